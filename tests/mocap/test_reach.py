"""Limbs turn until their ends are where they must be, and no bone stretches."""

import numpy as np
import pytest

from mocap.bodies.reach import reached
from mocap.rubber.constrain import Goal, easing


def joint(motion, name):
    return motion.skeleton.names.index(name)


def lengths(motion):
    places = motion.positions()
    parents = np.array(motion.skeleton.parents)
    return np.linalg.norm(places[:, 1:] - places[:, parents[1:]], axis=-1)


def test_a_hand_gets_where_it_can_get(stroll):
    motion = stroll(seconds=1.0)
    hand = joint(motion, "right hand")
    places = motion.positions()[:, hand] + [0.1, 0.15, 0.1]
    after = reached(motion, [Goal(hand, places, np.ones(len(motion)))], 0)
    np.testing.assert_allclose(after.positions()[:, hand], places, atol=1e-4)
    np.testing.assert_allclose(lengths(after), lengths(motion), atol=1e-9)
    others = [k for k, name in enumerate(motion.skeleton.names) if "right" not in name or "arm" in name]
    legs = [k for k in others if any(word in motion.skeleton.names[k] for word in ("hip", "knee", "foot"))]
    np.testing.assert_array_equal(after.rotation[:, legs], motion.rotation[:, legs])


def test_a_goal_where_the_joint_is_changes_nothing(stroll):
    motion = stroll(seconds=1.0)
    foot = joint(motion, "left foot")
    after = reached(motion, [Goal(foot, motion.positions()[:, foot], np.ones(len(motion)))], 0)
    np.testing.assert_array_equal(after.rotation, motion.rotation)


def test_a_goal_out_of_reach_stretches_the_limb_towards_it(stroll):
    motion = stroll(seconds=0.5)
    foot, hip = joint(motion, "left foot"), joint(motion, "left hip")
    far = motion.positions()[:, hip] + [1.5, -1.5, 0]
    after = reached(motion, [Goal(foot, far, np.ones(len(motion)))], 0, rounds=60)
    way = after.positions()[:, foot] - after.positions()[:, hip]
    assert (np.linalg.norm(way, axis=1) > 0.87).all()  # of 0.9
    towards = (way / np.linalg.norm(way, axis=1)[:, None]) @ (np.array([1, -1, 0]) / np.sqrt(2))
    assert (towards > 0.95).all()


def test_goals_come_and_go_without_a_jump(stroll):
    motion = stroll(seconds=2.0)
    foot = joint(motion, "left foot")
    there = motion.positions()[:, foot] + [0.02, 0.05, 0]
    frames = np.zeros(len(motion), bool)
    frames[50:70] = True
    after = reached(motion, [Goal(foot, there, easing(frames, 60.0))], 0)
    np.testing.assert_allclose(after.positions()[50:70, foot], there[50:70], atol=1e-4)
    shift = after.positions()[:, foot] - motion.positions()[:, foot]
    assert np.abs(np.diff(shift, axis=0)).max() < 0.05 * np.pi / 2 / 6 * 1.1
    np.testing.assert_array_equal(after.rotation[:40], motion.rotation[:40])


def test_a_joint_prefers_the_axis_it_turns_about(stroll):
    """The knee of a walk bends about x; asked for a step aside, hip and knee leave most of it to the hip."""
    motion = stroll(seconds=2.0, turning=0.0)
    foot, knee = joint(motion, "left foot"), joint(motion, "left knee")
    places = motion.positions()[:, foot] + [0, 0.08, 0.0]
    after = reached(motion, [Goal(foot, places, np.ones(len(motion)))], 0)
    assert np.abs(after.positions()[:, foot] - places).max() < 0.02
    bend = np.abs(after.rotation[:, knee, 1:3]).max()
    assert bend == pytest.approx(0, abs=0.02)
