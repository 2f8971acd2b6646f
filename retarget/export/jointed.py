"""A jointed figure as a 3-D file takes it: nodes that travel and turn, and four of them for each vertex.

Joints of a file are turned and carried here, never stretched: what stretches stand above a figure in its own file go
into the lengths between its joints.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from retarget.characters.puppet import Puppet
from retarget.characters.skin import Pose

MOST = 4
"""A vertex follows at most this many joints, as all programs can show."""


@dataclass(frozen=True, eq=False)
class Skin:
    """Joints inside a body: its place moves their roots, and each vertex follows the joints it is bound to.

    A vertex goes to sum_j share_j . world_j . inverse_bind_j . v, world_j made of the turns of j and all above it.
    """

    names: tuple[str, ...]  # J
    parents: tuple[int, ...]  # J, -1 for a root; parents come first
    translation: NDArray  # (T, J, 3) from the parent joint
    rotation: NDArray  # (T, J, 4) quaternions (x, y, z, w), against the parent joint
    inverse_bind: NDArray  # (J, 3, 4) from the body's own space to the joint's
    joints: NDArray  # (V, 4) int, the joints a vertex follows
    shares: NDArray  # (V, 4), rows sum to 1
    scale: NDArray | None = None  # (T, J, 3) of joints that are stretched; nothing hangs on such a joint


def skin_of(target: Puppet, weights: NDArray) -> Skin:
    """The skin of a figure that mixes its keys by weights (T, K); its vertices are the points of its file."""
    figure, pose = target.skin, target.posture(weights)
    stretch = pose.scale[..., :1]
    if stretched(pose):
        raise InputError(
            f"part {target.part!r}: joints in a 3-D file may turn and travel, this figure's are stretched: "
            "make a video of it instead"
        )
    whole = np.ones(stretch.shape[1])  # how much each joint is stretched with all that it hangs on
    translation = pose.translation.copy()
    for joint, parent in enumerate(figure.parents):
        above = whole[parent] if parent >= 0 else 1.0
        translation[:, joint] *= above
        whole[joint] = above * stretch[0, joint, 0]
    names, parents = list(figure.names), list(figure.parents)
    bound = figure.joints.copy()
    again = [b for b in range(len(bound)) if (bound[:b] == bound[b]).any()]  # bound twice, as another mesh may be
    for binding in again:
        names.append(f"{figure.names[bound[binding]]} {binding}")
        parents.append(int(figure.joints[binding]))
        bound[binding] = len(names) - 1
    still = (len(translation), len(again))
    rotation = np.concatenate([pose.rotation, np.tile([0, 0, 0, 1.0], (*still, 1))], axis=1)
    binds = np.tile(np.eye(3, 4), (len(names), 1, 1))
    binds[bound] = whole[figure.joints][:, None, None] * figure.inverse_bind
    joints, shares = _strongest(figure.shares, bound)
    translation = np.concatenate([translation, np.zeros((*still, 3))], axis=1)
    return Skin(tuple(names), tuple(parents), translation, rotation, binds, joints, shares)


def stretched(pose: Pose) -> bool:
    """Whether joints are stretched unevenly, or over time, in poses of T frames: then no skin can tell it."""
    stretch = pose.scale[..., :1]
    uneven = np.abs(pose.scale - stretch).max() > 1e-4 * np.abs(stretch).max()
    return bool(uneven or np.ptp(stretch, axis=0).max() > 1e-4)


def _strongest(table: object, bound: NDArray) -> tuple[NDArray, NDArray]:
    """The joints (V, 4) of the greatest shares in a sparse table (V, B), and those shares, summing to 1."""
    dense = table.toarray()
    if dense.shape[1] < MOST:
        dense = np.pad(dense, [(0, 0), (0, MOST - dense.shape[1])])
        bound = np.pad(bound, (0, MOST - len(bound)))
    chosen = np.argsort(-dense, axis=1, kind="stable")[:, :MOST]
    shares = np.take_along_axis(dense, chosen, axis=1)
    return np.where(shares > 0, bound[chosen], 0), shares / shares.sum(axis=1, keepdims=True)
