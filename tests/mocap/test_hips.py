"""Hips between what standing legs allow: against lengths measured by hand."""

import numpy as np
import pytest

from mocap.rubber import hips, subjoints
from mocap.skeleton import Skeleton

FPS = 60


@pytest.mark.parametrize(("shift", "expected"), [(-0.6, 0.9 / 1.5), (-0.1, 0.8), (0.2, 1.1), (1.0, 0.9 * 1.5)])
def test_a_standing_leg_is_as_long_as_it_may_be(shift, expected):
    """The leg is 0.9 m from hip to ankle; the body was pushed up or down by `shift` metres throughout."""
    cut, captured, placed = _standing(shift)
    moved = hips.carried(placed, cut, captured, [3], np.ones((90, 1), bool), FPS, 1.5, 0.1)
    hip = moved[:, cut.ends[1]]
    np.testing.assert_allclose(np.linalg.norm(hip - captured[:, 3], axis=1), expected, atol=1e-6)
    np.testing.assert_allclose(np.ptp(moved - placed, axis=1)[:, [0, 2]], 0, atol=1e-12)
    np.testing.assert_allclose(np.ptp(moved - placed, axis=1)[:, 1], 0, atol=1e-12)


def test_who_does_not_stand_is_left_alone():
    cut, captured, placed = _standing(-0.6)
    for feet, stands in (([3], np.zeros((90, 1), bool)), ([0], np.ones((90, 1), bool)), ([], np.zeros((90, 0), bool))):
        np.testing.assert_array_equal(hips.carried(placed, cut, captured, feet, stands, FPS, 1.5, 0.1), placed)


def test_hips_are_lifted_without_a_jolt():
    """A leg that comes to stand in frame 45: within 0.2 s the body is up."""
    cut, captured, placed = _standing(-0.6)
    stands = (np.arange(90) >= 45)[:, None]
    lift = (hips.carried(placed, cut, captured, [3], stands, FPS, 1.5, 0.2) - placed)[:, 0, 1]
    assert lift[5] == pytest.approx(0, abs=1e-9) and lift[70] == pytest.approx(0.3, abs=1e-3)
    assert (np.diff(lift) > -1e-9).all() and np.diff(lift).max() < 0.3 / 6


def _standing(shift):
    """A hip, and a straight leg that hangs 0.1 m beside it, captured as it stands and moved up by `shift`."""
    offsets = np.array([[0, 1, 0], [0.1, 0, 0], [0, -0.45, 0], [0, -0.45, 0]], float)
    cut = subjoints.subdivide(Skeleton(("root", "thigh", "shin", "ankle"), (-1, 0, 1, 2), offsets))
    captured = np.tile(np.cumsum(offsets, axis=0), (90, 1, 1))
    placed = subjoints.place(subjoints.placing(cut), captured) + [0, shift, 0]
    return cut, captured, placed
