"""Poses, and what they are in a motion: where joints are and how they are turned, against turns of joints on joints."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from mocap.skeletons import quaternions as quat
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion

SAME = 1e-5
"""A link that is longer or shorter by no more than this, times the figure's size, is the skeleton's."""


@dataclass(frozen=True, eq=False)
class Pose:
    """Where the J joints of a figure are and how they are turned."""

    positions: NDArray  # (J, 3)
    turns: NDArray  # (J, 4) quaternions x, y, z, w, in the world


def pose_of(motion: SkeletonMotion, frame: int) -> Pose:
    """The pose of one frame of a motion."""
    if not 0 <= frame < len(motion):
        raise InputError(f"a frame to pose must be 0 to {len(motion) - 1}, it is {frame}")
    own = motion.translation[frame][..., None], motion.rotation[frame][..., None]
    places, turns = quat.world(motion.skeleton.parents, *own)
    return Pose(places[..., 0], turns[..., 0])


def rest_of(skeleton: Skeleton) -> Pose:
    """The pose of a skeleton none of whose joints is turned."""
    return pose_of(motion_of(skeleton, (), 1.0), 0)


def motion_of(skeleton: Skeleton, poses: Sequence[Pose], fps: float) -> SkeletonMotion:
    """A motion of one frame for each pose; without any, one frame of the skeleton at rest."""
    translation = np.tile(np.asarray(skeleton.offsets, float), (max(len(poses), 1), 1, 1))
    rotation = np.zeros((*translation.shape[:2], 4))
    rotation[..., 3] = 1
    if poses:
        places = np.stack([pose.positions for pose in poses], axis=-1)  # (J, 3, T)
        turns = np.stack([pose.turns for pose in poses], axis=-1)
        size = max(float(skeleton.lengths().sum()), 1e-12)
        for joint, parent in enumerate(skeleton.parents):
            own, way = turns[joint], places[joint]
            if parent >= 0:
                back = quat.inverse(turns[parent])
                own, way = quat.product(back, own), quat.turned(back, way - places[parent])
                if np.abs(way.T - skeleton.offsets[joint]).max() <= SAME * size:
                    way = np.asarray(skeleton.offsets[joint], float)[:, None]
            translation[:, joint] = way.T
            rotation[:, joint] = own.T
    return SkeletonMotion(skeleton, translation, rotation, fps)
