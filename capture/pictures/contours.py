"""Contours as a clip's input: one curve for every frame, from JSON, CSV, SVG or mattes; point counts may differ.

JSON is ours to write: {"frames": [[[x, y], ...], ...], "closed": true, "fps": 24}.  What other programs and hands
write is read too.  A frame that a file leaves out holds the drawing before it, as on an exposure sheet.
"""

import csv
import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capture.errors import InputError
from capture.files import written_beside
from capture.pictures import matte

FRAMES = ("frames", "contours", "outlines", "curves")  # what a JSON file may call its list of curves
POINTS = ("points", "contour", "outline", "curve", "path", "vertices")


@dataclass(frozen=True, eq=False)
class Contours:
    """One curve a frame, in pixels; `make` sees that they are sound."""

    curves: tuple[NDArray, ...]  # T of (n_t, 2), a closed one without its first point again at the end
    closed: bool
    fps: float = 24.0

    def __len__(self) -> int:
        return len(self.curves)


def make(
    curves: Iterable[ArrayLike],
    closed: bool = True,
    fps: float = 24.0,
    source: str = "the contours",
    crossing: bool = False,
) -> Contours:
    """Contours of curves (n_t, 2), each checked; points that come twice in a row are taken once.

    `crossing` lets outlines through that cross themselves, as where a leg folds over its own body.
    """
    sound = tuple(checked(curve, closed, f"{source}, frame {t}", crossing) for t, curve in enumerate(curves))
    if not sound:
        raise InputError(f"{source} must hold a curve for at least one frame, there is none: draw one")
    if not (np.isfinite(fps) and fps > 0):
        raise InputError(f"{source}: frames a second must be a positive number, got {fps}; give fps=24, say")
    return Contours(sound, bool(closed), float(fps))


def read_contours(
    path: str | Path, closed: bool | None = None, name: str | None = None, crossing: bool = False
) -> Contours:
    """Contours from a JSON or CSV file, a folder of SVG drawings (one a frame) or one SVG with a path a frame.

    `closed` overrules what the file says; where it says nothing, curves are closed.  In a folder of SVGs the path
    whose id is `name` is taken, or the longest; their unit is a pixel.  A CSV has columns frame, x, y, perhaps point.
    """
    from capture.pictures import svgcurves

    path = Path(path)
    readers = {".json": _read_json, ".csv": _read_csv, ".svg": lambda p: svgcurves.read_file(p, closed)}
    if path.is_dir():
        curves, found, fps = svgcurves.read_folder(path, name, closed)
    elif path.suffix.lower() in readers:
        try:
            curves, found, fps = readers[path.suffix.lower()](path)
        except OSError as error:
            raise InputError(f"contours must be in a file that can be read: {path} ({error.strerror})") from None
        except (UnicodeDecodeError, RecursionError) as error:
            raise InputError(f"{path} must be a text file of contours, it cannot be read: {error}") from None
    else:
        raise InputError(
            f"contours must be a .json, .csv or .svg file or a folder of SVGs, got {path}: convert it first"
        )
    return make(curves, found if closed is None else closed, fps, str(path), crossing)


def write_contours(contours: Contours, path: str | Path) -> None:
    """Write JSON that `read_contours` reads back exactly."""
    values = {"closed": contours.closed, "fps": contours.fps, "frames": [curve.tolist() for curve in contours.curves]}
    with written_beside(path) as beside:
        beside.write_text(json.dumps(values) + "\n", encoding="utf-8")


def contours_of_mattes(mattes: Iterable[NDArray], step: float = 1.0, fps: float = 24.0) -> Contours:
    """The longest outline of every matte (H, W), 0-1 or a mask 0-255, traced sub-pixel, a point every `step` pixels."""
    curves = []
    for t, alpha in enumerate(mattes):
        alpha = np.asarray(alpha)
        if alpha.ndim != 2 or not np.isfinite(alpha).all():
            raise InputError(
                f"the matte of frame {t} must be one channel of finite numbers, got shape {alpha.shape}: cut it again"
            )
        alpha = alpha.astype(float) / (255 if alpha.max(initial=0) > 2 else 1)
        if alpha.max(initial=0) <= 0.5:
            raise InputError(
                f"a matte must hold something to be traced, that of frame {t} is empty: choose another box or colour"
            )
        curves.append(matte.trace(alpha, step))
    return make(curves, True, fps, "the mattes")


def checked(curve: ArrayLike, closed: bool, name: str, crossing: bool = False) -> NDArray:
    """The curve (n, 2) as an array, without points that repeat the one before; anything that is no curve is refused."""
    try:
        curve = np.array(curve, float)
    except (TypeError, ValueError):
        raise InputError(f"{name}: a curve must be a list of points [x, y], this is none: write it as such") from None
    if curve.ndim != 2 or curve.shape[1] != 2:
        raise InputError(
            f"{name}: a curve must be a list of points [x, y], got an array of shape {curve.shape}: write it as such"
        )
    if not np.isfinite(curve).all():
        bad = int(np.flatnonzero(~np.isfinite(curve).all(axis=1))[0])
        raise InputError(f"{name}: points must be finite numbers, point {bad} holds NaN or infinity: draw it again")
    if len(curve) and (curve == curve[0]).all():
        raise InputError(f"{name}: a curve must lead somewhere, all its {len(curve)} points are equal: draw it again")
    repeats = np.append(False, (curve[1:] == curve[:-1]).all(axis=1))
    kept = curve[~repeats]
    if closed and len(kept) > 1 and (kept[0] == kept[-1]).all():
        kept = kept[:-1]
    least = 3 if closed else 2
    if len(kept) < least:
        kind = "a closed outline" if closed else "an open curve"
        raise InputError(f"{name}: {kind} needs at least {least} different points, got {len(kept)}: draw it again")
    if closed and not crossing:
        _check_simple(kept, name)
    return kept


def signed_area(outline: ArrayLike) -> float:
    """The area inside a closed outline (n, 2), positive where it runs clockwise on the screen (y down)."""
    x, y = np.asarray(outline, float).T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def arcs(curve: NDArray, closed: bool) -> NDArray:
    """How far along the curve (n, 2) each point lies, in pixels; closed: and the whole length at the end (n + 1,)."""
    path = np.vstack([curve, curve[:1]]) if closed else curve
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])


def evenly(curve: NDArray, count: int, closed: bool) -> NDArray:
    """`count` points at equal distances along a curve (n, 2), from its first point on (to its last, if it is open)."""
    along = arcs(curve, closed)
    path = np.vstack([curve, curve[:1]]) if closed else curve
    at = np.linspace(0, along[-1], count, endpoint=not closed)
    return np.stack([np.interp(at, along, axis) for axis in path.T], axis=-1)


def _check_simple(outline: NDArray, name: str) -> None:
    """Refuse an outline that crosses itself, and say where."""
    import shapely

    polygon = shapely.Polygon(outline)
    if polygon.is_valid and polygon.area > 1e-9:
        return
    if polygon.area <= 1e-9 and np.linalg.matrix_rank(outline - outline[0], tol=1e-6) < 2:
        raise InputError(
            f"{name}: a closed outline must hold an area, its points lie on one line: open it or draw it again"
        )
    where = shapely.is_valid_reason(polygon).split("[")[-1].rstrip("]")
    raise InputError(
        f"{name}: a closed outline must not cross itself, this one does near ({where.replace(' ', ', ')}): "
        "draw it again as one simple loop"
    )


def _read_json(path: Path) -> tuple[list[Any], bool, float]:
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
    except json.JSONDecodeError as error:
        raise InputError(f"{path} must be JSON, it is not: {error}") from None
    table = values if isinstance(values, dict) else {}
    listed = next((table[key] for key in FRAMES if key in table), values if not table or _numbered(table) else None)
    if isinstance(listed, dict) and _numbered(listed):
        listed = [{"frame": int(key), "points": curve} for key, curve in listed.items()]
    if not isinstance(listed, list) or not listed:
        raise InputError(
            f'{path} must hold a list of frames, {{"frames": [[[x, y], ...], ...], "closed": true, "fps": 24}}, it '
            f"holds {', '.join(map(repr, table)) or 'none'}: write it so"
        )
    numbers = [_frame_number(frame, t, path) for t, frame in enumerate(listed)]
    curves = [_json_curve(frame) for frame in listed]
    closed = table.get("closed", table.get("is_closed", True))
    fps = table.get("fps", table.get("frame_rate", 24.0))
    if not isinstance(closed, bool) or isinstance(fps, bool) or not isinstance(fps, int | float):
        raise InputError(
            f'{path}: "closed" must be true or false and "fps" a number, got {closed!r} and {fps!r}: mend them'
        )
    return _exposed(dict(zip(numbers, curves)), len(curves), path), closed, float(fps)


def _numbered(table: dict) -> bool:
    return bool(table) and all(str(key).isdecimal() for key in table)


def _frame_number(frame: Any, t: int, path: Path) -> int:
    number = frame.get("frame", t) if isinstance(frame, dict) else t
    if isinstance(number, bool) or not isinstance(number, int):
        raise InputError(f"{path}: frames must be numbered by whole numbers, got {number!r}: mend it")
    return number


def _json_curve(frame: Any) -> Any:
    """The points of one frame: [x, y] or {"x": ..., "y": ...} in a list, alone or under a name, or lists of x and y."""
    if isinstance(frame, dict):
        if "x" in frame and "y" in frame and isinstance(frame["x"], list) and isinstance(frame["y"], list):
            return list(zip(frame["x"], frame["y"]))
        frame = next((frame[key] for key in POINTS if key in frame), None)
    if isinstance(frame, list) and frame and all(isinstance(point, dict) for point in frame):
        return [[point.get("x"), point.get("y")] for point in frame]
    return frame


def _read_csv(path: Path) -> tuple[list[Any], bool, float]:
    with path.open(newline="", encoding="utf-8-sig") as file:
        rows = [row for row in csv.reader(file) if any(cell.strip() for cell in row) and not row[0].startswith("#")]
    names = [cell.strip().lower() for cell in rows[0]] if rows else []
    if not {"frame", "x", "y"} <= set(names):
        raise InputError(
            f"{path}: the first line must name the columns frame, x, y (and point), got "
            f"{', '.join(names) or 'nothing'}: add it"
        )
    frame_at, x_at, y_at = (names.index(key) for key in ("frame", "x", "y"))
    point_at = names.index("point") if "point" in names else None
    frames: dict[int, list] = {}
    for number, row in enumerate(rows[1:], start=2):
        try:
            frame, x, y = int(row[frame_at]), float(row[x_at]), float(row[y_at])
            point = float(row[point_at]) if point_at is not None else len(frames.get(frame, ()))
        except (ValueError, IndexError):
            raise InputError(
                f"{path}: a line must hold a frame number, x and y, line {number} is {','.join(row)!r}: mend it"
            ) from None
        frames.setdefault(frame, []).append((point, x, y))
    curves = {
        frame: [point[1:] for point in sorted(points, key=lambda one: one[0])] for frame, points in frames.items()
    }
    return _exposed(curves, len(curves), path), True, 24.0


def _exposed(curves: dict[int, Any], count: int, path: Path) -> list[Any]:
    """Curves by frame number as a list from the first to the last; a number left out holds the drawing before it."""
    if len(curves) != count:
        raise InputError(f"{path}: every frame must be there once, a number comes twice: number the frames anew")
    if not curves:
        return []
    first, last = min(curves), max(curves)
    if last - first > 100 * count:
        raise InputError(
            f"{path}: frame numbers must follow each other, {count} frames are numbered {first} to {last}: mend them"
        )
    shown, held = [], None
    for frame in range(first, last + 1):
        held = curves.get(frame, held)
        shown.append(held)
    return shown
