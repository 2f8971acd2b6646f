"""Feet of a changed motion that stand where the captured ones stood, with bones as long as they are: legs turn.

For rubber see `rubber/feet`, whose legs stretch; for a motion made by analogy, whose feet stood nowhere yet,
`analogy/feet`.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mocap.bodies.reach import reached
from mocap.rubber.constrain import Goal, easing, envelope
from mocap.skeletons.skeleton import SkeletonMotion

SETTLE = 0.2
"""Seconds in which a foot comes down to where it was captured."""

STRAIGHT = 0.995
"""Of a leg's length: nearer to straight it would snap."""


def planted(motion: SkeletonMotion, captured: NDArray, feet: Sequence[int], contacts: NDArray) -> SkeletonMotion:
    """The motion (T frames) with the joints `feet` (F,) at their captured places (T, J, 3) in their contacts (T, F).

    Hips come down where a leg is too short for it.
    """
    goals = [
        Goal(joint, captured[:, joint], easing(contacts[:, foot], motion.fps, SETTLE))
        for foot, joint in enumerate(feet)
        if contacts[:, foot].any()
    ]
    if not goals:
        return motion
    ways = [motion.skeleton.path(goal.joint) for goal in goals]
    shared = [joint for joint in ways[0] if all(joint in way for way in ways) and joint not in feet]
    body = shared[-1] if len(ways) > 1 else ways[0][0]
    return reached(_lowered(motion, goals, body), goals, body)


def _lowered(motion: SkeletonMotion, goals: Sequence[Goal], body: int) -> SkeletonMotion:
    world = motion.world()
    lack = np.zeros(len(motion))
    for goal in goals:
        way = motion.skeleton.path(goal.joint)
        way = way[way.index(body) + 1 :]
        hip, here = world[:, way[0], :, 3], world[:, goal.joint, :, 3]
        long = STRAIGHT * np.linalg.norm(motion.translation[:, way[1:]], axis=-1).sum(axis=1)
        wanted = here + goal.hold[:, None] * (goal.places - here)
        flat = ((wanted - hip)[:, [0, 2]] ** 2).sum(axis=1)
        high = hip[:, 1] - wanted[:, 1] - np.sqrt(np.maximum(long**2 - flat, 0))
        lack = np.maximum(lack, np.where(goal.hold > 0, high, 0))
    if not lack.any():
        return motion
    down = np.zeros((len(motion), 3))
    down[:, 1] = -envelope(lack, round(SETTLE * motion.fps))
    above = motion.skeleton.parents[body]
    if above >= 0:
        down = np.einsum("tji,tj->ti", world[:, above, :, :3], down)
    translation = motion.translation.copy()
    translation[:, body] += down
    return replace(motion, translation=translation)
