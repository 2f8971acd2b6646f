"""Elastic curves that are where they should be when the beat sounds."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mocap.posing.arrive import arriving, response, settling

GOALS = np.random.default_rng(5).normal(size=(24, 4))


def way_left(bpm, damping, fps=24.0, frequency=2.2, hold=0.0, first=0.21):
    """Of each goal, what is left of the move (M,): in the frame nearest to its beat, and at the beat between frames."""
    when = first + np.arange(len(GOALS)) * 60 / bpm
    at = np.arange(0, when[-1] + 1, 1 / fps)
    curves = arriving(GOALS, when, at, frequency, damping, hold)
    far = np.linalg.norm(np.diff(GOALS, axis=0, prepend=0 * GOALS[:1]), axis=1)
    near = np.abs(at[:, None] - when).argmin(axis=0)
    between = np.stack([np.interp(when, at, curve) for curve in curves.T], axis=1)
    return tuple(np.linalg.norm(there - GOALS, axis=1) / far for there in (curves[near], between))


@pytest.mark.parametrize("bpm", [40, 60, 87, 97, 120, 135, 150, 180, 210, 240])
@pytest.mark.parametrize("damping", [0.3, 0.6, 0.8, 1.0, 2.0])
def test_at_its_beat_less_than_5_percent_of_a_move_is_left(bpm, damping):
    in_frame, between = way_left(bpm, damping)
    assert in_frame.max() < 0.05 and between.max() < 0.05


@pytest.mark.parametrize("fps", [25.0, 30.0, 60.0])
def test_so_it_is_at_other_frame_rates_and_with_soft_joints_held_long(fps):
    for bpm in (60, 111, 135):
        for left in (*way_left(bpm, 0.8, fps), *way_left(bpm, 0.8, fps, frequency=0.4, hold=0.3)):
            assert left.max() < 0.05


def test_the_test_of_the_beat_can_fail():
    """A spring that is only told its goal when the beat sounds is late."""
    when = np.arange(1, 9) * 0.5
    late = arriving(GOALS[:8], when + 0.25, np.arange(0, 5, 1 / 24), 2.2, 0.8)
    there = late[np.rint(24 * when).astype(int)]
    assert (np.linalg.norm(there - GOALS[:8], axis=1) / np.linalg.norm(GOALS[:8], axis=1)).max() > 0.2


@pytest.mark.parametrize("damping", [0.0, 0.2, 0.8, 1 - 1e-9, 1.0, 1 + 1e-7, 3.0])
def test_a_spring_goes_as_a_solver_of_its_equation_says(damping):
    w, seconds = 7.0, 0.31
    p, q, slope_p, slope_q = response(w, np.array(damping), np.array(seconds))
    for start, (place, speed) in (((1.0, 0.0), (p, slope_p)), ((0.0, 1.0), (q, slope_q))):
        truth = solve_ivp(
            lambda t, y: [y[1], -2 * damping * w * y[1] - w * w * y[0]], (0, seconds), start, rtol=1e-10, atol=1e-12
        ).y[:, -1]
        np.testing.assert_allclose([place, speed], truth, atol=1e-8)


def test_what_is_shown_does_not_depend_on_the_frame_rate():
    when, soft = np.array([0.4, 0.9, 1.37]), np.array([1.0, 2.0, 3.0, 5.0])
    at = np.arange(0, 2, 1 / 240)
    fine = arriving(GOALS[:3], when, at, soft, 0.5)
    np.testing.assert_allclose(arriving(GOALS[:3], when, at[::20], soft, 0.5), fine[::20], atol=1e-12)


def test_curves_have_no_jump_in_place_or_speed():
    when = np.cumsum(np.full(12, 0.37))
    at = np.arange(0, 5, 1e-4)
    curves = arriving(GOALS[:12], when, at, 2.2, 0.6)
    speed = np.diff(curves, axis=0) / 1e-4
    assert np.abs(np.diff(curves, axis=0)).max() < 0.01
    fastest = np.abs(speed).max()
    assert np.abs(np.diff(speed, axis=0)).max() < 1e-4 * 60 * fastest  # nowhere more than 60 times as quick in a second


def test_a_posture_is_held_and_the_move_after_it_is_quicker():
    when, at = np.array([0.5, 1.5]), np.arange(0, 2, 1 / 240)
    held = arriving(GOALS[:2], when, at, 1.0, 1.0, hold=0.7)
    loose = arriving(GOALS[:2], when, at, 1.0, 1.0)
    way = np.linalg.norm(GOALS[1] - GOALS[0])
    still = (at > 0.5) & (at < 1.2)
    assert np.linalg.norm(held[still] - GOALS[0], axis=1).max() < 0.05 * way
    assert np.linalg.norm(loose[still] - GOALS[0], axis=1).max() > 0.5 * way


def test_the_same_goal_again_is_no_move_and_a_goal_at_the_start_is_the_start():
    at = np.arange(0, 3, 1 / 24)
    still = arriving(np.tile(GOALS[:1], (5, 1)), np.arange(5) * 0.5, at)
    np.testing.assert_allclose(still, np.tile(GOALS[0], (len(at), 1)), atol=1e-12)
    np.testing.assert_array_equal(arriving(GOALS[:0], np.zeros(0), at, start=GOALS[3]), np.tile(GOALS[3], (len(at), 1)))


def test_softer_springs_set_out_earlier():
    at = np.arange(0, 2, 1 / 240)
    curves = arriving(np.ones((1, 2)), np.array([2.0]), at, np.array([0.7, 3.0]), 1.0)
    leaves = [np.argmax(curve > 0.01) for curve in curves.T]
    assert leaves[0] < leaves[1] - 100


def test_a_spring_stays_near_once_it_has_settled():
    for damping in (0.2, 0.5, 0.8, 1.0, 2.0):
        t = settling(np.array([damping]))[0]
        later = np.abs(response(1.0, np.array(damping), np.linspace(t, t + 60, 5000))[0])
        assert 0.016 < later[0] < 0.0201 and later.max() < 0.0201
