"""Analogies of captured cartoons: the same laws, on affine motion and key weights."""

from dataclasses import replace

import numpy as np
import pytest

from capture.errors import InputError
from capture.motion import keys
from capture.motion.tracks import CartoonMotion, Track, trim
from fixtures import ball
from mocap.analogy.analogy import Knobs
from mocap.analogy.cartoons import cartoon_analogy, of_cartoon, to_cartoon

BALL = 20 * np.stack([[np.cos(a), np.sin(a)] for a in np.linspace(0, 2 * np.pi, 24, endpoint=False)])


def bouncing(height=100.0, count=3, squash=0.3, travel=200.0, frames=97, name="ball"):
    """A ball that bounces: flat where it lands, long where it is quick, its second key mixed in at the top."""
    keyset = keys.keyset(("round", "egg"), np.stack([BALL + 100, BALL * [1, 1.4] + 100]), spacing=12.0)
    t = np.linspace(0, 1, frames)
    air = np.abs(np.sin(np.pi * count * t))
    stretch = 1 - squash * np.exp(-((air / 0.25) ** 2))
    maps = np.zeros((frames, 2, 3))
    maps[:, 0, 0], maps[:, 1, 1] = 1 / stretch, stretch
    maps[:, 0, 2], maps[:, 1, 2] = travel * t, -height * air
    weights = np.zeros((frames, len(keyset.rows)))
    first, second = (np.flatnonzero((keyset.rows[:, 0] == k) & (keyset.rows[:, 2] == 0))[0] for k in (0, 1))
    weights[:, second] = 0.8 * air
    weights[:, first] += 1 - weights.sum(axis=1)
    still = {"residual": np.zeros(frames), "visible": np.ones(frames, bool), "held": np.zeros(frames, bool)}
    pivot = np.array([100.0, 100.0])
    order = np.zeros(frames, int)
    track = Track(name, "", pivot, keyset.names, keyset.rows, maps, weights, **still, order=order)
    return CartoonMotion((track,), (keyset,), np.arange(frames) / 24, 24.0, (640, 480))


def test_curves_tell_a_cartoon():
    motion = bouncing()
    back = to_cartoon(of_cartoon(motion), np.arange(97.0), motion)
    np.testing.assert_allclose(back.tracks[0].affine, motion.tracks[0].affine, atol=1e-9)
    np.testing.assert_allclose(back.tracks[0].weights, motion.tracks[0].weights, atol=1e-12)


def test_the_two_laws():
    one, two = bouncing(), bouncing(height=180, squash=0.5, frames=81)
    made, _ = cartoon_analogy(one, two, one)
    assert len(made.times) == 81
    off = np.linalg.norm(made.points("ball") - two.points("ball"), axis=-1)
    assert np.median(off) < 1.0 and np.percentile(off, 95) < 8  # a landing takes two frames
    made, _ = cartoon_analogy(one, one, two)
    np.testing.assert_allclose(made.points("ball"), two.points("ball"), atol=0.05)


def test_a_bounce_gets_the_height_and_the_squash_of_another():
    """Twice as high and flatter; B has other bounces, twice as far apart, and another name."""
    one, two = bouncing(squash=0.2), bouncing(height=200, squash=0.5)
    three = bouncing(height=60, squash=0.2, travel=500, name="sack")
    made, _ = cartoon_analogy(one, two, three, Knobs(time=False))
    track = made.track("sack")
    assert -track.affine[:, 1, 2].min() == pytest.approx(120, rel=0.05)
    assert track.affine[:, 1, 1].min() == pytest.approx(0.5, abs=0.05)
    assert track.affine[-1, 0, 2] == pytest.approx(500, rel=0.02)
    np.testing.assert_allclose(track.weights.sum(axis=1), 1, atol=1e-9)


def rubbery():
    """The fixtures' ball: four bounces, each lower; it spins, is long in flight and flat where it lands."""
    toon = ball.ball()
    part = toon.parts[0]
    keyset = keys.keyset(part.key_names, part.points[part.key_frames], spacing=12.0)
    frames = len(part.affine)
    still = {"residual": np.zeros(frames), "visible": np.ones(frames, bool), "held": np.zeros(frames, bool)}
    weights, order = np.ones((frames, len(keyset.rows))), np.zeros(frames, int)
    track = Track("ball", "", part.pivot, keyset.names, keyset.rows, part.affine, weights, **still, order=order)
    return CartoonMotion((track,), (keyset,), np.arange(frames) / 24, 24.0, (640, 480))


def stiff(motion):
    """The motion with nothing of it stretched: every map with the turn alone."""
    maps = motion.tracks[0].affine.copy()
    u, _, vt = np.linalg.svd(maps[:, :, :2])
    maps[:, :, :2] = u @ vt
    return replace(motion, tracks=(replace(motion.tracks[0], affine=maps),))


def test_a_spinning_ball_is_told_and_squashed_along_the_page():
    motion = rubbery()
    back = to_cartoon(of_cartoon(motion, {"ball"}), np.arange(72.0), motion, {"ball"})
    np.testing.assert_allclose(back.tracks[0].affine, motion.tracks[0].affine, atol=1e-9)
    told = of_cartoon(motion, {"ball"})
    flat = told.values[:, told.named().index(("ball", "stretch y"))]
    assert {11, 33, 52} <= set(np.flatnonzero(flat < np.log(0.9)))  # where it lands, however far it has spun


def test_a_stiff_bounce_becomes_rubber_as_another_did():
    """A ball without squash : the fixtures' ball :: a sack that hops stiffly : ?  Three bounces each."""
    two, three = trim(rubbery(), 11, 69), bouncing(height=120, squash=0.0, travel=400, name="sack")
    one = stiff(two)
    made, _ = cartoon_analogy(one, two, three, Knobs(time=False))
    track = made.track("sack")
    air = -three.track("sack").affine[:, 1, 2] / 120
    tall, wide = track.affine[:, 1, 1], track.affine[:, 0, 0]
    lands = np.flatnonzero((air[1:-1] < air[:-2]) & (air[1:-1] <= air[2:])) + 1
    assert (tall[lands] < 0.95).all() and (wide[lands] > 1.02).all()
    assert tall[air > 0.5].mean() > tall[lands].mean() + 0.1
    np.testing.assert_allclose(track.affine[:, 1, 2], three.track("sack").affine[:, 1, 2], atol=12)
    still, _ = cartoon_analogy(one, one, three)
    np.testing.assert_allclose(still.track("sack").affine, three.track("sack").affine, atol=1e-6)


def test_motions_in_space_are_refused():
    motion = bouncing()
    deep = replace(motion.tracks[0], affine=np.zeros((97, 3, 4)))
    with pytest.raises(InputError, match="motion in the plane"):
        cartoon_analogy(replace(motion, tracks=(deep,)), motion, motion)
