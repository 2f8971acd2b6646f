"""Colours laid over a page, pixel by pixel; both have straight alpha."""

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray


def lay(below: NDArray, color: NDArray, alpha: NDArray) -> None:
    """Lay colours (h, w, 3), 0-1, of alpha (h, w) over uint8 pixels (h, w, 4), in place.

    Where nothing is laid, nothing changes.  The machine code by numba takes a tenth of NumPy's time: it is the step
    that every pixel of a photograph or a gradient goes through.
    """
    color = np.broadcast_to(color, (*alpha.shape, 3))
    _compiled()(below, np.ascontiguousarray(color, np.float32), np.ascontiguousarray(alpha, np.float32))


@lru_cache(maxsize=1)
def _compiled() -> Callable:
    from numba import njit

    try:
        return njit(_lay, cache=True)
    except RuntimeError:  # there is no folder where the machine code could be kept
        return njit(_lay)


def _lay(below: NDArray, color: NDArray, alpha: NDArray):  # noqa: ANN202 - numba reads this too
    height, width = alpha.shape
    for y in range(height):
        for x in range(width):
            over = alpha[y, x]
            if over <= 0:
                continue
            under = below[y, x, 3] / np.float32(255) * (1 - over)
            total = over + under
            for channel in range(3):
                mixed = (255 * color[y, x, channel] * over + below[y, x, channel] * under) / total
                below[y, x, channel] = np.uint8(min(max(mixed, 0), 255) + np.float32(0.5))
            below[y, x, 3] = np.uint8(min(255 * total, 255) + np.float32(0.5))
