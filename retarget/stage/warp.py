"""A picture bent by its mesh: where in the picture each pixel of the page comes from, triangle by triangle.

The map is one continuous field over the whole picture and is sampled once, so that triangles leave no seams.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from retarget.characters.picture import DrawnPicture


def warp(picture: DrawnPicture, window: tuple[slice, slice]) -> NDArray:
    """The picture's colours (h, w, 4), 0-1, premultiplied, in a window (rows, columns) of the page."""
    rows, columns = window
    corner = np.array([columns.start, rows.start], float)
    shape = (rows.stop - rows.start, columns.stop - columns.start)
    faces = picture.faces[_solid(picture.points[picture.faces])]
    face = _face_of_pixels(picture.points - corner, faces, shape)
    at = np.flatnonzero(face.ravel() >= 0)
    y, x = np.divmod(at, shape[1])
    mixed = np.zeros((*shape, 4), np.float32)
    for layer, share in picture.layers:
        maps = _inverse_maps(picture.points - corner, layer.points, faces)[face.ravel()[at]]  # (P, 2, 3)
        source = np.full((*shape, 2), -1e4, np.float32)
        source.reshape(-1, 2)[at] = maps[:, :, 0] * x[:, None] + maps[:, :, 1] * y[:, None] + maps[:, :, 2]
        level = layer.level(picture.scale)
        factor = np.array(level.shape[1::-1]) / layer.pixels[0].shape[1::-1]
        source = ((source + 0.5) * factor - 0.5).astype(np.float32)
        mixed += share * cv2.remap(level, source, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
    return np.clip(mixed, 0, 1)


def _solid(corners: NDArray) -> NDArray:
    """Which faces (F, 3, 2) have an area that can be turned back."""
    edges = corners[:, 1:] - corners[:, :1]
    return np.abs(np.linalg.det(edges)) > 1e-6


def _face_of_pixels(points: NDArray, faces: NDArray, shape: tuple[int, int]) -> NDArray:
    """The face (h, w) each pixel lies in, -1 outside; the border's faces reach a pixel beyond it."""
    face = np.full(shape, -1, np.int32)
    corners = np.round(np.clip(points[faces], -1e4, 1e4) * 16).astype(np.int32)  # 4 fractional bits
    for number, corner in enumerate(corners):
        cv2.polylines(face, [corner], True, number, thickness=3, shift=4)
    for number, corner in enumerate(corners):
        cv2.fillConvexPoly(face, corner, number, shift=4)
    return face


def _inverse_maps(points: NDArray, source: NDArray, faces: NDArray) -> NDArray:
    """Per face (F, 2, 3) the affine map from the page back into the picture."""
    here, there = points[faces], source[faces]
    edges_here = np.swapaxes(here[:, 1:] - here[:, :1], 1, 2)
    edges_there = np.swapaxes(there[:, 1:] - there[:, :1], 1, 2)
    linear = edges_there @ np.linalg.inv(edges_here)
    shift = there[:, 0] - (linear @ here[:, 0, :, None])[..., 0]
    return np.concatenate([linear, shift[..., None]], axis=-1)
