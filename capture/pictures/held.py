"""Whether a drawing is held: nothing but grain and the codec's noise has changed since the picture before.

Grain changes sign from pixel to pixel and all over the window; an edge that has moved changes many neighbouring
pixels alike, and only there.  So differences are smoothed with their sign, and the largest of them are held against
what is usual in the rest of the window.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

SMOOTH = 1.5  # pixels: an edge that moves changes a band at least as wide
REST = 0.5 * np.sqrt(SMOOTH**2 - 1)  # of it, in pixels of the halved picture: halving smooths by 1
# grey levels, smoothed; an outline of 150 grey levels that moves by half a pixel makes 11, by 0.3 pixels 7
CLEAN = 3.5  # what a held drawing may change in a picture without noise
NOISY = 9.5  # and what it may in any: a new drawing changes more, however noisy the film
FEW = 0.005  # share of the window that says what the largest change is: a pixel by itself says nothing
RISE = 2.0  # how much faster than the usual change the largest may grow: grain alone makes it 1.4


def is_held(before: NDArray, image: NDArray, window: tuple[slice, slice], where: NDArray | None = None) -> bool:
    """Whether two pictures (H, W, 3) show the same drawing in a window (rows, columns).

    Movement under about a third of a pixel passes for held; who compares with the picture that was last looked at,
    and not with the one just before, lets nothing slow slip by.  `where`, if given, is the size of the window and 1 at
    the pixels that count.
    """
    change = cv2.subtract(image[window][..., :3], before[window][..., :3], dtype=cv2.CV_32F)
    change = cv2.GaussianBlur(cv2.pyrDown(change), (5, 5), REST)
    flicker = np.median(change[::4, ::4].reshape(-1, 3), axis=0)  # of the film as a whole
    change = cv2.subtract(change, (*flicker.tolist(), 0.0))
    square = cv2.transform(cv2.multiply(change, change), np.full((1, 3), 1 / 3))
    if where is not None:
        square = square[where[::2, ::2] > 0]
    few = FEW * square.size
    if np.count_nonzero(square >= NOISY**2) > few + 1:
        return False
    if np.count_nonzero(square >= CLEAN**2) < few - 1:
        return True
    usual, most = np.sqrt(np.percentile(square, [95, 100 * (1 - FEW)]))
    return bool(most < min(CLEAN + RISE * usual, NOISY))
