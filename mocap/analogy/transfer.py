"""What turns one curve into another, and the same done to a third (Wu et al. 2008, sections 3.3 to 3.5).

Every channel has a scale a(t) and an offset b(t), both smooth: M_A' = a M_A + b, and B' = a M_B + b.  What is too quick
for them, a shake that only A' has, goes along as it is: then B = A gives B' = A'.
"""

import numpy as np
from numpy.typing import NDArray

SMOOTH = 2.0
"""Weight of the first differences of a and b at 30 frames a second, against the misfit of the curve."""

KEEP = 1e-3
"""Weight of (a - 1)^2, against channels of unit size: the offset does what a scale need not."""


ASTRAY = 0.3
"""So far, as a share, a mean may be off the scale's, to be half taken for scaled."""


def transferred(scale: NDArray, one: NDArray, two: NDArray, three: NDArray, held: NDArray | float = 0.0) -> NDArray:
    """What becomes of curves `three` (T, C) if `two` is to `one` as it is to them, all in one time (eq. 7).

    The offset and what neither it nor the scale (T, C) told of `two` are, together, two - scale one.  By `held` (C,),
    B's own mean is held against the scale (see `holding`).
    """
    return two + scale * (three - one) + (1 - scale) * held


def holding(scale: NDArray, one: NDArray, two: NDArray, three: NDArray) -> NDArray:
    """How much of what B (T, C) is on average beyond A goes into B' unscaled (C,), all in one time.

    Whose legs A' hardly swings and A bends does not bend those of an upright B: poses add, swings are scaled.  Unless
    the mean of A' is that of A times the scale: then all is scaled, means too.
    """
    scale, means = scale.mean(axis=0), [curve.mean(axis=0) for curve in (one, two, three)]
    off = np.abs(means[1] - scale * means[0])
    whole = np.abs(means[1] - means[0]) + np.abs(1 - scale) * np.abs(means[0])
    astray = off / np.maximum(whole, 1e-9) / ASTRAY
    return astray**4 / (1 + astray**4) * (means[2] - means[0])


def model(
    one: NDArray, two: NDArray, fps: float, keep: float = KEEP, smooth: float = SMOOTH
) -> tuple[NDArray, NDArray]:
    """Scale and offset (T, C) that turn curves `one` (T, C) into `two` (T, C), all in one time (eqs. 3 to 6).

    Least squares of a one + b - two, plus smooth |S a|^2 and |S b|^2 with forward differences, scaled with the square
    of the frame rate so that they ask the same of a second, plus keep |a - 1|^2 in units of the channel's size: that
    decides where `one` does not move, and how much of a third motion is left as it was.
    Erratum: the paper's eq. 4 has A and A' swapped; its central differences do not see a ripple from frame to frame.
    """
    from scipy.linalg import solveh_banded

    count, channels = one.shape
    weight = smooth * (fps / 30) ** 2
    scale, offset = np.empty_like(one), np.empty_like(one)
    stiff = np.full(count, 2.0)
    stiff[[0, -1]] = 1.0 if count > 1 else 0.0
    for c in range(channels):
        spread = _spread(one[:, c])
        first = one[:, c] / spread  # so that one weight suits metres and radians
        second = two[:, c] / spread
        band = np.zeros((3, 2 * count))  # upper form, a and b by turns
        band[2, 0::2] = first**2 + keep + weight * stiff
        band[2, 1::2] = 1 + weight * stiff
        band[1, 1::2] = first
        band[0, 2:] = -weight
        right = np.stack([first * second + keep, second], axis=-1).ravel()
        solution = solveh_banded(band, right, check_finite=False)
        scale[:, c], offset[:, c] = solution[0::2], solution[1::2] * spread
    return scale, offset


def model_dense(one: NDArray, two: NDArray, fps: float, keep: float = KEEP, smooth: float = SMOOTH) -> NDArray:
    """Scale and offset (2, T) of one channel (T,), by the normal equations as they stand: the oracle of `model`."""
    count = len(one)
    spread = _spread(one)
    first, second = one / spread, two / spread
    differences = np.diff(np.eye(count), axis=0) * np.sqrt(smooth) * fps / 30
    rows = np.block(
        [
            [np.diag(first), np.eye(count)],
            [differences, np.zeros((count - 1, count))],
            [np.zeros((count - 1, count)), differences],
            [np.sqrt(keep) * np.eye(count), np.zeros((count, count))],
        ]
    )
    right = np.concatenate([second, np.zeros(2 * count - 2), np.full(count, np.sqrt(keep))])
    scale, offset = np.linalg.solve(rows.T @ rows, rows.T @ right).reshape(2, count)
    return np.stack([scale, offset * spread])


def _spread(values: NDArray) -> float:
    """How large a channel is (root of its mean square); one that is nothing has size 1."""
    size = float(np.sqrt(np.mean(values**2)))
    return size if size > 1e-6 else 1.0
