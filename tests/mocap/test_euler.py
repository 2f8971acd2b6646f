"""Angles against SciPy, which is slow and right."""

from itertools import permutations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mocap.skeletons import euler


@pytest.mark.parametrize("order", ["X", "ZY", "YXY", *map("".join, permutations("XYZ"))])
def test_angles_are_turns_one_after_the_other(order):
    degrees = np.random.default_rng(0).uniform(-400, 400, (50, len(order)))
    truth = Rotation.from_euler(order, degrees, degrees=True).as_matrix()
    np.testing.assert_allclose(Rotation.from_quat(euler.quaternions(order, degrees)).as_matrix(), truth, atol=1e-12)


def test_no_axis_is_no_turn():
    np.testing.assert_array_equal(euler.quaternions("", np.zeros((2, 5, 0))), np.tile([0, 0, 0, 1.0], (2, 5, 1)))


def test_angles_of_a_turn_make_the_turn():
    turns = Rotation.random(200, rng=np.random.default_rng(1))
    again = Rotation.from_euler("ZXY", euler.degrees_zxy(turns.as_quat()), degrees=True)
    np.testing.assert_allclose(again.as_matrix(), turns.as_matrix(), atol=1e-12)


@pytest.mark.parametrize("x", [90.0, -90.0, 90 - 1e-6, 89.9999])
def test_a_quarter_about_x_is_no_trouble(x):
    turns = Rotation.from_euler("ZXY", [[30, x, 50], [-170, x, 100]], degrees=True)
    again = Rotation.from_euler("ZXY", euler.degrees_zxy(turns.as_quat()), degrees=True)
    np.testing.assert_allclose(again.as_matrix(), turns.as_matrix(), atol=2e-7)
