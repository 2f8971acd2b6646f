"""What every demo does alike: its cartoon is drawn and captured, a cast plays it, and both are left side by side."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capture.files import written_beside
from capture.fit import video
from capture.motion import tracks
from capture.motion.tracks import CartoonMotion
from capture.pictures import overlay
from capture.pictures.clip import Clip
from capture.pictures.encode import write_clip, write_picture
from capture.pictures.shot import Shot, read_shot, write_shot
from capture.progress import progress, working
from fixtures import variants, write
from fixtures.toon import Toon
from retarget.characters.casts import cast as casting
from retarget.characters.casts import castfile
from retarget.characters.casts.castlist import Cast
from retarget.stage import draw2d, staging
from retarget.stage.perform import Performance, perform

ON_SHEET, ON_STRIP = 12, 7  # frames


@dataclass(frozen=True, eq=False)
class Shown:
    """A demo that was played: T frames of the source and of what was made of it."""

    source: Sequence[NDArray]  # T pictures (H, W, 3) uint8
    made: Sequence[NDArray]  # T pictures (H, W, 3) uint8
    motion: CartoonMotion
    performance: Performance
    off: float  # pixels: the median distance of what was captured from what was drawn
    also: str = ""  # a figure more


def captured(
    toon: Toon, folder: Path, zoom: float = 1.0, lossless: bool = False
) -> tuple[Toon, Shot, Clip, CartoonMotion]:
    """The cartoon, `zoom` times as large, as a clip with its shot in the folder, and the motion captured from it.

    The clip is an mp4, and `lossless` a folder of PNG beside it, which is captured instead.
    """
    toon = toon if zoom == 1 else variants.zoomed(toon, zoom)
    frames = write.clip_in_memory(toon)
    path = write.write_toon(toon, folder, frames)
    if lossless:
        write_clip(folder / toon.name, frames, toon.fps)
        write_shot(replace(read_shot(path), clip=str(folder / toon.name), fps=toon.fps), path)
    shot = read_shot(path)
    clip = video.open_clip(shot)
    motion = video.capture(shot, clip)
    tracks.save(motion, folder / f"{toon.name}.motion.json")
    return toon, shot, clip, motion


def played(cast: Cast, motion: CartoonMotion, path: Path) -> Performance:
    """The motion played by a cast, which is written to `path`; feet stand where the source's do, if it says so."""
    castfile.write_cast(cast, path)
    with working("learning the drawings"):
        performance = perform(motion, casting.targets(cast, motion))
        return staging.stand(performance, motion) if cast.ground else performance


def drawn(performance: Performance, background: Any) -> list[NDArray]:
    """All frames (H, W, 3) before a colour or a picture; one that is held is drawn once."""
    made: list[NDArray] = []
    for t in progress(range(len(performance.times)), "drawing", len(performance.times)):
        held = t > 0 and all(np.array_equal(role.points[t], role.points[t - 1]) for role in performance.roles)
        made.append(made[-1] if held else draw2d.draw(performance, t, background))
    return made


def point_errors(motion: CartoonMotion, toon: Toon) -> NDArray:
    """Distances in pixels (T, N) of the captured outlines of all parts from those that were drawn."""
    errors = []
    for part in toon.parts:
        found = motion.points(part.name)[:, : part.points.shape[1]]
        errors.append(np.linalg.norm(found - part.points, axis=-1))
    return np.concatenate(errors, axis=1)


def leave(shown: Shown, folder: Path) -> None:
    """Write demo.mp4, source | result, and contact_sheet.png."""
    rows = overlay.side_by_side(zip(shown.source, shown.made))
    write_clip(folder / "demo.mp4", progress(rows, "writing demo.mp4", len(shown.made)), shown.motion.fps)
    pairs = list(overlay.side_by_side((shown.source[t], shown.made[t]) for t in spread(shown, ON_SHEET)))
    write_picture(folder / "contact_sheet.png", overlay.contact_sheet(pairs, columns=3, width=640))


def strip(shown: Shown, count: int = ON_STRIP, width: int = 220) -> NDArray:
    """Frames of the source in a row, and under them the same frames of what was made: one picture."""
    frames = spread(shown, count)
    both = [shown.source[t] for t in frames] + [shown.made[t] for t in frames]
    return overlay.contact_sheet(both, columns=count, width=width)


def said(shown: Shown) -> str:
    """How the demo went, in one sentence without its end."""
    also = f"; {shown.also}" if shown.also else ""
    return f"{tracks.summary(shown.motion)}; what was captured is {shown.off:.2f} px from the drawn truth{also}"


def write_text(file: Path, text: str) -> None:
    """A drawing's or a model's file."""
    with written_beside(file) as temporary:
        Path(temporary).write_text(text, encoding="utf-8")


def spread(shown: Shown, count: int) -> list[int]:
    """So many frames, evenly over the clip, the first and the last among them."""
    return np.linspace(0, len(shown.made) - 1, count).round().astype(int).tolist()
