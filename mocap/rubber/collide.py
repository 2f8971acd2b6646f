"""Limbs that go through each other: measured as capsules, and pushed apart.

Motion capture itself lets a hand touch a hip.  Only what exaggeration adds is a fault: two links may come as close as
they were captured, or as close as their capsules allow, whichever is closer.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mocap.rubber.subjoints import SubJoints
from mocap.skeleton import Skeleton

ROUNDS = 6
SMOOTH = 0.03
"""Seconds over which a push comes and goes: without it a limb would jump where it begins to touch."""


def radii(skeleton: Skeleton, share: float = 0.12) -> NDArray:
    """How thick the link above each joint is taken to be (J,), as a radius: a share of its own length.

    The median link bounds it from above twice over, so that a long spine is no barrel.
    """
    lengths = skeleton.lengths()
    usual = np.median(lengths[lengths > 0])
    return share * np.minimum(lengths, 2 * usual)


def overlaps(positions: NDArray, captured: NDArray, skeleton: Skeleton, thick: NDArray | None = None) -> NDArray:
    """How deep any two links go into each other beyond what was captured (T,), metres, for joints (T, J, 3) of both."""
    thick = radii(skeleton) if thick is None else thick
    deepest = np.zeros(len(positions))
    for one, other in _pairs(skeleton):
        _, _, lack = _lack(positions, captured, skeleton.parents, one, other, thick)
        np.maximum(deepest, lack, out=deepest)
    return deepest


def pushed_apart(
    positions: NDArray, captured: NDArray, subjoints: SubJoints, fps: float, thick: NDArray | None = None
) -> NDArray:
    """Sub-joints (T, S, 3) with links moved aside that overlap more than in the captured joints (T, J, 3).

    The link nearer to a limb's tip gives way; the push fades towards the body, and in time.
    """
    from scipy.ndimage import gaussian_filter1d, maximum_filter1d

    skeleton = subjoints.skeleton
    thick = radii(skeleton) if thick is None else thick
    depth = _depths(skeleton.parents)
    pairs, moved = _pairs(skeleton), positions
    width = SMOOTH * fps
    reach = 2 * int(np.ceil(2 * width)) + 1
    for _ in range(ROUNDS):
        joints = moved[:, subjoints.ends]
        push = np.zeros_like(joints)
        for one, other in pairs:
            way, at, lack = _lack(joints, captured, skeleton.parents, one, other, thick)
            if not lack.any():
                continue
            away = 1.0 if depth[one] >= depth[other] else -1.0
            loose, share = (one, at[0]) if away > 0 else (other, at[1])
            here = away * lack[:, None] * way
            for joint, part in _give_way(loose, share, skeleton.parents, depth):
                step = here * part[:, None]
                stronger = np.linalg.norm(step, axis=1) > np.linalg.norm(push[:, joint], axis=1)
                push[stronger, joint] = step[stronger]
        if not push.any():
            break
        size = np.linalg.norm(push, axis=-1)
        strongest = maximum_filter1d(size, reach, axis=0)  # smoothing must not take away what is needed
        smooth = gaussian_filter1d(push, width, axis=0, mode="nearest")
        soft = gaussian_filter1d(strongest, width, axis=0, mode="nearest")
        length = np.maximum(np.linalg.norm(smooth, axis=-1), 1e-12)
        moved = moved + _spread(smooth * (np.minimum(soft, strongest) / length)[..., None], subjoints)
    return moved


def _give_way(link: int, share: NDArray, parents: Sequence[int], depth: NDArray) -> list[tuple[int, NDArray]]:
    """Which joints move, against their parents, and how far for a push of 1 at `share` (T,) along a link.

    The two ends share the push as a lever does; an end that is fast to the body leaves it to the other.
    """
    parent = parents[link]
    if depth[parent] <= 1:
        return [(link, 1 / np.maximum(share, 0.3))]
    lever = share**2 + (1 - share) ** 2
    return [(parent, (1 - share) / lever), (link, (2 * share - 1) / lever)]


def _lack(
    joints: NDArray, captured: NDArray, parents: Sequence[int], one: int, other: int, thick: NDArray
) -> tuple[NDArray, tuple[NDArray, NDArray], NDArray]:
    """Unit ways (T, 3) from the other link to the one, shares (T,) along both, and metres they lack (T,)."""
    ends = [joints[:, k] for k in (parents[one], one, parents[other], other)]
    way, at = nearest_points(*ends)
    distance = np.linalg.norm(way, axis=-1)
    close = distance < thick[one] + thick[other]
    lack = np.zeros(len(joints))
    if close.any():
        before, _ = nearest_points(*(captured[close, k] for k in (parents[one], one, parents[other], other)))
        allowed = np.minimum(thick[one] + thick[other], np.linalg.norm(before, axis=-1))
        lack[close] = np.maximum(allowed - distance[close], 0)
    return way / np.maximum(distance, 1e-9)[:, None], at, lack


def nearest_points(a: NDArray, b: NDArray, c: NDArray, d: NDArray) -> tuple[NDArray, tuple[NDArray, NDArray]]:
    """From the segments c-d to the segments a-b the shortest ways (T, 3), and how far along each they are (T,).

    Distance is convex in the two shares: where the free minimum is outside, it is on the border of the unit square.
    """
    first, second, between = b - a, d - c, a - c
    ff, ss = (np.maximum((v * v).sum(axis=-1), 1e-18) for v in (first, second))
    fs, fb, sb = ((u * v).sum(axis=-1) for u, v in ((first, second), (first, between), (second, between)))
    apart = ff * ss - fs * fs
    along = np.clip(np.where(apart > 1e-12 * ff * ss, (fs * sb - ss * fb) / np.maximum(apart, 1e-18), 0.5), 0, 1)
    other = np.clip((fs * along + sb) / ss, 0, 1)
    along = np.clip((fs * other - fb) / ff, 0, 1)
    return between + along[..., None] * first - other[..., None] * second, (along, other)


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
