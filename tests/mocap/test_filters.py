"""Laws of the cartoon filter, and its answer to waves, which is known."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from capture.errors import InputError
from mocap.curves import filters


def step(t, length=0.4):
    """A move (T, 1) from 0 to 1 that begins at 2 s: the smoothest polynomial that starts and ends at rest."""
    u = np.clip((np.asarray(t) - 2) / length, 0, 1)
    return (u**3 * (10 - 15 * u + 6 * u**2))[:, None]


@pytest.mark.parametrize("shift", [0.0, 0.1, -0.031])
def test_what_goes_straight_on_at_one_speed_is_unchanged(shift):
    line = np.arange(50)[:, None] * [0.3, -2, 0] + [1, 1e3, 7]
    np.testing.assert_allclose(filters.cartoon(line, 24, 3.0, 0.12, shift), line, atol=1e-9)


@settings(max_examples=50, deadline=None)
@given(st.sampled_from([1, 2]), st.floats(0.3, 40), st.floats(-30, 30))
def test_the_kernels_sums_are_those_of_a_derivative(order, width, shift):
    frames, weights = filters.kernel(order, width, shift)
    away = frames - shift
    wanted = [[0, -1, 0], [0, 0, 2]][order - 1]
    for power in range(3):
        assert (weights * away**power).sum() == pytest.approx(wanted[power], abs=1e-6)


def test_wide_kernels_are_derivatives_of_a_gaussian():
    frames, weights = filters.kernel(2, 8.0, 0.4)
    u = (frames - 0.4) / 8
    truth = (u**2 - 1) * np.exp(-(u**2) / 2) / (np.sqrt(2 * np.pi) * 8**3)
    np.testing.assert_allclose(weights, truth, atol=1e-3 * np.abs(truth).max())


@pytest.mark.parametrize("frequency", [0.4, 1.0, 1.5, 3.0])
def test_a_wave_comes_out_as_the_formula_says(frequency):
    """The gain is 1 + amount * (e / 2) (omega sigma)^2 e^(-(omega sigma)^2 / 2), a shift only turns what is added."""
    fps, sigma, shift = 60, 0.15, 0.07
    t, omega = np.arange(600) / fps, 2 * np.pi * frequency
    gain = 0.8 * 0.5 * np.e * (omega * sigma) ** 2 * np.exp(-0.5 * (omega * sigma) ** 2)
    wanted = np.sin(omega * t) + gain * np.sin(omega * (t - shift))
    ours = filters.cartoon(np.sin(omega * t)[:, None], fps, 0.8, sigma, shift)[:, 0]
    np.testing.assert_allclose(ours[90:-90], wanted[90:-90], atol=2e-3)


def test_amount_one_doubles_the_movement_it_is_tuned_to():
    t = np.arange(2000) / 60
    for frequency in (1.0, 2.0, 4.0):
        wave = np.sin(2 * np.pi * frequency * t)[:, None] * [3.0, -50]
        sigma = filters.pace(wave, 60)
        assert sigma == pytest.approx(np.sqrt(2) / (2 * np.pi * frequency), rel=0.02)
        doubled = filters.cartoon(wave, 60)
        np.testing.assert_allclose(doubled[200:-200], 2 * wave[200:-200], atol=0.02 * np.abs(wave).max())


def test_a_move_is_announced_and_overshot_and_comes_to_rest_where_it_did():
    t = np.arange(0, 5, 1 / 60)
    ours = filters.cartoon(step(t), 60, 1.0, 0.1)[:, 0]
    assert ours[t < 2].min() < -0.05 and ours[t > 2.4].max() > 1.05
    np.testing.assert_allclose(ours[t < 1.3], 0, atol=1e-4)
    np.testing.assert_allclose(ours[t > 3.1], 1, atol=1e-4)


def test_anticipation_and_overshoot_have_amounts_of_their_own():
    t = np.arange(0, 5, 1 / 60)
    both = filters.cartoon(step(t), 60, 1.0, 0.1)[:, 0]
    before = filters.cartoon(step(t), 60, 1.0, 0.1, overshoot=0.0)[:, 0]
    after = filters.cartoon(step(t), 60, 1.0, 0.1, anticipation=0.0)[:, 0]
    assert before.min() < 0.8 * both.min() < 0 and before.max() < 1.02
    assert after.max() - 1 > 0.8 * (both.max() - 1) > 0 and after.min() > -0.02
    np.testing.assert_allclose(before + after, both + step(t)[:, 0], atol=1e-9)


@pytest.mark.parametrize("fps", [24, 30, 60, 120])
@pytest.mark.parametrize("shift", [0.0, 0.06])
def test_the_frame_rate_does_not_matter(fps, shift):
    def at_sixths(rate):
        return filters.cartoon(step(np.arange(5 * rate + 1) / rate), rate, 1.0, 0.1, shift)[:: rate // 6]

    np.testing.assert_allclose(at_sixths(fps), at_sixths(480), atol=0.01)


def test_the_chosen_width_does_not_depend_on_the_frame_rate_much():
    widths = [filters.pace(step(np.arange(5 * rate + 1) / rate), rate) for rate in (30, 60, 120)]
    assert max(widths) < 1.05 * min(widths) and 0.06 < widths[0] < 0.2


def test_curves_do_not_meet_and_time_may_run_backwards():
    curves = np.cumsum(np.random.default_rng(5).normal(size=(80, 4, 3)), axis=0)
    together = filters.cartoon(curves, 30, 1.3, 0.1)
    for joint in range(4):
        np.testing.assert_allclose(filters.cartoon(curves[:, joint], 30, 1.3, 0.1), together[:, joint], atol=1e-9)
    np.testing.assert_allclose(filters.cartoon(curves[::-1], 30, 1.3, 0.1)[::-1], together, atol=1e-9)
    late = filters.cartoon(curves, 30, 1.3, 0.1, np.array([0, 0.05, 0.1, 0])[:, None])
    np.testing.assert_allclose(late[:, [0, 3]], together[:, [0, 3]], atol=1e-9)


def test_curves_that_sum_to_one_still_do():
    weights = np.random.default_rng(2).dirichlet(np.ones(5), 60)
    np.testing.assert_allclose(filters.cartoon(weights, 24, 2.0, 0.08).sum(axis=1), 1, atol=1e-9)


def test_a_loop_stays_a_loop():
    t = np.arange(30) / 30
    once = np.column_stack([np.sin(2 * np.pi * t), 3 * t + np.cos(4 * np.pi * t)])
    travel = np.array([0, 3.0])
    long = np.concatenate([once + n * travel for n in range(9)])
    ours = filters.cartoon(once, 30, 1.0, 0.1, 0.03, loop=True, travel=travel)
    np.testing.assert_allclose(ours, filters.cartoon(long, 30, 1.0, 0.1, 0.03)[120:150] - 4 * travel, atol=1e-9)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_short_curves_come_back_finite(count):
    curve = np.array([[0.0, 1], [2, 3], [1, 8]])[:count]
    assert np.isfinite(filters.cartoon(curve, 24)).all()


def test_what_is_still_stays_still():
    np.testing.assert_array_equal(filters.cartoon(np.full((9, 2), 0.1), 24), np.full((9, 2), 0.1))


@pytest.mark.parametrize(
    "given",
    [{"sigma": 0.0}, {"sigma": np.nan}, {"curves": np.full((4, 2), np.nan)}, {"curves": np.zeros(4)}, {"fps": 0}],
)
def test_what_cannot_be_filtered_is_refused(given):
    with pytest.raises(InputError, match="must be"):
        filters.cartoon(**{"curves": np.zeros((4, 2)), "fps": 24, **given})
