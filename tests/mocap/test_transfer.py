"""Laws of scale and offset over time, and of rhythm."""

import numpy as np
import pytest

from mocap.analogy import rhythm, transfer


def waves(count=200, fps=60.0, channels=3):
    t = np.arange(count) / fps
    return np.stack([np.sin((1 + c) * 2 * t + c) + 0.3 * c for c in range(channels)], axis=-1)


def test_the_banded_solution_is_the_dense_one():
    one, two = waves(), waves()[::-1] * 1.3 + 0.2
    scale, offset = transfer.model(one, two, 60.0)
    for c in range(one.shape[1]):
        dense = transfer.model_dense(one[:, c], two[:, c], 60.0)
        np.testing.assert_allclose([scale[:, c], offset[:, c]], dense, atol=1e-8)


def test_equal_curves_have_scale_one_and_no_offset():
    scale, offset = transfer.model(waves(), waves(), 60.0)
    np.testing.assert_allclose(scale, 1, atol=1e-9)
    np.testing.assert_allclose(offset, 0, atol=1e-9)


def test_a_scale_and_an_offset_are_found_again():
    one = waves()
    scale, offset = transfer.model(one, 1.4 * one, 60.0)
    np.testing.assert_allclose(scale * one + offset, 1.4 * one, atol=0.01)
    other = waves(channels=3)[:, ::-1]
    np.testing.assert_allclose(scale.mean(), 1.4, rtol=0.05)
    scale, offset = transfer.model(one, one + 0.3, 60.0)
    np.testing.assert_allclose(scale * other + offset, other + 0.3, atol=0.015)


def test_a_channel_that_does_not_move_is_shifted_not_scaled():
    one = np.zeros((100, 1))
    scale, offset = transfer.model(one, one + 0.7, 60.0)
    np.testing.assert_allclose(scale, 1, atol=1e-6)
    np.testing.assert_allclose(offset, 0.7, atol=1e-6)


def test_the_frame_rate_does_not_matter():
    made = []
    for fps in (30.0, 120.0):
        t = np.arange(int(3 * fps) + 1) / fps
        one, two = np.sin(3 * t)[:, None], (np.sin(3 * t) * (1 + 0.4 * np.sin(t)) + 0.2 * t)[:, None]
        scale, offset = transfer.model(one, two, fps)
        made.append((scale * np.cos(2 * t)[:, None] + offset)[:: int(fps / 30), 0])
    np.testing.assert_allclose(*made, atol=0.03)


def test_equal_timings_leave_the_rhythm():
    at = np.linspace(0, 50, 60) ** 1.1
    np.testing.assert_allclose(rhythm.rhythm(at, at), np.arange(60), atol=1e-9)
    np.testing.assert_allclose(rhythm.rhythm(at, 2 * at), 2 * np.arange(60), atol=1e-9)
    np.testing.assert_allclose(rhythm.rhythm(at, 2 * at, 0.0), np.arange(60), atol=1e-9)


def test_where_b_is_a_the_rhythm_is_that_of_a2():
    """B's frames come when A' has them: the law, for a timing that rises unevenly."""
    at = np.arange(100.0)
    two = 130 * (np.linspace(0, 1, 100) + 0.1 * np.sin(np.linspace(0, 2 * np.pi, 100)))
    np.testing.assert_allclose(rhythm.rhythm(at, two), two, atol=1e-9)


def test_time_never_runs_back():
    random = np.random.default_rng(3)
    for _ in range(20):
        one, two = (np.cumsum(random.exponential(size=50)) for _ in range(2))
        assert (np.diff(rhythm.rhythm(one, two, 1.5)) > 0).all()


def test_curves_are_played_at_their_times():
    when = 150 * (np.linspace(0, 1, 100) + 0.05 * np.sin(np.linspace(0, 2 * np.pi, 100)))
    here = rhythm.moments(when)
    assert len(here) == 151 and here[0] == 0 and here[-1] == 99
    np.testing.assert_allclose(np.interp(here, np.arange(100), when), np.arange(151), atol=1e-6)


def test_pace_is_how_fast_a_time_curve_rises():
    at = np.arange(200.0)
    np.testing.assert_allclose(rhythm.pace(1.7 * at, 60.0), 1.7, atol=1e-12)
    slow = 100 * (at / 200 + 0.1 * np.sin(2 * np.pi * at / 200))
    np.testing.assert_allclose(rhythm.pace(slow, 60.0), 0.5 + 0.1 * np.pi * np.cos(2 * np.pi * at / 200), atol=0.03)


def test_where_b_is_a_all_of_a2_comes_back_whatever_the_scale():
    one, two = waves(), waves()[::-1] + np.random.default_rng(2).normal(size=(200, 3))
    scale, _ = transfer.model(one, two, 60.0)
    np.testing.assert_allclose(transfer.transferred(scale, one, two, one), two, atol=1e-12)
    np.testing.assert_allclose(transfer.transferred(np.ones_like(scale), one, one, two), two, atol=1e-12)


def test_poses_add_where_swings_vanish_and_scale_where_all_is_scaled():
    """A bends by 1 and swings, A' hardly swings: an upright B stays upright.  Twice A is twice B, its mean too."""
    t = np.arange(240) / 60
    swing = np.sin(2 * np.pi * t)[:, None]
    one, three = 1 + 0.5 * swing, 0.2 + 0.4 * swing
    for two, mean in ((1.1 + 0.02 * swing, 0.3), (2 * one, 0.4)):
        scale, _ = transfer.model(one, two, 60.0)
        held = transfer.holding(scale, one, two, three)
        made = transfer.transferred(scale, one, two, three, held)
        assert made.mean() == pytest.approx(mean, abs=0.15)  # the offset takes a little of what is scaled
