"""Elastic joints do what their equation says, whatever the frame rate, and never gain energy from nothing."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from capture.errors import InputError
from mocap.posing import elastic
from mocap.posing.elastic import Elastic, State

RNG = np.random.default_rng(3)
FREE, EVEN, SLUGGISH = (elastic.felt(2.0, damping) for damping in (0.15, 1.0, 3.0))
numbers = st.floats(-3, 3)
springs = st.builds(elastic.felt, st.floats(0.05, 60), st.one_of(st.floats(0, 5), st.just(1.0)), st.floats(0.01, 100))


def size(values):
    return np.abs(values).max()


def moments(fps, seconds=3.0):
    return np.arange(round(seconds * fps) + 1) / fps


def dance(joints=5, poses=7):
    """Postures every twelfth of a second or a few of them."""
    times = np.cumsum(RNG.integers(1, 6, poses)) / 12
    return times - times[0], RNG.normal(size=(poses, joints, 3))


@pytest.mark.parametrize("damping", [0.0, 0.2, 0.999999, 1.0, 1.000001, 4.0])
def test_a_step_is_what_the_equation_says(damping):
    """Against SciPy's integrator, with the equation written out as in the paper."""
    own = elastic.felt(1.7, damping, 0.6)
    m, c, k = own.inertia, own.damping, own.stiffness
    target, slope, torque = 0.8, -0.5, 2.0

    def rate(t, y):
        return [y[1], (k * (target + slope * t) + torque - c * y[1] - k * y[0]) / m]

    at = np.linspace(0, 2, 9)
    truth = solve_ivp(rate, (0, 2), [-0.4, 3.0], t_eval=at, rtol=1e-10, atol=1e-12).y
    ours = elastic.step(own, State(np.full((1, 1), -0.4), np.full((1, 1), 3.0)), at, target, slope, torque)
    assert ours.turns[:, 0, 0] == pytest.approx(truth[0], abs=1e-7)
    assert ours.speed[:, 0, 0] == pytest.approx(truth[1], abs=1e-6)


@pytest.mark.parametrize("play", [elastic.towards, elastic.along, elastic.through])
@pytest.mark.parametrize("own", [FREE, EVEN, SLUGGISH])
def test_the_motion_is_the_same_at_12_and_240_frames_a_second(play, own):
    times, targets = dance()
    slow, quick = (play(own, moments(fps), times, targets) for fps in (12, 240))
    assert size(slow.turns) > 0.5
    assert size(slow.turns - quick.turns[::20]) < 1e-9
    assert size(slow.speed - quick.speed[::20]) < 1e-9


def test_a_torque_that_is_held_gives_the_same_motion_at_12_and_240_frames_a_second():
    times, targets = dance()
    torque = 40 * RNG.normal(size=(37, 5, 3))
    slow = elastic.towards(FREE, moments(12), times, targets, None, torque)
    quick = elastic.towards(FREE, moments(240), times, targets, None, np.repeat(torque, 20, axis=0)[: 36 * 20 + 1])
    assert size(slow.turns - elastic.towards(FREE, moments(12), times, targets).turns) > 0.05
    assert size(slow.turns - quick.turns[::20]) < 1e-9


def test_played_in_one_go_is_stepped_frame_by_frame():
    times, targets = dance()
    at, state = moments(24), elastic.still(targets[0])
    played = elastic.towards(FREE, at, times, targets).turns
    for frame in range(len(at) - 1):
        now = targets[np.searchsorted(times, at[frame] + 1e-9) - 1]
        state = elastic.step(FREE, state, 1 / 24, now)
        assert size(state.turns - played[frame + 1]) < 1e-9


@settings(max_examples=60, deadline=None)
@given(st.floats(1.0, 40.0), st.floats(0.1, 20), numbers)
def test_with_a_damping_of_1_or_more_nothing_overshoots_from_rest(damping, frequency, far):
    own = elastic.felt(frequency, damping)
    turns = elastic.step(own, elastic.still(np.zeros((1, 1))), np.linspace(0, 8, 400), far).turns.ravel()
    assert (np.diff(np.abs(turns)) >= -1e-12).all() and np.abs(turns).max() <= abs(far) + 1e-12


def test_with_less_it_overshoots_by_what_textbooks_say():
    turns = elastic.step(FREE, elastic.still(np.zeros((1, 1))), np.linspace(0, 2, 20001), 1.0).turns
    assert turns.max() - 1 == pytest.approx(np.exp(-np.pi * 0.15 / np.sqrt(1 - 0.15**2)), abs=1e-6)


@settings(max_examples=80, deadline=None)
@given(springs, st.lists(numbers, min_size=2, max_size=2), st.floats(1e-3, 2))
def test_energy_never_grows_without_input(own, begin, seconds):
    state = State(np.full((1, 1), begin[0]), np.full((1, 1), 10 * begin[1]))
    held = elastic.energy(own, state)
    for _ in range(20):
        state = elastic.step(own, state, seconds, 0.0)
        now = elastic.energy(own, state)
        assert now <= held * (1 + 1e-9) + 1e-12
        held = now


def test_without_damping_energy_stays():
    own = elastic.felt(3.0, 0.0)
    state = State(np.full((1, 1), 0.4), np.full((1, 1), -1.0))
    later = elastic.step(own, state, 100.0, 0.0)
    assert elastic.energy(own, later) == pytest.approx(elastic.energy(own, state), rel=1e-9)


@settings(max_examples=60, deadline=None)
@given(springs)
def test_what_is_felt_and_what_is_computed_with_say_the_same(own):
    again = elastic.felt(elastic.frequency_of(own), elastic.damping_of(own), own.inertia)
    for name in ("inertia", "damping", "stiffness"):
        assert getattr(again, name) == pytest.approx(getattr(own, name), rel=1e-9)


def test_clumsier_is_slower_stiffer_is_quicker_and_wilder_swings_longer():
    plain = elastic.felt(2.0, 0.5)
    for change, quick, calm in (({"clumsy": 1}, 0.5, 0.5), ({"stiff": 1}, 2.0, 0.5), ({"wild": 1}, 1.0, 0.25)):
        changed = elastic.styled(plain, **change)
        assert elastic.frequency_of(changed) == pytest.approx(2.0 * quick)
        assert elastic.damping_of(changed) == pytest.approx(0.5 * calm)
        back = elastic.styled(changed, **{name: -amount for name, amount in change.items()})
        assert [back.inertia, back.damping, back.stiffness] == [
            pytest.approx(float(own)) for own in (plain.inertia, plain.damping, plain.stiffness)
        ]


def test_each_joint_has_a_spring_of_its_own():
    several = elastic.felt([1.0, 2.0, 5.0], [0.2, 1.0, 2.0])
    times, targets = dance(3)
    together = elastic.towards(several, moments(24), times, targets).turns
    for joint, (frequency, damping) in enumerate(((1.0, 0.2), (2.0, 1.0), (5.0, 2.0))):
        alone = elastic.towards(elastic.felt(frequency, damping), moments(24), times, targets[:, joint : joint + 1])
        assert size(together[:, joint] - alone.turns[:, 0]) < 1e-12


def test_a_change_while_it_plays_goes_on_from_where_it_was():
    """Half the way with one spring, then another: no jump in place or speed, and then the other's motion."""
    state = elastic.step(FREE, elastic.still(np.zeros((1, 1))), 0.2, 1.0)
    stiffer = elastic.styled(FREE, stiff=1, clumsy=-0.5)
    soon = elastic.step(stiffer, state, 1e-7, 1.0)
    assert size(soon.turns - state.turns) < 1e-5 and size(soon.speed - state.speed) < 1e-3
    split = elastic.step(stiffer, elastic.step(stiffer, state, 0.3, 1.0), 0.4, 1.0)
    assert split.turns == pytest.approx(elastic.step(stiffer, state, 0.7, 1.0).turns, abs=1e-12)
    carried = elastic.towards(
        stiffer, moments(24, 1), np.zeros(1), np.ones((1, 1, 3)), State(*(np.full((1, 3), a) for a in (0.3, 5.0)))
    )
    assert carried.turns[0] == pytest.approx(0.3) and carried.speed[0] == pytest.approx(5.0)


@pytest.mark.parametrize("own", [elastic.felt(0.3, 0.2), FREE, EVEN, SLUGGISH, elastic.felt(15.0, 0.6)])
def test_through_is_in_each_posture_at_its_time_and_its_speed_does_not_jump(own):
    times, targets = dance()
    assert size(elastic.through(own, times, times, targets).turns - targets) < 1e-7
    for moment in times[1:-1]:
        around = elastic.through(own, moment + np.array([-1e-7, 1e-7]), times, targets)
        assert size(np.diff(around.speed, axis=0)) < 0.01
        assert size(np.diff(around.turns, axis=0)) < 1e-4


def test_soft_springs_pass_through_postures_as_cubics_do():
    """With next to no spring a force that changes evenly is all there is: Hermite's cubic, the animator's ease."""
    own = elastic.felt(1e-3, 0.0)
    turns = elastic.through(
        own,
        np.array([0.0, 0.25, 0.5, 1.0]),
        np.array([0.0, 1.0]),
        np.array([0.0, 1.0])[:, None, None] * np.ones((2, 1, 3)),
    ).turns
    u = np.array([0.0, 0.25, 0.5, 1.0])
    assert turns[:, 0, 0] == pytest.approx(3 * u**2 - 2 * u**3, abs=1e-4)


@pytest.mark.parametrize("bpm", [60, 100, 140, 180])
@pytest.mark.parametrize(("frequency", "damping"), [(1, 0.3), (2, 0.2), (2, 0.5), (3, 0.4), (6, 0.3)])
def test_through_postures_it_swings_over_no_further_than_free_springs_do(bpm, frequency, damping):
    """Whatever the tempo: e^(-pi z / sqrt(1 - z^2)) of the move, from the largest speed some more."""
    own = elastic.felt(frequency, damping)
    times = np.arange(12) * 60 / bpm
    targets = np.random.default_rng(1).uniform(-1, 1, (12, 9, 3))
    at = np.arange(0, times[-1], 1 / 96)
    turns = elastic.through(own, at, times, targets).turns
    now = np.minimum(np.searchsorted(times, at, side="right") - 1, 10)
    low, high = np.minimum(targets[now], targets[now + 1]), np.maximum(targets[now], targets[now + 1])
    over = np.maximum(turns - high, low - turns).max()
    assert over < 1.2 * np.exp(-np.pi * damping / np.sqrt(1 - damping**2)) * (high - low).max()


def test_through_postures_it_waits_in_the_first_and_stays_in_the_last():
    times, targets = dance()
    found = elastic.through(FREE, np.array([-1.0, times[-1] + 5]), times, targets).turns
    assert found[0] == pytest.approx(targets[0]) and found[1] == pytest.approx(targets[-1], abs=1e-6)


@pytest.mark.parametrize("damping", [0.1, 0.5, 0.7, 1.0, 2.0])
def test_after_its_arrival_a_joint_stays_within_the_share(damping):
    own = elastic.felt(3.0, damping)
    seconds = float(elastic.arrival(own, 0.05))
    after = elastic.step(own, elastic.still(np.zeros((1, 1))), seconds + np.linspace(0, 3, 2000), 1.0).turns
    before = elastic.step(own, elastic.still(np.zeros((1, 1))), 0.97 * seconds, 1.0).turns
    assert np.abs(after - 1).max() <= 0.0502
    assert abs(before.item() - 1) > 0.05


def test_targets_that_go_evenly_are_followed_with_an_even_lag():
    """A ramp is followed c / k seconds late."""
    own = elastic.felt(2.0, 0.8)
    times, targets = np.array([0.0, 10.0]), np.array([0.0, 20.0])[:, None, None] * np.ones((2, 1, 3))
    late = elastic.along(own, np.array([0.0, 9.0]), times, targets)
    assert late.turns[1] == pytest.approx(2.0 * (9.0 - own.damping / own.stiffness), abs=1e-6)
    assert late.speed[1] == pytest.approx(2.0, abs=1e-6)


@pytest.mark.parametrize("play", [elastic.towards, elastic.along, elastic.through])
def test_one_frame_or_one_posture_is_enough(play):
    times, targets = dance()
    assert play(FREE, times[:1], times, targets).turns[0] == pytest.approx(targets[0])
    still = play(FREE, moments(12), times[:1], targets[:1])
    assert still.turns == pytest.approx(np.tile(targets[0], (37, 1, 1))) and size(still.speed) < 1e-9


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Elastic(0.0, 1.0, 1.0), "inertia of an elastic joint must be above 0, got 0"),
        (lambda: Elastic([1.0, -2.0], 1.0, 1.0), "inertia of an elastic joint must be above 0, got -2"),
        (lambda: Elastic(1.0, -0.1, 1.0), "damping of an elastic joint must be 0 or more, got -0.1"),
        (lambda: Elastic(1.0, 1.0, 0.0), "stiffness of an elastic joint must be above 0, got 0"),
        (lambda: Elastic(1.0, np.nan, 1.0), "damping of an elastic joint must be 0 or more, got nan"),
        (lambda: elastic.felt(0.0), "frequency of an elastic joint must be above 0"),
        (lambda: elastic.felt(2.0, -0.5), "damping of an elastic joint must be 0 or more"),
        (lambda: elastic.towards(FREE, moments(12), [], np.zeros((0, 2, 3))), "must be one or more"),
        (
            lambda: elastic.towards(FREE, moments(12), [0, 0], np.zeros((2, 2, 3))),
            "times of postures must be finite and rise",
        ),
        (lambda: elastic.through(FREE, moments(12), [0, 1], np.full((2, 2, 3), np.inf)), "must be finite numbers"),
        (lambda: elastic.arrival(elastic.felt(2.0, 0.0)), "never arrives"),
        (lambda: elastic.arrival(FREE, 0.0), "between 0 and 1"),
    ],
)
def test_bad_input_is_refused(make, said):
    with pytest.raises(InputError, match=said):
        make()
