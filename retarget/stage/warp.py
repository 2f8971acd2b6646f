"""A picture bent by its mesh: where in the picture each pixel of the page comes from, triangle by triangle.

    face_of_pixels   ->   which triangle (h, w)   ->   inverse_maps   ->   add_colors (h, w, 4)

Every pixel asks the one triangle it lies in for its place in the picture.  A pixel on an edge finds the same place by
both neighbours, so triangles leave no seams.  The loops are machine code by numba.
"""

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from retarget.characters.photos.picture import DrawnPicture

REACH = 1.5
"""Pixels that the border's triangles reach outwards: the outline's soft edge has its pixels' middles there."""

TOUCH = 1e-3
"""Pixels that all triangles reach: rounding must not let one slip through between two of them."""


def warp(picture: DrawnPicture, window: tuple[slice, slice]) -> NDArray:
    """The picture's colours (h, w, 4) float32, 0-1, premultiplied, in a window (rows, columns) of the page."""
    rows, columns = window
    shape = (rows.stop - rows.start, columns.stop - columns.start)
    points = picture.points - [columns.start, rows.start]
    faces = picture.faces[_solid(points[picture.faces])]
    on_border = np.isin(faces, np.concatenate(picture.rings)).any(axis=1)
    face = face_of_pixels(points[faces], on_border, shape)
    mixed = np.zeros((*shape, 4), np.float32)
    for layer, share in picture.layers:
        level = layer.level(picture.scale)
        there = ((layer.points + 0.5) * np.array(level.shape[1::-1]) / layer.size - 0.5)[faces]
        add_colors(face, points[faces], there, level, share, layer.opaque, mixed)
    return mixed


def face_of_pixels(corners: NDArray, on_border: NDArray, shape: tuple[int, int]) -> NDArray:
    """The face (h, w) int32 that each pixel's middle lies in, of corners (F, 3, 2), and -1 outside.

    Faces `on_border` (F,) reach beyond their edges where no other face is.
    """
    face = np.full(shape, -1, np.int32)
    cover = _compiled(_cover)
    corners = np.ascontiguousarray(corners, float)
    cover(corners, np.flatnonzero(on_border), REACH, face)
    cover(corners, np.arange(len(corners)), TOUCH, face)
    return face


def add_colors(
    face: NDArray, here: NDArray, there: NDArray, level: NDArray, share: float, goes_on: bool, mixed: NDArray
) -> None:
    """Add to `mixed` (h, w, 4), in place, `share` times the colours of a picture (H, W, 4) at every pixel's face.

    Faces have corners `here` (F, 3, 2) on the page and `there` in the picture.  Beyond its border the picture ends, or
    it `goes_on` as it is there.
    """
    maps = inverse_maps(here, there)
    # a border's thin triangle must not fetch its neighbourhood from the other end of the picture
    limits = np.concatenate([there.min(axis=1) - 2, there.max(axis=1) + 2], axis=1)
    _compiled(_add)(face, maps, limits, np.ascontiguousarray(level, np.float32), np.float32(share), goes_on, mixed)


def inverse_maps(here: NDArray, there: NDArray) -> NDArray:
    """Per face (F, 2, 3) the affine map from its corners on the page (F, 3, 2) back to those in the picture."""
    a, b = here[:, 1] - here[:, 0], here[:, 2] - here[:, 0]
    doubled = (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])[:, None]
    across = np.stack([b[:, 1], -b[:, 0]], axis=-1) / doubled  # how the first edge's share grows along x and y
    down = np.stack([-a[:, 1], a[:, 0]], axis=-1) / doubled
    u, v = there[:, 1] - there[:, 0], there[:, 2] - there[:, 0]
    linear = u[:, :, None] * across[:, None] + v[:, :, None] * down[:, None]
    shift = there[:, 0] - (linear @ here[:, 0, :, None])[..., 0]
    return np.concatenate([linear, shift[..., None]], axis=-1)


def _solid(corners: NDArray) -> NDArray:
    """Which faces (F, 3, 2) have an area that can be turned back."""
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) > 1e-6


@lru_cache
def _compiled(loops: Callable) -> Callable:
    """A function of this file as machine code, which is kept on disk where that is possible."""
    from numba import njit

    try:
        return njit(loops, cache=True)
    except RuntimeError:  # there is no folder where the machine code could be kept
        return njit(loops)


def _cover(corners: NDArray, chosen: NDArray, reach: float, face: NDArray):  # noqa: ANN202 - numba reads this too
    """Write into `face` (h, w) the number of each chosen face where it is, or no farther than `reach` pixels off."""
    height, width = face.shape
    for f in chosen:
        x0, y0 = corners[f, 0]
        x1, y1 = corners[f, 1]
        x2, y2 = corners[f, 2]
        left, right = max(min(x0, x1, x2) - reach, 0.0), min(max(x0, x1, x2) + reach, width - 1.0)
        top, bottom = max(min(y0, y1, y2) - reach, 0.0), min(max(y0, y1, y2) + reach, height - 1.0)
        sign = 1.0 if (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0) > 0 else -1.0
        # a x + b y + c: how far inside each edge, times its length
        a0, b0 = sign * (y1 - y2), sign * (x2 - x1)
        a1, b1 = sign * (y2 - y0), sign * (x0 - x2)
        a2, b2 = sign * (y0 - y1), sign * (x1 - x0)
        c0 = reach * np.sqrt(a0 * a0 + b0 * b0) - a0 * x1 - b0 * y1
        c1 = reach * np.sqrt(a1 * a1 + b1 * b1) - a1 * x2 - b1 * y2
        c2 = reach * np.sqrt(a2 * a2 + b2 * b2) - a2 * x0 - b2 * y0
        for y in range(int(np.ceil(top)), int(np.floor(bottom)) + 1):
            for x in range(int(np.ceil(left)), int(np.floor(right)) + 1):
                if a0 * x + b0 * y + c0 >= 0 and a1 * x + b1 * y + c1 >= 0 and a2 * x + b2 * y + c2 >= 0:
                    face[y, x] = f


def _add(  # noqa: ANN202
    face: NDArray, maps: NDArray, limits: NDArray, level: NDArray, share: float, goes_on: bool, mixed: NDArray
):
    """`add_colors` with the maps (F, 2, 3) at hand: four texels for a pixel, by how near they are."""
    height, width = face.shape
    rows, columns = level.shape[:2]
    for y in range(height):
        for x in range(width):
            f = face[y, x]
            if f < 0:
                continue
            u = maps[f, 0, 0] * x + maps[f, 0, 1] * y + maps[f, 0, 2]
            v = maps[f, 1, 0] * x + maps[f, 1, 1] * y + maps[f, 1, 2]
            u = min(max(u, limits[f, 0]), limits[f, 2])
            v = min(max(v, limits[f, 1]), limits[f, 3])
            if goes_on:
                u, v = min(max(u, 0.0), columns - 1.0), min(max(v, 0.0), rows - 1.0)
            left, top = int(np.floor(u)), int(np.floor(v))
            across, down = np.float32(u - left), np.float32(v - top)
            for corner in range(4):
                column, row = left + corner % 2, top + corner // 2
                if column < 0 or row < 0 or column >= columns or row >= rows:
                    continue
                part = share * (across if corner % 2 else 1 - across) * (down if corner // 2 else 1 - down)
                for channel in range(4):
                    mixed[y, x, channel] += part * level[row, column, channel]
