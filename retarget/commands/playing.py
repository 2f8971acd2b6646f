"""The command that lets motion capture play drawings and models."""

from pathlib import Path
from typing import TYPE_CHECKING, Literal

from retarget.commands import flags
from retarget.console import Out, captured, stem, tell

if TYPE_CHECKING:
    from mocap.onto.views import Views
    from mocap.rubber.rubber import RubberMotion
    from mocap.skeletons.skeleton import SkeletonMotion
    from retarget.characters.figures.skin import Skin
    from retarget.characters.models.model import Model

View = Literal["front", "side"]


def play(
    clip: Path,
    drawing: Path | None = None,
    out: Out = None,
    *,
    omega: float | None = None,
    stretch: flags.Stretch = 1.6,
    squash: flags.Squash = 0.5,
    hose: float = 1.0,
    follow: flags.Swing = 0.5,
    stiff: bool = False,
    view: View | None = None,
    foreshorten: float = 0.5,
    animation: str = "",
    plane: str = "zy",
    rate: float = 24.0,
    start: float = 0.0,
    seconds: float | None = None,
    size: int | None = None,
    background: str | None = None,
) -> str:
    """Let motion capture, made of rubber, play a drawing with marked joints, a body of hoses, or a model itself.

    Parameters
    ----------
    clip
        A *.bvh file; or a model, *.glb or *.gltf, that moves by itself.
    drawing
        Who plays: an SVG with joints marked by circles in a group with the id "joints"; a folder with texture.png,
        mask.png and char_cfg.yaml as AnimatedDrawings writes them; or a *.marks.toml that names a picture and its
        joints.  Without one a body of rubber hoses plays; a model
        plays itself.
    out
        .mp4, .mov, .webm, .gif or a folder of PNG; .glb; of a drawing also .json (Lottie), .svg, and *.motion.json,
        which keeps the motion of all sub-links.  NAME.play.mp4 beside you if not given.
    omega
        How many times the motion is exaggerated; without it as much as `stretch` allows in each limb.
    hose
        0 to 1: how round limbs bend.
    stiff
        The motion as it was captured, without rubber.
    view
        From where the performer is seen; without it arms and legs each from where they move most.
    foreshorten
        0 to 1: how much shorter a limb is drawn that points at the viewer.
    animation
        Of a model: which of its animations; the first without it.
    plane
        Of a model or of hoses: the side that is seen: "zy" as it looks to the right, "-zy" to the left, "xy" its front.
    rate
        About so many frames a second are drawn.
    start
        Seconds into the clip.
    seconds
        How much of it.
    size
        Width of the picture in pixels.
    background
        A colour, a picture or a clip.
    """
    from capture.errors import InputError

    out = out or Path(stem(clip) + ".play.mp4")
    rubber = {"omega": omega, "most_stretch": stretch, "squash": squash, "hose": hose, "follow": follow}
    cut = (rate, start, seconds, stiff, rubber)
    model = clip.suffix.lower() in (".glb", ".gltf")
    if model and drawing is not None:
        raise InputError(f"{clip} is a model and plays itself: leave the drawing out")
    if model or drawing is None:
        return _solid(clip, out, animation, plane, cut, size, background)
    return _drawn(clip, drawing, out, view, foreshorten, cut, size, background)


def _drawn(
    clip: Path,
    drawing: Path,
    out: Path,
    view: View | None,
    foreshorten: float,
    cut: tuple,
    size: int | None,
    background: str | None,
) -> str:
    from capture.motion import tracks
    from capture.pictures.encode import write_clip
    from capture.progress import progress
    from mocap.onto.bones import cast_marks
    from mocap.onto.to_tracks import to_tracks
    from retarget.characters.bodies.markfiles import read_marked
    from retarget.characters.casts.backdrop import read_background
    from retarget.export import formats
    from retarget.stage import draw2d
    from retarget.stage import play as stage

    character, motion = read_marked(drawing), captured(clip)
    made = _made(motion, *cut)
    casting = cast_marks(made, character.marks, _views(view))
    tell(f"{drawing}: {note}" for note in casting.notes)
    lent = to_tracks(made, character.marks, casting, foreshorten)
    said = f"{out}: {len(lent.times)} frames at {lent.fps:.4g} a second, {drawing.name} plays {clip.name}"
    if out.name.endswith(".motion.json"):
        tracks.save(lent, out)
        return f"{said}, {len(lent.tracks)} parts"
    performance = stage.play(lent, character)
    if write := formats.bodies(out):
        write(performance, out)
    elif write := formats.drawings(out):
        write(performance, out, size, background)
    else:
        behind = None if background is None else read_background(background)
        frames = draw2d.draw_frames(performance, behind, size)
        write_clip(out, progress(frames, "drawing", len(lent.times)), lent.fps, lent.times)
    return said


def _solid(
    clip: Path, out: Path, animation: str, plane: str, cut: tuple, size: int | None, background: str | None
) -> str:
    """A model's own animation, or a body of hoses in a captured motion, made of rubber: as a *.glb or as a video."""
    from capture.errors import InputError
    from capture.pictures.encode import write_clip
    from capture.progress import progress
    from retarget.characters.casts.backdrop import read_background
    from retarget.characters.figures.rubber_skin import posed, rubber_skin
    from retarget.export import formats
    from retarget.export.rubber import write_rubber
    from retarget.stage import draw2d
    from retarget.stage.play import play_mesh

    if formats.drawings(out) or out.name.endswith(".motion.json"):
        raise InputError(
            f"{out.name} holds drawings, and nobody drawn plays: ask for a video or a .glb, or add a drawing"
        )
    read = _hoses if clip.suffix.lower() == ".bvh" else _model
    made, model, skin, said = read(clip, animation, cut)
    bound, fps = rubber_skin(skin, model.points, made.subjoints), made.source.fps
    if out.suffix.lower() in (".glb", ".gltf"):
        write_rubber(model, bound, made, out, clip.stem)
    else:
        performance = play_mesh(posed(bound, model.points, made), model, fps, plane)
        behind = None if background is None else read_background(background)
        frames = draw2d.draw_frames(performance, behind, size)
        write_clip(out, progress(frames, "drawing", len(made)), fps, performance.times)
    joints, ours = len(made.subjoints.skeleton), len(made.subjoints)
    return f"{out}: {len(made)} frames at {fps:.4g} a second, {said} on {ours} sub-joints of {joints} joints"


def _hoses(clip: Path, _: str, cut: tuple) -> "tuple[RubberMotion, Model, Skin, str]":
    from retarget.characters.figures.hoses import hoses

    motion = captured(clip)
    made = _made(motion, *cut)
    model, skin = hoses(made.subjoints.skeleton, made.source)
    return made, model, skin, f"a body of hoses plays {clip.name}"


def _model(clip: Path, animation: str, cut: tuple) -> "tuple[RubberMotion, Model, Skin, str]":
    from capture.errors import InputError
    from retarget.characters.figures.rubber_skin import motion_of
    from retarget.characters.figures.skin import read_skin
    from retarget.characters.models.meshfiles import read_model

    skin, model = read_skin(clip), read_model(clip)
    if skin is None or not skin.animations:
        raise InputError(
            f"{clip} must have a skin and an animation to move by, it has none: give motion capture instead"
        )
    animation = animation or next(iter(skin.animations))
    return _made(motion_of(skin, animation), *cut), model, skin, animation


def _made(
    motion: "SkeletonMotion", rate: float, start: float, seconds: float | None, stiff: bool, how: dict
) -> "RubberMotion":
    """A stretch of the motion made of rubber, and of it about `rate` frames a second."""
    from dataclasses import replace

    from capture.errors import InputError
    from mocap.rubber import rubber

    first = round(start * motion.fps)
    last = len(motion) if seconds is None else min(len(motion), first + max(round(seconds * motion.fps), 1))
    if not 0 <= first < last or not rate > 0:
        raise InputError(
            f"the motion lasts {len(motion) / motion.fps:.2f} seconds: --start must lie in it, --seconds and --rate be "
            f"above 0, got {start:g}, {seconds or 0:g} and {rate:g}"
        )
    whole = motion.part(first, last)
    made = rubber.plain(whole) if stiff else rubber.make_rubber(whole, **how)
    step = max(round(motion.fps / rate), 1)
    source = made.source
    source = replace(
        source, translation=source.translation[::step], rotation=source.rotation[::step], fps=motion.fps / step
    )
    arrays = {name: getattr(made, name)[::step] for name in ("positions", "rotation", "stretch", "thickness")}
    return replace(made, source=source, **arrays)


def _views(view: View | None) -> "Views | None":
    from mocap.onto.views import FRONT, SIDE, Views

    if view is None:
        return None
    angle = FRONT if view == "front" else SIDE
    return Views(angle, angle, angle, note=f"seen from the {view}")
