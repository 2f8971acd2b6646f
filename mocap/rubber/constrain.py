"""Feet that stay and hands that hit: limbs bent as curves until their ends are where they must be (section 6).

A limb is a chain of sub-joints from the body to the tip.  After Nealen et al. (2007) its shape is kept as well as may
be: each inner sub-joint keeps its Laplacian, what it sticks out beyond the line of its neighbours, turned along with
the limb, while the chain's start and the goals are met exactly.  The matrices depend on which goals are held only.
Links may stretch: that is what rubber is for.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from mocap.rubber.subjoints import SubJoints

BLEND = 0.1
"""Seconds in which a goal takes hold, and in which it lets go."""


@dataclass(frozen=True, eq=False)
class Goal:
    """A joint is to be at places; hold says how much: 0 not at all, 1 exactly."""

    joint: int
    places: NDArray  # (T, 3) metres; those of frames without hold do not matter
    hold: NDArray  # (T,) in [0, 1]


def held(joint: int, places: NDArray, frames: NDArray, fps: float, blend: float = BLEND) -> Goal:
    """The goal that a joint is at `places` (T, 3) in `frames` (T,) bool, and comes and goes within `blend` seconds."""
    return Goal(joint, _carried_on(places, frames), easing(frames, fps, blend))


def reach(joint: int, place: Sequence[float], frame: int, count: int, fps: float, blend: float = 0.25) -> Goal:
    """The goal that a joint hits a place (3,) in one frame of `count`; `blend` seconds before it sets out."""
    if not 0 <= frame < count:
        raise InputError(f"a frame to reach something in must be 0 to {count - 1}, it is {frame}")
    return held(joint, np.tile(np.asarray(place, float), (count, 1)), np.arange(count) == frame, fps, blend)


def constrained(positions: NDArray, subjoints: SubJoints, goals: Sequence[Goal]) -> NDArray:
    """Sub-joints (T, S, 3) with every goal met; what hangs on a moved limb goes along with it.

    Goals of one limb are met together.  In frames that hold several goals partly, the limbs bent for each set of
    them are mixed, so that a goal held wholly stays met while another lets go; goals that are held alike are one set.
    """
    moved = positions.copy()
    for limb in _limbs(subjoints, goals):
        ends = [subjoints.ends[goal.joint] for goal in limb]
        chain = _chain(subjoints, ends)
        busy = np.flatnonzero(np.max([goal.hold for goal in limb], axis=0) > 0)
        start = moved[busy][:, chain]
        share = np.zeros((len(busy), len(chain), 3))
        together = _alike([goal.hold for goal in limb])
        for choice in product((False, True), repeat=max(together) + 1):
            weight = np.prod([_held(limb[together.index(k)].hold[busy], on) for k, on in enumerate(choice)], axis=0)
            if not any(choice) or not weight.any():
                continue
            on = np.flatnonzero(weight)
            nodes = [chain.index(end) for end, k in zip(ends, together) if choice[k]]
            places = np.stack([goal.places[busy[on]] for goal, k in zip(limb, together) if choice[k]], axis=1)
            share[on] += weight[on, None, None] * (bent(start[on], nodes, places) - start[on])
        shift = np.zeros((len(busy), len(subjoints.parents), 3))
        shift[:, chain] = share
        _carry_along(shift, chain, subjoints.parents)
        moved[busy] += shift
    return moved


def bent(chain: NDArray, nodes: Sequence[int], places: NDArray) -> NDArray:
    """Curves (T, n, 3) bent so that their first point stays and `nodes` are at `places` (T, g, 3)."""
    fixed = np.array([0, *nodes])
    goal = np.concatenate([chain[:, :1], places], axis=1)
    lengths = np.maximum(np.linalg.norm(np.diff(chain, axis=1), axis=-1).mean(axis=0), 1e-9)
    laplace = _laplacian(lengths)
    turned = _turned(np.matmul(laplace, chain), fixed, chain[:, fixed], goal)
    free = np.setdiff1d(np.arange(chain.shape[1]), fixed)
    solve = np.linalg.pinv(laplace[:, free])  # what is free follows from what is fixed
    curve = np.empty_like(chain)
    curve[:, fixed] = goal
    curve[:, free] = np.matmul(solve, turned - np.matmul(laplace[:, fixed], goal))
    return curve


def easing(frames: NDArray, fps: float, blend: float = BLEND) -> NDArray:
    """Shares (T,): 1 in `frames`, falling to 0 within `blend` seconds on either side, as smoothly as a cosine."""
    frames = np.asarray(frames, bool)
    if not frames.any() or blend <= 0:
        return frames.astype(float)
    from scipy.ndimage import distance_transform_edt

    away = np.minimum(distance_transform_edt(~frames) / (fps * blend), 1.0)
    return (1 + np.cos(np.pi * away)) / 2


def _held(hold: NDArray, on: bool) -> NDArray:
    return hold if on else 1 - hold


def _alike(holds: list[NDArray]) -> list[int]:
    """A number for each of several curves (T,), from 0 on; the same for those that are the same."""
    first = [next(k for k, other in enumerate(holds) if np.array_equal(hold, other)) for hold in holds]
    return [sorted(set(first)).index(k) for k in first]


def _carried_on(places: NDArray, frames: NDArray) -> NDArray:
    """Places of held frames, and beside them those of the nearest held frame, between two of them on the way."""
    known = np.flatnonzero(frames)
    if not len(known):
        return places
    every = np.arange(len(places))
    return np.stack([np.interp(every, known, places[known, axis]) for axis in range(3)], axis=-1)


def _laplacian(lengths: NDArray) -> NDArray:
    """Rows (n - 1, n): second differences at inner points of a chain with links (n - 1,), and its first link.

    The first link's row keeps the limb's root from turning freely; it weighs as one bend among the others.
    """
    count = len(lengths) + 1
    rows = np.zeros((count - 1, count))
    rows[0, :2] = np.array([-1.0, 1.0]) * 0.5
    for i in range(1, count - 1):
        before, after = 1 / lengths[i - 1], 1 / lengths[i]
        rows[i, i - 1 : i + 2] = np.array([before, -before - after, after]) / (before + after)
    return rows


def _turned(vectors: NDArray, fixed: NDArray, before: NDArray, after: NDArray) -> NDArray:
    """Vectors (T, n - 1, 3) at points of a chain, turned as the line between the fixed points around them was turned.

    Turned after the chain's own directions instead, round after round, a leg that is pressed together throws loops.
    """
    stretch = np.clip(np.searchsorted(fixed, np.arange(vectors.shape[1]), side="right") - 1, 0, len(fixed) - 2)
    first, second = (_unit(np.diff(points, axis=1))[:, stretch] for points in (before, after))
    axis, cosine = _cross(first, second), np.einsum("tnd,tnd->tn", first, second)[..., None]
    across = _cross(axis, vectors)
    # Rodrigues' formula with sin = |axis|; where a line turns right round there is no one way: it stays
    return vectors + across + _cross(axis, across) / np.maximum(1 + cosine, 0.05)


def _cross(a: NDArray, b: NDArray) -> NDArray:
    """Cross products (..., 3); NumPy's own takes twice as long."""
    result = np.empty_like(a)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        result[..., i] = a[..., j] * b[..., k] - a[..., k] * b[..., j]
    return result


def _unit(vectors: NDArray) -> NDArray:
    return vectors / np.maximum(np.sqrt(np.einsum("tnd,tnd->tn", vectors, vectors)), 1e-12)[..., None]


def _limbs(subjoints: SubJoints, goals: Sequence[Goal]) -> list[list[Goal]]:
    """Goals by the limb they pull; limbs, and the goals of each, nearest to the body first."""
    limbs: dict[int, list[Goal]] = {}
    for goal in sorted(goals, key=lambda goal: _depth(subjoints, goal.joint)):
        end = int(subjoints.ends[goal.joint])
        limbs.setdefault(_way_up(subjoints, end, _base(subjoints, end))[-2], []).append(goal)
    return list(limbs.values())


def _depth(subjoints: SubJoints, joint: int) -> int:
    return len(_way_up(subjoints, subjoints.ends[joint], -1))


def _base(subjoints: SubJoints, end: int) -> int:
    """Where the limb of a sub-joint begins: the start of its rubber-joint group, or the next fork towards the root."""
    parents = subjoints.skeleton.parents
    forks = {p for p in parents if parents.count(p) > 1}
    above = joint = int(subjoints.joint[end])
    while above >= 0:
        for group in subjoints.groups:
            if above in group[1:]:  # it, or what it hangs on as toes do on an ankle
                return int(subjoints.ends[group[0]])
        above = parents[above]
        if above in forks or (above >= 0 and parents[above] < 0):
            break
    if above < 0:
        raise InputError(
            f"a goal must be for a joint that hangs on others, {subjoints.skeleton.names[joint]} is a root: "
            "move the whole figure instead"
        )
    return int(subjoints.ends[above])


def _chain(subjoints: SubJoints, ends: Sequence[int]) -> list[int]:
    """Sub-joints from the limb's base to its farthest goal, or to its tip where a group goes on."""
    base = _base(subjoints, ends[0])
    tips = list(ends)
    for group in subjoints.groups:
        if int(subjoints.ends[group[0]]) == base:
            tips.append(int(subjoints.ends[group[-1]]))
    return max((_way_up(subjoints, tip, base)[::-1] for tip in tips), key=len)


def _way_up(subjoints: SubJoints, end: int, base: int) -> list[int]:
    way = [int(end)]
    while way[-1] != base and subjoints.parents[way[-1]] >= 0:
        way.append(int(subjoints.parents[way[-1]]))
    return way


def _carry_along(shift: NDArray, chain: Sequence[int], parents: Sequence[int]) -> None:
    """Fill in shifts (T, S, 3) of what hangs on a chain, from the sub-joint that it hangs on."""
    moved = set(chain)
    for sub, parent in enumerate(parents):
        if sub not in moved and parent in moved and parent != chain[0]:
            shift[:, sub] = shift[:, parent]
            moved.add(sub)
