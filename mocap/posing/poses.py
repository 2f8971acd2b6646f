"""Poses, and what they are in a motion: where joints are and how they are turned, against turns of joints on joints."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from mocap import quaternions as quat
from mocap.skeleton import Skeleton, SkeletonMotion

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


def between(skeleton: Skeleton, poses: Sequence[Pose], seconds: float, fps: float) -> SkeletonMotion:
    """A motion from pose to pose, `seconds` for each way, that slows in and out of every one.

    Joints turn on joints by the smallest turn, so that links keep their lengths on the way.
    """
    if not poses or not seconds > 0 or not fps > 0:
        raise InputError(
            f"a motion needs poses, seconds from one to the next and a frame rate, there are {len(poses)}, {seconds} "
            f"and {fps}: keep a posture first"
        )
    keys = motion_of(skeleton, poses, fps)
    times = np.arange(round((len(poses) - 1) * seconds * fps) + 1) / (seconds * fps)
    start = np.minimum(times.astype(int), max(len(poses) - 2, 0))
    end, share = np.minimum(start + 1, len(poses) - 1), np.clip(times - start, 0, 1)
    share = share * share * (3 - 2 * share)
    first, last = (np.ascontiguousarray(keys.rotation[at].transpose(1, 2, 0)).swapaxes(0, 1) for at in (start, end))
    way = quat.product(quat.inverse(first), last)
    way = way * np.where(way[3] < 0, -1.0, 1.0)
    sine = np.sqrt((way[:3] ** 2).sum(axis=0))
    vector = way[:3] * (2 * np.arctan2(sine, way[3]) / np.maximum(sine, 1e-12))
    rotation = quat.product(first, quat.from_vector(share * vector)).transpose(2, 1, 0)
    mixed = share[:, None, None]
    translation = (1 - mixed) * keys.translation[start] + mixed * keys.translation[end]
    return SkeletonMotion(skeleton, translation, np.ascontiguousarray(rotation), fps)
