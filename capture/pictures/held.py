"""Whether a drawing is held: nothing but grain and the codec's noise has changed since the picture before.

Grain changes sign from pixel to pixel and all over the window; an edge that has moved changes many neighbouring
pixels alike, and only there.  So differences are smoothed with their sign, and the largest of them are held against
what is usual in the rest of the window.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

SMOOTH = 1.5  # pixels: an edge that moves changes a band at least as wide
# grey levels, smoothed; an outline of 150 grey levels that moves by half a pixel makes 11, by 0.3 pixels 7
CLEAN = 3.5  # what a held drawing may change in a picture without noise
NOISY = 9.5  # and what it may in any: a new drawing changes more, however noisy the film
RISE = 2.0  # how much faster than the usual change the largest may grow: grain alone makes it 1.4


def is_held(before: NDArray, image: NDArray, window: tuple[slice, slice], where: NDArray | None = None) -> bool:
    """Whether two pictures (H, W, 3) show the same drawing in a window (rows, columns).

    Movement under about a third of a pixel passes for held; who compares with the picture that was last looked at,
    and not with the one just before, lets nothing slow slip by.  `where` (H, W), if given, is 1 at the pixels of the
    window that count.
    """
    change = cv2.subtract(image[window][..., :3], before[window][..., :3], dtype=cv2.CV_32F)
    change = cv2.GaussianBlur(change, (0, 0), SMOOTH)[::2, ::2]
    change -= np.median(change[::2, ::2], axis=(0, 1))  # film flickers as a whole
    size = np.sqrt(np.square(change).mean(axis=-1))
    if where is not None:
        size = size[where[window][::2, ::2] > 0]
    usual, most = np.percentile(size, [95, 99.5])
    return bool(most < min(CLEAN + RISE * usual, NOISY))
