"""Which stretch of a performer each bone of a marked drawing follows, and how that stretch lies over time."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mocap import marks as marking
from mocap import views as viewing
from mocap.marks import Marks
from mocap.rubber.rubber import RubberMotion
from mocap.skeleton import Skeleton, SkeletonMotion
from mocap.views import Views

PIECES = {"trunk": 3, "arms": 4, "legs": 4}
"""Into how many sub-links a bone of a part is cut, so that it can bend like a hose."""

ASTRAY = 40.0
"""Degrees: a file's pose at rest is believed if trunk, shoulders and feet lie no farther from where they belong."""


@dataclass(frozen=True)
class Bone:
    """From a marked joint's parent to the joint, and what it follows."""

    mark: int  # the joint at its far end
    part: str  # "trunk", "arms" or "legs": whose view it is seen in
    limb: str  # what is drawn as one, before or behind the rest: "trunk", "left arm", ...
    pieces: int = 1
    joints: tuple[int, int] | None = None  # the performer's joints it follows; None goes with what it hangs on
    across: bool = False  # it follows the line from right to left, as shoulders and hips do
    pointing: bool = True  # it points where the performer's limb does; otherwise it turns by as much from its rest
    believed: bool = False  # the file's own rest is the performer's, whichever way it has the bone


@dataclass(frozen=True, eq=False)
class Casting:
    """How a performer's joints play a marked drawing."""

    marks: Marks
    bones: tuple[Bone, ...]
    roles: dict[str, tuple[int, int]]  # role: (mark, joint)
    views: Views
    notes: tuple[str, ...]  # what was matched and chosen, a sentence each


@dataclass(frozen=True, eq=False)
class Performer:
    """Joints and sub-joints of a motion, in its own frame: z is where it faces."""

    skeleton: Skeleton
    fps: float
    positions: NDArray  # (T, S, 3) in the world
    heading: NDArray  # (T,)
    thickness: NDArray  # (T, S)
    parents: tuple[int, ...]  # of the S sub-joints
    lengths: NDArray  # (S,) of their links at rest
    ends: NDArray  # (J,) the sub-joint of each joint
    rest: NDArray  # (S, 3) the sub-joints at rest, in the performer's frame
    captured: SkeletonMotion  # what it was made of

    @property
    def tall(self) -> float:
        """How high the performer reaches over its lowest joint, most of the time, in metres."""
        return float(np.median(np.ptp(self.positions[..., 1], axis=1))) or 1.0

    def path(self, first: int, last: int) -> list[int]:
        """The sub-joints from a joint down to another that hangs on it, or over what both hang on."""
        down, up = [self.ends[last]], [self.ends[first]]
        above = {up[0]: 0}
        while self.parents[up[-1]] >= 0:
            up.append(self.parents[up[-1]])
            above[up[-1]] = len(up) - 1
        while down[-1] not in above:
            down.append(self.parents[down[-1]])
        return [*up[: above[down[-1]]], *down[::-1]]


def performer(motion: SkeletonMotion | RubberMotion, turning: bool = True, sided: bool = True) -> Performer:
    """A motion ready to be looked at; the viewer goes round with the performer if `turning` and it is `sided`."""
    if isinstance(motion, RubberMotion):
        source, sub = motion.source, motion.subjoints
        positions, thickness = motion.positions, motion.thickness
        parents, ends, before = sub.parents, np.asarray(sub.ends), np.array(sub.parents)
        same = (before >= 0) & (sub.joint[np.maximum(before, 0)] == sub.joint)
        step = sub.along - np.where(same, sub.along[np.maximum(before, 0)], 0.0)
        lengths, joint, along = step * _lengths(source)[sub.joint], sub.joint, sub.along
    else:
        source, positions = motion, motion.positions()
        parents, ends, lengths = motion.skeleton.parents, np.arange(len(motion.skeleton)), _lengths(motion)
        joint, along = ends, np.ones(len(ends))
        thickness = np.ones(positions.shape[:2])
    skeleton = source.skeleton
    rest = _rest(skeleton)
    heading = np.zeros(len(positions))
    pairs = _sides(skeleton, positions[:, ends]) if sided else []
    if pairs:
        own = float(viewing.headings(rest[None], pairs, 1.0)[0])
        rest = viewing.turned(rest[None], np.array([own]))[0]
        if turning:
            heading = viewing.headings(positions[:, ends], pairs, source.fps)
    above = np.array(skeleton.parents)[joint]
    rest = rest[joint] - np.where(above < 0, 0.0, 1 - along)[:, None] * (rest[joint] - rest[np.maximum(above, 0)])
    parents = tuple(parents)
    return Performer(skeleton, source.fps, positions, heading, thickness, parents, lengths, ends, rest, source)


def cast_marks(motion: SkeletonMotion | RubberMotion, marks: Marks, views: Views | None = None) -> Casting:
    """Who follows whom, found by the joints' names; without `views` they are chosen by what moves where."""
    marking.check(marks)
    skeleton = motion.source.skeleton if isinstance(motion, RubberMotion) else motion.skeleton
    pairs, told = marking.matched(marks, skeleton, _joints(motion))
    bones = tuple(_bone(joint, marks, pairs) for joint in range(len(marks)) if marks.lengths()[joint] > 0)
    if marking.named_alike(marks, skeleton):  # no figure: it has no sides, and stands as its file says
        bones = tuple(replace(bone, believed=True) for bone in bones)
        views = views or viewing.STILL
    if views is None:
        acting = performer(motion)
        seen = {
            part: _directions(acting, tuple(bone for bone in bones if bone.part == part)) for part in ("arms", "legs")
        }
        views = viewing.chosen(seen, _in_profile(marks, pairs))
    return Casting(marks, bones, pairs, views, (told, views.note) if views.note else (told,))


def sub_links(acting: Performer, bone: Bone) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """How a bone's stretch of the performer lies: vectors (T, n, 3) of its n pieces in the performer's frame,
    their length against rest (T, n), their thickness (T, n), and which way (n, 3) each points at rest."""
    if bone.across:
        first, last = (acting.ends[joint] for joint in bone.joints)
        vectors = viewing.turned((acting.positions[:, last] - acting.positions[:, first])[:, None], acting.heading)
        length = np.linalg.norm(vectors, axis=-1)
        rest = _at_rest(bone, (acting.rest[last] - acting.rest[first])[None], vectors)
        return vectors, length / max(float(np.median(length)), 1e-12), np.ones(length.shape), rest
    path = acting.path(*bone.joints)
    links = np.array([a if acting.parents[a] == b else b for a, b in zip(path[1:], path[:-1])])  # each step's own link
    at = np.concatenate([[0.0], np.cumsum(acting.lengths[links])])
    if at[-1] <= 0:
        at = np.arange(len(path), dtype=float)
    even = np.linspace(0, at[-1], bone.pieces + 1)
    mix = _interpolation(at, even)  # (n + 1, path)
    points = np.einsum("np,tpx->tnx", mix, acting.positions[:, path])
    vectors = viewing.turned(np.diff(points, axis=1), acting.heading)
    stretch = np.linalg.norm(vectors, axis=-1) / (at[-1] / bone.pieces)
    if bone.pieces == 1 and not bone.pointing:  # a stiff head on a neck that is always bent is as long as ever
        stretch = stretch / max(float(np.median(stretch)), 1e-12)
    middle = np.clip(np.searchsorted(at, 0.5 * (even[1:] + even[:-1]), side="right") - 1, 0, len(links) - 1)
    rest = _at_rest(bone, np.diff(mix @ acting.rest[path], axis=0), vectors)
    return vectors, stretch, acting.thickness[:, links[middle]], rest


def _at_rest(bone: Bone, pieces: NDArray, vectors: NDArray) -> NDArray:
    """Which way a bone's pieces point at rest (n, 3), given as they are in the file's (n, 3), and over time (T, n, 3).

    The file is believed if it has the bone about where it belongs: up, to the left, or forward.  Else a trunk leans to
    a side at rest as it does most of the time, for some files end a head in its ear.
    """
    belongs = np.eye(3)[0 if bone.across else 1 if bone.part == "trunk" else 2]
    whole = pieces.sum(axis=0)
    if bone.believed:
        belongs = whole / max(np.linalg.norm(whole), 1e-12)
    if whole @ belongs <= np.cos(np.radians(ASTRAY)) * np.linalg.norm(whole) or not np.any(whole):
        upright = bone.part == "trunk" and not bone.across
        pieces = np.median(vectors, axis=0) * (1, 1, 0) if upright else np.zeros_like(pieces)
    length = np.linalg.norm(pieces, axis=1, keepdims=True)
    return np.where(length > 1e-9, pieces / np.maximum(length, 1e-9), belongs)


def _interpolation(at: NDArray, wanted: NDArray) -> NDArray:
    """The matrix (n, p) that reads places `wanted` (n,) off values given at rising places `at` (p,)."""
    return np.stack([np.interp(wanted, at, row) for row in np.eye(len(at))], axis=-1)


def _bone(joint: int, marks: Marks, pairs: dict[str, tuple[int, int]]) -> Bone:
    role_of = {mark: role for role, (mark, _) in pairs.items()}
    role = role_of.get(joint, "")
    what = role.rpartition(" ")[2]
    limb = marking.limb_of(joint, marks.parents, role_of)
    part = {"arm": "arms", "leg": "legs"}.get(limb.rpartition(" ")[2], "trunk")
    if what in ("shoulder", "hip"):
        ends = [pairs.get(f"{one} {what}") for one in ("right", "left")]
        joints = None if None in ends else (ends[0][1], ends[1][1])
        return Bone(joint, "trunk", "trunk", 1, joints, across=True, pointing=False)
    up = marks.parents[joint]
    while up >= 0 and up not in role_of:
        up = marks.parents[up]
    if not role or up < 0:
        return Bone(joint, part, limb)
    start = pairs[role_of[up]][1]
    if start == pairs[role][1]:
        return Bone(joint, part, limb)
    pointing = what in ("elbow", "wrist", "knee", "ankle")
    pieces = PIECES[part] if pointing or role == "chest" else 1  # a head stays stiff: it has a face
    return Bone(joint, part, limb, pieces, (start, pairs[role][1]), pointing=pointing)


def _directions(acting: Performer, bones: tuple[Bone, ...]) -> NDArray:
    """Where arms and legs go (T, n, 3), as shares of their length: bones of arms, for an elbow that sticks out is a
    pose, but legs from hip to foot, for a knee that bends takes thigh and shank to and fro and the foot nowhere."""
    limbs: dict[str, list[NDArray]] = {}
    for bone in bones:
        if bone.pointing and bone.joints:
            limb = bone.limb if bone.part == "legs" else str(bone.mark)
            limbs.setdefault(limb, []).append(sub_links(acting, bone)[0].sum(axis=1))
    found = [sum(own) / max(sum(np.linalg.norm(way, axis=1).mean() for way in own), 1e-9) for own in limbs.values()]
    return np.stack(found, axis=1) if found else np.zeros((0, 0, 3))


def _joints(motion: SkeletonMotion | RubberMotion) -> NDArray:
    """Where the joints of a motion are (T, J, 3)."""
    if isinstance(motion, RubberMotion):
        return motion.positions[:, np.asarray(motion.subjoints.ends)]
    return motion.positions()


def _in_profile(marks: Marks, pairs: dict[str, tuple[int, int]]) -> bool:
    """Whether a drawing shows its side: shoulders and hips are narrow against the trunk."""
    widths = [
        np.linalg.norm(marks.places[pairs[f"left {what}"][0]] - marks.places[pairs[f"right {what}"][0]])
        for what in ("shoulder", "hip")
        if f"left {what}" in pairs and f"right {what}" in pairs
    ]
    if not widths or "chest" not in pairs or "hips" not in pairs:
        return False
    trunk = np.linalg.norm(marks.places[pairs["chest"][0]] - marks.places[pairs["hips"][0]])
    return max(widths) < viewing.NARROW * trunk


def _sides(skeleton: Skeleton, places: NDArray) -> list[tuple[int, int]]:
    """Pairs of joints, left and right, that tell where a performer faces."""
    found = marking.roles(skeleton, places)
    return [
        (found[f"left {what}"], found[f"right {what}"])
        for what in ("hip", "shoulder")
        if f"left {what}" in found and f"right {what}" in found
    ]


def _lengths(motion: SkeletonMotion) -> NDArray:
    """How long a motion's links (J,) are most of the time: files may give them in every frame and not at rest."""
    lengths = np.median(np.linalg.norm(motion.translation, axis=-1), axis=0)
    return np.where(np.array(motion.skeleton.parents) < 0, 0.0, lengths)


def _rest(skeleton: Skeleton) -> NDArray:
    """The joints (J, 3) of a skeleton when nothing is turned."""
    places = skeleton.offsets.astype(float).copy()
    for joint, parent in enumerate(skeleton.parents):
        if parent >= 0:
            places[joint] += places[parent]
    return places
