"""Triangles of a 3-D model as pixels: nearest first, smoothly lit, textured, with soft edges.

Every pixel asks at four places, each on a row and a column of its own, which triangle is nearest there.  Then each
triangle seen in the pixel is coloured once, in the middle of its places, and counts by their number: so edges are soft,
and colours cost no more than without.

    cover   ->   which triangle (h, w, 4)   ->   shade   ->   colours (h, w, 4)

The loops are machine code by numba; nothing here needs a graphics card.
"""

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from retarget.characters.models.mesh import DrawnMesh, Surface

PLACES = np.array([[-1, -3], [3, -1], [-3, 1], [1, 3]]) / 8
"""Where a pixel asks, from its middle: no two in one row or column, so that steep and flat edges get four steps."""

LIGHTS = np.array([[-0.55, -0.65, 0.75, 0.75], [0.9, 0.1, 0.45, 0.2]])
"""A key light from the upper left, a weaker one from the right: x, y (down) and z on the page, and its strength."""

AMBIENT = 0.22
NEAREST = 0.05
"""What is nearer to the eye than this share of its distance to the page is not drawn."""

GRID = 256.0
"""Corners lie on a grid, so many steps a pixel: sums of such numbers are exact, and no gap opens between triangles."""


def projected(mesh: DrawnMesh) -> NDArray:
    """Where the mesh's points (N, 3) are on the page, and how near: x, y, and a depth that grows to the viewer."""
    if mesh.eye is None:
        return mesh.points
    away = np.maximum(mesh.eye[2] - mesh.points[:, 2], NEAREST * mesh.eye[2])
    grown = mesh.eye[2] / away
    page = mesh.eye[:2] + (mesh.points[:, :2] - mesh.eye[:2]) * grown[:, None]
    return np.column_stack([page, grown])  # a depth that is straight on the page, as its inverse is in space


def render(mesh: DrawnMesh, window: tuple[slice, slice]) -> NDArray:
    """The mesh's colours (h, w, 4), 0-1, premultiplied, in a window (rows, columns) of the page."""
    rows, columns = window
    shape = (rows.stop - rows.start, columns.stop - columns.start)
    surface = mesh.surface
    texels, sizes, looks = surface.packed
    flat = projected(mesh) - [columns.start, rows.start, 0]
    flat[:, :2] = np.round(np.clip(flat[:, :2], -1e6, 1e6) * GRID) / GRID
    corners = flat[surface.faces]  # (F, 3, 3)
    doubled = _doubled_areas(corners)
    seen = doubled != 0
    if mesh.eye is not None:
        seen &= (mesh.eye[2] - mesh.points[surface.faces, 2] > NEAREST * mesh.eye[2]).all(axis=1)
    share = np.ones(corners.shape[:2]) if mesh.eye is None else corners[..., 2]  # what is even in space, per page
    uv = surface.uv[surface.faces]
    level = _levels(uv, doubled, surface, looks, sizes)
    cover, shade = _compiled()
    which = np.full((*shape, len(PLACES)), -1, np.int32)
    nearest = np.full(which.shape, -np.inf, np.float32)
    textures = (uv, share, surface.number, level, texels, sizes, looks)
    cover(corners, doubled, np.flatnonzero(seen), PLACES, textures, which, nearest)
    colors = np.ones((1, 4)) if surface.colors is None else surface.colors
    lights = np.column_stack([LIGHTS[:, :3] / np.linalg.norm(LIGHTS[:, :3], axis=1, keepdims=True), LIGHTS[:, 3]])
    normals = _normals(mesh.points, surface, doubled)
    out = np.zeros((*shape, 4), np.float32)
    shade(which, corners, doubled, normals, colors, surface.faces, PLACES, textures, lights, AMBIENT, out)
    return out


def _doubled_areas(corners: NDArray) -> NDArray:
    """Twice the area (F,) of triangles (F, 3, 2 or 3) on the page, positive if they run clockwise there."""
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def _normals(points: NDArray, surface: Surface, doubled: NDArray) -> NDArray:
    """Unit normals (F, 3, 3) at the corners, towards the viewer: every face is seen from both sides."""
    corners = points[surface.faces]
    face = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])  # as long as the face is large
    mixed = (surface.smooth @ face).reshape(-1, 3, 3)
    length = np.linalg.norm(mixed, axis=-1, keepdims=True)
    return mixed / np.maximum(length, 1e-30) * np.sign(doubled)[:, None, None]


def _levels(uv: NDArray, doubled: NDArray, surface: Surface, looks: NDArray, sizes: NDArray) -> NDArray:
    """How small a texture suits each face (F,): 0 as it is, 1 half as large, ..., by its area in both."""
    first = np.minimum(looks[surface.number, 4].astype(int), len(sizes) - 1)
    texels = np.abs(_doubled_areas(uv)) * sizes[first, 1] * sizes[first, 2]
    level = 0.5 * np.log2(np.maximum(texels, 1e-12) / np.maximum(np.abs(doubled), 1e-12))
    return np.clip(level, 0, np.maximum(looks[surface.number, 5] - 1, 0))


@lru_cache(maxsize=1)
def _compiled() -> tuple[Callable, Callable]:
    """`_cover` and `_shade` as machine code: at every place there is something to decide."""
    from numba import njit

    def quick(function: Callable) -> Callable:
        try:
            return njit(function, cache=True)
        except RuntimeError:  # there is no folder where the machine code could be kept
            return njit(function)

    return quick(_cover), quick(_shade)


def _cover(  # noqa: ANN202 - numba reads this too
    corners: NDArray,
    doubled: NDArray,
    chosen: NDArray,
    places: NDArray,
    textures: tuple,
    which: NDArray,
    nearest: NDArray,
):
    """Write into `which` (h, w, 4) the nearest of the chosen faces at every place, and how near it is."""
    uv, share, number, level, texels, sizes, looks = textures
    height, width, count = which.shape
    off = np.empty((3, count))
    for f in chosen:
        x0, y0, z0 = corners[f, 0]
        x1, y1, z1 = corners[f, 1]
        x2, y2, z2 = corners[f, 2]
        left = max(int(np.floor(min(x0, x1, x2))), 0)
        right = min(int(np.ceil(max(x0, x1, x2))), width - 1)
        top = max(int(np.floor(min(y0, y1, y2))), 0)
        bottom = min(int(np.ceil(max(y0, y1, y2))), height - 1)
        area = doubled[f]
        sign = 1.0 if area > 0 else -1.0
        least, most = min(z0, z1, z2), max(z0, z1, z2)
        look = int(number[f])
        cut_out = looks[look, 6] != 0 and looks[look, 5] > 0
        # twice the area between each edge and a place, positive inside; what is the same for all pixels comes first
        dx0, dy0, c0 = sign * (y1 - y2), sign * (x2 - x1), sign * (x1 * y2 - x2 * y1)
        dx1, dy1, c1 = sign * (y2 - y0), sign * (x0 - x2), sign * (x2 * y0 - x0 * y2)
        dx2, dy2, c2 = sign * (y0 - y1), sign * (x1 - x0), sign * (x0 * y1 - x1 * y0)
        for k in range(count):
            off[0, k] = dx0 * places[k, 0] + dy0 * places[k, 1]
            off[1, k] = dx1 * places[k, 0] + dy1 * places[k, 1]
            off[2, k] = dx2 * places[k, 0] + dy2 * places[k, 1]
        for y in range(top, bottom + 1):
            for x in range(left, right + 1):
                m0, m1, m2 = dx0 * x + dy0 * y + c0, dx1 * x + dy1 * y + c1, dx2 * x + dy2 * y + c2
                for k in range(count):
                    e0, e1, e2 = m0 + off[0, k], m1 + off[1, k], m2 + off[2, k]
                    if e0 < 0 or e1 < 0 or e2 < 0:
                        continue
                    z = min(max((e0 * z0 + e1 * z1 + e2 * z2) / (sign * area), least), most)
                    # faces that lie in one another: the first stays, in every frame
                    if z <= nearest[y, x, k] + 1e-5 * (1 + abs(z)):
                        continue
                    if cut_out:
                        b0, b1, b2 = e0 * share[f, 0], e1 * share[f, 1], e2 * share[f, 2]
                        total = b0 + b1 + b2
                        u = (b0 * uv[f, 0, 0] + b1 * uv[f, 1, 0] + b2 * uv[f, 2, 0]) / total
                        v = (b0 * uv[f, 0, 1] + b1 * uv[f, 1, 1] + b2 * uv[f, 2, 1]) / total
                        start, rows, columns = sizes[int(looks[look, 4]) + int(level[f] + 0.5)]
                        row = min(int((v - np.floor(v)) * rows), rows - 1)
                        column = min(int((u - np.floor(u)) * columns), columns - 1)
                        if texels[start + row * columns + column, 3] < 0.5:
                            continue
                    which[y, x, k] = f
                    nearest[y, x, k] = z


def _shade(  # noqa: ANN202
    which: NDArray,
    corners: NDArray,
    doubled: NDArray,
    normals: NDArray,
    colors: NDArray,
    faces: NDArray,
    places: NDArray,
    textures: tuple,
    lights: NDArray,
    ambient: float,
    out: NDArray,
):
    """Add to `out` (h, w, 4) the colour of each face seen in a pixel, by the share of places that see it."""
    uv, share, number, level, texels, sizes, looks = textures
    height, width, count = which.shape
    for y in range(height):
        for x in range(width):
            for k in range(count):
                f = which[y, x, k]
                if f < 0:
                    continue
                met, px, py, again = 0, 0.0, 0.0, False
                for other in range(count):
                    if which[y, x, other] == f:
                        again = again or other < k
                        met += 1
                        px += places[other, 0]
                        py += places[other, 1]
                if again:
                    continue
                px, py = x + px / met, y + py / met  # between places inside a triangle one is inside it too
                x0, y0 = corners[f, 0, 0] - px, corners[f, 0, 1] - py
                x1, y1 = corners[f, 1, 0] - px, corners[f, 1, 1] - py
                x2, y2 = corners[f, 2, 0] - px, corners[f, 2, 1] - py
                b0 = (x1 * y2 - x2 * y1) / doubled[f] * share[f, 0]
                b1 = (x2 * y0 - x0 * y2) / doubled[f] * share[f, 1]
                b2 = (x0 * y1 - x1 * y0) / doubled[f] * share[f, 2]
                total = b0 + b1 + b2
                b0, b1, b2 = b0 / total, b1 / total, b2 / total
                look = int(number[f])
                red, green, blue, alpha = looks[look, 0], looks[look, 1], looks[look, 2], looks[look, 3]
                if len(colors) > 1:
                    i0, i1, i2 = faces[f]
                    red *= b0 * colors[i0, 0] + b1 * colors[i1, 0] + b2 * colors[i2, 0]
                    green *= b0 * colors[i0, 1] + b1 * colors[i1, 1] + b2 * colors[i2, 1]
                    blue *= b0 * colors[i0, 2] + b1 * colors[i1, 2] + b2 * colors[i2, 2]
                    alpha *= b0 * colors[i0, 3] + b1 * colors[i1, 3] + b2 * colors[i2, 3]
                if looks[look, 5] > 0:
                    u = b0 * uv[f, 0, 0] + b1 * uv[f, 1, 0] + b2 * uv[f, 2, 0]
                    v = b0 * uv[f, 0, 1] + b1 * uv[f, 1, 1] + b2 * uv[f, 2, 1]
                    u, v = u - np.floor(u), v - np.floor(v)
                    r, g, b, a = 0.0, 0.0, 0.0, 0.0
                    small = int(level[f])
                    for step in range(2):  # between two sizes, and in each between four texels
                        share_of_size = level[f] - small if step else 1 - (level[f] - small)
                        if share_of_size <= 0:
                            continue
                        start, rows, columns = sizes[int(looks[look, 4]) + small + step]
                        at_x, at_y = u * columns - 0.5, v * rows - 0.5
                        column, row = int(np.floor(at_x)), int(np.floor(at_y))
                        for corner in range(4):
                            dx, dy = corner % 2, corner // 2
                            way_x, way_y = at_x - column, at_y - row
                            part = share_of_size * (way_x if dx else 1 - way_x) * (way_y if dy else 1 - way_y)
                            texel = start + (row + dy) % rows * columns + (column + dx) % columns
                            r += part * texels[texel, 0]
                            g += part * texels[texel, 1]
                            b += part * texels[texel, 2]
                            a += part * texels[texel, 3]
                    solid = max(a, 1e-6)  # a cut-out shows its colours whole, up to its edge
                    red, green, blue = red * r / solid, green * g / solid, blue * b / solid
                nx = b0 * normals[f, 0, 0] + b1 * normals[f, 1, 0] + b2 * normals[f, 2, 0]
                ny = b0 * normals[f, 0, 1] + b1 * normals[f, 1, 1] + b2 * normals[f, 2, 1]
                nz = b0 * normals[f, 0, 2] + b1 * normals[f, 1, 2] + b2 * normals[f, 2, 2]
                length = max(np.sqrt(nx * nx + ny * ny + nz * nz), 1e-12)
                light = ambient
                for n in range(len(lights)):
                    facing = (nx * lights[n, 0] + ny * lights[n, 1] + nz * lights[n, 2]) / length
                    light += lights[n, 3] * max(facing, 0.0)
                bright = light ** (1 / 2.2)  # light adds up; a picture's colours are its 2.2th root
                counted = alpha * met / count
                out[y, x, 0] += counted * min(red * bright, 1.0)
                out[y, x, 1] += counted * min(green * bright, 1.0)
                out[y, x, 2] += counted * min(blue * bright, 1.0)
                out[y, x, 3] += counted
