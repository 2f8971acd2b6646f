"""The posing desk: joints dragged on springs, postures mixed, kept and put on beats; a clip beside it made rubber."""

from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from threading import RLock
from typing import Annotated, Any, Literal

import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from capture.errors import InputError
from mocap.posing.choreography import Dance, Step
from mocap.skeletons.skeleton import SkeletonMotion
from retarget.workbench import figure as figures
from retarget.workbench.desks import Desk, Seen, Work
from retarget.workbench.figure import DANCE, POOL, Figure
from retarget.workbench.state import State, file_of

Number = Annotated[int, Meta(ge=0, le=10_000_000)]
Metres = Annotated[float, Meta(ge=-1e6, le=1e6)]
Name = Annotated[str, Meta(min_length=1, max_length=60)]
Extent = Annotated[float, Meta(ge=-3, le=3)]
Beat = Annotated[float, Meta(ge=0, le=1000)]
Bpm = Annotated[float, Meta(ge=20, le=400)]
Style = Annotated[float, Meta(ge=-1, le=1)]
SECONDS = 12.0  # of a clip that rubber is shown for
_work = RLock()


def shown(state: State) -> dict[str, Any]:
    """The figure, how it stands, and its dance."""
    figure = state.figure
    if figure is None:
        return {"figure": None}
    return {
        "figure": {
            "file": figure.file,
            "names": list(figure.skeleton.names),
            "parents": list(figure.skeleton.parents),
            "frames": 0 if figure.motion is None else len(figure.motion),
            "fps": 0.0 if figure.motion is None else figure.motion.fps,
        },
        "pose": np.round(figure.pose.positions, 5).tolist(),
        "pinned": list(figure.pinned),
        "pool": list(figure.pool.names()),
        "extents": figure.extents,
        "dance": {
            "beats": figure.dance.beats,
            "phrase": figure.dance.phrases[0].beats,
            "half": figure.dance.phrases[0].half,
            "steps": [
                {"beat": step.beat, "posture": step.posture, "extent": step.extent} for step in figures.steps_of(figure)
            ],
        },
    }


# --- actions: (state, fields) -> state ----------------------------------------------------------------------------


def begin(state: State, who: Literal["human", "flower", "lamp"]) -> State:
    """Pose a figure that is built in."""
    return replace(State(state.folder, who), figure=figures.figure_of(state.folder, who, who))


def drag(state: State, joint: Number, to: tuple[Metres, Metres, Metres]) -> State:
    """Drag a joint."""
    return _with(state, figures.dragged(_figure(state), _joint(state, joint), np.array(to)))


def pin(state: State, joint: Number, on: bool = True) -> State:
    """Pin a joint, or let it go."""
    figure = _figure(state)
    others = tuple(other for other in figure.pinned if other != _joint(state, joint))
    return _with(state, replace(figure, pinned=(*others, joint) if on else others))


def mix(state: State, posture: Name, extent: Extent) -> State:
    """Mix a posture in."""
    return _with(state, figures.postured(_figure(state), posture, round(extent, 3)))


def stand(state: State) -> State:
    """Stand at rest."""
    figure = _figure(state)
    turns = np.zeros((len(figure.skeleton), 3))
    return _with(state, replace(figure, pose=figures.mixed(figure.skeleton, figure.rest, turns), extents={}))


def keep(state: State, name: Name) -> State:
    """Keep the pose as a posture."""
    return _with(state, figures.kept(_figure(state), name.strip()))


def forget(state: State, name: Name) -> State:
    """Forget a posture."""
    return _with(state, figures.without(_figure(state), name))


def take(state: State, frame: Number) -> State:
    """Take the pose of a frame of the clip."""
    from mocap.posing import postures

    figure = _figure(state)
    if figure.motion is None:
        raise InputError("a pose can be taken from a clip of motion capture: open a .bvh file")
    posture = postures.posture_of(figure.motion, frame, "taken", figure.rest)
    turns = postures.turns_of(posture, figure.skeleton)
    return _with(state, replace(figure, pose=figures.mixed(figure.skeleton, figure.rest, turns), extents={}))


def put(state: State, posture: Name, beat: Beat, extent: Extent = 1.0) -> State:
    """Put a posture on a beat."""
    figure = _figure(state)
    figure.pool[posture]  # another is refused with the names there are
    return _with(state, figures.stepped(figure, [*figures.steps_of(figure), Step(beat, posture, extent)]))


def move(state: State, step: Number, beat: Beat | None = None, extent: Extent | None = None) -> State:
    """Move a step to another beat, or make it larger."""
    figure = _figure(state)
    steps = list(figures.steps_of(figure))
    if step >= len(steps):
        raise InputError(f"the dance has {len(steps)} steps, counted from 0; there is no step {step}")
    old = steps[step]
    beats = figure.dance.phrases[0].beats
    to = old.beat if beat is None else min(beat, beats - 0.25)
    steps[step] = replace(old, beat=to, extent=old.extent if extent is None else extent)
    return _with(state, figures.stepped(figure, steps))


def drop(state: State, step: Number) -> State:
    """Take a step out."""
    figure = _figure(state)
    steps = [one for n, one in enumerate(figures.steps_of(figure)) if n != step]
    return _with(state, figures.stepped(figure, steps))


def invent(state: State, seed: Number = 0) -> State:
    """Make a dance up."""
    from mocap.posing.invent import invented

    figure = _figure(state)
    made = invented(figure.pool, figure.skeleton, 8, seed, figure.rest)
    return _with(state, replace(figure, dance=Dance(made.phrases[:1])))  # what the timeline shows


# --- looks: (state, fields) -> bytes; nothing changes ---------------------------------------------------------------


def danced(
    state: State,
    bpm: Bpm = 120.0,
    quick: Annotated[float, Meta(ge=0.2, le=10)] = 2.2,
    damping: Annotated[float, Meta(ge=0.01, le=3)] = 0.8,
    clumsy: Style = 0.0,
    stiff: Style = 0.0,
    wild: Style = 0.0,
    extent: Extent = 1.0,
) -> Seen:
    """The dance: float32 (T, J, 3), little end first, 24 frames a second."""
    from mocap.posing import dance as dancing
    from mocap.posing.beats import steady
    from mocap.posing.elastic import felt, styled

    figure = _figure(state)
    if not any(phrase.steps for phrase in figure.dance.phrases):
        raise InputError("a dance needs a posture on a beat: put one there, or have a dance made up")
    music = steady(bpm, figure.dance.beats * 60 / bpm)
    springs = styled(felt(quick, damping), clumsy, stiff, wild)
    with _work:
        made = dancing.danced(
            figure.skeleton, figure.pool, figure.dance, music, 24.0, springs, extent=extent, rest=figure.rest
        )
    return _places(made.positions(), fps=24.0, bpm=bpm)


def rubber(
    state: State,
    omega: Annotated[float, Meta(ge=0, le=20)] | None = None,
    sigma: Annotated[float, Meta(gt=0.005, le=2)] = 0.15,
    follow: Annotated[float, Meta(ge=0, le=1)] = 0.5,
    squash: Annotated[float, Meta(ge=0, le=1)] = 0.5,
    hose: Annotated[float, Meta(ge=0, le=1)] = 1.0,
) -> Seen:
    """The clip made rubber: float32 (T, S, 3) of its sub-joints, with their parents beside."""
    from mocap.rubber.rubber import make_rubber

    clip = _clip(state)
    with _work:
        made = make_rubber(clip, omega, sigma, squash=squash, hose=hose, follow=follow)
    return _places(made.positions, fps=clip.fps, parents=list(made.subjoints.parents))


def clip(state: State) -> Seen:
    """The clip as it was captured: float32 (T, J, 3)."""
    motion = _clip(state)
    return _places(motion.positions(), fps=motion.fps, parents=list(motion.skeleton.parents))


# --- work: long, in a process of its own ----------------------------------------------------------------------------


def export(what: str, clip: str, files: list[str], out: str, sliders: dict[str, float]) -> dict[str, Any]:
    """Write the dance or the rubber into a file."""
    from retarget.commands import dancing, rubbering

    if what == "rubber":
        said = rubbering.exaggerate(Path(clip), Path(out), **sliders)
    else:
        pool, steps = (Path(file) for file in files)
        said = dancing.dance(None, Path(out), skeleton=clip, postures=pool, steps=steps, **sliders)
    return {"said": said.replace(str(Path(out).parent), Path(out).parent.name)}


def _prepare_export(
    state: State,
    what: Literal["dance", "rubber"],
    kind: Literal[".bvh", ".mp4", ".gif", ".webm"] = ".bvh",
    sliders: dict[str, Annotated[float, Meta(ge=-10, le=400)]] | None = None,
) -> dict[str, Any]:
    figure = _figure(state)
    given = dict(sliders or {})
    known = (
        {"omega", "sigma", "follow", "squash", "hose"}
        if what == "rubber"
        else {"bpm", "quick", "damping", "clumsy", "stiff", "wild", "extent"}
    )
    if set(given) - known:
        raise InputError(f"sliders of {what} must be {', '.join(sorted(known))}, got {', '.join(sorted(given))}")
    if what == "rubber":
        _clip(state)
    elif not figures.steps_of(figure):
        raise InputError("a dance needs a posture on a beat: put one there, or have a dance made up")
    else:
        given["beats"] = int(np.ceil(figure.dance.beats))
    source = figure.file if figure.motion is None else str(state.folder / figure.file)
    files = [str(file_of(state, POOL)), str(file_of(state, DANCE))]
    return {
        "what": what,
        "clip": source,
        "files": files,
        "out": str(file_of(state, f".{what}{kind}")),
        "sliders": given,
    }


def _exported(state: State) -> State:
    return state


def save_pose(state: State) -> State:
    """Write the pose as a BVH of one frame."""
    from mocap.posing import poses
    from mocap.skeletons.bvh import write_bvh

    figure = _figure(state)
    write_bvh(poses.motion_of(figure.skeleton, [figure.pose], 24.0), file_of(state, ".pose.bvh"))
    return state


DESK = Desk(
    "posing",
    shown,
    actions={
        one.__name__: one
        for one in (begin, drag, pin, mix, stand, keep, forget, take, put, move, drop, invent, save_pose)
    },
    looks={"danced": danced, "rubber": rubber, "clip": clip},
    work={"export": Work(_prepare_export, export, _exported)},
)


def _figure(state: State) -> Figure:
    if state.figure is None:
        raise InputError("there must be a figure to pose: open a .bvh file, or take one that is built in")
    return state.figure


def _with(state: State, figure: Figure) -> State:
    return replace(state, figure=figure)


def _joint(state: State, joint: int) -> int:
    count = len(_figure(state).skeleton)
    if joint >= count:
        raise InputError(f"the figure has {count} joints, counted from 0; there is no joint {joint}")
    return joint


@lru_cache(maxsize=4)
def _beginning(motion: SkeletonMotion) -> SkeletonMotion:
    return motion.part(0, min(len(motion), max(2, round(SECONDS * motion.fps))))


def _clip(state: State) -> SkeletonMotion:
    motion = _figure(state).motion
    if motion is None:
        raise InputError("rubber is made of motion capture: open a .bvh file")
    return _beginning(motion)


def _places(places: NDArray, **said: Any) -> Seen:
    points = np.ascontiguousarray(places, dtype="<f4")
    return Seen("application/octet-stream", points.tobytes(), {"shape": list(points.shape), **said})
