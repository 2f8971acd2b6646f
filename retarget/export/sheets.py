"""Characters as textured meshes: the points that ride with the character, its triangles, and pictures of it.

A picture is one already.  Of a vector drawing every painted element becomes a sheet of its own: a small mesh round
the element, carried as the drawing carries its own control points, with the element as a picture on it.  The sheets
come back to front in one mesh, so a limb that crosses the body crosses it here too.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from capture.motion import affine
from retarget.characters.drawings import paths
from retarget.characters.drawings.bend import Bent
from retarget.characters.drawings.drawing import Drawing
from retarget.characters.drawings.embed import carried_mesh, embedding, silhouette_mesh, silhouette_of
from retarget.characters.drawings.paths import DrawnPath
from retarget.characters.photos.picture import Layer, Picture

TEXELS = 2.0
"""Texture pixels for a pixel of the stage: a character may fill twice the frame before it looks soft."""

LARGEST = 4096
"""The longest edge of a texture; every graphics card takes as much."""

MARGIN = 3
"""Texture pixels left free round each tile, so that a smaller version of the texture mixes no two."""

STEPS_ACROSS = 22
"""A drawing as large as its own square has this many mesh steps across, as in `drawing`."""


@dataclass(frozen=True, eq=False)
class Look:
    """One picture of a character and where its vertices lie in it."""

    texture: NDArray  # (h, w, 4) uint8, straight alpha
    uv: NDArray  # (V, 2), 0-1 from the top-left corner
    repeats: bool = False  # beyond 0-1 the picture goes on again, as on models, and not its border


@dataclass(frozen=True, eq=False)
class Sheets:
    """V vertices of a character in its own units, y down, mixed like its other points."""

    shapes: NDArray  # (D, V, 2) for the rows that were asked for
    faces: NDArray  # (F, 3), back to front
    looks: tuple[Look, ...]  # one, or one for every key
    level: NDArray  # (V,) 0 for the element at the back, below 1 for the one in front
    carry: object = None  # sparse (V, N): vertices from the target's mesh points, rows sum to 1


def of_picture(target: Picture, rows: NDArray) -> Sheets:
    """A picture's own mesh; one look for every picture it has."""
    from scipy import sparse

    count = target.keys.points.shape[1]
    looks = tuple(_look(layer) for layer in target.layers)
    return Sheets(target.shapes(rows), target.keys.faces, looks, np.zeros(count), sparse.identity(count, format="csr"))


def of_drawing(target: Drawing, rows: NDArray, scale: float) -> Sheets:
    """A vector drawing's elements as sheets, for rows (D, 3); `scale` is stage pixels for one of its units.

    The vertices go as control points do: with the limb's mesh, and straight between keys what that leaves over.
    A look for every key where the keys are painted in different colours or widths, or else one.
    """
    shown = _shown([versions[0] for versions in target.paths])
    meshes, faces = _meshes([target.paths[number] for number in shown])
    first = [points[0] for points in meshes]
    carry = _carried_like_controls(target, shown, first)
    aligned = affine.apply(affine.invert(target.keys.removed), np.concatenate(meshes, axis=1))
    leftover = aligned - np.stack([carry @ shape for shape in target.keys.points])
    riding = replace(target, carry=carry, leftover=leftover)
    vertices = riding.shapes(rows)[:, target.keys.points.shape[1] :]
    rest = target.shapes(np.zeros((1, 3)))[0]
    every = [target.posed(rest, only, 1.0) for only in np.eye(len(target.keys.names))]
    every = [[drawn[number] for number in shown] for drawn in every]
    alike = (_painted_alike(one, two) for other in every[1:] for one, two in zip(every[0], other, strict=True))
    every = every[:1] if all(alike) else every
    return Sheets(vertices, faces, _looks(every, first, scale * TEXELS), _levels(meshes), carry)


def of_bent(target: Bent, scale: float) -> Sheets:
    """The elements of a bent drawing at rest, their only shape."""
    drawn = [target.paths[number] for number in _shown(target.paths)]
    meshes, faces = _meshes([(path,) for path in drawn])
    looks = _looks([drawn], [points[0] for points in meshes], scale * TEXELS)
    return Sheets(np.concatenate(meshes, axis=1), faces, looks, _levels(meshes))


def _shown(drawn: Sequence[DrawnPath]) -> list[int]:
    """The numbers of the paths that paint an area."""
    return [number for number, path in enumerate(drawn) if paths.painted(path).area > 0]


def _meshes(elements: Sequence[tuple[DrawnPath, ...]]) -> tuple[list[NDArray], NDArray]:
    """A mesh round each element: points (K, n, 2) as each key puts them, and the faces (F, 3) of all, in order."""
    step = np.sqrt(silhouette_of([versions[0] for versions in elements]).area) / STEPS_ACROSS
    meshes, faces, start = [], [], 0
    for versions in elements:
        mesh, own = _mesh(silhouette_of([versions[0]]), step)
        meshes.append(carried_mesh(mesh, own, [list(versions)]))
        faces.append(own + start)
        start += len(mesh)
    return meshes, np.concatenate(faces)


def _mesh(silhouette: object, step: float) -> tuple[NDArray, NDArray]:
    """Points (n, 2) and faces (f, 3) round a silhouette, each piece meshed by itself, for a speck counts here too."""
    import shapely

    grown = silhouette.buffer(0.5 * step)
    points, faces, start = [], [], 0
    for piece in getattr(grown, "geoms", [grown]):
        inside = shapely.intersection(silhouette, piece)
        mesh, own, _ = silhouette_mesh(inside, step)
        points.append(mesh)
        faces.append(own + start)
        start += len(mesh)
    return np.concatenate(points), np.concatenate(faces)


def _levels(meshes: list[NDArray]) -> NDArray:
    return np.repeat(np.arange(len(meshes)) / len(meshes), [points.shape[1] for points in meshes])


def _carried_like_controls(target: Drawing, shown: list[int], meshes: list[NDArray]) -> object:
    """A sparse matrix (V, N) that carries each element's vertices with the limb its control points ride on."""
    from scipy import sparse

    limb = np.zeros(target.keys.points.shape[1], int)
    for number, joint in enumerate(target.joints, 1):
        limb[joint.limb] = number
    rest, faces = target.keys.points[0], target.keys.faces
    starts = np.cumsum([0, *(len(versions[0].points) for versions in target.paths)])
    blocks = []
    for number, points in zip(shown, meshes, strict=True):
        ridden = np.bincount(limb[target.carry[starts[number] : starts[number + 1]].indices]).argmax()
        blocks.append(embedding(rest, faces[limb[faces[:, 0]] == ridden], points))
    return sparse.vstack(blocks, format="csr")


def _painted_alike(one: DrawnPath, other: DrawnPath) -> bool:
    """Whether two paths that lie in the same place look the same, but for what a bend does to a gradient."""
    if not np.allclose([one.width, one.opacity], [other.width, other.opacity], rtol=0.02):
        return False
    size = np.ptp(one.points, axis=0).max()
    return all(
        np.allclose(here, there, atol=0.01 if field != "place" else 0.1 * size)
        for paint, same in ((one.fill, other.fill), (one.stroke, other.stroke))
        for field, here, there in _compared(paint, same)
    )


def _compared(one: paths.Paint, other: paths.Paint) -> list[tuple[str, NDArray, NDArray]]:
    """The fields of two paints of one kind, side by side."""
    if not isinstance(one, paths.Gradient):
        return [] if one is None else [("color", one, other)]
    return [(field, getattr(one, field), getattr(other, field)) for field in ("offsets", "colors", "place")]


def _looks(every: list[list[DrawnPath]], meshes: list[NDArray], scale: float) -> tuple[Look, ...]:
    """Each way of painting the same elements as one texture: a tile for every element, packed on shelves."""
    from retarget.stage.draw2d import draw_things

    lows = [np.floor(points.min(axis=0) * scale) - MARGIN for points in meshes]
    highs = [np.ceil(points.max(axis=0) * scale) + MARGIN for points in meshes]
    sizes = (np.array(highs) - lows).astype(int)
    corners, size = _packed(sizes)
    if max(size) > LARGEST:
        return _looks(every, meshes, scale * 0.95 * LARGEST / max(size))
    places = [points * scale + corner - low for points, corner, low in zip(meshes, corners, lows, strict=True)]
    looks = []
    for elements in every:
        texture = np.zeros((size[1], size[0], 4), np.uint8)
        for path, (x, y), (width, height), low in zip(elements, corners, sizes.tolist(), lows, strict=True):
            place = np.column_stack([scale * np.eye(2), -low - 0.5])  # a page's pixel 0 lies half a pixel inside
            tile = draw_things([_enlarged(path, scale, place)], (width, height))
            texture[y : y + height, x : x + width] = _bled(tile)
        looks.append(Look(texture, np.concatenate(places) / size))
    return tuple(looks)


def _enlarged(path: DrawnPath, scale: float, place: NDArray) -> DrawnPath:
    fill, stroke = paths.carried(path.fill, place), paths.carried(path.stroke, place)
    dashes = tuple(scale * length for length in path.dashes)
    points = affine.apply(place, path.points)
    return replace(path, points=points, width=scale * path.width, dashes=dashes, fill=fill, stroke=stroke)


def _packed(sizes: NDArray) -> tuple[NDArray, tuple[int, int]]:
    """Corners (P, 2) of tiles of sizes (P, 2) laid on shelves, tall ones first, and the sheet's whole size."""
    width = int(max(sizes[:, 0].max(), np.ceil(1.1 * np.sqrt(sizes.prod(axis=1).sum()))))
    corners = np.zeros_like(sizes)
    x = y = shelf = 0
    for number in np.argsort(-sizes[:, 1], kind="stable"):
        if x + sizes[number, 0] > width:
            x, y, shelf = 0, y + shelf, 0
        corners[number] = (x, y)
        x, shelf = x + sizes[number, 0], max(shelf, sizes[number, 1])
    return corners, (width, int(y + shelf))


def _look(layer: Layer) -> Look:
    """A picture layer cut down to what its mesh covers, at the largest size a graphics card takes."""
    fitting = [level for level in layer.pixels if max(level.shape[:2]) <= LARGEST]
    level = fitting[0] if fitting else layer.pixels[-1]
    size = np.array(level.shape[1::-1])
    points = (layer.points + 0.5) * size / layer.size  # from the top-left corner
    low = np.clip(np.floor(points.min(axis=0)) - 2, 0, size - 1).astype(int)
    high = np.clip(np.ceil(points.max(axis=0)) + 2, low + 1, size).astype(int)
    pixels = level[low[1] : high[1], low[0] : high[0]]
    straight = pixels.copy()
    straight[..., :3] /= np.maximum(pixels[..., 3:], 1e-6)
    return Look(_bled(np.round(255 * np.clip(straight, 0, 1)).astype(np.uint8)), (points - low) / (high - low))


def _bled(image: NDArray) -> NDArray:
    """The picture (h, w, 4) with the colours of its border carried out to where nothing is seen.

    A graphics card mixes neighbouring pixels before it looks at their alpha; black ones would leave a dark fringe.
    """
    from scipy import ndimage

    seen = image[..., 3] > 0
    if seen.all() or not seen.any():
        return image
    nearest = ndimage.distance_transform_edt(~seen, return_distances=False, return_indices=True)
    bled = image[tuple(nearest)]
    bled[..., 3] = image[..., 3]
    return bled
