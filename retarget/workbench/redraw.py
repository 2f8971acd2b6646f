"""Key drawings corrected by hand: an SVG pulled into shape is a file of its own, the one that came stays as it is."""

from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from retarget.characters.drawings.paths import DrawnPath
from retarget.characters.models.meshfiles import MODELS

SMALL = 80  # pixels


def pulled(drawn: list[DrawnPath], at: NDArray, to: NDArray, reach: float) -> list[DrawnPath]:
    """The drawing with what is within `reach` pixels of a place pulled along to another, less and less."""
    made = []
    for path in drawn:
        away = np.linalg.norm(path.points - at, axis=1)
        share = np.where(away < reach, 0.5 + 0.5 * np.cos(np.pi * np.minimum(away / max(reach, 1e-9), 1)), 0.0)
        made.append(replace(path, points=path.points + share[:, None] * (to - at)))
    return made


def picture(file: Path, pull: tuple[NDArray, NDArray, float] | None = None) -> NDArray:
    """A drawing or picture (H, W, 4) on its own page; a drawing with a pull at it."""
    from retarget.stage import draw2d

    if file.suffix.lower() != ".svg":
        from retarget.characters.photos.photo import read_image

        return read_image(file)
    drawn, page = read(file, file.stat().st_mtime_ns)
    size = max(1, round(page[0])), max(1, round(page[1]))
    return draw2d.draw_things(pulled(drawn, *pull) if pull else drawn, size)


@lru_cache(maxsize=200)
def small(file: Path, changed: int) -> NDArray:
    """A drawing or picture (H, W, 4), at most SMALL pixels wide and high."""
    import cv2

    if file.suffix.lower() in MODELS:
        raise InputError(f"{file.name} is a model, it has no picture of its own: let it play to see it")
    whole = picture(file)
    share = min(SMALL / max(whole.shape[:2]), 1.0)
    size = max(1, round(whole.shape[1] * share)), max(1, round(whole.shape[0] * share))
    return cv2.resize(whole, size, interpolation=cv2.INTER_AREA)


def written(file: Path, pull: tuple[NDArray, NDArray, float]) -> Path:
    """The pulled drawing in a new file beside the old one."""
    from retarget.characters.drawings.svgout import write_keys

    if file.suffix.lower() != ".svg":
        raise InputError(f"only an SVG can be pulled into shape, {file.name} is none: drag its outline's points")
    drawn, page = read(file, file.stat().st_mtime_ns)
    stem, _, number = file.stem.rpartition(".edit")
    stem = stem if number.isdigit() else file.stem
    taken = {other.name for other in file.parent.iterdir()}
    name = next(name for n in range(1, 100_000) if (name := f"{stem}.edit{n}.svg") not in taken)
    write_keys([file.parent / name], [pulled(drawn, *pull)], page)
    return file.parent / name


@lru_cache(maxsize=8)
def read(file: Path, changed: int) -> tuple[list[DrawnPath], tuple[float, float]]:
    """An SVG's paths, and its page's width and height."""
    from retarget.characters.drawings.svg import read_page, read_svg

    return read_svg(file)[0], read_page(file)[0]
