"""How well a picture agrees with a fitted template, where some of its pixels may belong to somebody else."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

ALIKE = 40.0  # grey levels; a pixel that differs more is somebody else's


class Judgement(NamedTuple):
    """What a fit is worth."""

    misfit: float  # pixels: the shift that would explain how far the agreeing pixels differ, root mean square
    agreeing: float  # share of the known telling pixels that agree, 0 to 1
    known: float  # share of the telling pixels that can be seen, 0 to 1


def judge(difference: NDArray, power: float, known: NDArray | None = None) -> Judgement:
    """Judge differences (P, C) in grey levels; `power` is the template's mean squared slope per full-size pixel.

    `known` (P,) tells how far each pixel can be seen.
    """
    size = (difference**2).sum(axis=1)
    seen = np.ones(len(size)) if known is None else known.astype(float)
    agrees = seen * (size < ALIKE**2 * difference.shape[1])
    share = float(agrees.sum() / max(seen.sum(), 1e-9))
    mean = float((agrees * size).sum() / max(agrees.sum(), 1e-9))
    return Judgement(float(np.sqrt(mean / max(power, 1e-12))), share, float(seen.mean()))
