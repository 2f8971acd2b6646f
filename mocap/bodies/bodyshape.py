"""Limbs told by the shape of a skeleton: paths of like length that hang on one joint are a left and a right limb.

Lengths of links do not change with the pose, so they tell pairs in any; where joints are tells left from right only.
"""

from collections import defaultdict

import numpy as np
from numpy.typing import NDArray

from mocap.bodies.bodynames import shared_path
from mocap.skeletons.skeleton import Skeleton

FINGERS, HELPERS = 0.1, 0.025
"""Where all branches are no longer than this, as a share of the farthest way through the skeleton, they are fingers or
a face; beside longer ones such a branch may be a head, and one this short helps a rig to twist or hold something."""
ALIKE = 0.8
"""A left and a right limb are as long as each other to this ratio."""


def limbs(skeleton: Skeleton, places: NDArray) -> dict[str, list[int]]:
    """The paths of joints from the body outwards by part, for joints at `places` (T, J, 3).

    The pair of limbs that is nearest to the root is its legs, the farthest its arms; what hangs beside the arms alone
    is the head, beside the legs the tail.
    """
    lengths, paths = skeleton.lengths(), _paths(_pruned(skeleton))
    hung: dict[int, list[list[int]]] = defaultdict(list)
    for path in paths:
        if skeleton.parents[path[0]] >= 0:
            hung[_seat(path, skeleton, lengths)].append(path)
    if not hung:
        return {"spine": max(paths, key=lambda path: lengths[path].sum())}
    from_root = {seat: float(lengths[list(skeleton.path(seat))].sum()) for seat in hung}
    pairs, alone = [], []
    for seat in sorted(hung, key=lambda seat: (from_root[seat], seat)):
        at_seat = hung[seat]
        while (pair := _likest(at_seat, lengths)) is not None:
            pairs.append((seat, pair))
            at_seat = [path for path in at_seat if path not in pair]
        alone += [(seat, path) for path in at_seat]
    found = {}
    names = ["leg"] if len(pairs) == 1 else ["leg", *(f"{n} middle leg" for n in range(1, len(pairs) - 1)), "arm"]
    across = _left(pairs, skeleton, places)
    for (_, (one, other)), name in zip(pairs, names):
        apart = _apart(one, other, places)
        left, right = (one, other) if np.median((apart * across).sum(axis=-1)) >= 0 else (other, one)
        found |= {f"left {name}": left, f"right {name}": right}
    for name, path in zip(("head", "tail"), _head_and_tail(pairs, alone, from_root, lengths)):
        if path:
            found[name] = path
    limbs = {joint for path in found.values() for joint in path}
    spine = shared_path([skeleton.parents[path[0]] for path in found.values()], skeleton)
    spine = [joint for joint in spine if joint not in limbs]
    return found | ({"spine": spine} if spine else {})


def _pruned(skeleton: Skeleton) -> dict[int, list[int]]:
    """Each joint's children, without fingers, toes, face, and ends of links."""
    lengths = skeleton.lengths()
    reach = np.zeros(len(skeleton))
    farthest = np.zeros(len(skeleton))
    for joint in reversed(range(len(skeleton))):
        ways = sorted((reach[child] + lengths[child] for child in skeleton.children(joint)), reverse=True)
        reach[joint] = ways[0] if ways else 0.0
        farthest[joint] = sum(ways[:2])
    fingers, helpers = FINGERS * farthest.max(), HELPERS * farthest.max()
    tree: dict[int, list[int]] = {}
    gone = np.zeros(len(skeleton), bool)
    for joint, parent in enumerate(skeleton.parents):
        children = [child for child in skeleton.children(joint) if not skeleton.names[child].endswith(" end")]
        long = any(reach[child] + lengths[child] > fingers for child in children)
        kept = [child for child in children if long and reach[child] + lengths[child] > helpers]
        gone[joint] = parent >= 0 and (gone[parent] or joint not in tree[parent])
        tree[joint] = [] if gone[joint] else children if len(children) == 1 else kept
    return {joint: children for joint, children in tree.items() if not gone[joint]}


def _paths(tree: dict[int, list[int]]) -> list[list[int]]:
    """The unbranched paths that end in a tip, from the joint after the last branching."""
    above = {child: joint for joint, children in tree.items() for child in children}
    found = []
    for tip in (joint for joint, children in tree.items() if not children):
        path = [tip]
        while path[-1] in above and len(tree[above[path[-1]]]) == 1:
            path.append(above[path[-1]])
        found.append(path[::-1])
    return found


def _seat(path: list[int], skeleton: Skeleton, lengths: NDArray) -> int:
    """The joint that a path hangs on; of joints in one place, the first."""
    seat = skeleton.parents[path[0]]
    while seat >= 0 and skeleton.parents[seat] >= 0 and lengths[seat] <= 1e-6 * lengths.sum():
        seat = skeleton.parents[seat]
    return seat


def _likest(paths: list[list[int]], lengths: NDArray) -> tuple[list[int], list[int]] | None:
    """The two paths of one seat that are most alike, if any are."""
    best, pair = ALIKE, None
    for at, one in enumerate(paths):
        for other in paths[at + 1 :]:
            a, b = lengths[one].sum(), lengths[other].sum()
            alike = min(a, b) / max(a, b, 1e-12) - 0.05 * abs(len(one) - len(other))
            if alike > best:
                best, pair = alike, (one, other)
    return pair


def _head_and_tail(
    pairs: list[tuple], alone: list[tuple[int, list[int]]], from_root: dict[int, float], lengths: NDArray
) -> tuple[list[int], list[int]]:
    """The longest of the paths without a like, nearer to the arms, and nearer to the legs of two pairs."""
    hips = pairs[0][0] if pairs else -1
    far = [path for seat, path in alone if seat != hips or len(pairs) < 2]
    near = [path for seat, path in alone if seat == hips and len(pairs) > 1]

    def longest(paths: list[list[int]]) -> list[int]:
        return max(paths, key=lambda path: lengths[path].sum(), default=[])

    return longest(far), longest(near)


def _apart(one: list[int], other: list[int], places: NDArray) -> NDArray:
    """Which way it is from a limb to its like (T, 3), where they begin: legs may cross, hips do not."""
    ways = [places[:, a] - places[:, b] for a, b in zip(one, other)]
    far = [float(np.median(np.linalg.norm(way, axis=-1))) for way in ways]
    return next(way for way, distance in zip(ways, far) if distance >= 0.2 * max(far))


def _left(pairs: list[tuple], skeleton: Skeleton, places: NDArray) -> NDArray:
    """Which way is left (T, 3): up by the legs, ahead by the feet, or along the back of one on all fours."""
    if not pairs:
        return np.array([[1.0, 0, 0]])
    hips, legs = pairs[0]
    up = sum(places[:, hips] - places[:, leg[-1]] for leg in legs)
    up = up / np.maximum(np.linalg.norm(up, axis=-1, keepdims=True), 1e-12)
    ahead = places[:, pairs[-1][0]] - places[:, hips]
    if np.median(_across(ahead, up)) <= np.median(np.abs((ahead * up).sum(axis=-1))):  # the back is upright
        ahead = sum(_foot(leg, skeleton, places) for leg in legs)
    if np.median(_across(ahead, up)) < 1e-9:
        ahead = np.array([0.0, 0, 1] if np.abs(np.median(up, axis=0)).argmax() == 1 else [0.0, -1, 0])
    return np.cross(up, ahead)


def _foot(leg: list[int], skeleton: Skeleton, places: NDArray) -> NDArray:
    """The last link of a leg (T, 3), its end site included."""
    ends = [end for end in skeleton.children(leg[-1]) if np.linalg.norm(skeleton.offsets[end]) > 0]
    path = [skeleton.parents[leg[0]], *leg, *ends[:1]]
    return places[:, path[-1]] - places[:, path[-2]]


def _across(way: NDArray, up: NDArray) -> NDArray:
    """How much of a way (T, 3) is not along `up`."""
    return np.linalg.norm(way - (way * up).sum(axis=-1, keepdims=True) * up, axis=-1)
