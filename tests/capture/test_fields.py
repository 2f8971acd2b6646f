"""Smooth fields push neighbours alike, far places apart, and every point by about a pixel."""

import numpy as np
import pytest

from capture.fit.shapes import fields


@pytest.mark.parametrize("count", [200, 1300])  # with and without nodes
def test_drawn_pushes_are_alike_as_the_gaussian_says(count):
    rng = np.random.default_rng(3)
    points = rng.uniform((0, 0), (200, 60), (count, 2))
    modes, spread = fields.smooth_fields(points, most=60)
    pushes = (spread[:, None, None] * modes).transpose(1, 0, 2).reshape(count, -1)
    covariance = pushes @ pushes.T / 2  # of either axis
    apart = np.linalg.norm(points[:, None] - points, axis=-1)
    reach = fields.REACH * np.ptp(points[:, 0])
    np.testing.assert_allclose(covariance, np.exp(-0.5 * (apart / reach) ** 2), rtol=0, atol=0.05)


def test_there_are_no_more_fields_than_asked_for():
    points = np.random.default_rng(5).uniform(0, 100, (80, 2))
    modes, spread = fields.smooth_fields(points, most=6)
    assert modes.shape == (12, 80, 2) and spread.shape == (12,)
