"""Contour capture: affine map and key weights of points that are known in every frame (Bregler 2002, section 3.2).

A convex start finds the weights without the map; then map and weights alternate as a polish (eqs. 6 and 7).  With a
smoothness the weights of the whole clip are solved at once, which the paper leaves to the future: second differences of
the shape over time are held down, and nothing lags.  The map is left alone: a landing is meant to be hard.
"""

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.fit.shapes import weights as key_weights
from capture.fit.shapes.convex_start import convex_start
from capture.motion import affine, keys, triangulate
from capture.motion.keys import KeySet
from capture.motion.tracks import CartoonMotion, track_of

BOUNDS = (-0.5, 1.5)


def capture_points(
    tracked: NDArray,
    keyset: KeySet,
    start: NDArray | None = None,
    rounds: int = 6,
    smoothness: float = 0.0,
    drawing: NDArray | None = None,
    most: int = key_weights.MOST,
    bounds: tuple[float, float] = BOUNDS,
) -> tuple[NDArray, NDArray]:
    """Plain maps (T, d, d + 1) and weights (T, D) for mesh points seen at `tracked` (T, N, d) (eqs. 4-7).

    They start from the maps `start` (T, d, d + 1), or from the convex problem.  A key set that keeps its stretch gets
    maps that only turn and shift: preservation of volume, constraint 2.  `smoothness` is the half-width, in frames,
    over which an error of one frame is spread; frames in a row with the same number in `drawing` (T,) are one held
    drawing.
    """
    tracked = _checked(tracked, keyset)
    shapes = keys.shapes(keyset)
    rows, rigid = keyset.rows, keyset.keeps_stretch
    options = {"most": most, "bounds": bounds}

    def place(found: NDArray) -> NDArray:
        return keys.against(np.tensordot(found, shapes, axes=1), tracked, rigid)

    if len(shapes) == 1:
        found = np.ones((len(tracked), 1))
        return place(found), found
    if start is None:
        found = convex_start(tracked, shapes, rows, bounds)
        placed = place(found)
    else:
        placed = np.asarray(start, float)
    for _ in range(rounds):
        level = affine.apply(affine.invert(placed), tracked)
        if smoothness and len(tracked) > 2:
            found = key_weights.fit_smooth(level, shapes, rows, smoothness, drawing=drawing, **options)
        else:
            found = key_weights.fit_weights(level, shapes, rows, **options)
        placed = place(found)
    return placed, found


def loosened(
    tracked: NDArray, keyset: KeySet, placed: NDArray, weights: NDArray, loose: float, rounds: int = 2
) -> tuple[NDArray, NDArray]:
    """Maps and weights that come nearer to the tracked points (T, N, d) with a little of all rows.

    Three rows at a time leave a fifth more of a drawing outside the keys' span than need be, and jump from one three
    to the next, by up to half a pixel.  What they leave is spread over all rows by ridge regression: `loose` pixels of
    misfit are worth a weight of 1.
    """
    shapes = keys.shapes(keyset)
    count, points = shapes.shape[:2]
    if count == 1 or loose <= 0:
        return placed, weights
    ridge = loose * np.sqrt(points) * np.eye(count)  # as coordinates of their own, in which rows have nothing in common
    wide, sparse = np.hstack([shapes.reshape(count, -1), ridge]), weights
    for _ in range(rounds):
        level = affine.apply(affine.invert(placed), tracked).reshape(len(tracked), -1)
        weights = key_weights.fit_dense(np.hstack([level, sparse @ ridge]), wide, BOUNDS)
        placed = keys.against(np.tensordot(weights, shapes, axes=1), tracked, keyset.keeps_stretch)
    return placed, weights


def capture_outlines(
    outlines: NDArray,
    key_frames: NDArray,
    fps: float = 24.0,
    size: tuple[int, int] = (640, 480),
    part: str = "character",
    smoothness: float = 0.0,
    keeps_stretch: bool = False,
) -> CartoonMotion:
    """The motion of one part whose outline (T, N, 2), with corresponding points, is known in every frame.

    The keys are the outlines at `key_frames` (K,).  `smoothness` is in seconds.
    """
    outlines = np.asarray(outlines, float)
    keyset, points = outline_keys(outlines, key_frames, keeps_stretch=keeps_stretch)
    still = np.abs(np.diff(points, axis=0)).max(axis=(1, 2)) < 1e-6 * np.ptp(points, axis=1).max()
    held = np.concatenate([[False], still])
    drawing = np.cumsum(~held)
    placed, weights = capture_points(points, keyset, smoothness=smoothness * fps, drawing=drawing)
    shape = np.tensordot(weights, keys.shapes(keyset), axes=1)
    off = np.linalg.norm(affine.apply(placed, shape) - points, axis=-1)
    track = track_of(part, keyset, placed, weights, np.sqrt((off**2).mean(axis=1)), held=held)
    return CartoonMotion((track,), (keyset,), np.arange(len(points)) / fps, float(fps), size)


def outline_keys(
    outlines: NDArray,
    frames: NDArray,
    names: tuple[str, ...] | None = None,
    inbetweens: int = 5,
    keeps_stretch: bool = False,
) -> tuple[KeySet, NDArray]:
    """A key set of outlines (T, N, 2) at the given frames (K,), without an inside, and all outlines on its points.

    The first of the frames is what the others are aligned to; its outline must not cross itself.  A contour that is
    known in every frame needs no inside.  Where the mesh halves a step of the outline, so do the
    outlines that are returned, (T, N', 2): they fit `contour.capture_points`.
    """
    frames = np.asarray(frames, int)
    both = np.concatenate([outlines[frames], outlines])
    both, loop, inside, faces = triangulate.triangulate(both, spacing=2 * float(np.ptp(outlines, axis=1).max()))
    if len(inside):  # a lattice point may still fall inside: it is not seen, so it is not used
        faces = faces[(faces < both.shape[1]).all(axis=1)]
    aligned, removed = keys.align(both[: len(frames)], loop, keeps_stretch)
    names = tuple(f"k{frame}" for frame in frames) if names is None else names
    rows = keys.inbetween_rows(len(frames), inbetweens)
    return KeySet(names, aligned, faces, loop, rows, removed, keeps_stretch), both[len(frames) :]


def _checked(tracked: NDArray, keyset: KeySet) -> NDArray:
    tracked = np.asarray(tracked, float)
    if tracked.ndim != 3 or tracked.shape[1:] != keyset.points.shape[1:]:
        raise InputError(
            f"tracked points must be (T, {keyset.points.shape[1]}, {keyset.points.shape[2]}) like the key set's, "
            f"they came as {tracked.shape}: give every point of the mesh in every frame"
        )
    if not np.isfinite(tracked).all():
        frame = int(np.argmin(np.isfinite(tracked).all(axis=(1, 2))))
        raise InputError(f"tracked points must be finite numbers, frame {frame} holds NaN or infinity: fill it in")
    return tracked
