"""What is known of a layer in a key frame, from an outline, a box, a colour or scribbles."""

import cv2
import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.pictures import colors, patches
from capture.pictures.colors import Seed


def seed_outline(image: NDArray, outline: NDArray, margin: int = 3) -> Seed:
    """From an outline (B, 2): pixels within `margin` of it are in doubt, for ink has width."""
    mask = patches.filled((image.shape[1], image.shape[0]), outline)
    brush = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * margin + 1, 2 * margin + 1))
    inner, outer = cv2.erode(mask, brush), cv2.dilate(mask, brush)
    return Seed(image, inner if inner.any() else mask, 1 - outer, cv2.dilate(outer, brush))


def seed_box(image: NDArray, box: tuple[float, float, float, float], rounds: int = 4) -> Seed:
    """From a box (x, y, width, height) drawn round the layer.

    What lies round the box is background; what in the box does not look like it is the layer, learnt again
    a few times.
    """
    height, width = image.shape[:2]
    x, y, w, h = box
    x0, y0, x1, y1 = round(x), round(y), round(x + w), round(y + h)
    if w <= 0 or h <= 0 or x0 < 0 or y0 < 0 or x1 > width or y1 > height:
        raise InputError(
            f"a box (x, y, width, height) must lie inside the {width} x {height} picture, got "
            f"({x:g}, {y:g}, {w:g}, {h:g})"
        )
    within = np.zeros((height, width), np.uint8)
    within[y0:y1, x0:x1] = 1
    outside = 1 - within
    if outside.sum() < 16:
        raise InputError("a box must leave some background round the layer, this one covers the whole picture")
    yy, xx = np.mgrid[:height, :width]
    across = (2 * xx - x0 - x1 + 1) / (x1 - x0), (2 * yy - y0 - y1 + 1) / (y1 - y0)
    inside = within * (across[0] ** 2 + across[1] ** 2 < 1)
    for _ in range(rounds):
        model = colors.learn([Seed(image, inside, outside, within)])
        found = ((colors.chance(model, image) > 0.5) & (within > 0)).astype(np.uint8)
        if np.count_nonzero(found) < 16:
            break
        inside = patches.largest(found)
    return Seed(image, inside, outside, within)


def seed_color(image: NDArray, color: tuple[int, int, int], tolerance: float = 40.0) -> Seed:
    """From an RGB colour: the largest patch within `tolerance` grey levels of it, and the rest."""
    distance = np.linalg.norm(image[..., :3].astype(float) - color, axis=-1)
    near = (distance < tolerance).astype(np.uint8)
    if np.count_nonzero(near) < 16:
        raise InputError(
            f"a colour must occur in the frame it is picked from: fewer than 16 pixels are within {tolerance:g} "
            f"grey levels of {tuple(color)}, take the colour from the picture itself"
        )
    inside = patches.largest(near)
    outside = (1 - cv2.dilate(inside, np.ones((5, 5)))) & (distance > 0.5 * tolerance)
    return Seed(image, inside, outside.astype(np.uint8), np.ones_like(inside))


def seed_scribbles(image: NDArray, inside: list[NDArray], outside: list[NDArray], width: int = 5) -> Seed:
    """From strokes, each (N, 2), drawn on the layer and on the rest with a brush `width` pixels wide."""
    masks = []
    for strokes in (inside, outside):
        mask = np.zeros(image.shape[:2], np.uint8)
        for stroke in strokes:
            cv2.polylines(mask, [np.round(np.asarray(stroke)).astype(np.int32)], False, 1, width)
        masks.append(mask)
    return Seed(image, masks[0], masks[1], 1 - masks[1])
