"""Which frame of one motion is which of another (Wu et al. 2008, section 3.2).

Dynamic programming over pairs of frames.  The path is continuous and causal: a step takes the next frame of one motion,
of the other, or of both.  After Kovar and Gleicher (2003) a frame answers at most so many others, so that the slope of
the path stays within a limit and its inverse.  What was the same frame again and again is spread out afterwards.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError

SLOPE = 3
"""The paper's limit: one frame answers at most three."""

SMOOTH = 0.12
"""Seconds: frames are answered by whole frames, and what plays them must not stutter."""

CELLS = 4_000_000
"""From so many pairs of frames on a coarse alignment goes first, and only pairs near it are looked at."""

COARSER = 4
NEAR = 24


@dataclass(frozen=True, eq=False)
class Alignment:
    """Pairs of frames (n, 2), of one motion and of the other, in order; and the mean cost of a pair."""

    pairs: NDArray
    cost: float


def align(one: NDArray, other: NDArray, slope: int = SLOPE, free: tuple[int, int] = (0, 0)) -> Alignment:
    """Align curves (n, C) with curves (m, C); every frame of `other` is answered.

    Up to `free` frames may be left out at the start and at the end of `one`.  Refused where the slope limit cannot
    bring one length to the other.
    """
    one, other = np.atleast_2d(np.asarray(one, float).T).T, np.atleast_2d(np.asarray(other, float).T).T
    n, m = len(one), len(other)
    if min(n, m) < 2:
        raise InputError(
            f"motions must have two frames or more to be aligned, these have {n} and {m}: give longer ones"
        )
    if n - sum(free) > slope * m or m > slope * n:
        raise InputError(
            f"one motion must last at most {slope} times as long as the other to be aligned with it, these have {n} "
            f"and {m} frames: cut or repeat one of them, or raise the slope limit"
        )
    low, high = np.zeros(n, np.int64), np.full(n, m, np.int64)
    if n * m > CELLS and min(n, m) >= 4 * COARSER:
        coarse = align(_thinned(one), _thinned(other), slope, tuple(-(-many // COARSER) for many in free))
        low, high = _beside(coarse.pairs, n, m, free)
    cells, cost = _descend()(_scaled(one), _scaled(other), low, high, slope, *free)
    if not len(cells):
        raise InputError(
            f"a path of slope at most {slope} must lead through both motions, of {n} and {m} frames there is none: "
            "raise the slope limit"
        )
    return Alignment(cells, cost / len(cells))


def time_curve(pairs: NDArray, count: int, fps: float, smooth: float = SMOOTH) -> NDArray:
    """The frame of the first motion (m,), between frames too, for each of the second's `count` frames.

    Many frames that answer one are met at their mean; one that answers many is spread over them; then the curve is
    smoothed over `smooth` seconds, which leaves it rising and its ends where they are.
    """
    from scipy.ndimage import gaussian_filter1d

    first, second = np.asarray(pairs, float).T
    known, at = np.unique(second, return_inverse=True)
    spread = first + _spread(first, second)
    curve = np.bincount(at, spread) / np.bincount(at)
    curve = np.interp(np.arange(count), known, curve)
    curve[0], curve[-1] = first[0], first[-1]
    if smooth <= 0 or count < 3:
        return curve
    pad = min(int(4 * smooth * fps) + 1, count - 1)  # odd reflection keeps ends and straight lines
    before, after = 2 * curve[0] - curve[pad:0:-1], 2 * curve[-1] - curve[-2 : -pad - 2 : -1]
    return gaussian_filter1d(np.concatenate([before, curve, after]), smooth * fps)[pad : pad + count]


def warped(values: NDArray, pairs: NDArray, count: int) -> NDArray:
    """The paper's three cases, literally: curves (n, C) of the first motion on the second's `count` frames.

    One frame for one: taken.  Many for one: their mean.  One for many: a cubic B-spline through it and its neighbours.
    """
    from mocap.analogy.curves import sampled

    first, second = np.asarray(pairs, int).T
    out = np.zeros((count, values.shape[1]))
    np.add.at(out, second, sampled(values, first + _spread(first, second)))
    return out / np.bincount(second, minlength=count)[:, None]


def _spread(first: NDArray, second: NDArray) -> NDArray:
    """How far (-1/2, 1/2) each pair lies from its frame of the first motion, where that answers several."""
    starts = np.flatnonzero(np.r_[True, np.diff(first) != 0])
    lengths = np.diff(np.r_[starts, len(first)])
    place = np.arange(len(first)) - np.repeat(starts, lengths)
    many = np.repeat(lengths, lengths)
    return (place - (many - 1) / 2) / many


def _scaled(values: NDArray) -> NDArray:
    return np.ascontiguousarray(values, float)


def _thinned(values: NDArray) -> NDArray:
    """Every fourth frame, as the mean of four."""
    count = len(values) // COARSER * COARSER
    return values[:count].reshape(-1, COARSER, values.shape[1]).mean(axis=1)


def _beside(pairs: NDArray, n: int, m: int, free: tuple[int, int]) -> tuple[NDArray, NDArray]:
    """First and last + 1 frame (n,) of the other motion near a coarse path, for every frame of the one."""
    way = np.interp(np.arange(n), (pairs[:, 0] + 0.5) * COARSER - 0.5, (pairs[:, 1] + 0.5) * COARSER - 0.5)
    low = np.clip(np.floor(way).astype(np.int64) - NEAR, 0, m)
    high = np.clip(np.ceil(way).astype(np.int64) + NEAR + 1, 0, m)
    low[: free[0] + NEAR], high[n - free[1] - NEAR :] = 0, m
    return low, high


def plain(one: NDArray, other: NDArray, slope: int, free: tuple[int, int] = (0, 0)) -> float:
    """The cost of the best path, by the recursion as it stands: what the compiled loop is held against."""
    cost = ((one[:, None] - other[None]) ** 2).sum(axis=-1)
    n, m = cost.shape
    run = slope - 1
    best = np.full((n, m, 2 * run + 1), np.inf)
    for i in range(n):
        for j in range(m):
            if j == 0 and i <= free[0]:
                best[i, j, 0] = cost[i, j]
            elif i and j:
                best[i, j, 0] = best[i - 1, j - 1].min() + cost[i, j]
            for step in range(1, run + 1):
                if i:
                    best[i, j, step] = best[i - 1, j, step - 1 if step > 1 else 0] + cost[i, j]
                if j:
                    best[i, j, run + step] = best[i, j - 1, run + step - 1 if step > 1 else 0] + cost[i, j]
    return best[n - 1 - free[1] :, m - 1].min()


_compiled = []


def _descend():  # noqa: ANN202  a numba dispatcher
    """The compiled recursion, made on first use."""
    if _compiled:
        return _compiled[0]
    from numba import njit

    @njit(cache=True)
    def descend(one, other, low, high, slope, free_start, free_end):  # noqa: ANN001, ANN202
        """The best path of cells (i, low[i] <= j < high[i]); state 0 came diagonally, then runs down, then right."""
        n, m, channels = len(one), len(other), one.shape[1]
        run = slope - 1
        states = 2 * run + 1
        width = 0
        for i in range(n):
            width = max(width, high[i] - low[i])
        came = np.full((n, width, states), -1, np.int8)
        above, here = np.full((m + 1, states), np.inf), np.full((m + 1, states), np.inf)
        least, end_i, end_state = np.inf, -1, -1
        for i in range(n):
            if i > 1:
                here[low[i - 2] : high[i - 2]] = np.inf  # what it held two rows ago
            for j in range(low[i], high[i]):
                cost = 0.0
                for c in range(channels):
                    cost += (one[i, c] - other[j, c]) ** 2
                if j == 0 and i <= free_start:
                    here[j, 0] = cost
                elif i > 0 and j > 0:
                    best, state = np.inf, -1
                    for s in range(states):
                        if above[j - 1, s] < best:
                            best, state = above[j - 1, s], s
                    here[j, 0] = best + cost
                    came[i, j - low[i], 0] = state
                for step in range(1, run + 1):
                    before = step - 1
                    if i > 0:
                        here[j, step] = above[j, before] + cost
                    if j > 0:
                        state = 0 if step == 1 else run + before
                        here[j, run + step] = here[j - 1, state] + cost
            if i >= n - 1 - free_end and high[i] == m:
                for s in range(states):
                    if here[m - 1, s] < least:
                        least, end_i, end_state = here[m - 1, s], i, s
            above, here = here, above
        if end_i < 0:
            return np.zeros((0, 2), np.int64), np.inf
        path = np.zeros((n + m, 2), np.int64)
        count, i, j, state = 0, end_i, m - 1, end_state
        while True:
            path[count, 0], path[count, 1] = i, j
            count += 1
            if state == 0:
                state = came[i, j - low[i], 0]
                if state < 0:
                    break
                i, j = i - 1, j - 1
            elif state <= run:
                i, state = i - 1, state - 1
            else:
                j, state = j - 1, 0 if state == run + 1 else state - 1
        return path[:count][::-1].copy(), least

    _compiled.append(descend)
    return descend
