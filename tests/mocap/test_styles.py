"""Styles by formula keep the feet where they stand, and the paper's experiments hold for figures by formula."""

import numpy as np
import pytest

from fixtures import skeletons
from mocap.analogy import experiments, styles
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion


def motion_of(figure):
    return SkeletonMotion(
        Skeleton(figure.names, figure.parents, figure.offsets), figure.translation, figure.rotation, figure.fps
    )


FIGURE = skeletons.walk(seconds=3.0)
WALK, KICK = motion_of(FIGURE), motion_of(skeletons.kick(seconds=2.5))
HIPS, HEAD, TOES = 0, FIGURE.joint("Head"), [FIGURE.joint("LeftToeBase"), FIGURE.joint("RightToeBase")]


def test_who_crouches_is_lower_and_stands_where_he_stood():
    low = styles.crouched(WALK, lower=0.15)
    np.testing.assert_allclose(low.positions()[:, TOES], FIGURE.positions[:, TOES], atol=2e-3)
    np.testing.assert_allclose(low.positions()[:, HIPS, 1], FIGURE.positions[:, HIPS, 1] - 0.15, atol=1e-9)
    np.testing.assert_array_equal(low.translation[:, 1:], WALK.translation[:, 1:])


def test_who_steps_aside_goes_to_his_left_and_does_not_skate():
    aside = styles.aside(WALK, share=0.5)
    places = aside.positions()
    np.testing.assert_allclose(
        places[-1, HIPS, 0], 0.5 * (FIGURE.positions[-1, HIPS, 2] - FIGURE.positions[0, HIPS, 2])
    )
    assert np.abs(places[:, HIPS, 2] - places[0, HIPS, 2]).max() < 1e-9
    both = FIGURE.stands[1:] & FIGURE.stands[:-1]
    assert np.linalg.norm(np.diff(places[:, TOES], axis=0), axis=-1)[both].mean() * 60 < 0.05


def test_who_is_drunk_is_slower_and_sways():
    drunk = styles.drunk(WALK, slower=1.25)
    assert len(drunk) == pytest.approx(1.25 * len(WALK), abs=1)
    assert np.ptp(drunk.positions()[:, HEAD, 0]) > 0.2 > np.ptp(FIGURE.positions[:, HEAD, 0])


def test_a_motion_at_another_pace_goes_the_same_way():
    fast = styles.sped(WALK, 1.5)
    assert len(fast) == round((len(WALK) - 1) / 1.5) + 1
    np.testing.assert_allclose(fast.positions()[-1], FIGURE.positions[-1], atol=0.02)


def test_a_rhythm_makes_another_motion_faster_and_leaves_its_content():
    found = experiments.rhythm(styles.sped(WALK, 1 / 1.3), styles.sped(WALK, 1.3), KICK)
    assert len(found.made) == pytest.approx(len(KICK) / 1.3**2, rel=0.02)
    high = [motion.positions()[:, TOES[1], 1].max() for motion in (KICK, found.made)]
    assert high[1] == pytest.approx(high[0], abs=0.03)


def test_a_crouch_lowers_a_kick_whose_standing_foot_stays():
    found = experiments.style(WALK, styles.crouched(WALK), KICK)
    cards = found.cards()
    assert cards["B'"].skate <= cards["B"].skate + 0.5 < cards["B' before feet"].skate
    before, after = KICK.positions(), found.made.positions()
    np.testing.assert_allclose(after[:, HIPS, 1] - before[:, HIPS, 1], -0.15, atol=0.03)
    assert after[:, TOES[0], 1].min() > -0.02 and np.abs(after[:, TOES[0], 1] - before[:, TOES[0], 1]).max() < 0.02
