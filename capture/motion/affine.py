"""Affine maps (..., d, d + 1): v = L x + t with [L | t], acting on points (..., N, d) as rows."""

import numpy as np
from numpy.typing import ArrayLike, NDArray


def identity(d: int = 2) -> NDArray:
    """The map (d, d + 1) that moves nothing."""
    return np.eye(d, d + 1)


def apply(maps: ArrayLike, points: ArrayLike) -> NDArray:
    """Move points (..., N, d) by maps (..., d, d + 1); leading axes broadcast."""
    maps, points = np.asarray(maps, float), np.asarray(points, float)
    return points @ np.swapaxes(maps[..., :-1], -1, -2) + maps[..., None, :, -1]


def compose(outer: ArrayLike, inner: ArrayLike) -> NDArray:
    """The map (..., d, d + 1) that does `inner` first, then `outer`."""
    outer, inner = np.asarray(outer, float), np.asarray(inner, float)
    linear = outer[..., :-1] @ inner[..., :-1]
    shift = (outer[..., :-1] @ inner[..., -1:])[..., 0] + outer[..., -1]
    return np.concatenate([linear, shift[..., None]], axis=-1)


def invert(maps: ArrayLike) -> NDArray:
    """The maps (..., d, d + 1) that undo `maps`; a flattening map has none (LinAlgError)."""
    maps = np.asarray(maps, float)
    linear = np.linalg.inv(maps[..., :-1])
    return np.concatenate([linear, -linear @ maps[..., -1:]], axis=-1)


def about(maps: ArrayLike, pivot: ArrayLike) -> NDArray:
    """From v = L (x - pivot) + pivot + t, stored as [L | t], to the plain map of x; `from_about` undoes it."""
    maps, pivot = np.asarray(maps, float), np.asarray(pivot, float)
    shift = maps[..., -1] + pivot - (maps[..., :-1] @ pivot[..., None])[..., 0]
    return np.concatenate([maps[..., :-1], shift[..., None]], axis=-1)


def from_about(maps: ArrayLike, pivot: ArrayLike) -> NDArray:
    """From a plain map of x to [L | t] about the pivot: t is how far the pivot itself travels."""
    maps, pivot = np.asarray(maps, float), np.asarray(pivot, float)
    shift = maps[..., -1] - pivot + (maps[..., :-1] @ pivot[..., None])[..., 0]
    return np.concatenate([maps[..., :-1], shift[..., None]], axis=-1)


def fit(source: ArrayLike, target: ArrayLike, rcond: float = 1e-4) -> NDArray:
    """The map (..., d, d + 1) that brings source (..., N, d) nearest to target (..., N, d) (Bregler 2002, eqs. 5-6).

    Erratum: V S' (S S')^-1 fails for points on a line, and its minimum norm alone would flatten them.  So the
    best similarity comes first, then the smallest affine correction of what it leaves; directions in which
    the source is thinner than `rcond` of its length keep the similarity's scale.
    """
    source, target = np.asarray(source, float), np.asarray(target, float)
    similar = fit_similarity(source, target)
    left = target - apply(similar, source)
    centre = source.mean(axis=-2)
    solver = np.linalg.pinv(source - centre[..., None, :], rcond=rcond)  # (..., d, N)
    linear = np.swapaxes(solver @ left, -1, -2)
    shift = left.mean(axis=-2) - (linear @ centre[..., None])[..., 0]
    return similar + np.concatenate([linear, shift[..., None]], axis=-1)


def fit_similarity(source: ArrayLike, target: ArrayLike, scaled: bool = True) -> NDArray:
    """The turn, uniform scale and shift (..., d, d + 1) that bring source (..., N, d) nearest to target (..., N, d).

    With `scaled=False` the scale stays 1, a rigid motion.  No mirroring (Umeyama 1991).
    """
    source, target = np.asarray(source, float), np.asarray(target, float)
    centre, goal = source.mean(axis=-2), target.mean(axis=-2)
    spread = source - centre[..., None, :]
    cross = np.swapaxes(target - goal[..., None, :], -1, -2) @ spread  # (..., d, d)
    u, sigma, vt = np.linalg.svd(cross)
    sign = np.ones_like(sigma)
    sign[..., -1] = np.where(np.linalg.det(u @ vt) < 0, -1.0, 1.0)
    linear = (u * sign[..., None, :]) @ vt
    if scaled:
        power = np.sum(spread**2, axis=(-1, -2))
        ratio = (sigma * sign).sum(-1) / np.where(power > 0, power, 1)
        linear = linear * np.where(power > 0, ratio, 1)[..., None, None]
    shift = goal - (linear @ centre[..., None])[..., 0]
    return np.concatenate([linear, shift[..., None]], axis=-1)


def turn(maps: ArrayLike) -> NDArray:
    """The angle in radians (...) of the rotation nearest to maps (..., 2, 2 or 3), by polar decomposition."""
    maps = np.asarray(maps, float)
    return np.arctan2(maps[..., 1, 0] - maps[..., 0, 1], maps[..., 0, 0] + maps[..., 1, 1])
