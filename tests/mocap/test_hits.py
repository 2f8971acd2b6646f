"""Hits are found where they are, and met."""

import numpy as np
import pytest

from fixtures import skeletons
from mocap.bodies.body import Body, find_body
from mocap.rubber import hits, rubber
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion

FPS = 60.0


def kicking():
    figure = skeletons.kick(3.0, FPS)
    skeleton = Skeleton(figure.names, figure.parents, figure.offsets)
    return SkeletonMotion(skeleton, figure.translation, figure.rotation, FPS), figure


def boxing(times, seconds=4.0, quick=0.12, back=0.12):
    """A shoulder, an elbow and a hand that goes out to 0.6 m at each of `times` and comes back, along x; (T, 3, 3)."""
    t = np.arange(round(seconds * FPS)) / FPS
    out = np.full(len(t), 0.25)
    for hit in times:
        width = np.where(t < hit, quick, back)
        out = np.maximum(out, 0.25 + 0.35 * np.exp(-0.5 * ((t - hit) / width) ** 2))
    places = np.zeros((len(t), 3, 3))
    places[:, 2, 0] = out
    places[:, 1, 0], places[:, 1, 1] = 0.5 * out, -np.sqrt(np.maximum(0.31**2 - 0.25 * out**2, 0))
    return places, Body({"right arm": (0, 1, 2)}, (), (2,), np.array(["right arm"] * 3), "")


def test_punches_are_found_where_the_arm_is_longest():
    places, body = boxing([1.0, 1.9, 3.1])
    assert hits.find_hits(places, body, FPS) == ((2, 60), (2, 114), (2, 186))


@pytest.mark.parametrize("how", [{"quick": 0.6}, {"back": 3.0}])
def test_an_arm_that_goes_out_slowly_or_stays_there_hits_nothing(how):
    places, body = boxing([2.0], **how)
    assert hits.find_hits(places, body, FPS) == ()


def test_a_kick_is_one_hit_by_its_ankle_and_a_walk_is_none():
    motion, figure = kicking()
    ((joint, frame),) = hits.find_hits(figure.positions, find_body(motion.skeleton, figure.positions), FPS)
    middle = (skeletons.KICK[0] + skeletons.KICK[1] / 2) * FPS
    assert figure.names[joint] == "RightFoot" and abs(frame - middle) <= 2
    walk = skeletons.walk()
    skeleton = Skeleton(walk.names, walk.parents, walk.offsets)
    assert hits.find_hits(walk.positions, find_body(skeleton, walk.positions), walk.fps) == ()


def test_what_was_hit_is_hit_and_the_wind_up_stays_exaggerated():
    motion, figure = kicking()
    foot = figure.joint("RightFoot")
    free, made = (rubber.make_rubber(motion, 5, follow=0.5, hits=it) for it in ((), [(foot, 84)]))
    end = made.subjoints.ends[foot]
    assert np.linalg.norm(free.positions[84, end] - figure.positions[84, foot]) > 0.1
    np.testing.assert_allclose(made.positions[84, end], figure.positions[84, foot], atol=1e-4)
    far = np.abs(np.arange(len(motion)) - 84) > hits.BLEND * FPS
    np.testing.assert_allclose(made.positions[far], free.positions[far], atol=1e-12)
    others = [s for s in range(len(made.subjoints)) if "Left" in made.subjoints.names()[s]]
    np.testing.assert_allclose(made.positions[:, others], free.positions[:, others], atol=1e-12)


def test_several_hits_of_both_hands_are_met_in_their_frames():
    motion, figure = kicking()
    hands = [(figure.joint("LeftHand"), 70), (figure.joint("RightHand"), 78), (figure.joint("LeftHand"), 90)]
    made = rubber.make_rubber(motion, 5, hits=hands)
    for joint, frame in hands:
        np.testing.assert_allclose(
            made.positions[frame, made.subjoints.ends[joint]], figure.positions[frame, joint], atol=1e-4
        )
