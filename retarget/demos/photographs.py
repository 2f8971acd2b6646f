"""A motion lent to a photograph, which is laid over a moving background."""

from pathlib import Path

import numpy as np

from capture.pictures.clip import clip_of
from capture.pictures.encode import write_clip, write_picture
from capture.progress import progress
from fixtures import broom, dining_car
from retarget.characters.casts.castlist import Cast, CastKey, CastPart
from retarget.demos.shown import Shown, captured, leave, played, point_errors
from retarget.stage import composite

CUP = (70.0, 10.0, 420.0, 380.0)  # x, y, width, height round the cup and its saucer in the photograph


def broom_to_photograph(folder: Path, zoom: float = 1.0) -> Shown:
    """A broom dances, bent in three key drawings; a photographed cup dances like it in a train (figure 12)."""
    from skimage import data

    toon, _, clip, motion = captured(broom.broom(), folder, zoom)
    write_picture(folder / "coffee.png", data.coffee())
    behind = clip_of(np.stack(list(dining_car.going_by(len(clip)))), clip.fps)
    write_clip(folder / "dining_car.mp4", progress(behind, "drawing the background", len(behind)), behind.fps)
    keys = tuple(CastKey(key) for key in broom.KEYS)
    cast = Cast((CastPart("broom", keys, str(folder / "coffee.png"), height=0.75, box=CUP),))
    performance = played(cast, motion, folder / "coffee.cast.toml")
    blend = composite.Blend(soften=0.6, shadow=0.5)
    made = list(progress(composite.over(performance, behind, blend=blend), "drawing", len(clip)))
    shown = Shown(clip, made, motion, performance, float(np.median(point_errors(motion, toon))))
    leave(shown, folder)
    return shown
