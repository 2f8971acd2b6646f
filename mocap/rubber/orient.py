"""How sub-joints are turned, which so far only have places (Kwon & Lee 2008, section 6).

An original joint is turned as it was, and then by the smallest turn that makes its link go where it now goes.  Along a
link its two joints' turns are not simply mixed: what a joint is turned across its parent's link is a bend, which the
curve already has; what it is turned about that link is a twist, and is shared out evenly over the sub-joints.  For
small bends that is Slerp, and it does not flip for large ones.
"""

import numpy as np
from numpy.typing import NDArray

from mocap import quaternions as quat
from mocap.rubber.subjoints import SubJoints
from mocap.skeleton import Skeleton

BIND = 0.02
"""How much a joint with several children goes along with what it hangs on, beside how much it follows them all."""

PRESSED = 0.1
"""Times its whole link below which a sub-link's direction counts for less: in the cusp of a curve it has none."""


def orientations(positions: NDArray, subjoints: SubJoints, joints: NDArray, turns: NDArray) -> NDArray:
    """Turns (T, S, 4) of sub-joints at positions (T, S, 3), whose joints were at `joints` (T, J, 3), turned (T, J, 4).

    A sub-joint's turn takes the direction that the sub-link after it has at rest to the one it has in this frame; a
    joint with several children takes all of theirs as nearly as it can, a tip goes along with the sub-link before it.
    At rest none is turned; over time no quaternion jumps to its negative.
    """
    new, old, turns = (np.ascontiguousarray(array.transpose(1, 2, 0)) for array in (positions, joints, turns))
    skeleton = subjoints.skeleton
    out = _ways_out(skeleton)
    twists = _twists(subjoints, turns)
    following = _following(subjoints)
    result = np.empty((len(subjoints), *turns.shape[1:]))
    correction: list[NDArray] = []  # by how much each sub-joint is turned more than it was
    for s, (joint, along, above) in enumerate(zip(subjoints.joint.tolist(), subjoints.along, subjoints.parents)):
        before = correction[above] if above >= 0 else None
        if along < 1:
            parent = skeleton.parents[joint]
            was = quat.product(turns[parent], quat.about(_unit(skeleton.offsets[joint]), along * twists[joint]))
            more = _turn_of(old[joint] - old[parent], new[following[joint, s]] - new[s], before)
        else:
            was = turns[joint]
            ways = [(old[c] - old[joint], new[following[c, s]] - new[s]) for c in out[joint]]
            if len(ways) > 1:
                weights = [np.linalg.norm(skeleton.offsets[c]) for c in out[joint]]
                more = _nearest_turn(*(np.array(side) for side in zip(*ways)), np.array(weights), before)
            elif ways:
                more = _turn_of(*ways[0], before)
            else:
                more = _none(turns[joint]) if before is None else before
        correction.append(more)
        result[s] = quat.product(more, was)
    return np.ascontiguousarray(quat.steady(result.swapaxes(0, 1)).transpose(2, 1, 0))


def _turn_of(first: NDArray, second: NDArray, before: NDArray | None) -> NDArray:
    """The smallest turn (4, T) from ways (3, T) to others; a sub-link pressed to nothing goes on as those before it."""
    if before is None:
        return quat.between(first, second)
    short = np.sqrt((second * second).sum(axis=0)) / np.maximum(np.sqrt((first * first).sum(axis=0)), 1e-12)
    if (short < PRESSED).any():
        second = second + np.maximum(PRESSED - short, 0) * quat.turned(before, first)
    return quat.between(first, second)


def _ways_out(skeleton: Skeleton) -> list[list[int]]:
    """For each joint the joints at the far ends of the links that begin in its place."""
    lengths = skeleton.lengths()
    out: list[list[int]] = [[] for _ in range(len(skeleton))]
    for child in range(len(skeleton) - 1, -1, -1):  # children before their parents
        parent = skeleton.parents[child]
        if parent >= 0:
            out[parent] = ([child] if lengths[child] > 0 else out[child]) + out[parent]
    return out


def _following(subjoints: SubJoints) -> dict[tuple[int, int], int]:
    """The sub-joint that comes after one on the way to a joint: by that joint, and by the sub-joint before."""
    skeleton, found = subjoints.skeleton, {}
    lengths = skeleton.lengths()
    for s, (joint, above) in enumerate(zip(subjoints.joint.tolist(), subjoints.parents)):
        while above >= 0 and (joint, above) not in found:
            found[joint, above] = s
            if subjoints.along[above] < 1 or lengths[subjoints.joint[above]] > 0:
                break
            above = subjoints.parents[above]  # that one is in one place with its parent
    return found


def _twists(subjoints: SubJoints, turns: NDArray) -> dict[int, NDArray]:
    """How far joints are turned about the links above them (T,), without jumps; of those whose links are cut."""
    skeleton = subjoints.skeleton
    twists = {}
    for joint in np.unique(subjoints.joint[subjoints.along < 1]).tolist():
        own = quat.product(quat.inverse(turns[skeleton.parents[joint]]), turns[joint])
        twists[joint] = np.unwrap(quat.twist(own, _unit(skeleton.offsets[joint])))
    return twists


def _nearest_turn(first: NDArray, second: NDArray, weights: NDArray, before: NDArray | None) -> NDArray:
    """The turn (4, T) that takes directions (n, 3, T) nearest to others, and is near the turn of what comes before.

    Gauss and Newton on Wahba's problem; without a turn before, near none.
    """
    first, goal = (v / np.maximum(np.sqrt((v * v).sum(axis=1, keepdims=True)), 1e-12) for v in (first, second))
    weights = (weights / weights.sum())[:, None]
    turn, bind = (_none(first[0]), 1e-6) if before is None else (before, BIND)
    back = quat.inverse(turn)
    for _ in range(4):
        x, y, z = quat.turned(turn[:, None], first.swapaxes(0, 1))
        a, b, c = goal.swapaxes(0, 1)
        away = quat.product(turn, back)
        pull = 2 * bind * away[:3] * np.sign(away[3])
        right = [(weights * v).sum(axis=0) for v in (y * c - z * b, z * a - x * c, x * b - y * a)] - pull
        xx, yy, zz, xy, xz, yz = ((weights * v).sum(axis=0) for v in (x * x, y * y, z * z, x * y, x * z, y * z))
        step = _solve(yy + zz + bind, xx + zz + bind, xx + yy + bind, -xy, -xz, -yz, right)
        turn = quat.product(quat.from_vector(step), turn)
    return turn / np.sqrt((turn * turn).sum(axis=0))


def _solve(xx: NDArray, yy: NDArray, zz: NDArray, xy: NDArray, xz: NDArray, yz: NDArray, right: NDArray) -> NDArray:
    """Symmetric equations of three unknowns (3, T)."""
    a, b, c = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
    d, e, f = xx * zz - xz * xz, xy * xz - xx * yz, xx * yy - xy * xy
    r, s, t = right
    return np.stack([a * r + b * s + c * t, b * r + d * s + e * t, c * r + e * s + f * t]) / (xx * a + xy * b + xz * c)


def _none(like: NDArray) -> NDArray:
    """No turn (4, T)."""
    turn = np.zeros((4, like.shape[-1]))
    turn[3] = 1
    return turn


def _unit(vector: NDArray) -> NDArray:
    return vector / np.linalg.norm(vector)
