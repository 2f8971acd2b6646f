"""Drawn paths: cubic Bezier curves with their paint, and what geometry asks of them.

Every outline, whatever command drew it, is held as cubic curves, so that a bend, a turn or a squash of a
drawing is nothing but new places for its control points.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from capture.motion import affine


@dataclass(frozen=True, eq=False)
class Gradient:
    """Colours along a line, t = x, or round a point, t = |(x, y)|, of a unit square laid onto the drawing."""

    offsets: NDArray  # (S,) where the stops sit, 0-1, rising
    colors: NDArray  # (S, 4) red, green, blue, alpha, 0-1, straight alpha
    place: NDArray  # (2, 3) from the unit square to the drawing
    focus: NDArray | None = None  # (2,) of a radial gradient, in the unit circle; None for a linear one
    spread: str = "pad"  # beyond the ends: pad, reflect or repeat


Paint = NDArray | Gradient | None
"""A colour (4,) red, green, blue, alpha 0-1, a gradient, or nothing."""


@dataclass(frozen=True, eq=False)
class DrawnPath:
    """One painted element of a drawing: subpaths of cubic curves that share their ends."""

    name: str  # what an error calls it
    commands: str  # as it was drawn, such as "MCCZ"; equal in all keys
    points: NDArray  # (N, 2) per subpath a start, then three control points for every curve
    starts: NDArray  # (S + 1,) where each subpath starts in points; the last is N
    closed: NDArray  # (S,) bool
    fill: Paint = None
    stroke: Paint = None
    width: float = 1.0  # of the stroke
    cap: str = "butt"  # butt, round or square
    join: str = "miter"  # miter, round or bevel
    dashes: tuple[float, ...] = ()  # lengths on, off, on, ...
    evenodd: bool = False
    opacity: float = 1.0
    within: tuple[str, ...] = ()  # its own id and those of the groups it lies in, as the file has them


def pieces(path: DrawnPath) -> NDArray:
    """The control points (C, 4, 2) of all curves of a path, subpath after subpath."""
    firsts = [np.arange(a, b - 1, 3) for a, b in zip(path.starts[:-1], path.starts[1:], strict=True)]
    return path.points[np.concatenate(firsts)[:, None] + np.arange(4)]


def along(curves: NDArray, at: NDArray) -> NDArray:
    """Points (C, A, 2) of cubic curves (C, 4, 2) at parameters (A,) in 0-1."""
    at = np.asarray(at, float)
    basis = np.stack([(1 - at) ** 3, 3 * at * (1 - at) ** 2, 3 * at**2 * (1 - at), at**3], axis=-1)
    return basis @ curves


def flatten(path: DrawnPath, steps: int = 8) -> list[NDArray]:
    """Each subpath as a polyline (L, 2), `steps` straight lines for every curve."""
    lines = along(pieces(path), np.arange(1, steps + 1) / steps)  # (C, steps, 2)
    counts = (np.diff(path.starts) - 1) // 3
    ends = np.cumsum(counts)
    firsts = path.points[path.starts[:-1]]
    return [
        np.vstack([first, lines[end - count : end].reshape(-1, 2)])
        for first, count, end in zip(firsts, counts, ends, strict=True)
    ]


def split(path: DrawnPath, counts: NDArray) -> DrawnPath:
    """The same curves, curve c cut into counts[c] of equal parameter (de Casteljau)."""
    curves, numbers = pieces(path), iter(range(len(counts)))
    points, starts = [], [0]
    for a, b in zip(path.starts[:-1], path.starts[1:], strict=True):
        points.append(path.points[a : a + 1])
        for number in [next(numbers) for _ in range((b - a - 1) // 3)]:
            points.append(_cut(curves[number], int(counts[number])))
        starts.append(sum(map(len, points)))
    return replace(path, points=np.vstack(points), starts=np.array(starts))


def _cut(curve: NDArray, count: int) -> NDArray:
    """Control points (3 count, 2) of one curve (4, 2) cut evenly, without its start."""
    if count == 1:
        return curve[1:]
    t0, t1 = np.arange(count) / count, np.arange(1, count + 1) / count

    def polar(a: NDArray, b: NDArray, c: NDArray) -> NDArray:
        """The curve's symmetric trilinear form (its blossom), which holds the control points of any cut."""
        level = [(1 - a)[:, None] * curve[i] + a[:, None] * curve[i + 1] for i in range(3)]
        level = [(1 - b)[:, None] * level[i] + b[:, None] * level[i + 1] for i in range(2)]
        return (1 - c)[:, None] * level[0] + c[:, None] * level[1]

    return np.stack([polar(t0, t0, t1), polar(t0, t1, t1), polar(t1, t1, t1)], axis=1).reshape(-1, 2)


def moved(path: DrawnPath, place: NDArray) -> DrawnPath:
    """The path moved by an affine map (2, 3); strokes and dashes scale with the square root of its area."""
    scale = float(np.sqrt(abs(np.linalg.det(place[:, :2]))))
    return replace(
        path,
        points=affine.apply(place, path.points),
        fill=carried(path.fill, place),
        stroke=carried(path.stroke, place),
        width=path.width * scale,
        dashes=tuple(length * scale for length in path.dashes),
    )


def carried(paint: Paint, place: NDArray) -> Paint:
    """A paint moved along with what it paints: a gradient goes through the map (2, 3), a colour stays."""
    return replace(paint, place=affine.compose(place, paint.place)) if isinstance(paint, Gradient) else paint


def windings(path: DrawnPath) -> NDArray:
    """Which subpaths (S,) of an even-odd path must be turned round for the non-zero rule to fill the same.

    Right for subpaths that do not cross: a ring inside an even number of others runs one way, the rest the
    other way.
    """
    import shapely

    turn = np.zeros(len(path.closed), bool)
    if not path.evenodd or len(turn) < 2:
        return turn
    rings = flatten(path)
    areas = np.array([_area(ring) for ring in rings])
    solids = [shapely.make_valid(shapely.Polygon(ring)) if len(ring) > 3 else shapely.Point(ring[0]) for ring in rings]
    inner = [solid.representative_point() for solid in solids]
    for number, point in enumerate(inner):
        around = [k for k, solid in enumerate(solids) if abs(areas[k]) > abs(areas[number]) and solid.contains(point)]
        turn[number] = (areas[number] > 0) == bool(len(around) % 2)
    return turn


def wound(path: DrawnPath, turn: NDArray) -> DrawnPath:
    """The path with the subpaths marked in `turn` (S,) run backwards; it now fills by the non-zero rule."""
    points = path.points.copy()
    for a, b in zip(path.starts[:-1][turn], path.starts[1:][turn], strict=True):
        points[a:b] = path.points[a:b][::-1]
    return replace(path, points=points, evenodd=False)


def _area(ring: NDArray) -> float:
    x, y = ring.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def painted(path: DrawnPath) -> object:
    """What the path covers, as one shapely shape without regard to holes."""
    import shapely

    lines = flatten(path)
    parts = []
    if path.fill is not None:
        rings = [shapely.Polygon(line) for line in lines if len(line) > 3]  # a scribble crosses itself a thousand times
        parts += [shapely.make_valid(ring, method="structure", keep_collapsed=False) for ring in rings]
    if path.stroke is not None:
        caps, joins = {"butt": "flat"}, {"miter": "mitre"}
        parts += [
            shapely.LineString(line).buffer(
                path.width / 2,
                cap_style=caps.get(path.cap, path.cap),
                join_style=joins.get(path.join, path.join),
                mitre_limit=2,
            )
            for line in lines
            if np.ptp(line, axis=0).max() > 0
        ]
    whole = [shapely.make_valid(part) for part in parts if part.area > 0]  # a mitred line may cross itself
    return shapely.union_all([part for part in whole if part.area > 0])
