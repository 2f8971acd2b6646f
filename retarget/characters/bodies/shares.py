"""How much of each point of one drawing is of which part, when all that is said is a line through each part."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.motion import triangulate

LEAST = 0.1
"""What a part has of a point within less than this counts for nothing: far from a seam a point is of one part."""

SPREAD = 2 * np.log(0.5 / LEAST)
"""A share that spreads over the length 1 falls as exp(-x) / 2: so many lengths lie between both ends of a seam."""


def shares_by_lines(points: NDArray, faces: NDArray, lines: Sequence[NDArray], seam: float) -> NDArray:
    """Shares (M, P) of points (M, 2), mesh points first, in P parts round lines (2, 2), each from joint to end.

    Warmth spreads from the lines through the mesh (Baran and Popovic 2007): a point is of the line that warms it most.
    So an arm that hangs beside its body is no part of it, and a cheek goes with the head and not with the shoulder.
    Then what is of one line or another is smoothed over `seam` pixels.  Points behind the mesh's ride on it.
    """
    from scipy.sparse import linalg

    if not seam > 0:
        raise InputError(f"a seam must be wider than 0 pixels, got {seam:g}: say over how many pixels it blends")
    count = int(faces.max()) + 1
    stiff, mass = _laplacian(points[:count], faces)
    near = np.full(count, -1)
    steps = np.linspace(0, 1, 200)[:, None]
    gap = np.stack([_from_line(points[:count], line) for line in lines], axis=-1)
    for number, (start, end) in enumerate(lines):
        seeds = np.unique(_nearest(points[:count], start + steps * (end - start)))
        near[seeds] = np.where((near[seeds] < 0) | (gap[seeds, number] < gap[seeds, near[seeds]]), number, near[seeds])
    known = near >= 0
    warmth = np.eye(len(lines))[np.where(known, near, 0)] * known[:, None]
    free = np.flatnonzero(~known)
    if len(free):
        cool = (stiff[free][:, free] + 1e-12 * mass[free][:, free]).tocsc()
        warmth[free] = linalg.spsolve(cool, -(stiff[free][:, np.flatnonzero(known)] @ warmth[known])).reshape(
            -1, len(lines)
        )
    lost = warmth.max(axis=1) < 1e-3  # a piece that no line touches: as the crow flies
    of = np.where(lost, gap.argmin(axis=1), warmth.argmax(axis=1))
    spread = (mass + (seam / SPREAD) ** 2 * stiff).tocsc()
    shares = linalg.spsolve(spread, mass @ np.eye(len(lines))[of]).reshape(-1, len(lines))
    shares = np.clip((shares - LEAST) / (1 - 2 * LEAST), 0, 1)
    shares /= shares.sum(axis=1, keepdims=True)
    if len(points) > count:
        face, corners = triangulate.locate(points[count:], points[:count], faces)
        corners = np.clip(corners, 0, 1) / np.clip(corners, 0, 1).sum(axis=1, keepdims=True)
        shares = np.vstack([shares, np.einsum("pc,pcn->pn", corners, shares[faces[face]])])
    return shares


def _laplacian(points: NDArray, faces: NDArray) -> tuple[object, object]:
    """Stiffness and mass (N, N), sparse, of a mesh: cotangents, none below 0 so that no share is."""
    from scipy import sparse

    corners = points[faces]
    rows, columns, values = [], [], []
    area = np.zeros(len(points))
    for k in range(3):
        a, b = corners[:, (k + 1) % 3] - corners[:, k], corners[:, (k + 2) % 3] - corners[:, k]
        doubled = np.maximum(np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]), 1e-12)
        half = 0.5 * np.clip((a * b).sum(axis=1) / doubled, 1e-3, 1e3)
        rows += [faces[:, (k + 1) % 3], faces[:, (k + 2) % 3]]
        columns += [faces[:, (k + 2) % 3], faces[:, (k + 1) % 3]]
        values += [half, half]
        np.add.at(area, faces[:, k], doubled / 6)
    shape = (len(points), len(points))
    joined = sparse.csr_matrix((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=shape)
    stiff = sparse.diags(np.asarray(joined.sum(axis=1)).ravel()) - joined
    return stiff.tocsr(), sparse.diags(np.maximum(area, 1e-12)).tocsr()


def _nearest(points: NDArray, to: NDArray) -> NDArray:
    from scipy import spatial

    return spatial.KDTree(points).query(to)[1]


def _from_line(points: NDArray, line: NDArray) -> NDArray:
    """How far points (N, 2) are from a line (2, 2)."""
    start, way = line[0], line[1] - line[0]
    share = np.clip((points - start) @ way / max(way @ way, 1e-12), 0, 1)
    return np.linalg.norm(points - start - share[:, None] * way, axis=1)
