"""Joints marked on a drawing, and which joints of a skeleton they follow.

Names differ from file to file (LeftArm, UpperArm_L, mixamorig:LeftShoulder, left_shoulder), and one word may mean two
joints.  What never differs is the order of joints in a limb, so a limb is found by the words that are plain, elbow and
knee and hand and foot, and its other joints by their place in it.
"""

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError

ARM = ("shoulder", "elbow", "wrist", "fingers")
LEG = ("hip", "knee", "ankle", "toe")
TRUNK = ("hips", "chest", "head")
SIDES = ("left", "right")

_ELBOW = ("elbow", "forearm", "lowerarm", "lowarm", "loarm")
_KNEE = ("knee", "lowerleg", "lowleg", "loleg", "shin", "calf", "crus")
_WRIST, _ANKLE = ("wrist", "hand", "paw", "palm"), ("ankle", "foot", "paw")
_TIP_OF_ARM, _TOE = ("finger", "middle", "index"), ("toe", "ball")
_HEAD, _NECK = ("head", "skull", "face"), ("neck",)
_HIPS, _CHEST = ("hips", "pelvis", "root", "hip"), ("torso", "chest", "thorax", "upperback", "spine")


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


def roles(names: tuple[str, ...], parents: tuple[int, ...]) -> dict[str, int]:
    """Which joint is what: {"hips": 0, "left elbow": 7, ...}, of joints' names and parents; what is not found is left.

    The chest is where the arms part from the spine, the hips where the legs do.
    """
    words = [_plain(name) for name in names]
    sides = [_side(name) for name in names]
    found: dict[str, int] = {}
    for side in SIDES:
        for limb, bends, ends, tips in ((ARM, _ELBOW, _WRIST, _TIP_OF_ARM), (LEG, _KNEE, _ANKLE, _TOE)):
            own = [joint for joint in range(len(names)) if sides[joint] == side]
            bend = _first(own, words, bends)
            if bend is None and limb is LEG:  # LeftUpLeg and LeftLeg: the leg below is the shank
                bend = next((j for j in own if words[j] == "leg" and parents[j] in own), None)
            if bend is None or parents[bend] < 0:
                continue
            found[f"{side} {limb[0]}"], found[f"{side} {limb[1]}"] = parents[bend], bend
            below = [joint for joint in _below(bend, parents) if joint != bend]
            end = _first(below, words, ends)
            if end is None and below:
                end = below[0]
            if end is None:
                continue
            found[f"{side} {limb[2]}"] = end
            beyond = [joint for joint in _below(end, parents) if joint != end]
            tip = _first(beyond, words, tips)
            if tip is not None:
                found[f"{side} {limb[3]}"] = tip
    found |= _trunk(words, sides, parents, found)
    return found


def _trunk(words: list[str], sides: list[str], parents: tuple[int, ...], limbs: dict[str, int]) -> dict[str, int]:
    found: dict[str, int] = {}
    middle = [joint for joint in range(len(words)) if not sides[joint]]
    for name, ends in (("hips", "hip"), ("chest", "shoulder")):
        pair = [limbs.get(f"{side} {ends}") for side in SIDES]
        if None not in pair:
            found[name] = _meet(*pair, parents)
    if found.get("hips", -1) < 0:
        found["hips"] = (_first(middle, words, _HIPS) or 0) if middle else 0
    if found.get("chest", -1) < 0:
        chest = [joint for joint in middle if any(word in words[joint] for word in _CHEST)]
        found.pop("chest", None)
        if chest:
            found["chest"] = chest[-1]
    head = [joint for joint in middle if any(word in words[joint] for word in _HEAD)]
    neck = [joint for joint in middle if any(word in words[joint] for word in _NECK)]
    if head or neck:
        top = head or neck[-1:]
        end = [joint for joint in range(len(words)) if parents[joint] == top[-1] and "end" in words[joint]]
        found["head"] = (end or top)[-1]
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


def matched(marks: Marks, names: tuple[str, ...], parents: tuple[int, ...]) -> tuple[dict[str, tuple[int, int]], str]:
    """Which joint of a skeleton each marked joint follows: role -> (mark, joint), and a sentence that says it."""
    here, there = roles(marks.names, marks.parents), roles(names, parents)
    pairs = {role: (mark, there[role]) for role, mark in here.items() if role in there}
    if len(pairs) < 3:
        raise InputError(
            "the marked joints must be a figure's, such as left_elbow, right_knee and torso: of "
            f"{', '.join(marks.names)} only {', '.join(pairs) or 'none'} is found in the skeleton"
        )
    used = {mark for mark, _ in pairs.values()}
    left = [name for joint, name in enumerate(marks.names) if joint not in used and marks.lengths()[joint] > 0]
    told = ", ".join(f"{marks.names[mark]} = {names[joint]}" for mark, joint in pairs.values())
    return pairs, f"joints: {told}" + (f"; {', '.join(left)} go with what they hang on" if left else "")


def _plain(name: str) -> str:
    """A name's word: no prefix before a colon, no blanks, no side, small."""
    return re.sub(r"[^a-z0-9]", "", _sideless(name).lower())


def _sideless(name: str) -> str:
    name = re.split(r"[:|]", name)[-1]
    name = re.sub(r"(?i)left|right", "", name)
    name = re.sub(r"(?<![A-Za-z])[LRlr](?=[_.\-\s]|[A-Z])", "", name)
    return re.sub(r"[_.\-\s][LRlr](?=$|[_.\-\s])", "", name)


def _side(name: str) -> str:
    bare = re.split(r"[:|]", name)[-1]
    for side, letter in (("left", "L"), ("right", "R")):
        if re.search(f"(?i){side}", bare) or re.search(
            rf"(?:(?<![A-Za-z]){letter}(?=[_.\-\s]|[A-Z][a-z])|[_.\-\s]{letter}(?=$|[_.\-\s\d]))"
            rf"|(?:^|[_.\-\s]){letter.lower()}(?=$|[_.\-\s])|^{letter.lower()}(?=hand|foot|arm|leg|thumb)",
            bare,
        ):
            return side
    return ""


def _first(joints: list[int], words: list[str], wanted: tuple[str, ...]) -> int | None:
    """The first joint with one of the words in its name, the first words first."""
    for word in wanted:
        for joint in joints:
            if word in words[joint] and not words[joint].endswith("end"):
                return joint
    return None


def _below(joint: int, parents: tuple[int, ...]) -> list[int]:
    """The joint and all that hang on it, parents first."""
    inside = {joint}
    for other in range(joint + 1, len(parents)):
        if parents[other] in inside:
            inside.add(other)
    return sorted(inside)


def _meet(one: int, other: int, parents: tuple[int, ...]) -> int:
    """The joint that two joints both hang on, or -1."""
    above = set()
    while one >= 0:
        above.add(one)
        one = parents[one]
    while other >= 0 and other not in above:
        other = parents[other]
    return other
