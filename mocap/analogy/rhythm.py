"""The timing of A' for B, as A' differs from A (Wu et al. 2008, section 3.6).

Everything is told on B's time, in seconds.  B' goes as much faster than B as A' goes faster than A, moment by moment:
dS_B->B'/dt = (dS_B->A'/dt) / (dS_B->A/dt), which is positive wherever both curves rise, so that time never runs back.
Erratum: eqs. 8 and 9 compare curves over different times; aligned to each other as printed they lose the rhythm.
"""

import numpy as np
from numpy.typing import NDArray

PACE = 0.15
"""Seconds: how fast time goes is known no quicker than that, frames being answered whole."""


def rhythm(to_one: NDArray, to_two: NDArray, strength: float = 1.0) -> NDArray:
    """When (m,) B' does what B does at its frames, in frames of B's rate.

    `to_one` and `to_two` (m,) are where A and A' are at B's frames, in frames of the same rate, rising.  B' lasts as
    much longer than B as A' lasts longer than A, over what of them is used.  `strength` 0 keeps B's own timing.
    """
    count = len(to_one)
    if count < 2:
        return np.zeros(count)
    one, two = (np.maximum(np.diff(curve), 1e-6) for curve in (to_one, to_two))
    speed = (two / one) ** strength
    ratio = ((to_two[-1] - to_two[0]) / (to_one[-1] - to_one[0])) ** strength
    when = np.concatenate([[0], np.cumsum(speed)])
    return when * ratio * (count - 1) / when[-1]


def moments(when: NDArray) -> NDArray:
    """B's frame, between frames too, for every whole frame (n,) of B', if B's frame t comes at `when[t]` (eq. 10).

    The last frame stays the last, at most half a frame early or late.
    """
    whole = np.linspace(0, when[-1], round(when[-1]) + 1)
    return np.interp(whole, when, np.arange(len(when)))


def pace(when: NDArray, fps: float, smooth: float = PACE) -> NDArray:
    """How many frames of the other motion go by in a frame (m,), for a time curve (m,), over `smooth` seconds."""
    from scipy.ndimage import gaussian_filter1d

    return np.maximum(gaussian_filter1d(np.gradient(when), smooth * fps, mode="nearest"), 1e-3)
