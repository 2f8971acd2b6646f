"""Feet that stay on the floor: a posed figure's roots go where its feet let them, and legs reach for what is left."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mocap.body import Body
from mocap.skeleton import SkeletonMotion

SOFT = 0.015
"""Metres: a foot that is so much higher than the lowest carries e times less of the figure."""

CALM = 0.09
"""Seconds: a foot that is down for less is on its way."""

DOWN, UP = 0.03, 0.1
"""Metres over the lowest foot up to which a foot stands, and from which on it does not at all."""


def stood(motion: SkeletonMotion, feet: Sequence[int], places: NDArray) -> SkeletonMotion:
    """The motion moved so that its lowest feet (F,) are where they are in `places` (J, 3).

    With all feet down it is their middle that stays; the weight goes over smoothly when one is lifted, and not to one
    that only swings by.  What has no feet stays as it is.
    """
    if not len(feet):
        return motion
    goal, now = np.asarray(places, float)[list(feet)], motion.positions()[:, list(feet)]
    above = _above(now, goal, motion.fps)
    weight = np.exp(-above / SOFT)
    weight /= weight.sum(axis=1, keepdims=True)
    translation = motion.translation.copy()
    for root in (joint for joint, parent in enumerate(motion.skeleton.parents) if parent < 0):
        translation[:, root] += (weight[..., None] * (goal - now)).sum(axis=1)
    return replace(motion, translation=translation)


def planted(motion: SkeletonMotion, body: Body, places: NDArray) -> SkeletonMotion:
    """The motion `stood`, and its legs turned so that each foot that is down is where it is in `places` (J, 3).

    That is for figures that dance on the spot: feet neither slide nor cross, whatever springs do to the legs.
    """
    from mocap.reach import reached
    from mocap.rubber.constrain import Goal

    motion = stood(motion, body.feet, places)
    if not body.feet:
        return motion
    feet = list(body.feet)
    high = _above(motion.positions()[:, feet], np.asarray(places, float)[feet], motion.fps)
    share = np.clip((UP - high) / (UP - DOWN), 0, 1)
    hold = share**2 * (3 - 2 * share)  # (T, F)
    goals = [
        Goal(foot, np.broadcast_to(places[foot], (len(motion), 3)), hold[:, n]) for n, foot in enumerate(body.feet)
    ]
    return reached(motion, goals, motion.skeleton.parents[body.legs()[0][0]])


def _above(now: NDArray, goal: NDArray, fps: float) -> NDArray:
    """How much higher feet (T, F, 3) are than the lowest (T, F), seen over a moment."""
    from scipy.ndimage import gaussian_filter1d

    high = now[..., 1] - goal[:, 1]
    high = gaussian_filter1d(high - high.min(axis=1, keepdims=True), CALM * fps, axis=0, mode="nearest")
    return high - high.min(axis=1, keepdims=True)
