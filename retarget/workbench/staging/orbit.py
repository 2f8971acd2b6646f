"""Models on the stage seen from elsewhere, as pictures, for a page that cannot draw them itself (`solids`)."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from retarget.stage.perform import Performance, Role


def seen_from(performance: Performance, turn: float, tilt: float) -> Performance:
    """The performance with its models turned about the vertical, then tilted to the viewer (radians).

    All turn about one place, the middle of what is on the stage, so that parts of one figure stay together.
    """
    solid = [role for role in performance.roles if role.points.shape[-1] == 3]
    if not solid or turn == tilt == 0:
        return performance
    rotation = turned(turn, tilt)
    low = np.min([role.points.min(axis=1) for role in solid], axis=0)  # (T, 3)
    high = np.max([role.points.max(axis=1) for role in solid], axis=0)
    middle = ((low + high) / 2)[:, None]
    moved = [_turned(role, rotation, middle) for role in performance.roles]
    across = np.concatenate([role.points[..., 0] for role in moved if role.points.shape[-1] == 3], axis=1)
    low, high = across.min(axis=1), across.max(axis=1)
    shift = np.maximum(-low, 0) - np.maximum(high - performance.size[0], 0)  # nobody turns out of the picture
    return replace(performance, roles=tuple(_shifted(role, shift) for role in moved))


def turned(turn: float, tilt: float) -> NDArray:
    """The rotation (3, 3) of the stage's space, y down: the model's right side comes nearer with `turn` > 0."""
    c, s = np.cos(turn), np.sin(turn)
    about_y = np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])
    c, s = np.cos(tilt), np.sin(tilt)
    return np.array([[1, 0, 0], [0, c, s], [0, -s, c]]) @ about_y


def _turned(role: Role, rotation: NDArray, middle: NDArray) -> Role:
    if role.points.shape[-1] != 3:
        return role
    return replace(role, points=(role.points - middle) @ rotation.T + middle)


def _shifted(role: Role, right: NDArray) -> Role:
    if role.points.shape[-1] != 3:
        return role
    points = role.points.copy()
    points[..., 0] += right[:, None]
    return replace(role, points=points)
