"""Which joints stand, and when: the feet that a rubber motion keeps where they were captured."""

import numpy as np
from numpy.typing import NDArray

from mocap.body import find_body
from mocap.contacts import find_contacts
from mocap.skeleton import SkeletonMotion
from mocap.units import stature

POSES = 50
"""So many frames are enough to tell which joint is what."""


def found(motion: SkeletonMotion, captured: NDArray) -> tuple[tuple[int, ...], NDArray]:
    """The joints (F,) of feet, ankles and toes, and when each foot stands (T, F) bool; captured (T, J, 3) metres, y up.

    An ankle stands as long as its toe does: both are then where they were, and a heel lifts as it did.
    """
    body = find_body(motion.skeleton, captured[:: max(len(captured) // POSES, 1)])
    if not body.feet:
        return (), np.zeros((len(captured), 0), bool)
    stands = find_contacts(captured, body.feet, motion.fps, stature(motion, body) or None)
    lengths, joints, of_foot = motion.skeleton.lengths(), [], []
    for foot, leg in enumerate(body.legs()):
        sole = [body.feet[foot]]
        if leg[-1] == sole[0] and len(leg) > 2 and lengths[leg[-1]] < 0.5 * lengths[list(leg)].max():
            sole.insert(0, leg[-2])
        joints += sole
        of_foot += [foot] * len(sole)
    return tuple(joints), stands[:, of_foot]
