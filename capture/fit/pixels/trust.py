"""How much each pixel counts in a fit: some may belong to somebody else, who passes in front.

Far from the goal every pixel differs, so there the weights only fall off gently (Huber 1964) and the reach stays
wide.  Near the goal a pixel that still differs is not the layer's: its weight falls to nothing (Tukey's biweight).
"""

import numpy as np
from numpy.typing import NDArray

HUBER = 20.0  # grey levels; larger differences count linearly: they may be somebody else's pixels
SHARPEST = 2  # the coarsest level on which a pixel may lose its weight altogether
NEAR = 8.0  # times the step at which a level counts as done: from there on pixels may lose their weight
LEAST, MOST = 30.0, 120.0  # grey levels at which a pixel's weight is gone, in a calm picture and in a poor one
FINE, COARSE = 0.001, 0.1  # price of leaving a level's start, against what all pixels together would say


def weights(difference: NDArray, known: NDArray | None = None, gone: float | None = None) -> NDArray:
    """Weights (P,) of differences (P, C): gentle, or where `gone` is given falling off to nothing there.

    `known` (P,) tells how far each pixel can be seen.
    """
    weight = huber(difference) if gone is None else biweight(difference, gone)
    return weight if known is None else weight * known


def slack(level: int) -> float:
    """The price of leaving a level's start: four times as dear at every smaller size, for its pixels are fewer."""
    return min(FINE * 4**level, COARSE)


def mean_square(difference: NDArray, weight: NDArray) -> float:
    """Squared difference of a pixel (P, C), summed over channels, on the weighted average."""
    return float(weight @ np.einsum("pc,pc->p", difference, difference)) / max(float(weight.sum()), 1e-9)


def huber(difference: NDArray, threshold: float = HUBER) -> NDArray:
    """Weights (P,) of pixels by how far (P, C) they differ: 1 up to the threshold, then falling off."""
    return np.minimum(1.0, threshold / np.maximum(size_of(difference), 1e-9)).astype(difference.dtype)


def biweight(difference: NDArray, gone: float) -> NDArray:
    """Weights (P,) of pixels by how far (P, C) they differ: falling from 1 to 0 where they differ by `gone`."""
    left = 1.0 - (size_of(difference) / gone) ** 2
    return (np.maximum(left, 0) ** 2).astype(difference.dtype)


def size_of(difference: NDArray) -> NDArray:
    """How far pixels differ (P,), root mean square over their channels (P, C)."""
    return np.sqrt(np.einsum("pc,pc->p", difference, difference) / difference.shape[1])


def gone_at(size: NDArray, known: NDArray | None = None) -> float:
    """The size, in grey levels, from which on a pixel is somebody else's: nine times the usual (P,), within bounds."""
    size = size if known is None else size[known > 0.5]
    usual = float(np.median(size)) if len(size) else 0.0
    return float(np.clip(9.0 * usual, LEAST, MOST))
