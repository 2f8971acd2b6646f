"""Which point of one contour is which point of another: by turning and arc length, warped by dynamic programming.

A contour says where its curve runs, not which of its points is the tip of the nose.  Corners are recognised by how
the curve turns there, at several scales, which no move, turn or size changes; between corners lengths should
stretch evenly.  After a first warp an affine fit lays one curve on the other, and tangents and places are compared too.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capture.errors import InputError
from capture.fit.curves import monotone
from capture.motion import affine
from capture.pictures.contours import Contours, arcs, checked, evenly, make, signed_area

Pin = tuple[ArrayLike, ArrayLike]
"""A place of the source and the target's that belongs to it, each an index or a point (x, y) near the curve."""

SCALES = (0.015, 0.03, 0.06, 0.1)  # of the curve's length: over how much of it a turning is measured
TURNING, DIRECTION, PLACE = 0.5, 0.15, 12.0  # after the affine fit: squared radians, unit vectors, curve lengths
TIE, NEIGHBOURS = 0.02, 5.0  # how far curves are known to lie alike: hardly, or as neighbouring frames do
DOUBT = 1.5  # starts that cost at most so much more than the best are looked at again
NODES = 96  # the least number of samples of a source


@dataclass(frozen=True, eq=False)
class Task:
    """One source to be laid along one target, both as samples."""

    nodes: NDArray  # (N, 2) of the source
    target: NDArray  # (M, 2) at equal distances, the same way round
    closed: bool
    near: float  # of squared distances in curve lengths: how far both are known to lie alike
    pins: NDArray  # (Q, 2) node and place on the target in samples, increasing in both
    reference: NDArray  # (N, 2) the nodes in the drawing whose lengths count, and whose looks count as well
    laid: bool = False  # the two lie on each other as they are; else about their middles, in curve lengths


def match(
    source: ArrayLike, target: ArrayLike, closed: bool = True, pins: Sequence[Pin] = (), laid: float = 0.0
) -> NDArray:
    """For each point of source (n, 2) its place on target (m, 2), as positions (n,): 2.25 is a quarter past point 2.

    The curves may be moved, turned, scaled and bent against each other, of different point counts, either way
    round and with any start; an open curve's ends stay ends.  Where they are laid on each other already, such as two
    animals that stand alike, `laid` says how much their places are to count: 30, say.  Pins are obeyed exactly.
    Positions of a closed target lie in [0, m); `places` makes points of them.
    """
    source = checked(source, closed, "the source", crossing=True)
    target = checked(target, closed, "the target", crossing=True)
    along = arcs(source, closed)
    held = [(round(_index(a, source, closed)) % len(source), _index(b, target, closed)) for a, b in pins]
    even = np.linspace(0, along[-1], NODES, endpoint=not closed)
    nodes_at = np.unique(np.append(even, along[[a for a, _ in held]]))
    nodes = places(source, np.interp(nodes_at, along, np.arange(len(along))), closed)
    pinned = [(int(np.searchsorted(nodes_at, along[a])), b) for a, b in held]
    shares, reverse = _laid(nodes, nodes, target, closed, laid or TIE, pinned, "the target", laid > 0)
    if closed:
        nodes_at, shares = np.append(nodes_at, along[-1]), np.append(shares, shares[0] + 1)
    positions = _positions(np.interp(along[: len(source)], nodes_at, shares), target, closed, reverse)
    for a, b in held:
        positions[a] = b
    return positions


def align_all(
    contours: Contours | Sequence[ArrayLike],
    count: int = 100,
    pins: Mapping[int, Sequence[Pin]] | None = None,
    reference: int = 0,
    keys: Sequence[int] = (),
    closed: bool = True,
) -> NDArray:
    """All frames' contours as T outlines (T, count, 2), point n at the same place of the character in each.

    The reference frame's curve is spread into `count` points from its own first point on, a closed one clockwise on
    the screen.  Every other frame is matched with its neighbour on the way to the reference, and with the
    reference itself, so that small errors do not add up.  Frames in `keys`, and those with pins, are matched with the
    reference alone, and their neighbours with them.  A pin's first part is an index into the `count` points, or a
    point in the reference frame; it is obeyed exactly.
    """
    if not isinstance(contours, Contours):
        contours = make(contours, closed, crossing=True)
    pins = dict(pins or {})
    total, closed = len(contours), contours.closed
    anchors = sorted({int(frame) for frame in (reference, *keys, *pins)})
    if anchors[0] < 0 or anchors[-1] >= total:
        raise InputError(
            f"reference, keys and pins must name frames 0 to {total - 1}, got {anchors}: take one of those"
        )
    if count < 3:
        raise InputError(f"an outline needs at least 3 points, got count={count}: ask for more")
    first = contours.curves[reference]
    if closed and signed_area(first) < 0:
        first = np.vstack([first[:1], first[:0:-1]])
    pieces = -(-NODES // count)  # nodes to each of the `count` points
    rest = evenly(first, pieces * count if closed else pieces * (count - 1) + 1, closed)
    nodes = np.empty((total, *rest.shape))
    for t, neighbour in _order(total, anchors, reference):
        curve = contours.curves[t]
        if t == reference:
            nodes[t] = rest
        elif neighbour != reference and np.array_equal(curve, contours.curves[neighbour]):
            nodes[t] = nodes[neighbour]  # a held drawing
        else:
            held = _pins(pins.get(t, ()), rest[::pieces], curve, closed)
            pinned = [(a * pieces, b) for a, b in held]
            shares, reverse = _laid(nodes[neighbour], rest, curve, closed, NEIGHBOURS, pinned, f"frame {t}")
            nodes[t] = places(curve, _positions(shares, curve, closed, reverse), closed)
            for a, b in pinned:
                nodes[t, a] = places(curve, b, closed)
    return nodes[:, ::pieces]


def places(curve: ArrayLike, positions: ArrayLike, closed: bool = True) -> NDArray:
    """The points (..., 2) of a curve (m, 2) at fractional indices (...)."""
    curve, positions = np.asarray(curve, float), np.asarray(positions, float)
    return monotone.at(curve, positions.ravel(), closed).reshape(*positions.shape, 2)


def _order(total: int, anchors: list[int], reference: int) -> list[tuple[int, int]]:
    """Frames in the order in which they are matched, each with the frame it is matched with: the reference first."""
    pairs = [(anchor, reference) for anchor in sorted(anchors, key=lambda anchor: anchor != reference)]
    others = sorted(set(range(total)) - set(anchors), key=lambda t: min(abs(t - anchor) for anchor in anchors))
    for t in others:
        nearest = min(anchors, key=lambda anchor: abs(t - anchor))
        pairs.append((t, t - 1 if nearest < t else t + 1))
    return pairs


def _pins(pins: Sequence[Pin], source: NDArray, target: NDArray, closed: bool) -> list[tuple[int, float]]:
    """Pins as (index of the source, fractional index of the target)."""
    return [(round(_index(a, source, closed)) % len(source), _index(b, target, closed)) for a, b in pins]


def _index(place: ArrayLike, curve: NDArray, closed: bool) -> float:
    """The fractional index of a place on a curve (n, 2): of an index itself, or of the nearest point to (x, y)."""
    place = np.asarray(place, float)
    last = len(curve) - (0 if closed else 1)
    if place.shape == () and 0 <= place <= last:
        return float(place) % len(curve)
    if place.shape != (2,) or not np.isfinite(place).all():
        raise InputError(
            f"a pin must give an index from 0 to {last} or a point (x, y) on each curve, got {place.tolist()}"
        )
    start, end = curve[:last], np.roll(curve, -1, axis=0)[:last]
    step = end - start
    part = np.clip(((place - start) * step).sum(axis=1) / (step**2).sum(axis=1), 0, 1)
    nearest = int(np.argmin(np.linalg.norm(start + part[:, None] * step - place, axis=1)))
    return float(nearest + part[nearest]) % (len(curve) if closed else np.inf)


def _laid(
    nodes: NDArray,
    reference: NDArray,
    target: NDArray,
    closed: bool,
    near: float,
    pins: list[tuple[int, float]],
    name: str,
    laid: bool = False,
) -> tuple[NDArray, bool]:
    """The nodes' shares (N,) of the target's length, increasing, and whether the target is gone along in reverse."""
    ways = [signed_area(nodes) * signed_area(target) < 0] if closed else [False, True]
    samples = monotone.FINER * len(nodes)
    found = []
    for reverse in ways:
        ordered = _ordered_pins(pins, target, closed, reverse, samples)
        if ordered is not None:
            even = evenly(target[::-1] if reverse else target, samples, closed)
            warp, cost = _solve(Task(nodes, even, closed, near, ordered, reference, laid))
            found.append((cost, warp / (samples if closed else samples - 1), reverse))
    if not found:
        raise InputError(
            f"{name}: pins must come in the same order along both curves, these do not: move one or leave it out"
        )
    _, shares, reverse = min(found, key=lambda one: one[0])
    return shares, reverse


def _ordered_pins(
    pins: list[tuple[int, float]], target: NDArray, closed: bool, reverse: bool, samples: int
) -> NDArray | None:
    """Pins (Q, 2) as node and place in samples, increasing in both; None if they cannot be."""
    if not pins:
        return np.zeros((0, 2))
    way = target[::-1] if reverse else target
    along = arcs(way, closed)
    index = np.array([b for _, b in pins])
    index = (len(way) - 1 - index) % len(way) if reverse and closed else len(way) - 1 - index if reverse else index
    place = np.interp(index, np.arange(len(along)), along) / along[-1] * (samples if closed else samples - 1)
    table = np.column_stack([[a for a, _ in pins], place])
    table = table[np.argsort(table[:, 0], kind="stable")]
    if closed:
        table[:, 1] = table[0, 1] + (table[:, 1] - table[0, 1]) % samples
    return table if (np.diff(table, axis=0) > 1e-9).all() else None


def _positions(shares: NDArray, target: NDArray, closed: bool, reverse: bool) -> NDArray:
    """Fractional indices of a target (m, 2) at shares (...) of its length."""
    way = target[::-1] if reverse else target
    along = arcs(way, closed)
    part = shares % 1 if closed else np.clip(shares, 0, 1)
    index = np.interp(part * along[-1], along, np.arange(len(along)))
    if reverse:
        index = len(way) - 1 - index
    return index % len(way) if closed else index


def _solve(task: Task) -> tuple[NDArray, float]:
    """Places on the target in samples (N,), increasing, for the nodes, and how ill they fit, on average."""

    def about(points: NDArray) -> NDArray:
        if task.laid:
            return np.sqrt(task.near) * points / arcs(task.target, task.closed)[-1]
        return np.sqrt(task.near) * (points - points.mean(axis=0)) / arcs(points, task.closed)[-1]

    upright = about(task.nodes), about(task.target)
    own = np.hstack([_turning(task.nodes, task.closed), upright[0]])
    other = np.hstack([_turning(task.target, task.closed), upright[1]])
    lengths = _steps(task.reference)
    if task.closed and not len(task.pins):
        rough = monotone.starts(own, other, lengths)
        laps = [monotone.lap(own, other, lengths, start, reach=2 * monotone.FINER) for start in rough]
        warps = [warp for warp, cost in laps if cost <= DOUBT * min(cost for _, cost in laps)]
    else:
        warps = [_spans(own, other, lengths, task)[0]]
    found = [_look_again(task, warp, upright if task.laid else None) for warp in warps]
    ills = [
        cost / len(warp) + float(((upright[0] - monotone.at(upright[1], warp, task.closed)) ** 2).sum(axis=1).mean())
        for warp, cost in found
    ]
    best = int(np.argmin(ills))
    return found[best][0], ills[best]


def _look_again(
    task: Task, warp: NDArray, upright: tuple[NDArray, NDArray] | None, rounds: int = 2
) -> tuple[NDArray, float]:
    """The warp (N,) improved, and its cost, by what can be seen when an affine fit lays both curves on each other.

    Places (N, 2) and (M, 2) that lie `upright` on each other as they are count besides.
    """
    size = arcs(task.target, task.closed)[-1]
    lying = upright or (np.empty((len(task.nodes), 0)), np.empty((len(task.target), 0)))
    other = np.hstack([*2 * [_looks(task.target, task.closed, size) / np.sqrt(2)], lying[1]])
    cost = np.inf
    for _ in range(rounds):
        goal = monotone.at(task.target, warp, task.closed)
        views = [affine.apply(affine.fit(view, goal), view) for view in (task.nodes, task.reference)]
        own = np.hstack([*(_looks(view, task.closed, size) / np.sqrt(2) for view in views), lying[0]])
        if task.closed and not len(task.pins):
            warp, cost = monotone.lap(own, other, _steps(views[1]), warp)
        else:
            warp, cost = _spans(own, other, _steps(views[1]), task)
    return warp, cost


def _steps(points: NDArray) -> NDArray:
    """Lengths (N,) from each point to the next, the last to the first."""
    return np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1) + 1e-9


def _spans(own: NDArray, other: NDArray, lengths: NDArray, task: Task) -> tuple[NDArray, float]:
    """The warp (N,) from pin to pin, and its cost; the ends of an open curve are pins too."""
    pins, count = task.pins, len(own)
    if task.closed:
        pins = np.vstack([pins, pins[0] + (count, len(other))])
    else:
        inner = pins[(pins[:, 0] > 0) & (pins[:, 0] < count - 1)]
        pins = np.vstack([[[0, 0]], inner, [[count - 1, len(other) - 1]]])
    warp, cost = np.empty(count), 0.0
    for (a, start), (b, end) in pairwise(pins):
        rows = np.arange(int(a), int(b) + 1)
        found, part = monotone.span(own[rows % count], other, lengths[rows[:-1] % count], start, end)
        warp[rows % count] = found - np.where(rows >= count, len(other), 0)
        cost += part
    return warp, cost


def _looks(points: NDArray, closed: bool, size: float) -> NDArray:
    """What is compared when both curves lie on each other: turnings, tangents and places (N, F)."""
    ahead = np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0)
    if not closed:
        ahead[0], ahead[-1] = points[1] - points[0], points[-1] - points[-2]
    tangent = ahead / np.maximum(np.linalg.norm(ahead, axis=1, keepdims=True), 1e-9)
    return np.hstack(
        [np.sqrt(TURNING) * _turning(points, closed), np.sqrt(DIRECTION) * tangent, np.sqrt(PLACE) * points / size]
    )


def _turning(points: NDArray, closed: bool, grid: int = 288) -> NDArray:
    """By how many radians the curve turns at each point (N, scales), measured over several lengths."""
    even, along = evenly(points, grid, closed), arcs(points, closed)
    columns = []
    for h in (max(1, round(scale * grid)) for scale in SCALES):
        if closed:
            long = np.vstack([even[-h:], even, even[:h]])
        else:  # beyond its ends a curve goes on as its own mirror image: it does not turn there
            long = np.vstack([2 * even[0] - even[h:0:-1], even, 2 * even[-1] - even[-2 : -h - 2 : -1]])
        before, after = even - long[:grid], long[2 * h :] - even
        cross = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
        columns.append(np.arctan2(cross, (before * after).sum(axis=1)))
    table = np.stack(columns, axis=-1) / np.sqrt(len(SCALES))
    index = along[: len(points)] / along[-1] * (grid if closed else grid - 1)
    return monotone.at(table, index, closed)
