"""Laws of turns: they mix to turns, and the way round is kept."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from mocap.skeletons import rotations


def random_turns(count, seed=3):
    return Rotation.random(count, random_state=seed).as_quat()


def test_two_poses_mix_as_a_slerp():
    first, second = random_turns(5), random_turns(5, 4)
    turns = np.stack([np.zeros((5, 3)), rotations.turns_between(first, second)])
    shares = np.linspace(0, 1, 7)
    mixed = rotations.mixed(first, turns, np.stack([1 - shares, shares], axis=-1))
    for joint in range(5):
        there = Slerp([0, 1], Rotation.from_quat([first[joint], second[joint]]))(shares)
        apart = (there.inv() * Rotation.from_quat(mixed[:, joint])).magnitude()
        assert apart.max() < 1e-9


def test_all_weight_on_a_pose_is_the_pose_among_any_number():
    poses = np.stack([random_turns(4, seed) for seed in range(5)])
    turns = rotations.turns_between(poses[:1], poses)
    mixed = rotations.mixed(poses[0], turns, np.eye(5))
    apart = Rotation.from_quat(mixed.reshape(-1, 4)).inv() * Rotation.from_quat(poses.reshape(-1, 4))
    assert apart.magnitude().max() < 1e-9


def test_weights_outside_0_to_1_turn_further_the_same_way():
    first = np.array([[0, 0, 0, 1.0]])
    turns = np.array([[[0, 0, 0]], [[0, 0, 1.0]]])
    mixed = rotations.mixed(first, turns, np.array([[-0.5, 1.5], [1.4, -0.4]]))
    assert Rotation.from_quat(mixed[:, 0]).as_rotvec()[:, 2] == pytest.approx([1.5, -0.4])


def test_a_turn_that_goes_on_is_followed_past_a_whole_one():
    angle = np.linspace(0, 5 * np.pi, 60)
    axis = np.array([1.0, 2, -2]) / 3
    start = Rotation.from_euler("xyz", [0.3, -1, 2])
    turning = (start * Rotation.from_rotvec(angle[:, None] * axis)).as_quat()[:, None]
    turning[::3] *= -1  # a quaternion and its negative are the same turn
    np.testing.assert_allclose(rotations.unwrapped(turning)[:, 0], angle[:, None] * axis, atol=1e-9)


def test_unwrapped_turns_are_still_the_turns():
    way = Rotation.random(1, random_state=1) * Rotation.from_rotvec(np.cumsum(np.full((50, 3), 0.21), axis=0))
    turns = rotations.unwrapped(way.as_quat()[:, None])[:, 0]
    back = way[0] * Rotation.from_rotvec(turns)
    assert (back.inv() * way).magnitude().max() < 1e-9
    assert np.abs(np.diff(turns, axis=0)).max() < 0.5


def test_no_turn_at_all_may_be_a_whole_one():
    whole = np.array([[0, 0, 2 * np.pi]])
    np.testing.assert_allclose(rotations.nearest(np.zeros((1, 3)), whole + 0.1), whole, rtol=0.05, atol=0.11)
    np.testing.assert_array_equal(rotations.nearest(np.zeros((2, 3)), np.zeros((2, 3))), np.zeros((2, 3)))
