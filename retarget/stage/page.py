"""Whether a performance stays on its page: travel grows with the character, and a tall one can leave it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from capture.motion.tracks import CartoonMotion
from retarget.stage.perform import Performance

FREE = 0.02
"""Of the page's width: as far a character may be beyond its edge, for a hair or an ear, and nothing is said."""


@dataclass(frozen=True)
class Beyond:
    """How often and how far a character is beyond the page's edges where its source is not."""

    frames: int
    pixels: float  # in the worst frame ...
    worst: int  # ... which is this one, from 0

    def __str__(self) -> str:
        frames = f"{self.frames} frame{'s' * (self.frames != 1)}"
        return f"beyond the page in {frames}, most in frame {self.worst}, by {self.pixels:.0f} px"


def beyond(performance: Performance, motion: CartoonMotion) -> Beyond | None:
    """How far the characters reach over the page's edges further than what was captured; None if they do not."""
    over = np.zeros(len(motion.times))
    for role in performance.roles:
        over = np.maximum(over, np.where(role.visible, _over(role.mesh()[..., :2], performance.size), 0))
    was = np.zeros(len(motion.times))
    for track in motion.tracks:
        was = np.maximum(was, np.where(track.visible, _over(motion.outline(track.part), motion.size), 0))
    more = np.where(over > was + FREE * performance.size[0], over, 0)
    if not more.any():
        return None
    return Beyond(int(np.count_nonzero(more)), float(more.max()), int(more.argmax()))


def _over(points: NDArray, size: tuple[int, int]) -> NDArray:
    """How far (T,) the outermost of points (T, N, 2) lies beyond the edges of a page (width, height)."""
    return np.maximum(np.max(-0.5 - points, axis=(1, 2)), np.max(points - (np.array(size) - 0.5), axis=(1, 2)))
