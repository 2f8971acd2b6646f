"""Laws of springs, their equation integrated by SciPy, and that the frame rate does not matter."""

from itertools import pairwise
from time import thread_time

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from capture.errors import InputError
from mocap.rubber import followthrough

CHAIN = (-1, 0, 1, 2, 0, 4)  # a root, and two arms that hang on it
REST = np.array([[0, 0, 0], [0.3, 0, 0], [0.6, 0, 0], [0.9, 0.1, 0], [-0.3, 0.1, 0], [-0.6, 0.2, 0.1]])


def swinging(t):
    """Anchors (T, 6, 3) that swing below 2 Hz, further at the tips, for moments t (T,) in seconds."""
    t = np.asarray(t, float)[:, None]
    far = np.linalg.norm(REST, axis=1)
    x = 0.15 * far * np.sin(2 * np.pi * 1.9 * t + far)
    y = 0.3 * far * np.cos(2 * np.pi * 1.1 * t) + 0.05 * np.sin(2 * np.pi * 0.7 * t)
    return REST + np.stack([x, y, 0.1 * far * np.sin(2 * np.pi * 1.5 * t)], axis=-1)


def moments(fps, seconds=2.0):
    return np.arange(round(seconds * fps) + 1) / fps


def size(away):
    return np.abs(away).max()


def test_springs_do_what_their_equation_says():
    """Against SciPy's integrator: the equation written out again, on the formula instead of on frames."""
    omega, zeta, links = 2 * np.pi * 2.2, 0.25, 1.5
    pairs = [(c, p) for c, p in enumerate(CHAIN) if p >= 0]

    def rate(t, state):
        step = 1e-4
        early, anchor, late = swinging([t - step, t, t + step])
        goes = (late - early) / (2 * step)
        x, v = state.reshape(2, 6, 3)
        a = -(omega**2) * (x - anchor) - 2 * zeta * omega * (v - goes)
        for c, p in pairs:
            along, rest = x[c] - x[p], anchor[c] - anchor[p]
            d, l = np.linalg.norm(along), np.linalg.norm(rest)
            faster = along @ (v[c] - v[p]) / d - rest @ (goes[c] - goes[p]) / l
            force = -(links * omega**2 * (d - l) + 2 * zeta * np.sqrt(links) * omega * faster) * along / d
            a[c], a[p] = a[c] + force, a[p] - force
        return np.concatenate([v.ravel(), a.ravel()])

    at = moments(60, 1.0)
    slope = (swinging([1e-5]) - swinging([-1e-5]))[0] / 2e-5
    start = np.concatenate([swinging([0])[0].ravel(), slope.ravel()])
    truth = solve_ivp(rate, (0, 1), start, t_eval=at, rtol=1e-6, atol=1e-7).y[:18].T.reshape(-1, 6, 3)
    ours = followthrough.follow(swinging(at), CHAIN, 60, 2.2, zeta, links, blend=1.0, preroll=0.0)
    assert size(truth - swinging(at)) > 0.05  # there is something to be right about
    assert size(ours - truth) < 0.01 * size(truth - swinging(at))


@pytest.mark.parametrize(("frequency", "damping"), [(1.5, 0.1), (2.5, 0.35), (6.0, 1.0), (20.0, 2.0)])
def test_the_motion_is_the_same_at_24_30_60_and_120_frames(frequency, damping):
    def at_twelfths(fps):
        """Every sixth of a second, which all rates have."""
        away, _ = followthrough.swing(swinging(moments(fps)), CHAIN, fps, frequency, damping, preroll=0.0)
        return away[:: fps // 6]

    truth = at_twelfths(960)
    for fps in (24, 30, 60, 120):
        assert size(at_twelfths(fps) - truth) < 0.01 * max(size(truth), 0.02), fps


def test_what_goes_at_one_speed_trails_nothing():
    straight = REST + moments(30)[:, None, None] * [1.5, -0.2, 3]
    away, speed = followthrough.swing(straight, CHAIN, 30, damping=0.8)
    assert size(away) < 1e-12 and size(speed) < 1e-10


def test_what_is_still_stays_still_even_hanging_in_a_heap():
    heap = np.zeros((20, 6, 3))
    np.testing.assert_array_equal(followthrough.follow(heap, CHAIN, 24), heap)


def test_without_end_to_its_stiffness_the_swing_is_gone():
    anchors = swinging(moments(60))
    sizes = [size(followthrough.swing(anchors, CHAIN, 60, f, preroll=0.0)[0]) for f in (2, 8, 32, 1e3, 1e6)]
    assert all(more > less for more, less in pairwise(sizes))
    assert sizes[2] < 0.02 * sizes[0] and sizes[-1] < 1e-9


@pytest.mark.parametrize("links", [0.0, 1.0, 30.0])
def test_energy_never_grows_without_input(links):
    """A jolt, then the anchors stand: what the springs hold and what moves, together, only gets less."""
    anchors = np.concatenate([np.tile(REST, (5, 1, 1)), np.tile(REST + [0.0, 0.2, 0.1], (400, 1, 1))])
    anchors[5:, 3] += [0.1, -0.1, 0]
    away, speed = (a[12:] for a in followthrough.swing(anchors, CHAIN, 120, 3.0, 0.08, links))
    x, k = anchors[-1] + away, (2 * np.pi * 3) ** 2
    energy = 0.5 * (speed**2).sum(axis=(1, 2)) + 0.5 * k * (away**2).sum(axis=(1, 2))
    for c, p in [(c, p) for c, p in enumerate(CHAIN) if p >= 0]:
        rest = np.linalg.norm(anchors[-1, c] - anchors[-1, p])
        energy += 0.5 * links * k * (np.linalg.norm(x[:, c] - x[:, p], axis=-1) - rest) ** 2
    assert energy[0] > 0.1 and energy[-1] < 0.01 * energy[0]
    assert np.diff(energy).max() < 2e-3 * energy[0]


def test_springs_without_damping_keep_their_energy():
    anchors = np.concatenate([np.tile(REST, (5, 1, 1)), np.tile(REST + [0.0, 0.2, 0.1], (2000, 1, 1))])
    away, speed = (a[12:] for a in followthrough.swing(anchors, CHAIN, 60, 2.0, 0.0, links=0.0))
    energy = (speed**2 + (4 * np.pi * away) ** 2).sum(axis=(1, 2))
    np.testing.assert_allclose(energy, energy[0], rtol=1e-9)


@settings(max_examples=30, deadline=None)
@given(
    st.floats(1e-3, 1e6),
    st.floats(0, 1e3),
    st.floats(0, 1e9),
    st.sampled_from([12, 24, 59.94, 120, 1000]),
    st.integers(0, 99),
)
@example(942.0, 0.0, 1.0, 24, 0)  # nearly half a round in each of the shortest steps
@example(120.0, 0.0, 1e-3, 24, 0)  # and of the usual ones
def test_no_stiffness_and_no_damping_is_too_great(frequency, damping, links, fps, seed):
    """White noise for anchors, links of no length: a step that is too long would grow without end."""
    anchors = np.random.default_rng(seed).normal(size=(40, 6, 3))
    anchors[:, 5] = anchors[:, 4]
    away, speed = followthrough.swing(anchors, CHAIN, fps, frequency, damping, links)
    assert np.isfinite(speed).all() and size(away) < 1e4  # the weakest springs let go


def test_machine_code_and_plain_numpy_agree():
    anchors = swinging(moments(24, 1.0))
    given = {"frequency": np.linspace(1, 9, 6), "damping": np.linspace(0.1, 2, 6), "links": 2.5}
    quick, plain = (followthrough.swing(anchors, CHAIN, 24, **given, compiled=yes) for yes in (True, False))
    for one, other in zip(quick, plain):
        np.testing.assert_allclose(one, other, atol=1e-9 * size(other), rtol=0)


@pytest.mark.parametrize("damping", [0.05, 0.4, 3.0])
def test_a_loop_stays_a_loop(damping):
    """Played twice over from a loop's own end it swings the same again, and as the loop does after many rounds."""
    t, travel = np.arange(24) / 24, np.array([0.4, 0, 0.1])
    far = np.linalg.norm(REST, axis=1)[:, None]
    wave = np.sin(2 * np.pi * t)[:, None, None] * far * [0.2, 0, 0.1] + np.cos(4 * np.pi * t)[:, None, None] * [
        0,
        0.1,
        0,
    ]
    once = REST + wave + t[:, None, None] * travel
    away, _ = followthrough.swing(once, CHAIN, 24, 2.0, damping, loop=True, travel=travel)
    often = np.concatenate([once + n * travel for n in range(40)])
    long, _ = followthrough.swing(often, CHAIN, 24, 2.0, damping, preroll=0.0)
    np.testing.assert_allclose(away, long[-72:-48], atol=1e-3 * size(away))  # the last round has an open end
    found, _ = followthrough.swing(once, CHAIN, 24, 2.0, damping, loop=True)
    np.testing.assert_allclose(found, away, atol=0.02 * size(away))  # how far it goes is not said


def test_a_swing_is_under_way_when_a_motion_begins_in_its_middle():
    anchors = swinging(moments(60))
    begun, _ = followthrough.swing(anchors, CHAIN, 60, preroll=1.0)
    fresh, _ = followthrough.swing(anchors, CHAIN, 60, preroll=0.0)
    assert size(fresh[0]) == 0 and size(begun[0]) > 0.1 * size(begun)


def test_roots_stay_and_tips_swing_most_unless_told_otherwise():
    anchors = swinging(moments(60))
    share = followthrough.reach(anchors, CHAIN)
    assert share[0] == 0 and share.max() == share[3] == 1 and (np.diff(share[:4]) > 0).all()
    default = followthrough.follow(anchors, CHAIN, 60)
    away, _ = followthrough.swing(anchors, CHAIN, 60)
    np.testing.assert_array_equal(default[:, 0], anchors[:, 0])
    np.testing.assert_allclose(default, anchors + share[:, None] * away)
    np.testing.assert_array_equal(followthrough.follow(anchors, CHAIN, 60, blend=0.0), anchors)


def test_it_turns_and_moves_with_the_motion():
    from scipy.spatial.transform import Rotation

    turn = Rotation.from_rotvec([0.4, -1, 0.3]).as_matrix().T
    anchors = swinging(moments(30))
    moved = followthrough.follow(anchors @ turn + [3, 1, -2], CHAIN, 30)
    np.testing.assert_allclose(moved, followthrough.follow(anchors, CHAIN, 30) @ turn + [3, 1, -2], atol=1e-12)


@pytest.mark.parametrize("frames", [1, 2, 3, 4, 5])
def test_short_motions_are_followed_too(frames):
    out = followthrough.follow(swinging(moments(24)[:frames]), CHAIN, 24)
    assert out.shape == (frames, 6, 3) and np.isfinite(out).all()


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"frequency": 0}, "frequency of a swing, in Hz, must be between 0.001"),
        ({"frequency": np.nan}, "frequency"),
        ({"damping": -0.1}, "damping of a swing must be between 0 and"),
        ({"damping": 0.0, "loop": True}, "that loops must be between 0.01"),
        ({"links": np.inf}, "stiffness of links"),
        ({"preroll": -1}, "pre-roll"),
        ({"parents": (-1, 0)}, "each of the 2 sub-joints"),
    ],
)
def test_what_cannot_swing_is_refused(given, said):
    with pytest.raises(InputError, match=said):
        followthrough.swing(**{"positions": swinging(moments(24)), "parents": CHAIN, "fps": 24, **given})


def test_a_frame_of_58_sub_joints_takes_less_than_a_twentieth_of_a_millisecond():
    parents = tuple(-1 if s == 0 else s - 1 if s % 10 else 0 for s in range(58))
    anchors = np.random.default_rng(3).normal(size=(58, 3)) + 0.1 * np.sin(moments(120, 8.0) * 9)[:, None, None]
    followthrough.follow(anchors[:9], parents, 120)
    times = []
    for _ in range(3):
        start = thread_time()
        followthrough.follow(anchors, parents, 120)
        times.append((thread_time() - start) / len(anchors))
    assert min(times) < 5e-5
