"""Points that are known frame by frame and by nothing else, as few shapes that are mixed and placed.

So goes out what neither keys nor joints tell: a drawing that follows a line, a figure whose joints stretch, a character
that was staged point by point.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from capture.motion import affine

SMALL = 1e-3
"""The share of a shape's way from the base that `nearby` goes: so far, normals turn evenly."""


@dataclass(frozen=True, eq=False)
class Baked:
    """v(t) = place(t) . sum_d w_d(t) S_d, in T frames of V points in d dimensions."""

    names: tuple[str, ...]  # D
    shapes: NDArray  # (D, V, d); the first is the base, with the middle of its foot at the origin
    weights: NDArray  # (T, D), rows sum to 1
    place: NDArray  # (T, d, d + 1)


def fewest(points: NDArray, exact: float) -> Baked:
    """Points (T, V, d), y up, in the fewest shapes that keep them within `exact` of the height.

    The affine part of the way goes into the place; the shapes for the rest are found by a singular value decomposition.
    """
    low, high = points[0].min(axis=0), points[0].max(axis=0)
    foot = 0.5 * (low + high)
    foot[1] = low[1]
    base = points[0] - foot
    place = _placed(base, points)
    bends = affine.apply(affine.invert(place), points) - base  # (T, V, d)
    u, sigma, vt = np.linalg.svd(bends.reshape(len(points), -1), full_matrices=False)
    height = np.ptp(base, axis=0).max()
    left_out = np.sqrt(np.cumsum(sigma[::-1] ** 2))[::-1]  # no point is off by more in any frame
    count = int((left_out > exact * height).sum())
    shares, modes = u[:, :count] * sigma[:count] / height, vt[:count].reshape(count, *base.shape) * height
    weights = np.column_stack([1 - shares.sum(axis=1), shares])
    names = ("base", *(f"bend {number}" for number in range(1, count + 1)))
    return Baked(names, np.concatenate([base[None], base + modes]), weights, place)


def nearby(shapes: NDArray) -> NDArray:
    """Shapes (D, V, d) drawn in to the first one, so near that their normals are a small step from its own."""
    return shapes[:1] + SMALL * (shapes - shapes[:1])


def far(normals: NDArray) -> NDArray:
    """What the normals (D, V, 3) of `nearby` come to, to first order, at the whole shapes; readers make them unit."""
    return normals[:1] + (normals - normals[:1]) / SMALL


def _placed(base: NDArray, points: NDArray) -> NDArray:
    """The affine way (T, d, d + 1) of a base (V, d), or its travel alone where it is squashed flat on it."""
    place = affine.fit(base, points)
    if np.linalg.cond(place[..., :-1]).max() > 1e6:
        place[..., :-1] = np.eye(base.shape[1])
        place[..., -1] = points.mean(axis=1) - base.mean(axis=0)
    return place
