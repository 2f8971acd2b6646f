"""Joints marked on a drawing, and which joints of a skeleton they follow.

Both are told by `body.find_body`, by their names or else by their shape, so that left_elbow is LeftForeArm here and
LowerArm_L there.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from mocap.body import find_body
from mocap.bodynames import kind_of, limbs
from mocap.skeleton import Skeleton

ARM = ("shoulder", "elbow", "wrist")
LEG = ("hip", "knee", "ankle", "toe")
SIDES = ("left", "right")


@dataclass(frozen=True, eq=False)
class Marks:
    """J joints marked on a drawing, in its pixels, y down; parents come before their children, a root has -1."""

    names: tuple[str, ...]
    parents: tuple[int, ...]
    places: NDArray  # (J, 2)

    def __len__(self) -> int:
        return len(self.names)

    def lengths(self) -> NDArray:
        """How long the bone from each joint's parent to it is (J,); a root has none: 0."""
        up = np.array(self.parents)
        away = np.linalg.norm(self.places - self.places[np.maximum(up, 0)], axis=1)
        return np.where(up < 0, 0.0, away)

    def skeleton(self) -> Skeleton:
        """The marks as a flat skeleton, y up."""
        up = np.array(self.parents)
        away = np.where((up < 0)[:, None], self.places, self.places - self.places[np.maximum(up, 0)])
        return Skeleton(self.names, self.parents, np.column_stack([away * (1, -1), np.zeros(len(self))]))


def check(marks: Marks, name: str = "the drawing") -> Marks:
    """Refuse marks that are no skeleton; returns them unchanged."""
    if len(marks) < 2 or marks.places.shape != (len(marks), 2) or len(marks.parents) != len(marks):
        raise InputError(
            f"{name} must have two marked joints or more, each a place (x, y) and a parent: it has {len(marks)}"
        )
    if len(set(marks.names)) < len(marks):
        twice = next(one for one in marks.names if marks.names.count(one) > 1)
        raise InputError(f"{name} must name each marked joint once, {twice!r} comes twice: rename one")
    if not np.isfinite(marks.places).all():
        raise InputError(f"{name} must have its marked joints at finite places, some are not")
    if any(not -1 <= parent < joint for joint, parent in enumerate(marks.parents)):
        raise InputError(f"{name} must name the parent of each marked joint before the joint")
    return marks


def roles(skeleton: Skeleton, places: NDArray | None = None) -> dict[str, int]:
    """Which joint is what: {"hips": 0, "left elbow": 7, ...}; what is not found is left out.

    The chest is where the arms part from the spine, the hips where the legs do.  `places` (T, J, 3), or (J, 3), help
    where names do not tell.
    """
    parts = find_body(skeleton, places).parts
    found: dict[str, int] = {}
    for side in SIDES:
        arm, leg = list(parts.get(f"{side} arm", ())), list(parts.get(f"{side} leg", ()))
        handless = arm and kind_of(skeleton.names[arm[-1]])[0] == "arm"
        arm = arm[-2:] if handless else arm[-3:]
        foot = next((k for k, joint in enumerate(leg) if kind_of(skeleton.names[joint])[0] == "foot"), 2)
        leg = leg[max(foot - 2, 0) :]  # some files have a joint more above the hip
        found |= {f"{side} {what}": joint for what, joint in zip(ARM, arm, strict=False) if len(arm) > 1}
        found |= {f"{side} {what}": joint for what, joint in zip(LEG, leg, strict=False) if len(leg) > 1}
        if handless and len(arm) > 1 and skeleton.children(arm[-1]):
            found[f"{side} wrist"] = skeleton.children(arm[-1])[0]
    spine = parts.get("spine", ())
    for name, ends, otherwise in (("hips", "hip", spine[:1]), ("chest", "shoulder", spine[-1:])):
        pair = [found.get(f"{side} {ends}") for side in SIDES]
        met = -1 if None in pair else _meet(*pair, skeleton.parents)
        if met >= 0 or otherwise:
            found[name] = met if met >= 0 else otherwise[0]
    if parts.get("head"):
        top = parts["head"][-1]
        end = [child for child in skeleton.children(top) if not skeleton.children(child)]
        found["head"] = end[0] if len(end) == 1 and "end" in skeleton.names[end[0]].lower() else top
    return found


def limb_of(joint: int, parents: tuple[int, ...], role_of: dict[int, str]) -> str:
    """The limb, "left arm" or so, or else "trunk", that a joint belongs to, by the nearest role at it or above."""
    while joint >= 0:
        side, _, what = role_of.get(joint, "").rpartition(" ")
        if what in ARM[1:]:
            return f"{side} arm"
        if what in LEG[1:]:
            return f"{side} leg"
        if joint in role_of:
            return "trunk"
        joint = parents[joint]
    return "trunk"


def matched(marks: Marks, skeleton: Skeleton, places: NDArray | None = None) -> tuple[dict[str, tuple[int, int]], str]:
    """Which joint of a skeleton each marked joint follows: role -> (mark, joint), and a sentence that says it."""
    if pairs := named_alike(marks, skeleton):
        return pairs, f"joints: {', '.join(pairs)} are called alike"
    here, there = roles(marks.skeleton()), roles(skeleton, places)
    pairs = {role: (mark, there[role]) for role, mark in here.items() if role in there}
    if len(pairs) < 3:
        raise InputError(
            "the marked joints must be a figure's, such as left_elbow, right_knee and torso: of "
            f"{', '.join(marks.names)} only {', '.join(pairs) or 'none'} is found in the skeleton"
        )
    used = {mark for mark, _ in pairs.values()}
    left = [name for joint, name in enumerate(marks.names) if joint not in used and marks.lengths()[joint] > 0]
    told = ", ".join(f"{marks.names[mark]} = {skeleton.names[joint]}" for mark, joint in pairs.values())
    return pairs, f"joints: {told}" + (f"; {', '.join(left)} go with what they hang on" if left else "")


def named_alike(marks: Marks, skeleton: Skeleton) -> dict[str, tuple[int, int]]:
    """Name -> (mark, joint), where all marks are called as joints are, and their names tell no figure: a plant's."""
    if any(name.endswith(("arm", "leg")) for name in limbs(skeleton)):
        return {}
    joints = {_plain(name): joint for joint, name in enumerate(skeleton.names)}
    found = {_plain(name): (mark, joints.get(_plain(name), -1)) for mark, name in enumerate(marks.names)}
    return {} if any(joint < 0 for _, joint in found.values()) else found


def _plain(name: str) -> str:
    return " ".join(name.lower().replace("_", " ").replace("-", " ").split())


def _meet(one: int, other: int, parents: tuple[int, ...]) -> int:
    """The joint that two joints both hang on, or -1."""
    above = set()
    while one >= 0:
        above.add(one)
        one = parents[one]
    while other >= 0 and other not in above:
        other = parents[other]
    return other
