"""Left and right swapped, held against the mirror itself: joints' places with x turned round."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fixtures import skeletons
from mocap.body import find_body, rest_places
from mocap.posing import mirror
from mocap.skeleton import Skeleton, own_maps, world_maps

FIGURE = skeletons.walk(0.1)
SKELETON = Skeleton(FIGURE.names, FIGURE.parents, FIGURE.offsets)


def placed(skeleton, rest, turns):
    """Where joints are (J, 3), turned by rotation vectors (J, 3) after their rest (J, 4)."""
    rotation = (Rotation.from_quat(rest) * Rotation.from_rotvec(turns)).as_quat()
    return world_maps(skeleton.parents, own_maps(skeleton.offsets, rotation))


@pytest.mark.parametrize(
    ("name", "other"),
    [
        *[("LeftArm", "RightArm"), ("rig:RightUpLeg", "rig:LeftUpLeg"), ("l_knee", "r_knee"), ("thigh.L", "thigh.R")],
        *[("lShin", "rShin"), ("LHipJoint", "RHipJoint"), ("HandL", "HandR"), ("left leg", "right leg")],
        *[
            ("LEFT_TOE", "RIGHT_TOE"),
            ("Lamp", "Lamp"),
            ("Root", "Root"),
            ("LowerBack", "LowerBack"),
            ("bright", "bright"),
        ],
    ],
)
def test_names_have_another_side(name, other):
    assert mirror.other_side(name) == other and mirror.other_side(other) == name


def test_each_joint_has_its_counterpart_with_names_and_without():
    named = mirror.counterparts(SKELETON, find_body(SKELETON))
    places = rest_places(SKELETON)
    np.testing.assert_allclose(places[named] * [-1, 1, 1], places)
    plain = Skeleton(tuple(f"joint {n}" for n in range(len(SKELETON))), SKELETON.parents, SKELETON.offsets)
    limbs = mirror.counterparts(plain, find_body(plain))
    np.testing.assert_array_equal(limbs[limbs], np.arange(len(plain)))
    assert (limbs == named).mean() > 0.7


@pytest.mark.parametrize("seed", range(4))
def test_a_mirrored_pose_is_what_the_mirror_shows(seed):
    """The figure's rest pose is turned at random and alike on both sides, so joints' own axes are none of the world's."""
    rng = np.random.default_rng(seed)
    pairs = mirror.counterparts(SKELETON, find_body(SKELETON))
    vectors = rng.normal(size=(len(SKELETON), 3))
    vectors = vectors + vectors[pairs] * [1, -1, -1]  # symmetric: about x alike, about y and z the other way round
    rest = Rotation.from_rotvec(vectors).as_quat()
    at_rest = placed(SKELETON, rest, np.zeros_like(vectors))
    axis = mirror.across(at_rest[..., 3], pairs)
    np.testing.assert_allclose(np.abs(axis), [1, 0, 0], atol=1e-9)
    turns = rng.normal(size=(len(SKELETON), 3))
    swapped = mirror.mirrored(turns, pairs, axis, at_rest[..., :3])
    truth = placed(SKELETON, rest, turns)[..., 3] * [-1, 1, 1]
    np.testing.assert_allclose(placed(SKELETON, rest, swapped)[pairs][..., 3], truth, atol=1e-9)
    np.testing.assert_allclose(mirror.mirrored(swapped, pairs, axis, at_rest[..., :3]), turns, atol=1e-12)


def test_what_has_no_sides_is_mirrored_from_left_to_right():
    rope = Skeleton(("Base", "Stem", "Head"), (-1, 0, 1), np.array([[0.0, 0, 0], [0, 1, 0], [0, 1, 0]]))
    pairs = mirror.counterparts(rope, find_body(rope))
    np.testing.assert_array_equal(pairs, [0, 1, 2])
    axis = mirror.across(rest_places(rope), pairs)
    frames = np.tile(np.eye(3), (3, 1, 1))
    lean = np.array([[0, 0, 0], [0.2, 0.1, 0.5], [0, 0, 0]])
    np.testing.assert_allclose(mirror.mirrored(lean, pairs, axis, frames)[1], [0.2, -0.1, -0.5])
