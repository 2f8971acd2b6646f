"""Key weights of tracked shapes: which rows, and how much of each (Bregler et al. 2002, section 3.2, eq. 7).

The paper's three constraints: at most three rows are used, they sum to 1, each lies in [-0.5, 1.5].  A
support is two neighbouring rows of one pair's chain (key, in-betweens, key) and at most one further key: the
in-betweens lie on a curve, and a chord across it would be an illegal shape.  There are few such supports,
so all are solved in closed form, for all frames at once; nothing is thrown away to reach the number.
"""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray


def fit_weights(
    tracked: NDArray, shapes: NDArray, rows: NDArray, bounds: tuple[float, float] = (-0.5, 1.5), simpler: float = 1.02
) -> NDArray:
    """Weights (T, D) over rows whose mix of `shapes` (D, N, d) is nearest to shapes `tracked` (T, N, d).

    Of supports that fit equally well (within the factor `simpler`) the smaller one is taken.
    """
    tracked, shapes = np.asarray(tracked, float), np.asarray(shapes, float)
    count = len(shapes)
    centre = shapes.mean(axis=0)
    s = (shapes - centre).reshape(count, -1)
    v = (tracked - centre).reshape(len(tracked), -1)
    gram, cross, power = s @ s.T, v @ s.T, (v**2).sum(axis=1)  # all a frame costs from here on
    best = np.full(len(tracked), np.inf)
    weights = np.zeros((len(tracked), count))
    slack = 1e-9 * max(float(np.trace(gram)) / count, 1e-12)
    for support in supports(rows):
        found = _solve_support(gram[np.ix_(support, support)], cross[:, support], bounds)
        gap = power + np.einsum("ti,ij,tj->t", found, gram[np.ix_(support, support)], found)
        gap = np.maximum(gap - 2 * (found * cross[:, support]).sum(axis=1), 0) + slack
        better = gap * simpler ** (2 * len(support)) < best
        best[better] = (gap * simpler ** (2 * len(support)))[better]
        weights[better] = 0
        weights[np.ix_(better, support)] = found[better]
    return weights


def supports(rows: NDArray) -> list[list[int]]:
    """Rows that may be mixed: each key, each step of a pair's chain, and that step with one further key."""
    pairs, along = rows[:, :2].astype(int), rows[:, 2]
    key_row = {int(i): n for n, (i, j) in enumerate(pairs) if i == j}
    found = [[n] for n in key_row.values()]
    drawn = {(int(i), int(j)) for i, j in pairs if i != j}
    bare = {(i, j) for i in key_row for j in key_row if i < j and (i, j) not in drawn and (j, i) not in drawn}
    for i, j in sorted(drawn | bare):
        between = np.flatnonzero((pairs == (i, j)).all(axis=1))
        chain = [key_row[i], *between[np.argsort(along[between])].tolist(), key_row[j]]
        for step in pairwise(chain):
            found.append(list(step))
            found += [[*step, n] for k, n in key_row.items() if k not in (i, j)]
    return found


def _solve_support(gram: NDArray, cross: NDArray, bounds: tuple[float, float]) -> NDArray:
    """Weights (T, J) for J <= 3 rows: least squares with sum 1 and bounds, every set of free weights tried."""
    size, frames = len(gram), len(cross)
    low, high = bounds
    best = np.full(frames, np.inf)
    weights = np.zeros((frames, size))
    for state in np.ndindex(*(3,) * size):  # each weight free, at its lower bound or at its upper
        free = [n for n in range(size) if state[n] == 0]
        found = np.tile([0.0 if s == 0 else (low if s == 1 else high) for s in state], (frames, 1))
        left = 1 - found.sum(axis=1)
        if not free and abs(left[0]) > 1e-9:
            continue
        if free:
            first, rest = free[0], free[1:]
            found[:, first] = left
            if rest:  # walk along w_rest - w_first, which keeps the sum
                walk = np.zeros((size, len(rest)))
                walk[rest, np.arange(len(rest))] = 1
                walk[first] = -1
                slope = (cross - found @ gram) @ walk
                found = found + slope @ np.linalg.pinv(walk.T @ gram @ walk, hermitian=True).T @ walk.T
        inside = ((found >= low - 1e-9) & (found <= high + 1e-9)).all(axis=1)
        gap = np.einsum("ti,ij,tj->t", found, gram, found) - 2 * (found * cross).sum(axis=1)
        better = inside & (gap < best - 1e-12 * np.abs(best, where=np.isfinite(best), out=np.zeros(frames)))
        best[better], weights[better] = gap[better], found[better]
    return weights
