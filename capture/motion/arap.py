"""As rigid as possible: in-betweens of two key meshes (Alexa 2000), and a mesh carried along by a few points.

A triangle's way from key i to key j is split into a turn and a stretch; half-way it has half the turn and
half the stretch.  The triangles then disagree about their shared corners, and one linear solve settles that.
The equations are summed over both directions, i to j and j to i, which makes the result symmetric in its
ends (Baxter, Barla & Anjyo 2009).  Turns are unwrapped over the triangle graph, so that a curling tail
turns by 270 deg and not by -90.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
        shapes[of_pair] = keys[i] if i == j else _between(keys[i], keys[j], faces, rows[of_pair, 2])
    return shapes


def straight_inbetweens(keys: NDArray, faces: NDArray, rows: NDArray) -> NDArray:
    """The same rows on straight lines: (1 - s) of key i and s of key j.  Faces are not looked at."""
    keys, rows = np.asarray(keys, float), np.asarray(rows, float)
    i, j, s = rows[:, 0].astype(int), rows[:, 1].astype(int), rows[:, 2, None, None]
    return (1 - s) * keys[i] + s * keys[j]


def _between(start: NDArray, end: NDArray, faces: NDArray, s: NDArray) -> NDArray:
    """Shapes (S, N, 2) at parameters s (S,) of the way from `start` to `end` (N, 2)."""
    forth, back = _differences(start, faces), _differences(end, faces)
    way = forth.jacobians(end)  # (F, 2, 2)
    angle = _unwrap(affine.turn(way), faces, forth.area)
    stretch = np.swapaxes(_rotation(angle), -1, -2) @ way  # symmetric
    turned_back = back.jacobians(start)
    stretch_back = _rotation(angle) @ turned_back
    s = np.asarray(s, float)[:, None, None, None]
    eye = np.eye(2)
    goal_forth = _rotation(angle * s[..., 0, 0]) @ ((1 - s) * eye + s * stretch)  # (S, F, 2, 2)
    goal_back = _rotation(-angle * (1 - s[..., 0, 0])) @ (s * eye + (1 - s) * stretch_back)
    right = forth.divergence(goal_forth) + back.divergence(goal_back)  # (S, N, 2)
    anchors = (1 - s[..., 0]) * start + s[..., 0] * end
    return _solve(forth.laplacian() + back.laplacian(), right, faces, anchors)


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
    """Angles (F,) made continuous from each face to its neighbours, breadth first; the mean stays in (-pi, pi]."""
    from scipy.sparse import csgraph

    graph = _neighbours(faces)
    unwrapped = angle.copy()
    _, piece = csgraph.connected_components(graph, directed=False)
    for number in range(piece.max() + 1):
        members = np.flatnonzero(piece == number)
        order, before = csgraph.breadth_first_order(graph, members[0], directed=False)
        for face in order[1:]:
            nearest = unwrapped[before[face]]
            unwrapped[face] = nearest + (angle[face] - nearest + np.pi) % (2 * np.pi) - np.pi
        mean = np.average(unwrapped[members], weights=area[members] + 1e-30)
        unwrapped[members] -= 2 * np.pi * np.round(mean / (2 * np.pi))
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


def _solve(matrix: object, right: NDArray, faces: NDArray, anchors: NDArray) -> NDArray:
    """Solve for all right-hand sides (S, N, 2) at once; each connected piece keeps its anchors' centre."""
    from scipy import sparse
    from scipy.sparse import csgraph
    from scipy.sparse.linalg import splu

    count = right.shape[1]
    edges = sparse.csr_matrix(
        (np.ones(2 * len(faces)), (faces[:, [0, 1]].T.ravel(), faces[:, [1, 2]].T.ravel())), shape=(count, count)
    )
    pieces, piece = csgraph.connected_components(edges, directed=False)
    pins = np.array([np.flatnonzero(piece == number)[0] for number in range(pieces)])
    hold = sparse.csr_matrix((np.full(pieces, matrix.diagonal().mean()), (pins, pins)), shape=(count, count))
    solver = splu((matrix + hold).tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    shapes = solver.solve(np.moveaxis(right, 1, 0).reshape(count, -1)).reshape(count, len(right), 2)
    shapes = np.moveaxis(shapes, 0, 1)
    for number in range(pieces):
        members = piece == number
        shapes[:, members] += (anchors[:, members] - shapes[:, members]).mean(axis=1, keepdims=True)
    return shapes
