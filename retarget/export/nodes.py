"""Affine maps as nodes that only know travel, turn and stretch: two of them, one inside the other.

A 3-D scene's node has a translation T, a rotation R and a stretch S along its own axes, and no shear.  By the singular
value decomposition L = U S V' every linear map is a turn, a stretch and another turn, so an outer node of T, U, S and
an inner one of V' hold it exactly.  The decomposition is not unique; here it is the one that jumps least over time,
because programs turn along the shortest way between two frames and an animator edits these curves.
"""

from dataclasses import dataclass
from itertools import permutations, product

import numpy as np
from numpy.typing import NDArray

SAME = 1e-7
"""Stretches that differ by less than this share of their size count as equal: their axes may then lie anywhere."""


@dataclass(frozen=True, eq=False)
class Nodes:
    """Affine maps over time as outer T . R . S and inner R; quaternions are (x, y, z, w)."""

    translation: NDArray  # (T, 3)
    rotation: NDArray  # (T, 4)
    scale: NDArray  # (T, 3), with a negative one where the map mirrors
    inner: NDArray  # (T, 4); all (0, 0, 0, 1) where there is no shear

    def maps(self) -> NDArray:
        """The affine maps (T, 3, 4) that the two nodes make together."""
        from scipy.spatial.transform import Rotation

        outer, inner = (Rotation.from_quat(quats).as_matrix() for quats in (self.rotation, self.inner))
        return np.concatenate([outer * self.scale[:, None] @ inner, self.translation[..., None]], axis=-1)


def nodes(maps: NDArray) -> Nodes:
    """Affine maps (T, 3, 4) as two nested nodes, continuous over time; shear, mirroring and flattening included."""
    from scipy.spatial.transform import Rotation

    maps = np.asarray(maps, float)
    outer, scale, inner = _turns_and_stretches(maps[..., :-1])
    rotation, within = (_nearest_signs(Rotation.from_matrix(turns).as_quat()) for turns in (outer, inner))
    return Nodes(maps[..., -1], rotation, scale, within)


def lifted(maps: NDArray) -> NDArray:
    """Affine maps of the plane (..., 2, 3) as maps of space (..., 3, 4) that leave depth alone."""
    maps = np.asarray(maps, float)
    space = np.zeros((*maps.shape[:-2], 3, 4))
    space[..., :2, :2], space[..., :2, 3], space[..., 2, 2] = maps[..., :2], maps[..., 2], 1
    return space


def _turns_and_stretches(linear: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """U (T, 3, 3), S (T, 3) and V' (T, 3, 3) of linear maps (T, 3, 3), with U and V proper turns.

    The axes V are those of the symmetric stretch P in L = R P.  Each frame takes the order and signs of the axes
    that turn both U and V least against the frame before; the first frame against no turn.  A trace of the axes
    before is added to P, so that where stretches are equal, and any axes would do, they stay.
    """
    u, sigma, vt = np.linalg.svd(linear)
    stretch = np.swapaxes(vt, 1, 2) * sigma[:, None] @ vt  # P
    turn = u @ vt  # R, with a mirroring left in it
    arrangements = _arrangements()
    outer, scale, inner = np.empty_like(linear), np.empty(linear.shape[:2]), np.empty_like(linear)
    before = axes_before = np.eye(3)
    for t in range(len(linear)):
        trace = SAME * max(sigma[t, 0], 1e-30) * axes_before * [3.0, 2.0, 1.0] @ axes_before.T
        axes = np.linalg.eigh(stretch[t] + trace)[1] @ arrangements  # (A, 3, 3): all orders and signs
        turned = turn[t] @ axes
        mirrored = np.linalg.det(turn[t]) < 0
        signs = _MIRRORED if mirrored else _PLAIN
        both = turned[:, None] * signs[:, None]  # (A, 1 or 4, 3, 3): the columns that are mirrored, if any
        proper = np.linalg.det(axes) > 0
        near = np.einsum("asij,ij->as", both, before) + np.einsum("aij,ij->a", axes, axes_before)[:, None]
        best, which = np.unravel_index(np.where(proper[:, None], near, -np.inf).argmax(), near.shape)
        before, axes_before = both[best, which], axes[best]
        outer[t], inner[t] = before, axes_before.T
        scale[t] = np.einsum("ij,ik,kj->j", axes_before, stretch[t], axes_before) * signs[which]
    return outer, scale, inner


_PLAIN = np.ones((1, 3))
_MIRRORED = np.array([[-1, 1, 1], [1, -1, 1], [1, 1, -1], [-1, -1, -1]], float)


def _arrangements() -> NDArray:
    """All 48 orders and signs of three axes, as matrices (48, 3, 3)."""
    orders = [np.eye(3)[:, list(order)] for order in permutations(range(3))]
    return np.array([order * signs for order in orders for signs in product((1.0, -1.0), repeat=3)])


def _nearest_signs(quats: NDArray) -> NDArray:
    """Quaternions (T, 4), q or -q, which turn alike, each with the sign nearer to the one before."""
    flips = np.where((quats[1:] * quats[:-1]).sum(axis=1) < 0, -1.0, 1.0)
    return quats * np.concatenate([[1.0], np.cumprod(flips)])[:, None]
