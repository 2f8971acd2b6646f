"""Limbs told by the names of joints, as motion capture suites, rigs and research data write them."""

import re

from mocap.skeletons.skeleton import Skeleton

SIDES = {"left": "left", "l": "left", "lft": "left", "right": "right", "r": "right", "rgt": "right"}

STEMS = (  # what a name holds, and what such a joint is; the first that fits counts
    ("toe", r"toe|footindex|(?<!eye)ball"),
    ("finger", r"thumb|index|middle|(?<![a-z])ring|inhandring|handring|pinky|little|finger|palm|metacarp"),
    ("foot", r"foot|ankle|hoof|paw"),
    ("leg", r"leg|knee|shin|calf|thigh|femur|tibia"),
    ("hand", r"hand|wrist"),
    ("arm", r"arm|elbow|shoulder|shldr|collar|clavicle|scapula|humer|radius"),
    ("hip", r"hip|pelvis"),
    ("tail", r"tail"),
    ("head", r"head|skull|neck"),
    ("spine", r"spine|chest|back|torso|waist|abdomen|stomach|thorax|trunk"),
)
SIDED = ("toe", "foot", "leg", "hand", "arm")
"""Without a side a name of these means nothing: "Armature" is no arm."""


def limbs(skeleton: Skeleton) -> dict[str, list[int]]:
    """The paths of joints from the body outwards by part, of the parts that the names tell."""
    kinds = [kind_of(name) for name in skeleton.names]
    part = [_part(kind) for kind in kinds]
    depth = [len(skeleton.path(joint)) for joint in range(len(skeleton))]
    found = {}
    for name in sorted({one for one in part if one not in ("", "spine")}):
        own = [joint for joint in range(len(skeleton)) if part[joint] == name]
        path = _path(_tip(own, kinds, depth), name, part, skeleton)
        if len(path) > 1 or name in ("head", "tail"):
            found[name] = path
    spine = _spine(found, part, skeleton, depth)
    return {"spine": spine} | found if spine else found


def kind_of(name: str) -> tuple[str, str, str]:
    """What a joint is by its name ("arm", "toe", ... or ""), on which side, and whether "front" or "hind"."""
    name = name.rpartition(":")[2]
    words = [word.lower() for word in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+", name)]
    if {"end", "nub", "site", "eye", "ear", "jaw", "hair"} & set(words):
        return "", "", ""
    side = next((SIDES[word] for word in words if word in SIDES), "")
    rest = "".join(word for word in words if word not in SIDES)
    glued = re.match(rf"(left|right|l|r)(?=(?:{_GLUED}))", rest)
    if not side and glued:
        side, rest = SIDES[glued[1]], rest[glued.end() :]
    kind = next((kind for kind, stem in STEMS if re.search(stem, rest)), "")
    kind = {"hip": "leg" if side else "spine"}.get(kind, kind)
    if kind in SIDED and not side:
        return "", "", ""
    end = ""
    if kind in ("leg", "foot", "toe"):
        end = "front" if re.search(r"front|fore", rest) else "hind" if re.search(r"hind|rear|back", rest) else ""
    return kind, side, end


_GLUED = "hip|hand|arm|leg|foot|thumb|finger|shoulder|knee|elbow|ankle|wrist|toe|thigh|shin|calf|coll|clav|up|low|fore"


def _part(kind: tuple[str, str, str]) -> str:
    what, side, end = kind
    if what in ("arm", "hand"):
        return f"{side} arm"
    if what in ("leg", "foot", "toe"):
        return f"{side} {end} leg" if end else f"{side} leg"
    return what if what in ("head", "tail", "spine") else ""


def _tip(own: list[int], kinds: list[tuple[str, str, str]], depth: list[int]) -> int:
    """The joint at which a part ends: the nearest toe or wrist, since fingers are many; else the farthest joint."""
    for kind, nearest in (("toe", True), ("hand", True), ("foot", False)):
        such = [joint for joint in own if kinds[joint][0] == kind]
        if such:
            return min(such, key=lambda joint: depth[joint] if nearest else -depth[joint])
    return max(own, key=lambda joint: depth[joint])


def _path(tip: int, name: str, part: list[str], skeleton: Skeleton) -> list[int]:
    """From the part's first joint to its tip, over helpers between that have no telling name."""
    path, at = [tip], skeleton.parents[tip]
    while at >= 0 and part[at] in (name, ""):
        path.append(at)
        at = skeleton.parents[at]
    while part[path[-1]] != name:
        path.pop()
    return path[::-1]


def _spine(found: dict[str, list[int]], part: list[str], skeleton: Skeleton, depth: list[int]) -> list[int]:
    """From the joint that all limbs hang on, to the one that the arms, or the head, hang on."""
    ends = [skeleton.parents[path[0]] for path in found.values() if skeleton.parents[path[0]] >= 0]
    ends += [joint for joint in range(len(skeleton)) if part[joint] == "spine"]
    limbs = {joint for path in found.values() for joint in path}
    return [joint for joint in shared_path(ends, skeleton) if joint not in limbs]


def shared_path(ends: list[int], skeleton: Skeleton) -> list[int]:
    """The way to the deepest of some joints, from the last joint that the ways from the root to all of them share."""
    ways = [skeleton.path(joint) for joint in ends]
    shared = set.intersection(*map(set, ways)) if ways else set()
    if not shared:
        return []
    longest = max(ways, key=len)
    return list(longest[max(longest.index(joint) for joint in shared) :])
