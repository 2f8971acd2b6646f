"""How the camera moved: a homography from every frame to one of them, or none where it stood still.

Corners are followed from frame to frame outside the layer; what most of them agree on is the camera, if it holds all
over the picture: a large figure before an empty wall has the most corners, and is not the camera.
"""

from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

from capture.pictures.clip import Clip

STOOD = 0.75  # pixels that a corner of the picture may drift in a shot whose camera stands still
GRID = 6  # fields of the picture, each way: the camera moves most of those along its border, or it is no camera
MOST_OF = 0.6  # of the corners, and of the border's fields
CORNERS = 400
MOST_ROOM = 4.0  # times the picture's width, and its height, that a shot's background may take
OFF = 1.5  # pixels that a corner may be off the camera's motion from one frame to the next


def onto_one(clip: Clip, cover: Callable[[int], NDArray]) -> tuple[NDArray, tuple[int, int]]:
    """Maps (T, 3, 3) from the pixels of each frame to a picture that holds them all, and its width and height."""
    maps = homographies(clip, cover)
    if maps is None:
        return np.tile(np.eye(3), (len(clip), 1, 1)), clip.size
    width, height = clip.size
    ends = np.array([[[0, 0], [width - 1, 0], [width - 1, height - 1], [0, height - 1]]], float)
    seen = np.concatenate([cv2.perspectiveTransform(ends, one)[0] for one in maps])
    # a long journey needs more room than there is: what lies far from the middle frame is then made up
    low = np.maximum(np.floor(seen.min(axis=0)), (1 - MOST_ROOM) / 2 * np.array(clip.size))
    high = np.minimum(np.ceil(seen.max(axis=0)), (1 + MOST_ROOM) / 2 * np.array(clip.size))
    shift = np.eye(3)
    shift[:2, 2] = -low
    across, down = (high - low + 1).astype(int)
    return shift @ maps, (int(across), int(down))


def homographies(clip: Clip, cover: Callable[[int], NDArray]) -> NDArray | None:
    """Maps (T, 3, 3) from the pixels of each frame to those of the middle one; None if the camera stood still.

    `cover` gives the mask (H, W) uint8 of what hides the background in a frame.
    """
    steps = [np.eye(3)]
    before = _grey(clip[0])
    for t in range(1, len(clip)):
        now = _grey(clip[t])
        step = _step(now, before, cover(t), cover(t - 1))
        if step is None:
            return None
        steps.append(step)
        before = now
    total = [steps[0]]
    for step in steps[1:]:
        total.append(total[-1] @ step)
    middle = np.linalg.inv(total[len(total) // 2])
    maps = np.array([middle @ one for one in total])
    maps /= maps[:, 2:, 2:]
    width, height = clip.size
    ends = np.array([[[0, 0], [width, 0], [width, height], [0, height]]], float)
    drift = max(np.abs(cv2.perspectiveTransform(ends, one) - ends).max() for one in maps)
    return maps if drift > STOOD else None


def _step(now: NDArray, before: NDArray, hidden: NDArray, hid: NDArray) -> NDArray | None:
    """The map (3, 3) from a frame to the one before; None where nothing tells it."""
    free = 1 - cv2.dilate(hidden | hid, np.ones((15, 15), np.uint8))
    corners = cv2.goodFeaturesToTrack(now, CORNERS, 0.01, 8, mask=free)
    if corners is None or len(corners) < 24:
        return None
    found, good, _ = cv2.calcOpticalFlowPyrLK(now, before, corners, None, winSize=(21, 21), maxLevel=4)
    back, again, _ = cv2.calcOpticalFlowPyrLK(before, now, found, None, winSize=(21, 21), maxLevel=4)
    sure = (good & again).ravel().astype(bool) & (np.abs(back - corners).max(axis=(1, 2)) < 0.5)
    if sure.sum() < 24:
        return None
    cv2.setRNGSeed(0)
    step, kept = cv2.findHomography(corners[sure], found[sure], cv2.RANSAC, OFF)
    if step is None or kept.mean() < MOST_OF or not _all_over(corners[sure][kept.ravel() > 0][:, 0], now.shape):
        return None
    return step


def _all_over(points: NDArray, shape: tuple[int, int]) -> bool:
    """Whether points (n, 2) lie in most of the fields along the picture's border."""
    field = np.floor(points / np.array(shape[::-1]) * GRID).astype(int)
    border = {(int(x), int(y)) for x, y in field if x in (0, GRID - 1) or y in (0, GRID - 1)}
    return len(border) >= MOST_OF * 4 * (GRID - 1)


def _grey(frame: NDArray) -> NDArray:
    return cv2.cvtColor(np.ascontiguousarray(frame[..., :3]), cv2.COLOR_RGB2GRAY)
