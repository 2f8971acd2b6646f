"""Curves from SVG drawings: a folder with one drawing a frame, or one file with one path a frame.

SVG puts (0, 0) at the corner of the first pixel, we at its centre: half a unit is taken off.
"""

import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError

Found = tuple[list[NDArray], bool, float]  # curves, closed, fps: as the readers of contours.py give them


def read_folder(path: Path, name: str | None, closed: bool | None) -> Found:
    """One curve of each drawing in a folder, in the order of the numbers in their names: `name`, or the longest."""
    files = sorted((p for p in path.iterdir() if p.suffix.lower() == ".svg" and not p.name.startswith(".")), key=_order)
    if not files:
        raise InputError(
            f"{path}: a folder of contours must hold SVG drawings, one for each frame, this has none: fill it"
        )
    chosen = []
    for file in files:
        curves = _curves(file)
        if name is not None and name not in [one[0] for one in curves]:
            known = ", ".join(one[0] for one in curves if one[0]) or "none"
            raise InputError(
                f"{file} must hold a path with the id {name!r}, its ids are {known}: name it in every drawing"
            )
        some = [one for one in curves if name is None or one[0] == name]
        chosen.append(max(some, key=lambda one: _length(one[1])))
    return [one[1] for one in chosen], _all_closed([one[2] for one in chosen], closed, path), 24.0


def read_file(path: Path, closed: bool | None) -> Found:
    """Every path of one drawing is a frame, in the order in which they are drawn."""
    curves = _curves(path)
    return [one[1] for one in curves], _all_closed([one[2] for one in curves], closed, path), 24.0


def _curves(path: Path) -> list[tuple[str, NDArray, bool]]:
    """The id, points (n, 2) and closedness of every shape's longest piece."""
    from svgelements import SVG, Shape
    from svgelements import Path as SvgPath

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            document = SVG.parse(str(path), reify=True, ppi=96)
    except OSError as error:
        raise InputError(f"a drawing must be a file that can be read: {path} ({error.strerror})") from None
    except Exception as error:  # the parser raises whatever its guess ran into
        raise InputError(f"{path} must be an SVG drawing, it cannot be understood: {error!r}") from None
    found = []
    for element in document.elements():
        if not isinstance(element, Shape) or element.values.get("visibility") in ("hidden", "collapse"):
            continue
        pieces = [_piece(piece) for piece in SvgPath(element).as_subpaths()]
        pieces = [(points, closed or _filled(element)) for points, closed in pieces if len(points) > 1]
        if pieces:
            points, closed = max(pieces, key=lambda piece: _length(piece[0]))
            found.append((element.id or "", points - 0.5, closed))
    if not found:
        raise InputError(f"{path} must hold at least one path, there is none: draw the contour as a path")
    return found


def _piece(piece: Any) -> tuple[NDArray, bool]:
    """One subpath as points (n, 2), curves by a point every two units or so, and whether it comes back."""
    from svgelements import Close, Line, Move

    points, closed = [], False
    for segment in piece:
        if isinstance(segment, Close):
            closed = True
        elif isinstance(segment, Move | Line):
            points.append((segment.end.x, segment.end.y))
        else:
            rough = np.array([(p.x, p.y) for p in (segment.point(s) for s in np.linspace(0, 1, 9))])
            count = int(np.clip(np.ceil(_length(rough) / 2), 4, 400))
            points += [(p.x, p.y) for p in (segment.point(s) for s in np.linspace(0, 1, count + 1)[1:])]
    points = np.array(points, float).reshape(-1, 2)
    if len(points) > 3 and np.linalg.norm(points[0] - points[-1]) < 1e-6 * max(_length(points), 1):
        points, closed = points[:-1], True
    return points, closed


def _filled(element: Any) -> bool:
    """Whether the shape is painted inside, which closes it for the eye; a bare path counts as a line."""
    fill = element.values.get("fill")
    return fill is not None and str(fill) != "none"


def _length(points: NDArray) -> float:
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def _all_closed(found: list[bool], told: bool | None, path: Path) -> bool:
    if told is not None:
        return told
    if len(set(found)) > 1:
        odd = found.index(not found[0])
        raise InputError(
            f"{path}: all contours must be closed or all open, the first is {'closed' if found[0] else 'open'}, that "
            f"of frame {odd} is not: mend it, or say closed=True or closed=False"
        )
    return found[0]


def _order(path: Path) -> tuple:
    """frame2 before frame10."""
    words = re.split(r"(\d+)", path.stem.lower())
    return tuple(int(word) if k % 2 else word for k, word in enumerate(words)), path.name
