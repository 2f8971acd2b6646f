"""A motion on another skeleton, whose joints have other names, lengths and rest poses."""

import numpy as np
from numpy.typing import NDArray

from mocap.analogy import match
from mocap.analogy.curves import headed, hips, jointed
from mocap.bodies.body import find_body
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion, own_maps, world_maps
from mocap.skeletons.units import stature

ALIKE = np.radians(45)
"""Two persons in one kind of skeleton do not rest farther apart: then turns mean the same for both."""


def lent(
    motion: SkeletonMotion, goal: SkeletonMotion, usual: SkeletonMotion | None = None
) -> tuple[SkeletonMotion, str]:
    """The motion on the skeleton of `goal`, and a sentence on what was matched.

    Links point where the links they answer point, and the hips go as much farther as the skeleton is larger.  Joints
    that have no answer are told by a name of their own, and keep still.  Where rest poses do not tell how a link is
    rolled, it is on average as in `goal` in a `usual` motion of this skeleton, by default this one.
    """
    from scipy.spatial.transform import Rotation

    answers = match.matched(motion, goal)
    source = {answer: k for k, answer in answers.items()}
    skeleton, root = goal.skeleton, hips(goal)
    world = motion.world()
    rests = _rests(motion.skeleton, skeleton, source)
    if motion.skeleton.parents == skeleton.parents and all(_turned(rest) < ALIKE for rest in rests.values()):
        rests = dict.fromkeys(rests, np.eye(3))
    else:
        same = usual is not None and usual.skeleton.names == motion.skeleton.names
        _roll(rests, usual.world() if same else world, goal, source)
    count = len(motion)
    turns = np.empty((count, len(skeleton), 3, 3))
    rotation = np.tile(goal.rotation[0], (count, 1, 1))
    still = Rotation.from_quat(goal.rotation[0]).as_matrix()
    for joint, parent in enumerate(skeleton.parents):
        above = turns[:, parent] if parent >= 0 else np.eye(3)
        if joint in source:
            turns[:, joint] = world[:, source[joint], :, :3] @ rests[joint]
            own = Rotation.from_matrix(np.broadcast_to(np.swapaxes(above, -1, -2) @ turns[:, joint], (count, 3, 3)))
            rotation[:, joint] = own.as_quat()
        else:
            turns[:, joint] = above @ still[joint]
    translation = np.tile(goal.translation[0], (count, 1, 1))
    translation[:, root] = _hips_at(larger(motion, goal) * world[:, hips(motion), :, 3], goal, root)
    names = tuple(name if k in source else f"~{name}" for k, name in enumerate(skeleton.names))
    lent_on = Skeleton(names, skeleton.parents, skeleton.offsets)
    return SkeletonMotion(lent_on, translation, rotation, motion.fps), match.told(answers, goal)


def larger(one: SkeletonMotion, two: SkeletonMotion) -> float:
    """How many times as large the second skeleton is, by legs if both have some, else by all below the hips."""
    tall = [stature(motion, find_body(motion.skeleton, motion.positions())) for motion in (one, two)]
    if min(tall) <= 0:
        tall = [motion.skeleton.lengths()[jointed(motion.skeleton, hips(motion))].sum() for motion in (one, two)]
    return float(tall[1] / tall[0]) if min(tall) > 0 else 1.0


def _rests(one: Skeleton, two: Skeleton, source: dict[int, int]) -> dict[int, NDArray]:
    """For matched joints the turn (3, 3) that lays the links of `two` at rest onto those of `one`."""
    rests = {}
    for joint in sorted(source):
        nearest = [other for other in two.path(joint)[:-1] if other in rests]
        before = rests[nearest[-1]] if nearest else np.eye(3)
        here, there = [], []
        for other in source:
            way = two.path(other)
            if joint not in way[:-1] or any(between in source for between in way[way.index(joint) + 1 : -1]):
                continue
            path = one.path(source[other])
            if source[joint] not in path[:-1]:
                continue
            there.append(two.offsets[list(way[way.index(joint) + 1 :])].sum(axis=0))
            here.append(one.offsets[list(path[path.index(source[joint]) + 1 :])].sum(axis=0))
        here, there = (np.array([_unit(way) for way in ways]).reshape(-1, 3) for ways in (here, there))
        seen = (np.abs(here).sum(axis=1) > 0) & (np.abs(there).sum(axis=1) > 0)
        here, there = here[seen], there[seen] @ before.T
        turn = np.eye(3)
        if len(here) and np.abs(here - there).max() > 1e-6:
            u, sizes, vt = np.linalg.svd(here.T @ there)  # Kabsch's turn, where there are two ways to tell it
            if sizes[1] > 0.05:
                turn = u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt
            else:
                turn = _shortest(there.mean(axis=0), here.mean(axis=0))
        rests[joint] = turn @ before
    return rests


def _roll(rests: dict[int, NDArray], world: NDArray, goal: SkeletonMotion, source: dict[int, int]) -> None:
    """Roll those of the turns `rests` (3, 3) about their links that are large, so that on average links roll as B's do.

    One link tells where a joint points, not how it is rolled, and so about which of its axes it bends; a hand without
    fingers tells not even that, and is turned on average as B's.
    """
    from scipy.spatial.transform import Rotation

    root, skeleton = hips(goal), goal.skeleton
    theirs, ours = goal.world()[..., :3], world[..., :3]

    def level(turns: NDArray) -> Rotation:
        heading, _ = headed(turns)
        return Rotation.from_rotvec(-heading[:, None] * [0, 1, 0])

    before, after = level(ours[:, source[root]] @ rests[root]), level(theirs[:, root])
    for joint, rest in rests.items():
        below = [child for child in skeleton.children(joint) if child in source]
        if len(below) > 1 or _turned(rest) < ALIKE:
            continue
        mean = (before * Rotation.from_matrix(ours[:, source[joint]] @ rest)).mean().as_matrix()
        goal_mean = (after * Rotation.from_matrix(theirs[:, joint])).mean().as_matrix()
        apart = goal_mean.T @ mean
        if not below:
            rests[joint] = rest @ apart.T
            continue
        link = _unit(skeleton.offsets[below[0]])
        cross = np.cross(np.eye(3), link)
        angle = np.arctan2(np.trace(apart @ cross), np.trace(apart) - link @ apart @ link)
        rests[joint] = rest @ Rotation.from_rotvec(angle * link).as_matrix()


def _shortest(one: NDArray, other: NDArray) -> NDArray:
    """The smallest turn (3, 3) of a direction onto another."""
    from scipy.spatial.transform import Rotation

    axis = np.cross(one, other)
    size = np.linalg.norm(axis)
    if size < 1e-12 and one @ other < 0:  # straight back: about any axis across
        axis, size = np.cross(one, np.eye(3)[np.abs(one).argmin()]), 1.0
    return Rotation.from_rotvec(np.arctan2(size, one @ other) * _unit(axis)).as_matrix()


def _hips_at(places: NDArray, goal: SkeletonMotion, root: int) -> NDArray:
    """Where hips (T, 3) in the world are for what stands still above them."""
    above = goal.skeleton.parents[root]
    if above < 0:
        return places
    held = world_maps(goal.skeleton.parents, own_maps(goal.translation[:1], goal.rotation[:1]))[0, above]
    return (places - held[:, 3]) @ held[:, :3]


def _turned(turn: NDArray) -> float:
    """By how much a matrix (3, 3) turns, radians."""
    return float(np.arccos(np.clip((np.trace(turn) - 1) / 2, -1, 1)))


def _unit(way: NDArray) -> NDArray:
    size = np.linalg.norm(way)
    return way / size if size > 1e-9 else np.zeros(3)
