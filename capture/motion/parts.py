"""Sub-parts of one drawing: shares, soft seams and joints (Bregler et al. 2002, section 3.1.4).

    x(v, t) = sum_p b_p(v) sum_d w_pd(t) S_pd(v)        shape
    v(t)    = sum_p b_p(v) A_p(t) x(v, t)               place

All parts are parts of one mesh, and a point v belongs to them with shares b_p(v) that sum to 1.
"""

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.motion import affine, keys, tracks
from capture.motion.tracks import CartoonMotion


def soft_shares(points: NDArray, regions: list[NDArray], softness: float) -> NDArray:
    """Shares (N, P) of points (N, 2) in P regions, each a closed outline (B, 2).

    Where regions meet or overlap the shares pass from one to the other over about `softness` pixels; a point outside
    of all goes to the nearest.
    """
    import shapely

    if not softness > 0:
        raise InputError(
            f"a seam's softness must be above 0 pixels, got {softness:g}: say over how many pixels it blends"
        )
    points = np.asarray(points, float)
    depth = np.empty((len(points), len(regions)))  # pixels inside a region, negative outside
    for number, region in enumerate(regions):
        area = shapely.Polygon(region)
        if not area.is_valid or area.area == 0:
            raise InputError(f"a region must be a closed outline that does not cross itself, number {number} is none")
        away = shapely.distance(area.exterior, shapely.points(points))
        depth[:, number] = np.where(shapely.contains_xy(area, *points.T), away, -away)
    behind = (depth - depth.max(axis=1, keepdims=True)) / softness  # 0 for the part it lies deepest in
    level = np.clip(1 + behind, 0, 1)
    level = level * level * (3 - 2 * level)
    return level / level.sum(axis=1, keepdims=True)


def blended(shares: NDArray, shapes: NDArray, maps: NDArray) -> NDArray:
    """Places (T, N, d) of points with shares (N, P), from parts' shapes (P, T, N, d) and maps (P, T, d, d + 1)."""
    shape = np.einsum("np,ptnd->tnd", shares, shapes)
    return np.einsum("np,ptnd->tnd", shares, affine.apply(maps, shape[None]))


def body(motion: CartoonMotion, shares: NDArray) -> NDArray:
    """Where all points (T, N, d) of a motion whose parts share one mesh are; shares (N, P) in the tracks' order."""
    counts = {keyset.points.shape[1] for keyset in motion.keysets}
    if counts != {len(shares)} or shares.shape[1] != len(motion.tracks):
        raise InputError(
            f"shares must be given for every point and part, their shape is {shares.shape}, the motion has "
            f"{len(motion.tracks)} parts of {', '.join(str(count) for count in sorted(counts))} points"
        )
    shapes, maps = [], []
    for track, keyset in zip(motion.tracks, motion.keysets):
        rows = keys.shapes(keys.with_rows(keyset, track.rows))
        shapes.append(np.tensordot(track.weights, rows, axes=1))
        maps.append(tracks.total_affine(motion, track.part))
    return blended(shares, np.stack(shapes), np.stack(maps))
