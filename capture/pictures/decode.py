"""Open any clip: a video, an animated picture, a folder of pictures, a sprite sheet or a single picture."""

import math
import os
from dataclasses import replace
from pathlib import Path

import numpy as np

from capture.errors import InputError
from capture.pictures import movies, stills
from capture.pictures.clip import Clip, trim


def read_clip(
    path: str | os.PathLike,
    *,
    start: int = 0,
    stop: int | None = None,
    tile: tuple[int, int] | None = None,
    fps: float | None = None,
) -> Clip:
    """Open a video, an animated GIF, PNG or WebP, a folder of pictures, a sprite sheet, or a single picture.

    Frames start..stop (stop exclusive) are kept.  `tile` is the (width, height) of a sprite in a sheet, read
    row by row.  `fps` replaces the source's own timing; pictures without any play at 24 frames a second.
    """
    source = Path(path)
    if fps is not None and not (math.isfinite(fps) and fps > 0):
        raise InputError(f"the frame rate must be above 0, it is {fps}; give frames a second, such as 24")
    clip = _read(source, tile)
    if fps is not None:
        clip = replace(clip, fps=float(fps), edges=np.arange(len(clip) + 1) / fps)
    return trim(clip, start, stop)


def _read(source: Path, tile: tuple[int, int] | None) -> Clip:
    if not source.exists():
        raise InputError(f"{source}: the clip must exist, there is no such file; check its name")
    if source.is_dir():
        if tile is not None:
            raise InputError(f"{source}: a tile needs a single picture, this is a folder; leave the tile out")
        return stills.read_folder(source)
    if not os.access(source, os.R_OK):
        raise InputError(f"{source}: the clip must be readable, it is not; change its permissions")
    if source.stat().st_size == 0:
        raise InputError(f"{source}: a clip must hold frames, this file is empty (0 bytes); make it again")
    if stills.is_picture(source):
        return stills.read_picture(source, tile)
    if tile is not None:
        raise InputError(f"{source}: a tile needs a single picture, this is none; leave the tile out")
    return movies.read_video(source)
