"""Memory does not grow with a clip's length: what a frame leaves behind is a pose, not a picture."""

import tracemalloc

import cv2
import numpy as np

from capture.fit import video
from capture.motion.tracks import CartoonMotion
from capture.pictures.clip import Clip, remembering
from capture.pictures.shot import KeyDrawing, Part, Shot

SIZE = (120, 90)
POSE_BYTES = 2_000  # a frame's share of tables and tracks, generously
DRAWN_EVERY = 8  # frames: most are held, which makes the clip cheap; memory is the same
CORNERS = np.array([[-17.0, -12], [17, -12], [17, 4], [4, 12], [-17, 12]])


def where(t: int) -> np.ndarray:
    """The middle of the blob: it goes round for ever."""
    angle = 0.35 * (t // DRAWN_EVERY)
    return np.array([60 + 25 * np.cos(angle), 45 + 18 * np.sin(angle)])


def draw(t: int) -> np.ndarray:
    picture = np.full((SIZE[1], SIZE[0], 3), (235, 235, 220), np.uint8)
    for colour, scale in (((40, 110, 60), 1.0), ((220, 190, 60), 0.4)):
        corners = np.rint((where(t) + scale * CORNERS) * 16).astype(np.int32)
        cv2.fillPoly(picture, [corners], colour, cv2.LINE_AA, 4)
    return picture


def long_clip(frames: int) -> Clip:
    """A clip that is drawn as it is asked for."""
    edges = np.arange(frames + 1) / 24
    return Clip("drawn by formula", SIZE, 24.0, edges, False, (), remembering(draw, SIZE))


def shot(frames: int) -> Shot:
    """A key in the middle, so that the clip is gone through in both directions, and two parts that look for it."""
    key = KeyDrawing("middle", frames // 2, tuple(map(tuple, (where(frames // 2) + CORNERS).tolist())))
    return Shot("", (Part("blob", (key,)), Part("twin", (key,))))


def peak_of(frames: int) -> tuple[int, CartoonMotion]:
    """The most bytes in use at a time during a capture, and what came of it."""
    clip = long_clip(frames)
    tracemalloc.start()
    try:
        motion = video.capture(shot(frames), clip)
        return tracemalloc.get_traced_memory()[1], motion
    finally:
        tracemalloc.stop()


def test_four_times_the_frames_need_no_more_than_their_poses():
    video.capture(shot(16), long_clip(16))  # what is loaded once
    short, _ = peak_of(250)
    long, motion = peak_of(1000)
    print(f"\npeak {short / 2**20:.2f} MiB for 250 frames, {long / 2**20:.2f} MiB for 1000")
    assert long - short < 750 * POSE_BYTES < 750 * draw(0).nbytes
    off = motion.outline("blob").mean(axis=1) - motion.outline("blob")[500].mean(axis=0)
    assert np.abs(off - [where(t) - where(500) for t in range(1000)]).max() < 0.5
