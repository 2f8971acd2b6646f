"""Key drawings corrected by hand: an SVG is pulled into shape, or a stroke of it drawn anew.

What is made is a file of its own, the one that came stays as it is; and it has the same elements and curves, so that
control points still correspond to those of the other keys.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.fit.curves import correspond
from retarget.characters.drawings import paths
from retarget.characters.drawings.paths import DrawnPath
from retarget.characters.models.meshfiles import MODELS

SMALL = 80  # pixels

SAMPLES = 16  # places on each curve at which a stroke drawn anew is met
LIKE = 30.0  # how much the places of a stroke drawn all round count, besides its turnings, for what is where on it
WHOLE = 0.12  # of its length: a stroke whose ends are nearer than this to each other goes all round


def pulled(drawn: list[DrawnPath], at: NDArray, to: NDArray, reach: float) -> list[DrawnPath]:
    """The drawing with what is within `reach` pixels of a place pulled along to another, less and less."""
    made = []
    for path in drawn:
        away = np.linalg.norm(path.points - at, axis=1)
        share = np.where(away < reach, 0.5 + 0.5 * np.cos(np.pi * np.minimum(away / max(reach, 1e-9), 1)), 0.0)
        made.append(replace(path, points=path.points + share[:, None] * (to - at)))
    return made


def redrawn(drawn: list[DrawnPath], number: int, line: NDArray) -> list[DrawnPath]:
    """The drawing with a path drawn anew along a line (n, 2): from where on it the line begins to where it ends.

    A line that comes back to its beginning is a closed path's new whole.  The path keeps its curves, each in the same
    share of the new length as of the old, and what the line does not replace stays as it is.
    """
    if not 0 <= number < len(drawn):
        raise InputError(f"the drawing has {len(drawn)} strokes, counted from 0; there is no stroke {number}")
    path, line = drawn[number], _cleaned(line)
    part = min(range(len(path.closed)), key=lambda one: _away(_sampled(path, one), line))
    a, b = path.starts[part : part + 2]
    points = path.points.copy()
    points[a:b] = _refitted(points[a:b], bool(path.closed[part]), line)
    return [*drawn[:number], replace(path, points=points), *drawn[number + 1 :]]


def lines_of(file: Path) -> list[list[NDArray]]:
    """Every path's subpaths as polylines (L, 2): what a pen can catch."""
    return [paths.flatten(path) for path in read(file, file.stat().st_mtime_ns)[0]]


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


def check_svg(file: Path) -> None:
    """Refuse what is no SVG."""
    if file.suffix.lower() != ".svg":
        raise InputError(f"only an SVG can be redrawn, {file.name} is none: drag its outline's points")


def written(files: Sequence[Path], which: int, drawn: list[DrawnPath]) -> dict[int, Path]:
    """One key's new drawing in a new file beside the old one, by the number of its key.

    A drawing is written as cubic curves.  Where the other keys' files have lines or arcs in their place, those are
    written anew too, for keys must have the same commands.
    """
    from retarget.characters.drawings.svg import read_svg
    from retarget.characters.drawings.svgout import write_keys

    versions, pages = map(list, zip(*(read(file, file.stat().st_mtime_ns) for file in files), strict=True))
    versions[which] = drawn
    new = _names(files)

    def write(number: int) -> None:
        write_keys([new[k] if k == number else None for k in range(len(files))], versions, pages[number])

    write(which)
    told = _build(read_svg(new[which])[0])
    if all(_build(version) == told for k, version in enumerate(versions) if k != which):
        return {which: new[which]}
    for number in range(len(files)):
        if number != which:
            write(number)
    return dict(enumerate(new))


@lru_cache(maxsize=8)
def read(file: Path, changed: int) -> tuple[list[DrawnPath], tuple[float, float]]:
    """An SVG's paths, and its page's width and height."""
    from retarget.characters.drawings.svg import read_page, read_svg

    check_svg(file)
    return read_svg(file)[0], read_page(file)[0]


def is_edit(file: Path) -> bool:
    """Whether a file is a key that was corrected here, a version of another."""
    stem, _, number = file.stem.rpartition(".edit")
    return bool(stem) and number.isdigit()


def _names(files: Sequence[Path]) -> list[Path]:
    """A name that is free for each key's next version, NAME.edit1.svg."""
    new: list[Path] = []
    for file in files:
        stem = file.stem.rpartition(".edit")[0] if is_edit(file) else file.stem
        taken = {other.name for other in (*file.parent.iterdir(), *new)}
        new.append(file.parent / next(name for n in range(1, 100_000) if (name := f"{stem}.edit{n}.svg") not in taken))
    return new


def _build(drawn: list[DrawnPath]) -> list[tuple[str, tuple[int, ...]]]:
    """What must be the same in all keys."""
    return [(path.commands, tuple(path.starts.tolist())) for path in drawn]


def _cleaned(line: NDArray) -> NDArray:
    """A line without places that it stands still at."""
    line = np.asarray(line, float)
    line = line[np.append(True, np.abs(np.diff(line, axis=0)).max(axis=1) > 1e-6)]
    if len(line) < 3:
        raise InputError("a stroke must be drawn over some way, this one stands still: drag along the new line")
    return line


def _sampled(path: DrawnPath, part: int) -> NDArray:
    a, b = path.starts[part : part + 2]
    return _places(path.points[a:b])[0].reshape(-1, 2)


def _places(points: NDArray) -> tuple[NDArray, NDArray]:
    """Places (C, S + 1, 2) on the curves of a subpath, and at which parameters (S + 1,)."""
    curves = points[np.arange(0, len(points) - 1, 3)[:, None] + np.arange(4)]
    at = np.linspace(0, 1, SAMPLES + 1)
    return paths.along(curves, at), at


def _away(places: NDArray, line: NDArray) -> float:
    """How far a line's ends lie from places (n, 2)."""
    return sum(np.linalg.norm(places - end, axis=1).min() for end in line[[0, -1]])


def _refitted(points: NDArray, closed: bool, line: NDArray) -> NDArray:
    """A subpath's control points with a stretch of it laid along a line."""
    places, at = _places(points)
    count = len(places) * SAMPLES
    flat = np.concatenate([places[:, :-1].reshape(-1, 2), places[-1:, -1]])  # (count + 1, 2), the last on the first
    new = flat.copy()
    if closed and np.linalg.norm(line[-1] - line[0]) < WHOLE * _lengths(line)[-1]:
        at_line = correspond.match(flat[:-1], line, closed=True, laid=LIKE)
        new[:-1] = correspond.places(line, at_line)
        new[-1] = new[0]
    else:
        first, last = (int(np.linalg.norm(flat - end, axis=1).argmin()) for end in line[[0, -1]])
        ways = [np.arange(first, last + 1)] if first <= last else [np.arange(first, last - 1, -1)]
        if closed:  # the other way round
            first, last = first % count, last % count
            ways = [np.arange(first, first + (last - first) % count + 1) % count]
            ways.append(np.arange(first, first - (first - last) % count - 1, -1) % count)
        chosen = min((way for way in ways if len(way) > 1), key=lambda way: _apart(flat[way], line), default=None)
        if chosen is None:
            raise InputError("a stroke must run along the line that it replaces: begin and end it on that, apart")
        laid = _laid(flat[chosen], line)
        share = (_lengths(flat[chosen]) / max(_lengths(flat[chosen])[-1], 1e-12))[:, None]
        new[chosen] = laid + (1 - share) * (flat[chosen[0]] - laid[0]) + share * (flat[chosen[-1]] - laid[-1])
        if closed:
            new[count] = new[0]
    moved = np.linalg.norm(new - flat, axis=1) > 1e-9
    made = points.copy()
    for c in range(len(places)):
        own = slice(c * SAMPLES, (c + 1) * SAMPLES + 1)
        if moved[own].any():
            made[3 * c : 3 * c + 4] = _cubic(new[own], at)
    return made


def _laid(old: NDArray, line: NDArray) -> NDArray:
    """Old places (n, 2) where they come to lie on a line, each in the same share of the length."""
    share, along = _lengths(old), _lengths(line)
    share = share / max(share[-1], 1e-12) * along[-1]
    return np.stack([np.interp(share, along, line[:, axis]) for axis in (0, 1)], axis=-1)


def _lengths(line: NDArray) -> NDArray:
    return np.append(0.0, np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1)))


def _apart(way: NDArray, line: NDArray) -> float:
    return float(np.linalg.norm(way - _laid(way, line), axis=1).mean())


def _cubic(places: NDArray, at: NDArray) -> NDArray:
    """The control points (4, 2) of the curve that is nearest to places (S, 2), which begin at parameters (S,)."""
    ends, fine = places[[0, -1]], np.linspace(0, 1, 200)
    for _ in range(6):
        basis = np.stack([(1 - at) ** 3, 3 * at * (1 - at) ** 2, 3 * at**2 * (1 - at), at**3], axis=-1)
        inner = np.linalg.lstsq(basis[:, 1:3], places - basis[:, [0, 3]] @ ends, rcond=None)[0]
        curve = np.stack([ends[0], inner[0], inner[1], ends[1]])
        drawn = paths.along(curve[None], fine)[0]
        at = np.maximum.accumulate(fine[np.linalg.norm(drawn[None] - places[:, None], axis=-1).argmin(axis=1)])
        at[[0, -1]] = 0, 1  # where a place lies on the curve, not where it lay on the old one
    return curve
