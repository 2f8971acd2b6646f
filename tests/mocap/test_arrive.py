"""Elastic curves that are where they should be when the beat sounds."""

import numpy as np
import pytest

from capture.errors import InputError
from mocap.posing.arrive import arriving
from mocap.posing.elastic import felt

GOALS = np.random.default_rng(5).normal(size=(24, 4, 3))


def way_left(bpm, damping, fps=24.0, frequency=2.2, hold=0.0, first=0.21):
    """Of each goal, what is left of each joint's move (M, J): in the frame nearest to its beat, and at the beat between frames."""
    when = first + np.arange(len(GOALS)) * 60 / bpm
    at = np.arange(0, when[-1] + 1, 1 / fps)
    curves = arriving(felt(frequency, damping), at, when, GOALS, hold)
    far = np.linalg.norm(np.diff(GOALS, axis=0, prepend=0 * GOALS[:1]), axis=-1)
    near = np.abs(at[:, None] - when).argmin(axis=0)
    flat = curves.reshape(len(at), -1)
    between = np.stack([np.interp(when, at, curve) for curve in flat.T], axis=1).reshape(GOALS.shape)
    return tuple(np.linalg.norm(there - GOALS, axis=-1) / far for there in (curves[near], between))


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
    late = arriving(felt(2.2, 0.8), np.arange(0, 5, 1 / 24), when + 0.25, GOALS[:8])
    there = late[np.rint(24 * when).astype(int)]
    assert np.linalg.norm(there - GOALS[:8], axis=-1).max() > 0.5


def test_what_is_shown_does_not_depend_on_the_frame_rate():
    when, springs = np.array([0.4, 0.9, 1.37]), felt(2.0, 0.5)
    at = np.arange(0, 2, 1 / 240)
    fine = arriving(springs, at, when, GOALS[:3])
    np.testing.assert_allclose(arriving(springs, at[::20], when, GOALS[:3]), fine[::20], atol=1e-12)


def test_curves_have_no_jump_in_place_or_speed():
    when = np.cumsum(np.full(12, 0.37))
    at = np.arange(0, 5, 1e-4)
    curves = arriving(felt(2.2, 0.6), at, when, GOALS[:12])
    speed = np.diff(curves, axis=0) / 1e-4
    assert np.abs(np.diff(curves, axis=0)).max() < 0.01
    fastest = np.abs(speed).max()
    assert np.abs(np.diff(speed, axis=0)).max() < 1e-4 * 60 * fastest  # nowhere more than 60 times as quick in a second


def test_a_posture_is_held_and_the_move_after_it_is_quicker():
    when, at = np.array([0.5, 1.5]), np.arange(0, 2, 1 / 240)
    held = arriving(felt(1.0, 1.0), at, when, GOALS[:2], hold=0.7)
    loose = arriving(felt(1.0, 1.0), at, when, GOALS[:2])
    way = np.linalg.norm(GOALS[1] - GOALS[0])
    still = (at > 0.5) & (at < 1.2)
    assert np.linalg.norm(held[still] - GOALS[0], axis=(1, 2)).max() < 0.05 * way
    assert np.linalg.norm(loose[still] - GOALS[0], axis=(1, 2)).max() > 0.5 * way


def test_the_same_goal_again_is_no_move_and_a_goal_at_the_start_is_the_start():
    at = np.arange(0, 3, 1 / 24)
    still = arriving(felt(), at, np.arange(5) * 0.5, np.tile(GOALS[:1], (5, 1, 1)))
    np.testing.assert_allclose(still, np.tile(GOALS[0], (len(at), 1, 1)), atol=1e-12)


def test_softer_springs_set_out_earlier():
    at, when, goal = np.arange(0, 2, 1 / 240), np.array([2.0]), np.ones((1, 1, 3))
    soft, stiff = (arriving(felt(frequency, 1.0), at, when, goal)[:, 0, 0] for frequency in (0.7, 3.0))
    assert np.argmax(soft > 0.01) < np.argmax(stiff > 0.01) - 100


def test_two_postures_at_one_moment_are_refused():
    with pytest.raises(InputError, match="must rise"):
        arriving(felt(), np.arange(3), np.array([1.0, 1.0]), GOALS[:2])
