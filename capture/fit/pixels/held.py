"""Drawings that are held: pictures in which a part is as it was cost nothing."""

import numpy as np
from numpy.typing import NDArray

from capture.fit.pixels import cover, layer
from capture.fit.pixels.sighting import Sighting, margin, outline
from capture.pictures.held import is_held


def is_unchanged(image: NDArray, part: Sighting) -> bool:
    """Whether nothing has changed anywhere near the part since it was last found.

    A part that was lost is then back where it was; one that has a parent was carried on, and must be looked for.
    """
    if part.drawn is None or not (part.pose.visible or not part.model.part.parent):
        return False
    size = (image.shape[1], image.shape[0])
    return is_held(part.drawn, image, layer.window(outline(part.model, part.pose), size, margin(part.model)))


def rests(image: NDArray, part: Sighting, hidden: NDArray) -> bool:
    """Whether the part itself is as it was, though others move about it: what is in sight of it has not changed.

    `hidden` (H, W) is 1 where parts in front cover the picture.
    """
    if part.drawn is None or part.hidden is None or not part.pose.visible:
        return False
    rim = outline(part.model, part.pose)
    own = cover.grown(cover.solid(part.model, part.pose, np.zeros(2), image.shape), cover.EDGE)
    free = own & (1 - cover.grown(hidden | part.hidden, cover.EDGE))
    at = np.round(rim).astype(int)
    at = at[((at >= 0) & (at < (image.shape[1], image.shape[0]))).all(axis=1)]
    if free.sum() < 0.25 * own.sum() or free[at[:, 1], at[:, 0]].sum() < 0.25 * len(rim):
        return False  # too little to go by
    return is_held(part.drawn, image, layer.window(rim, (image.shape[1], image.shape[0]), cover.RIM), free)
