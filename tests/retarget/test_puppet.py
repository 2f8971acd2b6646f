"""A jointed figure mixes its joints, not its points; the arm's places are worked out by hand."""

from dataclasses import replace

import numpy as np
import pytest

from capture.errors import InputError
from capture.motion import affine
from retarget.characters.casts.cast import targets
from retarget.characters.casts.castfile import read_cast, write_cast
from retarget.characters.figures.puppet import KeyPose, read_puppet
from retarget.characters.figures.skin import skinned
from retarget.characters.models.meshfiles import read_model
from retarget.stage.perform import perform


def unaligned(puppet, weights):
    return skinned(puppet.skin, puppet.rest, puppet.posture(np.asarray(weights, float)))


def bend(arm, points):
    """By how far (T,) the forearm's tip, bound to the elbow alone, has turned about it, in degrees."""
    tip = int(np.flatnonzero(arm.share == 1)[-4])  # of the strip, not the hand
    way, rest = points[:, tip] - arm.elbow, arm.points[tip] - arm.elbow
    assert np.linalg.norm(way, axis=1) == pytest.approx(np.linalg.norm(rest), abs=1e-5)  # it never shrinks
    angle = np.degrees(np.arctan2(way[:, 1], way[:, 0]) - np.arctan2(rest[1], rest[0]))
    return (angle + 1) % 360 - 1


def waving(arm, *times, **changes):
    names = tuple("abcd"[: len(times)])
    return read_puppet("egg", names, arm.file, [KeyPose("wave", t) for t in times], **changes)


def test_all_weight_on_a_key_shows_the_key(arm):
    puppet = waving(arm, 0.0, 0.4, 0.9)
    shown = puppet.acted(np.eye(3))
    np.testing.assert_allclose(shown, puppet.keys.points, atol=1e-9)
    np.testing.assert_allclose(affine.apply(puppet.keys.removed, shown), unaligned(puppet, np.eye(3)), atol=1e-9)
    assert bend(arm, unaligned(puppet, np.eye(3))) == pytest.approx([0, 36, 81], abs=1e-3)


def test_an_arm_swings_round_instead_of_shrinking_through_the_elbow(arm):
    puppet = waving(arm, 0.0, 1.9)
    halfway = [[1, 0], [0.5, 0.5], [0.25, 0.75]]
    assert bend(arm, unaligned(puppet, halfway)) == pytest.approx([0, 85.5, 128.25], abs=1e-3)
    np.testing.assert_allclose(puppet.shapes(np.array([[0, 1, 0.75]])), puppet.acted(np.array([[0.25, 0.75]])))


def test_more_than_two_keys_mix_at_once_and_beyond_0_and_1(arm):
    puppet = waving(arm, 0.0, 1.0, 0.5)
    weights = [[0.5, 0.2, 0.3], [-0.2, 1.2, 0.0], [1.3, 0.0, -0.3]]
    assert bend(arm, unaligned(puppet, weights)) == pytest.approx([31.5, 108, 360 - 13.5], abs=1e-3)


def test_a_joint_goes_the_way_round_that_its_animation_goes(arm):
    puppet = waving(arm, 0.0, 3.0)  # three quarters of a turn
    assert bend(arm, unaligned(puppet, [[2 / 3, 1 / 3], [0, 1]])) == pytest.approx([90, 270], abs=1e-3)


def test_joints_turn_by_angles_given_in_the_cast_past_half_a_turn_too(arm):
    poses = [KeyPose(), KeyPose(turns={"elbow": (0, 0, 270)}), KeyPose("wave", 1.0, {"elbow": (0, 0, -30)})]
    puppet = read_puppet("egg", ("a", "b", "c"), arm.file, poses)
    weights = [[0, 1, 0], [0.5, 0.5, 0], [0, 0, 1], [0.5, 0, 0.5]]
    assert bend(arm, unaligned(puppet, weights)) == pytest.approx([270, 135, 60, 30], abs=1e-3)


def test_the_captured_affine_acts_on_the_whole_figure(arm, by_hand):
    """Under an affine map each posed figure is that map of the figure that does not move."""
    maps = by_hand.tumble(4)
    weights = [[1 - s, s] for s in (0, 0.3, 0.6, 1)]
    motion, still = (by_hand.motion(place, np.zeros((4, 7)) + [1, *[0] * 6]) for place in (maps, by_hand.still(4)))

    def weighed(motion):
        track = motion.tracks[0]
        rows = np.zeros_like(track.weights)
        for k in (0, 1):
            rows[:, np.flatnonzero((track.rows == [k, k, 0]).all(axis=1))[0]] = np.array(weights)[:, k]
        return replace(motion, tracks=(replace(track, weights=rows),))

    puppet = read_puppet("egg", by_hand.names, arm.file, [KeyPose("wave", 0.0), KeyPose("wave", 0.7)])
    moved, stood = (perform(weighed(m), [puppet]).roles[0] for m in (motion, still))
    assert np.ptp(stood.points[0, :, 1]) == pytest.approx(100)  # as tall as the egg
    for t in range(4):
        plain = affine.about(maps[t], motion.tracks[0].pivot)
        np.testing.assert_allclose(moved.points[t, :, :2], affine.apply(plain, stood.points[t, :, :2]), atol=1e-6)
        np.testing.assert_allclose(moved.points[t, :, 2], stood.points[t, :, 2], atol=1e-9)


def test_a_cast_names_the_poses(arm, by_hand, tmp_path):
    file = tmp_path / "arm.cast.toml"
    file.write_text(
        '[[parts]]\nname = "egg"\ndrawing = "arm.gltf"\n[[parts.keys]]\nname = "sit"\nanimation = "wave"\ntime = 0.5\n'
        '[[parts.keys]]\nname = "lean"\njoints = { elbow = [0, 0, 200.0] }\n'
    )
    motion = by_hand.motion(by_hand.still(2), [[1.0], [1.0]])
    cast = read_cast(file)
    puppet = targets(cast, motion)[0]
    assert bend(arm, unaligned(puppet, np.eye(2))) == pytest.approx([45, 200], abs=1e-3)
    write_cast(cast, tmp_path / "again.cast.toml")
    assert read_cast(tmp_path / "again.cast.toml") == cast
    things = perform(motion, [puppet]).posed(0)
    assert things[0].points.shape == read_model(arm.file).points.shape


def test_poses_that_are_not_there_are_refused(arm, worm):
    for pose, said in (
        (KeyPose("jump"), "'jump' is none of them: wave"),
        (KeyPose("wave", 7.0), "lasts 3.00 s, it is asked at 7 s"),
        (KeyPose(turns={"knee": (0, 0, 1)}), "'knee' is none of"),
        (KeyPose(turns={"elbow": (1.0,)}), "three angles in degrees"),
    ):
        with pytest.raises(InputError, match=said):
            read_puppet("egg", ("a",), arm.file, [pose])
    with pytest.raises(InputError, match="must be a GLB or glTF with a skin, or a BVH"):
        read_puppet("egg", ("a",), worm[0], [KeyPose()])
