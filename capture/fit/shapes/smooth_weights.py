"""Sparse key weights of a whole clip whose shape moves evenly: one quadratic program, which lags behind nothing.

With x_t = w_t S the clip minimises sum_t c_t |x_t - v_t|^2 + strength * integral |x''|^2, for drawings t that are held
for c_t frames; where each is held for one, the integral is sum_t |x_{t-1} - 2 x_t + x_{t+1}|^2 (the paper's own future
work).  Second differences of the *shape* count, not of the weights: two neighbouring rows are nearly the same drawing,
and going from one to the next is no jerk.  With C = diag(c), H = C + strength D2' D2 and the evened clip u = H^-1 C v
the sum is (x - u)' H (x - u) and a constant, so the deviations e = x - u from the evened clip decide which supports to
take: each drawing's few best ones are chained by Viterbi's method, at c_t |e_t|^2 a drawing and, for drawings a frame
apart, 4 strength |e_{t+1} - e_t|^2 a step (no second difference costs more).  All costs grow linearly with T.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from capture.fit.shapes import sparse_weights
from capture.fit.shapes.sparse_weights import Problem, Supports

FEW = 8  # supports of a frame that may become its own, besides its neighbours' best
HALF_WIDTH = (
    1.4332787816903483  # of the kernel of 1 / (1 + omega^4), where exp(-x / sqrt 2) (cos + sin)(x / sqrt 2) = 1/2
)


@dataclass(frozen=True, eq=False)
class Spacing:
    """When T drawings are seen."""

    held: NDArray  # (T,) frames
    step: NDArray  # (T - 1,) frames from the middle of one to the middle of the next
    strength: float

    @property
    def around(self) -> NDArray:
        """The frames (T - 2,) that each inner drawing stands for."""
        return (self.step[1:] + self.step[:-1]) / 2

    def metric(self) -> object:
        """H (T, T), sparse: C + strength D2' D2, with D2 second differences for drawings of any spacing."""
        from scipy import sparse

        before, after, root = 1 / self.step[:-1], 1 / self.step[1:], np.sqrt(self.around)
        size = len(self.held)
        second = sparse.diags(
            [before / root, -(before + after) / root, after / root], [0, 1, 2], shape=(size - 2, size)
        )
        return sparse.diags(self.held) + self.strength * second.T @ second

    def step_price(self) -> NDArray:
        """What (T - 1,) squared changes of the deviation cost at most: (a - b)^2 is no more than 2 a^2 + 2 b^2."""
        share = np.zeros(len(self.step))
        share[:-1] += 1 / self.around
        share[1:] += 1 / self.around
        return 2 * self.strength * share / self.step**2


def fit(
    tracked: NDArray,
    shapes: NDArray,
    supports: Supports,
    half_width: float,
    bounds: tuple[float, float],
    simpler: float,
    drawing: NDArray,
) -> NDArray:
    """Weights (T, D) for shapes `tracked` (T, N, d) over rows (D, N, d), evened with a half-width in frames.

    Frames in a row with the same number in `drawing` (T,) hold one drawing: they get the weights of their mean.
    """
    first = np.flatnonzero(np.diff(drawing, prepend=drawing[0] - 1))
    held = np.diff(first, append=len(tracked))
    shown = np.repeat(np.arange(len(first)), held)
    middle = first + (held - 1) / 2
    seen = np.add.reduceat(tracked, first, axis=0) / held.reshape(-1, *(1,) * (tracked.ndim - 1))
    given = sparse_weights.problem(seen, shapes)
    power = strength(half_width)
    if len(first) < 3 or power == 0:
        return sparse_weights.best_weights(given, supports, bounds, simpler)[shown]
    spacing = Spacing(held.astype(float), np.diff(middle), power)
    evened = sparse_weights.problem(even(seen, spacing), shapes)
    return _over(given, supports, _chain(evened, supports, spacing, bounds, simpler), spacing, bounds)[shown]


def strength(half_width: float) -> float:
    """The weight of squared second differences that spreads one frame's error to half at `half_width` frames.

    Least squares with it is the filter 1 / (1 + strength (2 sin(omega / 2))^4), whose kernel is the one of
    1 / (1 + omega^4) stretched by strength^(1/4).
    """
    return (half_width / HALF_WIDTH) ** 4


def even(seen: NDArray, spacing: Spacing) -> NDArray:
    """The T shapes (T, ...) without constraints: H^-1 C v, by one banded solve."""
    from scipy.linalg import solveh_banded

    count, matrix = len(seen), spacing.metric()
    bands = np.zeros((3, count))
    for offset in range(3):
        bands[2 - offset, offset:] = matrix.diagonal(offset)
    return solveh_banded(bands, spacing.held[:, None] * seen.reshape(count, -1)).reshape(seen.shape)


def _chain(
    evened: Problem, supports: Supports, spacing: Spacing, bounds: tuple[float, float], simpler: float
) -> NDArray:
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
        cost[:, q] = spacing.held * sparse_weights.score(gap, supports.size[chosen], simpler)
        off[:, q] = (weights @ evened.gram) @ to_axes - goal
    square = (off**2).sum(axis=2)
    steps = square[:-1, :, None] + square[1:, None, :] - 2 * off[:-1] @ np.swapaxes(off[1:], 1, 2)
    steps = spacing.step_price()[:, None, None] * np.maximum(steps, 0) + 1e-9 * (
        number[:-1, :, None] != number[1:, None, :]
    )
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


def _over(
    given: Problem, supports: Supports, number: NDArray, spacing: Spacing, bounds: tuple[float, float]
) -> NDArray:
    """Weights (T, D) on the support `number` (T,) of each frame: one program of blocks along the diagonal."""
    import piqp
    from scipy import sparse

    rows, used = supports.rows[number], np.arange(supports.rows.shape[1]) < supports.size[number][:, None]
    name = np.cumsum(used).reshape(used.shape) - 1  # of each used row's variable
    count, many = len(number), int(used.sum())
    metric = spacing.metric()
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
    linear = -spacing.held[frame] * given.cross[frame, rows[used]]
    ends = np.full(many, float(bounds[0])), np.full(many, float(bounds[1]))
    solver.setup(sparse.triu(matrix, format="csc"), linear, sums, np.ones(count), x_l=ends[0], x_u=ends[1])
    solver.solve()
    weights = np.zeros(given.cross.shape)
    weights[frame, rows[used]] = np.clip(solver.result.x, *bounds)
    return weights
