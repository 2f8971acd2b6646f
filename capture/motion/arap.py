"""As rigid as possible: key meshes mixed (Alexa 2000), and a mesh carried along by a few points.

A triangle's way from one key to another is split into a turn and a stretch; half-way it has half the turn and
half the stretch.  The triangles then disagree about their shared corners, and one linear solve settles that.
Turns and stretches of any number of keys are mixed by weights alike (Baxter, Barla & Anjyo 2009); the equations
are summed over every key as the one to start from, which makes the result symmetric in the keys.  Turns are
unwrapped over the triangle graph, so that a curling tail turns by 270 deg and not by -90.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.motion import affine


def inbetweens(keys: NDArray, faces: NDArray, rows: NDArray) -> NDArray:
    """Shapes (D, N, 2) for rows (D, 3) of [i, j, s]: key i, s of the way to key j, of keys (K, N, 2).

    A row's ends are the keys themselves; s outside [0, 1] carries the turn and stretch on.
    """
    keys, rows = np.asarray(keys, float), np.asarray(rows, float)
    shapes = np.empty((len(rows), *keys.shape[1:]))
    pairs = rows[:, :2].astype(int)
    for i, j in np.unique(pairs, axis=0):
        of_pair = np.flatnonzero((pairs == (i, j)).all(axis=1))
        shapes[of_pair] = keys[i] if i == j else _mix(keys[[i, j]], faces, _either_way(rows[of_pair, 2]))
    return shapes


def mix(keys: NDArray, faces: NDArray, weights: NDArray) -> NDArray:
    """Shapes (T, N, 2) that mix the turns and stretches of keys (K, N, 2) by weights (T, K), rows of sum 1.

    Seen from key i, a face is turned by sum_k w_k theta_ik and stretched by sum_k w_k S_ik, where R(theta_ik) S_ik
    takes it from key i to key k; the squared misfits, by area, are summed over all i.  A weight of 1 redraws its key,
    and two keys give exactly their in-betweens.  With more keys, those of weight 0 still say where the misfit is
    measured from, so that a weight may leave 0 without a jump: shapes between two of them then differ a little
    from `inbetweens`.  Turns are counted from the key that is turned least against the others.
    """
    keys, weights = np.asarray(keys, float), np.asarray(weights, float)
    if weights.ndim != 2 or weights.shape[1] != len(keys) or not np.allclose(weights.sum(axis=1), 1, atol=1e-6):
        raise InputError(
            f"weights need rows of sum 1 and one column for each of the {len(keys)} keys, they came with shape "
            f"{weights.shape} and sums from {weights.sum(axis=-1).min():g} to {weights.sum(axis=-1).max():g}: "
            "divide each row by its sum"
        )
    return _mix(keys, faces, weights)


def straight_inbetweens(keys: NDArray, faces: NDArray, rows: NDArray) -> NDArray:
    """The same rows on straight lines: (1 - s) of key i and s of key j.  Faces are not looked at."""
    keys, rows = np.asarray(keys, float), np.asarray(rows, float)
    i, j, s = rows[:, 0].astype(int), rows[:, 1].astype(int), rows[:, 2, None, None]
    return (1 - s) * keys[i] + s * keys[j]


def carry(
    mesh: NDArray, faces: NDArray, handles: NDArray, shares: NDArray, goals: NDArray, rounds: int = 60
) -> NDArray:
    """Move a mesh (N, 2) as rigidly as possible so that points of it reach their goals (P, 2).

    A point p is the mix `shares` (P, 3) of the mesh points `handles` (P, 3).  Local turns and one factored
    global solve alternate (Sorkine & Alexa 2007), from the best affine map on; returns points (N, 2).
    """
    from scipy import sparse
    from scipy.sparse.linalg import splu

    count = len(mesh)
    differences = _differences(mesh, faces)
    rows = np.repeat(np.arange(len(handles)), handles.shape[1])
    mix = sparse.csr_matrix((shares.ravel(), (rows, handles.ravel())), shape=(len(handles), count))
    pull = 1e3 * differences.area.sum() / max(len(handles), 1) / np.ptp(mesh, axis=0).max() ** 2
    solve = splu((differences.laplacian() + pull * mix.T @ mix + 1e-12 * sparse.eye(count)).tocsc()).solve
    at_rest = mix @ mesh
    moved = affine.apply(affine.fit(at_rest, goals), mesh)
    for _ in range(rounds):
        turns = _rotation(affine.turn(differences.jacobians(moved)))
        last, moved = moved, solve(differences.divergence(turns) + pull * (mix.T @ goals))
        if np.abs(moved - last).max() < 1e-4 * np.ptp(mesh, axis=0).max():
            break
    return moved


def ways(mesh: NDArray, moved: NDArray, faces: NDArray) -> tuple[NDArray, NDArray]:
    """How each face goes from a mesh (N, 2) to its places `moved` (K, N, 2): turns (K, F) and stretches (K, F, 2, 2).

    The linear map of a face is R(turn) stretch; turns are unwrapped, so that they may be averaged over neighbours.
    """
    start = _differences(np.asarray(mesh, float), faces)
    maps = np.stack([start.jacobians(points) for points in moved])
    turns = _unwrap(affine.turn(maps), faces, start.area)
    return turns, np.swapaxes(_rotation(turns), -1, -2) @ maps


def laplacian(mesh: NDArray, faces: NDArray) -> object:
    """The sparse symmetric matrix (N, N) whose quadratic form says how much a field over a mesh (N, 2) varies."""
    return _differences(np.asarray(mesh, float), faces).laplacian()


def follow(mesh: NDArray, faces: NDArray, turns: NDArray, stretches: NDArray) -> NDArray:
    """Shapes (K, N, 2) of a mesh (N, 2) whose faces go as near as possible to their own `ways`; their centres stay."""
    mesh = np.asarray(mesh, float)
    start = _differences(mesh, faces)
    right = start.divergence(_rotation(turns) @ stretches)
    return _solve(start.laplacian(), right, np.broadcast_to(mesh, (len(turns), *mesh.shape)))


def _mix(keys: NDArray, faces: NDArray, weights: NDArray) -> NDArray:
    starts = [_differences(key, faces) for key in keys]
    ways = np.stack([[start.jacobians(key) for key in keys] for start in starts])  # (K, K, F, 2, 2), from and to
    area = np.mean([start.area for start in starts], axis=0)
    turns = _turns_between(ways, faces, area)
    stretches = np.swapaxes(_rotation(turns), -1, -2) @ ways  # symmetric
    right = 0.0
    for start, turn, stretch in zip(starts, turns, stretches):
        goals = _rotation(weights @ turn) @ np.tensordot(weights, stretch, axes=1)  # (T, F, 2, 2)
        right = right + start.divergence(goals)
    anchors = np.tensordot(weights, keys, axes=1)
    return _solve(sum(start.laplacian() for start in starts), right, anchors)


def _turns_between(ways: NDArray, faces: NDArray, area: NDArray) -> NDArray:
    """Turns (K, K, F) of the maps (K, K, F, 2, 2) from key to key, whole turns counted alike from all keys."""
    forth, back = np.triu_indices(len(ways), 1)
    turns, smooth = np.zeros((2, *ways.shape[:3]))
    turns[forth, back] = affine.turn(ways[forth, back])
    smooth[forth, back] = _unwrap(turns[forth, back], faces, area)
    turns, smooth = (
        turns - np.swapaxes(turns, 0, 1),
        smooth - np.swapaxes(smooth, 0, 1),
    )  # the way back is the turn back
    base = np.argmin((smooth**2 @ area).sum(axis=1))  # never key 0 as such: the order of keys is to mean nothing
    counted = smooth[base] - smooth[base][:, None]
    return turns + 2 * np.pi * np.round((counted - turns) / (2 * np.pi))


def _either_way(s: NDArray) -> NDArray:
    return np.column_stack([1 - s, s])


@dataclass(frozen=True, eq=False)
class _Differences:
    """The linear maps of a mesh at rest: how any placement of its corners turns and stretches each face."""

    operator: object  # sparse (2 F, N): x-derivatives, then y-derivatives
    area: NDArray  # (F,)

    def jacobians(self, points: NDArray) -> NDArray:
        """Per face (F, 2, 2) the linear map from rest to `points` (N, 2)."""
        return np.moveaxis((self.operator @ points).reshape(2, len(self.area), 2), 0, -1)

    def divergence(self, goals: NDArray) -> NDArray:
        """Right-hand sides (..., N, 2) that ask for the linear maps `goals` (..., F, 2, 2)."""
        weighted = np.moveaxis(goals * self.area[:, None, None], -1, -3)  # (..., derivative, F, axis)
        flat = weighted.reshape(*goals.shape[:-3], 2 * len(self.area), 2)
        columns = np.moveaxis(flat, -2, 0).reshape(2 * len(self.area), -1)
        right = np.asarray(self.operator.T @ columns)
        return np.moveaxis(right.reshape(-1, *goals.shape[:-3], 2), 0, -2)

    def laplacian(self) -> object:
        """The symmetric sparse matrix (N, N) of the least-squares problem."""
        from scipy import sparse

        return self.operator.T @ sparse.diags(np.tile(self.area, 2)) @ self.operator


def _differences(rest: NDArray, faces: NDArray) -> _Differences:
    from scipy import sparse

    corners = rest[faces]
    edges = np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=-1)
    area = 0.5 * np.linalg.det(edges)
    thin = np.abs(area) < 1e-9 * np.abs(area).max()  # a collapsed face has no opinion
    edges[thin] = np.eye(2)
    inverse = np.linalg.inv(edges)  # rows: shares of edge 1 and edge 2
    slopes = np.concatenate([-inverse.sum(axis=1, keepdims=True), inverse], axis=1)  # (F, 3, 2)
    count = len(faces)
    row = np.arange(count)[:, None, None] + count * np.arange(2)[None, None, :]
    row = np.broadcast_to(row, slopes.shape)
    column = np.broadcast_to(faces[:, :, None], slopes.shape)
    operator = sparse.csr_matrix((slopes.ravel(), (row.ravel(), column.ravel())), shape=(2 * count, len(rest)))
    return _Differences(operator, np.where(thin, 0.0, np.abs(area)))


def _rotation(angle: NDArray) -> NDArray:
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([np.stack([c, -s], -1), np.stack([s, c], -1)], -2)


def _unwrap(angle: NDArray, faces: NDArray, area: NDArray) -> NDArray:
    """Angles (..., F) made continuous from each face to its neighbours; each piece's mean stays in (-pi, pi]."""
    from scipy.sparse import csgraph

    graph = _neighbours(faces)
    _, piece = csgraph.connected_components(graph, directed=False)
    _, seeds = np.unique(piece, return_index=True)
    steps, before, _ = csgraph.dijkstra(
        graph, directed=False, indices=seeds, unweighted=True, min_only=True, return_predecessors=True
    )
    unwrapped, whole = np.array(angle, float), 2 * np.pi
    by_steps = np.argsort(steps, kind="stable")
    for ring in np.split(by_steps, np.searchsorted(steps[by_steps], np.arange(1, steps.max() + 1)))[1:]:
        nearest = unwrapped[..., before[ring]]
        unwrapped[..., ring] += whole * np.round((nearest - unwrapped[..., ring]) / whole)
    for number in range(len(seeds)):
        members = piece == number
        mean = np.average(unwrapped[..., members], axis=-1, weights=area[members] + 1e-30)
        unwrapped[..., members] -= whole * np.round(mean / whole)[..., None]
    return unwrapped


def _neighbours(faces: NDArray) -> object:
    """Sparse graph (F, F) of faces that share an edge."""
    from scipy import sparse

    count, size = len(faces), int(faces.max()) + 1
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    _, name = np.unique(edges @ [size, 1], return_inverse=True)
    of_face = np.tile(np.arange(count), 3)
    incidence = sparse.csr_matrix((np.ones(3 * count), (of_face, name)))
    return incidence @ incidence.T


def _solve(matrix: object, right: NDArray, anchors: NDArray) -> NDArray:
    """Solve for all right-hand sides (S, N, 2) at once; each connected piece keeps its anchors' centre.

    What only collapsed faces join is not connected: a point that has no other faces is a piece of its own.
    """
    from scipy import sparse
    from scipy.sparse import csgraph
    from scipy.sparse.linalg import splu

    count = right.shape[1]
    stiff = sparse.csr_matrix(matrix)
    stiff.eliminate_zeros()
    pieces, piece = csgraph.connected_components(stiff, directed=False)
    pins = np.array([np.flatnonzero(piece == number)[0] for number in range(pieces)])
    hold = sparse.csr_matrix((np.full(pieces, matrix.diagonal().mean()), (pins, pins)), shape=(count, count))
    solver = splu((matrix + hold).tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    shapes = solver.solve(np.moveaxis(right, 1, 0).reshape(count, -1)).reshape(count, len(right), 2)
    shapes = np.moveaxis(shapes, 0, 1)
    for number in range(pieces):
        members = piece == number
        shapes[:, members] += (anchors[:, members] - shapes[:, members]).mean(axis=1, keepdims=True)
    return shapes
