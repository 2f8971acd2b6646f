"""How turns are compared and mixed.

Turns are mixed as rotation vectors against a first pose, unwrapped, so that a mixture of turns is a turn, more than two
poses mix at once, weights outside 0 to 1 turn further the same way, and a turn by 270 degrees is not one by -90.
"""

import numpy as np
from numpy.typing import NDArray


def turns_between(first: NDArray, rotations: NDArray) -> NDArray:
    """The shortest rotation vectors (..., 3), radians, that turn `first` (..., 4) into `rotations` (..., 4)."""
    from scipy.spatial.transform import Rotation

    first, rotations = np.broadcast_arrays(np.asarray(first, float), np.asarray(rotations, float))
    start, goal = (Rotation.from_quat(q.reshape(-1, 4)) for q in (first, rotations))
    return (start.inv() * goal).as_rotvec().reshape(*first.shape[:-1], 3)


def unwrapped(rotations: NDArray) -> NDArray:
    """Rotation vectors (T, J, 3) against the first frame, without jumps, for rotations (T, J, 4) over time.

    A turn is known but for whole turns; of all that it may be, each frame has the one nearest to the frame before.
    """
    turns = turns_between(rotations[:1], rotations)
    for t in range(1, len(turns)):
        turns[t] = nearest(turns[t], turns[t - 1])
    return turns


def nearest(turns: NDArray, guess: NDArray) -> NDArray:
    """The same turns (..., 3), with as many whole turns more or less as bring them nearest to `guess` (..., 3)."""
    angle = np.linalg.norm(turns, axis=-1, keepdims=True)
    length = np.linalg.norm(guess, axis=-1, keepdims=True)
    along = np.divide(guess, length, out=np.zeros_like(guess), where=length > 0)
    # no turn at all may be whole turns about any axis: take the guess's
    axis = np.where(angle > 1e-9, turns / np.maximum(angle, 1e-9), along)
    wanted = (axis * guess).sum(axis=-1, keepdims=True)
    return (angle + 2 * np.pi * np.round((wanted - angle) / (2 * np.pi))) * axis


def mixed(first: NDArray, turns: NDArray, weights: NDArray) -> NDArray:
    """Rotations (T, J, 4): `first` (J, 4) turned by the mixture of K poses' turns (K, J, 3) in weights (T, K)."""
    from scipy.spatial.transform import Rotation

    vectors = np.tensordot(weights, turns, axes=1)  # (T, J, 3)
    start = Rotation.from_quat(np.broadcast_to(first, (len(weights), *np.shape(first))).reshape(-1, 4))
    return (start * Rotation.from_rotvec(vectors.reshape(-1, 3))).as_quat().reshape(*vectors.shape[:2], 4)
