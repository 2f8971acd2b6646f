"""Joints that hang on each other: where they come to, and how their turns are mixed.

A joint's own map (3, 4) goes from its space to its parent's; parents come before their children, a root has parent -1.
Turns are mixed as rotation vectors against a first pose, unwrapped, so that a mixture of turns is a turn, more than two
poses mix at once, weights outside 0 to 1 turn further the same way, and a turn by 270 degrees is not one by -90.
"""

import numpy as np
from numpy.typing import NDArray


def own_maps(translations: NDArray, rotations: NDArray, scales: NDArray | float = 1.0) -> NDArray:
    """Joints' maps into their parents' space (..., J, 3, 4): stretched (..., J, 3), turned (..., J, 4), carried."""
    from scipy.spatial.transform import Rotation

    rotations = np.asarray(rotations, float)
    turns = Rotation.from_quat(rotations.reshape(-1, 4)).as_matrix().reshape(*rotations.shape[:-1], 3, 3)
    linear = turns * np.broadcast_to(scales, (*rotations.shape[:-1], 3))[..., None, :]
    return np.concatenate([linear, np.asarray(translations, float)[..., None]], axis=-1)


def world_maps(parents: tuple[int, ...], own: NDArray) -> NDArray:
    """Joints' maps into the figure's space (..., J, 3, 4) from those into their parents'."""
    from capture.motion import affine

    world = np.empty_like(own)
    for joint, parent in enumerate(parents):
        mine = own[..., joint, :, :]
        world[..., joint, :, :] = mine if parent < 0 else affine.compose(world[..., parent, :, :], mine)
    return world


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
