"""A body of hoses: closed skins on any skeleton, one in another, that bend without a crack."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from capture.errors import InputError
from fixtures import stickman
from mocap.body import rest_places
from mocap.rubber.rubber import make_rubber
from mocap.skeleton import Skeleton, SkeletonMotion
from retarget.characters import rubber_skin
from retarget.characters.hoses import INK, hoses
from retarget.characters.skin import Pose, skinned


def _moving(frames=24):
    swing = np.sin(np.linspace(0, 2 * np.pi, frames))[:, None]
    turns = {"LeftArm": swing * (0, 0.4, 0.8), "LeftForeArm": swing * (0, 0, 1.2), "RightUpLeg": swing * (-0.9, 0, 0)}
    return SkeletonMotion(Skeleton(*stickman.skeleton()), *stickman.moving(turns, frames))


def test_every_piece_is_closed_and_faces_outwards():
    model, _ = hoses(Skeleton(*stickman.skeleton()))
    edges = np.concatenate([model.faces[:, [0, 1]], model.faces[:, [1, 2]], model.faces[:, [2, 0]]])
    there = {tuple(edge) for edge in edges.tolist()}
    ring = {edge for edge in there if (edge[1], edge[0]) not in there}
    rims = np.unique(np.array(sorted(ring)))  # only the pinched ends are open, each smaller than can be seen
    assert len(rims) and np.ptp(model.points[rims].reshape(-1, 16, 3), axis=1).max() < 1e-6
    corners = model.points[model.faces]
    volume = np.einsum("fx,fx->f", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    assert volume > 0.01


def test_shares_sum_to_one_and_the_body_stands_where_the_joints_are():
    skeleton = Skeleton(*stickman.skeleton())
    model, skin = hoses(skeleton)
    np.testing.assert_allclose(np.asarray(skin.shares.sum(axis=1)).ravel(), 1)
    home = rest_places(skeleton)
    for joint in ("LeftForeArm", "RightLeg", "Head", "LeftHand"):
        away = np.linalg.norm(model.points - home[stickman.NAMES.index(joint)], axis=1)
        assert away.min() < 0.1
    assert np.ptp(model.points[:, 1]) == pytest.approx(np.ptp(home[:, 1]), rel=0.3)


def test_hoses_go_where_the_rubber_goes():
    motion = make_rubber(_moving(), feet=())
    model, skin = hoses(motion.subjoints.skeleton)
    points = rubber_skin.posed(rubber_skin.rubber_skin(skin, model.points, motion.subjoints), model.points, motion)
    home = rest_places(motion.subjoints.skeleton)
    hand = stickman.NAMES.index("LeftHand")
    glove = np.linalg.norm(model.points - home[hand], axis=1) < 0.12
    away = points[:, glove].mean(axis=1) - motion.positions[:, motion.subjoints.ends[hand]]
    assert glove.any() and np.linalg.norm(away, axis=1).max() < 0.15


def test_a_head_that_a_file_lays_on_its_ear_looks_forward_all_the_same():
    """The skeleton rests lying on its side, and stands up in every frame: its eyes are before it, its ears above."""
    about = Rotation.from_euler("z", -90, degrees=True)
    upright = _moving()
    skeleton = replace(upright.skeleton, offsets=about.apply(upright.skeleton.offsets))
    turns = Rotation.from_quat(upright.rotation.reshape(-1, 4))
    turns = (about * turns * about.inv()).as_quat().reshape(upright.rotation.shape)
    turns[:, 0] = (Rotation.from_quat(upright.rotation[:, 0]) * about.inv()).as_quat()
    offsets = np.tile(skeleton.offsets, (len(upright), 1, 1))
    motion = SkeletonMotion(skeleton, offsets, turns, 30.0)
    np.testing.assert_allclose(np.ptp(motion.positions()[0, :, 1]), np.ptp(upright.positions()[0, :, 1]), atol=1e-9)
    model, skin = hoses(skeleton, motion)
    pupils = np.unique(model.faces[model.surface == INK])
    posed = skinned(
        skin, model.points, Pose(motion.translation, motion.rotation, np.ones((len(motion), len(skeleton), 3)))
    )
    head = motion.positions()[:, stickman.NAMES.index("Head")]
    away = posed[:, pupils].mean(axis=1) - head
    assert (away[:, 2] > 0.1).all() and np.abs(away[:, 0]).max() < 0.05


def test_a_skeleton_without_bones_is_refused():
    with pytest.raises(InputError, match="bones"):
        hoses(Skeleton(("a", "b"), (-1, 0), np.zeros((2, 3))))
