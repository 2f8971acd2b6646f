"""Pictures of every row: the key frames' own pixels, warped onto the in-between meshes (Bregler 2002, 3.1.3, 3.3).

All live on one grid of pixels in key 0's frame, with the keys aligned.  An in-between of keys i and j mixes
both keys' pixels, s of key j.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from capture.fit.pixels.layer import Layer
from capture.motion import affine, keys
from capture.motion.keys import KeySet
from capture.progress import progress


@dataclass(frozen=True, eq=False)
class Grid:
    """A rectangle of pixels in key 0's frame."""

    origin: NDArray  # (2,)
    shape: tuple[int, int]  # rows, columns

    def points(self) -> NDArray:
        """Pixel positions (H, W, 2)."""
        y, x = np.mgrid[: self.shape[0], : self.shape[1]]
        return np.stack([x, y], -1) + self.origin


@dataclass(frozen=True, eq=False)
class MeshMap:
    """Which place of a mesh every pixel of a grid shows; beyond its edge the nearest place and the way to it."""

    corners: NDArray  # (H, W, 3) mesh points
    shares: NDArray  # (H, W, 3) barycentric
    beyond: NDArray  # (H, W, 2) pixels from the nearest place of the mesh, 0 inside

    def carry(self, values: NDArray) -> NDArray:
        """Interpolate values (N, C) given at the mesh points: (H, W, C)."""
        return np.einsum("...k,...kc->...c", self.shares, values[self.corners])

    def only(self, chosen: NDArray, step: int) -> "MeshMap":
        """The map of some pixels alone, as rows (P, ...): `chosen` of every so many rows and columns."""
        return MeshMap(*(field[::step, ::step][chosen] for field in (self.corners, self.shares, self.beyond)))


def grid_round(shapes: NDArray, margin: int = 12) -> Grid:
    """The grid that holds shapes (D, N, 2) and a margin."""
    low = np.floor(shapes.min(axis=(0, 1))).astype(int) - margin
    high = np.ceil(shapes.max(axis=(0, 1))).astype(int) + margin + 1
    return Grid(low, (int(high[1] - low[1]), int(high[0] - low[0])))


def mesh_map(points: NDArray, faces: NDArray, grid: Grid) -> MeshMap:
    """Locate every pixel of the grid in a mesh with points (N, 2)."""
    from scipy.ndimage import distance_transform_edt

    local = points - grid.origin
    painted = np.full(grid.shape, -1, np.int32)
    for number, corners in enumerate(np.round(local[faces] * 16).astype(np.int32)):
        cv2.fillConvexPoly(painted, corners, number, shift=4)
    _, (row, column) = distance_transform_edt(painted < 0, return_indices=True)
    y, x = np.mgrid[: grid.shape[0], : grid.shape[1]]
    nearest = np.stack([column, row], -1).astype(float)
    triangle = faces[painted[row, column]]
    a, b, c = np.moveaxis(local[triangle], 2, 0)
    first, second, way = b - a, c - a, nearest - a
    area = _cross(first, second)
    area = np.where(np.abs(area) < 1e-9, 1e-9, area)
    u, v = _cross(way, second) / area, _cross(first, way) / area
    return MeshMap(triangle, np.stack([1 - u - v, u, v], -1), np.stack([x, y], -1) - nearest)


def row_layers(drawn: list[Layer], keyset: KeySet, shapes: NDArray, grid: Grid, finest: int = 0) -> list[Layer]:
    """The rows' pictures (D of them) as layers, from the K key frames' own: from level `finest` on, the others empty.

    What is smoothed already is pulled at the size at which it will be used: a sixteenth of the work from level 2 on.
    """
    amount = keys.fold(keyset.rows, np.eye(len(keyset.rows)), len(drawn))  # (D, K)
    step = 2**finest
    small = Grid(np.zeros(2, int), tuple(-(-side // step) for side in grid.shape))
    layers = []
    for number, shape in enumerate(progress(shapes, "learning the keys", len(shapes))):
        place = mesh_map((shape - grid.origin) / step, keyset.faces, small)
        place = MeshMap(place.corners, place.shares, step * place.beyond)
        used = np.flatnonzero(amount[number] > 0)
        pulled = [
            pulled_layer(drawn[key], keyset.points[key], keyset.removed[key], place, grid.origin, finest)
            for key in used
        ]
        levels = [
            sum(np.float32(amount[number, key]) * one.levels[k] for key, one in zip(used, pulled))
            for k in range(len(drawn[0].levels))
        ]
        layers.append(Layer(tuple(levels), pulled[0].origin, pulled[0].ground))
    return layers


def pulled_layer(
    key: Layer, points: NDArray, removed: NDArray, place: MeshMap, origin: NDArray, finest: int = 0
) -> Layer:
    """A key frame's layer seen on the grid at `origin`, where the mesh has moved from `points` (N, 2).

    Every level is pulled for itself, smoothed already: so a frame that shows the key again, smoothed in the same way,
    differs by nothing.  The mesh map is of the size of level `finest`; the levels below that stay empty.
    """
    at = affine.apply(removed, (place.carry(points) + place.beyond).reshape(-1, 2)).reshape(place.beyond.shape)
    levels = [np.zeros((0, 0, 4), np.float32)] * min(finest, len(key.levels))
    for number in range(finest, len(key.levels)):
        step = 2 ** (number - finest)
        some = at[::step, ::step]
        values = key.sample(number, some.reshape(-1, 2))
        levels.append(np.ascontiguousarray(values.reshape(*some.shape[:2], -1)))
    return Layer(tuple(levels), np.asarray(origin, float), key.ground)


def _cross(a: NDArray, b: NDArray) -> NDArray:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
