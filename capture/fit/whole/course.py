"""A part through its clip, drawing by drawing: held frames are one drawing and share one pose."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from capture.fit.pixels.model import PartModel
from capture.motion.tracks import CartoonMotion, total_affine


@dataclass(frozen=True, eq=False)
class Course:
    """Where a part is in its G drawings.

    The unknowns (M,) of a drawing, M = 6 + L, are the linear part (4) times the part's scale, the position (2) of its
    centre, both in pixels, and the mode weights (L).
    """

    first: NDArray  # (G,) int, the frame in which a drawing is first shown
    held: NDArray  # (G,) int, for how many frames
    unknowns: NDArray  # (G, M)
    seen: NDArray  # (G,) bool, whether the pictures tell where the part is
    misfit: NDArray  # (G,) pixels, 0 where nothing was measured

    @property
    def drawing(self) -> NDArray:
        """The drawing (T,) that every frame shows."""
        return np.repeat(np.arange(len(self.first)), self.held)

    @property
    def middle(self) -> NDArray:
        """When a drawing is shown (G,), in frames."""
        return self.first + (self.held - 1) / 2


def course_of(motion: CartoonMotion, model: PartModel) -> Course:
    """What a capture found of a part."""
    track = motion.track(model.part.name)
    new = ~track.held | np.diff(track.visible, prepend=track.visible[0])
    new[0] = True
    first = np.flatnonzero(new)
    placed = total_affine(motion, track.part)[first]
    alpha = np.zeros((len(first), 0))
    if model.shape is not None:  # rows sum to 1, so a mix of rows has the mix of their mode weights
        alpha = track.weights[first] @ model.shape.space.coefficients
    centre, scale = frame_of(model)
    linear = scale * placed[:, :, :2].reshape(-1, 4)
    position = placed[:, :, :2] @ centre + placed[:, :, 2]
    unknowns = np.concatenate([linear, position, alpha], axis=1)
    return Course(first, np.diff(first, append=len(track)), unknowns, track.visible[first], track.residual[first])


def placed_of(unknowns: NDArray, model: PartModel) -> tuple[NDArray, NDArray]:
    """Plain maps (..., 2, 3) and mode weights (..., L)."""
    centre, scale = frame_of(model)
    linear = unknowns[..., :4].reshape(*unknowns.shape[:-1], 2, 2) / scale
    shift = unknowns[..., 4:6] - linear @ centre
    return np.concatenate([linear, shift[..., None]], axis=-1), unknowns[..., 6:]


def frame_of(model: PartModel) -> tuple[NDArray, float]:
    """The centre (2,) about which a part's maps are measured, and the pixels that a unit of them moves its rim."""
    template = model.rigid if model.shape is None else model.shape.bent
    return template.centre, template.scale


def mode_precision(model: PartModel) -> NDArray:
    """What the rows say of the unknowns (M,) beforehand: modes reach as far as the farthest row's, maps anywhere."""
    if model.shape is None:
        return np.zeros(6)
    reach = np.abs(model.shape.space.coefficients).max(axis=0)
    return np.concatenate([np.zeros(6), 1 / np.maximum(reach, 1e-6) ** 2])
