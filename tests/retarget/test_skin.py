"""A skinned arm in a file written here from the specification; where its points go is worked out by hand."""

from dataclasses import replace

import numpy as np
import pytest

from capture.errors import InputError
from retarget.characters.figures.skin import Pose, read_skin, sampled, skinned
from retarget.characters.models.meshfiles import read_model


def turned(points, angle, about):
    """Points (N, 3) turned about the z axis through a place."""
    c, s = np.cos(angle), np.sin(angle)
    return (points - about) @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1.0]]) + about


def at_rest(skin, frames=1):
    return Pose(
        *(np.repeat(a[None], frames, axis=0) for a in (skin.rest.translation, skin.rest.rotation, skin.rest.scale))
    )


def test_at_rest_a_figure_is_where_it_was_bound(arm):
    skin, model = read_skin(arm.file), read_model(arm.file)
    np.testing.assert_allclose(model.points, arm.points, atol=1e-6)
    np.testing.assert_allclose(skinned(skin, model.points, at_rest(skin))[0], arm.points, atol=1e-6)
    assert np.asarray(skin.shares.sum(axis=1)).ravel() == pytest.approx(np.ones(len(arm.points)))


def test_a_bent_elbow_takes_the_forearm_and_what_hangs_on_it(arm):
    skin, model = read_skin(arm.file), read_model(arm.file)
    pose = sampled(skin, "wave", np.array([0.0, 0.5, 2.0]))
    moved = skinned(skin, model.points, pose)
    for points, angle in zip(moved, np.radians([0, 45, 180]), strict=True):
        bent = turned(arm.points, angle, arm.elbow)
        there = arm.share[:, None] * bent + (1 - arm.share[:, None]) * arm.points
        np.testing.assert_allclose(points, there, atol=1e-5)


def test_joints_come_after_those_they_hang_on(arm):
    skin = read_skin(arm.file)
    assert all(parent < joint for joint, parent in enumerate(skin.parents))
    assert skin.parents[skin.index("elbow")] == skin.index("shoulder")


def test_steps_hold_and_cubic_splines_meet_their_values(arm):
    times = np.array([0.0, 0.6, 1.0, 1.7])
    stepped = sampled(read_skin(arm.written(interpolation="STEP")), "wave", times).rotation[:, 3]
    angles = 2 * np.arctan2(stepped[:, 2], stepped[:, 3])
    assert angles == pytest.approx(np.radians([0, 0, 90, 90]), abs=1e-6)
    curved = sampled(read_skin(arm.written(interpolation="CUBICSPLINE")), "wave", times).rotation[:, 3]
    angles = 2 * np.arctan2(curved[:, 2], curved[:, 3])
    assert angles[[0, 2]] == pytest.approx(np.radians([0, 90]), abs=1e-6)
    assert 0.5 < angles[1] < 1.2
    assert np.linalg.norm(curved, axis=1) == pytest.approx(np.ones(4))


def test_a_file_without_a_skin_has_none(tmp_path):
    (tmp_path / "bare.gltf").write_text('{"asset": {"version": "2.0"}}')
    assert read_skin(tmp_path / "bare.gltf") is None


def test_a_broken_skin_or_an_unknown_animation_is_refused(arm):
    with pytest.raises(InputError, match="the skin in the file is missing something"):
        read_skin(arm.written(joints=[0, 99]))
    with pytest.raises(InputError, match="'jump' is none of them: wave"):
        sampled(read_skin(arm.file), "jump", np.zeros(1))
    with pytest.raises(InputError, match="'knee' is none of"):
        replace(read_skin(arm.file)).index("knee")
