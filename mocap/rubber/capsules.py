"""How far limbs that go into each other have to move, frame by frame: links taken as capsules, pair by pair.

Twice the same: `run` in plain NumPy, all frames at once, and `compiled`, loop by loop, as machine code that looks twice
only at links that are near each other.
"""

from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

TINY = 1e-9
LEAST_SHARE = 0.3
"""A link that turns about a joint fast to the body moves its end no more than 1 / so much for what lies along it."""


@lru_cache
def compiled() -> Callable[..., tuple[NDArray, NDArray]]:
    """`run` as machine code, which is kept on disk where that is possible."""
    from numba import njit

    try:
        return njit(_loops, cache=True, error_model="numpy", nogil=True)
    except RuntimeError:  # there is no folder where the machine code could be kept
        return njit(_loops, error_model="numpy", nogil=True)


def run(
    joints: NDArray, captured: NDArray, pairs: NDArray, parents: NDArray, fast: NDArray, thick: NDArray
) -> tuple[NDArray, NDArray]:
    """Pushes (T, J, 3) of joints against their parents, and how deep any two links are in each other (T,), metres.

    Links are named by their far joints; of `pairs` (P, 2) the first gives way.  `thick` (J,) are the links' radii,
    `fast` (J,) says whose parent is fast to the body.  Two links may be as near as they were `captured` (T, J, 3).
    Links that have passed through each other are pushed back to the side on which they were captured, the less the
    further they are through: so a push does not turn round while they pass.
    """
    push, deepest = np.zeros_like(joints), np.zeros(len(joints))
    for one, other in pairs.tolist():
        ends = [parents[one], one, parents[other], other]
        way, (share, _) = nearest_points(*(joints[:, k] for k in ends))
        before, _ = nearest_points(*(captured[:, k] for k in ends))
        distance, radius = np.linalg.norm(way, axis=1), thick[one] + thick[other]
        allowed = np.minimum(radius, np.linalg.norm(before, axis=1))
        lack = np.maximum(allowed - distance, 0)
        deepest = np.maximum(deepest, lack)
        through = (way * before).sum(axis=1) < 0
        back = np.maximum((allowed + distance) * (1 - distance / radius), 0)
        size = np.where(through, -back, lack) / np.maximum(distance, TINY)
        for joint, part in _give_way(one, share, parents, fast):
            step = (size * part)[:, None] * way
            stronger = (step**2).sum(axis=1) > (push[:, joint] ** 2).sum(axis=1)
            push[stronger, joint] = step[stronger]
    return push, deepest


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


def _give_way(link: int, share: NDArray, parents: Sequence[int], fast: NDArray) -> list[tuple[int, NDArray]]:
    """Which joints move, against their parents, and how far for a push of 1 at `share` (T,) along a link.

    The two ends share the push as a lever does; an end that is fast to the body leaves it to the other.
    """
    if fast[link]:
        return [(link, 1 / np.maximum(share, LEAST_SHARE))]
    lever = share**2 + (1 - share) ** 2
    return [(parents[link], (1 - share) / lever), (link, (2 * share - 1) / lever)]


def _loops(joints, captured, pairs, parents, fast, thick):  # noqa: ANN001, ANN202 - numba infers the types
    frames, count, _ = joints.shape
    push, deepest = np.zeros((frames, count, 3)), np.zeros(frames)
    middle, half = np.empty((count, 3)), np.empty(count)
    way, before, step = np.empty(3), np.empty(3), np.empty(3)
    for t in range(frames):
        for j in range(count):
            p = max(parents[j], 0)
            square = 0.0
            for d in range(3):
                middle[j, d] = 0.5 * (joints[t, j, d] + joints[t, p, d])
                square += (joints[t, j, d] - joints[t, p, d]) ** 2
            half[j] = 0.5 * np.sqrt(square)
        for n in range(len(pairs)):
            one, other = pairs[n, 0], pairs[n, 1]
            radius = thick[one] + thick[other]
            square = 0.0
            for d in range(3):
                square += (middle[one, d] - middle[other, d]) ** 2
            if square > (half[one] + half[other] + radius) ** 2:
                continue
            distance, allowed, share, side = 0.0, 0.0, 0.0, 0.0
            for k in range(2):  # as captured, and as it is
                places = captured[t] if k == 0 else joints[t]
                ff, ss, fs, fb, sb = 1e-18, 1e-18, 0.0, 0.0, 0.0
                for d in range(3):
                    first = places[one, d] - places[parents[one], d]
                    second = places[other, d] - places[parents[other], d]
                    between = places[parents[one], d] - places[parents[other], d]
                    ff, ss, fs = ff + first * first, ss + second * second, fs + first * second
                    fb, sb = fb + first * between, sb + second * between
                across = ff * ss - fs * fs
                along = min(max((fs * sb - ss * fb) / across, 0.0), 1.0) if across > 1e-12 * ff * ss else 0.5
                opposite = min(max((fs * along + sb) / ss, 0.0), 1.0)
                along = min(max((fs * opposite - fb) / ff, 0.0), 1.0)
                square = 0.0
                for d in range(3):
                    first = places[one, d] - places[parents[one], d]
                    second = places[other, d] - places[parents[other], d]
                    way[d] = places[parents[one], d] - places[parents[other], d] + along * first - opposite * second
                    square += way[d] * way[d]
                if k == 0:
                    allowed = min(radius, np.sqrt(square))
                    before[:] = way
                else:
                    distance, share = np.sqrt(square), along
                    side = way[0] * before[0] + way[1] * before[1] + way[2] * before[2]
            if distance >= radius:
                continue
            lack = max(allowed - distance, 0.0)
            deepest[t] = max(deepest[t], lack)
            size = -(allowed + distance) * (1 - distance / radius) if side < 0 else lack
            size /= max(distance, TINY)
            lever = share**2 + (1 - share) ** 2
            for end in range(1 if fast[one] else 2):
                joint = one if fast[one] or end == 1 else parents[one]
                if fast[one]:
                    part = 1 / max(share, LEAST_SHARE)
                else:
                    part = (2 * share - 1) / lever if end == 1 else (1 - share) / lever
                new, old = 0.0, 0.0
                for d in range(3):
                    step[d] = size * part * way[d]
                    new, old = new + step[d] ** 2, old + push[t, joint, d] ** 2
                if new > old:
                    push[t, joint] = step
    return push, deepest
