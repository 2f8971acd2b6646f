"""The way over the ground as the feet that stand carry it (Wu et al. 2008, section 3.7, before any leg is bent).

The curves of the root and those of the legs are made apart, and may not agree on how long a step is: then all feet
slide.  Where feet stand, they tell how fast the body goes; in flight it goes on as before and after.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mocap.analogy.curves import hips
from mocap.skeleton import SkeletonMotion

EVEN = 0.1
"""Seconds within which the body's speed is not changed suddenly."""


def carried(
    motion: SkeletonMotion, feet: Sequence[int], contacts: NDArray, slack: float, even: float = EVEN
) -> SkeletonMotion:
    """The motion with its root going as the joints `feet` (F,) carry it in their contacts (T, F).

    Speeds are changed by what goes beyond `slack` metres a second: so much feet slide that stand well.
    """
    from scipy.linalg import solveh_banded

    both = contacts[1:] & contacts[:-1]
    if not both.any():
        return motion
    slides = np.diff(motion.positions()[:, feet][..., [0, 2]], axis=0) * motion.fps  # (T - 1, F, 2)
    standing = both.sum(axis=1)
    wanted = -(slides * both[..., None]).sum(axis=1)
    stiff = (even * motion.fps) ** 2
    band = np.zeros((2, len(both)))
    band[1] = standing + stiff * np.r_[1, np.full(len(both) - 2, 2), 1] if len(both) > 1 else standing
    band[0, 1:] = -stiff
    change = solveh_banded(band, wanted, check_finite=False)
    size = np.linalg.norm(change, axis=1, keepdims=True)
    change *= np.maximum(size - slack, 0) / np.maximum(size, 1e-12)
    way = np.concatenate([np.zeros((1, 2)), np.cumsum(change, axis=0)]) / motion.fps
    return shifted(motion, np.stack([way[:, 0], np.zeros(len(way)), way[:, 1]], axis=-1))


def shifted(motion: SkeletonMotion, way: NDArray) -> SkeletonMotion:
    """The motion with its hips carried by `way` (T, 3) in the world."""
    body = hips(motion)
    above = motion.skeleton.parents[body]
    turn = np.eye(3) if above < 0 else motion.world()[:, above, :, :3]
    translation = motion.translation.copy()
    translation[:, body] += (np.swapaxes(turn, -1, -2) @ way[..., None])[..., 0]
    return replace(motion, translation=translation)
