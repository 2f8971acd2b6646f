"""Real readers take a rubber model as it is: no complaint by the validator, and three.js poses it as we do."""

import os
from pathlib import Path

import numpy as np
import pytest
from scipy import sparse
from scipy.spatial.transform import Rotation

from fixtures import hose
from mocap.rubber.rubber import make_rubber
from mocap.skeleton import Skeleton, SkeletonMotion
from retarget.characters import rubber_skin
from retarget.characters.meshfiles import Material, Model, read_model
from retarget.characters.skin import Pose, Skin, read_skin
from retarget.export.rubber import write_rubber

FRAMES = 24


def _figure():
    names, parents, offsets = hose.joints()
    points, faces = hose.tube()
    model = Model(
        points=points,
        faces=faces,
        materials=(Material((0.8, 0.4, 0.2, 1.0)),),
        surface=np.zeros(len(faces), int),
        uv=np.zeros((len(points), 2)),
    )
    still = Pose(offsets, np.tile([0, 0, 0, 1.0], (3, 1)), np.ones((3, 3)))
    binds = np.concatenate([np.tile(np.eye(3), (3, 1, 1)), -np.cumsum(offsets, axis=0)[..., None]], axis=-1)
    skin = Skin(names, parents, still, np.arange(3), binds, sparse.csr_matrix(hose.shares()), {})
    phase = np.linspace(0, 2 * np.pi, FRAMES)[:, None]
    rotation = np.tile([0, 0, 0, 1.0], (FRAMES, 3, 1))
    rotation[:, 0] = Rotation.from_rotvec(np.sin(phase) * (0.3, 0.8, 1.0)).as_quat()
    rotation[:, 1] = Rotation.from_rotvec(np.cos(2 * phase) * (0.9, 0.2, -1.2)).as_quat()
    motion = SkeletonMotion(Skeleton(names, parents, offsets), np.tile(offsets, (FRAMES, 1, 1)), rotation, 24.0)
    return model, skin, make_rubber(motion, omega=3.0)


def _fox():
    """The real fox's run; the test is skipped where there is none."""
    root = Path(__file__).resolve().parents[2]
    path = Path(os.environ.get("TOONCAP_DATA", root.parent / "shared" / "data")) / "meshes" / "Fox.glb"
    if not path.is_file():
        pytest.skip(f"there is no {path}: set TOONCAP_DATA to the folder of real material")
    skin = read_skin(path)
    return read_model(path), skin, make_rubber(rubber_skin.motion_of(skin, "Run"), omega=3.0)


@pytest.mark.parametrize("figure", [_figure, _fox])
def test_a_rubber_model_passes_the_validator_and_three_poses_it_as_we_do(three, validate, tmp_path, figure):
    model, skin, motion = figure()
    assert np.ptp(motion.stretch) > 0.2
    bound = rubber_skin.rubber_skin(skin, model.points, motion.subjoints)
    write_rubber(model, bound, motion, tmp_path / "rubber.glb")
    issues = validate(tmp_path / "rubber.glb")
    assert (issues["numErrors"], issues["numWarnings"]) == (0, 0)
    times = np.float32(np.arange(len(motion)) / motion.source.fps).tolist()
    (shown,) = three(tmp_path / "rubber.glb", times).meshes
    ours = rubber_skin.posed(bound, model.points, motion)
    for t in range(0, len(motion), 5):
        away = np.linalg.norm(np.asarray(shown.points[t])[:, None] - ours[t], axis=-1)
        assert max(away.min(axis=1).max(), away.min(axis=0).max()) < 1e-4 * np.ptp(model.points)
