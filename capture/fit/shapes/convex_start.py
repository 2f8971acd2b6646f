"""A start for contour capture that cannot settle wrongly: the weights without the affine map (see ERRATA on eq. 7).

Affine map and weights together are not convex.  But any affine map of the tracked points X = [V, 1] lies in the space
its columns span; what of a shape lies outside of that space no map can explain.  So

    minimise  | (I - X X^+) sum_k w_k S_k |^2   subject to  sum w = 1 and the bounds

is one small convex problem a frame, and exact where the tracked points are an affine map of a mix.
"""

from collections.abc import Iterator
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from capture.fit.shapes.weights import supports

AT_ONCE = 4096
"""Small problems that are solved together: each alone would spend its time in calls."""


def convex_start(
    tracked: NDArray, shapes: NDArray, rows: NDArray, bounds: tuple[float, float] = (-0.5, 1.5)
) -> NDArray:
    """Weights (T, D) of tracked points (T, N, d) over shapes (D, N, d), before any affine map is known."""
    tracked, shapes = np.asarray(tracked, float), np.asarray(shapes, float)
    frames, count = len(tracked), len(shapes)
    shapes = shapes - shapes[0].mean(axis=0)
    centred = tracked - tracked.mean(axis=1, keepdims=True)
    basis = np.concatenate([centred, np.ones((*centred.shape[:2], 1))], axis=-1)
    basis = np.linalg.qr(basis)[0]  # (T, N, d + 1)
    flat = shapes.reshape(count, -1)
    explained = np.einsum("tnq,knc->tkqc", basis, shapes).reshape(frames, count, -1)
    gram = flat @ flat.T - explained @ explained.swapaxes(1, 2)  # (T, D, D): what no map explains
    best, weights = np.full(frames, np.inf), np.zeros((frames, count))
    slack = 1e-9 * np.trace(flat @ flat.T) / count
    for tried in _blocks(supports(rows), max(AT_ONCE // frames, 1)):
        some, size = tried.shape
        chosen = gram[:, tried[:, :, None], tried[:, None, :]].reshape(-1, size, size)
        found, gap = (one.reshape(frames, some, *one.shape[1:]) for one in _least(chosen, bounds))
        gap = (np.maximum(gap, 0) + slack) * 1.02 ** (2 * size)  # of equals the simpler
        least = gap.argmin(axis=1)
        frame = np.flatnonzero(gap[np.arange(frames), least] < best)
        least = least[frame]
        best[frame] = gap[frame, least]
        weights[frame] = 0
        weights[frame[:, None], tried[least]] = found[frame, least]
    return weights


def _blocks(tried: list[list[int]], most: int) -> Iterator[NDArray]:
    """Supports (C, J) of one size each, the smallest first, `most` at a time."""
    for _, alike in groupby(sorted(tried, key=len), key=len):
        block = np.array(list(alike))
        yield from (block[first : first + most] for first in range(0, len(block), most))


def _least(gram: NDArray, bounds: tuple[float, float]) -> tuple[NDArray, NDArray]:
    """Weights (M, J) with sum 1 and within the bounds that make w' G w least for gram (M, J, J), and its value."""
    many, size = gram.shape[:2]
    low, high = bounds
    best, weights = np.full(many, np.inf), np.zeros((many, size))
    for state in np.ndindex(*(3,) * size):  # each weight free, at its lower bound or at its upper
        free = [n for n in range(size) if state[n] == 0]
        found = np.tile([0.0 if s == 0 else (low if s == 1 else high) for s in state], (many, 1))
        left = 1 - found.sum(axis=1)
        if not free and abs(left[0]) > 1e-9:
            continue
        if free:
            first, rest = free[0], free[1:]
            found[:, first] = left
            if rest:
                walk = np.zeros((size, len(rest)))
                walk[rest, np.arange(len(rest))], walk[first] = 1, -1
                slope = -(gram @ found[..., None])[..., 0] @ walk
                found = (
                    found + (np.linalg.pinv(walk.T @ gram @ walk, hermitian=True) @ slope[..., None])[..., 0] @ walk.T
                )
        inside = ((found >= low - 1e-9) & (found <= high + 1e-9)).all(axis=1)
        value = np.einsum("ti,tij,tj->t", found, gram, found)
        better = inside & (value < best)
        best[better], weights[better] = value[better], found[better]
    return weights, best
