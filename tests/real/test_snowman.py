"""The snowman's hat (Noto Animated Emoji), lent to a top hat; the clip's own vertices are the truth."""

from pathlib import Path

import numpy as np
import pytest

from capture.motion import affine
from capture.motion.tracks import CartoonMotion
from capture.pictures import overlay
from capture.pictures.clip import Clip
from capture.pictures.encode import write_clip, write_picture
from retarget.characters.casts import cast as casting
from retarget.stage import draw2d
from retarget.stage.perform import perform


@pytest.fixture
def clip(snowman_clip: Clip) -> Clip:
    return snowman_clip


@pytest.fixture
def motion(snowman_hat: CartoonMotion) -> CartoonMotion:
    return snowman_hat


def test_the_hat_is_followed(data: Path, motion: CartoonMotion):
    truth = _crown(data)
    track = motion.tracks[0]
    captured = affine.apply(affine.about(track.affine, track.pivot), truth[0])
    off = np.linalg.norm(captured - truth, axis=-1)
    # an affine map cannot follow the hat's bending: what the best one would leave, from the truth itself
    best = affine.apply(affine.fit(truth[0], truth), truth[0])
    least = np.linalg.norm(best - truth, axis=-1)
    print(
        f"\nsnowman's hat against gt.npz, crown and band: median {np.median(off):.2f} px, p95 "
        f"{np.percentile(off, 95):.2f}, worst {off.max():.2f}; the best affine map leaves median "
        f"{np.median(least):.2f}, p95 {np.percentile(least, 95):.2f}, worst {least.max():.2f}"
    )
    assert track.visible.all()
    assert np.median(off) < 1.0
    assert np.percentile(off, 95) < 6.0


def test_a_contact_sheet_is_left_to_look_at(data: Path, clip: Clip, motion: CartoonMotion, sheets: Path):
    drawing = data / "drawings" / "openclipart" / "tophat_benji_park_01.svg"
    performance = perform(motion, casting.targets(casting.cast_of(drawing, motion), motion))
    drawn = list(draw2d.draw_frames(performance, clip))  # over the source itself
    proof = list(overlay.draw_over(clip, motion))
    pairs = list(overlay.side_by_side((p[:300], d[:300]) for p, d in zip(proof, drawn)))
    assert len(pairs) == len(clip)
    write_picture(sheets / "snowman_tophat.png", overlay.contact_sheet(pairs[::5], columns=4, width=480))
    write_clip(sheets / "snowman_tophat.mp4", pairs, motion.fps)


def _crown(data: Path) -> np.ndarray:
    """The vertices (T, n, 2) of the hat's paths that are in sight: the band, and the crown above the brim."""
    truth = np.load(data / "clips" / "noto_snowman_hat" / "gt.npz")
    band, hat = truth["path/4:hat/0"][:, 0], truth["path/4:hat/1"][:, 0]
    crown = hat[:, hat[0, :, 1] < band[0, :, 1].max()]
    return np.concatenate([band, crown], axis=1)
