"""Commands from a motion to a new drawing."""

from dataclasses import replace
from pathlib import Path
from typing import Literal

from retarget.console import Out, stem, tell, told

SIDES = {"front": "xy", "right": "zy", "back": "-xy", "left": "-zy"}  # as casts call them
SLID = 0.5  # pixels that a foot slides: less is not seen, and not told


def retarget(
    motion: Path,
    out: Out = None,
    *,
    cast: Path | None = None,
    drawing: tuple[Path, ...] = (),
    background: str | None = None,
    into: Path | None = None,
    box: tuple[float, float, float, float] | None = None,
    side: Literal["front", "right", "back", "left"] | None = None,
    height: float | None = None,
    size: int | None = None,
    bend: bool = False,
    bridge: bool = False,
    soften: float = 0.0,
    match: float = 0.0,
    shadow: float = 0.0,
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
        Instead of a cast: SVG or PNG files whose names end in the key's name, or a folder of them; or one photograph or
        one 3-D model (GLB, glTF, OBJ, PLY) that plays all keys; or one of them for all parts, drawn in their pose.
    background
        A colour, a picture or a clip behind the character; transparent if not given, white in an mp4.  A clip runs at
        its own rate.
    into
        The *.shot.toml that was captured: the character takes the place of the layer in its own clip.
    box
        X Y WIDTH HEIGHT round what to cut out of a photograph given with --drawing.
    side
        How a 3-D model given with --drawing is seen: from its front, its back, or its side, looking to the right or the
        left; its front if not given.
    height
        How tall a character given with --drawing is, times the source's height; how far it travels goes with it.
    size
        Width in pixels of what is made; the source's own if not given.
    bend
        Bend the one drawing along a captured line of action.
    bridge
        Show every part in every frame, also what the capture has lost; without it only limbs that pass behind their
        body, and with --into not even those.
    soften
        Before a background: pixels that the character's edges are blurred by.
    match
        Before a background: 0 to 1, how far its brightness and colours go to the background's.
    shadow
        Before a background: 0 to 1, how dark a shadow it throws.
    """
    from capture.errors import InputError
    from capture.fit.video import open_clip
    from capture.motion import gaps, tracks
    from capture.pictures.clip import Clip
    from capture.pictures.encode import write_clip
    from capture.pictures.shot import read_shot
    from capture.progress import progress, working
    from retarget.characters.casts import cast as casting
    from retarget.characters.casts.backdrop import read_background
    from retarget.characters.casts.castcheck import BEND
    from retarget.characters.casts.castfile import read_cast
    from retarget.characters.casts.castlist import Cast, CastPart
    from retarget.characters.models.meshfiles import MODELS
    from retarget.characters.target import parts_of
    from retarget.export import formats
    from retarget.stage import composite, draw2d, plate
    from retarget.stage.direct import direct
    from retarget.stage.folds import folds
    from retarget.stage.page import beyond
    from retarget.stage.perform import perform

    captured = tracks.load(motion)
    out = out or Path(stem(motion) + ".retarget.mp4")
    if table := formats.table(out):
        table(captured, out)
        return f"{out}: {tracks.summary(captured)}"
    if (cast is None) == (not drawing):
        raise InputError("a retarget needs either --cast FILE or --drawing FILES, to say who plays")
    if box is not None and cast is not None:
        raise InputError("--box cuts out the photograph given with --drawing; a cast says box = [...] itself")
    if side is not None and (cast is not None or any(file.suffix.lower() not in MODELS for file in drawing)):
        raise InputError('--side says how a 3-D model given with --drawing is seen; a cast says plane = "zy" itself')
    if height is not None and (cast is not None or not 0 < height < float("inf")):
        raise InputError(f"--height must be above 0, and is for --drawing; a cast says it itself: got {height:g}")
    if bend and (cast is not None or len(drawing) != 1 or len(captured.tracks) != 1):
        raise InputError('--bend needs one --drawing and a motion of one part; a cast says between = "bend" itself')
    if bend:
        part = CastPart(captured.tracks[0].part, drawing=str(drawing[0]), between=BEND)
        chosen = Cast((part,))
    else:
        chosen = read_cast(cast) if cast is not None else casting.cast_of(list(drawing), captured)
    flags = (("box", box), ("plane", SIDES.get(side)), ("height", height))
    told_here = {name: value for name, value in flags if value is not None}
    parts, bodies = (tuple(replace(one, **told_here) for one in ones) for ones in (chosen.parts, chosen.bodies))
    chosen = replace(chosen, parts=parts, bodies=bodies)
    lent = gaps.bridged(captured) if bridge else gaps.limbs_bridged(captured) if into is None else captured
    with working("learning the drawings"):
        actors = casting.targets(chosen, lent)
        performance, slid = direct(perform(lent, actors), chosen, lent)
    tell(note for actor in actors for note in getattr(actor, "notes", ()))
    tell(map(str, folds(performance)))
    parts = ", ".join(part for actor in actors for part in parts_of(actor))
    feet = f"; {slid}" if slid is not None and max(slid.before, slid.after) >= SLID else ""
    said = f"{out}: {len(captured.times)} frames at {captured.fps:.4g} a second, new"
    if write := formats.bodies(out):
        with working("meshing the drawings"):
            write(performance, out)
        return f"{said} bodies play {parts}{feet}"
    over = beyond(performance, captured)
    done = f"{said} drawings play {parts}{feet}{f'; {over}' if over else ''}"
    drawings = formats.drawings(out)
    if drawings and (into is not None or any((soften, match, shadow))):
        raise InputError(
            f"--into, --soften, --match and --shadow make pictures, {out.name} holds drawings: ask for a video"
        )
    blend = composite.Blend(soften, match, shadow)
    if into is not None:
        if background is not None:
            raise InputError("--into says what is behind the character, the shot's own clip: leave --background out")
        shot = read_shot(into)
        clip = told(open_clip(shot))
        with working("finding what was behind the layer"):
            frames = plate.into(performance, shot, captured, clip, size, blend)
    else:
        behind = casting.backdrop(chosen) if background is None else read_background(background)
        if isinstance(behind, Clip):
            told(behind)
            if behind.edges[-1] < captured.times[-1]:
                tell([f"{behind.path}: it ends after {behind.edges[-1]:.2f} s, its last frame stays behind the rest"])
        if drawings:
            if isinstance(behind, Clip):
                raise InputError(
                    f"a moving background needs a video, {out.name} holds drawings: give a colour or a picture"
                )
            with working("writing the drawings"):
                drawings(performance, out, size, behind)
            return done
        if blend == composite.Blend():
            frames = draw2d.draw_frames(performance, behind, size)
        elif behind is None:
            raise InputError("--soften, --match and --shadow need something behind the character: add --background")
        else:
            frames = composite.over(performance, behind, size, blend)
    write_clip(out, progress(frames, "drawing", len(captured.times)), captured.fps, captured.times)
    return done
