"""The bow tie of *Copying is not theft* (Nina Paley): a jaw opens over it, a tongue has its colour, ink touches ink.

The user's part is one outline drawn round the tie in frame 128.  The masks show only what is in sight of its red: where
they are as wide as the tie, their middle is the tie's; where the jaw hides one lobe, only the other end is known.
"""

import json
from pathlib import Path

import numpy as np
import pytest

from capture.fit import video
from capture.motion.tracks import CartoonMotion
from capture.pictures import overlay
from capture.pictures.clip import Clip
from capture.pictures.encode import write_picture
from capture.pictures.shot import KeyDrawing, Part, Shot

FIRST, STOP = 128, 205
WIDE = 60  # pixels of the tie's 73 that a mask must span to show both its ends
PIECE = 20  # and to show one of them; what is smaller may be any piece of it
# fmt: off
OUTLINE = (
    (420.0, 215.0), (425.0, 211.7), (438.3, 215.0), (446.7, 220.7), (454.3, 218.3), (462.3, 220.7), (471.7, 213.3),
    (486.7, 205.0), (494.3, 208.3), (496.7, 223.3), (495.0, 236.7), (486.7, 240.0), (473.3, 235.0), (462.3, 228.3),
    (455.0, 233.3), (446.7, 229.3), (441.7, 238.3), (430.0, 240.0), (421.7, 233.3), (419.0, 223.3),
)
# fmt: on


@pytest.fixture(scope="module")
def clip(data: Path) -> Clip:
    return video.open_clip(_shot(data))


@pytest.fixture(scope="module")
def motion(data: Path, clip: Clip) -> CartoonMotion:
    return video.capture(_shot(data), clip)


def test_the_tie_stays_where_it_is_whatever_the_jaw_does(data: Path, motion: CartoonMotion):
    low, high = _boxes(data)
    outline = motion.outline("tie")
    whole = high[:, 0] - low[:, 0] > WIDE
    middle = 0.5 * (outline.min(axis=1) + outline.max(axis=1))
    off = np.linalg.norm(middle - 0.5 * (low + high), axis=1)[whole]
    beyond = outline.max(axis=1)[:, 0] - high[:, 0]  # the outline lies round the ink, the mask within it
    ends = np.abs(beyond - beyond[0])[~whole & (high[:, 0] - low[:, 0] > PIECE)]
    print(
        f"\nbow tie: in {whole.sum()} frames both ends are in sight, middle off by median {np.median(off):.1f} px, "
        f"within 4 px in {np.mean(off <= 4):.0%}; in {len(ends)} others one: it is off by median "
        f"{np.median(ends):.1f} px, within 4 px in {np.mean(ends <= 4):.0%}"
    )
    assert np.mean(off <= 4) >= 0.9
    assert np.mean(np.append(off, ends) <= 4) >= 0.9


def test_a_contact_sheet_is_left_to_look_at(clip: Clip, motion: CartoonMotion, sheets: Path):
    pictures = [picture[170:280, 380:530] for picture in overlay.draw_over(clip, motion, FIRST)]
    assert len(pictures) == STOP - FIRST
    write_picture(sheets / "bowtie.png", overlay.contact_sheet(pictures[::2], columns=8, width=220))


def _shot(data: Path) -> Shot:
    tie = Part("tie", (KeyDrawing("rest", FIRST, OUTLINE),))
    return Shot(str(data / "clips" / "copying_is_not_theft" / "copying_is_not_theft.mp4"), (tie,), FIRST, STOP)


def _boxes(data: Path) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest x and y (T, 2) of what the masks show of the tie."""
    told = json.loads((data / "clips" / "copying_is_not_theft" / "bowtie.json").read_text())
    boxes = {one["frame"]: one["bbox"] for one in told}
    x, y, width, height = np.array([boxes[t] for t in range(FIRST, STOP)], float).T
    return np.column_stack([x, y]), np.column_stack([x + width - 1, y + height - 1])
