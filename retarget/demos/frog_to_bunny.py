"""The main job on a built-in cartoon: a frog jumps, is captured, and a bunny jumps like it."""

from pathlib import Path

import numpy as np

from capture.motion import tracks
from capture.pictures import overlay
from capture.pictures.encode import write_clip, write_picture
from capture.progress import progress
from fixtures import backdrop, frog, write
from retarget.characters.casts import cast as casting
from retarget.demos.shown import ON_SHEET, Shown, captured, drawn, leave, played, point_errors, spread
from retarget.export.tables import write_csv
from retarget.stage import draw2d

PAPER = (236, 240, 232)  # behind the bunny


def demo(folder: Path) -> str:
    """Draw the frog's clip, capture it, and lend its motion to the bunny; everything lands in `folder`.

    Leaves demo.mp4 (source | proof | new drawing), contact_sheet.png, frog.motion.json and frog.csv, and beside them
    the clip, the shot and cast files, the misfit plot and the bunny alone with alpha.  Returns the closing line.
    """
    shown = _played(folder)
    clip, motion = shown.source, shown.motion
    write_csv(motion, folder / "frog.csv")
    overlay.residual_plot(motion, folder / "misfit.png")
    bunny = draw2d.draw_frames(shown.performance)
    write_clip(folder / "bunny.webm", progress(bunny, "writing bunny.webm", len(clip)), motion.fps)
    proof = list(overlay.draw_over(clip, motion))
    rows = overlay.side_by_side(zip(clip, proof, shown.made))
    write_clip(folder / "demo.mp4", progress(rows, "writing demo.mp4", len(clip)), motion.fps)
    pairs = list(overlay.side_by_side([(proof[t], shown.made[t]) for t in spread(shown, ON_SHEET)]))
    write_picture(folder / "contact_sheet.png", overlay.contact_sheet(pairs, columns=3, width=640))
    off = f"the outline is {shown.off:.2f} px from the drawn truth"
    return f"{tracks.summary(motion)}; {off}; look at {folder}/demo.mp4"


def frog_to_bunny(folder: Path, zoom: float = 1.0) -> Shown:
    """A frog of four key drawings jumps; a bunny drawn in the same four jumps like it (figures 2, 8 and 9)."""
    shown = _played(folder, zoom)
    leave(shown, folder)
    return shown


def _played(folder: Path, zoom: float = 1.0) -> Shown:
    toon, _, clip, motion = captured(frog.frog(), folder, zoom)
    drawings = [path for path in write.write_characters(folder / "characters") if path.stem.startswith("bunny_")]
    performance = played(casting.cast_of(drawings, motion), motion, folder / "bunny.cast.toml")
    made = drawn(performance, backdrop.plain(frog.GROUND, PAPER))
    return Shown(clip, made, motion, performance, float(np.median(point_errors(motion, toon))))
