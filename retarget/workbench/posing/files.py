"""What leaves the posing desk: a pose, a dance, or a clip made rubber, as files of other programs."""

from pathlib import Path
from typing import Any, Literal

from capture.errors import InputError
from mocap.posing.beats import Beats
from mocap.skeletons.skeleton import SkeletonMotion
from retarget.characters.bodies.marked import MarkedDrawing
from retarget.characters.figures.dancer import BUILT_IN, Dancer, read_dancer
from retarget.workbench import made
from retarget.workbench.desks import Done, Work
from retarget.workbench.figure import Figure, figure_of
from retarget.workbench.posing import music
from retarget.workbench.posing.posed import figure_in
from retarget.workbench.state import State, file_of

FPS = 24.0
SIZE = 480  # pixels of a picture of a skeleton
WORDS = {
    ".mp4": "MP4 with sound",
    ".gif": "GIF",
    ".webm": "WebM video",
    ".bvh": "BVH",
    ".glb": "glTF model",
    ".svg": "SVG",
    ".png": "PNG",
    ".json": "Lottie",
}
Kind = Literal[".mp4", ".gif", ".webm", ".bvh", ".glb", ".svg", ".png", ".json"]


def kinds(figure: Figure) -> dict[str, list[list[str]]]:
    """As what a pose, a dance and rubber can be written: [ending, words] of each."""
    vector = figure.drawing is not None and isinstance(figure.drawing.character, MarkedDrawing)
    drawn = figure.drawing is not None
    pose = [".png", *((".svg",) if vector else ()), ".bvh", *(() if drawn else (".glb",))]
    dance = [".mp4", ".gif", ".webm", ".bvh", ".glb", *((".svg", ".json") if vector else ())]
    rubber = [".bvh", ".mp4", ".gif"] if figure.motion is not None else []
    found = {"pose": pose, "dance": dance, "rubber": rubber}
    return {what: [[one, _words(one, what)] for one in of] for what, of in found.items()}


def dance_of(figure: Figure, between: tuple[float, float] | None = None) -> tuple[SkeletonMotion, Beats]:
    """The figure's dance, or what of it is between two moments, and the beats it is danced to."""
    from mocap.posing import dance as dancing
    from mocap.posing.elastic import felt, styled

    if not any(phrase.steps for phrase in figure.dance.phrases):
        raise InputError("a dance needs a posture on a beat: put one there, or have a dance made up")
    beats, slider = music.beats_of(figure), figure.slider
    springs = styled(felt(slider("quick"), slider("damping")), slider("clumsy"), slider("stiff"), slider("wild"))
    told = (figure.skeleton, figure.pool, figure.dance, beats, FPS, springs, slider("extent"), figure.rest, between)
    return dancing.danced(*told), beats


def save_pose(state: State, kind: Kind = ".bvh") -> State:
    """Write the pose into a file of its own."""
    from mocap.posing import poses
    from mocap.skeletons.bvh import write_bvh

    figure, out = figure_in(state), file_of(state, f".pose{kind}")
    if kind not in [one for one, _ in kinds(figure)["pose"]]:
        raise InputError(f"a pose of this figure is written as {_known(figure, 'pose')}, not as {kind}")
    motion = poses.motion_of(figure.skeleton, [figure.pose], FPS)
    if kind == ".bvh":
        write_bvh(motion, out)
    elif figure.drawing is not None:
        _write_drawn(figure, out)
    else:
        _write_posed(motion, _dancer(state.folder, figure.file), out)
    made.note(out, f"{out.name}: the pose; {made.size_of(out)}", "posing")
    return state


def export(what: str, folder: str, file: str, name: str, out: str) -> Done:
    """Write the dance or the rubber into a file."""
    from retarget.commands import rubbering
    from retarget.commands.onward import write_performed

    figure, path = figure_of(Path(folder), file, name), Path(out)
    if what == "rubber":
        said = rubbering.exaggerate(Path(folder) / file, path, **figure.rubber())
        return _told(path, said.replace(str(path.parent), path.parent.name))
    motion, beats = dance_of(figure)
    dancer = _dancer(Path(folder), file)
    drawing = None if path.suffix == ".bvh" else dancer.drawing
    song = None if figure.music is None else Path(folder) / figure.music.file
    write_performed(motion, dancer, path, drawing, SIZE, (song, beats))
    return _told(path, f"{path.parent.name}/{path.name}: {len(motion)} frames, {beats.bpm:.0f} beats a minute")


def _prepare_export(state: State, what: Literal["dance", "rubber"], kind: Kind = ".mp4") -> dict[str, Any]:
    figure = figure_in(state)
    known = [one for one, _ in kinds(figure)[what]]
    if what == "rubber" and not known:
        raise InputError("rubber is made of motion capture: open a .bvh file")
    if kind not in known:
        raise InputError(f"{what} of this figure is written as {_known(figure, what)}, not as {kind}")
    if what == "dance" and not any(phrase.steps for phrase in figure.dance.phrases):
        raise InputError("a dance needs a posture on a beat: put one there, or have a dance made up")
    out = file_of(state, f".{what}{kind}")
    return {"what": what, "folder": str(state.folder), "file": figure.file, "name": state.name, "out": str(out)}


EXPORT = Work(_prepare_export, export, made.exported)


def _told(path: Path, said: str) -> Done:
    return Done({"out": str(path), "sentence": f"{said}; {made.size_of(path)}", "desk": "posing"}, said)


def _known(figure: Figure, what: str) -> str:
    return ", ".join(one for one, _ in kinds(figure)[what])


def _words(kind: str, what: str) -> str:
    return "MP4 video" if kind == ".mp4" and what == "rubber" else WORDS[kind]


def _write_drawn(figure: Figure, out: Path) -> None:
    """A drawing in its pose, transparent around, as large as it was drawn."""
    from PIL import Image

    from capture.files import written_beside
    from retarget.export.svg import write_svg
    from retarget.stage import draw2d
    from retarget.stage.held import performed

    shown = performed(figure.drawing, figure.pose.positions[None])
    if out.suffix == ".svg":
        write_svg(shown, out)
        return
    with written_beside(out) as beside:
        Image.fromarray(draw2d.draw(shown, 0)).save(beside)


def _write_posed(motion: SkeletonMotion, dancer: Dancer, out: Path) -> None:
    """A skeleton in its pose, or the model whose skeleton it is."""
    from PIL import Image

    from capture.files import written_beside
    from retarget.commands.onward import pictures, write_performed

    if out.suffix == ".png":
        with written_beside(out) as beside:
            Image.fromarray(next(iter(pictures(motion, dancer, SIZE)))).save(beside)
    else:
        write_performed(motion, dancer, out, None, SIZE, None)


def _dancer(folder: Path, file: str) -> Dancer:
    return read_dancer(file if file in BUILT_IN else str(folder / file))
