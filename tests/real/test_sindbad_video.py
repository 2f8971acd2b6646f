"""Sindbad's torso in the film itself (Fleischer 1936): arms pass before it, it turns, grain and a painted background.

The user's part is three outlines, here those of the colour masks in three frames out of 33.
"""

from pathlib import Path

import numpy as np
import pytest
from skimage.io import imread

from capture.fit import video
from capture.fit.curves import correspond
from capture.motion.tracks import CartoonMotion
from capture.pictures import contours, matte, overlay
from capture.pictures.clip import Clip
from capture.pictures.encode import write_picture
from capture.pictures.shot import KeyDrawing, Part, Shot

FIRST, STOP = 308, 341
KEYS = (308, 320, 335)  # every thirteen frames or so
EARLIEST = 300  # the number of the folder's first frame


@pytest.fixture(scope="module")
def shot(data: Path) -> Shot:
    traced = contours.contours_of_mattes([_mask(data, t).astype(float) for t in KEYS])
    outlines = correspond.align_all(traced, 90)
    drawn = [KeyDrawing(f"pose {t}", t - EARLIEST, tuple(map(tuple, o.tolist()))) for t, o in zip(KEYS, outlines)]
    frames = data / "clips" / "sindbad_dance" / "frames"
    return Shot(str(frames), (Part("torso", tuple(drawn)),), FIRST - EARLIEST, STOP - EARLIEST, fps=24)


@pytest.fixture(scope="module")
def clip(shot: Shot) -> Clip:
    return video.open_clip(shot)


@pytest.fixture(scope="module")
def motion(shot: Shot, clip: Clip) -> CartoonMotion:
    return video.capture(shot, clip)


def test_the_torso_is_followed_in_the_film(data: Path, motion: CartoonMotion):
    masks = [_mask(data, t) for t in range(FIRST, STOP)]
    alike = np.array([_overlap(matte.fill(motion.size, o) > 0, m) for o, m in zip(motion.outline("torso"), masks)])
    print(
        f"\nSindbad's torso in the film: overlap with the masks median {np.median(alike):.2f}, a tenth below "
        f"{np.percentile(alike, 10):.2f}, least {alike.min():.2f}; {np.sum(alike < 0.5)} frames below a half"
    )
    assert np.median(alike) >= 0.8
    assert np.percentile(alike, 10) >= 0.7


def test_a_contact_sheet_is_left_to_look_at(clip: Clip, motion: CartoonMotion, sheets: Path):
    pictures = list(overlay.draw_over(clip, motion, FIRST - EARLIEST))
    assert len(pictures) == STOP - FIRST
    write_picture(sheets / "sindbad_video.png", overlay.contact_sheet(pictures[::2], columns=6, width=320))


def _mask(data: Path, frame: int) -> np.ndarray:
    return imread(data / "clips" / "sindbad_dance" / "mask_torso" / f"{frame:05d}.png") > 127


def _overlap(one: np.ndarray, other: np.ndarray) -> float:
    return float((one & other).sum() / (one | other).sum())
