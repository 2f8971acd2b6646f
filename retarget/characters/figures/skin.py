"""A mesh on a skeleton: the nodes, bindings and animations of a glTF file, and linear blend skinning.

A point goes to sum_b share_b . world_b . inverse_bind_b . v, with world_b the map of the node it is bound to.  All
nodes of the file are joints here, those above a skeleton and meshes without one too: a hat on a head moves with it.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.motion import affine
from mocap.skeletons import skeleton
from retarget.characters.models.gltffile import DAMAGE, GltfFile, open_gltf
from retarget.characters.models.meshfiles import own_place, placed


@dataclass(frozen=True, eq=False)
class Pose:
    """How every joint lies in its parent's space, in one moment or, with a leading T, in many."""

    translation: NDArray  # (..., J, 3)
    rotation: NDArray  # (..., J, 4) quaternions (x, y, z, w)
    scale: NDArray  # (..., J, 3)


@dataclass(frozen=True, eq=False)
class Animation:
    """Curves of some joints over time."""

    seconds: float
    curves: tuple[tuple[int, str, str, NDArray, NDArray], ...]  # joint, what of it, how between, times (n,), values


@dataclass(frozen=True, eq=False)
class Skin:
    """What N points of a mesh hang on."""

    names: tuple[str, ...]  # J
    parents: tuple[int, ...]  # J, -1 for a root; parents come first
    rest: Pose
    joints: NDArray  # (B,) the joint of each binding
    inverse_bind: NDArray  # (B, 3, 4) from the mesh's space to the joint's
    shares: object  # sparse (N, B), rows sum to 1
    animations: dict[str, Animation]

    def index(self, name: str) -> int:
        """The number of a joint; an unknown name is refused with the names there are."""
        if name not in self.names:
            raise InputError(f"a figure must have the joint that is named, {name!r} is none of {', '.join(self.names)}")
        return self.names.index(name)


def skinned(skin: Skin, points: NDArray, pose: Pose) -> NDArray:
    """The points (T, N, 3) of a mesh (N, 3) in poses of T frames."""
    world = skeleton.world_maps(skin.parents, skeleton.own_maps(pose.translation, pose.rotation, pose.scale))
    bound = affine.compose(world[:, skin.joints], skin.inverse_bind)  # (T, B, 3, 4)
    moved = np.empty((len(bound), len(points), 3))
    for t, maps in enumerate(bound):
        blend = (skin.shares @ maps.reshape(len(maps), 12)).reshape(-1, 3, 4)
        moved[t] = np.einsum("nij,nj->ni", blend[..., :3], points) + blend[..., 3]
    return moved


def sampled(skin: Skin, animation: str, times: NDArray) -> Pose:
    """The pose (T joints' worth) of an animation at times (T,), in seconds; before and after it, its ends."""
    if animation not in skin.animations:
        known = ", ".join(skin.animations) or "none"
        raise InputError(f"a pose must be of one of the file's animations, {animation!r} is none of them: {known}")
    times = np.asarray(times, float)
    pose = {
        kind: np.repeat(getattr(skin.rest, kind)[None], len(times), axis=0)
        for kind in ("translation", "rotation", "scale")
    }
    for joint, kind, between, at, values in skin.animations[animation].curves:
        pose[kind][:, joint] = _curve(kind, between, at, values, times)
    return Pose(**pose)


def read_skin(path: str | Path) -> Skin | None:
    """The skin of a *.glb or *.gltf file, point by point as `meshfiles.read_model` reads it; None if it has none."""
    file = open_gltf(path)
    if not file.things("skins"):
        return None
    try:
        return _skin(file)
    except InputError:
        raise
    except DAMAGE as error:
        raise InputError(f"{path}: the skin in the file is missing something ({error!r}): export it again") from None


def _skin(file: GltfFile) -> Skin:
    from scipy import sparse

    nodes = file.things("nodes")
    above = {child: number for number, node in enumerate(nodes) for child in node.get("children", ())}
    order = _parents_first(above, len(nodes))
    number_of = {node: joint for joint, node in enumerate(order)}
    parents = tuple(number_of[above[node]] if node in above else -1 for node in order)
    rest = _rest([nodes[node] for node in order])
    world = skeleton.world_maps(parents, skeleton.own_maps(rest.translation, rest.rotation, rest.scale))
    joints, binds, starts = [], [], []
    for skin in file.things("skins"):
        starts.append(len(joints))
        joints += [number_of[node] for node in skin["joints"]]
        if "inverseBindMatrices" in skin:
            binds += list(np.swapaxes(file.array(skin["inverseBindMatrices"]).reshape(-1, 4, 4), 1, 2)[:, :3])
        else:
            binds += [np.eye(3, 4)] * len(skin["joints"])
    meshes = file.things("meshes")
    shown = {id(meshes[node["mesh"]]): number for number, node in enumerate(nodes) if "mesh" in node}
    rows, columns, values, count = [], [], [], 0
    for mesh, _ in placed(file):
        node = shown[id(mesh)]
        if "skin" not in nodes[node]:  # it hangs on its node as it is; its points come in the scene's space
            joints.append(number_of[node])
            binds.append(affine.invert(world[number_of[node]]))
        for primitive in mesh["primitives"]:
            has = primitive["attributes"]
            if primitive.get("mode", 4) not in (4, 5, 6) or "POSITION" not in has:
                continue
            size = file.content["accessors"][has["POSITION"]]["count"]
            bound, share = np.full((size, 1), len(joints) - 1), np.ones((size, 1))
            if "skin" in nodes[node]:
                sets = sorted(name[7:] for name in has if name.startswith("JOINTS_"))
                bound = np.hstack([file.array(has[f"JOINTS_{n}"]).astype(int) for n in sets])
                bound = bound + starts[nodes[node]["skin"]]
                share = np.hstack([file.array(has[f"WEIGHTS_{n}"]).astype(float) for n in sets])
            rows.append(np.repeat(np.arange(count, count + size), bound.shape[1]))
            columns.append(bound.ravel())
            values.append((share / share.sum(axis=1, keepdims=True)).ravel())
            count += size
    table = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    shares = sparse.csr_matrix(table, shape=(count, len(joints)))
    names = tuple(nodes[node].get("name", f"joint {node}") for node in order)
    animations = {
        told.get("name", f"animation {n}"): _animation(file, told, number_of)
        for n, told in enumerate(file.things("animations"))
    }
    return Skin(names, parents, rest, np.array(joints), np.stack(binds).astype(float), shares, animations)


def _parents_first(above: dict[int, int], count: int) -> list[int]:
    """Node numbers with each after the one it hangs on."""

    def depth(node: int) -> int:
        steps = 0
        while node in above and steps <= count:
            node, steps = above[node], steps + 1
        if steps > count:
            raise ValueError("nodes hang on each other in a circle")
        return steps

    return sorted(range(count), key=depth)


def _rest(nodes: list[dict[str, Any]]) -> Pose:
    from scipy.spatial.transform import Rotation

    own = np.stack([own_place(node)[:3] for node in nodes])
    scale = np.linalg.norm(own[..., :3], axis=1)
    turns = Rotation.from_matrix(own[..., :3] / np.maximum(scale, 1e-12)[:, None])
    return Pose(own[..., 3], turns.as_quat(), scale)


def _animation(file: GltfFile, told: dict[str, Any], number_of: dict[int, int]) -> Animation:
    curves = []
    for channel in told["channels"]:
        target, sampler = channel["target"], told["samplers"][channel["sampler"]]
        if target["path"] != "weights" and "node" in target:
            between = sampler.get("interpolation", "LINEAR")
            arrays = (file.array(sampler[which]).astype(float) for which in ("input", "output"))
            curves.append((number_of[target["node"]], target["path"], between, *arrays))
    return Animation(max((curve[3].max() for curve in curves), default=0.0), tuple(curves))


def _curve(kind: str, between: str, at: NDArray, values: NDArray, times: NDArray) -> NDArray:
    """A glTF sampler's values at times (T,): rotations go round, a cubic spline has its slopes beside its values."""
    from scipy.spatial.transform import Rotation, Slerp

    times = np.clip(times, at[0], at[-1])
    if between == "CUBICSPLINE":
        from scipy.interpolate import CubicHermiteSpline

        into, value, out = np.moveaxis(values.reshape(len(at), 3, -1), 1, 0)
        step = np.clip(np.searchsorted(at, times, side="right") - 1, 0, max(len(at) - 2, 0))
        drawn = [
            CubicHermiteSpline(at[k : k + 2], value[k : k + 2], [out[k], into[k + 1]])(t) if len(at) > 1 else value[0]
            for k, t in zip(step, times)
        ]
        drawn = np.stack(drawn)
        return drawn / np.linalg.norm(drawn, axis=1, keepdims=True) if kind == "rotation" else drawn
    if between == "STEP" or len(at) == 1:
        return values[np.searchsorted(at, times, side="right") - 1]
    if kind == "rotation":
        return Slerp(at, Rotation.from_quat(values))(times).as_quat()
    return np.stack([np.interp(times, at, column) for column in values.T], axis=-1)
