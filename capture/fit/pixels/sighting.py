"""What is known of a part while its clip is gone through."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from capture.fit.pixels import model as models
from capture.fit.pixels.model import PartModel
from capture.pictures.matte import ColorModel

REACH = 64.0  # pixels a drawing may jump between frames, beyond its own size's share


@dataclass(frozen=True, eq=False)
class Pose:
    """Where a part is in one frame."""

    placed: NDArray  # (2, 3) plain map of the aligned shape
    alpha: NDArray  # (L,) mode weights, empty for one key
    misfit: float = 0.0  # pixels
    agreeing: float = 1.0  # share of the pixels that can be seen and agree
    visible: bool = True
    held: bool = False


@dataclass(frozen=True, eq=False)
class Sighting:
    """What is known of a part as its clip is gone through."""

    model: PartModel
    colors: ColorModel  # they follow the clip slowly
    pose: Pose  # the latest
    misfits: tuple[float, ...] = ()  # of the latest drawings, in pixels
    drawn: NDArray | None = None  # (H, W, 3) the picture the part was last found in
    hidden: NDArray | None = None  # (H, W) uint8, 1 where other parts covered it in that picture
    before: NDArray | None = None  # (2, 3) the map of the drawing before
    searched: NDArray | None = None  # (H, W, 3) the picture the part was last looked for in vain
    doubted: float = 1.0  # what the best fit was worth when other starts last did no better; 1 for no doubt


def outline(model: PartModel, pose: Pose) -> NDArray:
    """The part's boundary (B, 2) as posed."""
    return models.outline_at(model, pose.placed, pose.alpha)


def across(model: PartModel) -> float:
    """The part's size in pixels, the longer side of its first key."""
    return float(np.ptp(model.keyset.points[0], axis=0).max())


def margin(model: PartModel) -> float:
    """Pixels round a pose in which a part is looked for."""
    return REACH + 0.25 * across(model)


def is_sane(model: PartModel, pose: Pose) -> bool:
    """Whether a map is one a drawing can have: not mirrored, not collapsed, not more than 8 times its area.

    A linear part that stretches one way and shrinks the other more than 8 times over counts as collapsed.
    """
    if not np.isfinite(pose.placed).all() or np.abs(pose.placed).max() > 1e4:
        return False
    long, short = np.linalg.svd(pose.placed[:, :2], compute_uv=False)
    area = float(np.linalg.det(pose.placed[:, :2]))
    return 1 / 8 < area < 8 and long < 8 * short
