"""A skeleton without a skin as a character: every bone is a spindle from its joint to the next."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from mocap.skeletons.bvh import read_bvh
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion
from retarget.characters.figures.skin import Animation, Pose, Skin
from retarget.characters.models.model import Material, Model

MOTION = "motion"
"""The one animation of a BVH."""

THICK = 0.1
"""A bone is this wide on either side, as a share of its length; a fifth of the way along it is widest."""

IVORY = (0.93, 0.89, 0.78, 1.0)


def read_bones(path: str | Path) -> tuple[Model, Skin]:
    """A *.bvh as a mesh of spindles and the skin that they hang on."""
    motion = read_bvh(path)
    skeleton = motion.skeleton
    places = _rest_places(skeleton)
    points, faces, bound = [], [], []
    for joint, parent in enumerate(skeleton.parents):
        if parent >= 0 and np.linalg.norm(skeleton.offsets[joint]) > 0:
            faces.append(_FACES + 6 * len(points))
            points.append(_spindle(places[parent], places[joint]))
            bound += [parent] * 6
    if not points:
        raise InputError(f"{path} must have bones, its joints all lie in one place: export it again")
    model = Model(
        points=np.concatenate(points),
        faces=np.concatenate(faces),
        materials=(Material(IVORY),),
        surface=np.zeros(8 * len(points), int),
        uv=np.zeros((6 * len(points), 2)),
    )
    return model, _skin(motion, places, np.array(bound))


def _skin(motion: SkeletonMotion, places: NDArray, bound: NDArray) -> Skin:
    from scipy import sparse

    skeleton, count = motion.skeleton, len(motion.skeleton)
    still = Pose(skeleton.offsets, np.tile([0, 0, 0, 1.0], (count, 1)), np.ones((count, 3)))
    binds = np.concatenate([np.tile(np.eye(3), (count, 1, 1)), -places[..., None]], axis=-1)
    shares = sparse.csr_matrix((np.ones(len(bound)), (np.arange(len(bound)), bound)), shape=(len(bound), count))
    times = np.arange(len(motion.rotation)) / motion.fps
    curves = []
    for joint in range(count):
        curves.append((joint, "rotation", "LINEAR", times, motion.rotation[:, joint]))
        curves.append((joint, "translation", "LINEAR", times, motion.translation[:, joint]))
    animations = {MOTION: Animation(float(times[-1]), tuple(curves))}
    return Skin(skeleton.names, skeleton.parents, still, np.arange(count), binds, shares, animations)


def _rest_places(skeleton: Skeleton) -> NDArray:
    """Where the joints (J, 3) are when nothing is turned."""
    places = skeleton.offsets.copy()
    for joint, parent in enumerate(skeleton.parents):
        if parent >= 0:
            places[joint] += places[parent]
    return places


_FACES = np.array([[0, 2, 1], [0, 3, 2], [0, 4, 3], [0, 1, 4], [5, 1, 2], [5, 2, 3], [5, 3, 4], [5, 4, 1]])


def _spindle(start: NDArray, stop: NDArray) -> NDArray:
    """Six points: the start, four round the thickest place, the stop."""
    way = stop - start
    side = np.cross(way, np.eye(3)[np.argmin(np.abs(way))])
    side *= THICK * np.linalg.norm(way) / np.linalg.norm(side)
    other = np.cross(way, side) / np.linalg.norm(way)
    round_it = start + 0.2 * way + np.stack([side, other, -side, -other])
    return np.concatenate([start[None], round_it, stop[None]])
