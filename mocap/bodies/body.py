"""Which joint is what: arms, legs, spine, head and tail of any skeleton, told by names, or else by shape.

Read `bodynames` and `bodyshape` for the two ways; here is what both lead to.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mocap.bodies import bodynames, bodyshape
from mocap.skeletons.skeleton import Skeleton


@dataclass(frozen=True, eq=False)
class Body:
    """The parts of a skeleton of J joints."""

    parts: dict[str, tuple[int, ...]]  # "spine", "head", "tail", "left arm", ...: joints from the body outwards
    feet: tuple[int, ...]  # of each leg the joint that stands: the toe, or the end of a foot without one; left first
    hands: tuple[int, ...]  # the wrist of each arm, left first
    label: NDArray  # (J,) str: the part each joint belongs to, fingers to their arm; "root" above the spine
    told: str  # a sentence: how the parts were told

    def legs(self) -> tuple[tuple[int, ...], ...]:
        """The joints of each leg, from the hip outwards."""
        return tuple(joints for name, joints in self.parts.items() if name.endswith("leg"))


def find_body(skeleton: Skeleton, places: NDArray | None = None) -> Body:
    """The parts of a skeleton; what it has not, such as a tail, or any part of a rope, is not in `parts`.

    `places` (T, J, 3), or (J, 3), where its joints are in some frames: by them the arms of an animal on all fours are
    told to be front legs, and left is told from right where names do not tell.  Without them it is the rest pose,
    which in many files means nothing.  A part has the joints of one path, without fingers and end sites, and without
    joints that lie where their parents lie.
    """
    places = rest_places(skeleton)[None] if places is None else np.asarray(places, float)
    places = places.reshape(-1, len(skeleton), 3)
    paths = bodynames.limbs(skeleton)
    told = "its parts were told by the names of its joints"
    if sum(name.endswith(("leg", "arm")) for name in paths) < 2:
        paths = bodyshape.limbs(skeleton, places)
        told = "its joints have no names that tell its parts, they were told by its shape"
    paths = _on_all_fours(paths, places)
    size = float(skeleton.lengths().sum())
    parts = {name: _apart(path, skeleton, size) for name, path in sorted(paths.items(), key=_order)}
    legs = [joints for name, joints in parts.items() if name.endswith("leg")]
    arms = [joints for name, joints in parts.items() if name.endswith("arm")]
    feet = tuple(_standing(leg, skeleton, size) for leg in legs)
    return Body(parts, feet, tuple(joints[-1] for joints in arms), _labels(paths, skeleton), told)


def rest_places(skeleton: Skeleton) -> NDArray:
    """Where the joints (J, 3) are when nothing is turned."""
    places = np.array(skeleton.offsets, float)
    for joint, parent in enumerate(skeleton.parents):
        if parent >= 0:
            places[joint] += places[parent]
    return places


def _on_all_fours(paths: dict[str, list[int]], places: NDArray) -> dict[str, list[int]]:
    """Arms as front legs, where they go along with the legs and the back goes across."""
    limbs = [f"{side} {limb}" for limb in ("leg", "arm") for side in ("left", "right")]
    if not all(limb in paths for limb in limbs):
        return paths
    ways = [places[:, paths[limb][-1]] - places[:, paths[limb][0]] for limb in limbs]
    left_leg, right_leg, left_arm, right_arm = (_unit(way) for way in ways)
    tops = [places[:, paths[limb][0]] for limb in limbs]
    back = _unit(tops[2] + tops[3] - tops[0] - tops[1])
    down = _unit(left_leg + right_leg)

    def along(a: NDArray, b: NDArray) -> float:
        return float(np.median((a * b).sum(axis=-1)))

    agree = min(along(left_leg, right_leg), along(left_arm, down), along(right_arm, down))
    if agree < 0.5 or abs(along(back, down)) > 0.5:
        return paths
    fours = {"leg": "hind leg", "arm": "front leg"}
    return {_renamed(name, fours): path for name, path in paths.items()}


def _renamed(name: str, changes: dict[str, str]) -> str:
    side, _, limb = name.partition(" ")
    return f"{side} {changes[limb]}" if limb in changes else name


def _unit(way: NDArray) -> NDArray:
    return way / np.maximum(np.linalg.norm(way, axis=-1, keepdims=True), 1e-12)


def _apart(path: list[int], skeleton: Skeleton, size: float) -> tuple[int, ...]:
    """A path without the joints that lie where their parents lie, but for its last."""
    lengths = skeleton.lengths()
    roots = [joint for joint in path if skeleton.parents[joint] < 0]
    return tuple(joint for joint in path if lengths[joint] > 1e-6 * size or joint == path[-1] or joint in roots)


def _standing(leg: tuple[int, ...], skeleton: Skeleton, size: float) -> int:
    """What of a leg stands: its toe; of one without a toe (hip, knee, ankle) the end of the foot, where it is known."""
    tip = leg[-1]
    ends = [end for end in skeleton.children(tip) if skeleton.lengths()[end] > 1e-6 * size]
    toeless = len(leg) < 4 and "toe" not in skeleton.names[tip].lower()
    return ends[0] if toeless and len(ends) == 1 and not skeleton.children(ends[0]) else tip


def _labels(paths: dict[str, list[int]], skeleton: Skeleton) -> NDArray:
    own = {joint: name for name, path in paths.items() for joint in path}
    label: list[str] = []
    for joint, parent in enumerate(skeleton.parents):
        label.append(own.get(joint, label[parent] if parent >= 0 else "root"))
    return np.array(label)


def _order(item: tuple[str, list[int]]) -> tuple[int, str]:
    side = item[0].partition(" ")[0]
    return ["spine", "head", "left", "right", "tail"].index(side) if side in _FIRST else 9, item[0]


_FIRST = ("spine", "head", "left", "right", "tail")
