"""A model at the posing desk, for a page that draws it: its mesh once, and for every pose how its joints carry it.

v(t) = sum_j b_j(v) (R_j(t) (v - home_j) + place_j(t))        v as it was bound, in metres
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mocap.posing import poses
from mocap.posing.poses import Pose
from mocap.skeletons.skeleton import Skeleton
from retarget.characters.figures.dancer import Dancer
from retarget.characters.models.model import Model

COLUMNS = 15  # of a joint: the rows of its map (3, 4), and its place
MOST = 4  # joints that carry a point


def joints_at(skeleton: Skeleton, world: NDArray) -> NDArray:
    """The joints (T, J, COLUMNS) of a figure whose joints' maps into the world are (T, J, 3, 4)."""
    turn, place = world[..., :3], world[..., 3]
    shift = place - np.einsum("tjab,jb->tja", turn, poses.rest_of(skeleton).positions)
    maps = np.concatenate([turn, shift[..., None]], axis=-1)
    return np.concatenate([maps.reshape(*maps.shape[:2], 12), place], axis=-1)


def joints_of(skeleton: Skeleton, pose: Pose) -> NDArray:
    """The joints (J, COLUMNS) of a figure in a pose."""
    from scipy.spatial.transform import Rotation

    turn = Rotation.from_quat(pose.turns).as_matrix()
    return joints_at(skeleton, np.concatenate([turn, pose.positions[..., None]], axis=-1)[None])[0]


def mesh(dancer: Dancer) -> tuple[NDArray, dict[str, Any]]:
    """Points (N, 3) in metres, their colours (N, 3), the joints (N, MOST) that carry them, how much, faces (F, 3)."""
    from scipy import sparse

    model, skin = dancer.model, dancer.skin
    bindings = len(skin.joints)
    to_joints = sparse.csr_matrix((np.ones(bindings), (np.arange(bindings), skin.joints)), (bindings, len(skin.names)))
    shares = (skin.shares @ to_joints).toarray()
    which = np.argsort(-shares, axis=1)[:, :MOST]
    if which.shape[1] < MOST:
        which = np.pad(which, ((0, 0), (0, MOST - which.shape[1])))
    much = np.take_along_axis(shares, which, axis=1)
    much /= np.maximum(much.sum(axis=1, keepdims=True), 1e-12)
    arrays = (dancer.unit * model.points, colors(model), which, much, model.faces)
    return np.concatenate([np.ravel(one) for one in arrays]), {"points": len(model.points), "faces": len(model.faces)}


def colors(model: Model) -> NDArray:
    """A colour (N, 3), 0-1, at each point, of its material, texture and own colour: enough to see who it is."""
    own = np.ones((len(model.points), 3)) if model.colors is None else np.array(model.colors[:, :3], float)
    material = np.zeros(len(model.points), int)
    material[model.faces.ravel()] = np.repeat(model.surface, 3)
    for number, one in enumerate(model.materials):
        mine = material == number
        own[mine] *= one.color[:3]
        if one.texture is not None and mine.any():
            size = np.array(one.texture.shape[1::-1])
            x, y = np.minimum((model.uv[mine] % 1.0) * size, size - 1).astype(int).T
            own[mine] *= one.texture[y, x, :3] / 255
    return own
