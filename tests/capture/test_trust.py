"""A pixel that differs counts less: gently while the goal is far, not at all once it is near."""

import numpy as np
import pytest

from capture.fit.pixels import trust

DIFFERENCE = np.array([(0.0,) * 4, (10.0,) * 4, (20.0,) * 4, (80.0,) * 4], np.float32)


def test_far_off_pixels_count_linearly_and_near_ones_fully():
    assert np.allclose(trust.huber(DIFFERENCE), [1, 1, 1, 0.25])


def test_near_the_goal_a_pixel_that_differs_too_much_has_no_weight_at_all():
    weight = trust.biweight(DIFFERENCE, 40.0)
    assert weight[0] == 1 and weight[3] == 0
    assert weight[1] == pytest.approx((1 - 1 / 16) ** 2) and weight[2] == pytest.approx((1 - 1 / 4) ** 2)


def test_what_is_hidden_does_not_count():
    known = np.array([1, 0.5, 0, 1])
    assert np.allclose(trust.weights(DIFFERENCE, known), trust.huber(DIFFERENCE) * known)
    assert np.allclose(trust.weights(DIFFERENCE, known, 40.0), trust.biweight(DIFFERENCE, 40.0) * known)


@pytest.mark.parametrize("noise, most", [(1.0, trust.LEAST), (8.0, 80.0), (100.0, trust.MOST)])
def test_the_limit_follows_the_pictures_own_noise_within_bounds(noise, most):
    size = np.abs(noise * np.random.default_rng(0).standard_normal(4000))
    size[:1500] = 200  # a third belongs to somebody else
    gone = trust.gone_at(size)
    assert trust.LEAST <= gone <= most * 1.4 and (noise > 50 or gone < 200)
    assert trust.gone_at(size, (np.arange(4000) >= 1500).astype(float)) <= gone


def test_the_mean_square_is_that_of_the_pixels_that_count():
    assert trust.mean_square(DIFFERENCE, np.array([1, 1, 0, 0])) == pytest.approx(200)
    assert trust.mean_square(DIFFERENCE, np.zeros(4)) == 0
