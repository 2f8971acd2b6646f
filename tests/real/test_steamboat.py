"""The left smokestack of Steamboat Willie (1928), frames 33-107, lent to a bottle."""

import json
from pathlib import Path

import numpy as np
import pytest
from skimage.io import imread

from capture.fit import video
from capture.motion.tracks import CartoonMotion
from capture.pictures import matte, overlay
from capture.pictures.clip import Clip
from capture.pictures.encode import write_clip, write_picture
from capture.pictures.shot import KeyDrawing, Part, Shot
from retarget.characters.casts import cast as casting
from retarget.stage import draw2d
from retarget.stage.perform import Performance, perform

FIRST, STOP = 33, 108
MASKED = 290  # the masks end at this row, the stack stands on the deck a few pixels lower


@pytest.fixture(scope="module")
def clip(data: Path) -> Clip:
    return video.open_clip(_shot(data))


@pytest.fixture(scope="module")
def motion(data: Path, clip: Clip) -> CartoonMotion:
    return video.capture(_shot(data), clip)


@pytest.fixture(scope="module")
def bottle(data: Path, motion: CartoonMotion) -> Performance:
    drawing = data / "drawings" / "openclipart" / "bottle_jean_victor_balin_.svg"
    return perform(motion, casting.targets(casting.cast_of(drawing, motion), motion))


def test_the_stack_is_followed_through_smoke(data: Path, motion: CartoonMotion):
    overlaps = {t: _overlap(data, motion, t) for t in _clear_frames(data)}
    worst = min(overlaps, key=overlaps.get)
    print(
        f"\nsteamboat: {len(overlaps)} frames free of smoke, overlap with the mask median "
        f"{np.median(list(overlaps.values())):.3f}, least {overlaps[worst]:.3f} at frame {worst}"
    )
    assert motion.tracks[0].visible.all()
    assert np.median(list(overlaps.values())) > 0.9
    assert overlaps[worst] > 0.8


def test_the_bottle_rises_and_sinks_with_the_stack_and_stays_on_the_deck(data: Path, bottle: Performance):
    ink = np.array([_box(draw2d.draw(bottle, t - FIRST)[..., 3] > 127) for t in _clear_frames(data)])
    stack = np.array([_box(_mask(data, t)) for t in _clear_frames(data)])
    off, foot = np.abs(ink[:, 1] - stack[:, 1]), ink[1:, 3]  # in the first frame the box, not the deck, is the foot
    print(
        f"\nbottle: its top is off the stack's by median {np.median(off):.1f} px, worst {off.max():.1f}, while that "
        f"travels {np.ptp(stack[:, 1]):.0f} px; its foot stays within {np.ptp(foot):.1f} px"
    )
    assert np.corrcoef(ink[:, 1], stack[:, 1])[0, 1] > 0.995
    assert np.median(off) <= 2
    assert np.ptp(foot) <= 5


def test_a_contact_sheet_is_left_to_look_at(clip: Clip, motion: CartoonMotion, bottle: Performance, sheets: Path):
    drawn = list(draw2d.draw_frames(bottle, "#c9c9c0"))
    proof = list(overlay.draw_over(clip, motion))
    pairs = list(overlay.side_by_side((p[60:320, 230:430], d[60:320, 230:430]) for p, d in zip(proof, drawn)))
    assert len(pairs) == STOP - FIRST
    write_picture(sheets / "steamboat_bottle.png", overlay.contact_sheet(pairs[::4], columns=7, width=300))
    write_clip(sheets / "steamboat_bottle.mp4", pairs, motion.fps)


def _shot(data: Path) -> Shot:
    stack = Part("stack", (KeyDrawing("rest", FIRST),), box=(300, 192, 44, 99))
    return Shot(str(data / "clips" / "steamboat_willie" / "steamboat_willie.mp4"), (stack,), FIRST, STOP)


def _clear_frames(data: Path) -> list[int]:
    """Frames of the clip whose left mask holds the stack alone, without smoke."""
    told = json.loads((data / "clips" / "steamboat_willie" / "stack_masks.json").read_text())
    clear = {frame["frame"] for frame in told for part in frame["parts"] if _is_left(part)}
    return [t for t in range(FIRST, STOP) if t in clear]


def _is_left(part: dict) -> bool:
    x, _, width, _ = part["bbox"]
    return x + width / 2 < 345 and not part["merged_with_smoke"]


def _mask(data: Path, frame: int) -> np.ndarray:
    return imread(data / "clips" / "steamboat_willie" / "masks" / f"{frame:04d}.png") == 100


def _box(mask: np.ndarray) -> tuple[float, float, float, float]:
    """Least and greatest x and y of a mask, as x0, y0, x1, y1."""
    y, x = np.nonzero(mask)
    return x.min(), y.min(), x.max(), y.max()


def _overlap(data: Path, motion: CartoonMotion, frame: int) -> float:
    outline = motion.outline("stack")[frame - FIRST]
    solid, mask = matte.fill(motion.size, outline) > 0, _mask(data, frame)
    solid[MASKED:] = False
    return (solid & mask).sum() / (solid | mask).sum()
