"""A limb of rubber told by key poses is the same limb, and any cast can play it."""

import numpy as np
import pytest

from capture.errors import InputError
from capture.motion.tracks import check
from fixtures import stickman
from mocap.by_poses import by_key_poses, limb_outlines
from mocap.marks import Marks
from mocap.skeleton import Skeleton, SkeletonMotion
from mocap.to_tracks import to_tracks
from mocap.views import Views
from retarget.characters.drawing import outline_drawing
from retarget.stage.perform import perform

ARM = ("left_elbow", "left_hand")


@pytest.fixture(scope="module")
def lent():
    """An arm that swings round its shoulder and bends at its elbow."""
    phase = np.linspace(0, 2 * np.pi, 40)[:, None]
    turns = {"LeftArm": 0.8 * np.sin(phase) * (0, 0, 1), "LeftForeArm": (0.6 + 0.6 * np.cos(phase)) * (0, 0, 1)}
    motion = SkeletonMotion(Skeleton(*stickman.skeleton()), *stickman.moving(turns, 40))
    marks = Marks(*stickman.marks())
    from mocap.bones import cast_marks

    return to_tracks(motion, marks, cast_marks(motion, marks, Views(turning=False)), foreshorten=0.0)


def test_an_outline_lies_round_the_limb(lent):
    outlines = limb_outlines(lent, ARM, width=10.0)
    middle = len(outlines[0]) // 2
    tip = outlines[:, middle]  # on the round end, 5 pixels beyond the hand
    places = SkeletonMotion(Skeleton(*stickman.skeleton()), *stickman.moving({}, 1)).positions()
    shoulder = lent.track("left_elbow 1").pivot
    reach = np.linalg.norm(tip - shoulder, axis=1)
    length = 100 * np.linalg.norm(
        np.diff(places[0, [stickman.NAMES.index(n) for n in ("LeftArm", "LeftHand")]], axis=0)
    )
    assert reach.max() < length + 5.01 and reach.min() < length - 5  # straight at most, and it bends
    wide = np.linalg.norm(outlines[:, 2] - outlines[:, -3], axis=1)
    np.testing.assert_allclose(wide, 10.0, atol=1e-6)


def test_a_limb_by_key_poses_is_drawn_again_from_a_few_of_them(lent):
    captured = check(by_key_poses(lent, ARM, close=2.0))
    (track,) = captured.tracks
    assert 2 <= len(track.keys) <= 4
    np.testing.assert_allclose(track.key_weights().sum(axis=1), 1, atol=1e-6)
    drawn = captured.outline("limb")
    truth = limb_outlines(lent, ARM)
    away = np.linalg.norm(drawn[:, None, :: max(1, drawn.shape[1] // 40)] - truth[:, :, None], axis=-1).min(axis=1)
    assert away.max() < 6.0 and np.median(away) < 2.0


def test_any_drawing_of_the_keys_can_play_it(lent):
    captured = by_key_poses(lent, ARM, close=2.0)
    played = perform(captured, [outline_drawing("limb", captured.keysets[0], np.array([0.2, 0.3, 0.8, 1.0]))])
    mesh = played.roles[0].mesh()
    np.testing.assert_allclose(mesh, captured.points("limb"), atol=1e-6)


def test_joints_that_do_not_follow_each_other_are_refused(lent):
    with pytest.raises(InputError, match="follow each other"):
        by_key_poses(lent, ("left_elbow", "right_hand"))
    with pytest.raises(InputError, match="the motion has root"):
        limb_outlines(lent, ("wing",))
