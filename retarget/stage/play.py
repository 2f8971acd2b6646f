"""Motion meets a drawing with marked joints: all parts move one body, each point by its shares.

    v(t) = sum_p b_p(v) A_p(t) v        DESIGN's place equation, the shape being the drawing's own

The maps act about the drawing's own joints and each hangs on its parent's, so a drawing of other proportions than the
one the motion was made for stays in one piece.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from capture.motion import affine
from capture.motion.tracks import CartoonMotion, total_affine
from retarget.characters.bodies.marked import MarkedDrawing, MarkedPicture, Piece, Segments, segments
from retarget.characters.models.mesh import mesh
from retarget.characters.models.model import Model
from retarget.characters.target import REST
from retarget.stage.perform import Performance, Role

EDGE = 8.0
"""Pixels between a drawing and the edge of its page."""


def play(motion: CartoonMotion, character: MarkedPicture | MarkedDrawing) -> Performance:
    """Let a marked drawing play a motion that `to_tracks` made; limbs are drawn in the motion's order."""
    parts = segments(character.marks, tuple(track.part for track in motion.tracks))
    maps, scale = maps_of(motion, parts)
    orders = np.stack([track.order for track in motion.tracks])
    return hung_on(character.pieces(parts), parts, maps, orders, motion.times, motion.fps, motion.size, scale)


def maps_of(motion: CartoonMotion, parts: Segments) -> tuple[NDArray, float]:
    """How its parts move a drawing: maps (P, T, 2, 3) from its own pixels to the page, and how large it is there."""
    scale, place = _placed(motion, parts.starts, parts.stops)
    pivots = dict(zip(parts.names, affine.apply(place, parts.starts), strict=True))
    maps = np.stack([total_affine(motion, name, pivots) for name in parts.names])
    return affine.compose(maps, place), scale


def hung_on(
    pieces: Sequence[Piece],
    parts: Segments,
    maps: NDArray,
    orders: NDArray,
    times: NDArray,
    fps: float,
    size: tuple[int, int],
    scale: float = 1.0,
) -> Performance:
    """The pieces of a drawing moved by its parts' maps (P, T, 2, 3), which have an order (P, T), on a page."""
    roles = []
    for piece in pieces:
        first = parts.limbs.index(piece.limb)
        joint = affine.apply(maps[first], parts.starts[first][None])[:, 0]
        order = np.full_like(orders[first], orders.min() - 1) if piece.behind else orders[first]
        roles.append(_role(piece, maps, order, scale, joint))
    return _on_page(Performance(tuple(roles), times, fps, size))


def play_mesh(
    points: NDArray,
    model: Model,
    fps: float,
    plane: str | Sequence[float] = "xy",
    height: int = 480,
    distance: float | None = None,
) -> Performance:
    """A model that goes through points (T, N, 3) in its own space, y up, as it is seen in a plane.

    The page holds its whole way and is `height` pixels high; `distance` is that of the viewer, times the model's size.
    """
    target = replace(mesh("figure", (REST,), model, points[:1], plane), distance=distance)
    seen = affine.apply(target.view, points)
    low, high = seen[..., :2].min(axis=(0, 1)), seen[..., :2].max(axis=(0, 1))
    scale = float((height - 2 * EDGE) / max(high[1] - low[1], 1e-12))
    seen = seen * scale
    seen[..., :2] += EDGE - scale * low
    ones, frames = np.ones((len(points), 1)), len(points)
    role = Role(
        target,
        seen,
        ones,
        scale,
        np.ones(frames, bool),
        np.zeros(frames, int),
        np.zeros((1, 3)),
        ones,
        seen.mean(axis=1)[:, :2],
    )
    return Performance(
        (role,), np.arange(frames) / fps, fps, (int(np.ceil(scale * (high - low)[0] + 2 * EDGE)), height)
    )


def _on_page(performance: Performance) -> Performance:
    """The performance on a page made larger where the drawing reaches farther than its joints, over the edge."""
    every = np.concatenate([role.points.reshape(-1, 2) for role in performance.roles])
    before = np.ceil(np.maximum(EDGE - every.min(axis=0), 0))
    after = np.ceil(np.maximum(every.max(axis=0) + EDGE - performance.size, 0))
    size = tuple(int(edge) for edge in performance.size + before + after)
    roles = tuple(replace(role, points=role.points + before, joint=role.joint + before) for role in performance.roles)
    return replace(performance, roles=roles, size=size)


def _placed(motion: CartoonMotion, starts: NDArray, stops: NDArray) -> tuple[float, NDArray]:
    """How large the drawing is on the motion's page, and the similarity (2, 3) that puts root on root."""
    quads = [keyset.points[0] for keyset in motion.keysets]
    there = sum(np.linalg.norm(quad[1:3].mean(axis=0) - quad[[0, 3]].mean(axis=0)) for quad in quads[1:])
    scale = there / np.linalg.norm(stops - starts, axis=1)[1:].sum()
    if abs(scale - 1) < 1e-9:
        scale = 1.0
    linear = scale * np.eye(2)
    return float(scale), np.column_stack([linear, motion.tracks[0].pivot - linear @ starts[0]])


def _role(piece: Piece, maps: NDArray, order: NDArray, scale: float, joint: NDArray) -> Role:
    frames = maps.shape[1]
    rest = piece.target.shapes(np.zeros((1, 3)))[0]  # (M, 2), aligned to key 0, which is as it was drawn
    mixed = np.tensordot(piece.shares, maps, axes=1)  # (M, T, 2, 3)
    points = np.einsum("mtij,mj->tmi", mixed[..., :2], rest) + np.swapaxes(mixed[..., 2], 0, 1)
    ones = np.ones((frames, 1))
    return Role(piece.target, points, ones, scale, np.ones(frames, bool), order, np.zeros((1, 3)), ones, joint)
