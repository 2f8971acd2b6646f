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


def seed_box(image: NDArray, box: tuple[float, float, float, float], rounds: int = 5) -> Seed:
    """From a box (x, y, width, height) drawn round the layer.

    What lies round the box is background; what belongs together inside it and differs from that is found by
    OpenCV's grabCut, which weighs colours against edges.  It is slow, but this is done once for a shot.
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
    if cv2.countNonZero(1 - within) < 16:
        raise InputError("a box must leave some background round the layer, this one covers the whole picture")
    margin = round(0.25 * max(x1 - x0, y1 - y0)) + 8  # pixels round the box: farther off other colours are usual
    spot = slice(max(y0 - margin, 0), y1 + margin), slice(max(x0 - margin, 0), x1 + margin)
    inside = np.zeros_like(within)
    inside[spot] = _grabbed(image[spot], within[spot], rounds)
    if cv2.countNonZero(inside) < 16:
        inside = _ellipse(within)
    return Seed(image, inside, 1 - cv2.dilate(inside, np.ones((3, 3), np.uint8)), within)


def _grabbed(image: NDArray, within: NDArray, rounds: int) -> NDArray:
    """The mask (H, W) of what grabCut takes for one thing in a box, from a start at the ellipse in it."""
    marks = np.where(within > 0, cv2.GC_PR_BGD, cv2.GC_BGD).astype(np.uint8)
    marks[_ellipse(within) > 0] = cv2.GC_PR_FGD
    picture = np.ascontiguousarray(image[..., :3])
    cv2.setRNGSeed(0)  # its first clusters are drawn by lot
    try:
        cv2.grabCut(picture, marks, None, np.zeros((1, 65)), np.zeros((1, 65)), rounds, cv2.GC_INIT_WITH_MASK)
    except cv2.error:  # of one flat colour there are no clusters
        return np.zeros_like(within)
    return patches.without_holes(patches.largest((marks & 1 & within).astype(np.uint8)))


def _ellipse(within: NDArray) -> NDArray:
    """The ellipse (H, W) uint8 that a box, given as a mask, holds."""
    x, y, w, h = cv2.boundingRect(within)
    yy, xx = np.mgrid[: within.shape[0], : within.shape[1]]
    across = (2 * (xx - x) + 1 - w) / w, (2 * (yy - y) + 1 - h) / h
    return ((across[0] ** 2 + across[1] ** 2) < 1).astype(np.uint8)


def seed_color(image: NDArray, color: tuple[int, int, int], tolerance: float = 40.0) -> Seed:
    """From an RGB colour: the largest patch within `tolerance` grey levels of it, and what belongs to it.

    A layer is more than one flat patch: its ink, its eyes and its other colours hang together with the patch, and do
    not occur in the picture farther off.  Where that does not come to an end, the patch alone has to do.
    """
    distance = np.linalg.norm(image[..., :3].astype(float) - color, axis=-1)
    near = (distance < tolerance).astype(np.uint8)
    if np.count_nonzero(near) < 16:
        raise InputError(
            f"a colour must occur in the frame it is picked from: fewer than 16 pixels are within {tolerance:g} "
            f"grey levels of {tuple(color)}, take the colour from the picture itself"
        )
    patch = patches.largest(near)
    grown = _belonging(image, patch)
    inside = patch if grown is None else grown
    outside = 1 - cv2.dilate(inside, np.ones((5, 5), np.uint8))
    if grown is None:
        outside &= (distance > 0.5 * tolerance).astype(np.uint8)
    return Seed(image, inside, outside, np.ones_like(inside))


def _belonging(image: NDArray, patch: NDArray) -> NDArray | None:
    """The mask (H, W) of what hangs together with a patch, unlike what is farther off; None if it has no end."""
    x, y, w, h = cv2.boundingRect(patch)
    reach = max(w, h)
    near_by = np.zeros_like(patch)
    near_by[max(y - reach, 0) : y + h + reach, max(x - reach, 0) : x + w + reach] = 1
    if near_by.mean() > 0.9:  # too little is farther off to say what is usual there
        return None
    other = colors.unlike(image, 1 - near_by)
    grown = patches.touching(((other | patch) & near_by).astype(np.uint8), patch, reach=0.05)
    solid = patches.without_holes(cv2.morphologyEx(grown, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)))
    endless = (solid & cv2.dilate(1 - near_by, np.ones((3, 3), np.uint8))).any() or solid.sum() > 0.5 * near_by.sum()
    return None if endless or not solid.any() else solid


def seed_scribbles(image: NDArray, inside: list[NDArray], outside: list[NDArray], width: int = 5) -> Seed:
    """From strokes, each (N, 2), drawn on the layer and on the rest with a brush `width` pixels wide."""
    masks = []
    for strokes in (inside, outside):
        mask = np.zeros(image.shape[:2], np.uint8)
        for stroke in strokes:
            cv2.polylines(mask, [np.round(np.asarray(stroke)).astype(np.int32)], False, 1, width)
        masks.append(mask)
    return Seed(image, masks[0], masks[1], 1 - masks[1])
