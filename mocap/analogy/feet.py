"""Feet of a made-up motion that stand where they step (Wu et al. 2008, section 3.7).

A foot that was on the ground in B, and is near it in B', is meant to stand.  It is held at the one place where it
strays least, by turning the leg's joints; hips that are too high for that come down a little.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mocap.analogy.curves import hips
from mocap.reach import reached
from mocap.rubber.constrain import BLEND, Goal, easing
from mocap.skeleton import SkeletonMotion

REACH = 0.995
"""Of a leg's length: nearer to straight it would snap."""


def standing(motion: SkeletonMotion, feet: Sequence[int], contacts: NDArray, blend: float = BLEND) -> SkeletonMotion:
    """The motion (T frames) with the joints `feet` (F,) at rest in their contacts (T, F); bones keep their lengths."""
    places = motion.positions()
    goals = [
        _stand(joint, places[:, joint], contacts[:, foot], motion.fps, blend)
        for foot, joint in enumerate(feet)
        if contacts[:, foot].any()
    ]
    if not goals:
        return motion
    body = hips(motion)
    return reached(_lowered(motion, goals, body), goals, body)


def _stand(joint: int, places: NDArray, contact: NDArray, fps: float, blend: float) -> Goal:
    """A goal at the mean place of every stretch of contact, and between two of them where the joint is."""
    held = places.copy()
    for first, stop in np.flatnonzero(np.diff(np.r_[0, contact, 0])).reshape(-1, 2):
        held[first:stop] = places[first:stop].mean(axis=0)
    hold = easing(contact, fps, blend)
    known = np.flatnonzero(contact)
    shift = np.stack([np.interp(np.arange(len(held)), known, (held - places)[known, k]) for k in range(3)], axis=-1)
    return Goal(joint, places + shift, hold)


def _lowered(motion: SkeletonMotion, goals: Sequence[Goal], body: int) -> SkeletonMotion:
    """The motion with the hips let down, smoothly, where a leg would have to be longer than it is."""
    from scipy.ndimage import gaussian_filter1d, maximum_filter1d

    world, parents = motion.world(), motion.skeleton.parents
    lack = np.zeros(len(motion))
    for goal in goals:
        way = [goal.joint]
        while parents[way[-1]] not in (body, -1):
            way.append(parents[way[-1]])
        hip = world[:, way[-1], :, 3]
        length = REACH * sum(np.linalg.norm(motion.translation[:, joint], axis=1).mean() for joint in way[:-1])
        wanted = goal.hold[:, None] * goal.places + (1 - goal.hold)[:, None] * world[:, goal.joint, :, 3]
        aside = np.minimum(np.linalg.norm((wanted - hip)[:, [0, 2]], axis=1), 0.9 * length)
        lack = np.maximum(lack, hip[:, 1] - wanted[:, 1] - np.sqrt(length**2 - aside**2))
    lack = np.where(np.max([goal.hold for goal in goals], axis=0) > 0, lack, 0.0)
    if lack.max() <= 0:
        return motion
    width = BLEND * motion.fps
    down = gaussian_filter1d(maximum_filter1d(lack, 2 * int(2 * width) + 1), width, mode="nearest")
    above = parents[body]
    turn = np.eye(3) if above < 0 else world[:, above, :, :3]
    translation = motion.translation.copy()
    translation[:, body] -= np.swapaxes(turn, -1, -2) @ np.array([0, 1.0, 0]) * down[:, None]
    return replace(motion, translation=translation)
