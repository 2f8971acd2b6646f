"""A figure at the posing desk: its joints, how it stands now, its postures, and the steps that it dances."""

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from mocap.posing.choreography import Dance, Phrase, Step, read_dance
from mocap.posing.limits import JointLimits
from mocap.posing.poses import Pose
from mocap.posing.postures import Pool, read_pool
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion

POOL, DANCE = ".postures.json", ".dance.toml"
BEATS = 8.0  # of a dance that begins
STILL = 1e-6  # radians: a joint that is turned by less is not


@dataclass(frozen=True, eq=False)
class Figure:
    """J joints, and everything that a person does with them."""

    file: str  # a .bvh in the folder, or the name of a figure that is built in
    skeleton: Skeleton
    rest: NDArray  # (J, 4)
    limits: tuple[JointLimits, ...]
    pose: Pose
    motion: SkeletonMotion | None = None  # what the file holds, upright
    pinned: tuple[int, ...] = ()
    extents: dict[str, float] = field(default_factory=dict)  # of the postures that are mixed now
    pool: Pool | None = None
    dance: Dance | None = None


def figure_of(folder: Path, file: str, name: str) -> Figure:
    """The figure of a .bvh file or a built-in one, with the postures and the dance that lie under its name."""
    from mocap.posing import limits
    from mocap.posing.starting import starting_pool
    from mocap.skeletons.bvh import read_bvh
    from mocap.skeletons.units import upright
    from retarget.characters.figures.dancer import BUILT_IN, read_dancer

    dancer = read_dancer(file if file in BUILT_IN else str(folder / file))
    motion = None if file in BUILT_IN else upright(read_bvh(folder / file))
    pool, dance = folder / (name + POOL), folder / (name + DANCE)
    return Figure(
        file,
        dancer.skeleton,
        dancer.rest,
        limits.usual(dancer.skeleton),
        mixed(dancer.skeleton, dancer.rest, np.zeros((len(dancer.skeleton), 3))),
        motion,
        pool=read_pool(pool) if pool.exists() else starting_pool(dancer.skeleton, dancer.rest),
        dance=read_dance(dance) if dance.exists() else Dance((Phrase((), BEATS),)),
    )


def mixed(skeleton: Skeleton, rest: NDArray, turns: NDArray) -> Pose:
    """The pose of joints turned by (J, 3) against rest."""
    from mocap.posing import poses, postures

    return poses.pose_of(postures.posed(skeleton, turns[None], 24.0, rest), 0)


def dragged(figure: Figure, joint: int, to: NDArray) -> Figure:
    """The figure with a joint at a place (3,), metres, and all others where springs take them."""
    from mocap.posing import springs

    pose = springs.drag(figure.skeleton.parents, figure.pose, joint, to, figure.pinned, figure.limits)
    return replace(figure, pose=pose)


def postured(figure: Figure, name: str, extent: float) -> Figure:
    """The figure in a mix of its postures, one of them to another extent; what was dragged goes."""
    from mocap.posing import postures

    extents = {**figure.extents, name: extent}
    extents = {posture: share for posture, share in extents.items() if share}
    figure.pool[name]  # another is refused with the names there are
    turns = postures.mixed(figure.pool, extents, figure.skeleton)
    return replace(figure, pose=mixed(figure.skeleton, figure.rest, turns), extents=extents)


def kept(figure: Figure, name: str) -> Figure:
    """The figure with its pose in the pool under a name."""
    from mocap.posing import poses, postures

    motion = poses.motion_of(figure.skeleton, [figure.pose], 24.0)
    posture = postures.posture_of(motion, 0, name, figure.rest)
    if not any(np.abs(turn).max() > STILL for turn in posture.turns.values()):
        raise InputError("a posture must turn some joint, this is the pose at rest: drag something first")
    return replace(figure, pool=postures.with_posture(figure.pool, posture), extents={name: 1.0})


def without(figure: Figure, name: str) -> Figure:
    """The figure without one of its postures, nor the steps that need it."""
    left = tuple(posture for posture in figure.pool.postures if posture is not figure.pool[name])
    if not left:
        raise InputError("a pool must hold at least one posture: keep another first")
    extents = {other: share for other, share in figure.extents.items() if other != name}
    phrases = tuple(
        replace(
            phrase,
            steps=tuple(step for step in phrase.steps if step.posture != name),
            pulse="" if phrase.pulse == name else phrase.pulse,
        )
        for phrase in figure.dance.phrases
    )
    return replace(figure, pool=replace(figure.pool, postures=left), extents=extents, dance=Dance(phrases))


def steps_of(figure: Figure) -> tuple[Step, ...]:
    """The steps of the first phrase: what the timeline shows."""
    return figure.dance.phrases[0].steps if figure.dance.phrases else ()


def stepped(figure: Figure, steps: list[Step], beats: float | None = None) -> Figure:
    """The figure with such steps in its first phrase, in the order of their beats."""
    from mocap.posing.choreography import checked

    first = figure.dance.phrases[0] if figure.dance.phrases else Phrase((), BEATS)
    steps = sorted(steps, key=lambda step: (step.beat, step.posture))
    phrase = replace(first, steps=tuple(steps), beats=first.beats if beats is None else beats)
    dance = Dance((phrase, *figure.dance.phrases[1:]))
    return replace(figure, dance=checked(dance) if steps else dance)
