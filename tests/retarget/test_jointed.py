"""What a 3-D file is told of a figure plays the figure: joint by joint, with 4x4 matrices, as a program would."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse
from scipy.spatial.transform import Rotation

from capture.errors import InputError
from capture.motion import affine
from retarget.characters.figures.puppet import KeyPose, read_puppet
from retarget.export import jointed
from retarget.export.bodies import bodies, stage_to_space
from retarget.stage.perform import perform


def played(body, t):
    """The vertices of a skinned body in frame t (V, 3)."""
    skin, world = body.skin, []
    for j, parent in enumerate(skin.parents):
        own = np.eye(4)
        own[:3, :3] = Rotation.from_quat(skin.rotation[t, j]).as_matrix()
        own[:3, 3] = skin.translation[t, j]
        world.append((world[parent] if parent >= 0 else np.eye(4)) @ own)
    base = np.column_stack([body.shapes[0], np.ones(body.shapes.shape[1])])
    moved = np.zeros_like(base)
    for slot in range(skin.joints.shape[1]):
        for v, j in enumerate(skin.joints[:, slot]):
            bind = np.vstack([skin.inverse_bind[j], [0, 0, 0, 1]])
            moved[v] += skin.shares[v, slot] * (world[j] @ bind @ base[v])
    return affine.apply(body.place[t], moved[:, :3])


def figure(arm, names):
    return read_puppet("egg", names, arm.file, [KeyPose("wave", 0.0), KeyPose("wave", 2.7)])


def test_a_figure_in_a_file_is_the_role_on_the_stage(arm, by_hand):
    rng = np.random.default_rng(8)
    performance = perform(by_hand.motion(by_hand.tumble(5), rng.dirichlet(np.ones(7), 5)), [figure(arm, by_hand.names)])
    (body,) = bodies(performance)
    stage, role = stage_to_space(performance.size), performance.roles[0]
    used = np.unique(role.target.body.surface.faces)
    for t in range(5):
        seen = affine.apply(stage, role.points[t, used, :2])
        there = played(body, t)[:, :2]
        away = np.linalg.norm(there[:, None] - seen, axis=-1)
        assert away.min(axis=1).max() < 1e-6 and away.min(axis=0).max() < 1e-6


def test_a_vertex_follows_its_four_strongest_joints():
    table = sparse.csr_matrix(np.array([[0.3, 0.1, 0.2, 0.05, 0.35], [0, 0, 1.0, 0, 0]]))
    joints, shares = jointed._strongest(table, np.array([10, 11, 12, 13, 14]))
    assert sorted(joints[0]) == [10, 11, 12, 14] and shares.sum(axis=1) == pytest.approx([1, 1])
    assert joints[1, 0] == 12 and shares[1] == pytest.approx([1, 0, 0, 0])


def test_a_figure_whose_joints_stretch_is_refused(arm, by_hand):
    puppet = figure(arm, by_hand.names)
    scale = puppet.scale.copy()
    scale[1, 3] = [1, 2, 1]
    with pytest.raises(InputError, match="this figure's are stretched"):
        jointed.skin_of(replace(puppet, scale=scale), np.array([[0.5, 0.5]]))
