"""What is worked on: a shot, the motion captured from it, and who plays it; and the files they live in.

All files of one piece of work lie in one folder and share a name: hop.shot.toml, hop.motion.json, hop.cast.toml.
"""

from dataclasses import dataclass, replace
from pathlib import Path

from capture.errors import InputError
from capture.fit import source
from capture.motion import tracks
from capture.motion.tracks import CartoonMotion
from capture.pictures.shot import KeyDrawing, Part, Shot, read_shot, write_shot
from mocap.posing.choreography import write_dance
from mocap.posing.postures import write_pool
from mocap.posing.stance import write_stance
from retarget.characters.casts.castfile import Cast, read_cast, write_cast
from retarget.workbench.figure import DANCE, POOL, STANCE, Figure, figure_of, is_figure

SHOT, MOTION, CAST = ".shot.toml", ".motion.json", ".cast.toml"
DOCUMENTS = (SHOT, MOTION, CAST, POOL, DANCE, STANCE)
CLIPS = (".mp4", ".mkv", ".mov", ".webm", ".avi", ".gif", ".apng", ".png", ".webp")


@dataclass(frozen=True, eq=False)
class State:
    """Everything a person can change; an action makes a new one of it."""

    folder: Path  # nothing outside it is read or written
    name: str = ""  # of the files; nothing is open without it
    shot: Shot | None = None
    motion: CartoonMotion | None = None
    captured: Shot | None = None  # what the motion was captured from, as far as that is known
    cast: Cast | None = None
    figure: Figure | None = None


def file_of(state: State, kind: str) -> Path:
    """Where a document of this kind is kept: SHOT, MOTION, CAST, or any other ending."""
    return state.folder / (state.name + kind)


def open_file(path: Path) -> State:
    """The state with this file open, and with it the others of its name; a clip begins a shot of its own."""
    for kind in (SHOT, MOTION, CAST):
        if path.name.endswith(kind):
            return _work(path.parent, path.name.removesuffix(kind))
    if is_figure(path):
        return pose_file(State(path.parent), path.name)
    if not (path.is_dir() or path.suffix.lower() in CLIPS):
        raise InputError(f"{path.name} must be a clip, a figure, {SHOT}, {MOTION} or {CAST}: choose another file")
    work = _work(path.parent, path.stem, Shot(str(path), (Part("character", (KeyDrawing("rest", 0),)),)))
    if not path.samefile(work.shot.clip):
        shot = file_of(work, SHOT)
        raise InputError(
            f"{shot.name} is about another clip, {work.shot.clip}: rename one of the two, or open {shot.name} itself"
        )
    return work


def _work(folder: Path, name: str, begun: Shot | None = None) -> State:
    """What lies in a folder under a name; where there is no shot yet, one that is begun."""
    fresh = State(folder, name)
    shot, motion, cast = (file_of(fresh, kind) for kind in (SHOT, MOTION, CAST))
    opened = read_shot(shot) if shot.exists() else begun
    found = tracks.load(motion) if motion.exists() else None
    return replace(
        fresh,
        shot=opened,
        motion=found,
        captured=None if found is None else source.shot_of(found) or opened,
        cast=read_cast(cast) if cast.exists() else None,
    )


def pose_file(state: State, file: str) -> State:
    """The state with a figure to pose open: of a .bvh, a model with a skin, a marked drawing, or one built in."""
    name = file.removesuffix(".marks.toml") if file.lower().endswith(".marks.toml") else str(Path(file).with_suffix(""))
    return State(state.folder, name, figure=figure_of(state.folder, file, name))


def documents(state: State) -> dict[str, tuple[object, object]]:
    """By kind: the document, if there is one, and the function that writes it to a path."""
    figure = state.figure
    pool = None if figure is None else figure.pool
    dance = None if figure is None or not any(phrase.steps for phrase in figure.dance.phrases) else figure.dance
    return {
        SHOT: (state.shot, write_shot),
        MOTION: (state.motion, tracks.save),
        CAST: (state.cast, write_cast),
        POOL: (pool, write_pool),
        DANCE: (dance, write_dance),
        STANCE: (None if figure is None else figure.stance, write_stance),
    }
