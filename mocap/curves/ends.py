"""What a curve does before its first frame and after its last.

A filter that looks half a second ahead needs frames that were never captured.  Repeating the end frame stops a walk
dead, and mirroring it turns it round; reflected in the point where it ends it just goes on.
"""

import numpy as np
from numpy.typing import NDArray


def extended(curves: NDArray, before: int, after: int, loop: bool = False, travel: NDArray | float = 0.0) -> NDArray:
    """Curves (T, ...) with more frames at both ends (before + T + after, ...), reflected oddly: P(-i) = 2 P(0) - P(i).

    With `loop` frame T is frame 0 again, `travel` (...) further on.
    """
    curves = np.asarray(curves, float)
    frames = np.arange(-before, len(curves) + after)
    period = len(curves) if loop else 2 * (len(curves) - 1)
    if period == 0:  # one frame stands still
        return np.repeat(curves, len(frames), axis=0)
    rounds, within = np.divmod(frames, period)
    shape = (-1, *(1,) * (curves.ndim - 1))
    if loop:
        return curves[within] + rounds.reshape(shape) * np.asarray(travel, float)
    back = within >= len(curves)  # the way there once more, turned by half a turn: it goes on from the last frame
    there = curves[np.where(back, period - within, within)]
    gone = 2 * (curves[-1] - curves[0])
    out = np.where(back.reshape(shape), 2 * curves[-1] - there, there)
    return out + rounds.reshape(shape) * gone


def travel_of(path: NDArray) -> NDArray:
    """How far (d,) a loop's root goes on its path (T, d) in one round; nothing where it ends up where it began.

    The step from the last frame back to the first was not captured: it is taken to be like its neighbours.
    """
    path = np.asarray(path, float)
    steps = np.diff(path, axis=0)
    if len(steps) < 2:
        return np.zeros(path.shape[1:])
    near, far = steps[0] + steps[-1], steps[1] + steps[-2]
    around = path[-1] - path[0] + (4 * near - far) / 6  # the cubic through the two steps before and the two after
    return around if np.linalg.norm(around) > 2 * np.linalg.norm(steps, axis=-1).max() else np.zeros_like(around)
