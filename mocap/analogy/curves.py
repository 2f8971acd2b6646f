"""Motions as curves that can be scaled, shifted and mixed (Wu et al. 2008, section 3.1).

Turns are exponential maps, unwrapped in time.  The root is told as one walks, not where on the map: how fast it goes
ahead and aside in its own heading, how fast it turns, how high it is and how it leans.  So a walk to the north and one
to the west are the same curves.  Erratum: the paper's differences in world axes depend on the heading.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mocap.skeletons import rotations
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion, own_maps, world_maps

ROOT = ("ahead", "aside", "turning", "height", "lean x", "lean y", "lean z")
"""The root's channels: metres a second, radians a second, metres, radians."""
RATES = ROOT[:3]
"""Those that go as fast as time goes: a step is as long in whatever time it is made."""


FAR = 1.5
"""Radians: rotation vectors of so much and less can be scaled and added."""


@dataclass(frozen=True, eq=False)
class Curves:
    """C channels over T frames; a channel is named by its owner and what it tells of it."""

    values: NDArray  # (T, C)
    owners: tuple[str, ...]  # (C,) a joint's or a part's name
    kinds: tuple[str, ...]  # (C,) as in ROOT; "turn x", ... of joints; a cartoon's own
    fps: float

    def __len__(self) -> int:
        return len(self.values)

    def named(self) -> tuple[tuple[str, str], ...]:
        """Owner and kind of every channel."""
        return tuple(zip(self.owners, self.kinds))


@dataclass(frozen=True, eq=False)
class Start:
    """What the curves of a skeleton's motion leave out: where it sets off, and what its turns are told against."""

    place: NDArray  # (2,) x and z of the root, metres
    heading: float  # radians about y
    neutral: NDArray  # (J, 4) turns; for the root, of its lean


def hips(motion: SkeletonMotion) -> int:
    """The joint that carries the body: of those above the first fork, the last that is shifted over time."""
    skeleton, joint = motion.skeleton, motion.skeleton.parents.index(-1)
    carries = joint
    while True:
        if np.ptp(motion.translation[:, joint], axis=0).max() > 1e-6:
            carries = joint
        below = skeleton.children(joint)
        if len(below) != 1:
            return carries
        joint = below[0]


def of_skeleton(
    motion: SkeletonMotion, neutral: NDArray | None = None, near: NDArray | None = None
) -> tuple[Curves, Start]:
    """A motion as curves, and where it sets off.

    Turns are told against the `neutral` ones (J, 4), by default none; of one joint they should not be half a turn away,
    where rotation vectors end.  Of the whole turns more or less that a joint may be in, the first frame has those
    nearest to `near` (1 + J, 3), the root's lean first, by default the smallest; each frame those nearest to the one
    before.
    """
    root, skeleton, fps = hips(motion), motion.skeleton, motion.fps
    neutral = np.tile([0, 0, 0, 1.0], (len(skeleton), 1)) if neutral is None else neutral
    world = motion.world()[:, root]
    heading, lean = headed(world[:, :, :3])
    place = world[:, [0, 2], 3]
    steps = np.diff(place, axis=0) * fps
    ahead, aside = _in_heading(steps, heading[:-1])
    rates = np.stack([ahead, aside, np.diff(heading) * fps], axis=-1)
    rates = np.concatenate([rates, rates[-1:]]) if len(rates) else np.zeros((1, 3))  # the last frame goes on
    turns = _vectors(_against(neutral, root), np.concatenate([lean[:, None], motion.rotation], axis=1), near)
    columns = [rates, world[:, 1:2, 3], turns[:, 0]]
    owners, kinds = [skeleton.names[root]] * len(ROOT), list(ROOT)
    for joint in jointed(skeleton, root):
        columns.append(turns[:, 1 + joint])
        owners += [skeleton.names[joint]] * 3
        kinds += ["turn x", "turn y", "turn z"]
    told = Curves(np.concatenate(columns, axis=1), tuple(owners), tuple(kinds), fps)
    return told, Start(place[0], heading[0], neutral)


def to_skeleton(curves: Curves, start: Start, model: SkeletonMotion) -> SkeletonMotion:
    """The motion that curves tell, on the skeleton of `model`; what they do not tell stays as in its first frame."""
    from scipy.spatial.transform import Rotation

    root, skeleton, count = hips(model), model.skeleton, len(curves)
    column = {name: k for k, name in enumerate(curves.named())}
    own = [column[skeleton.names[root], kind] for kind in ROOT]
    ahead, aside, turning, height = curves.values[:, own[:4]].T
    heading = start.heading + np.concatenate([[0], np.cumsum(turning[:-1])]) / curves.fps
    steps = _out_of_heading(ahead[:-1], aside[:-1], heading[:-1]) / curves.fps
    ground = start.place + np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
    lean = Rotation.from_quat(start.neutral[root]) * Rotation.from_rotvec(curves.values[:, own[4:]])
    turn = Rotation.from_rotvec(heading[:, None] * [0, 1, 0]) * lean

    rotation = np.tile(model.rotation[0], (count, 1, 1))
    for joint in jointed(skeleton, root):
        name = skeleton.names[joint]
        if (name, "turn x") in column:
            told = [column[name, f"turn {axis}"] for axis in "xyz"]
            own_turn = Rotation.from_rotvec(curves.values[:, told])
            rotation[:, joint] = (Rotation.from_quat(start.neutral[joint]) * own_turn).as_quat()
    translation = np.tile(model.translation[0], (count, 1, 1))
    world = np.stack([ground[:, 0], height, ground[:, 1]], axis=-1)
    above = _above(model, root)
    rotation[:, root] = (above[1].inv() * turn).as_quat()
    translation[:, root] = above[1].inv().apply(world - above[0])
    return SkeletonMotion(skeleton, translation, rotation, curves.fps)


def neutral(motion: SkeletonMotion) -> NDArray:
    """Turns (J, 4) to tell turns against: none; of joints that are turned far from rest their mean ones."""
    from scipy.spatial.transform import Rotation

    root = hips(motion)
    mean = np.stack([Rotation.from_quat(turns).mean().as_quat() for turns in np.swapaxes(motion.rotation, 0, 1)])
    mean[root] = Rotation.from_quat(headed(motion.world()[:, root, :, :3])[1]).mean().as_quat()
    mean[2 * np.arccos(np.minimum(np.abs(mean[:, 3]), 1)) < FAR] = [0, 0, 0, 1]
    return mean


def first_turns(motion: SkeletonMotion, neutral: NDArray) -> NDArray:
    """Turns (1 + J, 3) of the first frame, for `near` of another motion of the same joints."""
    root = hips(motion)
    lean = headed(motion.world()[:1, root, :, :3])[1]
    return _vectors(_against(neutral, root), np.concatenate([lean[:, None], motion.rotation[:1]], axis=1), None)[0]


def resampled(curves: Curves, at: NDArray, fps: float | None = None) -> Curves:
    """Curves at frames (n,), which may lie between frames: cubic B-splines through them."""
    return Curves(sampled(curves.values, at), curves.owners, curves.kinds, curves.fps if fps is None else fps)


def sampled(values: NDArray, at: NDArray) -> NDArray:
    """Curves (T, C) at frames (n,) between 0 and T - 1."""
    from scipy.interpolate import make_interp_spline

    degree = min(3, len(values) - 1)
    if degree < 1:
        return np.repeat(values, len(at), axis=0)
    at = np.clip(at, 0, len(values) - 1)
    whole = np.round(at).astype(int)
    if np.array_equal(whole, at):
        return values[whole]
    return make_interp_spline(np.arange(len(values)), values, degree)(at)


def at_rate(curves: Curves, fps: float) -> Curves:
    """The same curves at another frame rate."""
    if abs(fps - curves.fps) < 1e-9 * fps:
        return curves
    seconds = (len(curves) - 1) / curves.fps
    return resampled(curves, np.arange(round(seconds * fps) + 1) * curves.fps / fps, fps)


def jointed(skeleton: Skeleton, root: int) -> list[int]:
    """Joints told by their turns: all below the root that something hangs on."""
    inner = set(skeleton.parents)
    below = {root}
    for joint, parent in enumerate(skeleton.parents):
        if parent in below:
            below.add(joint)
    return [joint for joint in sorted(below - {root}) if joint in inner]


def headed(turns: NDArray) -> tuple[NDArray, NDArray]:
    """Heading (T,) about y, unwrapped, and what is left of turns (T, 3, 3) after it, as quaternions (T, 4)."""
    from scipy.spatial.transform import Rotation

    whole = Rotation.from_matrix(turns)
    turned = whole.as_quat()
    heading = np.unwrap(2 * np.arctan2(turned[:, 1], turned[:, 3]))
    return heading, (Rotation.from_rotvec(-heading[:, None] * [0, 1, 0]) * whole).as_quat()


def _in_heading(steps: NDArray, heading: NDArray) -> tuple[NDArray, NDArray]:
    """Steps (n, 2) in x and z as ahead (z at heading 0) and aside."""
    x, z = steps.T
    return x * np.sin(heading) + z * np.cos(heading), x * np.cos(heading) - z * np.sin(heading)


def _out_of_heading(ahead: NDArray, aside: NDArray, heading: NDArray) -> NDArray:
    x = ahead * np.sin(heading) + aside * np.cos(heading)
    z = ahead * np.cos(heading) - aside * np.sin(heading)
    return np.stack([x, z], axis=-1)


def _against(neutral: NDArray, root: int) -> NDArray:
    """Neutral turns (1 + J, 4): of the root's lean, and of every joint."""
    return np.concatenate([neutral[root][None], neutral])


def _vectors(neutral: NDArray, turning: NDArray, near: NDArray | None) -> NDArray:
    """Rotation vectors (T, 1 + J, 3) of quaternions against neutral ones (1 + J, 4), without jumps in time."""
    turns = rotations.turns_between(neutral, turning)
    if near is not None:
        turns[0] = rotations.nearest(turns[0], near)
    for t in range(1, len(turns)):
        turns[t] = rotations.nearest(turns[t], turns[t - 1])
    return turns


def _above(model: SkeletonMotion, root: int) -> tuple:
    """Place (3,) and turn of what stands still above the hips."""
    from scipy.spatial.transform import Rotation

    parent = model.skeleton.parents[root]
    if parent < 0:
        return np.zeros(3), Rotation.identity()
    own = own_maps(model.translation[:1], model.rotation[:1])
    world = world_maps(model.skeleton.parents, own)[0, parent]
    return world[:, 3], Rotation.from_matrix(world[:, :3])
