"""Sparse key weights of a clip: all supports in closed form, against one cvxpy problem per support and frame."""

from time import perf_counter

import numpy as np

from capture.fit import weights as key_weights
from capture.motion import keys


def rows():
    """Milliseconds a frame, and how much worse than cvxpy's best our misfit is (it should be 0)."""
    import cvxpy as cp

    keyset, shapes = _wobbles()
    rng = np.random.default_rng(0)
    tracked = shapes[rng.integers(len(shapes), size=240)] + rng.normal(0, 2, (240, *shapes.shape[1:]))
    start = perf_counter()
    found = key_weights.fit_weights(tracked, shapes, keyset.rows, simpler=1.0)
    ours = 1e3 * (perf_counter() - start) / len(tracked)
    ours_gap = [np.sum((np.tensordot(w, shapes, axes=1) - v) ** 2) for w, v in zip(found, tracked)]

    supports = key_weights.supports(keyset.rows)
    flat = shapes.reshape(len(shapes), -1).T
    start, worse = perf_counter(), 0.0
    for frame in range(2):  # it takes a second a frame
        best = np.inf
        for support in supports:
            w = cp.Variable(len(support))
            misfit = cp.sum_squares(flat[:, support] @ w - tracked[frame].ravel())
            problem = cp.Problem(cp.Minimize(misfit), [cp.sum(w) == 1, w >= -0.5, w <= 1.5])
            best = min(best, problem.solve())
        worse = max(worse, ours_gap[frame] / best - 1)
    peer = 1e3 * (perf_counter() - start) / 2
    return {"ours_ms": ours, "cvxpy_ms": peer, "time_ours_to_cvxpy": ours / peer, "misfit_above_cvxpy": worse}


def _wobbles():
    angle = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    base = np.column_stack([100 * np.cos(angle), 70 * np.sin(angle)])
    bends = (
        0 * base,
        [20, 0] * np.sin(2 * angle)[:, None],
        [0, 25] * np.cos(3 * angle)[:, None],
        15 * np.cos(base / 30),
    )
    keyset = keys.keyset(("a", "b", "c", "d"), np.stack([base + bend for bend in bends]))
    return keyset, keys.shapes(keyset)
