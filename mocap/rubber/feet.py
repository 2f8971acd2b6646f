"""Feet stand where the captured feet stood, and go through no floor (section 6)."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mocap.rubber.constrain import BLEND, Goal, constrained, easing
from mocap.rubber.subjoints import SubJoints

LEAST = 1e-6
"""Metres that are no depth."""


def kept(
    positions: NDArray,
    subjoints: SubJoints,
    captured: NDArray,
    feet: Sequence[int],
    contacts: NDArray,
    fps: float,
    blend: float = BLEND,
) -> NDArray:
    """Sub-joints (T, S, 3) with the joints `feet` (F,) at their captured places in their contacts (T, F).

    `captured` (T, J, 3) are the joints as they were captured.  The body moves as it was made to; legs stretch.  While a
    contact comes and goes within `blend` seconds the foot nears the captured one as that moves, so that what is not
    exaggerated stays as it is.
    """
    goals = [
        Goal(joint, captured[:, joint], easing(contacts[:, foot], fps, blend))
        for foot, joint in enumerate(feet)
        if contacts[:, foot].any()
    ]
    return constrained(positions, subjoints, goals)


def above(
    positions: NDArray,
    subjoints: SubJoints,
    feet: Sequence[int],
    captured: NDArray,
    fps: float,
    ease: float = 0.08,
    floor: float | None = None,
) -> NDArray:
    """Sub-joints (T, S, 3) with legs lifted where a foot would go lower than it ever was captured, or than `floor`.

    Each leg is lifted by what its lowest foot joint lacks, so that a foot keeps its slope; it sets out `ease` seconds
    before and settles as long after, for a foot that hit the floor would tremble.
    """
    goals = []
    for joints in _legs(subjoints, feet):
        lowest = captured[:, joints, 1].min(axis=0) if floor is None else floor
        here = positions[:, subjoints.ends[list(joints)], 1]
        lack = (lowest - here).max(axis=1)
        if lack.max() < LEAST:
            continue
        lack = _eased(np.where(lack < LEAST, 0.0, lack), round(ease * fps))
        for joint in joints:
            places = positions[:, subjoints.ends[joint]].copy()
            places[:, 1] += lack
            goals.append(Goal(joint, places, (lack > 0).astype(float)))
    return constrained(positions, subjoints, goals)


def _eased(lack: NDArray, frames: int) -> NDArray:
    """A smooth curve (T,) nowhere less than `lack` (T,), which it leaves `frames` before and after."""
    from scipy.ndimage import correlate1d, maximum_filter1d

    bell = np.hanning(2 * frames + 3)[1:-1]
    return correlate1d(maximum_filter1d(lack, 2 * frames + 1), bell / bell.sum(), mode="nearest")


def _legs(subjoints: SubJoints, feet: Sequence[int]) -> list[list[int]]:
    """The feet's joints, those of one leg together."""
    parents = subjoints.skeleton.parents
    legs: list[list[int]] = []
    for joint in sorted(feet):
        above = parents[joint]
        while above >= 0 and above not in feet:
            above = parents[above]
        same = [leg for leg in legs if above in leg]
        if same:
            same[0].append(joint)
        else:
            legs.append([joint])
    return legs
