"""The way over the ground as the feet that stand carry it (Wu et al. 2008, section 3.7, before any leg is bent).

The curves of the root and those of the legs are made apart, and may not agree on how long a step is: then all feet
slide.  Where feet stand, they tell how fast the body goes; in flight it goes on as before and after.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mocap.analogy.curves import hips
from mocap.skeletons.skeleton import SkeletonMotion

EVEN = 0.1
"""Seconds within which the body is not moved suddenly."""

LOW = 0.01
"""Metres: feet that stand so much too high or low are left to the legs."""


def carried(
    motion: SkeletonMotion, feet: Sequence[int], contacts: NDArray, slack: float, even: float = EVEN
) -> SkeletonMotion:
    """The motion with its root going as the joints `feet` (F,) carry it in their contacts (T, F).

    Speeds are changed by what goes beyond `slack` metres a second: so much feet slide that stand well.  If they do on
    average, nothing is changed.
    """
    both = contacts[1:] & contacts[:-1]
    slides = np.diff(motion.positions()[:, feet][..., [0, 2]], axis=0) * motion.fps  # (T - 1, F, 2)
    if not both.any() or np.linalg.norm(slides, axis=-1)[both].mean() <= 1.01 * slack:
        return motion
    change = _evenly(-slides, both, even * motion.fps, slack)
    way = np.concatenate([np.zeros((1, 2)), np.cumsum(change, axis=0)]) / motion.fps
    return shifted(motion, np.stack([way[:, 0], np.zeros(len(way)), way[:, 1]], axis=-1))


def grounded(
    motion: SkeletonMotion,
    feet: Sequence[int],
    contacts: NDArray,
    heights: NDArray,
    slack: float = LOW,
    even: float = EVEN,
) -> SkeletonMotion:
    """The motion as high as its feet are at `heights` (T, F), metres, in their contacts (T, F), but for `slack`."""
    if not contacts.any():
        return motion
    lack = (heights - motion.positions()[:, feet, 1])[..., None]
    change = _evenly(lack, contacts, even * motion.fps, slack)
    return shifted(motion, change * [0, 1.0, 0])


def _evenly(wanted: NDArray, where: NDArray, even: float, slack: float) -> NDArray:
    """What is wanted (n, F, d) where (n, F) it is, evened out over `even` frames and shortened by `slack`: (n, d)."""
    from scipy.linalg import solveh_banded

    stiff, count = even**2, len(where)
    band = np.zeros((2, count))
    band[1] = where.sum(axis=1) + (stiff * np.r_[1, np.full(count - 2, 2), 1] if count > 1 else 0)
    band[0, 1:] = -stiff
    change = solveh_banded(band, (wanted * where[..., None]).sum(axis=1), check_finite=False)
    size = np.linalg.norm(change, axis=1, keepdims=True)
    return change * np.maximum(size - slack, 0) / np.maximum(size, 1e-12)


def shifted(motion: SkeletonMotion, way: NDArray) -> SkeletonMotion:
    """The motion with its hips carried by `way` (T, 3) in the world."""
    body = hips(motion)
    above = motion.skeleton.parents[body]
    turn = np.eye(3) if above < 0 else motion.world()[:, above, :, :3]
    translation = motion.translation.copy()
    translation[:, body] += (np.swapaxes(turn, -1, -2) @ way[..., None])[..., 0]
    return replace(motion, translation=translation)
