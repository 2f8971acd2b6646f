"""From where a performer is seen when a drawing plays its part: arms, legs and trunk each in the plane that shows most.

A drawing has one view of itself and no other.  A performer who turns round would fold it up, so the viewer goes round
with the performer and looks at the arms from the front, say, and at striding legs from the side, as the authors of
AnimatedDrawings found children's drawings to want it.  A camera that stands still can be asked for instead.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

PARTS = ("trunk", "arms", "legs")
FRONT, SIDE = 0.0, 90.0
"""Degrees that the viewer stands round from the performer's front, towards its right side: then it faces right."""

BETTER = {"arms": 4.0, "legs": 1.5}
"""Limbs are seen from the side only if they go so much farther there, in squares: most drawings show a front.

More is asked of arms: from the side one hides the other, and arms thrown up are one.
"""

STEADY = 0.25
"""Seconds over which the way the performer faces is averaged: hips that swing in a walk are the walk's own."""

NARROW = 0.3
"""A drawing whose shoulders and hips are narrower than this share of its trunk's length shows its side."""


@dataclass(frozen=True)
class Views:
    """Degrees round from the performer's front for each part; or, if the camera stands still, from the z axis."""

    trunk: float = FRONT
    arms: float = FRONT
    legs: float = FRONT
    turning: bool = True  # the viewer goes round with the performer
    note: str = ""

    def seen(self, part: str) -> NDArray:
        """The rows (3, 3) that take a place in the performer's frame to right, up, and to the viewer."""
        angle = np.radians(getattr(self, part))
        return np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])


STILL = Views(turning=False)
"""Along -z, for what has no front."""


def headings(positions: NDArray, sides: list[tuple[int, int]], fps: float) -> NDArray:
    """Which way a performer faces (T,), radians from z towards x, of joints (T, J, 3) and pairs (left, right) of them.

    Steadied over a quarter of a second, and without jumps.
    """
    from scipy.ndimage import gaussian_filter1d

    across = sum(positions[:, left] - positions[:, right] for left, right in sides)
    forward = np.stack([-across[:, 2], across[:, 0]], axis=-1)  # across x up, on the floor: x, z
    angle = np.unwrap(np.arctan2(forward[:, 0], forward[:, 1]))
    return gaussian_filter1d(angle, STEADY * fps, mode="nearest") if len(angle) > 1 else angle


def turned(vectors: NDArray, heading: NDArray) -> NDArray:
    """Vectors (T, ..., 3) as seen in the frame of a performer who faces `heading` (T,): z is its front, x its left."""
    shape = (len(heading), *[1] * (np.ndim(vectors) - 2))
    c, s = np.cos(heading).reshape(shape), np.sin(heading).reshape(shape)
    x, y, z = np.moveaxis(vectors, -1, 0)
    return np.stack([c * x - s * z, y, s * x + c * z], axis=-1)


def chosen(ways: dict[str, NDArray], profile: bool) -> Views:
    """Views for a drawing that shows its front, or its `profile`, by where limbs go (T, n, 3) against their length.

    They are told in the performer's frame.  Of front and side, limbs are seen from where they go farther out.
    """
    if profile:
        return Views(SIDE, SIDE, SIDE, note="seen from its right side, for the drawing shows a side")
    angles, told = {}, []
    for part in ("arms", "legs"):
        across, _, along = np.einsum("tnx,tnx->x", ways[part], ways[part]) if ways[part].size else (1.0, 0.0, 0.0)
        angles[part] = SIDE if along > BETTER[part] * across else FRONT
        told.append(f"{part} {'side' if angles[part] else 'front'} ({along / max(across, 1e-9):.1f} deep to 1 wide)")
    return Views(FRONT, angles["arms"], angles["legs"], note=f"seen from the front; {', '.join(told)}")
