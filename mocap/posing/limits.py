"""Joints that only bend, and only one way: the paper's own wish (Chen et al. 2004, section 7), a knee and an elbow.

A hinge's link may lie in any direction that the hinge reaches once the bone above it rolls, as a thigh does in the hip;
how far a bone may roll is limited too, or else a knee would bend forwards by rolling half round.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from mocap.body import find_body, rest_places
from mocap.skeleton import Skeleton


@dataclass(frozen=True, eq=False)
class JointLimits:
    """A joint that only turns about an axis, in radians from its rest pose."""

    joint: int
    axis: NDArray  # (3,) of length 1, in the joint's own space; bending turns about it by the right-hand rule
    least: float
    most: float
    roll: float = 0.8  # radians that the bone above may roll, either way from where it was


@dataclass(frozen=True, eq=False)
class Held:
    """The hinges of a figure in the order of its tree, at the start of a drag; H of them."""

    joints: NDArray  # (H,)
    axes: NDArray  # (H, 3) in the world
    least: NDArray  # (H,) radians from the start
    most: NDArray  # (H,)
    roll: NDArray  # (H,)

    def for_stars(self, count: int) -> tuple[NDArray, ...]:
        """The number of each star's limit (J,), -1 for none, and the limits' arrays, which are never empty."""
        hinge = np.full(count, -1)
        hinge[self.joints] = np.arange(len(self.joints))
        rest = np.zeros((1, 3)), np.zeros(1), np.zeros(1), np.zeros(1)
        own = self.axes, self.least, self.most, self.roll
        return hinge, *(own if len(self.joints) else rest)


def usual(skeleton: Skeleton) -> tuple[JointLimits, ...]:
    """Knees that bend back and elbows that bend ahead, of whoever has toes to tell which way that is.

    Elsewhere nothing is limited.  A straight limb may be bent the wrong way by 3 degrees, and bends by 155 at most.
    """
    body, places = find_body(skeleton), rest_places(skeleton)
    toes = [places[leg[-1]] - places[leg[-2]] for name, leg in body.parts.items() if name in _LEGS and len(leg) >= 4]
    ahead = sum(toes, np.zeros(3)) * [1, 0, 1]
    if not np.linalg.norm(ahead) > 0:
        return ()
    ahead = ahead / np.linalg.norm(ahead)
    found = []
    for name, joints in body.parts.items():
        if name not in _LEGS + _ARMS or len(joints) < 3:
            continue
        hinge, last = (joints[1], joints[2]) if name in _LEGS else (joints[-2], joints[-1])
        way = places[last] - places[hinge]
        axis = np.cross(way, -ahead if name in _LEGS else ahead)
        if np.linalg.norm(axis) > 0.3 * np.linalg.norm(way):
            roll = 0.8 if name in _LEGS else 1.6
            found.append(JointLimits(hinge, axis / np.linalg.norm(axis), np.radians(-3), np.radians(155), roll))
    return tuple(found)


def bend_of(limit: JointLimits, parents: Sequence[int], turns: NDArray) -> float:
    """By how much, in radians, a hinge is bent in a pose with turns (J, 4)."""
    from mocap import quaternions as quat

    above = parents[limit.joint]
    own = turns[limit.joint]
    if above >= 0:
        own = quat.product(quat.inverse(turns[above]), own)
    return float(quat.twist(own, limit.axis))


def gathered(limits: Sequence[JointLimits], order: NDArray, turns: NDArray, parents: Sequence[int]) -> Held:
    """The limits as a drag needs them, in the tree's order; who begins beyond a limit may stay as far beyond it."""
    from scipy.spatial.transform import Rotation

    axes, least, most = np.zeros((len(limits), 3)), np.zeros(len(limits)), np.zeros(len(limits))
    for n, limit in enumerate(limits):
        axis = np.asarray(limit.axis, float)
        if not 0 <= limit.joint < len(parents) or axis.shape != (3,) or not abs(np.linalg.norm(axis) - 1) < 1e-6:
            raise InputError(
                f"a limit must be on one of {len(parents)} joints, about an axis (x, y, z) of length 1, it is on joint "
                f"{limit.joint} about {limit.axis}"
            )
        if not limit.least <= limit.most or not limit.roll >= 0:
            raise InputError(
                f"a limit's least bend must be below its most, and its roll not below 0, they are {limit.least}, "
                f"{limit.most} and {limit.roll}"
            )
        bend = bend_of(limit, parents, turns)
        axes[n] = Rotation.from_quat(turns[limit.joint]).apply(axis)
        least[n], most[n] = min(limit.least - bend, 0.0), max(limit.most - bend, 0.0)
    back = np.argsort(order)
    joints = np.array([back[limit.joint] for limit in limits], np.int64)
    return Held(joints, axes, least, most, np.array([limit.roll for limit in limits], float))


_LEGS, _ARMS = ("left leg", "right leg"), ("left arm", "right arm")
