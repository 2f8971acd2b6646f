"""Legs turn until feet stand where they were captured."""

from dataclasses import replace

import numpy as np

from fixtures import skeletons
from mocap.bodies.planted import planted
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion


def walking():
    figure = skeletons.walk(3.0, 60.0)
    skeleton = Skeleton(figure.names, figure.parents, figure.offsets)
    motion = SkeletonMotion(skeleton, figure.translation, figure.rotation, figure.fps)
    feet = [figure.joint("LeftToeBase"), figure.joint("RightToeBase")]
    return figure, motion, feet


def test_what_stands_already_stays_as_it_is():
    figure, motion, feet = walking()
    made = planted(motion, figure.positions, feet, figure.stands)
    np.testing.assert_allclose(made.positions(), figure.positions, atol=1e-4)


def test_feet_are_brought_back_under_hips_that_bob_too_much_and_bones_keep_their_lengths():
    figure, motion, feet = walking()
    translation = motion.translation.copy()
    translation[:, 0, 1] += 0.12 * np.sin(np.arange(len(motion)) / 9)
    translation[:, 0, 2] += 0.03 * np.cos(np.arange(len(motion)) / 7)
    bobbing = replace(motion, translation=translation)
    made = planted(bobbing, figure.positions, feet, figure.stands)
    for foot, joint in enumerate(feet):
        off = np.linalg.norm(made.positions()[:, joint] - figure.positions[:, joint], axis=1)[figure.stands[:, foot]]
        assert off.max() < 2e-3
    lengths = np.linalg.norm(made.translation[:, 1:], axis=-1)
    np.testing.assert_allclose(lengths, np.broadcast_to(bones_of(figure), lengths.shape), atol=1e-9)
    down = made.translation[:, 0, 1] - translation[:, 0, 1]
    assert down.max() < 1e-9 and down.min() < -0.01


def test_without_contacts_it_is_the_same_motion():
    figure, motion, feet = walking()
    assert planted(motion, figure.positions, feet, np.zeros((len(motion), 2), bool)) is motion


def bones_of(figure):
    return np.linalg.norm(figure.offsets[1:], axis=1)
