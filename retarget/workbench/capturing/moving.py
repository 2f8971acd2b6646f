"""Which part of a frame moves: a box to begin with, for who cannot or would not draw one.

What is at a place in this frame and in few others is there only for now.  Where something stands for half of a clip and
then leaves, half of the frames differ there, and far fewer where it only passes: so what counts is how many differ.
Where it will stand later most differ too: but there this frame shows the ground, in colours that are elsewhere as well.
"""

import numpy as np
from numpy.typing import NDArray

LOOKED_AT = 13  # frames of the clip
WIDE = 320  # pixels across: a box needs no more
DIFFERS = 24  # of 255, in the channel that differs most
SOME = 0.15  # of the frames must differ at a place that moves
MOST = 0.9  # of the picture: what fills more stands out from nothing
COMMON = 0.004  # of what stays: colours that fill more of it than this are the ground's
MARGIN = 0.06  # of the box, for its rim


def box(frames: list[NDArray], here: NDArray) -> tuple[float, float, float, float] | None:
    """x, y, width and height of what moves in the picture `here` (H, W, 3), against others; None if nothing does."""
    import cv2

    height, width = here.shape[:2]
    zoom = min(1.0, WIDE / width)
    now, others = _small(here, zoom), [_small(one, zoom) for one in frames]
    share = np.mean([np.abs(now - one).max(axis=-1) > DIFFERS for one in others] or [np.zeros(now.shape[:2])], axis=0)
    most = float(np.percentile(share, 99.5))
    if most < SOME:
        return None
    moves = share >= most / 2
    own = moves & ~_like_the_ground(now, share < SOME / 2)
    moves = own if own.sum() > 0.1 * moves.sum() else moves
    mask = cv2.morphologyEx(moves.astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    mask = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, np.ones((9, 9), np.uint8))
    parts = cv2.connectedComponentsWithStats(mask)[2][1:]
    if not len(parts):
        return None
    near = parts[parts[:, cv2.CC_STAT_AREA] >= parts[:, cv2.CC_STAT_AREA].max() / 5]
    low, high = near[:, :2].min(axis=0), (near[:, :2] + near[:, 2:4]).max(axis=0)
    if np.prod(high - low) > MOST * mask.size:
        return None  # a cut, or a camera that moves
    rim = np.maximum(MARGIN * (high - low), 2)
    low, high = np.maximum(low - rim, 0) / zoom, np.minimum((high + rim) / zoom, (width, height))
    x, y, w, h = (round(float(v), 1) for v in (*low, *(high - low)))
    return x, y, w, h


def _small(picture: NDArray, zoom: float) -> NDArray:
    """A picture (h, w, 3) of a few hundred pixels across, as numbers that can be taken from each other."""
    import cv2

    size = max(1, round(picture.shape[1] * zoom)), max(1, round(picture.shape[0] * zoom))
    small = cv2.resize(np.ascontiguousarray(picture[..., :3]), size, interpolation=cv2.INTER_AREA)
    return cv2.GaussianBlur(small, (3, 3), 0).astype(int)


def _like_the_ground(picture: NDArray, stays: NDArray) -> NDArray:
    """Where a picture (h, w, 3) has a colour that much of what stays (h, w) has."""
    coarse = (picture >> 4) @ (256, 16, 1)
    counts = np.bincount(coarse[stays], minlength=4096)
    return (counts > COMMON * max(stays.sum(), 1))[coarse]
