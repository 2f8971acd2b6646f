"""In-betweens a second: all at once, against rebuilding and solving each, and beside libigl's deformation.

libigl has no interpolation: its as-rigid-as-possible handle deformation, prefactored and with the ends of a bar
as handles, is the nearest thing there is (10 rounds of local turns and global solve each).
"""

from time import perf_counter

import numpy as np

from capture.motion import arap

SIZES = {500: (44, 12), 2000: (90, 23)}  # vertices along and across
MANY = 100  # in-betweens of one pair, as a whole clip asks for


def rows():
    """Per size: in-betweens a second, set-up included, and how many times those of the others that is."""
    found = {}
    for size, (columns, across) in SIZES.items():
        mesh, faces = _bar(columns, across)
        ends = np.stack([mesh, _curled(mesh, np.radians(120))])
        steps = np.linspace(0.05, 0.95, MANY)
        one_by_one = steps[::10]
        ours = _rate(lambda: arap.inbetweens(ends, faces, np.array([(0, 1, s) for s in steps])), MANY)  # noqa: B023
        naive = _rate(lambda: [_naive(ends, faces, s) for s in one_by_one], len(one_by_one))  # noqa: B023
        found |= {f"per_second_{size}": ours, f"ratio_to_naive_{size}": ours / naive}
        found[f"points_off_naive_{size}"] = np.abs(
            _naive(ends, faces, 0.3) - arap.inbetweens(ends, faces, np.array([(0, 1, 0.3)]))[0]
        ).max()
        four = np.stack([_curled(mesh, np.radians(wind)) for wind in (1e-3, 120, -60, 90)])
        weights = np.random.default_rng(0).dirichlet(np.ones(4), MANY)
        found[f"four_keys_per_second_{size}"] = _rate(lambda: arap.mix(four, faces, weights), MANY)  # noqa: B023
        peer = _libigl(mesh, faces, ends[1])
        if peer is not None:
            found[f"ratio_to_libigl_{size}"] = ours / _rate(peer, 10)
    return found


def _naive(ends, faces, s):
    """One in-between, everything built anew and solved by spsolve; turns are not even unwrapped."""
    from scipy import sparse
    from scipy.sparse.linalg import spsolve

    left, right = 0.0, 0.0
    for (start, end), part in ((ends, s), (ends[::-1], 1 - s)):
        corners = start[faces]
        edges = np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=-1)
        inverse = np.linalg.inv(edges)
        slopes = np.concatenate([-inverse.sum(axis=1, keepdims=True), inverse], axis=1)  # (F, 3, 2)
        at = np.arange(len(faces))[:, None, None] + len(faces) * np.arange(2)
        places = (np.broadcast_to(at, slopes.shape).ravel(), np.broadcast_to(faces[..., None], slopes.shape).ravel())
        gradient = sparse.csr_matrix((slopes.ravel(), places), shape=(2 * len(faces), len(start)))
        area = sparse.diags(np.tile(np.linalg.det(edges) / 2, 2))
        way = (gradient @ end).reshape(2, len(faces), 2).transpose(1, 2, 0)
        u, sigma, vt = np.linalg.svd(way)
        turn, stretch = u @ vt, np.swapaxes(vt, 1, 2) @ (sigma[..., None] * vt)
        angle = part * np.arctan2(turn[:, 1, 0], turn[:, 0, 0])
        c, d = np.cos(angle), np.sin(angle)
        goal = np.moveaxis(np.array([[c, -d], [d, c]]), -1, 0) @ ((1 - part) * np.eye(2) + part * stretch)
        left = left + gradient.T @ area @ gradient
        right = right + gradient.T @ area @ goal.transpose(2, 0, 1).reshape(-1, 2)
    pin = sparse.csr_matrix(([1.0], ([0], [0])), shape=left.shape)
    shape = spsolve((left + pin).tocsc(), right)
    return shape + ((1 - s) * ends[0] + s * ends[1] - shape).mean(axis=0)


def _libigl(mesh, faces, goal):
    """Ten deformations, prefactored, or None where libigl is not installed."""
    try:
        import igl
    except ImportError:
        print("arap.ratio_to_libigl: skipped, libigl is not installed")
        return None
    ends = np.flatnonzero((mesh[:, 0] == mesh[:, 0].min()) | (mesh[:, 0] == mesh[:, 0].max())).astype(np.int32)
    data = igl.ARAPData()
    data.max_iter = 10
    igl.arap_precomputation(np.asarray(mesh), faces.astype(np.int64), 2, ends, data)

    def deform():
        for s in np.linspace(0.05, 0.95, 10):
            igl.arap_solve((1 - s) * mesh[ends] + s * goal[ends], data, np.array(mesh))

    return deform


def _rate(work, count):
    """How many a second, from the best of five runs."""
    times = []
    for _ in range(5):
        start = perf_counter()
        work()
        times.append(perf_counter() - start)
    return count / min(times)


def _bar(columns, across):
    x, y = np.meshgrid(np.linspace(0, 100, columns), np.linspace(-12, 12, across))
    corner = (np.arange(across - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    below = corner + columns
    faces = np.concatenate([np.stack([corner, corner + 1, below + 1], -1), np.stack([corner, below + 1, below], -1)])
    return np.column_stack([x.ravel(), y.ravel()]), faces


def _curled(points, total):
    angle, radius = total * points[:, 0] / 100, 100 / total
    r = radius - points[:, 1]
    return np.column_stack([r * np.sin(angle), radius - r * np.cos(angle)])
