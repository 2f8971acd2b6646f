"""Jointed figures that play a part: keys are poses, mixed joint by joint (Bregler et al. 2002, section 3.4.2).

The paper's special case: all joints share the captured key weights.  Each key is a rotation for every joint; a frame
mixes the rotations, by as many keys as have weight, then runs the kinematics and skins the mesh.  Arms so swing round
instead of shrinking through the body, as a mixture of points would have them.

What a pose turns, stretches and shifts the figure as a whole, where it is seen, is taken out again (eq. 5), frame by
frame as for any other in-between, and the captured affine map is put in its place: it acts on the whole figure.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.motion import affine
from capture.motion.keys import KeySet, fold
from mocap.skeletons import rotations
from retarget.characters.figures.bones import read_bones
from retarget.characters.figures.skin import Pose, Skin, read_skin, sampled, skinned
from retarget.characters.models import lift
from retarget.characters.models.lift import Depth
from retarget.characters.models.mesh import DrawnMesh, Mesh, mesh, removed_maps
from retarget.characters.models.meshfiles import read_model

FRAMES = 60
"""An animation is looked at this many times a second, to see which way round a joint turns."""


@dataclass(frozen=True)
class KeyPose:
    """A pose of a figure: a moment of one of its file's animations, or how it stands; and joints turned from there."""

    animation: str = ""
    time: float = 0.0  # seconds
    turns: Mapping[str, Sequence[float]] = field(default_factory=dict)  # joint: rotation vector, degrees, own axes


@dataclass(frozen=True, eq=False)
class Puppet:
    """A jointed figure as a target, in the units of its file, y up."""

    body: Mesh  # its key poses as shapes, and how it is seen
    skin: Skin
    rest: NDArray  # (N, 3) the mesh as it is bound
    first: Pose  # of key 0
    turns: NDArray  # (K, J, 3) unwrapped rotation vectors against key 0, each about the joint's own axes
    travel: NDArray  # (K, J, 3) joints' places against their parents
    scale: NDArray  # (K, J, 3)
    height: float = 1.0
    pivot: NDArray | None = None  # (3,) in key 0

    @property
    def part(self) -> str:
        return self.body.part

    @property
    def keys(self) -> KeySet:
        return self.body.keys

    @property
    def box(self) -> NDArray:
        return self.body.box

    @property
    def view(self) -> NDArray:
        return self.body.view

    @property
    def depth(self) -> Depth:
        return self.body.depth

    def shapes(self, rows: NDArray) -> NDArray:
        """The points (D, N, 3) for rows (D, 3): joints turned part of the way."""
        count = len(self.keys.names)
        return self.acted(fold(np.asarray(rows, float), np.eye(len(rows)), count))

    def acted(self, weights: NDArray) -> NDArray:
        """The points (T, N, 3) for weights (T, K) folded onto keys, aligned to key 0; they may lie outside 0 to 1."""
        points = skinned(self.skin, self.rest, self.posture(weights))
        return affine.apply(affine.invert(self.removed(points)), points)

    def posture(self, weights: NDArray) -> Pose:
        """The joints in frames of weights (T, K), before anything is aligned."""
        rotation = rotations.mixed(self.first.rotation, self.turns, weights)
        return Pose(np.tensordot(weights, self.travel, axes=1), rotation, np.tensordot(weights, self.scale, axes=1))

    def removed(self, points: NDArray) -> NDArray:
        """The maps (T, 3, 4) that alignment takes out of the figure's points (T, N, 3)."""
        first = affine.apply(self.keys.removed[:1], self.keys.points[:1])
        seen = affine.apply(self.view, np.concatenate([first, points]))
        return removed_maps(seen, self.keys.outline, self.view, self.depth)[1:]

    def posed(self, points: NDArray, weights: NDArray, scale: float) -> list[DrawnMesh]:
        """The figure on points (N, 3) of the stage."""
        return self.body.posed(points, weights, scale)


def read_puppet(
    part: str,
    names: tuple[str, ...],
    file: str | Path,
    poses: Sequence[KeyPose],
    plane: str | Sequence[float] = "xy",
    depth: Depth = lift.kept,
) -> Puppet:
    """A character from a *.glb or *.gltf file with a skin, or a *.bvh, and a pose of it for every key."""
    path = Path(file)
    kind = path.suffix.lower()
    if kind == ".bvh":
        model, skin = read_bones(path)
    else:
        skin = read_skin(path) if kind in (".glb", ".gltf") else None
        if skin is None:
            raise InputError(
                f"part {part!r}: a figure that is posed must be a GLB or glTF with a skin, or a BVH, {path} is none"
            )
        model = read_model(path)
    found = [_pose(skin, pose, part) for pose in poses]
    turns = np.stack([_turns(skin, poses[0], pose, found[0], there) for pose, there in zip(poses, found)])
    shapes = np.concatenate([skinned(skin, model.points, there) for there in found])
    body = mesh(part, names, model, shapes, plane, depth)
    travel, scale = (np.concatenate([getattr(there, kind) for there in found]) for kind in ("translation", "scale"))
    first = Pose(found[0].translation[0], found[0].rotation[0], found[0].scale[0])
    return Puppet(body, skin, model.points, first, turns, travel, scale)


def _pose(skin: Skin, pose: KeyPose, part: str) -> Pose:
    """The joints of a key, (1, J, ...)."""
    from scipy.spatial.transform import Rotation

    if pose.animation:
        longest = skin.animations[pose.animation].seconds if pose.animation in skin.animations else np.inf
        if not 0 <= pose.time <= longest + 1e-6:
            raise InputError(
                f"part {part!r}: a pose must be a moment of its animation, {pose.animation!r} lasts {longest:.2f} s, "
                f"it is asked at {pose.time:g} s"
            )
        here = sampled(skin, pose.animation, np.array([pose.time]))
    else:
        here = Pose(*(rest[None] for rest in (skin.rest.translation, skin.rest.rotation, skin.rest.scale)))
    rotation = here.rotation.copy()
    for name, turn in _asked(skin, pose, part).items():
        joint = skin.index(name)
        rotation[0, joint] = (Rotation.from_quat(rotation[0, joint]) * Rotation.from_rotvec(turn)).as_quat()
    return replace(here, rotation=rotation)


def _turns(skin: Skin, first: KeyPose, pose: KeyPose, start: Pose, goal: Pose) -> NDArray:
    """Rotation vectors (J, 3) from the first key to a key, the way round that its animation or its angles go.

    Between moments of one animation a joint goes the way the animation does; otherwise the shortest way, and on
    from there by the angles given: 270 degrees are three quarters of a turn.
    """
    guess = np.zeros((len(skin.names), 3))
    if pose.animation and pose.animation == first.animation and pose.time != first.time:
        count = max(2, int(np.ceil(abs(pose.time - first.time) * FRAMES)) + 1)
        way = sampled(skin, pose.animation, np.linspace(first.time, pose.time, count))
        guess = rotations.unwrapped(way.rotation)[-1]
    elif pose is not first:
        plain = [_pose(skin, replace(key, turns={}), "").rotation[0] for key in (first, pose)]
        guess = rotations.turns_between(*plain)
    for key, sign in ((pose, 1.0), (first, -1.0)):
        for name, turn in _asked(skin, key, "").items():
            guess[skin.index(name)] += sign * turn
    return rotations.nearest(rotations.turns_between(start.rotation[0], goal.rotation[0]), guess)


def _asked(skin: Skin, pose: KeyPose, part: str) -> dict[str, NDArray]:
    """The turns a pose asks for, in radians."""
    turns = {name: np.radians(np.asarray(turn, float)) for name, turn in pose.turns.items()}
    for name, turn in turns.items():
        skin.index(name)
        if turn.shape != (3,) or not np.isfinite(turn).all():
            raise InputError(
                f"part {part!r}: a joint's turn must be three angles in degrees, {name!r} has {pose.turns[name]}"
            )
    return turns
