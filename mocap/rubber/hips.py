"""Hips come down no further than the legs they stand on can be squashed, and go up no further than those stretch."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mocap.rubber import exaggerate
from mocap.rubber.constrain import easing
from mocap.rubber.subjoints import SubJoints

SMOOTH = 0.06
"""Seconds over which hips are lifted or let down: a leg's bound may be passed by a little within them."""


def carried(
    positions: NDArray,
    subjoints: SubJoints,
    captured: NDArray,
    feet: Sequence[int],
    contacts: NDArray,
    fps: float,
    most_stretch: float,
    settle: float,
) -> NDArray:
    """Sub-joints (T, S, 3) lifted or let down as a whole, where feet that are to stand ask too much of their legs.

    A leg that stands (`contacts` (T, F) of the joints `feet` (F,), coming and going within `settle` seconds) may be
    `most_stretch` times as long or as short, from hip to captured ankle, as it was captured (T, J, 3).
    """
    up, down = np.zeros((2, len(positions)))
    for foot, joint in enumerate(feet):
        leg = next((group for group in subjoints.groups if group[-1] == joint), None)
        if leg is None or not contacts[:, foot].any():
            continue
        long = np.linalg.norm(captured[:, leg[0]] - captured[:, joint], axis=1)
        here = positions[:, subjoints.ends[leg[0]]] - captured[:, joint]
        share = easing(contacts[:, foot], fps, settle)
        flat = here[:, 0] ** 2 + here[:, 2] ** 2
        lowest, highest = (np.sqrt(np.maximum((r * long) ** 2 - flat, 0)) for r in (1 / most_stretch, most_stretch))
        up = np.maximum(up, share * np.maximum(lowest - here[:, 1], 0))
        down = np.maximum(down, share * np.where(highest > 0, np.maximum(here[:, 1] - highest, 0), 0))
    lift = up - down
    if not lift.any():
        return positions
    moved = positions.copy()
    moved[..., 1] += exaggerate.averaged(lift, SMOOTH * fps)[:, None]
    return moved
