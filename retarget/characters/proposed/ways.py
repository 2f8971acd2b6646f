"""How a source turns and stretches from its first key to the others, lent to a mesh (after Sumner & Popovic 2004).

A way is five numbers: a turn in radians, then the four of the symmetric stretch before it.  Turns and stretches are
lent and not distances: long legs swing as far as short ones.  The mesh then goes its faces' ways as nearly as it can.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from capture.motion import affine, arap, triangulate
from capture.motion.keys import KeySet

REACH = 0.06
"""Of a mesh's size: over how far it evens out what it is lent where it is laid on the source crookedly."""

_THIRDS = np.array([[4, 1, 1], [1, 4, 1], [1, 1, 4]]) / 6  # where a face is asked


@dataclass(frozen=True, eq=False)
class Ways:
    """A source's first key and the ways from there to its K keys."""

    rest: NDArray  # (N, 2)
    faces: NDArray  # (F, 3)
    outline: NDArray  # (B,)
    of_faces: NDArray  # (K, F, 5)
    of_points: NDArray  # (K, N, 5)

    def at_outline(self, places: NDArray) -> NDArray:
        """Ways (K, P, 5) at positions (P,) along the outline: 2.25 is a quarter past its point 2."""
        first = np.floor(places).astype(int)
        share = (places - first)[:, None]
        known, count = self.of_points[:, self.outline], len(self.outline)
        return (1 - share) * known[:, first % count] + share * known[:, (first + 1) % count]

    def at(self, points: NDArray) -> NDArray:
        """Ways (K, P, 5) at points (P, 2) of the first key, of the nearest place for those outside."""
        face, shares = triangulate.locate(points, self.rest, self.faces)
        shares = np.clip(shares, 0, 1)
        shares /= shares.sum(axis=1, keepdims=True)
        return np.einsum("pc,kpcx->kpx", shares, self.of_points[:, self.faces[face]])


def ways_of(source: KeySet, angle: float = 0.0) -> Ways:
    """A source's ways, of its keys as they were drawn, for a drawing that is turned by `angle` against it."""
    shapes = affine.apply(source.removed, source.points)  # a key's own turn and stretch are lent as well
    turns, stretches = arap.ways(shapes[0], shapes, source.faces)
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s], [s, c]])
    stretches = turn @ stretches @ turn.T
    of_faces = np.concatenate([turns[..., None], stretches.reshape(*turns.shape, 4)], axis=-1)
    of_points = _at_points(of_faces, shapes[0], source.faces)
    return Ways(shapes[0], source.faces, source.outline, of_faces, of_points)


def lent(ways: Ways, mesh: NDArray, faces: NDArray, edge: NDArray, along: NDArray) -> NDArray:
    """Ways (K, F, 5) for the faces of a mesh (N, 2) whose points `edge` (E,) lie `along` (E,) the source's outline.

    A harmonic map lays the mesh on the source.  Where it is laid flat, a face goes the way of what it lies on; where it
    is crowded, such as the ears on an earless head, ways are evened out over some distance.
    """
    place = ways.rest[ways.outline]
    first, share = np.floor(along).astype(int), (along % 1)[:, None]
    goal = (1 - share) * place[first % len(place)] + share * place[(first + 1) % len(place)]
    weights, goals = np.zeros(len(mesh)), np.zeros((len(mesh), 2))
    weights[edge], goals[edge] = 1e3, goal
    laid = _smooth(mesh, faces, weights, goals)

    alike = _alike(mesh, laid, faces)
    flat = np.setdiff1d(np.arange(len(mesh)), np.union1d(edge, faces[alike == 0]))
    size = np.sqrt(_areas(mesh, faces).sum())
    weights[flat] = _areas(mesh, faces)[flat] / (REACH * size) ** 2
    goals = np.zeros((len(mesh), len(ways.of_faces), 5))
    goals[edge] = np.moveaxis(ways.at_outline(along), 1, 0)
    goals[flat] = np.moveaxis(ways.at(laid[flat]), 1, 0)
    even = _smooth(mesh, faces, weights, goals.reshape(len(mesh), -1)).reshape(goals.shape)
    even = np.moveaxis(even, 1, 0)[:, faces].mean(axis=2)
    asked = [
        triangulate.locate(np.einsum("c,fcx->fx", share, laid[faces]), ways.rest, ways.faces)[0] for share in _THIRDS
    ]
    own = np.mean([ways.of_faces[:, face] for face in asked], axis=0)
    return even + alike[:, None] * (own - even)


def followed(mesh: NDArray, faces: NDArray, fields: NDArray, rounds: int = 6) -> tuple[NDArray, NDArray]:
    """Shapes (K, N, 2) of a mesh (N, 2) whose faces go their ways (K, F, 5), and the ways that they went.

    Where a face turns over, the ways round it are evened out, ever farther about.
    """
    rest = _double_areas(mesh[faces])
    moved = _gone(mesh, faces, fields)
    for reach in range(1, rounds + 1):
        folded = (_double_areas(moved[:, faces]) * rest < 0).any(axis=0)
        if not folded.any():
            break
        crowd = np.unique(faces[folded])
        for _ in range(reach):
            crowd = np.unique(faces[np.isin(faces, crowd).any(axis=1)])
        weights = np.full(len(mesh), 1e3)
        weights[crowd] = 0
        goals = np.moveaxis(_at_points(fields, mesh, faces), 1, 0)
        even = _smooth(mesh, faces, weights, goals.reshape(len(mesh), -1)).reshape(goals.shape)
        round_it = np.isin(faces, crowd).all(axis=1)
        fields = np.where(round_it[:, None], np.moveaxis(even, 1, 0)[:, faces].mean(axis=2), fields)
        moved = _gone(mesh, faces, fields)
    return moved, fields


def _gone(mesh: NDArray, faces: NDArray, fields: NDArray) -> NDArray:
    """Shapes (K, N, 2) of a mesh (N, 2) whose faces go their ways (K, F, 5); loose pieces stay with the largest one."""
    turns, stretches = fields[..., 0], fields[..., 1:].reshape(*fields.shape[:2], 2, 2)
    moved = arap.follow(mesh, faces, turns, stretches)
    piece = pieces_of(len(mesh), faces)
    main = np.flatnonzero(piece == np.bincount(piece).argmax())
    for number in set(piece.tolist()) - {int(piece[main[0]])}:
        loose = np.flatnonzero(piece == number)
        gaps = np.linalg.norm(mesh[loose][:, None] - mesh[main], axis=-1)
        own, other = np.unravel_index(gaps.argmin(), gaps.shape)
        own, other = loose[own], main[other]
        angle = turns[:, (faces == other).any(axis=1)].mean(axis=1)
        away = mesh[own] - mesh[other]
        c, s = np.cos(angle), np.sin(angle)
        there = moved[:, other] + np.stack([c * away[0] - s * away[1], s * away[0] + c * away[1]], axis=-1)
        moved[:, loose] += (there - moved[:, own])[:, None]
    return moved


def pieces_of(count: int, faces: NDArray) -> NDArray:
    """For each of a mesh's points (N,) the number of the connected piece that it belongs to."""
    from scipy import sparse
    from scipy.sparse import csgraph

    ends = faces[:, [0, 1]].ravel(), faces[:, [1, 2]].ravel()
    graph = sparse.csr_matrix((np.ones(2 * len(faces)), ends), shape=(count, count))
    return csgraph.connected_components(graph, directed=False)[1]


def strain(mesh: NDArray, moved: NDArray, faces: NDArray, fields: NDArray) -> tuple[NDArray, NDArray]:
    """The factor (K,) within which 99 of 100 faces keep the stretch they were lent, and how many fold over (K,)."""
    _, stretches = arap.ways(mesh, moved, faces)
    lent = fields[..., 1:].reshape(*fields.shape[:2], 2, 2)
    own, asked = (np.maximum(np.linalg.svd(s, compute_uv=False), 1e-3) for s in (stretches, lent))
    turned_over = _double_areas(moved[:, faces]) * _double_areas(mesh[faces]) < 0
    return np.quantile(np.maximum(own / asked, asked / own).max(axis=2), 0.99, axis=1), turned_over.sum(axis=1)


def _double_areas(corners: NDArray) -> NDArray:
    """Twice the signed areas (...) of triangles (..., 3, 2)."""
    return np.linalg.det(corners[..., 1:, :] - corners[..., :1, :])


def _alike(mesh: NDArray, laid: NDArray, faces: NDArray) -> NDArray:
    """How far (F,) faces keep their form where they are laid: 1 as much as the mesh at large, 0 squeezed or folded."""
    _, stretches = arap.ways(mesh, laid[None], faces)
    sigma = np.linalg.svd(stretches[0], compute_uv=False)
    sigma = sigma / max(np.median(sigma), 1e-12)
    form = np.minimum(sigma[:, 1], 1 / np.maximum(sigma[:, 0], 1e-12))
    return np.where(np.linalg.det(stretches[0]) > 0, np.clip((form - 0.4) / 0.4, 0, 1), 0.0)


def _smooth(mesh: NDArray, faces: NDArray, weights: NDArray, goals: NDArray) -> NDArray:
    """The smoothest field (N, C) on a mesh that keeps to goals (N, C) as strongly as weights (N,) say."""
    from scipy import sparse
    from scipy.sparse.linalg import splu

    matrix = arap.laplacian(mesh, faces) + sparse.diags(weights + 1e-9)
    return splu(matrix.tocsc()).solve(weights[:, None] * goals)


def _areas(points: NDArray, faces: NDArray) -> NDArray:
    """A third of the area (N,) of the faces round each point."""
    return np.bincount(faces.ravel(), np.abs(_double_areas(points[faces])).repeat(3) / 6, len(points))


def _at_points(values: NDArray, points: NDArray, faces: NDArray) -> NDArray:
    """Values of faces (K, F, C) as the points' (K, N, C), each the mean of the faces round it by area."""
    area = np.abs(_double_areas(points[faces])) / 6
    found = np.zeros((len(values), len(points), values.shape[2]))
    for corner in range(3):
        np.add.at(found, (slice(None), faces[:, corner]), values * area[:, None])
    return found / np.maximum(_areas(points, faces), 1e-30)[:, None]
