"""Frames of the clip as the page gets them: encoded once, and the latest kept."""

from functools import lru_cache
from pathlib import Path
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.pictures.clip import Clip
from capture.pictures.decode import read_clip
from capture.pictures.shot import Shot
from retarget.workbench.desks import Seen

QUALITY = 90  # of JPEG: ink stays clean
KEPT = 600  # encoded frames: 25 s of a clip, some 30 MB

_decoding = Lock()  # a decoder is for one thread at a time


def clip_of(shot: Shot) -> Clip:
    """The whole clip of a shot; its frames are the ones that the shot counts in."""
    return _opened(shot.clip, shot.fps, shot.tile, _changed(shot.clip))


def frame(shot: Shot, number: int) -> NDArray:
    """A frame (H, W, 3 | 4) of the clip, from any thread."""
    clip = clip_of(shot)
    if not 0 <= number < len(clip):
        raise InputError(f"the clip has frames 0 to {len(clip) - 1}, there is no frame {number}")
    with _decoding:
        return np.asarray(clip[number])


def encoded(shot: Shot, number: int) -> Seen:
    """A frame as a JPEG, or as a PNG where it has alpha."""
    return _encoded(shot.clip, shot.fps, shot.tile, _changed(shot.clip), number)


def png(picture: NDArray) -> bytes:
    """A picture (H, W, 3 | 4) uint8 as a PNG, packed quickly rather than small."""
    return _packed(picture, ".png")


@lru_cache(maxsize=2)
def _opened(path: str, fps: float | None, tile: tuple[int, int] | None, changed: int) -> Clip:
    return read_clip(path, tile=tile, fps=fps)


@lru_cache(maxsize=KEPT)
def _encoded(path: str, fps: float | None, tile: tuple[int, int] | None, changed: int, number: int) -> Seen:
    picture = frame(Shot(path, fps=fps, tile=tile), number)
    kind = "png" if picture.shape[2] == 4 else "jpeg"
    return Seen(f"image/{kind}", _packed(picture, f".{kind}"))


def _packed(picture: NDArray, suffix: str) -> bytes:
    import cv2

    order = cv2.COLOR_RGBA2BGRA if picture.shape[2] == 4 else cv2.COLOR_RGB2BGR
    options = [cv2.IMWRITE_PNG_COMPRESSION, 1] if suffix == ".png" else [cv2.IMWRITE_JPEG_QUALITY, QUALITY]
    done, data = cv2.imencode(suffix, cv2.cvtColor(picture, order), options)
    if not done:
        raise InputError("a frame could not be packed for the page: it may be too large")
    return data.tobytes()


def _changed(path: str) -> int:
    """When a clip's file was last written: another clip under the same name is another clip."""
    return Path(path).stat().st_mtime_ns if Path(path).exists() else 0
