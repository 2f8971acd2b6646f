"""Motion of the plane lent to space: the stage is seen from the front, x right, y down, z to the viewer, in pixels.

What was captured in a drawing's plane moves a model in the plane it is seen in; what its depth does meanwhile no
drawing tells, and is chosen.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError

Depth = Callable[[NDArray], NDArray]
"""A rule for how much deeper a body gets (...) under maps of the plane (..., 2, 3).  `kept`, `even` and
`keeping_volume` are three; each is the product of its values for two maps that are done one after the other."""

PLANES = {"xy": (0.0, 0.0, 1.0), "zy": (-1.0, 0.0, 0.0), "-xy": (0.0, 0.0, -1.0), "-zy": (1.0, 0.0, 0.0)}
"""Sides of a model that stands up along y and looks along z, by the direction they are seen from: its front, its
side as it looks to the right, its back, and its side as it looks to the left."""

THINNEST = 0.05
"""A drawing squashed flatter than to this share of its area makes no body deeper any more."""


def kept(maps: NDArray) -> NDArray:
    """Depth stays as it is."""
    return np.ones(np.shape(maps)[:-2])


def even(maps: NDArray) -> NDArray:
    """Depth grows as width and height do on the average, the square root of the area's change."""
    return np.sqrt(np.abs(np.linalg.det(np.asarray(maps)[..., :2])))


def keeping_volume(maps: NDArray) -> NDArray:
    """Depth makes up for the area's change: what is squashed from above bulges to the viewer too."""
    return 1 / np.maximum(np.abs(np.linalg.det(np.asarray(maps)[..., :2])), THINNEST)


def lifted(maps: NDArray, depth: NDArray) -> NDArray:
    """Maps of the plane (..., 2, 3) as maps of space (..., 3, 4) that stretch depth by `depth` (...)."""
    maps = np.asarray(maps, float)
    space = np.zeros((*maps.shape[:-2], 3, 4))
    space[..., :2, :2], space[..., :2, 3], space[..., 2, 2] = maps[..., :2], maps[..., 2], depth
    return space


def view(plane: str | Sequence[float]) -> NDArray:
    """The turn (3, 3) from a model, y up, to what is seen of it: to the right, down, and to the viewer.

    `plane` is a name in PLANES, or the direction (3,) from the model to the viewer.
    """
    if isinstance(plane, str) and plane not in PLANES:
        raise InputError(f"a plane must be {', '.join(PLANES)} or a direction [x, y, z] to the viewer, got {plane!r}")
    towards = np.asarray(PLANES[plane] if isinstance(plane, str) else plane, float)
    if towards.shape != (3,) or not np.isfinite(towards).all() or np.linalg.norm(towards) < 1e-9:
        raise InputError(f"a plane's direction to the viewer must be three numbers, not all 0, got {plane}")
    towards = towards / np.linalg.norm(towards)
    top = np.array([0.0, 1, 0])
    if abs(towards[1]) > 1 - 1e-9:  # from above what lies to the back is up, from below what lies to the front
        top = np.array([0.0, 0, -np.sign(towards[1])])
    right = np.cross(top, towards)
    right /= np.linalg.norm(right)
    return np.stack([right, -np.cross(towards, right), towards])
