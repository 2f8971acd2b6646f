"""What becomes of a skeleton that moves on the spot: a file, a film of sticks or a model, a drawing that plays it."""

from pathlib import Path
from typing import TYPE_CHECKING

from retarget.console import tell

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from mocap.posing.beats import Beats
    from mocap.skeletons.skeleton import SkeletonMotion
    from retarget.characters.figures.dancer import Dancer


def write_performed(
    motion: "SkeletonMotion",
    dancer: "Dancer",
    out: Path,
    drawing: Path | None,
    size: int,
    sound: "tuple[Path | None, Beats] | None",
) -> None:
    """The motion as what the name of `out` asks for: of a drawing if there is one, else of the dancer itself."""
    from capture.errors import InputError
    from mocap.rubber import rubber
    from mocap.skeletons.bvh import write_bvh
    from retarget.characters.figures.rubber_skin import rubber_skin
    from retarget.export import formats
    from retarget.export.rubber import write_rubber

    kind = out.suffix.lower()
    if drawing is not None:
        if kind == ".bvh":
            raise InputError(
                f"{out.name} holds a skeleton, and {drawing.name} is to move: ask for a video, or leave it"
            )
        _drawn(motion, drawing, out, size, sound)
    elif kind == ".bvh":
        write_bvh(motion, out)
    elif kind in (".glb", ".gltf"):
        model, skin, moved = dancer.body(motion)
        made = rubber.plain(moved)
        write_rubber(model, rubber_skin(skin, model.points, made.subjoints), made, out, "dancer")
    elif formats.drawings(out) or formats.bodies(out):
        raise InputError(f"{out.name} holds drawings, and nobody drawn moves: ask for a video, .glb or .bvh")
    else:
        _film(pictures(motion, dancer, size), len(motion), motion.fps, out, sound)


def pictures(motion: "SkeletonMotion", dancer: "Dancer", size: int) -> "Iterator[NDArray]":
    """A stick figure's pictures; a model's own where it has one."""
    import numpy as np

    from mocap import sticks
    from mocap.rubber import rubber
    from retarget.characters.figures.rubber_skin import posed, rubber_skin
    from retarget.stage import draw2d
    from retarget.stage.play import play_mesh

    if dancer.model is not None:
        model, skin, moved = dancer.body(motion)
        made = rubber.plain(moved)
        points = posed(rubber_skin(skin, model.points, made.subjoints), model.points, made)
        return draw2d.draw_frames(play_mesh(points, model, motion.fps, (0.5, 0.1, 0.86), size), None, None)
    places = motion.positions()
    view = sticks.view_of(places, (size, size), 0.45, follow=False)
    thick = 0.017 * float(np.ptp(places[..., 1], axis=1).max())
    return sticks.draw(places, motion.skeleton.parents, view, thick, sticks.sides(motion.skeleton.names))


def _drawn(
    motion: "SkeletonMotion", drawing: Path, out: Path, size: int, sound: "tuple[Path | None, Beats] | None"
) -> None:
    """The motion by a drawing with marked joints (`mocap play` does it with rubber)."""
    from mocap.onto.bones import cast_marks
    from mocap.onto.to_tracks import to_tracks
    from mocap.rubber import rubber
    from retarget.characters.bodies.markfiles import read_marked
    from retarget.export import formats
    from retarget.stage import draw2d
    from retarget.stage.play import play

    character, made = read_marked(drawing), rubber.plain(motion)
    casting = cast_marks(made, character.marks, None)
    tell(f"{drawing}: {note}" for note in casting.notes)
    performance = play(to_tracks(made, character.marks, casting), character)
    if write := formats.bodies(out):
        write(performance, out)
    elif write := formats.drawings(out):
        write(performance, out, size, None)
    else:
        _film(draw2d.draw_frames(performance, None, size), len(motion), motion.fps, out, sound)


def _film(
    frames: "Iterator[NDArray]", count: int, fps: float, out: Path, sound: "tuple[Path | None, Beats] | None"
) -> None:
    """Pictures as a clip, with the music, or clicks on the beats, where a file can have sound."""
    from capture.files import written_beside
    from capture.pictures.encode import write_clip
    from capture.progress import progress
    from retarget.export.sound import CODECS, add_sound, clicks, sound_of

    frames = progress(frames, "drawing", count)
    if sound is None or out.suffix.lower() not in CODECS:
        write_clip(out, frames, fps)
        return
    music, beats = sound
    with written_beside(out) as beside:
        write_clip(beside, frames, fps)
        heard = clicks(beats.times, count / fps) if music is None else sound_of(music, count / fps)
        add_sound(beside, *heard)
