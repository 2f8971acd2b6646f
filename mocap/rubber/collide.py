"""Limbs that go through each other: measured as capsules, and pushed apart.

Motion capture itself lets a hand touch a hip.  Only what exaggeration adds is a fault: two links may come as close as
they were captured, or as close as their capsules allow, whichever is closer.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mocap.rubber import capsules
from mocap.rubber.constrain import envelope
from mocap.rubber.subjoints import SubJoints
from mocap.skeletons.skeleton import Skeleton

ROUNDS, SHARE = 10, 0.7
"""Limbs are pushed so often, by this share of what they lack: with all of it two legs push each other to and fro."""

NOTHING = 1e-3
"""Metres that need no push."""

SMOOTH = 0.1
"""Seconds in which a push comes and goes: in a third of that, limbs captured 120 times a second jerk 40 times more."""


def radii(skeleton: Skeleton, share: float = 0.12) -> NDArray:
    """How thick the link above each joint is taken to be (J,), as a radius: a share of its own length.

    The median link bounds it from above twice over, so that a long spine is no barrel.
    """
    lengths = skeleton.lengths()
    usual = np.median(lengths[lengths > 0])
    return share * np.minimum(lengths, 2 * usual)


def overlaps(positions: NDArray, captured: NDArray, skeleton: Skeleton, thick: NDArray | None = None) -> NDArray:
    """How deep any two links go into each other beyond what was captured (T,), metres, for joints (T, J, 3) of both."""
    return capsules.compiled()(*_arrays(positions, captured, skeleton, thick))[1]


def pushed_apart(
    positions: NDArray, captured: NDArray, subjoints: SubJoints, fps: float, thick: NDArray | None = None
) -> NDArray:
    """Sub-joints (T, S, 3) with links moved aside that overlap more than in the captured joints (T, J, 3).

    The link nearer to a limb's tip gives way; the push fades towards the body, and in time.
    """
    push_of, moved = capsules.compiled(), positions
    for _ in range(ROUNDS):
        joints = moved[:, subjoints.ends]
        push, _ = push_of(*_arrays(joints, captured, subjoints.skeleton, thick))
        if np.abs(push).max() < NOTHING:
            break
        moved = moved + SHARE * _spread(_eased(push, fps), subjoints)
    return moved


def _arrays(positions: NDArray, captured: NDArray, skeleton: Skeleton, thick: NDArray | None) -> tuple[NDArray, ...]:
    """What `capsules` works on."""
    parents = np.array(skeleton.parents)
    depth = _depths(skeleton.parents)
    fast = (parents < 0) | (depth[parents] <= 1)
    thick = radii(skeleton) if thick is None else np.asarray(thick, float)
    pairs = [(a, b) if depth[a] >= depth[b] else (b, a) for a, b in _pairs(skeleton)]
    pairs = np.array(pairs, int).reshape(-1, 2)
    return np.ascontiguousarray(positions), np.ascontiguousarray(captured), pairs, parents, fast, thick


def _eased(push: NDArray, fps: float) -> NDArray:
    """Pushes (T, J, 3) that come and go softly: each nowhere smaller than it was, its way that of those around it."""
    from scipy.ndimage import correlate1d

    moves = np.flatnonzero(push.any(axis=(0, 2)))
    own = push[:, moves]
    frames = max(round(SMOOTH * fps), 1)
    size = np.linalg.norm(own, axis=-1)
    strongest = envelope(size, frames)
    wide = np.hanning(4 * frames + 3)[1:-1]  # as far as a push is felt
    way, weight = (correlate1d(values, wide, axis=0, mode="nearest") for values in (own, size))
    eased = np.zeros_like(push)
    eased[:, moves] = (strongest / np.maximum(weight, 1e-12))[..., None] * way
    return eased


def _pairs(skeleton: Skeleton) -> list[tuple[int, int]]:
    """Links, named by their far joints, that have length and no joint or short link between them."""
    lengths, parents = skeleton.lengths(), skeleton.parents
    links = [joint for joint in range(len(skeleton)) if lengths[joint] > 0]
    usual = np.median(lengths[links]) if links else 0.0
    thick = [joint for joint in links if lengths[joint] > 0.35 * usual]  # not every finger against every toe
    return [
        (one, other)
        for i, one in enumerate(thick)
        for other in thick[:i]
        if _way_between(one, other, parents, lengths) > 0.5 * usual
    ]


def _way_between(one: int, other: int, parents: Sequence[int], lengths: NDArray) -> float:
    """The length of the links between two links, along the skeleton; none where they meet."""

    def up(joint: int) -> list[int]:
        way = [joint]
        while parents[way[-1]] >= 0:
            way.append(parents[way[-1]])
        return way

    first, second = up(one), up(other)
    shared = set(first) & set(second)
    if one in shared or other in shared:  # one hangs on the other
        longer, shorter = (first, other) if other in shared else (second, one)
        return float(sum(lengths[joint] for joint in longer[1 : longer.index(shorter)]))
    return float(sum(lengths[joint] for joint in (*first[1:], *second[1:]) if joint not in shared))


def _depths(parents: Sequence[int]) -> NDArray:
    depths = np.zeros(len(parents), int)
    for joint, parent in enumerate(parents):
        depths[joint] = 0 if parent < 0 else depths[parent] + 1
    return depths


def _spread(push: NDArray, subjoints: SubJoints) -> NDArray:
    """Pushes (T, J, 3) of joints against their parents, as moves of all sub-joints (T, S, 3)."""
    parents = subjoints.skeleton.parents
    joints = push.copy()
    for joint, parent in enumerate(parents):
        if parent >= 0:
            joints[:, joint] += joints[:, parent]
    above = np.array([max(parent, 0) for parent in parents])[subjoints.joint]
    share = subjoints.along[:, None]
    return (1 - share) * joints[:, above] + share * joints[:, subjoints.joint]
