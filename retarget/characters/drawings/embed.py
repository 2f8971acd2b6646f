"""A drawing in a mesh of its silhouette: the mesh, where a key puts it, and how it carries its points."""

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.motion import affine, arap, triangulate
from capture.motion.triangulate import valid_ring
from retarget.characters.drawings import paths
from retarget.characters.drawings.paths import DrawnPath


def silhouette_of(version: list[DrawnPath]) -> object:
    """All that a key paints, as one shapely shape without holes; its bounds are the character's box."""
    import shapely

    union = shapely.union_all([paths.painted(path) for path in version])
    pieces = [piece for piece in getattr(union, "geoms", [union]) if piece.area > 0]
    if not pieces:
        raise InputError("a drawing must paint an area, all its shapes are empty: give them a fill or a stroke")
    return shapely.union_all([shapely.Polygon(piece.exterior) for piece in pieces])


def silhouette_mesh(silhouette: object, step: float) -> tuple[NDArray, NDArray, NDArray]:
    """Points (N, 2), faces (F, 3) and boundary (B,) of a silhouette, slightly grown, every piece meshed."""
    import shapely

    grown = silhouette.buffer(0.35 * step).simplify(0.08 * step)
    pieces = [shapely.Polygon(piece.exterior) for piece in getattr(grown, "geoms", [grown])]
    largest = max(piece.area for piece in pieces)
    edges, insides, meshes = [], [], []
    for piece in (piece for piece in pieces if piece.area > 0.002 * largest):
        ring = np.array(piece.exterior.coords)[:-1]
        ring = valid_ring(ring, max(12, round(piece.length / step)))
        outline, loop, inside, faces = triangulate.triangulate(ring[None], step)
        edges.append(outline[0])
        insides.append(inside)
        meshes.append((loop, faces))
    borders = np.cumsum([0, *map(len, edges)])
    inners = borders[-1] + np.cumsum([0, *map(len, insides)])
    outline, faces = [], []
    for number, (loop, own) in enumerate(meshes):
        places = np.concatenate(
            [np.arange(borders[number], borders[number + 1]), np.arange(inners[number], inners[number + 1])]
        )
        outline.append(places[loop])
        faces.append(places[own])
    return np.vstack([*edges, *insides]), np.vstack(faces), np.concatenate(outline)


def carried_mesh(mesh: NDArray, faces: NDArray, elements: list[list[DrawnPath]]) -> NDArray:
    """Where each key puts the mesh (K, N, 2): points along its curves are the handles.

    The affine part of the way goes first and only the rest is as rigid as possible: a key that is an affine
    copy of key 0 then leaves nothing over when its affine map is taken out (eq. 5).
    """
    curves = [np.concatenate([samples(of_keys[k]) for of_keys in elements]) for k in range(len(elements[0]))]
    if len(curves) == 1:
        return mesh[None]
    _, once = np.unique(np.round(np.hstack(curves), 6), axis=0, return_index=True)
    face, shares = triangulate.locate(curves[0][once], mesh, faces)
    drawn = [mesh]
    for goal in curves[1:]:
        way = affine.fit(curves[0][once], goal[once])
        left = affine.apply(affine.invert(way), goal[once])
        drawn.append(affine.apply(way, arap.carry(mesh, faces, faces[face], shares, left)))
    return np.stack(drawn)


def samples(path: DrawnPath) -> NDArray:
    """The start and the middle (2 C, 2) of every curve of a path."""
    return paths.along(paths.pieces(path), (0.0, 0.5)).reshape(-1, 2)


def embedding(mesh: NDArray, faces: NDArray, points: NDArray) -> object:
    """A sparse matrix (P, N) that carries points (P, 2) along with a mesh (N, 2), smoother than its faces.

    Each corner of a point's face brings its own place and the mean bend round it; the mean of that and of
    the flat face follows a smooth bend to second order, so that curves do not break at the faces' edges.
    """
    from scipy import sparse

    face, shares = triangulate.locate(points, mesh, faces)
    corners = faces[face]  # (P, 3)
    count = np.arange(len(points)).repeat(3)
    shape = (len(points), len(mesh))
    flat = sparse.csr_matrix((shares.ravel(), (count, corners.ravel())), shape=shape)
    slopes, area = _slopes(mesh, faces)  # (F, 3, 2)
    number = np.arange(len(faces)).repeat(3)
    gather = sparse.csr_matrix((area.repeat(3), (faces.ravel(), number)), shape=(len(mesh), len(faces)))
    gather = sparse.diags(1 / np.maximum(np.asarray(gather.sum(axis=1)).ravel(), 1e-30)) @ gather
    near = np.where(shares.min(axis=1) > -0.3, 0.5, 0.0)  # far outside, only the flat face is to be trusted
    away = shares[..., None] * (points[:, None] - mesh[corners]) * near[:, None, None]  # (P, 3, 2)
    carried = flat
    for axis in (0, 1):
        slope = sparse.csr_matrix((slopes[..., axis].ravel(), (number, faces.ravel())), shape=(len(faces), len(mesh)))
        bend = sparse.csr_matrix((away[..., axis].ravel(), (count, corners.ravel())), shape=shape)
        carried = carried + bend @ (gather @ slope)
    return carried.tocsr()


def _slopes(mesh: NDArray, faces: NDArray) -> tuple[NDArray, NDArray]:
    """Gradients (F, 3, 2) of the three corner shares of each face, and the faces' areas (F,)."""
    corners = mesh[faces]
    edges = np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=-1)
    inverse = np.linalg.inv(edges)
    return np.concatenate([-inverse.sum(axis=1, keepdims=True), inverse], axis=1), 0.5 * np.abs(np.linalg.det(edges))
