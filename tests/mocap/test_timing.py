"""Timing changes when, not what."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from capture.errors import InputError
from capture.motion import tracks
from fixtures import write
from fixtures.frog import frog
from fixtures.hat import hat
from mocap.curves import timing
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion


def swing(fps=60, seconds=4.0):
    """A pendulum (T, 2), in pixels."""
    angle = 1.2 * np.sin(2 * np.pi * 0.5 * np.arange(round(fps * seconds) + 1) / fps)
    return 100 * np.column_stack([np.sin(angle), -np.cos(angle)])


def speed(curves, fps):
    return np.linalg.norm(np.gradient(curves, 1 / fps, axis=0), axis=-1)


def test_poses_are_held_longer_and_the_way_between_is_quicker():
    old = swing()
    new = timing.played(old, timing.eased(old, 60, 0.6))
    side = np.abs(old[:, 0]).max()
    assert np.mean(np.abs(new[:, 0]) > 0.9 * side) > 1.3 * np.mean(np.abs(old[:, 0]) > 0.9 * side)
    assert speed(new, 60).max() > 1.15 * speed(old, 60).max()
    even = timing.played(old, timing.eased(old, 60, -0.6))
    assert speed(even, 60).max() < 0.9 * speed(old, 60).max()


@pytest.mark.parametrize("strength", [-0.5, 0.4, 0.8])
def test_speed_goes_with_a_power_of_what_it_was(strength):
    old = swing(240)
    moments = timing.eased(old, 240, strength, smooth=0.02)
    was, now = speed(old, 240), speed(timing.played(old, moments), 240)
    there = np.interp(moments, np.arange(len(old)), was)
    middle = there > 0.35 * was.mean()  # slower than PACES allows, it is slowed no more
    power = np.polyfit(np.log(there[middle]), np.log(now[middle]), 1)[0]
    assert power == pytest.approx(1 + strength, abs=0.05)


@pytest.mark.parametrize("strength", [-1.0, 0.5, 3.0])
def test_time_runs_forward_and_kept_frames_stay_where_they_are(strength):
    keep = (17, 60, 61, 140)
    moments = timing.eased(swing(), 60, strength, keep)
    assert (np.diff(moments) > 0).all() and moments[0] == 0 and moments[-1] == 240
    np.testing.assert_allclose(moments[list(keep)], keep, atol=1e-9)


def test_an_even_motion_and_a_still_one_and_no_strength_change_nothing():
    line = np.arange(50)[:, None] * [1.0, 2]
    for curves, strength in ((line, 0.8), (0 * line, 0.8), (swing(), 0.0), (line[:1], 1.0), (line[:2], 1.0)):
        np.testing.assert_allclose(timing.eased(curves, 24, strength), np.arange(len(curves)), atol=1e-9)


def test_the_frame_rate_does_not_matter():
    at = [timing.eased(swing(fps), fps, 0.6)[:: fps // 6] / fps for fps in (30, 60, 240)]
    np.testing.assert_allclose(at[0], at[2], atol=0.01)
    np.testing.assert_allclose(at[1], at[2], atol=0.01)


@pytest.mark.parametrize(("fps", "holds"), [(24, {2}), (60, {5}), (30, {2, 3}), (120, {10}), (12, {1}), (8, {1})])
def test_on_twos_there_are_twelve_drawings_a_second(fps, holds):
    moments = timing.on_twos(5 * fps, fps)
    shown, counts = np.unique(moments, return_counts=True)
    assert len(shown) == 5 * min(fps, 12) and set(counts.tolist()) == holds
    assert (moments <= np.arange(5 * fps)).all() and (np.diff(moments) >= 0).all()  # nothing is shown before its time


def test_between_frames_joints_turn_the_short_way():
    skeleton = Skeleton(("root", "tip"), (-1, 0), np.array([[0, 1.0, 0], [1, 0, 0]]))
    turns = Rotation.from_rotvec(np.outer([0, 0.4, 1.0, 1.0], [0, 0, 1]))
    rotation = np.tile([0, 0, 0, 1.0], (4, 2, 1))
    rotation[:, 0] = turns.as_quat() * [[1], [-1], [1], [1]]  # a quaternion and its negative are the same turn
    motion = SkeletonMotion(skeleton, np.tile(skeleton.offsets, (4, 1, 1)), rotation, 24.0)
    ours = timing.played_joints(motion, np.array([0, 0.5, 1, 1.25, 3]))
    angle = Rotation.from_quat(ours.rotation[:, 0]).as_euler("zyx")[:, 0]
    np.testing.assert_allclose(angle, [0, 0.2, 0.4, 0.55, 1.0], atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(np.diff(ours.positions(), axis=1)[:, 0], axis=-1), 1)


def test_a_cartoon_on_ones_put_on_twos_holds_every_second_drawing():
    hats = write.motion_of(hat())
    ones = tracks.trim(hats, 0, 20)
    ours = tracks.check(timing.played_drawings(ones, timing.on_twos(20, ones.fps)))
    assert ours.tracks[0].held[1::2].all()
    np.testing.assert_array_equal(ours.points("hat")[::2], ours.points("hat")[1::2])


def test_a_cartoon_on_twos_keeps_its_drawings_when_it_is_eased():
    source = write.motion_of(frog())
    points = source.outline("frog").reshape(len(source.times), -1)
    moments = timing.eased(points, source.fps, 0.7)
    ours = tracks.check(timing.played_drawings(source, moments))
    old, new = source.outline("frog"), ours.outline("frog")
    apart = np.abs(new[:, None] - old[None]).max(axis=(2, 3))
    new_drawing = ~source.track("frog").held
    on_ones = (new_drawing & np.append(new_drawing[1:], True))[np.floor(moments + 1e-9).astype(int)]
    assert (apart.min(axis=1) < 1e-9)[~on_ones].all() and (~on_ones).sum() > 40
    assert (apart.argmin(axis=1) != np.arange(len(old)))[~on_ones].any()
    still = np.abs(np.diff(new, axis=0)).max(axis=(1, 2)) == 0
    assert still[ours.track("frog").held[1:]].all()  # a held frame is the frame before


def test_a_cartoon_that_is_shown_when_it_was_is_unchanged():
    source = write.motion_of(frog())
    ours = timing.played_drawings(source, np.arange(len(source.times)))
    np.testing.assert_array_equal(ours.track("frog").affine, source.track("frog").affine)
    np.testing.assert_array_equal(ours.track("frog").held, source.track("frog").held)


@pytest.mark.parametrize(
    "make",
    [
        lambda: timing.eased(swing(), 60, 9.0),
        lambda: timing.eased(swing(), 60, 0.5, keep=(999,)),
        lambda: timing.on_twos(9, 24, 0.0),
        lambda: timing.played_drawings(write.motion_of(hat()), np.arange(3.0)),
    ],
)
def test_what_cannot_be_timed_is_refused(make):
    with pytest.raises(InputError, match="must"):
        make()
