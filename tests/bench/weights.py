"""Key weights of a clip: exact, dense and smooth, each against cvxpy or SCIP on the same frames.

`misfit_above_...` says how much worse than the peer's our squared misfit is, relative to the peer's: 0, or less where
the peer stops at a tolerance.
"""

from time import perf_counter

import numpy as np

from capture.fit.shapes import weights as key_weights
from capture.motion import keys

FRAMES = 240
LOW, HIGH = -0.5, 1.5


def rows():
    """Milliseconds a frame and ratios of the peer's time to ours."""
    return _of_rows() | _dense() | _any()


def _of_rows():
    """The rows of 4 and of 8 keys, against one cvxpy problem per support and frame."""
    import cvxpy as cp

    found = {}
    for count in (4, 8):
        keyset, shapes = _wobbles(count)
        rng = np.random.default_rng(0)
        tracked = shapes[rng.integers(len(shapes), size=FRAMES)] + rng.normal(0, 2, (FRAMES, *shapes.shape[1:]))
        far = shapes.mean(axis=0) + rng.normal(0, 40, (FRAMES, *shapes.shape[1:]))
        weights, ours = _timed(lambda: key_weights.fit_weights(tracked, shapes, keyset.rows, simpler=1.0))  # noqa: B023
        _, beyond = _timed(lambda: key_weights.fit_weights(far, shapes, keyset.rows, simpler=1.0))  # noqa: B023
        _, even = _timed(lambda: key_weights.fit_smooth(tracked, shapes, keyset.rows, 2.0))  # noqa: B023
        found[f"ms_{len(shapes)}_rows"] = ours
        found[f"ms_{len(shapes)}_rows_bounds_active"] = beyond
        found[f"ms_{len(shapes)}_rows_smooth"] = even
        if count == 8:
            continue
        supports = key_weights.supports(keyset.rows)
        flat = shapes.reshape(len(shapes), -1).T
        start, worse = perf_counter(), -np.inf
        for frame in range(2):  # it takes a second a frame
            best = np.inf
            for support in supports:
                w = cp.Variable(len(support))
                misfit = cp.sum_squares(flat[:, support] @ w - tracked[frame].ravel())
                problem = cp.Problem(cp.Minimize(misfit), [cp.sum(w) == 1, w >= LOW, w <= HIGH])
                best = min(best, problem.solve())
            worse = max(worse, _misfit(weights[frame], shapes, tracked[frame]) / best - 1)
        found |= {"ratio_to_cvxpy_per_support": 1e3 * (perf_counter() - start) / 2 / ours, "misfit_above_cvxpy": worse}
    return found


def _dense():
    """All keys at once, against one parametrised (DPP) cvxpy problem a frame by the quicker of two solvers.

    The ratio is that of shapes so far off that most frames touch a bound; near ones take a single solve for all.
    """
    import cvxpy as cp

    found = {}
    for count in (8, 20):
        shapes, near = _keys(count)
        tracked = near + np.random.default_rng(1).normal(0, 150, near.shape)
        weights, ours = _timed(lambda: key_weights.fit_dense(tracked, shapes))  # noqa: B023
        touching = np.mean(((weights < LOW + 1e-6) | (weights > HIGH - 1e-6)).any(axis=1))
        flat = shapes.reshape(count, -1)
        root = np.linalg.qr(flat.T, mode="r")  # |w S|^2 = |root w|^2: no data of N points in the peer's problem either
        w, cross = cp.Variable(count), cp.Parameter(count)
        wish = cp.sum_squares(root @ w) - 2 * cross @ w
        problem = cp.Problem(cp.Minimize(wish), [cp.sum(w) == 1, w >= LOW, w <= HIGH])
        times, worse = [], -np.inf
        for solver in ("CLARABEL", "PIQP"):
            start = 0.0
            for at, frame in enumerate(tracked):
                if at == 1:
                    start = perf_counter()  # the first frame compiles
                cross.value = flat @ frame.ravel()
                problem.solve(solver=solver)
                gap = _misfit(weights[at], shapes, frame) / _misfit(w.value, shapes, frame) - 1
                worse = max(worse, gap)
            times.append(1e3 * (perf_counter() - start) / (FRAMES - 1))
        found |= {
            f"dense_ms_{count}_keys": ours,
            f"dense_ms_{count}_keys_near": _timed(lambda: key_weights.fit_dense(near, shapes))[1],  # noqa: B023
            f"dense_share_at_bounds_{count}_keys": touching,
            f"ratio_to_cvxpy_per_frame_{count}_keys": min(times) / ours,
            f"dense_misfit_above_cvxpy_{count}_keys": worse,
        }
    return found | {"ratio_to_cvxpy_per_frame": min(found[f"ratio_to_cvxpy_per_frame_{k}_keys"] for k in (8, 20))}


def _any():
    """At most 3 of 8 keys, against a mixed-integer program; for 20 keys our time alone."""
    shapes, tracked = _keys(8)
    weights, ours = _timed(lambda: key_weights.fit_any(tracked, shapes, 3))
    many, more = _keys(20)
    found = {"any_ms_8_rows": ours, "any_ms_20_rows": _timed(lambda: key_weights.fit_any(more, many, 3))[1]}
    try:
        import pyscipopt  # noqa: F401
    except ImportError:
        print("weights.ratio_to_miqp: skipped, pyscipopt is not installed")
        return found
    import cvxpy as cp

    flat = shapes.reshape(8, -1)
    root = np.linalg.qr(flat.T, mode="r")
    start, worse = perf_counter(), -np.inf
    for frame in range(4):
        w, used = cp.Variable(8), cp.Variable(8, boolean=True)
        wish = cp.sum_squares(root @ w) - 2 * (flat @ tracked[frame].ravel()) @ w
        limits = [cp.sum(w) == 1, w >= LOW * used, w <= HIGH * used, cp.sum(used) <= 3]
        cp.Problem(cp.Minimize(wish), limits).solve(solver="SCIP")
        peer = _misfit(w.value, shapes, tracked[frame])
        worse = max(worse, _misfit(weights[frame], shapes, tracked[frame]) / peer - 1)
    peer_ms = 1e3 * (perf_counter() - start) / 4
    return found | {"miqp_ms": peer_ms, "ratio_to_miqp": peer_ms / ours, "misfit_above_miqp": worse}


def _timed(work):
    """What it returns, and its best of five times in milliseconds a frame."""
    times = []
    for _ in range(5):
        start = perf_counter()
        result = work()
        times.append(perf_counter() - start)
    return result, 1e3 * min(times) / FRAMES


def _misfit(weights, shapes, tracked):
    return np.sum((np.tensordot(weights, shapes, axes=1) - tracked) ** 2)


def _keys(count):
    """Plain keys (K, N, 2) and mixes of four of them with 2 px of noise (T, N, 2)."""
    rng = np.random.default_rng(count)
    angle = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    base = np.column_stack([100 * np.cos(angle), 70 * np.sin(angle)])
    waves = np.stack([np.cos(angle[:, None] * n + (0, 1)) for n in range(1, 25)])  # (24, N, 2)
    shapes = base + np.tensordot(rng.normal(0, 6, (count, 24)), waves, axes=1)
    weights = np.zeros((FRAMES, count))
    for frame in weights:
        frame[rng.choice(count, 4, replace=False)] = rng.dirichlet(np.ones(4)) * 1.6 - 0.15
    return shapes, np.tensordot(weights, shapes, axes=1) + rng.normal(0, 2, (FRAMES, 60, 2))


def _wobbles(count):
    """A key set of `count` wobbling blobs with five in-betweens for each pair: 34 rows of 4 keys, 148 of 8."""
    angle = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    base = np.column_stack([100 * np.cos(angle), 70 * np.sin(angle)])
    bends = [20 * np.column_stack([np.sin(k * angle + k), np.cos((k + 1) * angle)]) for k in range(1, count)]
    keyset = keys.keyset(tuple("abcdefgh"[:count]), np.stack([base, *(base + bend for bend in bends)]))
    return keyset, keys.shapes(keyset)
