"""The main job on a built-in cartoon: a frog jumps, is captured, and a bunny jumps like it."""

from pathlib import Path

import numpy as np

from capture.fit import video
from capture.motion import tracks
from capture.motion.tracks import CartoonMotion
from capture.pictures import overlay
from capture.pictures.encode import over, write_clip, write_picture
from capture.pictures.shot import read_shot
from capture.progress import progress, working
from fixtures import frog, write
from fixtures.toon import Toon
from retarget.characters import cast as casting
from retarget.characters import castfile
from retarget.export.tables import write_csv
from retarget.stage import draw2d, staging
from retarget.stage.perform import perform

PAPER = (236, 240, 232)  # behind the bunny where there is no alpha


def demo(folder: Path) -> str:
    """Draw the frog's clip, capture it, and lend its motion to the bunny; everything lands in `folder`.

    Leaves demo.mp4 (source | proof | new drawing), contact_sheet.png, frog.motion.json and frog.csv, and beside them
    the clip, the shot and cast files, the misfit plot and the bunny alone with alpha.  Returns the closing line.
    """
    toon = frog.frog()
    shot = read_shot(write.write_toon(toon, folder))
    clip = video.open_clip(shot)
    motion = video.capture(shot, clip)
    tracks.save(motion, folder / "frog.motion.json")
    write_csv(motion, folder / "frog.csv")
    overlay.residual_plot(motion, folder / "misfit.png")

    drawings = [path for path in write.write_characters(folder / "characters") if path.stem.startswith("bunny_")]
    cast = casting.cast_of(drawings, motion)
    castfile.write_cast(cast, folder / "bunny.cast.toml")
    with working("learning the bunny"):
        performance = staging.stand(perform(motion, casting.targets(cast, motion)), motion)
    bunny = list(progress(draw2d.draw_frames(performance), "drawing the bunny", len(clip)))
    write_clip(folder / "bunny.webm", progress(bunny, "writing bunny.webm", len(clip)), motion.fps)

    proof = list(overlay.draw_over(clip, motion))
    drawn = [over(frame, PAPER) for frame in bunny]
    rows = overlay.side_by_side(zip(clip, proof, drawn))
    write_clip(folder / "demo.mp4", progress(rows, "writing demo.mp4", len(clip)), motion.fps)
    shown = np.linspace(0, len(clip) - 1, 12).round().astype(int)
    pairs = list(overlay.side_by_side([(proof[t], drawn[t]) for t in shown]))
    write_picture(folder / "contact_sheet.png", overlay.contact_sheet(pairs, columns=3, width=640))
    off = np.median(point_errors(motion, toon))
    return f"{tracks.summary(motion)}; the outline is {off:.2f} px from the drawn truth; look at {folder}/demo.mp4"


def point_errors(motion: CartoonMotion, toon: Toon) -> np.ndarray:
    """Distances in pixels (T, N) of a one-part cartoon's captured outline from the one that was drawn."""
    part = toon.parts[0]
    return np.linalg.norm(motion.points(part.name)[:, : part.points.shape[1]] - part.points, axis=-1)
