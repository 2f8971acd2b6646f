"""At most J weights, exactly: least squares over many small supports, of which a bound rules out nearly all.

For a support (a few rows) the misfit under sum 1 alone is a distance to a flat, known in closed form for all
frames and supports at once.  It is a lower bound of the misfit with bounded weights.  So supports are tried from
the lowest of these on, and those that lie above what has been reached are never solved.  Nothing is thrown away
to reach the number J: keeping the J largest weights of a dense fit gives another, worse answer.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

TABLE = 4_000_000  # numbers in the largest array: long clips with many supports are cut into pieces of frames


@dataclass(frozen=True, eq=False)
class Problem:
    """Least squares sum_t |v_t - w_t S|^2 as inner products: what a frame costs no longer depends on N.

    All is in units of `unit`, the mean square of a row about the rows' mean.
    """

    gram: NDArray  # (D, D) S S'
    cross: NDArray  # (T, D) V S'
    power: NDArray  # (T,) |v_t|^2
    unit: float


@dataclass(frozen=True, eq=False)
class Supports:
    """C sets of rows that may be mixed, each of at most J rows."""

    rows: NDArray  # (C, J) int, the first `size` of them count
    size: NDArray  # (C,) int

    @property
    def by_size(self) -> list[tuple[NDArray, NDArray]]:
        """Numbers (n,) and rows (n, size) of the supports of each size."""
        groups = [np.flatnonzero(self.size == size) for size in np.unique(self.size)]
        return [(members, self.rows[members, : self.size[members[0]]]) for members in groups]


def problem(tracked: NDArray, shapes: NDArray) -> Problem:
    """Inner products of T shapes (T, ...) and D rows (D, ...), about the rows' mean: sum 1 leaves that free."""
    centre = shapes.mean(axis=0)
    s = (shapes - centre).reshape(len(shapes), -1)
    v = (tracked - centre).reshape(len(tracked), -1)
    unit = max(float((s**2).sum()) / len(s), 1e-12)
    return Problem(s @ s.T / unit, v @ s.T / unit, (v**2).sum(axis=1) / unit, unit)


def as_supports(lists: list[list[int]]) -> Supports:
    """Supports from lists of rows."""
    size = np.array([len(rows) for rows in lists])
    table = np.zeros((len(lists), size.max()), int)
    for line, rows in zip(table, lists):
        line[: len(rows)] = rows
    return Supports(table, size)


def best_weights(given: Problem, supports: Supports, bounds: tuple[float, float], simpler: float = 1.0) -> NDArray:
    """Weights (T, D) of the support with the least score in each frame."""
    number, _ = best_supports(given, supports, bounds, simpler)
    return weights_on(given, supports, number[:, 0], bounds)[0]


def weights_on(
    given: Problem, supports: Supports, number: NDArray, bounds: tuple[float, float]
) -> tuple[NDArray, NDArray]:
    """Weights (T, D) on the support `number` (T,) of each frame, and their gaps (T,)."""
    weights, gap = np.zeros(given.cross.shape), np.empty(len(number))
    for members, _ in supports.by_size:
        frames = np.flatnonzero(np.isin(number, members))
        rows = supports.rows[number[frames], : supports.size[members[0]]]
        weights[frames[:, None], rows], gap[frames] = solve(given, frames, rows, bounds)
    return weights, gap


def best_supports(
    given: Problem, supports: Supports, bounds: tuple[float, float], simpler: float = 1.0, few: int = 1
) -> tuple[NDArray, NDArray]:
    """Numbers and scores (T, few) of each frame's best supports, best first; score = gap * simpler^(2 size)."""
    flats = [(members, rows, *_flat(given.gram, rows)) for members, rows in supports.by_size]
    few, step = min(few, len(supports.size)), max(1, TABLE // supports.rows.size)
    found = []
    for at in range(0, len(given.cross), step):
        cross, power = given.cross[at : at + step], given.power[at : at + step]
        part = Problem(given.gram, cross, power, given.unit)
        gap = np.empty((len(cross), len(supports.size)))
        for members, rows, offset, root in flats:
            gap[:, members] = _distances(part, rows, offset, root).T
        found.append(_search(part, supports, score(gap, supports.size, simpler), bounds, simpler, few))
    return np.concatenate([number for number, _ in found]), np.concatenate([score for _, score in found])


def score(gap: NDArray, size: NDArray, simpler: float) -> NDArray:
    """What supports are compared by; the slack keeps nought from passing for better than nearly nought."""
    return (gap + 1e-9) * simpler ** (2.0 * size)


def solve(given: Problem, frames: NDArray, rows: NDArray, bounds: tuple[float, float]) -> tuple[NDArray, NDArray]:
    """Weights (n, J) and gaps (n,) of n pairs of a frame (n,) and the rows (n, J) it may use; sum 1, in bounds.

    A weight that breaks a bound is held there, and the others are solved again.  If several break theirs, each in turn:
    of a convex misfit, the best point within lies on a side that the best point without lies beyond.
    """
    gram = given.gram[rows[:, :, None], rows[:, None, :]] + 1e-12 * np.eye(rows.shape[1])  # equal rows share alike
    cross = given.cross[frames[:, None], rows]
    low, high = bounds
    best, weights = np.full(len(rows), np.inf), np.zeros(rows.shape)
    pair, held = np.arange(len(rows)), np.full(rows.shape, np.nan)  # what a weight is held at; NaN: it is free
    while len(pair):
        found = _on_face(gram[pair], cross[pair], held)
        gap = ((gram[pair] @ found[..., None])[..., 0] * found - 2 * found * cross[pair]).sum(axis=1)
        hopeful = (gap < best[pair]) & (np.abs(found.sum(axis=1) - 1) < 1e-9)
        under, over = found < low - 1e-10, found > high + 1e-10
        broken = (under | over) & np.isnan(held)
        inside = np.flatnonzero(hopeful & ~broken.any(axis=1))
        inside = inside[np.argsort(-gap[inside], kind="stable")]  # of one pair's faces the last, the best, stays
        best[pair[inside]], weights[pair[inside]] = gap[inside], found[inside]
        face, breaker = np.nonzero(broken & hopeful[:, None])
        now_held = held[face]
        now_held[np.arange(len(face)), breaker] = np.where(under[face, breaker], low, high)
        left, free = 1 - np.nansum(now_held, axis=1), np.isnan(now_held).sum(axis=1)
        possible = (left >= free * low - 1e-9) & (left <= free * high + 1e-9)
        pair, held = pair[face][possible], now_held[possible]
    return weights, np.maximum(best + given.power[frames], 0)


def _search(
    given: Problem, supports: Supports, least: NDArray, bounds: tuple[float, float], simpler: float, few: int
) -> tuple[NDArray, NDArray]:
    """Numbers and scores (T, few), trying supports in the order of the `least` score (T, C) each could have."""
    number, best = np.zeros((len(least), few), int), np.full((len(least), few), np.inf)
    left, busy, take = least.copy(), np.arange(len(least)), few
    while len(busy):
        tried = np.argpartition(left[busy], take - 1, axis=1)[:, :take]
        promising = left[busy[:, None], tried] < best[busy, -1:]
        reached = np.full(tried.shape, np.inf)
        for members, _ in supports.by_size:
            size = supports.size[members[0]]
            which, column = np.nonzero(promising & (supports.size[tried] == size))
            gap = solve(given, busy[which], supports.rows[tried[which, column], :size], bounds)[1]
            reached[which, column] = score(gap, size, simpler)
        left[busy[:, None], tried] = np.inf
        best_and_new = np.concatenate([best[busy], reached], axis=1)
        order = np.argsort(best_and_new, axis=1, kind="stable")[:, :few]
        best[busy] = np.take_along_axis(best_and_new, order, axis=1)
        number[busy] = np.take_along_axis(np.concatenate([number[busy], tried], axis=1), order, axis=1)
        busy = busy[left[busy].min(axis=1) < best[busy, -1]]
        take = min(2 * take, len(supports.size))
    return number, best


def _flat(gram: NDArray, rows: NDArray) -> tuple[NDArray, NDArray]:
    """For supports (C, J): offset (C, J - 1) and root (C, J - 1, J - 1), which measure along the flat of J rows."""
    first, rest = rows[:, :1], rows[:, 1:]
    offset = gram[rest, first] - gram[first, first]  # <s_n - s_1, s_1>
    across = gram[rest[:, :, None], rest[:, None, :]] - gram[first[..., None], rest[:, None, :]]
    values, vectors = np.linalg.eigh(across - offset[:, :, None])  # <s_n - s_1, s_m - s_1>
    thin = values <= 1e-12 * np.abs(values).max(axis=1, keepdims=True, initial=0)
    return offset, (np.where(thin, 0, 1 / np.sqrt(np.where(thin, 1, values))))[:, :, None] * np.swapaxes(vectors, 1, 2)


def _distances(given: Problem, rows: NDArray, offset: NDArray, root: NDArray) -> NDArray:
    """Squared distances (C, T) of all frames from the flats through supports (C, J)."""
    cross, first = np.ascontiguousarray(given.cross.T), rows[:, 0]
    to_first = given.power - 2 * cross[first] + given.gram[first, first][:, None]
    along = root @ (cross[rows[:, 1:]] - (cross[first][:, None] + offset[..., None]))  # (C, J - 1, T)
    return np.maximum(to_first - (along**2).sum(axis=1), 0)


def _on_face(gram: NDArray, cross: NDArray, held: NDArray) -> NDArray:
    """Weights (n, J) with sum 1 and some of them held, by the conditions of Lagrange."""
    count, size = cross.shape
    free = np.isnan(held)
    known, any_free = np.where(free, 0.0, held), free.any(axis=1)
    system, right = np.zeros((count, size + 1, size + 1)), np.zeros((count, size + 1))
    both = free[:, :, None] & free[:, None, :]
    system[:, :size, :size] = np.where(both, gram, np.eye(size) * ~free[:, :, None])
    system[:, :size, size] = system[:, size, :size] = free
    system[:, size, size] = ~any_free  # then the sum is what it is
    right[:, :size] = np.where(free, cross - (gram @ known[..., None])[..., 0], known)
    right[:, size] = np.where(any_free, 1 - known.sum(axis=1), 0)
    return np.linalg.solve(system, right[..., None])[:, :size, 0]
