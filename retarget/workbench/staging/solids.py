"""Models on the stage as a graphics card takes them: what stays is given once, and then only where points are.

A card's corner is a point of the model with one normal.  Where an edge is hard a point has several, so corners are
counted by point and by the faces that their normal is the sum of: N points become V corners, V little more than N.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from retarget.characters.models.mesh import DrawnMesh, Surface
from retarget.stage import draw2d
from retarget.stage.perform import Performance, Role

PIECE = 4 * 2**20  # bytes of points in one answer
TEXTURE = 2048  # pixels of a texture's longer edge: more is not seen on a page


@dataclass(frozen=True, eq=False)
class Corners:
    """A surface's V corners and F faces, by material; their normals are sums of faces' normals."""

    point: NDArray  # (V,) uint32, the model's point that a corner is
    faces: NDArray  # (F, 3) uint32 corners, the first material's faces first
    spans: tuple[tuple[int, int, int], ...]  # material, its first face, how many
    first: NDArray  # (V + 1,) uint32, where a corner's faces begin in `beside`
    beside: NDArray  # (E,) uint32 faces
    uv: NDArray  # (V, 2) float32
    colors: NDArray | None  # (V, 4) float32


def is_solid(role: Role) -> bool:
    """Whether a role is a model in space."""
    return role.points.shape[-1] == 3


def told(performance: Performance) -> dict[str, Any]:
    """All roles in short, the size of the stage, and how far down the ground is."""
    roles = [_solid(role) if is_solid(role) else _flat(role) for role in performance.roles]
    return {"roles": roles, "size": list(performance.size), "ground": ground(performance)}


def ground(performance: Performance) -> float:
    """How far down (pixels) the models' lowest points come, but for a few frames."""
    lowest = [role.mesh()[..., 1].max(axis=1) for role in performance.roles if is_solid(role)]
    return float(np.percentile(np.max(lowest, axis=0), 95)) if lowest else float(performance.size[1])


@lru_cache(maxsize=8)
def corners(surface: Surface) -> Corners:
    """A surface's corners; the same surface is asked for once and again."""
    order = np.argsort(surface.number, kind="stable")
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    table = surface.smooth.tocsr()
    mark = np.random.default_rng(7).integers(1, 2**40, len(order))  # whole numbers: their sums are exact
    sums = np.add.reduceat(mark[table.indices], table.indptr[:-1])  # no corner is without faces
    keys = np.column_stack([surface.faces.ravel(), sums])
    _, chosen, corner = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    own = table[chosen]
    point = surface.faces.ravel()[chosen]
    materials, firsts, counts = np.unique(surface.number[order], return_index=True, return_counts=True)
    return Corners(
        point.astype(np.uint32),
        corner.reshape(-1, 3)[order].astype(np.uint32),
        tuple(zip(materials.tolist(), firsts.tolist(), counts.tolist(), strict=True)),
        own.indptr.astype(np.uint32),
        rank[own.indices].astype(np.uint32),
        surface.uv[point].astype(np.float32),
        None if surface.colors is None else surface.colors[point].astype(np.float32),
    )


def packed(role: Role) -> tuple[bytes, dict[str, int]]:
    """What stays of a model, array after array, and how long each is: faces, first, beside, uv, colours."""
    found = corners(_drawn(role).surface)
    arrays: list[NDArray] = [found.faces, found.first, found.beside, found.uv]
    arrays += [] if found.colors is None else [found.colors]
    counts = {"corners": len(found.point), "faces": len(found.faces), "beside": len(found.beside)}
    return _bytes(arrays), {**counts, "colored": int(found.colors is not None)}


def places(role: Role, first: int, count: int) -> tuple[bytes, int]:
    """The corners' places (n, V, 3) float32 in pixels of the stage, in at most `count` frames from `first`."""
    point = corners(_drawn(role).surface).point
    most = max(1, PIECE // (12 * len(point)))
    count = min(count, most, len(role.points) - first)
    return _bytes([role.points[first : first + count, point].astype(np.float32)]), count


def texture(role: Role, number: int) -> NDArray:
    """A material's texture (h, w, 3 or 4): with alpha only where that cuts something out, as it is drawn."""
    import cv2

    materials = _drawn(role).surface.materials
    if number >= len(materials) or materials[number].texture is None:
        raise InputError(f"material {number} must have a texture to be shown, it has none: reload the page")
    pixels = materials[number].texture
    factor = TEXTURE / max(pixels.shape[:2])
    if factor < 1:
        size = tuple(max(1, round(length * factor)) for length in pixels.shape[1::-1])
        pixels = cv2.resize(pixels, size, interpolation=cv2.INTER_AREA)
    return pixels if materials[number].cut_out else pixels[..., :3]


def flat(performance: Performance, number: int, t: int) -> NDArray:
    """A drawing alone (H, W, 4) on the stage's page in frame t."""
    role = performance.roles[number]
    things = role.target.posed(role.points[t], role.weights[t], role.scale) if role.visible[t] else []
    return draw2d.draw_things(things, performance.size)


def _drawn(role: Role) -> DrawnMesh:
    return role.target.posed(role.points[0], role.weights[0], role.scale)[0]


def _solid(role: Role) -> dict[str, Any]:
    drawn = _drawn(role)
    eye = None if drawn.eye is None else float(drawn.eye[2] - drawn.points[:, 2].mean())
    looks = [
        {"color": list(map(float, one.color)), "textured": one.texture is not None, "cut_out": one.cut_out}
        for one in drawn.surface.materials
    ]
    spans = [list(span) for span in corners(drawn.surface).spans]
    middles = [] if eye is None else np.round(role.points.mean(axis=1), 3).tolist()
    return {"solid": True, "eye": eye, "middles": middles, "materials": looks, "spans": spans, **_times(role)}


def _flat(role: Role) -> dict[str, Any]:
    return {"solid": False, **_times(role)}


def _times(role: Role) -> dict[str, Any]:
    return {"visible": role.visible.astype(int).tolist(), "order": np.asarray(role.order).astype(int).tolist()}


def _bytes(arrays: Iterable[NDArray]) -> bytes:
    return b"".join(np.ascontiguousarray(one).tobytes() for one in arrays)
