"""3-D models as a 3-D file takes them: one piece for each material, with a normal at every vertex.

A file knows one normal for a vertex, so vertices on a hard edge are doubled.  The shapes are the keys themselves: a
model's in-betweens go straight, and so do morph targets.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from capture.motion import affine
from retarget.characters.models.mesh import Mesh, Surface
from retarget.export.sheets import Look

ALIKE = 1e-3
"""Normals at corners of one point that differ less than this, as parts of 1, are one normal."""


@dataclass(frozen=True, eq=False)
class Piece:
    """What a model shows in one material: V vertices of their own."""

    points: NDArray  # (V,) the model's points that they are
    faces: NDArray  # (F, 3)
    normals: NDArray  # (K, V, 3) in the body's own space
    color: tuple[float, float, float, float]
    colors: NDArray | None  # (V, 4) sRGB
    look: Look | None


def pieces(target: Mesh, own: NDArray) -> list[Piece]:
    """A model's pieces; `own` (3, 4) brings its points into the body's own space, unmirrored."""
    surface = target.surface
    corners = np.stack([_normals(affine.apply(own, shape), surface) for shape in target.keys.points])  # (K, F, 3, 3)
    found = []
    for number, material in enumerate(surface.materials):
        chosen = surface.number == number
        if not chosen.any():
            continue
        point, at = surface.faces[chosen].ravel(), corners[:, chosen].reshape(len(corners), -1, 3)
        kinds = np.column_stack([point, np.round(at[0] / ALIKE)]).astype(np.int64)
        _, first, vertex = np.unique(kinds, axis=0, return_index=True, return_inverse=True)
        look = None
        if material.texture is not None:
            texture = material.texture.copy()
            if not material.cut_out:
                texture[..., 3] = 255
            look = Look(texture, surface.uv[point[first]], repeats=True)
        colors = None if surface.colors is None else surface.colors[point[first]]
        found.append(Piece(point[first], vertex.reshape(-1, 3), at[:, first], material.color, colors, look))
    return found


def _normals(points: NDArray, surface: Surface) -> NDArray:
    """Unit normals (F, 3, 3) at the corners of faces."""
    corners = points[surface.faces]
    mixed = (surface.smooth @ np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])).reshape(-1, 3, 3)
    length = np.linalg.norm(mixed, axis=-1, keepdims=True)
    return np.where(length > 0, mixed / np.maximum(length, 1e-300), [0.0, 0.0, 1.0])
