"""The `tooncap` command: a subcommand is a function below, its flags are that function's arguments.

Everything heavy is imported inside the functions, so that `tooncap --help` answers at once.
"""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

from cyclopts import App, CycloptsError, Parameter

from retarget.console import background_of, folder_at, not_shadowed, one_line, shot_of, stem, told

Out = Annotated[Path | None, Parameter(name=["--out", "-o"])]


def demo(out: Annotated[Path, Parameter(name=["--out", "-o"])] = Path("demo")) -> str:
    """Capture the built-in frog and let a bunny jump like it.

    Parameters
    ----------
    out
        The folder that takes the videos, the contact sheet and the data.
    """
    from retarget.demo import demo as run

    return run(folder_at(out))


def fixtures(folder: Path) -> str:
    """Write the synthetic cartoons, their truth, and the characters to retarget to.

    Parameters
    ----------
    folder
        Where they go; it is made if it is not there.
    """
    from capture.progress import progress
    from fixtures import cartoons, write

    folder = folder_at(folder)
    toons = cartoons.all_toons()
    for name, draw in progress(toons.items(), "drawing", len(toons)):
        write.write_toon(draw(), folder)
        del name
    drawings = write.write_characters(folder / "characters")
    return f"{folder}: {len(toons)} cartoons with their shots and truth, {len(drawings)} drawings of characters"


def suggest(
    source: Path,
    out: Out = None,
    *,
    box: tuple[float, float, float, float] | None = None,
    color: str | None = None,
    frame: int | None = None,
    name: str = "character",
    residual: float = 1.0,
    keys: int = 8,
    start: int = 0,
    stop: int | None = None,
    fps: float | None = None,
    tile: tuple[int, int] | None = None,
) -> str:
    """Find the key drawings of a clip, and write them into a shot file that can be captured.

    Parameters
    ----------
    source
        A clip: mp4, mkv, webm, gif, apng, webp, a folder of pictures, a sprite sheet; or a *.shot.toml of one part.
    out
        The shot file; NAME.shot.toml beside you if not given.  NAME.keys.png and NAME.residual.png come with it.
    box
        X Y WIDTH HEIGHT of a box drawn round the layer, in pixels.
    color
        The layer's main colour, such as "#3a7f2c".
    frame
        The frame that box or colour are seen in; the first if not given.
    name
        What to call the part.
    residual
        How many pixels a drawing may be off what the keys can redraw.
    keys
        How many keys there may be at most.
    start
        The first frame to look at.
    stop
        The frame to stop before.
    fps
        Frames a second, for pictures that carry no time.
    tile
        WIDTH HEIGHT of a sprite sheet's tiles.
    """
    from dataclasses import replace

    from capture.errors import InputError
    from capture.fit import outlines, video
    from capture.fit import suggest as choosing
    from capture.pictures import overlay as proof
    from capture.pictures.encode import write_picture
    from capture.pictures.shot import write_shot

    shot = shot_of(source, name, box, color, frame, start, stop, fps, tile)
    if len(shot.parts) > 1:
        raise InputError(f"keys are suggested for one part at a time, {source} has {len(shot.parts)}: split it")
    clip = told(video.open_clip(shot))
    followed = outlines.follow(shot.parts[0], clip, shot.start)
    found = choosing.suggest(followed.points, residual, keys, followed.whole)
    part = choosing.with_keys(shot.parts[0], followed.points, found, shot.start)
    why = choosing.reasons(found, shot.start)
    out = out or Path(stem(source) + ".shot.toml")
    sheet, curves = (out.with_name(f"{stem(out)}.{kind}.png") for kind in ("keys", "residual"))
    write_shot(replace(shot, parts=(part,)), out)
    pictures = [clip[int(t)] for t in found.key_frames]
    write_picture(sheet, proof.key_sheet(pictures, followed.points[found.key_frames], why))
    names = [key.name for key in part.keys]
    proof.key_curves(curves, names, found.residual, found.residual_without, found.residual_by_count, residual)
    worst, lost = int(found.residual.argmax()), int((~followed.whole).sum())
    said = f"{out}: {len(names)} key{'s' if len(names) > 1 else ''} for {len(clip)} frames"
    said += f", worst residual {found.residual[worst]:.1f} px at frame {worst + shot.start}"
    said += "" if found.met() else f", more than the {residual:g} px asked for"
    said += f", {lost} frames left out" if lost else ""
    return "\n".join([*why, f"{said}; see {sheet} and {curves}"])


def capture(
    source: Path,
    out: Out = None,
    *,
    box: tuple[float, float, float, float] | None = None,
    color: str | None = None,
    frame: int | None = None,
    name: str = "character",
    start: int = 0,
    stop: int | None = None,
    fps: float | None = None,
    tile: tuple[int, int] | None = None,
) -> str:
    """Capture the motion of a shot, or straight of a clip with --box or --color.

    Parameters
    ----------
    source
        A *.shot.toml, or a clip: mp4, mkv, webm, gif, apng, webp, a folder of pictures, a sprite sheet.
    out
        The motion file; NAME.motion.json beside you if not given.
    box
        X Y WIDTH HEIGHT of a box drawn round the layer, in pixels.
    color
        The layer's main colour, such as "#3a7f2c".
    frame
        The frame that box or colour are seen in; the first if not given.
    name
        What to call the part.
    start
        The first frame to capture.
    stop
        The frame to stop before.
    fps
        Frames a second, for pictures that carry no time.
    tile
        WIDTH HEIGHT of a sprite sheet's tiles.
    """
    from capture.fit import video
    from capture.motion import tracks
    from capture.pictures.shot import write_shot

    shot = shot_of(source, name, box, color, frame, start, stop, fps, tile)
    out = out or Path(stem(source) + ".motion.json")
    clip = told(video.open_clip(shot))
    motion = video.capture(shot, clip)
    tracks.save(motion, out)
    said = f"{out}: {tracks.summary(motion, shot.start)}"
    if not source.name.endswith(".toml"):
        beside = out.with_name(stem(out) + ".shot.toml")
        write_shot(shot, beside)
        said += f"; the shot is in {beside}"
    return said


def contour(
    source: Path,
    out: Out = None,
    *,
    name: str = "character",
    residual: float = 1.0,
    keys: int = 8,
    points: int = 100,
    smooth: float = 0.0,
    volume: bool = False,
) -> str:
    """Capture the motion of contours that are known in every frame; key drawings are found among them.

    Open curves are captured as lines of action.

    Parameters
    ----------
    source
        A JSON or CSV of points, an SVG with a path for each frame, or a folder of SVGs.
    out
        The motion file; NAME.motion.json beside you if not given.
    name
        What to call the part.
    residual
        How many pixels the chosen keys may leave in any frame.
    keys
        How many keys there may be at most.
    points
        How many points an outline gets.
    smooth
        Seconds over which the change of shape is smoothed; 0.1 calms shaky tracing.
    volume
        Let the part turn and move only, so that squash and stretch lie in its keys.
    """
    from capture.fit import suggest as keys_of
    from capture.fit.action import capture_line
    from capture.fit.contour import capture_outlines
    from capture.fit.curves import correspond
    from capture.motion import tracks
    from capture.pictures.contours import read_contours

    contours = read_contours(source)
    outlines = correspond.align_all(contours, points)
    size = tuple(int(edge) for edge in outlines.max(axis=(0, 1)).clip(1) + 16)
    if contours.closed:
        found = keys_of.suggest(outlines, residual, keys)
        motion = capture_outlines(outlines, found.key_frames, contours.fps, size, name, smooth, volume)
    else:
        motion = capture_line(outlines, contours.fps, most_keys=keys, within=residual, part=name, size=size)
    out = out or Path(stem(source) + ".motion.json")
    tracks.save(motion, out)
    return f"{out}: {tracks.summary(motion)}; its keys are {', '.join(motion.tracks[0].keys)}"


def overlay(shot: Path, motion: Path, out: Out = None) -> str:
    """Draw the captured points, grid and weights over the clip, and plot the misfit over time.

    Parameters
    ----------
    shot
        The *.shot.toml that was captured.
    motion
        The *.motion.json that came of it.
    out
        The proof: mp4, webm, gif or a folder of PNG; the plot is put beside it as NAME.misfit.png.
    """
    from capture.fit import video
    from capture.motion import tracks
    from capture.pictures import overlay as proof
    from capture.pictures.encode import write_clip
    from capture.pictures.shot import read_shot
    from capture.progress import progress

    captured = tracks.load(motion)
    captured_from = read_shot(shot)
    clip = told(video.open_clip(captured_from))
    out = out or Path(stem(motion) + ".proof.mp4")
    frames = progress(proof.draw_over(clip, captured, captured_from.start), "overlay", len(clip))
    count = write_clip(out, frames, captured.fps, captured.times)
    worst = proof.residual_plot(captured, out.with_name(out.stem + ".misfit.png"), first=captured_from.start)
    return f"{out}: {count} frames, worst at {', '.join(f'frame {t}' for t in worst)}"


def retarget(
    motion: Path,
    out: Out = None,
    *,
    cast: Path | None = None,
    drawing: tuple[Path, ...] = (),
    background: str | None = None,
    size: int | None = None,
    bend: bool = False,
) -> str:
    """Lend a captured motion to new drawings.

    Parameters
    ----------
    motion
        The *.motion.json that was captured.
    out
        What to make: .mp4, .webm or ProRes .mov (both with alpha), .gif, or a folder of PNG; .json for Lottie, .svg for
        an animated drawing, a folder's 0000.svg for a drawing a frame; .glb, .gltf, .usda, .usdc or .usdz for 3-D
        programs; .jsx for After Effects; .csv or .curves.json for the curves.
    cast
        A *.cast.toml that says which drawing plays which key of which part.
    drawing
        Instead of a cast: SVG or PNG files whose names end in the key's name, or a folder of them.
    background
        A colour or a picture behind the character; transparent if not given, white in an mp4.
    size
        Width in pixels of what is made; the source's own if not given.
    bend
        Bend the one drawing along a captured line of action.
    """
    from capture.errors import InputError
    from capture.motion import tracks
    from capture.pictures.encode import write_clip
    from capture.progress import progress, working
    from retarget.characters import cast as casting
    from retarget.export import formats
    from retarget.stage import draw2d
    from retarget.stage.perform import perform

    captured = tracks.load(motion)
    out = out or Path(stem(motion) + ".retarget.mp4")
    if table := formats.table(out):
        table(captured, out)
        return f"{out}: {tracks.summary(captured)}"
    if (cast is None) == (not drawing):
        raise InputError("a retarget needs either --cast FILE or --drawing FILES, to say who plays")
    if bend and (cast is not None or len(drawing) != 1 or len(captured.tracks) != 1):
        raise InputError('--bend needs one --drawing and a motion of one part; a cast says between = "bend" itself')
    if bend:
        part = casting.CastPart(captured.tracks[0].part, drawing=str(drawing[0]), between=casting.BEND)
        chosen = casting.Cast((part,))
    else:
        chosen = casting.read_cast(cast) if cast is not None else casting.cast_of(list(drawing), captured)
    with working("learning the drawings"):
        performance = perform(captured, casting.targets(chosen, captured))
    parts = ", ".join(part.name for part in chosen.parts)
    said = f"{out}: {len(captured.times)} frames at {captured.fps:.4g} a second, new"
    if bodies := formats.bodies(out):
        with working("meshing the drawings"):
            bodies(performance, out)
        return f"{said} bodies play {parts}"
    behind = casting.backdrop(chosen) if background is None else background_of(background)
    if drawings := formats.drawings(out):
        with working("writing the drawings"):
            drawings(performance, out, size, behind)
        return f"{said} drawings play {parts}"
    frames = draw2d.draw_frames(performance, behind, size)
    write_clip(out, progress(frames, "drawing", len(captured.times)), captured.fps, captured.times)
    return f"{said} drawings play {parts}"


COMMANDS: tuple[Callable[..., str], ...] = (demo, fixtures, suggest, capture, contour, overlay, retarget)


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; 0 when it worked, 2 with one sentence when something given could not be used."""
    app = App(
        name="tooncap",
        help="Capture the motion of a cartoon and lend it to another drawing.",
        version_flags=["--version"],
        default_parameter=Parameter(negative=()),
    )
    for command in COMMANDS:
        app.command(command)
    from capture.errors import InputError

    try:
        not_shadowed()
        said = app(arguments, exit_on_error=False, print_error=False, result_action="return_value")
    except (InputError, CycloptsError) as error:
        print(f"tooncap: {one_line(error)}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("tooncap: interrupted; nothing half-written is left", file=sys.stderr)
        return 130
    if said:
        print(said)
    return 0


if __name__ == "__main__":
    sys.exit(main())
