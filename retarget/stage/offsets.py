"""The calmest way to move a whole performance so that it meets its constraints: one quadratic program an axis.

Over drawings t that are shown for c_t seconds, an offset o minimises

    sum_t c_t o_t^2  +  tau^4 * integral (o'')^2

so that o is what is demanded at some drawings, anything else at the others.  What is demanded is met exactly, for those
drawings are no unknowns; away from them the offset goes over smoothly, adds no more acceleration than it must, and is
forgotten: half of it after `half_life` seconds.  For a foot that is set down while another stands c_t hardly counts:
longer legs walk farther, and to be pulled back at every step would be a lurch.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

HALF_WIDTH = 1.4332787816903483
"""Where exp(-x / sqrt 2) (cos + sin)(x / sqrt 2), the answer to a demand at 0 for tau = 1, has fallen to a half."""

STANDING = 1e-4
"""What a second of a foot that came down while another stood counts, against one in the air."""

Path = tuple[NDArray, NDArray]
"""Numbers of drawings (n,), and a curve (n,) that the offset follows there, but for a constant of its own."""


def calmest(
    times: NDArray, half_life: float, fixed: NDArray, paths: Sequence[Path] = (), most: NDArray | None = None
) -> NDArray:
    """The offset (D,) for drawings that begin at `times` (D,), in seconds.

    `fixed` (D,) is the offset where it is known, NaN elsewhere; a drawing lies on one path at most, and is not fixed.
    `most` (D,) is what the offset may be at most where it is not fixed.
    """
    count = len(times)
    if count < 3:
        return _few(fixed, most)
    known = np.isfinite(fixed)
    spread, given = _unknowns(known, np.where(known, fixed, 0.0), paths)
    alone, counts = _alone(known, paths), np.ones(count)
    for on, _ in paths:
        if on[0] > 0 and not alone[on[0] - 1]:
            counts[on] = STANDING
    metric = _metric(times, half_life / HALF_WIDTH, counts)
    rate = (spread.T @ metric @ spread).tocsc()
    pull = spread.T @ (metric @ given)
    if not spread.shape[1]:
        return given
    from scipy.sparse.linalg import spsolve

    offset = spread @ spsolve(rate, -pull) + given
    if most is None or (offset <= most)[~known].all():
        return offset
    free = np.flatnonzero(~known & np.isfinite(most))
    offset = spread @ _held_below(rate, pull, spread[free], (most - given)[free]) + given
    offset[alone] = np.minimum(offset, most)[alone]  # the solver's last digits: no drawing goes deeper than it may
    return offset


def _few(fixed: NDArray, most: NDArray | None) -> NDArray:
    offset = np.where(np.isfinite(fixed), fixed, 0.0)
    return offset if most is None else np.where(np.isfinite(fixed), offset, np.minimum(offset, most))


def _unknowns(known: NDArray, values: NDArray, paths: Sequence[Path]) -> tuple[object, NDArray]:
    """The sparse (D, U) and the (D,) that make offsets of unknowns: free drawings, then one constant a path."""
    from scipy import sparse

    given = values.copy()
    alone = np.flatnonzero(_alone(known, paths))
    rows, columns = [alone], [np.arange(len(alone))]
    for number, (on, curve) in enumerate(paths):
        given[on] = curve
        rows.append(on)
        columns.append(np.full(len(on), len(alone) + number))
    rows, columns = np.concatenate(rows), np.concatenate(columns)
    return sparse.csr_matrix((np.ones(len(rows)), (rows, columns)), (len(known), len(alone) + len(paths))), given


def _alone(known: NDArray, paths: Sequence[Path]) -> NDArray:
    alone = ~known
    for on, _ in paths:
        alone[on] = False
    return alone


def _metric(times: NDArray, tau: float, counts: NDArray) -> object:
    """C + tau^4 D2' D2 (D, D), sparse, with second differences for drawings of any spacing."""
    from scipy import sparse

    step = np.diff(times)
    shown = counts * np.append(step, np.median(step))
    before, after, root = 1 / step[:-1], 1 / step[1:], np.sqrt((step[1:] + step[:-1]) / 2)
    bands = [before / root, -(before + after) / root, after / root]
    second = sparse.diags(bands, [0, 1, 2], shape=(len(times) - 2, len(times)))
    return sparse.diags(shown) + tau**4 * second.T @ second


def _held_below(rate: object, pull: NDArray, rows: object, most: NDArray) -> NDArray:
    import piqp
    from scipy import sparse

    scale = 1 / np.abs(rate.diagonal()).max()
    solver = piqp.SparseSolver()
    solver.settings.eps_abs = solver.settings.eps_rel = 1e-10
    empty = sparse.csc_matrix((0, rate.shape[0]))
    low = np.full(len(most), -np.inf)
    solver.setup((scale * rate).tocsc(), scale * pull, empty, np.zeros(0), rows.tocsc(), low, most, None, None)
    solver.solve()
    return np.array(solver.result.x)
