"""Joint angles are filtered without a link being stretched, and without regard to which way a figure faces."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mocap.curves import filters, joint_filters
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion

ARM = Skeleton(("shoulder", "elbow", "hand"), (-1, 0, 1), np.array([[0, 1.4, 0], [0.3, 0, 0], [0.25, 0, 0]]))


def waving(fps=60, seconds=3.0, faces=0.0):
    """An arm that swings about one axis, and bends in the elbow about another."""
    t = np.arange(round(seconds * fps)) / fps
    shoulder = Rotation.from_euler("Y", faces) * Rotation.from_rotvec(
        np.outer(np.sin(2 * np.pi * 1.2 * t), [0, 0, 0.9])
    )
    elbow = Rotation.from_rotvec(np.outer(0.8 + 0.5 * np.cos(2 * np.pi * 1.2 * t), [0, 0.6, 0.8]))
    rest = np.tile([0, 0, 0, 1.0], (len(t), 1))
    rotation = np.stack([shoulder.as_quat(), elbow.as_quat(), rest], axis=1)
    return SkeletonMotion(ARM, np.tile(ARM.offsets, (len(t), 1, 1)), rotation, fps)


BOTH = (
    lambda motion: joint_filters.cartoon_angles(motion, 1.0, 0.1, follow=0.08),
    lambda motion: joint_filters.exaggerated_angles(motion, 3.0, 0.15),
)


@pytest.mark.parametrize("change", BOTH)
def test_links_keep_their_lengths(change):
    places = change(waving()).positions()
    lengths = np.linalg.norm(np.diff(places, axis=1), axis=-1)
    np.testing.assert_allclose(lengths, np.tile([0.3, 0.25], (len(lengths), 1)), atol=1e-12)
    assert np.abs(places - waving().positions()).max() > 0.05


@pytest.mark.parametrize("change", BOTH)
def test_a_figure_that_faces_elsewhere_moves_the_same(change):
    turn = Rotation.from_euler("Y", 2.9)
    here, there = change(waving()).positions(), change(waving(faces=2.9)).positions()
    pivot = np.array([0, 1.4, 0])
    np.testing.assert_allclose((here - pivot) @ turn.as_matrix().T + pivot, there, atol=1e-9)


@pytest.mark.parametrize("change", BOTH)
def test_what_turns_on_at_one_speed_or_not_at_all_is_unchanged(change):
    motion = waving()
    spin = np.outer(np.arange(len(motion)) * 0.11, [0.6, 0, 0.8])  # three rounds
    steady = motion.rotation.copy()
    steady[:, 0] = Rotation.from_rotvec(spin).as_quat()
    steady[:, 1] = steady[40, 1]
    motion = SkeletonMotion(ARM, motion.translation, steady, motion.fps)
    np.testing.assert_allclose(change(motion).positions(), motion.positions(), atol=1e-9)


def test_about_one_axis_it_is_the_filter_on_the_angle():
    motion = waving()
    angle = 0.9 * np.sin(2 * np.pi * 1.2 * np.arange(len(motion)) / 60)
    wanted = filters.cartoon(angle[:, None], 60, 1.3, 0.12)[:, 0]
    ours = Rotation.from_quat(joint_filters.cartoon_angles(motion, 1.3, 0.12).rotation[:, 0]).as_rotvec()
    np.testing.assert_allclose(ours, np.outer(wanted, [0, 0, 1]), atol=1e-9)


def test_turns_laid_out_and_put_on_again_are_the_turns():
    turns = Rotation.random(1, random_state=3) * Rotation.from_rotvec(
        np.cumsum(np.random.default_rng(1).normal(0, 0.2, (60, 3)), axis=0)
    )
    rotations = turns.as_quat()[:, None] * np.random.default_rng(2).choice([-1, 1], (60, 1, 1))
    steps = np.diff(joint_filters.developed(rotations), axis=0)
    again = joint_filters.turned(rotations[:-1], steps)
    assert (Rotation.from_quat(again[:, 0]).inv() * turns[1:]).magnitude().max() < 1e-9


def test_the_hand_comes_later_than_the_shoulder():
    """Against the same filter without `follow`, what is added to the elbow is late by its share of the way."""
    motion, late = waving(), 0.1
    share = joint_filters.depth(ARM)
    np.testing.assert_allclose(share, [0, 0.3 / 0.55, 1])
    plain, behind = (joint_filters.cartoon_angles(motion, 1.0, 0.1, follow=f) for f in (0.0, late))
    np.testing.assert_allclose(plain.rotation[:, 0], behind.rotation[:, 0], atol=1e-12)
    t = np.arange(len(motion)) / 60
    start = Rotation.from_quat(motion.rotation[:, 1]).inv()
    added = [(start * Rotation.from_quat(m.rotation[:, 1])).as_rotvec() @ [0, 0.6, 0.8] for m in (plain, behind)]
    shifted = np.interp(t - late * share[1], t, added[0])
    np.testing.assert_allclose(added[1][40:-40], shifted[40:-40], atol=0.01 * np.abs(added[0]).max())


def test_a_loop_of_turns_stays_a_loop():
    motion, long = waving(60, 2.5), waving(60, 7.5)  # three swings, exactly, and nine
    for change, given in ((joint_filters.cartoon_angles, (1.0, 0.1)), (joint_filters.exaggerated_angles, (3.0, 0.1))):
        theirs = change(long, *given).positions()[150:300]
        np.testing.assert_allclose(change(motion, *given, loop=True).positions(), theirs, atol=1e-6)


def test_a_root_that_walks_straight_walks_straight_on():
    motion = waving()
    way = motion.translation.copy()
    way[:, 0] += np.arange(len(motion))[:, None] * [0.02, 0, 0.01]
    walking = SkeletonMotion(ARM, way, motion.rotation, 60)
    for change in BOTH:
        np.testing.assert_allclose(change(walking).translation, way, atol=1e-9)
