"""Laws of exaggeration: what it leaves alone, and what it may not do."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from capture.errors import InputError
from mocap.rubber import exaggerate

FORMS = [exaggerate.exaggerated, exaggerate.extrapolated]


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("loop", [False, True])
def test_omega_1_changes_nothing(form, loop):
    walk = _swinging()
    np.testing.assert_allclose(form(walk, 60, omega=1, loop=loop), walk, atol=1e-15)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("count", [1, 2, 3, 7, 200])
@pytest.mark.parametrize("omega", [0.0, 2.0, 5.0, 50.0])
def test_a_straight_path_at_one_speed_stays_for_every_omega(form, count, omega):
    """Clips that are shorter than the filter too: nothing is known of what was before and after but the path."""
    start, speed = np.array([[3.0, 1, -2]]), np.array([[1.3, -0.4, 0.02]])
    path = start + np.arange(count)[:, None, None] / 60 * speed
    np.testing.assert_allclose(form(path, 60, omega=omega), path, atol=1e-12)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10_000), st.floats(1, 20), st.floats(0, 0.6), st.integers(3, 60))
def test_eq_1_never_shortens_a_link(seed, omega, sigma, count):
    """Links of any length, turned at will; in a loop, where no frame is reflected at an end."""
    rng = np.random.default_rng(seed)
    links = rng.normal(size=(count, 4, 3))
    links *= rng.uniform(0.1, 2, (1, 4, 1)) / np.linalg.norm(links, axis=-1, keepdims=True)
    links[:, 0] = 0  # the root stays: in a loop travel is told by it
    pushed = exaggerate.extrapolated(np.cumsum(links, axis=1), 30, omega, sigma, loop=True)
    lengths = np.linalg.norm(np.diff(pushed, axis=1), axis=-1)
    assert (lengths >= np.linalg.norm(links[:, 1:], axis=-1) * (1 - 1e-9)).all()


def test_eq_1_shortens_no_link_away_from_the_ends_of_a_clip():
    turned = np.random.default_rng(3).normal(size=(200, 2, 3))
    turned /= np.linalg.norm(turned, axis=-1, keepdims=True)
    turned[:, 0] = 0
    pushed = exaggerate.extrapolated(turned, 60, sigma=0.1)
    assert np.linalg.norm(pushed[40:-40, 1] - pushed[40:-40, 0], axis=-1).min() >= 1 - 1e-6


def test_the_average_is_the_sum_that_eq_2_says():
    """By hand: weights, and frames that are reflected oddly as often as the filter reaches beyond an end."""
    curve = np.random.default_rng(0).normal(size=(9, 1, 3)).cumsum(axis=0)
    width = 0.4 * 10
    reach = np.arange(-30, 31)
    weights = np.exp(-(reach**2) / (2 * width**2))
    average = [sum(w * _beyond(curve, t + i) for w, i in zip(weights / weights.sum(), reach)) for t in range(9)]
    by_hand = 5 * curve - 4 * np.array(average)
    np.testing.assert_allclose(exaggerate.extrapolated(curve, 10, 5, 0.4), by_hand, atol=1e-6)
    over_time = exaggerate.extrapolated(curve, 10, 5, np.full((9, 1), 0.4))
    np.testing.assert_allclose(over_time, by_hand, atol=1e-6)


def test_a_wave_is_made_as_much_larger_as_the_formula_says():
    """A Gaussian leaves exp(-(2 pi f sigma)^2 / 2) of a wave of f Hz; so the exaggerated wave is known."""
    fps, hertz = 120, 1.5
    wave = np.sin(2 * np.pi * hertz * np.arange(480) / fps)[:, None, None] * np.ones(3)
    gain = lambda seconds: np.exp(-((2 * np.pi * hertz * seconds) ** 2) / 2)  # noqa: E731
    paper = exaggerate.extrapolated(wave, fps, 5, 0.15, loop=True)
    np.testing.assert_allclose(paper, (1 + 4 * (1 - gain(0.15))) * wave, atol=1e-7)
    ours = exaggerate.exaggerated(wave, fps, 5, 0.15, loop=True)
    np.testing.assert_allclose(ours, (1 + 4 * (gain(0.04) - gain(0.15))) * wave, atol=1e-7)


def test_noise_is_not_exaggerated():
    """Trembling is told by its jerk, the third differences over time."""
    clean = _swinging(count=400)
    noise = 0.002 * np.random.default_rng(1).normal(size=clean.shape)
    trembling = lambda form: np.diff(form(clean + noise, 60) - form(clean, 60), 3, axis=0).std()  # noqa: E731
    assert trembling(exaggerate.exaggerated) < 1.05 * np.diff(noise, 3, axis=0).std()
    assert trembling(exaggerate.extrapolated) > 4.9 * np.diff(noise, 3, axis=0).std()


@pytest.mark.parametrize("fps", [30, 60])
def test_the_frame_rate_does_not_matter_where_calm_is_given(fps):
    slow, quick = (_swinging(count=1 + 4 * rate, fps=rate) for rate in (fps, 120))
    few = exaggerate.exaggerated(slow, fps, calm=0.05)
    many = exaggerate.exaggerated(quick, 120, calm=0.05)[:: 120 // fps]
    # one link's way is some 0.5 m; the frames just before an end know of the end alone
    np.testing.assert_allclose(few, many, atol=0.004)


def test_each_joint_and_frame_may_have_its_own_amount():
    walk = _swinging()
    ones, fives = exaggerate.exaggerated(walk, 60, 1), exaggerate.exaggerated(walk, 60, 5)
    own = exaggerate.exaggerated(walk, 60, np.array([1, 5, 5.0]))
    np.testing.assert_allclose(own[:, 0], ones[:, 0])
    np.testing.assert_allclose(own[:, 1:], fives[:, 1:])
    later = np.where(np.arange(len(walk)) < 60, 1.0, 5.0)[:, None]
    pushed = exaggerate.exaggerated(walk, 60, later)
    np.testing.assert_allclose(pushed[:60], ones[:60])
    np.testing.assert_allclose(pushed[60:], fives[60:])
    both = exaggerate.exaggerated(walk, 60, sigma=np.array([0.1, 0.15, 0.3]))
    np.testing.assert_allclose(both[:, 2], exaggerate.exaggerated(walk, 60, sigma=0.3)[:, 2])
    sigmas = np.tile([0.1, 0.15, 0.3], (len(walk), 1))
    np.testing.assert_allclose(exaggerate.exaggerated(walk, 60, sigma=sigmas), both, atol=1e-7)


def test_a_link_of_omega_1_is_carried_along_by_its_parent():
    walk = _swinging()
    pushed = exaggerate.exaggerated(walk, 60, np.array([5.0, 5, 1]), parents=(-1, 0, 1))
    np.testing.assert_allclose(pushed[:, 2] - pushed[:, 1], walk[:, 2] - walk[:, 1], atol=1e-12)
    np.testing.assert_allclose(pushed[:, :2], exaggerate.exaggerated(walk, 60)[:, :2], atol=1e-12)
    same = exaggerate.exaggerated(walk, 60, np.full(3, 5.0), parents=(-1, 0, 1))
    np.testing.assert_allclose(same, exaggerate.exaggerated(walk, 60), atol=1e-12)


def test_a_loop_stays_a_loop_on_the_spot_and_along_a_way():
    fps, count = 60, 72
    step = 2 * np.pi * np.arange(3 * count) / count
    cycle = np.stack([0.3 * np.sin(step), 0.1 * np.cos(2 * step), 0.2 * np.cos(step)], axis=-1)[:, None]
    for travel in (0.0, 1.2 / count):
        thrice = cycle + travel * np.arange(3 * count)[:, None, None] * np.array([1.0, 0, 0])
        once = exaggerate.exaggerated(thrice[:count], fps, loop=True)
        middle = exaggerate.exaggerated(thrice, fps, loop=True)[count : 2 * count]
        np.testing.assert_allclose(once + count * travel * np.array([1.0, 0, 0]), middle, atol=1e-5)


@pytest.mark.parametrize(
    "wrong", [{"omega": np.ones(4)}, {"omega": np.nan}, {"sigma": -0.1}, {"sigma": np.ones((2, 3))}, {"calm": np.inf}]
)
def test_what_cannot_be_an_amount_is_refused(wrong):
    with pytest.raises(InputError, match=next(iter(wrong))):
        exaggerate.exaggerated(_swinging(), 60, **wrong)


def _beyond(curve, t):
    if t < 0:
        return 2 * curve[0] - _beyond(curve, -t)
    if t >= len(curve):
        return 2 * curve[-1] - _beyond(curve, 2 * (len(curve) - 1) - t)
    return curve[t]


def _swinging(count=120, fps=60):
    """A walking hip, a shoulder above it and a hand that swings (T, 3, 3) m."""
    seconds = np.arange(count) / fps
    hip = np.stack([1.2 * seconds, 0.9 + 0.03 * np.sin(10 * seconds), 0 * seconds], axis=-1)
    angle = 0.9 * np.sin(5 * seconds)
    hand = 0.6 * np.stack([np.sin(angle), -np.cos(angle), 0.2 * np.sin(3 * seconds)], axis=-1)
    shoulder = hip + np.array([0, 0.5, 0])
    return np.stack([hip, shoulder, shoulder + hand], axis=1)
