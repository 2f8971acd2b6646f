"""A figure at the posing desk: its joints, how it stands now, its postures, the dance, and what it feels like."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from mocap.posing.choreography import Dance, Phrase, read_dance
from mocap.posing.limits import JointLimits
from mocap.posing.poses import Pose
from mocap.posing.postures import Pool, read_pool
from mocap.posing.stance import Music, Stance, pinned_of, pose_of, read_stance, stance_of
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion
from retarget.characters.figures.dancer import BUILT_IN, Dancer, read_dancer
from retarget.stage.held import Held

POOL, DANCE, STANCE = ".postures.json", ".dance.toml", ".posing.json"
FIGURE = "char_cfg.yaml"  # of a folder that is a figure, as AnimatedDrawings keeps one
FIGURES = (".bvh", ".glb", ".gltf", ".svg", ".toml")
BEATS = 8.0  # of a dance that begins
STILL = 1e-6  # radians: a joint that is turned by less is not

FEEL = {"bpm": 120.0, "quick": 2.2, "damping": 0.8, "clumsy": 0.0, "stiff": 0.0, "wild": 0.0, "extent": 1.0}
RUBBER = {"omega": 3.0, "sigma": 0.15, "follow": 0.5, "squash": 0.5, "hose": 1.0}
"""Sliders before anybody moves them: of a dance, and of rubber."""


@dataclass(frozen=True, eq=False)
class Figure:
    """J joints, and everything that a person does with them."""

    file: str  # in the folder, or the name of a figure that is built in
    skeleton: Skeleton
    rest: NDArray  # (J, 4)
    limits: tuple[JointLimits, ...]
    pose: Pose
    begun: Pose  # how it stands before anybody poses it
    motion: SkeletonMotion | None = None  # what the file holds, upright
    drawing: Held | None = None  # what it is drawn as
    body: Dancer | None = None  # a model's own mesh
    pinned: tuple[int, ...] = ()
    extents: dict[str, float] = field(default_factory=dict)  # of the postures that are mixed now
    pool: Pool | None = None
    dance: Dance | None = None
    feel: dict[str, float] = field(default_factory=dict)  # sliders that were moved
    music: Music | None = None

    @cached_property
    def stance(self) -> Stance | None:
        """What is kept of the pose and what belongs to it; nothing of a figure that stands as it did."""
        if self.pose is self.begun and not (self.pinned or self.extents or self.feel or self.music):
            return None
        return stance_of(self.skeleton, self.pose, self.pinned, self.extents, self.feel, self.music)

    def slider(self, name: str) -> float:
        """Where a slider of FEEL or RUBBER is."""
        return self.feel.get(name, {**FEEL, **RUBBER}[name])

    def rubber(self) -> dict[str, float]:
        """Where the sliders of RUBBER are: how `make_rubber` is told."""
        return {name: self.slider(name) for name in RUBBER}


def is_figure(path: Path) -> bool:
    """Whether a file may hold somebody who can be posed: reading it tells."""
    if path.is_dir():
        return (path / FIGURE).is_file()
    if path.suffix.lower() == ".toml":
        return path.name.lower().endswith(".marks.toml")
    return path.suffix.lower() in FIGURES


def has_joints(path: Path) -> bool:
    """Whether a file, at a glance, has joints: an SVG or a model may as well be something to cast."""
    if not is_figure(path):
        return False
    if path.suffix.lower() == ".svg":
        return path.stat().st_size < 2**22 and b'id="joints"' in path.read_bytes()
    if path.suffix.lower() in (".glb", ".gltf"):
        with path.open("rb") as file:
            return b'"skins"' in file.read(2**22)
    return True


def figure_of(folder: Path, file: str, name: str) -> Figure:
    """The figure of a file or a built-in one, with what lies under its name: postures, a dance, how it was left."""
    from mocap.posing import limits, postures
    from mocap.posing.starting import starting_pool
    from mocap.skeletons.bvh import read_bvh
    from mocap.skeletons.units import upright
    from retarget.stage.held import hold

    dancer = read_dancer(file if file in BUILT_IN else str(folder / file))
    skeleton, rest = dancer.skeleton, dancer.rest
    motion = upright(read_bvh(folder / file)) if file.lower().endswith(".bvh") else None
    drawn = postures.unturned(skeleton) if dancer.drawing is not None else rest
    begun = mixed(skeleton, drawn, np.zeros((len(skeleton), 3)))
    pool, dance, stance = (folder / (name + kind) for kind in (POOL, DANCE, STANCE))
    figure = Figure(
        file,
        skeleton,
        rest,
        () if dancer.drawing is not None else limits.usual(skeleton),  # on a page a knee bends either way
        begun,
        begun,
        motion,
        None if dancer.drawing is None else hold(dancer.drawing),
        dancer if dancer.model is not None and dancer.skin is not None else None,
        pool=read_pool(pool) if pool.exists() else starting_pool(skeleton, rest),
        dance=read_dance(dance) if dance.exists() else Dance((Phrase((), BEATS),)),
    )
    return left_as(figure, read_stance(stance)) if stance.exists() else figure


def left_as(figure: Figure, stance: Stance) -> Figure:
    """The figure as it was left."""
    known = {**FEEL, **RUBBER}
    feel = {name: value for name, value in stance.feel.items() if name in known}
    pose, pinned = pose_of(stance, figure.skeleton), pinned_of(stance, figure.skeleton)
    extents = {name: extent for name, extent in stance.extents.items() if name in figure.pool.names()}
    return replace(figure, pose=pose, pinned=pinned, extents=extents, feel=feel, music=stance.music)


def mixed(skeleton: Skeleton, rest: NDArray, turns: NDArray) -> Pose:
    """The pose of joints turned by (J, 3) against rest."""
    from mocap.posing import poses, postures

    return poses.pose_of(postures.posed(skeleton, turns[None], 24.0, rest), 0)


def dragged(figure: Figure, joint: int, to: NDArray) -> Figure:
    """The figure with a joint at a place (3,), metres, and all others where springs take them."""
    from mocap.posing import springs

    mine = _hangs_with(figure.skeleton.parents, joint)
    if len(mine) == 1:
        positions = figure.pose.positions.copy()
        positions[joint] = to
        return replace(figure, pose=Pose(positions, figure.pose.turns))
    number = {one: n for n, one in enumerate(mine)}
    parents = tuple(number.get(figure.skeleton.parents[one], -1) for one in mine)
    part = Pose(figure.pose.positions[mine], figure.pose.turns[mine])
    pinned = tuple(number[one] for one in figure.pinned if one in number)
    limits = tuple(replace(one, joint=number[one.joint]) for one in figure.limits if one.joint in number)
    moved = springs.drag(parents, part, number[joint], to, pinned, limits)
    positions, turns = figure.pose.positions.copy(), figure.pose.turns.copy()
    positions[mine], turns[mine] = moved.positions, moved.turns
    return replace(figure, pose=Pose(positions, turns))


def _hangs_with(parents: Sequence[int], joint: int) -> list[int]:
    """The joints that hang together with one: files of models hold lights and other things beside."""
    tops = []
    for one, parent in enumerate(parents):
        tops.append(one if parent < 0 else tops[parent])
    return [one for one, top in enumerate(tops) if top == tops[joint]]


def check_posture(figure: Figure, name: str) -> None:
    """Refuse a posture that the figure does not have, with the names of those it has."""
    _ = figure.pool[name]


def postured(figure: Figure, name: str, extent: float) -> Figure:
    """The figure in a mix of its postures, one of them to another extent; what was dragged goes."""
    from mocap.posing import postures

    extents = {**figure.extents, name: extent}
    extents = {posture: share for posture, share in extents.items() if share}
    check_posture(figure, name)
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
