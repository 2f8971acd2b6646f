"""A skeleton alone is a character too: its spindles reach from joint to joint in every pose."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from capture.errors import InputError
from retarget.characters.figures.bones import read_bones
from retarget.characters.figures.puppet import KeyPose, read_puppet
from retarget.characters.figures.skin import sampled, skinned
from retarget.stage.perform import perform

CHAIN = """HIERARCHY
ROOT hip
{
 OFFSET 0 0 0
 CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
 JOINT knee
 { OFFSET 0 -4 0 CHANNELS 3 Zrotation Xrotation Yrotation
  End Site { OFFSET 0 -3 0 } } }
MOTION
Frames: 3
Frame Time: 0.5
"""


@pytest.fixture
def chain(tmp_path):
    """A leg whose knee bends by 0, 70 and 140 degrees while the hip moves on and turns."""
    frames = [f"{t} 9 0 {20 * t} 0 0 {70 * t} 0 0" for t in range(3)]
    file = tmp_path / "chain.bvh"
    file.write_text(CHAIN + "\n".join(frames) + "\n")
    return file


def test_spindles_reach_from_joint_to_joint(chain):
    model, skin = read_bones(chain)
    assert model.points.shape == (12, 3) and len(model.faces) == 16
    moved = skinned(skin, model.points, sampled(skin, "motion", np.array([0.0, 0.5, 1.0])))
    for t, points in enumerate(moved):
        hip = np.array([t, 9.0, 0])
        knee = hip + Rotation.from_euler("z", 20 * t, degrees=True).apply([0, -4.0, 0])
        foot = knee + Rotation.from_euler("z", 90 * t, degrees=True).apply([0, -3.0, 0])
        np.testing.assert_allclose(points[[0, 5, 6, 11]], [hip, knee, knee, foot], atol=1e-9)


def test_faces_look_outwards(chain):
    model, _ = read_bones(chain)
    for bone in range(2):
        middle = model.points[6 * bone : 6 * bone + 6].mean(axis=0)
        a, b, c = np.moveaxis(model.points[model.faces[8 * bone : 8 * bone + 8]], 1, 0)
        assert (np.einsum("fi,fi->f", np.cross(b - a, c - a), a - middle) > 0).all()


def test_a_skeleton_plays_a_part(chain, by_hand):
    poses = [KeyPose("motion", 0.0), KeyPose("motion", 1.0)]
    puppet = read_puppet("egg", by_hand.names, chain, poses)
    role = perform(by_hand.motion(by_hand.still(1), [[1.0]]), [puppet]).roles[0]
    assert np.ptp(role.points[0, :, 1]) == pytest.approx(100) and role.points[0, :, 1].max() == pytest.approx(200)
    half = skinned(puppet.skin, puppet.rest, puppet.posture(np.array([[0.5, 0.5]])))[0]
    thigh, shank = half[5] - half[0], half[11] - half[6]
    assert (np.linalg.norm(thigh), np.linalg.norm(shank)) == pytest.approx((4, 3))
    assert np.degrees(np.arccos(thigh @ shank / 12)) == pytest.approx(70)


def test_joints_all_in_one_place_are_refused(tmp_path):
    file = tmp_path / "dot.bvh"
    file.write_text(CHAIN.replace("-4", "0").replace("-3", "0").replace("Frames: 3", "Frames: 1") + "0 " * 9)
    with pytest.raises(InputError, match="must have bones"):
        read_bones(file)
