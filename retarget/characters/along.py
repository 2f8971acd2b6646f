"""How a shape that has no keys goes along with a source's: the same bends, lent in one of three ways.

A thin-plate spline of the source's outline follows it closely, and where that stretches the shape little it is taken.
By the faces' own turns and stretches (`ways`) slim limbs swing and keep their form, where the shape is built like the
source; laid on something else it crumples.  A spline that is evened out never does, but leaves out the ears that a cup
has not.  Of these two the one is taken that stretches the shape less.
"""

import numpy as np
from numpy.typing import NDArray

from capture.motion import affine, arap
from capture.motion.keys import KeySet
from retarget.characters import propose, ways
from retarget.characters.embed import embedding, silhouette_mesh

CLOSE, EVEN = 1e-4, 0.2
"""How much a spline is evened out against the outline's own, where one is the drawing's height."""

LITTLE = 1.5
"""Times its length: a shape that is stretched no more follows closely."""

MOST = 160
"""Outline points that a spline follows."""


def gone_along(solid: object, points: NDArray, source: KeySet, even: float = EVEN) -> NDArray:
    """Where points (P, 2) on a shape, shapely's `solid`, go in the source's K keys (K, P, 2); in the first they stay.

    Shape and source are laid box on box; `even` is how much the last of the three ways is evened out.
    """
    drawn = affine.apply(source.removed, source.points)[:, source.outline]
    box = np.reshape(solid.bounds, (2, 2))
    mesh, faces, edge = silhouette_mesh(solid, np.sqrt(solid.area) / propose.FACES_ACROSS)

    def stretch(stiffness: float) -> float:
        return stretch_of(mesh, by_spline(mesh, box, drawn, stiffness), faces)

    if stretch(CLOSE) < LITTLE:
        return by_spline(points, box, drawn, CLOSE)
    swung = by_ways(solid, mesh, faces, edge, source)
    if stretch_of(mesh, swung, faces) < stretch(even):
        carry = embedding(mesh, faces, points)
        return points + np.stack([carry @ (moved - mesh) for moved in swung])
    return by_spline(points, box, drawn, even)


def by_spline(points: NDArray, box: NDArray, drawn: NDArray, stiffness: float) -> NDArray:
    """Points (P, 2) of a shape in a box (2, 2) moved (K, P, 2) by thin-plate splines of outlines (K, B, 2)."""
    from scipy.interpolate import RBFInterpolator

    drawn = drawn[:, :: max(1, -(-drawn.shape[1] // MOST))]
    low, high = drawn[0].min(axis=0), drawn[0].max(axis=0)
    span = box[1] - box[0]
    tall = max(high[1] - low[1], 1e-9 * np.ptp(drawn))
    size = np.where(span > 0, (high - low) / np.where(span > 0, span, 1), 1.0)  # source pixels for a unit, in x and y
    at = ((points - box[0]) * size + low) / tall
    _, once = np.unique(np.round(drawn[0] / tall, 6), axis=0, return_index=True)  # a spline needs each place once
    moves = [np.zeros_like(points)]
    for key in drawn[1:]:
        bend = RBFInterpolator(drawn[0, once] / tall, (key - drawn[0])[once] / tall, smoothing=stiffness)
        moves.append(bend(at) * tall / size)
    return points + np.stack(moves)


def by_ways(solid: object, mesh: NDArray, faces: NDArray, edge: NDArray, source: KeySet) -> NDArray:
    """A mesh (N, 2) with its boundary's points `edge` in the source's keys (K, N, 2), by its faces' ways."""
    outline = affine.apply(source.removed, source.points)[0, source.outline]
    rim = propose.rim_of(solid)
    at = propose.corresponding(outline, rim)
    along, off = propose.nearest(mesh[edge], rim)
    near = off < 2 * propose.NECKS * np.sqrt(solid.area) + 1e-9
    piece = ways.pieces_of(len(mesh), faces)[edge]
    near |= ~np.isin(piece, piece[near])
    asked = ways.lent(ways.ways_of(source), mesh, faces, edge[near], propose.source_places(along[near], len(rim), at))
    return ways.followed(mesh, faces, asked)[0]


def stretch_of(mesh: NDArray, moved: NDArray, faces: NDArray) -> float:
    """By which factor one of a hundred faces is stretched or squashed in K keys (K, N, 2); inf if one folds."""
    _, stretches = arap.ways(mesh, moved, faces)
    if (np.linalg.det(stretches) < 0).any():
        return np.inf
    by = np.maximum(np.linalg.svd(stretches, compute_uv=False), 1e-3)
    return float(np.quantile(np.maximum(by, 1 / by).max(axis=2), 0.99))
