"""Contour capture: affine map and key weights of points that are known in every frame (Bregler 2002, section 3.2)."""

import numpy as np
from numpy.typing import NDArray

from capture.fit import weights as key_weights
from capture.motion import affine, keys
from capture.motion.keys import KeySet


def capture_points(
    tracked: NDArray, keyset: KeySet, start: NDArray | None = None, rounds: int = 6
) -> tuple[NDArray, NDArray]:
    """Plain maps (T, d, d + 1) and weights (T, D) for mesh points seen at `tracked` (T, N, d) (eqs. 4-7).

    Map and weights alternate: they start from `start` (T, d, d + 1), or from key 0 alone.  The keys must be aligned
    (they are, in a KeySet), or the alternation settles wrongly.
    """
    tracked = np.asarray(tracked, float)
    shapes = keys.shapes(keyset)
    if len(shapes) == 1:
        return affine.fit(shapes[0], tracked), np.ones((len(tracked), 1))
    placed = affine.fit(keyset.points[0], tracked) if start is None else np.asarray(start, float)
    for _ in range(rounds):
        level = affine.apply(affine.invert(placed), tracked)
        found = key_weights.fit_weights(level, shapes, keyset.rows)
        placed = affine.fit(np.tensordot(found, shapes, axes=1), tracked)
    return placed, found
