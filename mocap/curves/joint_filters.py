"""Filters on a skeleton's joint angles: what may be done to it without stretching a link.

A joint's turns over time are laid out as a curve of small turns, each seen from the joint as it then stands, one after
the other (the development of the curve).  No direction is singular on it, a turn of many rounds is no longer than it
is, and a filter's change is a small turn again: by that the joint is turned further.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mocap.curves import filters
from mocap.curves.ends import travel_of
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion


def cartoon_angles(
    motion: SkeletonMotion,
    amount: float = 1.0,
    sigma: float | None = None,
    follow: float = 0.0,
    anticipation: float = 1.0,
    overshoot: float = 1.0,
    loop: bool = False,
) -> SkeletonMotion:
    """The cartoon animation filter on joint angles and on how roots travel (Wang et al. 2006).

    sigma in seconds, the `pace` of the angles if not given; `follow` is how many seconds the tips come later.
    """
    turns = developed(motion.rotation)
    sigma = filters.pace(turns, motion.fps, loop) if sigma is None else sigma
    late = follow * depth(motion.skeleton)[:, None]
    said = {"anticipation": anticipation, "overshoot": overshoot, "loop": loop}
    around, far = _rounds(motion, turns) if loop else (0.0, 0.0)
    bent = filters.cartoon(turns, motion.fps, amount, sigma, late, travel=around, **said)
    moved = filters.cartoon(motion.translation, motion.fps, amount, sigma, late, travel=far, **said)
    return replace(motion, rotation=turned(motion.rotation, bent - turns), translation=moved)


def exaggerated_angles(
    motion: SkeletonMotion, omega: float = 2.0, sigma: float = 0.15, loop: bool = False
) -> SkeletonMotion:
    """Joint angles turned `omega` times as far from their average over `sigma` seconds (after Lee and Shin 2001).

    Roots' ways are exaggerated likewise, so that a leap is a higher one.
    """
    turns = developed(motion.rotation)
    around, far = _rounds(motion, turns) if loop else (0.0, 0.0)
    away = turns - filters.average(turns, motion.fps, sigma, loop, around)
    off = motion.translation - filters.average(motion.translation, motion.fps, sigma, loop, far)
    return replace(
        motion,
        rotation=turned(motion.rotation, (omega - 1) * away),
        translation=motion.translation + (omega - 1) * off,
    )


def developed(rotations: NDArray) -> NDArray:
    """Rotations (T, J, 4) as curves (T, J, 3) of small turns, radians in the joint's own axes, from 0 on."""
    from mocap.skeletons.rotations import turns_between

    curves = np.zeros((*rotations.shape[:-1], 3))
    if len(rotations) > 1:
        curves[1:] = np.cumsum(turns_between(rotations[:-1], rotations[1:]), axis=0)
    return curves


def turned(rotations: NDArray, turns: NDArray) -> NDArray:
    """Rotations (T, J, 4) turned further by rotation vectors (T, J, 3) in the joints' own axes."""
    from scipy.spatial.transform import Rotation

    more = Rotation.from_quat(rotations.reshape(-1, 4)) * Rotation.from_rotvec(turns.reshape(-1, 3))
    return more.as_quat().reshape(rotations.shape)


def depth(skeleton: Skeleton) -> NDArray:
    """How far joints are from their root along the links at rest (J,): 0 at roots, 1 where furthest."""
    far = np.zeros(len(skeleton))
    for joint, (parent, length) in enumerate(zip(skeleton.parents, skeleton.lengths())):
        far[joint] = far[parent] + length if parent >= 0 else 0.0
    return far / far.max() if far.any() else far


def _rounds(motion: SkeletonMotion, turns: NDArray) -> tuple[NDArray, NDArray]:
    """How far joints turn (J, 3) and go (J, 3) in a round of a loop, against their parents: only roots get on."""
    from mocap.skeletons.rotations import turns_between

    around = turns[-1] - turns[0] + turns_between(motion.rotation[-1], motion.rotation[0])
    return around, np.stack([travel_of(path) for path in np.swapaxes(motion.translation, 0, 1)])
