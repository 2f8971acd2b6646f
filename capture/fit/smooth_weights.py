"""Sparse key weights of a whole clip whose shape moves evenly: one quadratic program, which lags behind nothing.

With x_t = w_t S the clip minimises sum_t |x_t - v_t|^2 + strength sum_t |x_{t-1} - 2 x_t + x_{t+1}|^2 (the paper's own
future work).  Second differences of the *shape* count, not of the weights: two neighbouring rows are nearly the same
drawing, and going from one to the next is no jerk.  With H = 1 + strength D2' D2 and the evened clip u = H^-1 v the
sum is (x - u)' H (x - u) and a constant, so the deviations e = x - u from the evened clip decide which supports to
take: each frame's few best ones are chained by Viterbi's method, at the price |e_t|^2 a frame and
4 strength |e_{t+1} - e_t|^2 a step (no second difference costs more).  All costs grow linearly with T.
"""

import numpy as np
from numpy.typing import NDArray

from capture.fit import sparse_weights
from capture.fit.sparse_weights import Problem, Supports

FEW = 8  # supports of a frame that may become its own, besides its neighbours' best
HALF_WIDTH = (
    1.4332787816903483  # of the kernel of 1 / (1 + omega^4), where exp(-x / sqrt 2) (cos + sin)(x / sqrt 2) = 1/2
)


def fit(
    tracked: NDArray,
    shapes: NDArray,
    supports: Supports,
    half_width: float,
    bounds: tuple[float, float],
    simpler: float,
) -> NDArray:
    """Weights (T, D) for shapes `tracked` (T, N, d) over rows (D, N, d), evened with a half-width in frames."""
    given = sparse_weights.problem(tracked, shapes)
    power = strength(half_width)
    if len(tracked) < 3 or power == 0:
        return sparse_weights.best_weights(given, supports, bounds, simpler)
    evened = sparse_weights.problem(even(tracked, power), shapes)
    return _over(given, supports, _chain(evened, supports, power, bounds, simpler), power, bounds)


def strength(half_width: float) -> float:
    """The weight of squared second differences that spreads one frame's error to half at `half_width` frames.

    Least squares with it is the filter 1 / (1 + strength (2 sin(omega / 2))^4), whose kernel is the one of
    1 / (1 + omega^4) stretched by strength^(1/4).
    """
    return (half_width / HALF_WIDTH) ** 4


def even(tracked: NDArray, power: float) -> NDArray:
    """The T shapes (T, ...) without constraints: H^-1 v, by one banded solve."""
    from scipy.linalg import solveh_banded

    count = len(tracked)
    matrix = _metric(count, power)
    bands = np.zeros((3, count))
    for offset in range(3):
        bands[2 - offset, offset:] = matrix.diagonal(offset)
    return solveh_banded(bands, tracked.reshape(count, -1)).reshape(tracked.shape)


def _chain(evened: Problem, supports: Supports, power: float, bounds: tuple[float, float], simpler: float) -> NDArray:
    """The support (T,) of each frame."""
    number, _ = sparse_weights.best_supports(evened, supports, bounds, simpler, FEW)
    best = np.pad(number[:, 0], 2, mode="edge")
    near = [best[shift : shift + len(number)] for shift in (0, 1, 3, 4)]
    number = np.column_stack([number, *near])  # (T, Q)
    values, vectors = np.linalg.eigh(evened.gram)
    kept = values > 1e-10 * values[-1]
    to_axes = vectors[:, kept] / np.sqrt(values[kept])  # orthonormal axes of the rows' span
    goal = evened.cross @ to_axes
    cost, off = np.empty(number.shape), np.empty((*number.shape, kept.sum()))
    for q, chosen in enumerate(number.T):
        weights, gap = sparse_weights.weights_on(evened, supports, chosen, bounds)
        cost[:, q] = sparse_weights.score(gap, supports.size[chosen], simpler)
        off[:, q] = (weights @ evened.gram) @ to_axes - goal
    square = (off**2).sum(axis=2)
    steps = square[:-1, :, None] + square[1:, None, :] - 2 * off[:-1] @ np.swapaxes(off[1:], 1, 2)
    steps = 4 * power * np.maximum(steps, 0) + 1e-9 * (number[:-1, :, None] != number[1:, None, :])
    return np.take_along_axis(number, _viterbi(cost, steps)[:, None], axis=1)[:, 0]


def _viterbi(cost: NDArray, steps: NDArray) -> NDArray:
    """The cheapest way (T,) through states of `cost` (T, Q) by `steps` (T - 1, Q, Q), from and to."""
    total, came_from = cost[0], np.zeros(cost.shape, int)
    for t, step in enumerate(steps, 1):
        ways = total[:, None] + step
        came_from[t] = ways.argmin(axis=0)
        total = ways.min(axis=0) + cost[t]
    way = np.zeros(len(cost), int)
    way[-1] = total.argmin()
    for t in range(len(cost) - 1, 0, -1):
        way[t - 1] = came_from[t, way[t]]
    return way


def _over(given: Problem, supports: Supports, number: NDArray, power: float, bounds: tuple[float, float]) -> NDArray:
    """Weights (T, D) on the support `number` (T,) of each frame: one program of blocks along the diagonal."""
    import piqp
    from scipy import sparse

    rows, used = supports.rows[number], np.arange(supports.rows.shape[1]) < supports.size[number][:, None]
    name = np.cumsum(used).reshape(used.shape) - 1  # of each used row's variable
    count, many = len(number), int(used.sum())
    metric = _metric(count, power)
    matrix = sparse.csc_matrix((many, many))
    for offset in range(3):  # the upper triangle's blocks
        here, there = slice(0, count - offset), slice(offset, count)
        block = metric.diagonal(offset)[:, None, None] * given.gram[rows[here, :, None], rows[there, None, :]]
        both = used[here, :, None] & used[there, None, :]
        at = [np.broadcast_to(index, both.shape)[both] for index in (name[here, :, None], name[there, None, :])]
        matrix = matrix + sparse.csc_matrix((block[both], at), shape=(many, many))
    frame = np.nonzero(used)[0]
    sums = sparse.csc_matrix((np.ones(many), (frame, np.arange(many))), shape=(count, many))
    solver = piqp.SparseSolver()
    solver.settings.eps_abs = solver.settings.eps_duality_gap_abs = 1e-10
    linear = -given.cross[frame, rows[used]]
    ends = np.full(many, float(bounds[0])), np.full(many, float(bounds[1]))
    solver.setup(sparse.triu(matrix, format="csc"), linear, sums, np.ones(count), x_l=ends[0], x_u=ends[1])
    solver.solve()
    weights = np.zeros(given.cross.shape)
    weights[frame, rows[used]] = np.clip(solver.result.x, *bounds)
    return weights


def _metric(count: int, power: float) -> object:
    """H (T, T), sparse: 1 + power D2' D2."""
    from scipy import sparse

    second = sparse.diags([1.0, -2.0, 1.0], [0, 1, 2], shape=(count - 2, count))
    return sparse.eye(count) + power * second.T @ second
