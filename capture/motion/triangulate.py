"""Triangles inside an outline: a boundary, a hexagonal lattice within, and Delaunay between them.

Shewchuk's Triangle would do this too, but its licence forbids commercial use.  The lattice keeps a distance
from the boundary, which gives good angles without a quality mesher (smallest angle about 28 deg where the
outline's points are even).
"""

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError

NEAREST = 16
"""Faces that are tried first when the one is looked for that a point lies in."""


def triangulate(
    outlines: NDArray, spacing: float | None = None, rounds: int = 20
) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """Mesh the first of K corresponding closed outlines (K, B, 2); every outline gets the same boundary points.

    Returns outlines (K, B', 2) whose first B points are the given ones, the loop (B',) of indices in order
    round the boundary, interior points (I, 2) of the first outline, and faces (F, 3), counter-clockwise on a
    y-down screen, into the B' + I points.  Where a limb is thinner than its outline's steps, Delaunay
    would cut across: those steps are halved, in all outlines at the same place.
    """
    import shapely

    outlines = np.asarray(outlines, float)
    loop = np.arange(outlines.shape[1])
    _check_points(outlines)
    polygon = shapely.Polygon(outlines[0])
    if not polygon.is_valid or polygon.area < 1e-9:
        raise InputError(
            "an outline must be a closed curve that does not cross itself, this one "
            f"{'has no area' if polygon.area < 1e-9 else 'crosses itself'}: draw it again as one simple loop"
        )
    if spacing is None:
        spacing = float(np.median(np.linalg.norm(np.diff(outlines[0][loop], axis=0), axis=1)))
        spacing = max(spacing, np.sqrt(polygon.area / 1500))  # a fine outline needs no fine inside
    inside = _hexagonal_lattice(polygon.buffer(-0.6 * spacing), spacing)
    faces = _delaunay_inside(np.vstack([outlines[0], inside]), polygon)
    for _ in range(rounds):
        missing = _missing_edges(loop, faces)
        if not len(missing):
            break
        outlines, loop = _halve(outlines, loop, missing)
        faces = _delaunay_inside(np.vstack([outlines[0], inside]), polygon)
    return outlines, loop, inside, faces


def resample(outline: NDArray, count: int) -> NDArray:
    """Spread `count` points evenly along a closed outline (B, 2), starting at its first point."""
    outline = np.asarray(outline, float)
    closed = np.vstack([outline, outline[:1]])
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))])
    at = np.linspace(0, along[-1], count, endpoint=False)
    return np.stack([np.interp(at, along, closed[:, axis]) for axis in range(closed.shape[1])], axis=-1)


def valid_ring(ring: NDArray, count: int) -> NDArray:
    """`count` even points (B, 2) along a ring (B, 2), or more where so few would make it cross itself."""
    import shapely

    for factor in (1, 2, 4):
        even = resample(ring, factor * count)
        if shapely.Polygon(even).is_valid:
            return even
    return ring


def locate(points: NDArray, mesh_points: NDArray, faces: NDArray) -> tuple[NDArray, NDArray]:
    """For points (P, 2) the face (P,) they lie in, or are nearest to, and barycentric shares (P, 3).

    Outside the mesh the shares leave [0, 1]: the nearest triangle is continued.
    """
    points = np.asarray(points, float)
    corners = mesh_points[faces]  # (F, 3, 2)
    edges = np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=-1)
    inverse = np.linalg.inv(edges)
    # a share times its corner's height says in pixels how far outside
    heights = np.abs(np.linalg.det(edges))[:, None] / np.linalg.norm(
        corners[:, [1, 2, 0]] - corners[:, [2, 0, 1]], axis=-1
    )

    def judged(some: NDArray, among: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        """The best of faces (P, C) or (C,) for points (P, 2), their shares, and how far outside the points are."""
        uv = np.einsum("...fij,...fj->...fi", inverse[among], some[:, None] - corners[among, 0])
        bary = np.concatenate([1 - uv.sum(-1, keepdims=True), uv], axis=-1)
        outside = np.max(-bary * heights[among], axis=-1)
        best = np.argmin(np.maximum(outside, 0) + 1e-9 * np.abs(bary).max(-1), axis=1)
        each = np.arange(len(some))
        return np.broadcast_to(among, outside.shape)[each, best], bary[each, best], outside[each, best]

    face, shares, off = np.empty(len(points), int), np.empty((len(points), 3)), np.full(len(points), np.inf)
    if len(points) * len(faces) > NEAREST * len(points) + 200_000:  # most points lie in one of the nearest few faces
        from scipy.spatial import cKDTree

        near = cKDTree(corners.mean(axis=1)).query(points, NEAREST)[1]
        face, shares, off = judged(points, near)
    rest = np.flatnonzero(off > 0)
    for start in range(0, len(rest), 512):  # bounds the (P, F) table
        some = rest[start : start + 512]
        face[some], shares[some], _ = judged(points[some], np.arange(len(faces)))
    return face, shares


def _check_points(outlines: NDArray) -> None:
    """Refuse points that are no numbers, and steps of no length: their two ends could not both be in a mesh."""
    if not np.isfinite(outlines).all():
        raise InputError(
            "the points of an outline must be finite numbers, this one holds NaN or infinity: draw it again"
        )
    still = np.flatnonzero((outlines[0] == np.roll(outlines[0], -1, axis=0)).all(axis=1))
    if len(still):
        x, y = outlines[0, still[0]]
        raise InputError(
            f"neighbouring points of an outline must differ, ({x:g}, {y:g}) comes twice in a row: leave one of "
            "them out (the last point joins the first by itself)"
        )


def _hexagonal_lattice(polygon, spacing: float) -> NDArray:  # noqa: ANN001 - shapely is imported late
    """Lattice points (I, 2) inside a polygon."""
    import shapely

    if polygon.is_empty:
        return np.zeros((0, 2))
    x0, y0, x1, y1 = polygon.bounds
    rows = np.arange(y0, y1 + spacing, spacing * np.sqrt(3) / 2)
    columns = np.arange(x0, x1 + spacing, spacing)
    x, y = np.meshgrid(columns, rows)
    x = x + np.where(np.arange(len(rows)) % 2, spacing / 2, 0)[:, None]
    return np.stack([x, y], -1)[shapely.contains_xy(polygon, x, y)]


def _delaunay_inside(points: NDArray, polygon) -> NDArray:  # noqa: ANN001
    """Delaunay faces (F, 3) whose centre lies inside the polygon, all turned the same way round."""
    import shapely
    from scipy.spatial import Delaunay

    faces = Delaunay(points).simplices
    corners = points[faces]
    centres = corners.mean(axis=1)
    area = _signed_area(corners)
    keep = shapely.contains_xy(polygon, *centres.T) & (np.abs(area) > 1e-9 * np.abs(area).max())
    faces, area = faces[keep], area[keep]
    return np.where(area[:, None] > 0, faces, faces[:, ::-1])


def _signed_area(corners: NDArray) -> NDArray:
    """Areas (F,) of triangles (F, 3, 2), positive where x turns towards y."""
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return 0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def _missing_edges(loop: NDArray, faces: NDArray) -> NDArray:
    """Positions in the loop whose step to the next point is no edge of the mesh."""
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    steps = np.sort(np.stack([loop, np.roll(loop, -1)], axis=1), axis=1)
    size = max(int(edges.max()), int(steps.max())) + 1
    return np.flatnonzero(~np.isin(steps @ [size, 1], edges @ [size, 1]))


def _halve(outlines: NDArray, loop: NDArray, where: NDArray) -> tuple[NDArray, NDArray]:
    """Put a point half-way into the given steps of the loop, in every outline."""
    after = np.roll(loop, -1)
    middles = 0.5 * (outlines[:, loop[where]] + outlines[:, after[where]])
    new = outlines.shape[1] + np.arange(len(where))
    return np.concatenate([outlines, middles], axis=1), np.insert(loop, where + 1, new)
