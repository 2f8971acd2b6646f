"""Feet that stay on the floor: a posed figure's roots go where its feet let them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mocap.skeleton import SkeletonMotion

SOFT = 0.015
"""Metres: a foot that is so much higher than the lowest carries e times less of the figure."""


def stood(motion: SkeletonMotion, feet: Sequence[int], places: NDArray) -> SkeletonMotion:
    """The motion moved so that its lowest feet (F,) are where they are in `places` (J, 3).

    With all feet down it is their middle that stays, and the weight goes over smoothly when one is lifted.  What has
    no feet stays as it is.
    """
    feet = list(feet)
    if not feet:
        return motion
    goal = np.asarray(places, float)[feet]
    now = motion.positions()[:, feet]
    above = now[..., 1] - goal[:, 1]
    weight = np.exp(-(above - above.min(axis=1, keepdims=True)) / SOFT)
    weight /= weight.sum(axis=1, keepdims=True)
    move = (weight[..., None] * (goal - now)).sum(axis=1)
    translation = motion.translation.copy()
    for root in (joint for joint, parent in enumerate(motion.skeleton.parents) if parent < 0):
        translation[:, root] += move
    return replace(motion, translation=translation)
