"""Keys in small, to be compared side by side: the source's, as it was captured, and what plays it."""

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.motion import affine
from capture.motion.tracks import CartoonMotion
from capture.pictures.encode import over
from retarget.workbench import pictures
from retarget.workbench.state import State

SIZE = 160  # pixels of the longer edge
MARGIN = 0.08  # of its size, round what is drawn
INK = (92, 140, 190)


def small(picture: NDArray) -> NDArray:
    """A picture (H, W, 3 | 4) in small, cut to what is drawn on it, on paper."""
    alpha = picture[..., 3] > 8 if picture.shape[2] == 4 else np.ones(picture.shape[:2], bool)
    rows, columns = np.nonzero(alpha)
    if len(rows):
        picture = _cut(picture, (columns.min(), rows.min(), columns.max(), rows.max()))
    return _shrunk(over(picture))


def source(state: State, motion: CartoonMotion, part: str, key: str) -> NDArray:
    """The source's key (h, w, 3): out of its frame where the clip is here, else its outline."""
    track, keyset = motion.track(part), motion.keyset(part)
    if key not in track.keys:
        raise InputError(f"a key must be one of {', '.join(track.keys)}, got {key[:40]!r}")
    number = track.keys.index(key)
    outline = affine.apply(keyset.removed, keyset.points)[number, keyset.outline]
    frame = _frame(state, part, key)
    if frame is not None:
        return _shrunk(over(_cut(frame, (*outline.min(axis=0), *outline.max(axis=0)))))
    return _silhouette(outline)


def _frame(state: State, part: str, key: str) -> NDArray | None:
    """The frame of the clip that the key was drawn in, if that is known."""
    shot = state.captured if state.captured is not None else state.shot
    for one in shot.parts if shot is not None else ():
        for drawn in one.keys:
            if (one.name, drawn.name) == (part, key):
                try:
                    return pictures.frame(shot, drawn.frame)
                except InputError:  # the clip has gone
                    return None
    return None


def _silhouette(outline: NDArray) -> NDArray:
    import cv2

    low, high = outline.min(axis=0), outline.max(axis=0)
    scale = SIZE / max((high - low).max() * (1 + 2 * MARGIN), 1e-9)
    margin = MARGIN * (high - low).max()
    size = np.maximum(np.ceil((high - low + 2 * margin) * scale), 1).astype(int)
    paper = np.full((size[1], size[0], 3), 255, np.uint8)
    points = np.round((outline - low + margin) * scale * 16).astype(np.int32)
    cv2.fillPoly(paper, [points], INK, cv2.LINE_AA, 4)
    return paper


def _cut(picture: NDArray, box: tuple[float, float, float, float]) -> NDArray:
    x0, y0, x1, y1 = box
    margin = MARGIN * max(x1 - x0, y1 - y0)
    height, width = picture.shape[:2]
    left, right = np.clip([np.floor(x0 - margin), np.ceil(x1 + margin) + 1], 0, width).astype(int)
    top, bottom = np.clip([np.floor(y0 - margin), np.ceil(y1 + margin) + 1], 0, height).astype(int)
    return picture[top:bottom, left:right] if right > left and bottom > top else picture


def _shrunk(picture: NDArray) -> NDArray:
    import cv2

    factor = min(1.0, SIZE / max(picture.shape[:2]))
    size = tuple(max(1, round(length * factor)) for length in picture.shape[1::-1])
    return cv2.resize(np.ascontiguousarray(picture), size, interpolation=cv2.INTER_AREA)
