"""A figure whose metres are known, told in other units and with other axes up, comes back as it was."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from fixtures import skeletons
from mocap.bodies.body import find_body
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion
from mocap.skeletons.units import upright

WALK = skeletons.walk(seconds=1.5, fps=20.0)
MOTION = SkeletonMotion(Skeleton(WALK.names, WALK.parents, WALK.offsets), WALK.translation, WALK.rotation, WALK.fps)
UNITS = {"metres": 1.0, "centimetres": 100, "millimetres": 1000, "inches": 1 / 0.0254, "5.64 cm": 0.45 / 0.0254}


def _in_units(motion, factor):
    skeleton = replace(motion.skeleton, offsets=factor * motion.skeleton.offsets)
    return replace(motion, skeleton=skeleton, translation=factor * motion.translation)


def _turned(motion, turn, rest_too):
    """The motion in a space that is turned: the roots alone, or all joints and the rest pose with them."""
    joints = range(len(motion.skeleton)) if rest_too else [0]
    offsets, translation, rotation = motion.skeleton.offsets.copy(), motion.translation.copy(), motion.rotation.copy()
    for joint in joints:
        offsets[joint], translation[:, joint] = turn.apply(offsets[joint]), turn.apply(translation[:, joint])
        turned = turn * Rotation.from_quat(rotation[:, joint])
        rotation[:, joint] = (turned * turn.inv() if rest_too else turned).as_quat()
    skeleton = replace(motion.skeleton, offsets=offsets)
    return replace(motion, skeleton=skeleton, translation=translation, rotation=rotation)


@pytest.mark.parametrize("unit", UNITS)
def test_lengths_in_any_unit_become_metres_and_it_is_said(unit):
    motion = upright(_in_units(MOTION, UNITS[unit]))
    np.testing.assert_allclose(motion.positions(), WALK.positions, atol=1e-9)
    np.testing.assert_allclose(motion.skeleton.offsets, WALK.offsets, atol=1e-9)
    assert motion.notes == () if unit == "metres" else unit in motion.notes[0] and "1.71 m tall" in motion.notes[0]


@pytest.mark.parametrize(
    ("degrees", "axis", "rest_too"),
    [(90, "z", True), (90, "z", False), (-90, "-z", True), (-90, "-z", False), (180, "-y", True)],
)
def test_whatever_is_up_becomes_y(degrees, axis, rest_too):
    """Turned about x, such that z or a negative axis is up; in some files the rest pose with it, in some not."""
    turn = Rotation.from_euler("x", degrees, degrees=True)
    motion = upright(_turned(MOTION, turn, rest_too))
    np.testing.assert_allclose(motion.positions(), WALK.positions, atol=1e-9)
    np.testing.assert_allclose(motion.skeleton.offsets, WALK.offsets, atol=1e-9)
    assert len(motion.notes) == 1 and f"its {axis} axis was up" in motion.notes[0]


def test_who_faces_another_way_faces_it_still():
    turn = Rotation.from_euler("y", 70, degrees=True)
    motion = upright(_turned(MOTION, turn, rest_too=False))
    np.testing.assert_allclose(motion.positions()[:, 5], turn.apply(WALK.positions[:, 5]), atol=1e-9)


def test_what_is_upright_stays_as_it_is():
    once = upright(_in_units(_turned(MOTION, Rotation.from_euler("x", 90, degrees=True), True), 100.0))
    twice = upright(once)
    np.testing.assert_array_equal(twice.translation, once.translation)
    assert twice.notes == once.notes and len(once.notes) == 2


def test_a_sleeper_is_not_stood_up():
    """It lies along z on the floor, y up."""
    stands = skeletons.kick(seconds=0.9)
    skeleton = Skeleton(stands.names, stands.parents, stands.offsets)
    standing = SkeletonMotion(skeleton, stands.translation, stands.rotation, stands.fps)
    motion = upright(_turned(standing, Rotation.from_euler("x", 90, degrees=True), rest_too=False))
    assert np.ptp(motion.positions()[..., 1]) < 0.5 and np.ptp(motion.positions()[..., 2]) > 1.2
    assert "never stands upright; y was taken" in motion.notes[0]


def test_a_handstand_is_one():
    motion = upright(_turned(MOTION, Rotation.from_euler("z", 180, degrees=True), rest_too=False))
    assert motion.notes == () and (motion.positions()[:, 5, 1] < motion.positions()[:, 0, 1]).all()


def test_a_person_of_no_known_unit_is_made_as_tall_as_people_are():
    motion = upright(_in_units(MOTION, 7.0))
    factor = motion.positions()[0, 0, 1] / WALK.positions[0, 0, 1]
    assert "no unit" in motion.notes[0]
    np.testing.assert_allclose(motion.positions(), factor * WALK.positions, atol=1e-9)
    assert motion.positions()[0, WALK.joint("Head end"), 1] == pytest.approx(1.6, abs=0.1)


@pytest.mark.parametrize(("factor", "unit"), [(1.0, None), (100.0, "centimetres"), (1000.0, "millimetres")])
def test_a_rope_has_a_unit_too(factor, unit):
    offsets = factor * np.tile([0.3, 0, 0], (5, 1))
    still = np.tile([0, 0, 0, 1.0], (2, 5, 1))
    rope = SkeletonMotion(Skeleton(tuple("abcde"), (-1, 0, 1, 2, 3), offsets), np.tile(offsets, (2, 1, 1)), still, 25)
    motion = upright(rope)
    np.testing.assert_allclose(motion.positions(), rope.positions() / factor, atol=1e-9)
    assert any("no legs" in note for note in motion.notes) and (unit is None or unit in " ".join(motion.notes))


def test_joints_in_one_place_are_no_trouble():
    dot = SkeletonMotion(Skeleton(("a",), (-1,), np.zeros((1, 3))), np.zeros((1, 1, 3)), np.eye(4)[None, 3:], 25)
    assert "one place" in upright(dot).notes[-1]


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=60, deadline=None)
def test_whatever_hangs_together_somehow_is_set_upright_once(seed):
    """Any tree of joints, under names that mean something or nothing: no part has another's joint, once is enough."""
    rng = np.random.default_rng(seed)
    joints, frames = rng.integers(1, 14), rng.integers(1, 12)
    lowest = np.where(rng.random(joints) < 0.1, -1, np.maximum(np.arange(joints) - 3, 0))
    parents = (-1, *(int(rng.integers(lowest[joint], joint)) for joint in range(1, joints)))
    words = [
        "LeftLeg",
        "RightLeg",
        "LeftArm",
        "RightArm",
        "Hips",
        "Spine",
        "Head",
        "Tail",
        "LeftFoot",
        "RightToe",
        "LeftHand",
        "Neck",
        "LeftHandThumb",
        "x",
    ]
    offsets = rng.normal(size=(joints, 3)) * 10.0 ** rng.integers(-3, 4) * (rng.random((joints, 1)) < 0.8)
    moved = (rng.random((joints, 1)) < 0.3) * rng.normal(size=(frames, joints, 3)) * np.abs(offsets).max()
    turns = Rotation.random(frames * joints, rng=rng).as_quat().reshape(frames, joints, 4)
    skeleton = Skeleton(tuple(rng.choice(words, joints).tolist()), parents, offsets)
    motion = upright(SkeletonMotion(skeleton, offsets + moved, turns, 30.0))
    parts = find_body(motion.skeleton, motion.positions()).parts
    held = [joint for part in parts.values() for joint in part]
    assert len(held) == len(set(held)) and all(0 <= joint < joints for joint in held)
    np.testing.assert_allclose(upright(motion).translation, motion.translation, atol=1e-12)
