"""A motion made of rubber: the whole chain of Kwon & Lee 2008, from captured joints to turned and stretched sub-joints.

joints -> pushed away from their average -> not too long, and short as often as long -> sub-joints on curves
       -> swinging after -> feet where they stood -> turned
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capture.errors import InputError
from mocap import quaternions as quat
from mocap.ends import travel_of
from mocap.rubber import amounts, collide, exaggerate, hips, lengths, soles, subjoints
from mocap.rubber import feet as standing
from mocap.rubber import squash as squashing
from mocap.rubber.orient import orientations
from mocap.rubber.subjoints import SubJoints
from mocap.skeleton import Skeleton, SkeletonMotion

SOFT = 0.5
"""The last half of the way to the longest and shortest that a link may be is taken ever more slowly."""

SETTLE = 0.2
"""Seconds in which a foot comes down to where it was captured; in 0.1 steps jerk twice as much as exaggerated."""

JOLT = 6.0
"""A first pose from which all joints jump so many times further than ever after is no part of the motion."""


@dataclass(frozen=True, eq=False)
class RubberMotion:
    """Sub-joints over T frames, in the world: each has a place, an orientation, and its sub-link a stretch."""

    source: SkeletonMotion  # what was exaggerated, upright
    subjoints: SubJoints
    positions: NDArray  # (T, S, 3) metres
    rotation: NDArray  # (T, S, 4) quaternions (x, y, z, w) in the world; at rest none is turned
    stretch: NDArray  # (T, S) length of the sub-link above a sub-joint, times its length at rest; roots 1
    thickness: NDArray  # (T, S) how thick that sub-link is, times at rest: 1 / sqrt(stretch) keeps its volume

    def __len__(self) -> int:
        return len(self.positions)


def make_rubber(
    motion: SkeletonMotion,
    omega: ArrayLike | None = None,
    sigma: ArrayLike = 0.15,
    most_stretch: float = 1.6,
    squash: float = 0.5,
    hose: float = 1.0,
    follow: float = 0.0,
    feet: Sequence[int] | None = None,
    contacts: NDArray | None = None,
    apart: bool = False,
    calm: ArrayLike | None = None,
    loop: bool = False,
) -> RubberMotion:
    """Exaggerate an upright motion and bend its limbs.

    `omega` is how much, for all or for each joint, over time too (see `exaggerate`); where it is nan or not given, each
    part of the body is exaggerated as much as keeps its links within `most_stretch` times their length.
    `sigma` is the seconds of the average that is exaggerated against, `squash` 0 to 1 how much stretch takes turns
    with squash, `hose` 0 to 1 how round limbs bend, `follow` 0 to 1 how much of the springs' swing is taken.  The
    joints `feet` (F,) stay where they were captured while in `contacts` (T, F), and go no lower than they ever were;
    not given, they are found; an empty list lets feet go where they will.  `apart` keeps limbs from going through each
    other further than they were captured to; it takes several times as long as all else.
    """
    if not most_stretch >= 1:
        raise InputError(
            f"links may become 1 or more times as long as they are, not {most_stretch:g}: choose such as 1.6"
        )
    if posed_first(motion):
        omega, sigma, contacts, calm = (_later(values, len(motion)) for values in (omega, sigma, contacts, calm))
        own = (omega, sigma, most_stretch, squash, hose, follow, feet, contacts, apart, calm, loop)
        return _joined(plain(motion.part(0, 1), hose), make_rubber(motion.part(1, len(motion)), *own), rooted(motion))
    motion = rooted(motion)
    parts = subjoints.subdivide(motion.skeleton)
    captured, turns = joints_of(motion)
    calm = exaggerate.calm_of(motion.fps, sigma) if calm is None else calm
    travel = travel_of(captured[:, _goer(motion, captured)]) if loop else None
    deviations = exaggerate.deviation(captured, motion.fps, sigma, calm, loop, travel)
    deviations[:, np.ptp(captured, axis=0).max(axis=-1) == 0] = 0  # a root that stays on the floor
    omega = np.asarray(np.nan if omega is None else omega, float)
    if np.isnan(omega).any():
        omega = np.where(np.isnan(omega), amounts.omega_of(captured, deviations, parts, most_stretch), omega)
    pushed = exaggerate.pushed(captured, deviations, omega, motion.skeleton.parents)
    pushed = _in_bounds(pushed, motion, most_stretch, squash, loop)
    placed = subjoints.place(subjoints.placing(parts, hose), pushed)
    placed = _swinging(placed, parts, motion.fps, follow, loop, travel)
    feet, contacts = soles.found(motion, captured) if feet is None else (feet, contacts)
    placed = _standing(placed, parts, captured, feet, contacts, motion.fps, most_stretch)
    if apart:
        placed = collide.pushed_apart(placed, captured, parts, motion.fps)
        placed = _kept(placed, parts, captured, feet, contacts, motion.fps)
    return finished(motion, parts, placed, captured, turns)


def plain(motion: SkeletonMotion, hose: float = 0.0) -> RubberMotion:
    """A motion as it was captured, on sub-joints."""
    motion = rooted(motion)
    parts = subjoints.subdivide(motion.skeleton)
    captured, turns = joints_of(motion)
    return finished(motion, parts, subjoints.place(subjoints.placing(parts, hose), captured), captured, turns)


def finished(
    motion: SkeletonMotion, parts: SubJoints, positions: NDArray, captured: NDArray, turns: NDArray
) -> RubberMotion:
    """The rubber motion of sub-joints at positions (T, S, 3), turned as their joints (T, J, 3), (T, J, 4) were."""
    stretch = lengths.ratios(positions, parts.parents, parts.lengths())
    rotation = orientations(positions, parts, captured, turns)
    return RubberMotion(motion, parts, positions, rotation, stretch, squashing.thickness_of(stretch))


def joints_of(motion: SkeletonMotion) -> tuple[NDArray, NDArray]:
    """Where joints are (T, J, 3), and how they are turned in the world (T, J, 4)."""
    own = (np.ascontiguousarray(array.transpose(1, 2, 0)) for array in (motion.translation, motion.rotation))
    places, turns = quat.world(motion.skeleton.parents, *own)
    return places.transpose(2, 0, 1), turns.transpose(2, 0, 1)


def on_skeleton(made: RubberMotion) -> SkeletonMotion:
    """The rubber motion as one of an ordinary skeleton with the sub-joints as joints, each turned and moved (6 DOF)."""
    parts, parents = made.subjoints, made.subjoints.parents
    pieces = np.bincount(parts.joint, minlength=len(parts.skeleton))
    skeleton = Skeleton(parts.names(), parents, (parts.skeleton.offsets / pieces[:, None])[parts.joint])
    places, turns = (np.ascontiguousarray(array.transpose(1, 2, 0)) for array in (made.positions, made.rotation))
    translation, rotation = places.copy(), turns.copy()
    for s, parent in enumerate(parents):
        if parent >= 0:
            back = quat.inverse(turns[parent])
            translation[s] = quat.turned(back, places[s] - places[parent])
            rotation[s] = quat.product(back, turns[s])
    source = made.source
    return SkeletonMotion(
        skeleton, translation.transpose(2, 0, 1), rotation.transpose(2, 0, 1), source.fps, source.notes
    )


def rooted(motion: SkeletonMotion) -> SkeletonMotion:
    """The motion with each joint that moves freely against its parent made a root, and links as long as they are.

    Some files hang moving hips on a root that stays on the floor: what lies between them is no link.
    """
    skeleton, parents = motion.skeleton, np.array(motion.skeleton.parents)
    middle = np.median(motion.translation[:: max(len(motion) // 100, 1)], axis=0)
    away = np.abs(motion.translation - middle).max(axis=(0, 2))
    body = np.linalg.norm(middle[parents >= 0], axis=1).sum()
    free = (parents >= 0) & (away > 0.01 * body)
    settled = Skeleton(
        skeleton.names,
        tuple(np.where(free, -1, parents).tolist()),
        np.where((parents >= 0)[:, None] & ~free[:, None], middle, skeleton.offsets),
    )
    if not free.any():
        return replace(motion, skeleton=settled)
    places, turns = joints_of(motion)
    translation, rotation = motion.translation.copy(), motion.rotation.copy()
    translation[:, free], rotation[:, free] = places[:, free], turns[:, free]
    return replace(motion, skeleton=settled, translation=translation, rotation=rotation)


def posed_first(motion: SkeletonMotion) -> bool:
    """Whether the first frame is a pose that somebody set before the motion, as a T-pose is in many CMU files."""
    if len(motion) < 4:
        return False
    cosine = np.einsum("tji,tji->tj", motion.rotation[1:], motion.rotation[:-1])
    jumps = np.sqrt(np.maximum(1 - cosine**2, 0)).mean(axis=1)  # sines of half the angles
    return bool(jumps[0] > JOLT * jumps[1:].max() and jumps[0] > 0.05)


def _in_bounds(pushed: NDArray, motion: SkeletonMotion, most_stretch: float, squash: float, loop: bool) -> NDArray:
    """Links squashed as they are stretched, and not longer or shorter than they may be."""
    parents, rest = motion.skeleton.parents, motion.skeleton.lengths()
    ratio = lengths.ratios(pushed, parents, rest)
    if squash:
        ratio = squashing.alternating(ratio, motion.fps, squash, loop=loop)
    ratio = lengths.bounded(ratio, 1 / most_stretch, most_stretch, SOFT)
    return lengths.stretched(pushed, parents, rest, ratio)


def _later(values: ArrayLike | None, count: int) -> ArrayLike | None:
    """What is given for every frame of `count`, without the first."""
    return values[1:] if np.ndim(values) == 2 and len(values) == count else values


def _goer(motion: SkeletonMotion, captured: NDArray) -> int:
    """The root that goes furthest: some files leave one on the floor."""
    roots = [joint for joint, parent in enumerate(motion.skeleton.parents) if parent < 0]
    return max(roots, key=lambda joint: np.ptp(captured[:, joint], axis=0).max())


def _swinging(
    placed: NDArray, parts: SubJoints, fps: float, share: float, loop: bool, travel: NDArray | None
) -> NDArray:
    if not share:
        return placed
    from mocap.rubber import followthrough

    return placed + share * (followthrough.follow(placed, parts.parents, fps, loop=loop, travel=travel) - placed)


def _standing(
    placed: NDArray,
    parts: SubJoints,
    captured: NDArray,
    feet: Sequence[int],
    contacts: NDArray | None,
    fps: float,
    most_stretch: float,
) -> NDArray:
    if not len(feet):
        return placed
    if contacts is not None:
        placed = hips.carried(placed, parts, captured, feet, contacts, fps, most_stretch, SETTLE)
    floor = captured[..., 1].min()
    hands = [group[-1] for group in parts.groups if group[-1] not in feet]
    placed = standing.above(placed, parts, _with_what_hangs_on(parts.skeleton, feet), captured, fps)
    placed = standing.above(placed, parts, hands, captured, fps, floor=floor)
    placed = _kept(placed, parts, captured, feet, contacts, fps)
    between = parts.along < 1  # nor does a bent shin go through the floor
    placed[:, between, 1] = np.maximum(placed[:, between, 1], floor)
    return placed


def _with_what_hangs_on(skeleton: Skeleton, joints: Sequence[int]) -> list[int]:
    found = set(joints)
    for child, parent in enumerate(skeleton.parents):
        if parent in found:
            found.add(child)
    return sorted(found)


def _kept(
    placed: NDArray, parts: SubJoints, captured: NDArray, feet: Sequence[int], contacts: NDArray | None, fps: float
) -> NDArray:
    return placed if contacts is None else standing.kept(placed, parts, captured, feet, contacts, fps, SETTLE)


def _joined(first: RubberMotion, later: RubberMotion, source: SkeletonMotion) -> RubberMotion:
    names = ("positions", "rotation", "stretch", "thickness")
    arrays = {name: np.concatenate([getattr(first, name), getattr(later, name)]) for name in names}
    note = "the first frame is a pose set before the captured motion: it is kept as it is"
    return replace(later, source=replace(source, notes=(*source.notes, note)), **arrays)
