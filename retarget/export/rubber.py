"""A skinned model that moves like rubber, as a 3-D file: its sub-joints side by side under one node.

Joints that hang on each other would hand their stretch down, and turned stretches shear what hangs below: a fault that
no program can mend, for a node has no shear.  So no sub-joint hangs on another here; each is placed, turned and
stretched in the model's own space, and every program that shows skins shows the same.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from capture.motion import affine
from mocap.rubber.rubber import RubberMotion
from retarget.characters.mesh import mesh
from retarget.characters.meshfiles import Model
from retarget.characters.rubber_skin import MOST, RubberSkin, stretches
from retarget.characters.target import REST
from retarget.export import solids
from retarget.export.bodies import Body
from retarget.export.gltf import write_bodies
from retarget.export.jointed import Skin


def write_rubber(
    model: Model, rubber: RubberSkin, motion: RubberMotion, path: str | Path, name: str = "rubber"
) -> None:
    """A model, bound as it was in its file, and how it moves, as a *.glb or *.gltf file, in the model's own units."""
    frames = len(motion.positions)
    skin = skin_of(rubber, motion)
    bound = mesh(name, (REST,), model, model.points[None])
    parts = solids.pieces(bound, affine.identity(3))
    still = np.tile(affine.identity(3), (frames, 1, 1))
    bodies = tuple(
        Body(
            name if len(parts) == 1 else f"{name} {number}",
            ("bound",),
            model.points[None, part.points],
            np.ones((frames, 1)),
            still,
            part.faces,
            looks=() if part.look is None else (part.look,),
            color=part.color,
            normals=part.normals,
            colors=part.colors,
            skin=Skin(
                skin.names,
                skin.parents,
                skin.translation,
                skin.rotation,
                skin.inverse_bind,
                skin.joints[part.points],
                skin.shares[part.points],
                skin.scale,
            ),
        )
        for number, part in enumerate(parts)
    )
    fps = motion.source.fps
    write_bodies(bodies, np.arange(frames) / fps, fps, path, notes={"fps": fps})


def skin_of(rubber: RubberSkin, motion: RubberMotion) -> Skin:
    """All sub-joints as roots: placed, turned with x along their links, and stretched there."""
    from scipy.spatial.transform import Rotation

    frames, count = motion.positions.shape[:2]
    turns = Rotation.from_quat(motion.rotation.reshape(-1, 4)) * Rotation.from_matrix(
        np.tile(rubber.axes, (frames, 1, 1))
    )
    quats = turns.as_quat().reshape(frames, count, 4)
    flips = np.cumprod(np.where((quats[1:] * quats[:-1]).sum(axis=-1) < 0, -1.0, 1.0), axis=0)
    quats[1:] *= flips[..., None]  # q and -q turn alike: none jumps
    back = np.swapaxes(rubber.axes, -1, -2)
    binds = np.concatenate([back, -(back @ rubber.home[..., None])], axis=-1)
    joints, shares = _four(rubber.shares)
    return Skin(rubber.names, (-1,) * count, motion.positions, quats, binds, joints, shares, stretches(motion))


def _four(table: object) -> tuple[NDArray, NDArray]:
    """The sub-joints (V, 4) that vertices follow, and their shares (V, 4), of a sparse table of at most 4 in a row."""
    from scipy import sparse

    table = sparse.csr_matrix(table)
    table.eliminate_zeros()
    joints, shares = np.zeros((table.shape[0], MOST), int), np.zeros((table.shape[0], MOST))
    counts = np.diff(table.indptr)
    rows = np.repeat(np.arange(len(counts)), counts)
    places = np.arange(len(rows)) - np.repeat(table.indptr[:-1], counts)
    joints[rows, places], shares[rows, places] = table.indices, table.data
    return joints, shares
