"""Squash and stretch: how long links are, and how thick.

Eq. 1 never shortens a link; what is made of rubber is as often shorter than longer.
"""

import numpy as np
from numpy.typing import NDArray

from mocap.rubber import exaggerate

SLIM, FAT = 0.5, 1.8
"""A link is drawn no thinner and no thicker than so many times at rest, whatever its volume asks for."""


def alternating(ratio: NDArray, fps: float, amount: float = 1.0, sigma: float = 0.3, loop: bool = False) -> NDArray:
    """Length ratios (T, J) divided by their own average over `sigma` seconds, so that stretch and squash take turns.

    The average is of logarithms, for half as long and twice as long to weigh the same; `amount` 0 leaves the ratios.
    """
    logs = np.log(np.maximum(ratio, 1e-6))
    return np.exp(logs - amount * exaggerate.averaged(logs, sigma * fps, loop))


def thickness_of(stretch: NDArray) -> NDArray:
    """How thick links (T, S) are, times at rest, so that each keeps its volume: 1 / sqrt(stretch), within bounds."""
    return np.clip(1 / np.sqrt(np.maximum(stretch, 1e-6)), SLIM, FAT)


def volume(stretch: NDArray, thickness: NDArray, lengths: NDArray) -> NDArray:
    """The volume (T,) of all links as round rods of one thickness at rest, times that at rest; lengths (S,) are."""
    return (stretch * thickness**2) @ lengths / max(lengths.sum(), 1e-12)
