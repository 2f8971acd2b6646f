"""The cheapest monotone warp of one row of features along another, by dynamic programming.

Row i of `own` (N, F) is laid at place v_i of `other` (M, F), v increasing, so that

    sum_i c(own_i - other(v_i)) + STRETCH sum_i log^2((v_{i+1} - v_i) / nominal_i)

is least, where c(r) = CAP r^2 / (r^2 + CAP) and nominal_i (the lengths, scaled to the other's) is the step of even
stretching.  Steps are slope-limited: a piece stretches at most STEEPEST times more than the whole, and shrinks at
most FINER times.  A few Gauss-Newton steps on the same sum bring the warp between the samples.
"""

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

STRETCH = 0.5
CAP = 1.0  # about the most a row can cost: a limb that folds must not pull the rest along
FINER = 3  # samples of the other for each of its own
STEEPEST = 4


def span(own: NDArray, other: NDArray, lengths: NDArray, start: float, end: float) -> tuple[NDArray, float]:
    """Places (N,) from exactly `start` to exactly `end` of an other's row (beyond its rows: cyclic), and the sum.

    `lengths` (N - 1,) are those of the steps between own rows.
    """
    steps = len(own) - 1
    if steps < 2:
        return np.linspace(start, end, len(own)), 0.0
    grid = np.linspace(start, end, FINER * steps + 1)
    fine = at(other, grid, True)
    nominal = lengths / lengths.sum() * FINER * steps
    base = _whole(np.append(0.0, np.cumsum(nominal)))
    cost = _cost(own, fine)
    paths, sums = _cheapest(cost, base, np.zeros(1, int), max(6, len(fine) // 3), nominal, closed=False)
    if not np.isfinite(sums[0]):  # lengths so uneven that no slope-limited path keeps to the ends
        return np.interp(np.append(0.0, np.cumsum(nominal)), np.arange(len(grid)), grid), CAP * len(own)
    warp = _polish(paths[0].astype(float), own, fine, nominal, closed=False)
    return np.interp(warp, np.arange(len(grid)), grid), float(sums[0])


def lap(own: NDArray, other: NDArray, lengths: NDArray, near: NDArray, reach: int = FINER) -> tuple[NDArray, float]:
    """Places (N,) once round a cyclic other near a warp (N,), and the sum; `lengths` (N,) come back to row 0.

    The start may move by `reach` places.
    """
    nominal = lengths / lengths.sum() * len(other)
    base = _whole(np.append(near, near[0] + len(other)))
    base[-1] = base[0] + len(other)
    paths, sums = _cheapest(_cost(own, other), base, np.arange(-reach, reach + 1), 4 * FINER, nominal, closed=True)
    best = int(np.argmin(sums))
    if not np.isfinite(sums[best]):
        return near, CAP * len(own)
    return _polish(paths[best].astype(float), own, other, nominal, closed=True), float(sums[best])


def starts(own: NDArray, other: NDArray, lengths: NDArray, nodes: int = 32, keep: int = 3) -> list[NDArray]:
    """Rough warps (N,) round a cyclic other, from the best few of all starts, on a coarse picture of both curves."""
    from scipy.ndimage import gaussian_filter1d

    count, fine, samples = len(own), len(other), nodes * FINER
    rows, columns = np.arange(nodes) * count / nodes, np.arange(samples) * fine / samples
    few = at(gaussian_filter1d(own, 0.3 * count / nodes, axis=0, mode="wrap"), rows, True)
    many = at(gaussian_filter1d(other, 0.3 * fine / nodes, axis=0, mode="wrap"), columns, True)
    along = np.append(0.0, np.cumsum(lengths)) / lengths.sum() * samples
    base = np.interp(np.append(rows, count), np.arange(count + 1), along)
    paths, sums = _cheapest(
        _cost(few, many), _whole(base), np.arange(samples), samples // 6, np.diff(base), closed=True
    )
    found, taken = [], np.full(samples, False)
    for start in np.argsort(sums):
        if len(found) < keep and not taken[start] and sums[start] < 2 * sums.min():
            taken[(start + np.arange(-4, 5)) % samples] = True
            path = np.append(paths[start], paths[start, 0] + samples) * fine / samples
            found.append(np.interp(np.arange(count), np.append(rows, count), path))
    return found or [along[:-1] * fine / samples]


def at(table: NDArray, places: NDArray, closed: bool) -> NDArray:
    """Rows of a table (M, F) at fractional places (N,), round and round if closed."""
    count = len(table)
    places = np.mod(places, count) if closed else np.clip(places, 0, count - 1)
    low = np.minimum(np.floor(places).astype(int), count - 1)
    high = (low + 1) % count if closed else np.minimum(low + 1, count - 1)
    part = (places - low)[:, None]
    return (1 - part) * table[low] + part * table[high]


def _cost(own: NDArray, other: NDArray) -> NDArray:
    square = (own**2).sum(axis=1)[:, None] + (other**2).sum(axis=1) - 2 * own @ other.T
    square = np.maximum(square, 0)
    return CAP * square / (square + CAP)


def _whole(base: NDArray) -> NDArray:
    return np.rint(base).astype(int)


def _cheapest(
    cost: NDArray, base: NDArray, starts: NDArray, width: int, nominal: NDArray, closed: bool
) -> tuple[NDArray, NDArray]:
    """For each start (S,) the cheapest path (S, N) over cost (N, M), and its sum (S,), infinite where there is none.

    Paths stay within `width` samples of base + start and begin and end on it; a closed one's base has a last
    entry for coming back.
    """
    tolls = STRETCH * np.log(np.arange(1, STEEPEST * FINER + 1) / nominal[:, None]) ** 2
    paths, sums = _compiled()(cost, base, np.asarray(starts), width, tolls, closed)
    return paths[:, : len(cost)], sums


@lru_cache(maxsize=1)
def _compiled() -> Callable:
    """`_paths` as machine code: calls of NumPy on such short rows would take a hundred times as long."""
    from numba import njit

    try:
        return njit(_paths, cache=True)
    except RuntimeError:  # there is no folder where the machine code could be kept
        return njit(_paths)


def _paths(  # noqa: ANN202 - numba reads this too
    cost: NDArray, base: NDArray, starts: NDArray, width: int, tolls: NDArray, closed: bool
):
    """The loops of `_cheapest`; `tolls` (steps, gains) price a step of 1, 2, ... samples."""
    count, samples = cost.shape
    rows, states = len(base), 2 * width + 1
    paths = np.zeros((len(starts), rows), np.int64)
    sums = np.full(len(starts), np.inf)
    choice = np.zeros((rows, states), np.int64)
    for lane in range(len(starts)):
        total = np.full(states, np.inf)
        total[width] = cost[0, (base[0] + starts[lane]) % samples]
        for i in range(1, rows):
            after = np.full(states, np.inf)
            drift = base[i] - base[i - 1]
            for state in range(states):
                column = base[i] + starts[lane] + state - width
                if not closed and (column < 0 or column >= samples):
                    continue
                for gain in range(1, tolls.shape[1] + 1):
                    before = state + drift - gain
                    if 0 <= before < states and total[before] + tolls[i - 1, gain - 1] < after[state]:
                        after[state] = total[before] + tolls[i - 1, gain - 1]
                        choice[i, state] = before
                if i < count:
                    after[state] += cost[i, column % samples]
            total = after
        sums[lane] = total[width]
        state = width
        for i in range(rows - 1, -1, -1):
            paths[lane, i] = base[i] + starts[lane] + state - width
            state = choice[i, state]
    return paths, sums


def _polish(places: NDArray, own: NDArray, other: NDArray, nominal: NDArray, closed: bool, rounds: int = 4) -> NDArray:
    """Places (N,) moved between the samples: Gauss-Newton on the sum; the ends of an open path stay."""
    count = len(own)
    ends = np.vstack([other[-1:], other, other[:1]]) if closed else np.pad(other, ((1, 1), (0, 0)), "edge")
    slopes = 0.5 * (ends[2:] - ends[:-2])
    behind = np.arange(len(nominal))
    ahead = (behind + 1) % count
    free = np.arange(count) if closed else np.arange(1, count - 1)
    for _ in range(rounds):
        step = places[ahead] - places[behind]
        step[-1] += len(other) if closed else 0
        left, slope = own - at(other, places, closed), at(slopes, places, closed)
        trust = 1 / (1 + (left**2).sum(axis=1) / CAP) ** 2
        pull, push = STRETCH / step**2, STRETCH * np.log(step / nominal) / step
        normal = np.diag(trust * (slope**2).sum(axis=1) + 1e-9)
        right = trust * (slope * left).sum(axis=1)
        for a, b in ((ahead, behind), (behind, ahead)):
            np.add.at(normal, (a, a), pull)
            np.add.at(normal, (a, b), -pull)
        np.add.at(right, ahead, -push)
        np.add.at(right, behind, push)
        move = np.zeros(count)
        move[free] = np.linalg.solve(normal[np.ix_(free, free)], right[free])
        shrink = np.max((move[behind] - move[ahead]) / step)
        places = places + move * min(1.0, 0.5 / max(shrink, 1e-9))  # no step may turn back
    return places
