"""A pose to start from, for skeletons whose files have none: in many, joints that are not turned mean nothing."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mocap.body import Body, find_body
from mocap.posing.starting import kind_of, standing
from mocap.rubber.rubber import rooted
from mocap.skeleton import Skeleton, SkeletonMotion


def rested(motion: SkeletonMotion) -> tuple[Skeleton, NDArray]:
    """A skeleton that stands on the floor at the origin and looks along z, and how its joints are turned there (J, 4).

    It is the frame of an upright motion in which legs are straightest below, and the trunk above them; a human's arms
    are made to hang and its legs straight.  Links are as long as they are for most of the time.
    """
    settled = _settled(motion)
    places = settled.positions()
    body = find_body(settled.skeleton, places)
    score = _uprightness(body, places)
    best = int((score >= score.max() - 1e-6).argmax())
    if kind_of(settled.skeleton, settled.rotation[best]) == "plant":
        frame = settled.part(0, 1)
        frame = replace(frame, skeleton=replace(frame.skeleton, offsets=frame.translation[0]))
        middle = [joint for joint, parent in enumerate(frame.skeleton.parents) if parent < 0][:1]
    else:
        frame = _facing(settled.part(best, best + 1), body, places[best])
        middle = [leg[0] for leg in body.legs()]
    rest = standing(frame.skeleton, frame.rotation[0])
    shown = replace(frame, rotation=rest[None]).positions()[0]
    offsets = frame.skeleton.offsets.copy()
    roots = [joint for joint, parent in enumerate(frame.skeleton.parents) if parent < 0]
    hips = shown[middle].mean(axis=0)
    offsets[roots] -= [hips[0], shown[:, 1].min(), hips[2]]
    return replace(frame.skeleton, offsets=offsets), rest


def _settled(motion: SkeletonMotion) -> SkeletonMotion:
    """The motion with links that keep their length, and a root for each joint that moves freely."""
    motion = rooted(motion)
    inner = np.array(motion.skeleton.parents) >= 0
    return replace(motion, translation=np.where(inner[:, None], motion.skeleton.offsets, motion.translation))


def _uprightness(body: Body, places: NDArray) -> NDArray:
    """How straight legs go down and the trunk goes up in each of T frames (T,), and how flat and level the feet are."""
    score, ankles, size = np.zeros(len(places)), [], 1e-9
    for name, path in body.parts.items():
        joints = places[:, list(path)]
        if name.endswith("leg"):
            leg = joints[:, :-1] if len(path) > 3 else joints
            length = np.linalg.norm(np.diff(leg, axis=1), axis=-1).sum(axis=1)
            pitch = (joints[:, -1] - leg[:, -1])[:, 1]
            score += (leg[:, 0] - leg[:, -1])[:, 1] / np.maximum(length, 1e-9)
            score -= 5 * np.abs(pitch - np.median(pitch)) / np.maximum(length, 1e-9)  # most of the time feet are flat
            ankles.append(leg[:, -1, 1])
            size = max(size, float(np.median(length)))
    if ankles:
        score -= 3 * np.ptp(ankles, axis=0) / size
    if len(ankles) == 2 and "spine" in body.parts:
        top = body.parts.get("head", body.parts["spine"])[0]
        way = places[:, top] - places[:, body.parts["spine"][0]]
        score += 3 * way[:, 1] / np.maximum(np.linalg.norm(way, axis=-1), 1e-9)
    return score


def _facing(frame: SkeletonMotion, body: Body, places: NDArray) -> SkeletonMotion:
    """One frame turned about the vertical, so that its left is x, and its roots carried there as the rest's are."""
    from scipy.spatial.transform import Rotation

    across = np.zeros(3)
    for name, path in body.parts.items():
        other = body.parts.get(name.replace("left", "right", 1)) if name.startswith("left") else None
        if other:
            across += places[path[0]] - places[other[0]]
    heading = np.arctan2(across[2], across[0]) if np.hypot(across[0], across[2]) > 1e-9 else 0.0
    turn = Rotation.from_rotvec([0, heading, 0])
    offsets, rotation = frame.skeleton.offsets.copy(), frame.rotation.copy()
    for root in (joint for joint, parent in enumerate(frame.skeleton.parents) if parent < 0):
        offsets[root] = turn.apply(frame.translation[0, root])
        rotation[0, root] = (turn * Rotation.from_quat(rotation[0, root])).as_quat()
    return replace(
        frame, skeleton=replace(frame.skeleton, offsets=offsets), rotation=rotation, translation=offsets[None]
    )
