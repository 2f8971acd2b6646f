"""Which part of a frame moves: a box to begin with, for who cannot or would not draw one.

What is at a place in this frame and in few others was there only for now.  Where something stands for half of a clip and
then leaves, half of the frames differ there, and far fewer where it only passes: so what counts is how many differ.
"""

import numpy as np
from numpy.typing import NDArray

LOOKED_AT = 13  # frames of the clip
WIDE = 320  # pixels across: a box needs no more
DIFFERS = 24  # of 255, in the channel that differs most
SOME = 0.15  # of the frames must differ at a place that moves
MARGIN = 0.06  # of the box, for its rim


def box(frames: list[NDArray], here: NDArray) -> tuple[float, float, float, float] | None:
    """x, y, width and height of what moves in the picture `here` (H, W, 3), against others of its clip; None if nothing does."""
    import cv2

    height, width = here.shape[:2]
    zoom = min(1.0, WIDE / width)
    size = max(1, round(width * zoom)), max(1, round(height * zoom))
    small = [
        cv2.GaussianBlur(cv2.resize(one[..., :3], size, interpolation=cv2.INTER_AREA), (3, 3), 0) for one in frames
    ]
    now = cv2.GaussianBlur(cv2.resize(here[..., :3], size, interpolation=cv2.INTER_AREA), (3, 3), 0).astype(int)
    if not small:
        return None
    share = np.mean([np.abs(now - one).max(axis=-1) > DIFFERS for one in small], axis=0)
    most = float(np.percentile(share, 99.5))
    if most < SOME:
        return None
    mask = cv2.morphologyEx((share >= most / 2).astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    mask = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, np.ones((9, 9), np.uint8))
    count, _, stats, _ = cv2.connectedComponentsWithStats(mask)
    if count < 2:
        return None
    parts = stats[1:]
    near = parts[parts[:, cv2.CC_STAT_AREA] >= parts[:, cv2.CC_STAT_AREA].max() / 5]
    low = near[:, :2].min(axis=0)
    high = (near[:, :2] + near[:, 2:4]).max(axis=0)
    rim = np.maximum(MARGIN * (high - low), 2)
    low, high = np.maximum(low - rim, 0) / zoom, np.minimum(high + rim, size) / zoom
    x, y, w, h = (round(float(v), 1) for v in (*low, *(np.minimum(high, (width, height)) - low)))
    return x, y, w, h
