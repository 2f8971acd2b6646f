"""Key weights of tracked shapes: which rows, and how much of each (Bregler et al. 2002, section 3.2, eq. 7).

The paper's three constraints: at most three rows are used, they sum to 1, each lies in [-0.5, 1.5].  `fit_weights`
holds all of them exactly, frame by frame; `fit_smooth` does so for a whole clip whose motion is to be even;
`fit_any` is for keys without in-betweens, `fit_dense` for all rows at once.
"""

from itertools import combinations, pairwise
from math import comb

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.fit.shapes import smooth_weights, sparse_weights

MOST = 3  # rows at a time, the paper's number
SUPPORTS = 2_000_000  # what `fit_any` will look through


def fit_weights(
    tracked: NDArray,
    shapes: NDArray,
    rows: NDArray,
    most: int = MOST,
    bounds: tuple[float, float] = (-0.5, 1.5),
    simpler: float = 1.02,
) -> NDArray:
    """Weights (T, D) over `rows` (D, 3) whose mix of `shapes` (D, N, d) is nearest to shapes `tracked` (T, N, d).

    At most `most` rows of one of the `supports` are used, their weights sum to 1 and lie within `bounds`; of all such
    weights these are the best.  One row fewer is preferred where it leaves no more than `simpler` times the distance
    (root of the summed squares); with 1 only the distance counts.
    """
    tracked, shapes = _checked(tracked, shapes, bounds, most, _key_count(rows))
    allowed = sparse_weights.as_supports(supports(rows, most))
    return sparse_weights.best_weights(sparse_weights.problem(tracked, shapes), allowed, bounds, simpler)


def fit_smooth(
    tracked: NDArray,
    shapes: NDArray,
    rows: NDArray,
    smoothness: float,
    most: int = MOST,
    bounds: tuple[float, float] = (-0.5, 1.5),
    simpler: float = 1.06,
    drawing: NDArray | None = None,
) -> NDArray:
    """Weights (T, D) as by `fit_weights`, but of the whole clip at once, so that the mixed shape moves evenly.

    An error in a single frame is spread until it falls to half `smoothness` frames away (seconds times frames a second;
    1 takes off the worst, 3 leaves slow moves only).  The shape is smoothed, not the weights; nothing lags behind.
    A cartoon on twos moves by steps, which must not be smoothed: frames in a row with the same number in `drawing` (T,)
    show one drawing and get the same weights.  `simpler` is stricter than there: a key that joins in for one frame is
    jitter too.
    """
    tracked, shapes = _checked(tracked, shapes, bounds, most, _key_count(rows))
    if not 0 <= smoothness < np.inf:
        raise InputError(f"smoothness must be 0 frames or more, {smoothness} came: give a half-width such as 2.5")
    allowed = sparse_weights.as_supports(supports(rows, most))
    drawing = np.arange(len(tracked)) if drawing is None else np.asarray(drawing)
    if drawing.shape != (len(tracked),):
        raise InputError(
            f"drawing must hold one number for each of the {len(tracked)} frames, it came with shape {drawing.shape}: "
            "give equal numbers to frames that hold one drawing"
        )
    return smooth_weights.fit(tracked, shapes, allowed, smoothness, bounds, simpler, drawing)


def fit_any(tracked: NDArray, shapes: NDArray, most: int, bounds: tuple[float, float] = (-0.5, 1.5)) -> NDArray:
    """Weights (T, D) of which at most `most` are not 0, whichever: for keys (D, N, d) that have no in-betweens."""
    tracked, shapes = _checked(tracked, shapes, bounds, most, len(shapes))
    if comb(len(shapes), most) > SUPPORTS:
        raise InputError(
            f"no more than {SUPPORTS} choices of rows can be looked through, {most} of {len(shapes)} came: "
            "use fewer rows, or `fit_weights`, which knows neighbouring in-betweens"
        )
    choices = np.array(list(combinations(range(len(shapes)), most)))  # a smaller choice is one with noughts
    allowed = sparse_weights.Supports(choices, np.full(len(choices), most))
    return sparse_weights.best_weights(sparse_weights.problem(tracked, shapes), allowed, bounds)


def fit_dense(tracked: NDArray, shapes: NDArray, bounds: tuple[float, float] = (-0.5, 1.5)) -> NDArray:
    """Weights (T, D) over all rows: one solve for all frames in which no bound matters, a quadratic program for others.

    Where rows depend on each other (more rows than dimensions, equal rows) the weights are not unique: a ridge of 1e-10
    of the mean square of a row then chooses small ones, and only then.
    """
    tracked, shapes = _checked(tracked, shapes, bounds, len(shapes), len(shapes))
    given, count = sparse_weights.problem(tracked, shapes), len(shapes)
    gram = given.gram
    across = gram - gram[:1] - gram[:, :1] + gram[0, 0]  # sum 1 leaves only differences of rows
    if count > 1 and np.linalg.eigvalsh(across[1:, 1:])[0] < 1e-10:
        gram = gram + 1e-10 * np.eye(count)
    weights = _with_sum_1(gram, given.cross)
    beyond = ((weights < bounds[0]) | (weights > bounds[1])).any(axis=1)
    if beyond.any():
        weights[beyond] = _within(gram, given.cross[beyond], bounds)
    return weights


def _with_sum_1(gram: NDArray, cross: NDArray) -> NDArray:
    """Weights (T, D) with sum 1 and no bounds, by the conditions of Lagrange."""
    count = len(gram)
    system = np.block([[gram, np.ones((count, 1))], [np.ones((1, count)), np.zeros((1, 1))]])
    return np.linalg.solve(system, np.vstack([cross.T, np.ones(len(cross))]))[:count].T


def _within(gram: NDArray, cross: NDArray, bounds: tuple[float, float]) -> NDArray:
    """Weights (T, D) with sum 1 in bounds: one solver, set up once, frame by frame."""
    import piqp

    count = len(gram)
    solver = piqp.DenseSolver()
    solver.settings.eps_abs = solver.settings.eps_duality_gap_abs = 1e-10
    ends = np.full(count, float(bounds[0])), np.full(count, float(bounds[1]))
    ones = np.asfortranarray(np.ones((1, count)))
    solver.setup(np.asfortranarray(gram), -cross[0], ones, np.ones(1), x_l=ends[0], x_u=ends[1])
    weights = np.empty_like(cross)
    for found, of_frame in zip(weights, cross):
        solver.update(c=-of_frame)
        solver.solve()
        found[:] = solver.result.x
    return np.clip(weights, *bounds)


def supports(rows: NDArray, most: int = MOST) -> list[list[int]]:
    """Rows (D, 3) that may be mixed, at most `most` at a time: key; step of a pair's chain; that and further keys.

    A pair's chain is key, in-betweens, key.  The in-betweens lie on a curve, and a chord across it would be an illegal
    shape: hence single steps.  With `most` 1, each row alone.
    """
    if most == 1:
        return [[n] for n in range(len(rows))]
    pairs, along = np.asarray(rows)[:, :2].astype(int), np.asarray(rows)[:, 2]
    key_row = {int(i): n for n, (i, j) in enumerate(pairs) if i == j}
    found = [[n] for n in key_row.values()]
    drawn = {(int(i), int(j)) for i, j in pairs if i != j}
    bare = {(i, j) for i in key_row for j in key_row if i < j and (i, j) not in drawn and (j, i) not in drawn}
    for i, j in sorted(drawn | bare):
        between = np.flatnonzero((pairs == (i, j)).all(axis=1))
        chain = [key_row[i], *between[np.argsort(along[between])].tolist(), key_row[j]]
        others = [n for k, n in key_row.items() if k not in (i, j)]
        for step in pairwise(chain):
            found += [[*step, *more] for count in range(most - 1) for more in combinations(others, count)]
    return list({frozenset(support): support for support in found}.values())


def _key_count(rows: NDArray) -> int:
    return int(np.sum(np.asarray(rows)[:, 0] == np.asarray(rows)[:, 1]))


def _checked(
    tracked: NDArray, shapes: NDArray, bounds: tuple[float, float], most: int, together: int
) -> tuple[NDArray, NDArray]:
    """Shapes as floats, if weights can be fitted to them; at most `most` rows, and `together`, can be mixed."""
    tracked, shapes = np.asarray(tracked, float), np.asarray(shapes, float)
    if (
        shapes.ndim < 2
        or 0 in shapes.shape
        or 0 in tracked.shape
        or tracked.ndim != shapes.ndim
        or tracked.shape[1:] != shapes.shape[1:]
    ):
        raise InputError(
            f"tracked shapes must have the points of the rows' shapes, {tracked.shape} came with {shapes.shape}: "
            "bring them into correspondence first"
        )
    for name, array in (("tracked shapes", tracked), ("rows' shapes", shapes)):
        if not np.isfinite(array).all():
            number = int(np.flatnonzero(~np.isfinite(array).reshape(len(array), -1).all(axis=1))[0])
            raise InputError(
                f"{name} must be finite, number {number} (counted from 0) holds NaN or infinity: leave it out"
            )
    if not 1 <= most <= max(together, MOST):  # three of two rows are two: the default asks for nothing wrong
        raise InputError(
            f"the number of rows used at a time must lie between 1 and the {together} that can be mixed, "
            f"{most} came: change it"
        )
    low, high = bounds
    rows = min(most, together)
    if not (low <= 1 / rows <= high):
        raise InputError(f"bounds must let {rows} weights sum to 1, [{low:g}, {high:g}] do not: widen them")
    if rows < len(shapes) and not low <= 0 <= high:
        raise InputError(f"bounds must hold 0, for not all rows are used, [{low:g}, {high:g}] do not: widen them")
    return tracked, shapes
