"""Joints turned until others are where they must be: inverse kinematics for any skeleton, all frames at once.

Damped least squares on the joints above a goal.  A joint turns most easily about the axes it turns about anyway; a knee
may turn a little about the others, so that no bone has to stretch (Wu et al. 2008, section 3.7).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from capture.motion import affine
from mocap.rubber.constrain import Goal
from mocap.skeletons.skeleton import SkeletonMotion, own_maps

LINKS = 3
"""So many joints above the first goal turn: hip, knee and ankle for a toe; they never include the hips."""

ROUNDS = 12
INWARD = 0.02
"""Of a limb's length: so much nearer is asked of it where it is bent in full; less asks less, so that nothing jumps."""

STIFF = 0.15
"""How easily a joint turns about an axis that it hardly uses, against the one it uses most."""


def reached(motion: SkeletonMotion, goals: Sequence[Goal], body: int, rounds: int = ROUNDS) -> SkeletonMotion:
    """The motion (T frames) with goals met as well as the limbs reach; joints above and at `body` keep their turns.

    Goals of one limb are met together.  A goal held by 0.5 is met half way from where the joint was.
    """
    rotation, maps = motion.rotation.copy(), motion.world()
    for limb in _limbs(motion.skeleton.parents, goals, body):
        turning = _turning(motion.skeleton.parents, limb, body)
        busy = np.flatnonzero(np.max([goal.hold for goal in limb], axis=0) > 0)
        if len(busy) and turning:
            rotation[busy] = _solved(motion, rotation[busy], maps[busy], limb, busy, turning, rounds)
    return replace(motion, rotation=rotation)


def _solved(
    motion: SkeletonMotion,
    rotation: NDArray,
    maps: NDArray,
    goals: Sequence[Goal],
    busy: NDArray,
    turning: Sequence[int],
    rounds: int,
) -> NDArray:
    """Rotations (F, J, 4) of busy frames with the turning joints turned."""
    from scipy.spatial.transform import Rotation

    parents = motion.skeleton.parents
    chain = _between(parents, [goal.joint for goal in goals], turning[0])
    ease = _ease(motion.rotation[:, turning])  # (n, 3) along each joint's own axes
    start = np.stack([maps[:, goal.joint, :, 3] for goal in goals], axis=1)
    wanted = np.stack([goal.places[busy] for goal in goals], axis=1)
    hold = np.stack([goal.hold[busy] for goal in goals], axis=1)[..., None]
    wanted = start + hold * (wanted - start)
    reach = np.linalg.norm(np.diff(maps[:, chain][..., 3], axis=1), axis=-1).sum(axis=1).mean()
    damping = (0.01 * reach) ** 2
    rotation = rotation.copy()
    bend = _bend(motion.rotation[:, turning])
    limbs = np.array([[joint in _way_up(parents, goal.joint)[1:] for joint in turning] for goal in goals])
    for k in range(rounds):
        places = np.stack([maps[:, goal.joint, :, 3] for goal in goals], axis=1)
        left = (wanted - places).reshape(len(busy), -1)
        if np.abs(left).max() < 1e-5:
            break
        axes = maps[:, turning, :, :3]  # (F, n, 3, 3) columns are the joints' axes in the world
        arms = places[:, :, None] - maps[:, turning][:, None, ..., 3]  # (F, g, n, 3)
        # a small turn about axis a moves a point at arm r by a x r
        moves = np.cross(axes.swapaxes(-1, -2)[:, None], arms[..., None, :])  # (F, g, n, axis, 3)
        moves = moves * limbs[None, :, :, None, None]
        jacobian = moves.transpose(0, 1, 4, 2, 3).reshape(len(busy), left.shape[1], -1)
        eased = jacobian * ease.ravel()
        gram = eased @ jacobian.swapaxes(-1, -2) + damping * np.eye(left.shape[1])
        turns = (eased.swapaxes(-1, -2) @ np.linalg.solve(gram, left[..., None]))[..., 0]
        turns = turns.reshape(len(busy), len(turning), 3)
        if k == 0:  # a straight limb cannot shorten by small turns: its inner joints are bent a little first
            inward = -(left.reshape(*places.shape) * arms[:, :, 0]).sum(axis=(1, 2)) / reach**2
            turns[:, 1:] += np.clip(inward / INWARD, 0, 1)[:, None, None] * bend[1:]
        size = np.linalg.norm(turns, axis=-1, keepdims=True)
        turns *= np.minimum(1, 0.5 / np.maximum(size, 1e-12))
        own = Rotation.from_quat(rotation[:, turning].reshape(-1, 4)) * Rotation.from_rotvec(turns.reshape(-1, 3))
        rotation[:, turning] = own.as_quat().reshape(len(busy), len(turning), 4)
        mine = own_maps(motion.translation[busy][:, chain], rotation[:, chain])
        for n, joint in enumerate(chain):
            maps[:, joint] = affine.compose(maps[:, parents[joint]], mine[:, n])
    return rotation


def _ease(rotation: NDArray) -> NDArray:
    """How easily joints (T, n, 4) turn about their own axes (n, 3): as they do in the motion, 1 for the most used."""
    from mocap.skeletons import rotations

    turns = rotations.turns_between(rotation[:1], rotation)
    used = turns.std(axis=0)
    return STIFF + (1 - STIFF) * used / np.maximum(used.max(axis=-1, keepdims=True), 1e-9)


def _bend(rotation: NDArray) -> NDArray:
    """A small turn (n, 3) of each joint (T, n, 4) the way it is bent most: a knee backwards, an elbow forwards."""
    from mocap.skeletons import rotations

    turns = rotations.turns_between(np.array([0, 0, 0, 1.0]), rotation)
    most = turns[np.linalg.norm(turns, axis=-1).argmax(axis=0), np.arange(rotation.shape[1])]
    return 0.1 * most / np.maximum(np.linalg.norm(most, axis=-1, keepdims=True), 0.1)


def _limbs(parents: Sequence[int], goals: Sequence[Goal], body: int) -> list[list[Goal]]:
    """Goals by limb: by the joint below `body` that they hang on."""
    limbs: dict[int, list[Goal]] = {}
    for goal in goals:
        way = _way_up(parents, goal.joint)
        base = way[way.index(body) - 1] if body in way[1:] else way[-1]
        limbs.setdefault(base, []).append(goal)
    return list(limbs.values())


def _turning(parents: Sequence[int], goals: Sequence[Goal], body: int) -> list[int]:
    """The joints that turn, nearest to the body first: those above the farthest goal, and only so many."""
    ways = [_way_up(parents, goal.joint) for goal in goals]
    way = max(ways, key=len)[1:]
    if body in way:
        way = way[: way.index(body)]
    count = LINKS + sum(goal.joint in way for goal in goals) - (1 if len(goals) > 1 else 0)
    return way[:count][::-1]


def _between(parents: Sequence[int], joints: Sequence[int], first: int) -> list[int]:
    """Joints from `first` down to `joints`, parents first."""
    wanted: set[int] = set()
    for joint in joints:
        way = _way_up(parents, joint)
        wanted |= set(way[: way.index(first) + 1] if first in way else [joint])
    return sorted(wanted)


def _way_up(parents: Sequence[int], joint: int) -> list[int]:
    way = [joint]
    while parents[way[-1]] >= 0:
        way.append(parents[way[-1]])
    return way
