"""Feet that stand carry the body: a root of another speed is brought to theirs."""

from dataclasses import replace

import numpy as np
import pytest

from fixtures import skeletons
from mocap.analogy.carry import carried, shifted
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion

WALK = skeletons.walk(seconds=4.0)
FEET = [WALK.joint("LeftFoot"), WALK.joint("RightFoot")]


def walking(faster=0.0, aside=0.0):
    """The walk of the fixtures, whose feet stand still, with its root so many metres a second too fast."""
    motion = SkeletonMotion(Skeleton(WALK.names, WALK.parents, WALK.offsets), WALK.translation, WALK.rotation, WALK.fps)
    t = np.arange(len(motion)) / WALK.fps
    return shifted(motion, np.stack([aside * t, 0 * t, faster * t], axis=-1))


@pytest.mark.parametrize(("faster", "aside"), [(0.9, 0.0), (-0.6, 0.2)])
def test_the_body_goes_as_fast_as_its_feet_say(faster, aside):
    after = carried(walking(faster, aside), FEET, WALK.stands, 0.0)
    np.testing.assert_allclose(after.positions(), WALK.positions, atol=0.02)


def test_a_body_that_goes_with_its_feet_is_left_alone():
    motion = walking()
    np.testing.assert_array_equal(carried(motion, FEET, WALK.stands, 0.02).translation, motion.translation)
    wild = walking(faster=1.0)
    assert carried(wild, FEET, np.zeros_like(WALK.stands), 0.0) is wild


def test_in_flight_it_goes_on_as_before_and_after():
    """Nothing stands for half a second: there the speed is that of either side."""
    stands = WALK.stands.copy()
    stands[100:130] = False
    after = carried(walking(faster=0.9), FEET, stands, 0.0)
    np.testing.assert_allclose(after.positions()[:, 0, 2], WALK.positions[:, 0, 2], atol=0.03)


def test_hips_on_a_turned_root_are_carried_in_the_world():
    motion = walking()
    names = ("root", *motion.skeleton.names)
    parents = (-1, *(parent + 1 for parent in motion.skeleton.parents))
    skeleton = Skeleton(names, parents, np.concatenate([np.zeros((1, 3)), motion.skeleton.offsets]))
    still = np.zeros((len(motion), 1, 3))
    turn = np.tile([0, np.sqrt(0.5), 0, np.sqrt(0.5)], (len(motion), 1, 1))
    translation = np.concatenate([still, motion.translation], axis=1)
    rotation = np.concatenate([turn, motion.rotation], axis=1)
    turned = replace(motion, skeleton=skeleton, translation=translation, rotation=rotation)
    way = np.tile([0.3, 0.1, -0.2], (len(motion), 1))
    np.testing.assert_allclose(
        shifted(turned, way).positions()[:, 1:] - turned.positions()[:, 1:],
        np.tile(way[:, None], (1, 31, 1)),
        atol=1e-12,
    )
