"""3-D models that play a part: key shapes are morph targets of a file, or several files of one mesh.

A model is seen in a plane, where it is a character like any other: of its keys the affine map that is seen there is
taken out (eq. 5), and the captured one is put back.  A turn towards the viewer, which no captured map could put back,
so stays with the key.  In-betweens go straight, as morph targets do everywhere.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.motion import affine, keys
from capture.motion.keys import Inbetweener, KeySet
from retarget.characters.models import lift
from retarget.characters.models.lift import Depth
from retarget.characters.models.meshfiles import read_model
from retarget.characters.models.model import Material, Model

CREASE = np.cos(np.radians(50))
"""Faces that meet at a sharper angle than this have an edge between them, where the file has no normals to say so."""

LARGEST = 4096
"""The longest edge of a texture that is used; a larger one is made smaller."""

MANY = 64
"""At most this many faces round one point are mixed into a normal, evenly chosen: a fan may have thousands."""


@dataclass(frozen=True, eq=False)
class Surface:
    """What the skin of a model looks like, whatever its shape."""

    faces: NDArray  # (F, 3)
    uv: NDArray  # (N, 2) in textures, from their top-left corner
    number: NDArray  # (F,) which material
    materials: tuple[Material, ...]
    colors: NDArray | None  # (N, 4) sRGB
    smooth: object  # sparse (3 F, F): the faces whose normals make up the normal at each corner

    @cached_property
    def packed(self) -> tuple[NDArray, NDArray, NDArray]:
        """All textures in one row, in ever smaller sizes: texels (P, 4) premultiplied, and where they lie.

        Sizes (L, 3) are [start, height, width]; looks (M, 7) are a material's red, green, blue, alpha, its first size,
        how many it has, and whether it is cut out.
        """
        texels, sizes, looks = [np.ones((1, 4), np.float32)], [], []
        for material in self.materials:
            levels = () if material.texture is None else _smaller(material)
            looks.append((*material.color, len(sizes), len(levels), material.cut_out))
            for level in levels:
                sizes.append((sum(map(len, texels)), *level.shape[:2]))
                texels.append(level.reshape(-1, 4))
        return np.concatenate(texels), np.array(sizes or [(0, 1, 1)]), np.array(looks, float)


@dataclass(frozen=True, eq=False)
class DrawnMesh:
    """A model posed on the page."""

    points: NDArray  # (N, 3) x right, y down, z to the viewer, all in page pixels
    surface: Surface
    eye: NDArray | None = None  # (3,) where the viewer is; None sees without perspective


@dataclass(frozen=True, eq=False)
class Mesh:
    """A 3-D model as a target, in the units of its file, y up."""

    part: str
    keys: KeySet  # of 3-D points
    box: NDArray  # (2, 2) of key 0 as it is seen: right and down
    view: NDArray  # (3, 4) from its own space to what is seen: right, down, and to the viewer from its middle
    surface: Surface
    depth: Depth = lift.kept
    distance: float | None = None  # of the viewer, times the longest edge of key 0; None sees without perspective
    between: Inbetweener = keys.straight
    height: float = 1.0
    pivot: NDArray | None = None  # (3,) in key 0

    def shapes(self, rows: NDArray) -> NDArray:
        """The points (D, N, 3) for rows (D, 3)."""
        return keys.shapes(keys.with_rows(self.keys, rows), self.between)

    def posed(self, points: NDArray, weights: NDArray, scale: float) -> list[DrawnMesh]:
        """The model on points (N, 3) of the stage; with perspective it is looked at on a level with its middle."""
        eye = None
        if self.distance is not None:
            away = self.distance * scale * np.ptp(self.keys.points[0], axis=0).max()
            eye = points.mean(axis=0) + [0, 0, away]
        return [DrawnMesh(points, self.surface, eye)]


def read_mesh(
    part: str,
    names: tuple[str, ...],
    files: Sequence[str | Path],
    morphs: Sequence[Mapping[str, float]] = (),
    plane: str | Sequence[float] = "xy",
    depth: Depth = lift.kept,
) -> Mesh:
    """A character from a model file for every key, or from one file for all of them.

    `morphs` says for each key which of its file's morph targets it is made of, and how much of each.  A key without
    any is the morph target of its own name; else the file's own shape, if no other key is that.
    """
    read = {path: read_model(path) for path in map(Path, dict.fromkeys(files))}
    told = [dict(of_key) for of_key in morphs] or [{} for _ in names]
    plain: dict[Path, str] = {}
    shapes = []
    for name, path, mixture in zip(names, map(Path, files), told, strict=True):
        model, known = read[path], {target.lower(): target for target in read[path].morphs}
        if not mixture and name.lower() in known:
            mixture = {known[name.lower()]: 1.0}
        missing = [target for target in mixture if target not in model.morphs]
        if missing or (not mixture and path in plain):
            asked = f"{name!r} asks for {missing[0]!r}" if missing else f"{plain[path]!r} and {name!r} name none"
            raise InputError(
                f"part {part!r}: a key must be a morph target of its model, {path} has "
                f"{', '.join(model.morphs) or 'none'}, and {asked}: give it morphs = {{ NAME = 1.0 }} or its own file"
            )
        if not mixture:
            plain[path] = name
        shapes.append(model.points + sum((share * model.morphs[target] for target, share in mixture.items()), 0.0))
    first = read[Path(files[0])]
    for path, model in read.items():
        _check_alike(first, model, str(files[0]), str(path))
    return mesh(part, names, first, np.stack(shapes), plane, depth)


def mesh(
    part: str,
    names: tuple[str, ...],
    model: Model,
    shapes: NDArray,
    plane: str | Sequence[float] = "xy",
    depth: Depth = lift.kept,
) -> Mesh:
    """A character from a model and its key shapes (K, N, 3)."""
    shapes = np.asarray(shapes, float)
    turn = lift.view(plane)
    used = np.unique(model.faces)
    seen = shapes[0, used] @ turn.T
    low, high = seen.min(axis=0), seen.max(axis=0)
    if (high - low)[:2].max() <= 0:
        raise InputError(f"part {part!r}: a model must be seen in its plane, it has no width or height there: turn it")
    view = np.column_stack([turn, [0.0, 0.0, -0.5 * (low[2] + high[2])]])
    removed = removed_maps(affine.apply(view, shapes), used, view, depth)
    aligned = affine.apply(affine.invert(removed), shapes)
    keyset = KeySet(tuple(names), aligned, model.faces, used, keys.inbetween_rows(len(names)), removed)
    surface = surface_of(replace(model, points=shapes[0]))
    return Mesh(part, keyset, np.stack([low[:2], high[:2]]), view, surface, depth)


def surface_of(model: Model) -> Surface:
    """What a model looks like in any shape; where its edges are hard is seen in the shape it has."""
    return Surface(model.faces, model.uv, model.surface, model.materials, model.colors, _smooth(model.points, model))


def _check_alike(first: Model, other: Model, file: str, path: str) -> None:
    rule = f"{path} must be the same mesh as {file} in another shape"
    if len(other.points) != len(first.points):
        raise InputError(
            f"{rule}: it has {len(other.points)} points, not {len(first.points)}; edit a copy of the first"
        )
    if not np.array_equal(other.faces, first.faces):
        raise InputError(f"{rule}: it joins its points to other faces; edit a copy of the first")


def removed_maps(seen: NDArray, used: NDArray, view: NDArray, depth: Depth) -> NDArray:
    """The maps (K, 3, 4) of a model's space from an aligned key to the key, for keys as they are seen (K, N, 3).

    In the plane they are those of eq. 5, as for a drawing; depth follows by its rule.
    """
    flat = keys.against(seen[0, used, :2], seen[:, used, :2], keeps_stretch=False)
    flat[0] = affine.identity()
    squashed = np.flatnonzero(np.linalg.cond(flat[..., :-1]) > 1e8)
    if len(squashed):
        raise InputError(
            f"a key must not be squashed flat where it is seen, key {squashed[0]} (counted from 0) is against key 0: "
            "shape it again, or choose another plane"
        )
    return affine.compose(affine.invert(view), affine.compose(lift.lifted(flat, depth(flat)), view))


def _smooth(points: NDArray, model: Model) -> object:
    """Which faces share a normal with each corner: those round the same place, unless an edge lies between.

    Points that lie in one place count as one, so that seams of textures do not show.
    """
    from scipy import sparse

    faces = model.faces
    corners = points[faces]
    if model.normals is not None:
        facing, least = model.normals[faces].reshape(-1, 3), 0.95
    else:
        facing, least = np.repeat(np.cross(*np.moveaxis(corners[:, 1:] - corners[:, :1], 1, 0)), 3, axis=0), CREASE
    facing = facing / np.maximum(np.linalg.norm(facing, axis=1, keepdims=True), 1e-30)
    fine = max(np.ptp(points, axis=0).max(), 1e-30) * 1e-6
    place = np.unique(np.round(points / fine).astype(np.int64), axis=0, return_inverse=True)[1].ravel()[faces].ravel()
    order = np.argsort(place, kind="stable")
    counts = np.bincount(place)
    starts = np.cumsum(counts) - counts
    reach = np.minimum(counts[place], MANY)  # how many faces each corner looks at
    corner = np.repeat(np.arange(3 * len(faces)), reach)
    step = np.arange(len(corner)) - np.repeat(np.cumsum(reach) - reach, reach)
    other = order[starts[place[corner]] + step * counts[place[corner]] // np.repeat(reach, reach)]
    agree = (corner == other) | ((facing[corner] * facing[other]).sum(axis=1) > least)
    corner = np.concatenate([corner[agree], np.arange(3 * len(faces))])  # its own face always counts
    other = np.concatenate([other[agree], np.arange(3 * len(faces))])
    table = sparse.csr_matrix((np.ones(len(corner)), (corner, other // 3)), shape=(3 * len(faces), len(faces)))
    table.data[:] = 1.0
    return table


def _smaller(look: Material) -> tuple[NDArray, ...]:
    """A material's texture premultiplied, then halved down to a few pixels, so that a small model does not flicker."""
    pixels = look.texture.astype(np.float32) / 255
    if not look.cut_out:
        pixels[..., 3] = 1
    pixels[..., :3] *= pixels[..., 3:]
    sizes = [_within(pixels, LARGEST)]
    while max(sizes[-1].shape[:2]) > 2:
        height, width = sizes[-1].shape[:2]
        sizes.append(_within(sizes[-1], (max(width, height) + 1) // 2))
    return tuple(sizes)


def _within(pixels: NDArray, most: int) -> NDArray:
    """A picture made smaller until its longer edge is at most `most`."""
    import cv2

    height, width = pixels.shape[:2]
    factor = most / max(width, height)
    if factor >= 1:
        return pixels
    return cv2.resize(
        pixels, (max(1, round(width * factor)), max(1, round(height * factor))), interpolation=cv2.INTER_AREA
    )
