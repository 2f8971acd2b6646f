"""Commands from a clip to a motion: choose the keys, capture, and prove it."""

from pathlib import Path
from typing import TYPE_CHECKING

from retarget.commands import flags
from retarget.console import Out, device_needs_refine, shot_of, stem, tell, told

if TYPE_CHECKING:
    from numpy.typing import NDArray

FILLED = 0.4  # of a box: a layer that takes up less of it may have been cut through


def suggest(
    source: Path,
    out: Out = None,
    *,
    box: flags.Box = None,
    color: flags.Color = None,
    frame: flags.Seen = None,
    name: flags.Name = "character",
    residual: float = 1.0,
    keys: flags.Keys = 8,
    start: int = 0,
    stop: flags.Stop = None,
    fps: flags.PictureRate = None,
    tile: flags.Tile = None,
) -> str:
    """Find the key drawings of a clip, and write them into a shot file that can be captured.

    Parameters
    ----------
    source
        A clip: mp4, mkv, webm, gif, apng, webp, a folder of pictures, a sprite sheet; or a *.shot.toml of one part.
    out
        The shot file; NAME.shot.toml beside you if not given.  NAME.keys.png and NAME.residual.png come with it.
    residual
        How many pixels a drawing may be off what the keys can redraw.
    start
        The first frame to look at.
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
    _tell_of_box(box, followed.points[(start if frame is None else frame) - shot.start])
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
    box: flags.Box = None,
    color: flags.Color = None,
    frame: flags.Seen = None,
    name: flags.Name = "character",
    start: int = 0,
    stop: flags.Stop = None,
    fps: flags.PictureRate = None,
    tile: flags.Tile = None,
    refine: flags.Refine = False,
    device: flags.Device = "auto",
    again: bool = False,
) -> str:
    """Capture the motion of a shot, or straight of a clip with --box or --color.

    A capture that was interrupted goes on from where it was when the same command is given again.  With --again only
    what was changed in the shot since the last capture is tracked, from key to key; the rest stays as it is.

    Parameters
    ----------
    source
        A *.shot.toml, or a clip: mp4, mkv, webm, gif, apng, webp, a folder of pictures, a sprite sheet.
    out
        The motion file; NAME.motion.json beside you if not given.
    start
        The first frame to capture.
    again
        Track only what was changed since OUT was captured: keys added, moved or removed.
    """
    from capture.errors import InputError
    from capture.fit import again as captures
    from capture.fit import batch, video
    from capture.motion import tracks
    from capture.pictures.shot import write_shot

    shot = shot_of(source, name, box, color, frame, start, stop, fps, tile)
    device_needs_refine(refine, device)
    out = out or Path(stem(source) + ".motion.json")
    clip = told(video.open_clip(shot))
    if again and refine:
        raise InputError("--again is of a stretch, --refine of the whole clip: give one of the two")
    if again:
        motion, done = captures.capture_again_to(out, shot, clip)
    else:
        motion, done = batch.capture_to(out, shot, clip, refine, device), ""
    said = f"{out}: {tracks.summary(motion, shot.start)}" + (f"; {done}" if done else "")
    _tell_of_box(box, motion.outline(motion.tracks[0].part)[(start if frame is None else frame) - shot.start])
    if not source.name.endswith(".toml"):
        beside = out.with_name(stem(out) + ".shot.toml")
        write_shot(shot, beside)
        said += f"; the shot is in {beside}"
    return said


def _tell_of_box(box: tuple[float, float, float, float] | None, outline: "NDArray") -> None:
    """Say when most of a box that was drawn round the layer has not been taken for it: the box may cut through it."""
    if box is None:
        return
    (x, y), (right, bottom) = outline.min(axis=0), outline.max(axis=0)
    width, height = right - x, bottom - y
    if width * height < FILLED * box[2] * box[3]:
        tell(
            [
                f"of the box only {width:.0f} x {height:.0f} pixels at {x:.0f}, {y:.0f} are taken for the layer: if it "
                "is more than that, draw the box wider, with background on all sides, or give --color"
            ]
        )


def contour(
    source: Path,
    out: Out = None,
    *,
    name: flags.Name = "character",
    residual: float = 1.0,
    keys: flags.Keys = 8,
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
    residual
        How many pixels the chosen keys may leave in any frame.
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
    low, high = outlines.min(axis=(0, 1)), outlines.max(axis=(0, 1))
    room = low.clip(16, 16 + 0.5 * (high - low))  # as much beyond as before: new drawings may be wider than a line
    size = tuple(int(edge) for edge in high.clip(1) + room)
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
