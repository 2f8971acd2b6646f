"""three.js poses a skinned file as our reader does, and plays the figure we make of it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from capture.motion import affine, keys
from capture.motion.tracks import CartoonMotion, track_of
from retarget.characters.figures.puppet import KeyPose, read_puppet
from retarget.characters.figures.skin import read_skin, sampled, skinned
from retarget.characters.models.meshfiles import read_model
from retarget.export.bodies import Body, Skin, stage_to_space
from retarget.export.gltf import write_bodies, write_glb
from retarget.stage.perform import perform

FRAMES, COUNT = 9, 42
SIZE = (320, 240)


def write_figure(path, place):
    """A random figure of four joints that moves for FRAMES frames of 1/24 s."""
    rng = np.random.default_rng(11)
    turns = Rotation.from_rotvec(np.cumsum(rng.normal(0, 0.3, (FRAMES, 4, 3)), axis=0).reshape(-1, 3))
    bones = np.tile(rng.normal(0, 0.5, (4, 3)), (FRAMES, 1, 1))
    bind = affine.invert(0.2 * rng.normal(0, 1, (4, 3, 4)) + np.eye(3, 4))
    shares, joints = rng.dirichlet(np.ones(4), COUNT), np.tile(np.arange(4), (COUNT, 1))
    quats = turns.as_quat().reshape(FRAMES, 4, 4)
    skin = Skin(("hip", "knee", "foot", "tail"), (-1, 0, 1, 0), bones, quats, bind, joints, shares)
    normals = np.tile([0.0, 0, 1], (1, COUNT, 1))
    faces = np.arange(COUNT).reshape(-1, 3)
    shape = rng.uniform(-1, 1, (1, COUNT, 3))
    body = Body("figure", ("bound",), shape, np.ones((FRAMES, 1)), place, faces, normals=normals, skin=skin)
    write_bodies((body,), np.arange(FRAMES) / 24, 24.0, path)


def test_our_reader_poses_a_skinned_file_as_three_does(three, tmp_path):
    place = np.tile(np.eye(3, 4), (FRAMES, 1, 1)) + np.random.default_rng(2).normal(0, 0.1, (FRAMES, 3, 4))
    write_figure(tmp_path / "figure.glb", place)
    times = np.float32(np.arange(FRAMES) / 24)
    (shown,) = three(tmp_path / "figure.glb", times.tolist()).meshes
    skin = read_skin(tmp_path / "figure.glb")
    (animation,) = skin.animations
    ours = skinned(skin, read_model(tmp_path / "figure.glb").points, sampled(skin, animation, times))
    assert np.abs(ours - shown.points).max() < 1e-4 * np.ptp(ours)


@pytest.mark.parametrize("stretched", [False, True])
def test_three_plays_the_figure_that_is_on_the_stage(three, validate, tmp_path, stretched):
    write_figure(tmp_path / "figure.glb", np.tile(np.eye(3, 4), (FRAMES, 1, 1)))
    skin = read_skin(tmp_path / "figure.glb")
    poses = [KeyPose(*skin.animations, time) for time in (0.0, 0.2, 0.3)]
    figure = read_puppet("egg", ("a", "b", "c"), tmp_path / "figure.glb", poses)
    if stretched:  # no skin can tell it, morph targets do
        figure = replace(figure, scale=figure.scale * [[[1.0]], [[1.3]], [[0.8]]] * [1, 0.9, 1.1])
    angle = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    round_egg = np.stack([160 + 40 * np.sin(angle), 150 - 50 * np.cos(angle)], axis=-1)
    source = keys.keyset(("a", "b", "c"), np.stack([round_egg, round_egg * [1, 1.1], round_egg * [1.2, 1]]))
    rng = np.random.default_rng(3)
    weights = rng.uniform(-0.3, 1.2, (FRAMES, len(source.rows)))
    weights[:, 0] += 1 - weights.sum(axis=1)
    weights = 0.2 * weights
    weights[:, 0] += 0.8
    maps = np.tile(np.eye(2, 3), (FRAMES, 1, 1)) + rng.normal(0, 0.1, (FRAMES, 2, 3)) * [1, 1, 50]
    track = track_of("egg", source, maps, weights, np.zeros(FRAMES))
    performance = perform(CartoonMotion((track,), (source,), np.arange(FRAMES) / 24, 24.0, SIZE), [figure])
    write_glb(performance, tmp_path / "played.glb")
    issues = validate(tmp_path / "played.glb")
    assert (issues["numErrors"], issues["numWarnings"]) == (0, 0)
    times = np.float32(np.arange(FRAMES) / 24).tolist()
    (shown,) = three(tmp_path / "played.glb", times).meshes
    assert (read_skin(tmp_path / "played.glb") is None) == stretched
    role = affine.apply(stage_to_space(SIZE), performance.roles[0].points[..., :2])
    for t in range(FRAMES):
        away = np.linalg.norm(np.asarray(shown.points[t])[:, None, :2] - role[t], axis=-1)
        assert max(away.min(axis=1).max(), away.min(axis=0).max()) < 1e-4 * np.ptp(role[t], axis=0).max()
