"""Skins on sub-joints: shares are kept, a rigid motion is the file's own, hoses stay round, thick and unwrung."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse
from scipy.spatial.transform import Rotation

from capture.errors import InputError
from capture.motion import affine
from fixtures import hose
from mocap.rubber.rubber import RubberMotion, plain
from mocap.rubber.subjoints import SubJoints
from mocap.skeleton import Skeleton, SkeletonMotion
from retarget.characters import rubber_skin
from retarget.characters.skin import Animation, Pose, Skin, skinned

CUT = 6


def _skin(animations=None):
    names, parents, offsets = hose.joints()
    count = len(names)
    rest = Pose(offsets, np.tile([0, 0, 0, 1.0], (count, 1)), np.ones((count, 3)))
    binds = np.concatenate([np.tile(np.eye(3), (count, 1, 1)), -np.cumsum(offsets, axis=0)[..., None]], axis=-1)
    return Skin(names, parents, rest, np.arange(count), binds, sparse.csr_matrix(hose.shares()), animations or {})


def _cut(pieces):
    """The hose's skeleton with each link in so many pieces."""
    skeleton = Skeleton(*hose.joints())
    joint = np.concatenate([[0], np.repeat([1, 2], pieces)])
    along = np.concatenate([[1.0], np.tile(np.arange(1, pieces + 1) / pieces, 2)])
    return SubJoints(skeleton, tuple(range(-1, 2 * pieces)), joint, along, np.array([0, pieces, 2 * pieces]), ())


def _rubber(positions, rotation, stretch, thickness, pieces=CUT):
    sub = _cut(pieces)
    source = SkeletonMotion(sub.skeleton, np.zeros((1, 3, 3)), np.tile([0, 0, 0, 1.0], (1, 3, 1)), 30.0)
    shape = np.shape(positions)[:2]
    return RubberMotion(
        source, sub, positions, rotation, np.broadcast_to(stretch, shape), np.broadcast_to(thickness, shape)
    )


def _played(motion):
    skin, (points, _) = _skin(), hose.tube()
    bound = rubber_skin.rubber_skin(skin, points, motion.subjoints)
    return rubber_skin.posed(bound, points, motion)[0].reshape(hose.RINGS, hose.AROUND, 3)


def _radii(rings):
    return np.linalg.norm(rings - rings.mean(axis=1, keepdims=True), axis=-1)


@pytest.mark.parametrize("beside", [2, None])
def test_shares_in_sub_joints_sum_to_those_in_the_joints(beside):
    sub, (points, _) = _cut(CUT), hose.tube()
    for joint in range(3):
        alone = hose.shares() * (np.arange(3) == joint)
        shared = rubber_skin.redistributed(sparse.csr_matrix(alone), points, sub, beside).toarray()
        np.testing.assert_allclose(shared.sum(axis=1), hose.shares()[:, joint], atol=1e-12)
        assert shared.min() >= 0


def test_the_papers_shares_go_by_one_over_the_distance():
    sub, points = _cut(2), np.array([[0.2, 0.0, 0.0]])
    table = sparse.csr_matrix([[1.0, 0, 0]])
    says = np.array([1 / 0.2, 1 / 0.3, 1 / 0.8])  # of the sub-joints at 0, 0.5 and 1
    every = rubber_skin.redistributed(table, points, sub, beside=None).toarray()[0]
    np.testing.assert_allclose(every[:3], says / says.sum())
    two = rubber_skin.redistributed(table, points, sub).toarray()[0]
    np.testing.assert_allclose(two[:3], [*says[:2] / says[:2].sum(), 0])


def test_a_joint_that_no_cut_link_leads_to_does_not_follow_the_next_one():
    """A pelvis stays with the hips, however near the thigh: its link is none that bends."""
    sub, points = _cut(1), np.array([[0.9, 0.0, 0.0]])
    shared = rubber_skin.redistributed(sparse.csr_matrix([[1.0, 0, 0]]), points, sub).toarray()[0]
    np.testing.assert_allclose(shared, [1, 0, 0])


def test_a_link_that_leads_to_nothing_bound_bends_nothing():
    skin = _skin()
    alone = replace(skin, shares=sparse.csr_matrix(np.tile([1.0, 0, 0], (len(hose.tube()[0]), 1))))
    bound = rubber_skin.rubber_skin(alone, hose.tube()[0], _cut(CUT))
    np.testing.assert_allclose(bound.shares.toarray()[:, 0], 1)


def test_a_vertex_follows_four_sub_joints_at_most():
    sub, (points, _) = _cut(CUT), hose.tube()
    shares = rubber_skin.strongest(
        rubber_skin.redistributed(sparse.csr_matrix(hose.shares()), points, sub, None)
    ).toarray()
    assert (shares > 0).sum(axis=1).max() == 4
    np.testing.assert_allclose(shares.sum(axis=1), 1)


def test_without_sub_joints_a_motion_is_the_files_own():
    """In a file whose joints are turned already when the mesh is bound, and hang askew."""
    rng = np.random.default_rng(5)
    names, parents, offsets = hose.joints()
    turns = Rotation.from_rotvec(rng.normal(0, 0.6, (3, 3)))
    rest = Pose(offsets + rng.normal(0, 0.2, (3, 3)), turns.as_quat(), np.ones((3, 3)))
    binds = affine.invert(
        np.concatenate([Rotation.random(3, rng=rng).as_matrix(), rng.normal(0, 1, (3, 3, 1))], axis=-1)
    )
    times = np.arange(5) / 30
    curves = tuple((joint, "rotation", "LINEAR", times, Rotation.random(5, rng=rng).as_quat()) for joint in range(3))
    skin = Skin(
        names,
        parents,
        rest,
        np.arange(3),
        binds,
        sparse.csr_matrix(hose.shares()),
        {"wave": Animation(times[-1], curves)},
    )
    motion = rubber_skin.motion_of(skin, "wave")
    sub = SubJoints(motion.skeleton, parents, np.arange(3), np.ones(3), np.arange(3), ())
    world = motion.world()
    quats = Rotation.from_matrix(world[..., :3].reshape(-1, 3, 3)).as_quat().reshape(5, 3, 4)
    ones = np.ones((5, 3))
    rubber = RubberMotion(motion, sub, world[..., 3], quats, ones, ones)
    points, _ = hose.tube()
    bound = rubber_skin.rubber_skin(skin, points, sub)
    from retarget.characters.skin import sampled

    truth = skinned(skin, points, sampled(skin, "wave", times))
    np.testing.assert_allclose(rubber_skin.posed(bound, points, rubber), truth, atol=1e-9)


def test_a_hose_at_rest_is_the_mesh():
    sub = _cut(CUT)
    home = rubber_skin.rest_places(sub)[None]
    still = np.tile([0, 0, 0, 1.0], (1, len(sub), 1))
    np.testing.assert_allclose(_played(_rubber(home, still, 1.0, 1.0)).reshape(-1, 3), hose.tube()[0], atol=1e-12)


def test_a_stretched_hose_is_as_long_and_as_thin_as_its_sub_links_say():
    sub = _cut(CUT)
    home = rubber_skin.rest_places(sub)[None] * (1.5, 1, 1)
    still = np.tile([0, 0, 0, 1.0], (1, len(sub), 1))
    rings = _played(_rubber(home, still, 1.5, 0.8))
    np.testing.assert_allclose(rings[:, :, 0], hose.tube()[0].reshape(rings.shape)[:, :, 0] * 1.5, atol=1e-9)
    np.testing.assert_allclose(_radii(rings), 0.8 * hose.RADIUS, atol=1e-9)


def test_a_twisted_hose_is_not_wrung():
    """Half a turn from end to end leaves it as thick as it was: with joints alone it would be thin as a thread."""
    sub = _cut(CUT)
    home = rubber_skin.rest_places(sub)[None]
    share = home[0, :, 0] / hose.LENGTH
    turns = Rotation.from_rotvec(np.pi * share[:, None] * (1, 0, 0)).as_quat()[None]
    rings = _played(_rubber(home, turns, 1.0, 1.0))
    assert _radii(rings).min() > 0.93 * hose.RADIUS
    few = _cut(1)
    wrung = _played(_rubber(rubber_skin.rest_places(few)[None], turns[:, [0, CUT, 2 * CUT]], 1.0, 1.0, 1))
    assert _radii(wrung).min() < 0.8 * hose.RADIUS  # so this can fail


def test_a_bent_hose_lies_round_its_curve():
    sub, bend = _cut(CUT), np.pi / 2
    angle = bend * rubber_skin.rest_places(sub)[:, 0] / hose.LENGTH
    radius = hose.LENGTH / bend
    places = radius * np.stack([np.sin(angle), 1 - np.cos(angle), np.zeros_like(angle)], axis=-1)
    rotation = Rotation.from_rotvec(angle[:, None] * (0, 0, 1)).as_quat()[None]
    rings = _played(_rubber(places[None], rotation, 1.0, 1.0))
    away = np.abs(np.linalg.norm(rings.mean(axis=1) - (0, radius, 0), axis=1) - radius)
    assert away.max() < 0.05 * hose.RADIUS
    assert np.abs(_radii(rings) / hose.RADIUS - 1).max() < 0.05


def test_joints_that_stretch_by_themselves_are_refused():
    skin = _skin(
        {"grow": Animation(1.0, ((1, "scale", "LINEAR", np.array([0, 1.0]), np.array([[1, 1, 1], [2, 1, 1.0]])),))}
    )
    with pytest.raises(InputError, match="bake its scale"):
        rubber_skin.motion_of(skin, "grow")


def test_the_whole_chain_bends_the_hose_and_moves_its_tip_where_the_hand_goes():
    frames = 30
    swing = np.sin(np.linspace(0, 2 * np.pi, frames))[:, None] * (0, 0, 0.8)
    names, parents, offsets = hose.joints()
    rotation = np.tile([0, 0, 0, 1.0], (frames, 3, 1))
    rotation[:, 1] = Rotation.from_rotvec(swing).as_quat()
    source = SkeletonMotion(Skeleton(names, parents, offsets), np.tile(offsets, (frames, 1, 1)), rotation, 30.0)
    motion = plain(source, hose=1.0)
    points, _ = hose.tube()
    bound = rubber_skin.rubber_skin(_skin(), points, motion.subjoints)
    rings = rubber_skin.posed(bound, points, motion).reshape(frames, hose.RINGS, hose.AROUND, 3)
    hand = motion.positions[:, motion.subjoints.ends[2]]
    assert np.linalg.norm(rings[:, -1].mean(axis=1) - hand, axis=-1).max() < 0.3 * hose.RADIUS
