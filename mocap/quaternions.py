"""Turns as quaternions x, y, z, w, for clips of many joints: components first, so that each is one run of memory.

Everything takes and gives arrays (4, ...) or vectors (3, ...).  scipy's Rotation does the same ten times slower.
"""

import numpy as np
from numpy.typing import NDArray


def product(p: NDArray, q: NDArray) -> NDArray:
    """The turn q, then the turn p."""
    a, b, c, d = p
    x, y, z, w = q
    return np.stack(
        [
            d * x + a * w + b * z - c * y,
            d * y - a * z + b * w + c * x,
            d * z + a * y - b * x + c * w,
            d * w - a * x - b * y - c * z,
        ]
    )


def inverse(q: NDArray) -> NDArray:
    """The turn back."""
    return q * _BACK.reshape(4, *[1] * (q.ndim - 1))


def turned(q: NDArray, v: NDArray) -> NDArray:
    """Vectors (3, ...) turned."""
    x, y, z, w = q
    a, b, c = v
    s, t, u = 2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)
    return np.stack([a + w * s + y * u - z * t, b + w * t + z * s - x * u, c + w * u + x * t - y * s])


def between(first: NDArray, second: NDArray) -> NDArray:
    """The smallest turn from one direction (3, ...) to another; vectors need not be of length 1, one of 0 turns none.

    Between opposite directions all half turns are as small: one about some axis across is taken.
    """
    lengths = np.sqrt((first * first).sum(axis=0) * (second * second).sum(axis=0))
    a, b, c = first
    d, e, f = second
    q = np.stack([b * f - c * e, c * d - a * f, a * e - b * d, lengths + (a * d + b * e + c * f)])
    size = np.sqrt((q * q).sum(axis=0))
    lost = size <= 1e-9 * np.maximum(lengths, 1e-300)
    if lost.any():
        q, size = np.where(lost, _half_turn(first, lengths), q), np.where(lost, 1.0, size)
    return q / size


def about(axis: NDArray, angle: NDArray) -> NDArray:
    """The turn by angles (...), radians, about an axis (3,) or axes (3, ...) of length 1."""
    axis = np.asarray(axis, float)
    axis = axis.reshape(3, *[1] * np.ndim(angle)) if axis.ndim == 1 else axis
    half = 0.5 * np.asarray(angle, float)
    return np.concatenate([axis * np.sin(half), np.cos(half)[None]])


def twist(q: NDArray, axis: NDArray) -> NDArray:
    """By how much (...), in (-pi, pi], a turn goes round an axis (3,), but for what turns that axis itself."""
    along = np.tensordot(axis, q[:3], axes=1)
    angle = 2 * np.arctan2(along, q[3])
    return np.pi - (np.pi - angle) % (2 * np.pi)


def from_vector(vector: NDArray) -> NDArray:
    """The turn by a rotation vector (3, ...), radians."""
    angle = np.sqrt((vector * vector).sum(axis=0))
    return np.concatenate([vector * (0.5 * np.sinc(angle / (2 * np.pi))), np.cos(0.5 * angle)[None]])


def steady(q: NDArray) -> NDArray:
    """The same turns (4, ..., T), with signs such that over time none jumps to its negative."""
    agree = np.einsum("i...t,i...t->...t", q[..., 1:], q[..., :-1])
    if (agree >= 0).all():
        return q
    signs = np.cumprod(np.where(agree < 0, -1.0, 1.0), axis=-1)
    return np.concatenate([q[..., :1], q[..., 1:] * signs], axis=-1)


def world(parents: tuple[int, ...], translation: NDArray, rotation: NDArray) -> tuple[NDArray, NDArray]:
    """Places (J, 3, T) and turns (J, 4, T) of joints in the world from theirs against their parents, shaped alike."""
    places, turns = np.empty_like(translation), np.empty_like(rotation)
    for joint, parent in enumerate(parents):
        if parent < 0:
            places[joint], turns[joint] = translation[joint], rotation[joint]
        else:
            places[joint] = places[parent] + turned(turns[parent], translation[joint])
            turns[joint] = product(turns[parent], rotation[joint])
    return places, turns


_BACK = np.array([-1.0, -1, -1, 1])


def _half_turn(first: NDArray, lengths: NDArray) -> NDArray:
    """Half a turn about an axis across `first`; where a direction is of length 0, no turn."""
    axis = np.stack([first[1] - first[2], first[2] - first[0], first[0] - first[1]])
    other = np.stack([first[1], -first[0], np.zeros_like(first[0])])  # where first is along (1, 1, 1)
    small = (axis * axis).sum(axis=0) < 1e-12 * (first * first).sum(axis=0)
    axis = np.where(small, other, axis)
    axis = axis / np.maximum(np.sqrt((axis * axis).sum(axis=0)), 1e-300)
    none = lengths < 1e-300
    return np.concatenate([np.where(none, 0.0, axis), np.where(none, 1.0, 0.0)[None]])
