"""A report card of motions whose faults are known because they were put in."""

import numpy as np
import pytest

from fixtures import skeletons
from mocap.report import jerk, report, skate
from mocap.rubber.rubber import RubberMotion
from mocap.rubber.subjoints import SubJoints
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion

WALK = skeletons.walk(seconds=3.0)
MOTION = SkeletonMotion(Skeleton(WALK.names, WALK.parents, WALK.offsets), WALK.translation, WALK.rotation, WALK.fps)
TIMES = np.arange(len(WALK.positions)) / WALK.fps


def test_a_faultless_walk_has_a_faultless_card():
    card = report(MOTION)
    assert (card.frames, card.joints, card.fps) == (180, 31, 60) and card.tall == pytest.approx(1.71, abs=0.01)
    assert card.stands == pytest.approx(WALK.stands.mean(), abs=0.01)
    assert card.skate == pytest.approx(0, abs=0.2) and card.kept == 1 and card.jerk == 1  # cm/s
    assert card.stretch == pytest.approx((1, 1, 1)) and card.volume == pytest.approx((1, 1)) and card.penetration == 0


def test_feet_that_slide_skate():
    slid = WALK.positions + 0.1 * TIMES[:, None, None] * np.array([0.6, 0, 0.8])
    card = report(MOTION, slid)
    assert card.skate == pytest.approx(10, abs=0.3) and card.kept == 1  # cm/s; slow enough to be standing still
    assert card.jerk == pytest.approx(1) and card.stretch == pytest.approx((1, 1, 1))
    np.testing.assert_allclose(skate(slid[:, :1], np.ones((180, 1), bool), 60), 100 * np.hypot(0.06, 1.1 + 0.08))


def test_feet_that_lift_lose_their_contacts():
    lifted = WALK.positions + [0, 0.1, 0]
    lifted[:90] -= [0, 0.1, 0]
    assert report(MOTION, lifted).kept == pytest.approx(WALK.stands[:90].sum() / WALK.stands.sum(), abs=0.02)


def test_larger_is_jerkier_and_longer_in_proportion():
    card = report(MOTION, 1.5 * WALK.positions)
    assert card.jerk == pytest.approx(1.5) and card.stretch == pytest.approx((1.5, 1.5, 1.5))
    assert card.volume == pytest.approx((1.5, 1.5))


def test_jerk_is_the_third_derivative():
    places = np.zeros((50, 1, 3))
    places[:, 0, 1] = 7 * (np.arange(50) / 25) ** 3
    assert jerk(places, 25.0) == pytest.approx(42)


def test_limbs_that_go_through_each_other_are_told():
    crossed = WALK.positions.copy()
    left, right = (WALK.joint(f"{side}ForeArm") for side in ("Left", "Right"))
    crossed[:, left : left + 5] = crossed[:, right : right + 5]
    assert report(MOTION, crossed).penetration > 2  # cm


def _rubber(stretch):
    """An arm of two links of 1 m along x, each cut into two; pulled to `stretch` times its length, as thick as it is."""
    skeleton = Skeleton(("shoulder", "elbow", "hand"), (-1, 0, 1), np.array([[0, 0, 0], [1.0, 0, 0], [1.0, 0, 0]]))
    still = np.tile([0, 0, 0, 1.0], (len(stretch), 3, 1))
    source = SkeletonMotion(skeleton, np.tile(skeleton.offsets, (len(stretch), 1, 1)), still, 60.0)
    joint, along = np.array([0, 1, 1, 2, 2]), np.array([1, 0.5, 1, 0.5, 1])
    cut = SubJoints(skeleton, (-1, 0, 1, 2, 3), joint, along, np.array([0, 2, 4]), ())
    ratio = np.tile(stretch[:, None], (1, 5))
    places = np.zeros((len(stretch), 5, 3))
    places[..., 0] = stretch[:, None] * np.arange(5) / 2
    return RubberMotion(source, cut, places, np.tile(still[:, :1], (1, 5, 1)), ratio, 1 / np.sqrt(ratio))


def test_rubber_keeps_its_volume_where_it_is_as_much_thinner():
    made = _rubber(np.linspace(0.8, 1.6, 200))
    card = report(made.source, made, seconds=0.01)
    assert card.stretch == pytest.approx((0.808, 1.2, 1.592)) and card.volume == pytest.approx((1, 1))
    assert card.joints == 5 and card.ms_per_frame == pytest.approx(0.05)
    assert np.isnan(card.stands) and np.isnan(card.skate) and np.isnan(card.kept)


def test_hips_that_move_on_a_root_that_stays_are_no_stretched_link():
    names, parents = ("root", *WALK.names), (-1, *(parent + 1 for parent in WALK.parents))
    still = np.zeros((180, 1, 3)), np.tile([0, 0, 0, 1.0], (180, 1, 1))
    skeleton = Skeleton(names, parents, np.concatenate([np.zeros((1, 3)), WALK.offsets]))
    translation = np.concatenate([still[0], WALK.translation], axis=1)
    motion = SkeletonMotion(skeleton, translation, np.concatenate([still[1], WALK.rotation], axis=1), 60.0)
    assert report(motion).stretch == pytest.approx((1, 1, 1))


def test_the_card_says_what_it_measured():
    text = "\n".join(report(MOTION, WALK.positions, seconds=0.009).lines())
    for said in (
        "180 frames at 60 a second, 31 joints and ends, 1.71 m tall",
        "100 % kept",
        "1.00 times as captured",
        "0.050 ms",
    ):
        assert said in text
    captured = "\n".join(report(MOTION).lines(captured=True))
    assert "skating" in captured and "kept" not in captured and "jerk" not in captured
    rope = _rubber(np.ones(4))
    assert "feet" not in "\n".join(report(rope.source, rope).lines())
