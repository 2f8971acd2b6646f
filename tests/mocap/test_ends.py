"""A curve goes on where it ends."""

import numpy as np
import pytest

from mocap.curves.ends import extended


def test_a_straight_line_goes_straight_on_however_far():
    line = np.arange(7.0)[:, None] * [1, -2] + [3, 5]
    longer = extended(line, 40, 25)
    np.testing.assert_allclose(longer, np.arange(-40.0, 32)[:, None] * [1, -2] + [3, 5], atol=1e-12)


@pytest.mark.parametrize("count", [1, 2, 9])
def test_ends_are_reflected_in_the_point_where_they_are(count):
    curve = np.random.default_rng(count).normal(size=(count, 2, 3))
    longer = extended(curve, count - 1, count - 1)
    np.testing.assert_allclose(longer[: count - 1], 2 * curve[0] - curve[:0:-1])
    np.testing.assert_allclose(longer[2 * count - 1 :], 2 * curve[-1] - curve[-2::-1])
    np.testing.assert_array_equal(longer[count - 1 : 2 * count - 1], curve)


def test_a_loop_comes_round_and_goes_on_by_its_travel():
    walk = np.random.default_rng(1).normal(size=(5, 3))
    longer = extended(walk, 6, 7, loop=True, travel=np.array([1, 0, 2]))
    rounds, frame = np.divmod(np.arange(-6, 12), 5)
    np.testing.assert_allclose(longer, walk[frame] + rounds[:, None] * [1, 0, 2])


def test_frames_that_are_there_are_left_as_they_are_to_the_bit():
    curve = np.random.default_rng(2).normal(size=(30, 4)) * 1e3
    for loop in (False, True):
        np.testing.assert_array_equal(extended(curve, 11, 80, loop)[11:41], curve)
