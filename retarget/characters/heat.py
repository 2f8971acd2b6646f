"""Which bones a point of a drawing follows, and how much each: heat that flows from the bones through the drawing.

    (-Laplacian + H) w_b = H p_b,   H = 1 / d^2 to the nearest bone in sight, p_b = 1 where that bone is b

(Baran & Popovic 2007, section 4.)  Heat flows inside the drawing only, so a hand that hangs beside a hip does not
follow the hip; and it flows the wider the farther the bone is, so a fat limb bends as softly as it is fat.  Shares are
positive and sum to 1 by themselves.
"""

import numpy as np
from numpy.typing import NDArray

NEAR = 6
"""So many nearest bones are asked whether they are in sight."""


def heat_shares(points: NDArray, faces: NDArray, starts: NDArray, stops: NDArray, silhouette: object = None) -> NDArray:
    """Shares (N, P) of a mesh's points (N, 2) in P bones from `starts` to `stops` (P, 2); rows sum to 1.

    A bone is in sight where the straight way to it stays in the shapely `silhouette`; without one all are.
    """
    from scipy import sparse
    from scipy.sparse import csgraph
    from scipy.sparse.linalg import splu

    points = np.asarray(points, float)
    away, foot = nearest_on(points, starts, stops)
    bone, seen = _in_sight(points, away, foot, silhouette)
    count = len(points)
    stiffness, area = _laplacian(points, faces)
    distance = np.maximum(away[np.arange(count), bone], 1e-3 * np.ptp(points, axis=0).max())
    heat = np.where(seen, 1 / distance**2, 0.0)
    # a piece of the mesh that no bone is in sight of asks the nearest all the same
    _, piece = csgraph.connected_components(stiffness, directed=False)
    blind = ~np.isin(piece, np.unique(piece[seen]))
    heat[blind] = 1 / distance[blind] ** 2
    warm = sparse.diags(area * heat)
    sources = sparse.csr_matrix((area * heat, (np.arange(count), bone)), shape=(count, len(starts)))
    shares = splu((stiffness + warm + 1e-12 * sparse.eye(count)).tocsc()).solve(sources.toarray())
    shares = np.maximum(shares, 0)
    return shares / shares.sum(axis=1, keepdims=True)


def nearest_on(points: NDArray, starts: NDArray, stops: NDArray) -> tuple[NDArray, NDArray]:
    """How far points (N, 2) are from segments (P, 2) (N, P), and the segments' nearest points (N, P, 2)."""
    way = stops - starts
    along = np.einsum("npx,px->np", points[:, None] - starts, way) / np.maximum((way**2).sum(axis=1), 1e-12)
    foot = starts + np.clip(along, 0, 1)[..., None] * way
    return np.linalg.norm(points[:, None] - foot, axis=-1), foot


def _in_sight(points: NDArray, away: NDArray, foot: NDArray, silhouette: object) -> tuple[NDArray, NDArray]:
    """The nearest bone in sight of each point (N,), or the nearest of all, and whether it is in sight (N,)."""
    order = np.argsort(away, axis=1, kind="stable")[:, :NEAR]
    rows = np.arange(len(points))[:, None]
    if silhouette is None:
        return order[:, 0], np.ones(len(points), bool)
    import shapely

    near = np.stack([np.broadcast_to(points[:, None], (*order.shape, 2)), foot[rows, order]], axis=2)
    area = silhouette.buffer(0.005 * np.ptp(points, axis=0).max())
    shapely.prepare(area)
    open_ = shapely.covers(area, shapely.linestrings(near.reshape(-1, 2, 2))).reshape(order.shape)
    first = open_.argmax(axis=1)
    seen = open_.any(axis=1)
    return order[np.arange(len(points)), np.where(seen, first, 0)], seen


def _laplacian(points: NDArray, faces: NDArray) -> tuple[object, NDArray]:
    """The stiffness (N, N), sparse, positive, of heat in triangles, and the area round each point (N,)."""
    from scipy import sparse

    corners = points[faces]
    edges = np.roll(corners, -1, axis=1) - np.roll(corners, 1, axis=1)  # opposite each corner
    double = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1]))
    double = np.maximum(double, 1e-9 * double.max())
    rows, columns, values = [], [], []
    for i, j in ((0, 1), (1, 2), (2, 0)):
        weight = np.minimum(
            (edges[:, i] * edges[:, j]).sum(axis=1) / (2 * double), 0
        )  # obtuse corners pass no heat back
        for a, b, value in ((i, j, weight), (j, i, weight), (i, i, -weight), (j, j, -weight)):
            rows.append(faces[:, a])
            columns.append(faces[:, b])
            values.append(value)
    table = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    area = np.bincount(faces.ravel(), np.repeat(double / 6, 3), minlength=len(points))
    return sparse.csr_matrix(table, shape=(len(points), len(points))), area
