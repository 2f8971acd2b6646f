"""The extended linear warping space: in-betweens of every pair of keys, and their principal components.

Bregler et al. 2002, section 3.1.3.  V = M + sum_l alpha_l E_l (eq. 3), with M the mean of all rows.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from capture.motion import affine


@dataclass(frozen=True, eq=False)
class KeySpace:
    """Shapes as a mean and L modes, and how each row is mixed from them."""

    mean: NDArray  # (N, d)
    modes: NDArray  # (L, N, d), orthonormal
    coefficients: NDArray  # (D, L) alpha of every row
    spread: NDArray  # (L,) standard deviation of alpha over the rows
    error: float  # largest distance in pixels of any row's point from its mix


def extended_space(shapes: NDArray, error: float = 0.1, most: int = 12) -> KeySpace:
    """PCA of all rows (D, N, d) with just enough modes that no point of a row is off by more than `error`.

    `most` bounds the count; then the error that is left is told in the result.
    """
    shapes = np.asarray(shapes, float)
    mean = shapes.mean(axis=0)
    flat = (shapes - mean).reshape(len(shapes), -1)
    u, sigma, vt = np.linalg.svd(flat, full_matrices=False)
    possible = int(np.count_nonzero(sigma > 1e-9 * max(sigma.max(), 1e-12))) if sigma.max() > 1e-9 else 0
    coefficients = u * sigma
    for count in range(min(possible, most) + 1):
        left = (flat - coefficients[:, :count] @ vt[:count]).reshape(shapes.shape)
        off = float(np.linalg.norm(left, axis=-1).max())
        if off <= error:
            break
    coefficients = coefficients[:, :count]
    modes = vt[:count].reshape(count, *shapes.shape[1:])
    return KeySpace(mean, modes, coefficients, coefficients.std(axis=0), off)


def mix(space: KeySpace, alpha: NDArray) -> NDArray:
    """Shapes (..., N, d) of mode weights (..., L): M + sum_l alpha_l E_l."""
    return space.mean + np.tensordot(alpha, space.modes, axes=1)


def nearest(
    space: KeySpace, seen: NDArray, at: NDArray, placed: NDArray, alpha: NDArray, rounds: int = 5
) -> tuple[NDArray, NDArray]:
    """Map (d, d + 1) and mode weights (L,) that bring mesh points `at` (B,) nearest to where they are `seen` (B, d).

    Least squares by Gauss-Newton from a map and weights nearby: together the two are not linear, but nearly.
    """
    mean, modes, d = space.mean[at], space.modes[:, at], space.mean.shape[1]
    for _ in range(rounds):
        shape = mean + np.tensordot(alpha, modes, axes=1)
        centre, scale = shape.mean(axis=0), max(float(np.ptp(shape, axis=0).max()), 1e-9)
        local = np.column_stack([(shape - centre) / scale, np.ones(len(at))])  # so that all unknowns are pixels
        by_map = np.einsum("bj,ik->bikj", local, np.eye(d)).reshape(d * len(at), -1)
        by_modes = np.einsum("ij,lbj->bil", placed[:, :d], modes).reshape(d * len(at), len(modes))
        left = seen - affine.apply(placed, shape)
        step = np.linalg.lstsq(np.hstack([by_map, by_modes]), left.ravel(), rcond=1e-6)[0]
        change = step[: d * (d + 1)].reshape(d, d + 1) / np.append(np.full(d, scale), 1.0)
        change[:, d] -= change[:, :d] @ centre
        placed, alpha = placed + change, alpha + step[d * (d + 1) :]
    return placed, alpha


def as_affine_combination(space: KeySpace) -> NDArray:
    """The L + 1 shapes (L + 1, N, d) of eq. 3, M + E_l and M itself, whose weights sum to 1.

    Erratum: the last weight is alpha_{L+1} = 1 - sum over l = 1 .. L of alpha_l; and M is here the mean alone.
    """
    return np.concatenate([space.mean + space.modes, space.mean[None]])
