"""Quaternions with components first, held against scipy's."""

import numpy as np
from scipy.spatial.transform import Rotation

from mocap.skeletons import quaternions as quat
from mocap.skeletons import skeleton


def test_products_inverses_and_turned_vectors_are_scipys():
    p, q = (Rotation.random(50, random_state=seed) for seed in (1, 2))
    v = np.random.default_rng(0).normal(size=(50, 3))
    _same(quat.product(p.as_quat().T, q.as_quat().T), p * q)
    _same(quat.inverse(p.as_quat().T), p.inv())
    np.testing.assert_allclose(quat.turned(p.as_quat().T, v.T).T, p.apply(v), atol=1e-12)
    _same(quat.from_vector(v.T), Rotation.from_rotvec(v))
    _same(quat.about(np.array([0, 0.6, 0.8]), v[:, 0]), Rotation.from_rotvec(v[:, :1] * [0, 0.6, 0.8]))


def test_the_smallest_turn_between_directions():
    a, b = np.random.default_rng(3).normal(size=(2, 40, 3))
    turn = Rotation.from_quat(quat.between(a.T, b.T).T)
    unit = lambda v: v / np.linalg.norm(v, axis=1, keepdims=True)  # noqa: E731
    np.testing.assert_allclose(turn.apply(unit(a)), unit(b), atol=1e-12)
    angle = np.arccos((unit(a) * unit(b)).sum(axis=1))
    np.testing.assert_allclose(turn.magnitude(), angle, atol=1e-9)


def test_opposite_directions_are_half_a_turn_apart_and_no_direction_is_no_turn():
    a = np.array([[1.0, 0, 0], [1, 1, 1], [0, 2, 0], [0, 0, 0]])
    turn = Rotation.from_quat(quat.between(a.T, -a.T).T)
    np.testing.assert_allclose(turn.apply(a), -a, atol=1e-12)
    np.testing.assert_allclose(turn.magnitude(), [np.pi, np.pi, np.pi, 0], atol=1e-9)
    np.testing.assert_allclose(quat.between(a.T, a.T).T, [[0, 0, 0, 1]] * 4, atol=1e-12)


def test_twist_is_what_a_turn_goes_round_an_axis():
    axis = np.array([2.0, -1, 2]) / 3
    round_it = np.linspace(-3, 3, 25)
    tilt = Rotation.from_rotvec(1.1 * np.cross(axis, [0.3, 0.5, -0.8]))
    turns = tilt * Rotation.from_rotvec(round_it[:, None] * axis)
    np.testing.assert_allclose(quat.twist(turns.as_quat().T, axis), round_it, atol=1e-9)
    np.testing.assert_allclose(quat.twist(-turns.as_quat().T, axis), round_it, atol=1e-9)


def test_steady_turns_are_the_same_turns_without_jumps():
    q = Rotation.from_rotvec(np.linspace(0, 12, 60)[:, None] * [0, 0.6, 0.8]).as_quat()
    shaken = q * np.random.default_rng(0).choice([-1, 1], (60, 1))
    steady = quat.steady(shaken.T).T
    assert np.linalg.norm(np.diff(steady, axis=0), axis=1).max() < 0.2
    np.testing.assert_allclose(np.abs((steady * q).sum(axis=1)), 1, atol=1e-12)


def test_joints_in_the_world_are_where_their_maps_say():
    parents = (-1, 0, 1, 0, -1, 4)
    rng = np.random.default_rng(4)
    translation = rng.normal(size=(7, 6, 3))
    rotation = Rotation.random(42, random_state=5).as_quat().reshape(7, 6, 4)
    maps = skeleton.world_maps(parents, skeleton.own_maps(translation, rotation))
    places, turns = quat.world(parents, translation.transpose(1, 2, 0), rotation.transpose(1, 2, 0))
    np.testing.assert_allclose(places.transpose(2, 0, 1), maps[..., 3], atol=1e-12)
    matrices = Rotation.from_quat(turns.transpose(2, 0, 1).reshape(-1, 4)).as_matrix()
    np.testing.assert_allclose(matrices.reshape(7, 6, 3, 3), maps[..., :3], atol=1e-12)


def _same(ours, theirs):
    np.testing.assert_allclose(np.abs((ours.T * theirs.as_quat()).sum(axis=1)), 1, atol=1e-12)
