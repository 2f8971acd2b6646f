"""The hopping rabbit (Noto Animated Emoji) in the video: head and body in one pass, one grey, the head before the body.

The user's part is one outline of the head and eight of the body; everything else is seen in the pictures.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from capture.fit import video
from capture.fit.suggest import Suggestion
from capture.motion.tracks import CartoonMotion
from capture.pictures import matte, overlay
from capture.pictures.clip import Clip
from capture.pictures.encode import write_picture
from capture.pictures.shot import KeyDrawing, Part, Shot


@pytest.fixture(scope="module")
def head(rabbit_curve: Callable[[str], np.ndarray]) -> np.ndarray:
    return rabbit_curve("path/6:Head/0")


@pytest.fixture(scope="module")
def shot(data: Path, head: np.ndarray, rabbit_body: np.ndarray, rabbit_keys: Suggestion) -> Shot:
    keys = tuple(KeyDrawing(f"pose {t}", int(t), _outline(rabbit_body[t])) for t in rabbit_keys.key_frames)
    parts = (
        Part("body", keys, order=0),
        Part("head", (KeyDrawing("rest", 0, _outline(head[0])),), parent="body", order=1),
    )
    return Shot(str(data / "clips" / "noto_rabbit_hop" / "frames"), parts, fps=30)


@pytest.fixture(scope="module")
def clip(shot: Shot) -> Clip:
    return video.open_clip(shot)


@pytest.fixture(scope="module")
def motion(shot: Shot, clip: Clip) -> CartoonMotion:
    return video.capture(shot, clip)


def test_the_head_is_followed_to_a_pixel(motion: CartoonMotion, head: np.ndarray):
    off = np.linalg.norm(motion.points("head")[:, : head.shape[1]] - head, axis=-1)
    median, most = np.percentile(off, [50, 95])
    print(f"\nrabbit's head in the video: median {median:.2f} px, p95 {most:.2f}, worst {off.max():.2f}")
    assert motion.track("head").visible.all()
    assert median <= 1.0
    assert most <= 3.0


def test_the_body_is_followed_beneath_the_head(motion: CartoonMotion, rabbit_body: np.ndarray):
    alike = [_overlap(motion.size, seen, true) for seen, true in zip(motion.outline("body"), rabbit_body)]
    print(f"\nrabbit's body in the video: overlap with the truth median {np.median(alike):.3f}, least {min(alike):.3f}")
    assert np.median(alike) >= 0.93
    assert min(alike) >= 0.8


def test_a_contact_sheet_is_left_to_look_at(clip: Clip, motion: CartoonMotion, sheets: Path):
    pictures = list(overlay.draw_over(clip, motion))
    assert len(pictures) == len(clip)
    write_picture(sheets / "rabbit_video.png", overlay.contact_sheet(pictures[::2], columns=5, width=300))


def _outline(points: np.ndarray) -> tuple[tuple[float, float], ...]:
    return tuple(map(tuple, points.tolist()))


def _overlap(size: tuple[int, int], one: np.ndarray, other: np.ndarray) -> float:
    first, second = (matte.fill(size, outline) > 0 for outline in (one, other))
    return float((first & second).sum() / (first | second).sum())
