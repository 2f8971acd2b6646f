"""A motion made of rubber: what the whole chain gives (Kwon & Lee 2008)."""

from dataclasses import dataclass

from numpy.typing import NDArray

from mocap.rubber.subjoints import SubJoints
from mocap.skeleton import SkeletonMotion


@dataclass(frozen=True, eq=False)
class RubberMotion:
    """Sub-joints over T frames, in the world: each has a place, an orientation, and its sub-link a stretch."""

    source: SkeletonMotion  # what was exaggerated, upright
    subjoints: SubJoints
    positions: NDArray  # (T, S, 3) metres
    rotation: NDArray  # (T, S, 4) quaternions (x, y, z, w) in the world; at rest none is turned
    stretch: NDArray  # (T, S) length of the sub-link above a sub-joint, times its length at rest; roots 1
    thickness: NDArray  # (T, S) how thick that sub-link is, times at rest: 1 / sqrt(stretch) keeps its volume
