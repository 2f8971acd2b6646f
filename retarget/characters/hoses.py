"""A body of rubber hoses on any skeleton: who has no drawing and no model can see a motion's rubber all the same.

Limbs are hoses, hands are gloves and feet are boots; a trunk, a head with two eyes.  All are round, closed and lie in
one another where they meet, so whatever bends shows no crack.
"""

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from mocap.body import Body, find_body, rest_places
from mocap.skeleton import Skeleton, SkeletonMotion, own_maps, world_maps
from retarget.characters.meshfiles import Material, Model
from retarget.characters.skin import Pose, Skin

AROUND, ALONG = 16, 24
SOFT = 0.3
"""The last share of a link along which its hose passes over to the next joint."""

COAT, CREAM, WHITE, BOOT, INK = range(5)
LOOKS = ((0.18, 0.16, 0.24), (0.98, 0.91, 0.79), (1.0, 1.0, 1.0), (0.94, 0.71, 0.16), (0.05, 0.04, 0.07))
RADII = {"arm": 0.028, "leg": 0.036, "spine": 0.085, "head": 0.04, "tail": 0.025}
"""Half as thick as a part is, as a share of the legs' and the spine's length together."""


def hoses(skeleton: Skeleton, motion: SkeletonMotion | None = None) -> tuple[Model, Skin]:
    """The body, and the skin that binds it to the skeleton's joints at rest.

    A `motion` of the same joints helps to tell arms from legs where names do not, and which way a head looks: in many
    files' rest pose it lies on its ear.
    """
    world = own_maps(skeleton.offsets, np.tile([0, 0, 0, 1.0], (len(skeleton), 1)))[None]
    world = world_maps(skeleton.parents, world) if motion is None else motion.world()
    body, home = find_body(skeleton, world[..., 3]), rest_places(skeleton)
    tall = _length(body.parts.get("spine", ()), home) + max(
        (_length(leg, home) for leg in body.legs()), default=_length(range(len(home)), home)
    )
    if tall <= 0:
        raise InputError("a body of hoses needs a skeleton with bones, all of this one's joints lie in one place")
    made = _Made()
    for name, path in body.parts.items():
        kind = name.rpartition(" ")[2]
        radius = RADII.get(kind, RADII["tail"]) * tall
        for joint in path:
            parent = skeleton.parents[joint]
            joined = parent in path or (kind in ("arm", "leg", "head", "tail") and parent >= 0)
            if joined and np.linalg.norm(home[joint] - home[parent]) > 1e-3 * tall:
                made.hose(parent, joint, home, radius, COAT)
    for hand in body.hands:
        made.ball(hand, home[hand] + 0.03 * tall * _way(hand, skeleton, home), 0.052 * tall, WHITE)
    for foot in body.feet:
        made.hose(skeleton.parents[foot], foot, home, 0.05 * tall, BOOT)
    if "head" in body.parts:
        joint = body.parts["head"][-1]
        _add_head(made, joint, home[joint], *_upright(world, joint, body), tall)
    return made.model(), made.skin(skeleton, home)


def rods(skeleton: Skeleton) -> tuple[Model, Skin]:
    """A body of rods, one for each link, and its skin: for what has no limbs to dress, as a flower or a lamp."""
    home, made = rest_places(skeleton), _Made()
    lengths = skeleton.lengths()
    if not lengths.max() > 0:
        raise InputError("a body of rods needs a skeleton with bones, all of this one's joints lie in one place")
    radius = 0.02 * float(np.ptp(home, axis=0).max())
    for joint in np.flatnonzero(lengths > 1e-6 * lengths.max()).tolist():
        made.hose(skeleton.parents[joint], joint, home, radius, BOOT if not skeleton.children(joint) else COAT)
    return made.model(), made.skin(skeleton, home)


def _upright(world: NDArray, joint: int, body: Body) -> tuple[NDArray, NDArray]:
    """Which ways up and left (3,) are for a joint at rest, by what they are to it in the frames (T, J, 3, 4)."""
    back = np.swapaxes(world[:, joint, :, :3], -1, -2)
    left = np.zeros((len(world), 3))
    for limb in ("leg", "arm", "hind leg", "front leg"):
        one, other = (body.parts.get(f"{side} {limb}") for side in ("left", "right"))
        if one and other:
            left += world[:, one[0], :, 3] - world[:, other[0], :, 3]
    up = _unit(np.einsum("tab,b->a", back, [0, 1.0, 0]))
    left = np.einsum("tab,tb->a", back, left)
    left -= (left @ up) * up
    return up, _unit(left) if np.linalg.norm(left) > 1e-9 else _unit(np.cross(up, [0, 0.1, 1.0]))


def _add_head(made: "_Made", joint: int, at: NDArray, up: NDArray, left: NDArray, tall: float) -> None:
    """A head with a face, eyes and round ears on a joint."""
    front, middle, size = np.cross(left, up), at + 0.07 * tall * up, 0.13 * tall
    made.ball(joint, middle, size, COAT)
    made.ball(joint, middle + size * (0.30 * front - 0.15 * up), 0.8 * size, CREAM)
    for side in (-1.0, 1.0):
        eye = middle + size * (0.95 * front + side * 0.3 * left + 0.15 * up)
        made.ball(joint, eye, 0.2 * size, WHITE)
        made.ball(joint, eye + 0.13 * size * front, 0.11 * size, INK)
        made.ball(joint, middle + size * (0.85 * up + side * 0.75 * left), 0.36 * size, COAT)


class _Made:
    """Points, faces, colours and shares that grow piece by piece."""

    def __init__(self) -> None:
        self.points: list[NDArray] = []
        self.faces: list[NDArray] = []
        self.looks: list[NDArray] = []
        self.bound: list[tuple[NDArray, NDArray, NDArray]] = []  # joints, other joints, shares of the other
        self.count = 0

    def hose(self, start: int, stop: int, home: NDArray, radius: float, look: int) -> None:
        """A hose with round ends from one joint to the next."""
        way = home[stop] - home[start]
        length = float(np.linalg.norm(way))
        bow = np.linspace(0, np.pi / 2, 6)
        ends = radius * np.sin(bow)
        at = np.concatenate([-ends[::-1], np.linspace(0, length, ALONG)[1:-1], length + ends])
        reach = np.concatenate([radius * np.cos(bow[::-1]), np.full(ALONG - 2, radius), radius * np.cos(bow)])
        late = np.clip((at / length - (1 - SOFT)) / SOFT, 0, 1)
        self._add(home[start], way / length, at, reach, look, start, stop, late * late * (3 - 2 * late))

    def ball(self, joint: int, middle: NDArray, radius: float, look: int) -> None:
        """A ball that moves with one joint."""
        bow = np.linspace(-np.pi / 2, np.pi / 2, 13)
        zero = np.zeros(len(bow))
        self._add(middle, np.array([0, 1.0, 0]), radius * np.sin(bow), radius * np.cos(bow), look, joint, joint, zero)

    def _add(
        self,
        origin: NDArray,
        way: NDArray,
        at: NDArray,
        reach: NDArray,
        look: int,
        joint: int,
        other: int,
        late: NDArray,
    ) -> None:
        side = np.cross(way, np.eye(3)[np.argmin(np.abs(way))])
        side /= np.linalg.norm(side)
        angle = 2 * np.pi * np.arange(AROUND) / AROUND
        round_it = np.cos(angle)[:, None] * side + np.sin(angle)[:, None] * np.cross(way, side)
        points = origin + at[:, None, None] * way + np.maximum(reach, 1e-9)[:, None, None] * round_it
        ring, k = np.meshgrid(np.arange(len(at) - 1), np.arange(AROUND), indexing="ij")
        here, beside = ring * AROUND + k, ring * AROUND + (k + 1) % AROUND
        quads = np.stack([here, beside, beside + AROUND, here + AROUND], axis=-1).reshape(-1, 4) + self.count
        faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
        self.points.append(points.reshape(-1, 3))
        self.faces.append(faces)
        self.looks.append(np.full(len(faces), look))
        size = points.shape[0] * AROUND
        self.bound.append((np.full(size, joint), np.full(size, other), np.repeat(late, AROUND)))
        self.count += size

    def model(self) -> Model:
        materials = tuple(Material((*color, 1.0)) for color in LOOKS)
        points = np.concatenate(self.points)
        return Model(
            points=points,
            faces=np.concatenate(self.faces),
            materials=materials,
            surface=np.concatenate(self.looks),
            uv=np.zeros((len(points), 2)),
        )

    def skin(self, skeleton: Skeleton, home: NDArray) -> Skin:
        from scipy import sparse

        joints, others, late = (np.concatenate(arrays) for arrays in zip(*self.bound, strict=True))
        count = len(skeleton)
        rows = np.tile(np.arange(len(joints)), 2)
        table = (np.concatenate([1 - late, late]), (rows, np.concatenate([joints, others])))
        shares = sparse.csr_matrix(table, shape=(len(joints), count))
        still = Pose(skeleton.offsets, np.tile([0, 0, 0, 1.0], (count, 1)), np.ones((count, 3)))
        binds = np.concatenate([np.tile(np.eye(3), (count, 1, 1)), -home[..., None]], axis=-1)
        return Skin(skeleton.names, skeleton.parents, still, np.arange(count), binds, shares, {})


def _way(joint: int, skeleton: Skeleton, home: NDArray) -> NDArray:
    """The direction (3,) in which a joint's own link goes on, or else the one that leads to it."""
    for child in skeleton.children(joint):
        if np.linalg.norm(home[child] - home[joint]) > 0:
            return _unit(home[child] - home[joint])
    parent = skeleton.parents[joint]
    return _unit(home[joint] - home[parent]) if parent >= 0 else np.array([0, 1.0, 0])


def _unit(vector: NDArray) -> NDArray:
    length = np.linalg.norm(vector)
    return vector / length if length > 0 else np.array([0, 1.0, 0])


def _length(path: tuple[int, ...] | range, home: NDArray) -> float:
    return float(np.linalg.norm(np.diff(home[list(path)], axis=0), axis=1).sum()) if len(path) > 1 else 0.0
