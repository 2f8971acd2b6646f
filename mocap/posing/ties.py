"""What a skeleton is to springs: a tree in an order that does not depend on how its joints are numbered.

A *star* is a joint with all its children: what turns with it.  Joints are ordered by depth, then by their parents'
order, then by where they are; so the same figure gives the same sums, to the last digit, however it is numbered.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError

SIBLINGS = 12
"""With so many of its siblings a link is tied to what follows it: a dandelion must not cost the square of its seeds."""

STRAIGHT = 0.1
"""Springs along a straight limb resist a bend only when it has begun; in rounds this much is counted on at once."""


@dataclass(frozen=True, eq=False)
class Tree:
    """J joints in order; all but `order` are in that order."""

    order: NDArray  # (J,) the skeleton's own numbers
    parents: NDArray  # (J,)
    first: NDArray  # (J,) a joint's first child
    count: NDArray  # (J,) how many children, one after the other

    def ways(self, positions: NDArray) -> NDArray:
        """From parents to joints (J, 3); nothing for the root."""
        ways = positions - positions[self.parents]
        ways[0] = 0
        return ways

    def springs(self, near: float, far: float, fixed: Sequence[int] = ()) -> tuple[NDArray, NDArray]:
        """Pairs (P, 2) of joints two and three links apart, and how stiff (P,) the springs between them are.

        Across fixed joints there are none: a foot stays flat on the floor whatever the shin above it does.
        """
        pairs, apart, across = _pairs(tuple(self.parents.tolist()))
        stiff = np.where(apart == 2, near, far)
        free = np.ones(len(self.parents) + 1, bool)  # the last is for -1, nowhere
        free[list(fixed)] = False
        return pairs, stiff * free[across].all(axis=1)

    def bends(self, positions: NDArray, stiff: NDArray) -> NDArray:
        """How stiff joints (J,) are against being bent, by springs as stiff as (P,) says."""
        pairs, _, across = _pairs(tuple(self.parents.tolist()))
        bends = np.zeros(len(positions))
        a, b = positions[pairs[:, 0]], positions[pairs[:, 1]]
        along = (b - a) / np.maximum(np.sqrt(((b - a) ** 2).sum(axis=1)), 1e-12)[:, None]
        for joints in across.T:
            there = joints >= 0
            arm = b[there] - positions[joints[there]]
            square = (arm * arm).sum(axis=1)
            lever = square - (arm * along[there]).sum(axis=1) ** 2
            shorter = np.minimum(square, ((a[there] - positions[joints[there]]) ** 2).sum(axis=1))
            square = np.minimum(lever, shorter) + STRAIGHT * shorter
            bends += np.bincount(joints[there], stiff[there] * square, len(bends))
        return bends


def tree_of(parents: Sequence[int], positions: NDArray) -> Tree:
    """The tree of a skeleton whose joints are at positions (J, 3)."""
    root = _root(parents)
    below: list[list[int]] = [[] for _ in parents]
    for joint, parent in enumerate(parents):
        if parent >= 0:
            below[parent].append(joint)
    found = [root] if root >= 0 else []
    for joint in found:  # which grows on the way
        found += below[joint]
    if len(found) < len(parents):
        raise InputError("a skeleton must be a tree, this one's parents lead round in a circle: mend them")
    sizes, places = _sizes(found, parents), positions.tolist()
    order, above = [root], [-1]
    for rank, joint in enumerate(order):
        children = below[joint]
        order += sorted(children, key=lambda child: (places[child], sizes[child])) if len(children) > 1 else children
        above += [rank] * len(children)
    ranks = np.array(above)
    count = np.bincount(ranks[1:], minlength=len(ranks))
    return Tree(np.array(order), ranks, np.cumsum(count) - count + 1, count)


def _root(parents: Sequence[int]) -> int:
    """The joint that all others hang on."""
    count, roots = len(parents), [joint for joint, parent in enumerate(parents) if parent < 0]
    if not count or max(parents) >= count:
        raise InputError(f"parents must be joints, 0 to {count - 1}, or -1 for the root: mend the skeleton")
    if len(roots) > 1:
        raise InputError(
            f"a skeleton must hang together, this one has {len(roots)} roots (joints {roots[:9]}): pose one part at "
            "a time"
        )
    return roots[0] if roots else -1


def _sizes(order: list[int], parents: Sequence[int]) -> list[int]:
    """How many joints hang on each, with itself."""
    sizes = [1] * len(order)
    for joint in reversed(order):
        if parents[joint] >= 0:
            sizes[parents[joint]] += sizes[joint]
    return sizes


@lru_cache(maxsize=64)
def _pairs(parents: Sequence[int]) -> tuple[NDArray, NDArray, NDArray]:
    """Pairs (P, 2) of joints that a bend brings nearer to each other, how many links they are apart (P,), and where
    between them that bend may be (P, 2), -1 for nowhere."""
    below: list[list[int]] = [[] for _ in parents]
    for joint, parent in enumerate(parents):
        if parent >= 0:
            below[parent].append(joint)
    pairs, apart, across = [], [], []
    for joint, parent in enumerate(parents):
        if parent < 0:
            continue
        siblings = below[parent]
        mine = siblings.index(joint)
        beside = [siblings[(mine + n) % len(siblings)] for n in range(1, min(SIBLINGS + 1, len(siblings)))]
        beyond = [parents[parent]] * (parents[parent] >= 0) + beside
        for child in below[joint]:
            pairs += [(parent, child)] + [(other, child) for other in beyond]
            apart += [2] + [3] * len(beyond)
            across += [(joint, -1)] + [(joint, parent if other == parents[parent] else -1) for other in beyond]
    return np.array(pairs, np.int64).reshape(-1, 2), np.array(apart), np.array(across, np.int64).reshape(-1, 2)
