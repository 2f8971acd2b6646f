"""The posing desk: joints dragged on springs, postures mixed, kept and put on beats; a clip beside it made rubber."""

import json
from dataclasses import replace
from functools import lru_cache
from threading import Lock, RLock
from typing import Annotated, Any

import numpy as np
from msgspec import Meta

from capture.errors import InputError
from mocap.posing.poses import Pose
from mocap.skeletons.skeleton import SkeletonMotion
from retarget.characters.figures.dancer import Dancer
from retarget.workbench import figure as figures
from retarget.workbench import made
from retarget.workbench.desks import Desk, Seen
from retarget.workbench.fields import File, Name, Number
from retarget.workbench.figure import FEEL, RUBBER
from retarget.workbench.folder import listing
from retarget.workbench.posing import files, fleshed, music, phrases, puppet
from retarget.workbench.posing.posed import Extent, figure_in, joint_of, numbers, with_figure
from retarget.workbench.state import State, pose_file

Metres = Annotated[float, Meta(ge=-1e6, le=1e6)]
Moment = Annotated[float, Meta(ge=0, le=36_000)]
Parts = Annotated[list[Annotated[str, Meta(max_length=400)]], Meta(min_length=1, max_length=2000)]
RANGES = {
    **dict.fromkeys(("clumsy", "stiff", "wild"), (-1, 1)),
    **dict.fromkeys(("follow", "squash", "hose"), (0, 1)),
    "bpm": (40, 240),
    "quick": (0.2, 10),
    "damping": (0.01, 3),
    "extent": (-3, 3),
    "omega": (0, 20),
    "sigma": (0.005, 2),
}
SECONDS = 12.0  # of a clip that rubber is shown for
FPS = 24.0
_work, _readying = RLock(), Lock()


def shown(state: State) -> dict[str, Any]:
    """The figure, how it stands, and its dance."""
    figure = state.figure
    if figure is None:
        return {"figure": None, "made": []}
    return {
        "figure": {
            "file": figure.file,
            "names": list(figure.skeleton.names),
            "parents": list(figure.skeleton.parents),
            "frames": 0 if figure.motion is None else len(figure.motion),
            "fps": 0.0 if figure.motion is None else figure.motion.fps,
            "drawn": "" if figure.drawing is None else f"{figure.file} {id(figure.drawing)}",
            "body": "" if figure.body is None else f"{figure.file} {id(figure.body)}",
            "kinds": files.kinds(figure),
        },
        "pose": _places_of(figure.pose),
        "parts": None if figure.drawing is None else _parts_of(figure.drawing, figure.pose),
        "joints": None if figure.body is None else _joints_of(figure.body, figure.pose),
        "pinned": list(figure.pinned),
        "pool": list(figure.pool.names()),
        "extents": figure.extents,
        "feel": {**FEEL, **RUBBER, **figure.feel},
        "dance": phrases.shown(figure),
        "music": music.shown(figure),
        "made": made.shown(state, "posing"),
    }


# --- actions: (state, fields) -> state ----------------------------------------------------------------------------


def begin(state: State, who: File) -> State:
    """Pose a figure: one that is built in, or of a file in the folder."""
    from retarget.characters.figures.dancer import BUILT_IN
    from retarget.workbench.folder.filenames import inside

    if who not in BUILT_IN and not figures.is_figure(inside(state.folder, who)):
        raise InputError(
            f"a figure must be {', '.join(BUILT_IN)}, a .bvh, a model with a skin or a drawing with marked joints, got "
            f"{who[:80]!r}"
        )
    return pose_file(state, who)


def drag(state: State, joint: Number, to: tuple[Metres, Metres, Metres]) -> State:
    """Drag a joint."""
    return with_figure(state, figures.dragged(figure_in(state), joint_of(state, joint), np.array(to)))


def pin(state: State, joint: Number, on: bool = True) -> State:
    """Pin a joint, or let it go."""
    figure = figure_in(state)
    others = tuple(other for other in figure.pinned if other != joint_of(state, joint))
    return with_figure(state, replace(figure, pinned=(*others, joint) if on else others))


def unpin(state: State) -> State:
    """Let all joints go."""
    return with_figure(state, replace(figure_in(state), pinned=()))


def mix(state: State, posture: Name, extent: Extent) -> State:
    """Mix a posture in."""
    return with_figure(state, figures.postured(figure_in(state), posture, round(extent, 3)))


def stand(state: State) -> State:
    """Stand at rest."""
    figure = figure_in(state)
    turns = np.zeros((len(figure.skeleton), 3))
    return with_figure(state, replace(figure, pose=figures.mixed(figure.skeleton, figure.rest, turns), extents={}))


def undrag(state: State) -> State:
    """Stand as drawn, or as the figure began."""
    figure = figure_in(state)
    return with_figure(state, replace(figure, pose=figure.begun, extents={}))


def keep(state: State, name: Name) -> State:
    """Keep the pose as a posture."""
    return with_figure(state, figures.kept(figure_in(state), name.strip()))


def forget(state: State, name: Name) -> State:
    """Forget a posture."""
    return with_figure(state, figures.without(figure_in(state), name))


def take(state: State, frame: Number) -> State:
    """Take the pose of a frame of the clip."""
    from mocap.posing import postures

    figure = figure_in(state)
    if figure.motion is None:
        raise InputError("a pose can be taken from a clip of motion capture: open a .bvh file")
    posture = postures.posture_of(figure.motion, frame, "taken", figure.rest)
    turns = postures.turns_of(posture, figure.skeleton)
    return with_figure(state, replace(figure, pose=figures.mixed(figure.skeleton, figure.rest, turns), extents={}))


def feel(state: State, slider: Name, value: Annotated[float, Meta(ge=-1000, le=1000)]) -> State:
    """Move a slider."""
    figure = figure_in(state)
    if slider not in RANGES:
        raise InputError(f"a slider must be one of {', '.join(RANGES)}, got {slider!r}")
    least, most = RANGES[slider]
    if not least <= value <= most:
        raise InputError(f"the slider {slider} must be {least:g} to {most:g}, got {value:g}")
    return with_figure(state, replace(figure, feel={**figure.feel, slider: round(value, 4)}))


# --- looks: (state, fields) -> bytes; nothing changes ---------------------------------------------------------------


def ready(state: State) -> Seen:
    """Nothing, as soon as joints can be dragged: machine code is made when it is first needed, once on a machine."""
    with _readying:  # a lock of its own: others go on meanwhile
        figure = figure_in(state)
        joint = len(figure.skeleton) - 1
        figures.dragged(figure, joint, figure.begun.positions[joint] + 0.01)
    return Seen("application/json", b"true")


def danced(state: State, start: Moment = 0.0, seconds: Moment | None = None) -> Seen:
    """The dance, or some seconds of it: float32 (T, J, 3), 24 frames a second, or of a drawing its parts' (T, P, 7)."""
    figure = figure_in(state)
    between = None if seconds is None else (start, start + seconds)
    with _work:
        motion, beats = files.dance_of(figure, between)
        said = {"fps": FPS, "first": 0 if between is None else int(np.ceil(start * FPS - 1e-9)), "bpm": beats.bpm}
        if figure.body is not None:
            return numbers(fleshed.joints_at(figure.skeleton, motion.world()), **said)
        if figure.drawing is None:
            return numbers(motion.positions(), **said)
        parts, names = puppet.parts_dancing(figure.drawing, motion, between is None)
    return numbers(parts, parts=names, root=figure.drawing.character.marks.places[0].tolist(), **said)


def mesh(state: State, parts: Parts | None = None) -> Seen:
    """The drawing's pieces (see `puppet.mesh`)."""
    held = _drawing(state)
    with _work:
        pieces, told = puppet.mesh(held, held.parts.names if parts is None else tuple(parts))
    return numbers(pieces, **told)


def texture(state: State) -> Seen:
    """The picture of a drawn figure."""
    return Seen("image/png", puppet.texture(_drawing(state)))


def body(state: State) -> Seen:
    """The mesh of a model (see `fleshed.mesh`)."""
    figure = figure_in(state)
    if figure.body is None:
        raise InputError("this figure has a skeleton only: open a model with a skin")
    points, told = fleshed.mesh(figure.body)
    return numbers(points, **told)


def rubber(state: State) -> Seen:
    """The clip made rubber: float32 (T, S, 3) of its sub-joints, with their parents beside."""
    from mocap.rubber.rubber import make_rubber

    clip, sliders = _clip(state), figure_in(state).rubber()
    with _work:
        rubbery = make_rubber(clip, **sliders)
    return numbers(rubbery.positions, fps=clip.fps, parents=list(rubbery.subjoints.parents))


def clip(state: State) -> Seen:
    """The clip as it was captured: float32 (T, J, 3)."""
    motion = _clip(state)
    return numbers(motion.positions(), fps=motion.fps, parents=list(motion.skeleton.parents))


def others(state: State) -> Seen:
    """Whom the folder has to pose: a list of files."""
    found = listing.listing(state.folder).of("bvh", "figure")
    return Seen("application/json", json.dumps(found).encode())


DESK = Desk(
    "posing",
    shown,
    actions={
        one.__name__: one
        for one in (
            *(begin, drag, pin, unpin, mix, stand, undrag, keep, forget, take, feel),
            *(*phrases.ACTIONS, *music.ACTIONS),
        )
    },
    writes={one.__name__: one for one in (*music.WRITES, files.save_pose)},
    looks={one.__name__: one for one in (ready, danced, rubber, clip, mesh, texture, body, others, *music.LOOKS)}
    | {"made": made.piece},
    work={"export": files.EXPORT, "hear": music.HEAR},
)


def _drawing(state: State) -> puppet.Held:
    held = figure_in(state).drawing
    if held is None:
        raise InputError("this figure has a skeleton only: open a drawing with marked joints")
    return held


@lru_cache(maxsize=2)
def _places_of(pose: Pose) -> list[list[float]]:
    return np.round(pose.positions, 5).tolist()


@lru_cache(maxsize=2)
def _parts_of(held: puppet.Held, pose: Pose) -> list[float]:
    return np.round(puppet.parts_at(held, pose.positions[None])[0], 8).ravel().tolist()


@lru_cache(maxsize=2)
def _joints_of(dancer: Dancer, pose: Pose) -> list[float]:
    return np.round(fleshed.joints_of(dancer.skeleton, pose), 6).ravel().tolist()


@lru_cache(maxsize=4)
def _beginning(motion: SkeletonMotion) -> SkeletonMotion:
    return motion.part(0, min(len(motion), max(2, round(SECONDS * motion.fps))))


def _clip(state: State) -> SkeletonMotion:
    motion = figure_in(state).motion
    if motion is None:
        raise InputError("rubber is made of motion capture: open a .bvh file")
    return _beginning(motion)
