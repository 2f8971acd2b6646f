"""Whole shots captured, against the motion that was drawn."""

from dataclasses import replace

import numpy as np
import pytest

from capture.errors import InputError
from capture.fit import video
from capture.motion.tracks import CartoonMotion
from capture.pictures.clip import clip_of
from capture.pictures.shot import KeyDrawing, Part, Shot
from fixtures import ball, frog, hat, maps, render, walker, write
from fixtures.toon import Toon

LOST = 5.0  # pixels of median error in a frame


def point_errors(motion: CartoonMotion, toon: Toon, name: str) -> np.ndarray:
    """Distances (T, N) of the captured outline points from the drawn ones, in pixels."""
    truth = toon.part(name).points
    return np.linalg.norm(motion.points(name)[:, : truth.shape[1]] - truth, axis=-1)


def captured(toon: Toon) -> CartoonMotion:
    return video.capture(write.shot_of(toon), write.clip_in_memory(toon))


def check(toon: Toon, most: float) -> CartoonMotion:
    motion = captured(toon)
    off = point_errors(motion, toon, toon.parts[0].name)
    print(f"\n{toon.name}: median {np.median(off):.3f} px, worst frame {np.median(off, axis=1).max():.3f}")
    assert np.median(off) <= most
    assert (np.median(off, axis=1) <= LOST).all()
    assert motion.tracks[0].visible.all()
    return motion


def test_the_ball_is_found_to_a_seventh_of_a_pixel():
    check(ball.ball(), 0.15)


def test_the_ball_is_found_before_a_busy_background_of_its_own_colour():
    check(ball.ball(busy=True, noise=3.0), 0.15)


def test_the_hat_is_found_to_a_seventh_of_a_pixel():
    check(hat.hat(rigid_shape=True), 0.15)


def test_the_hat_that_bends_is_found_with_its_keys():
    toon = hat.hat()
    motion = check(toon, 0.3)
    off = np.abs(motion.tracks[0].key_weights() - toon.parts[0].weights)
    assert np.median(off.max(axis=1)) < 0.1


@pytest.fixture(scope="module")
def frog_motion() -> CartoonMotion:
    return captured(frog.frog())


def test_the_frog_is_found_with_its_keys(frog_motion: CartoonMotion):
    off = point_errors(frog_motion, frog.frog(), "frog")
    print(f"\nfrog: median {np.median(off):.3f} px, worst frame {np.median(off, axis=1).max():.3f}")
    assert np.median(off) <= 0.6
    assert (np.median(off, axis=1) <= LOST).all()


def test_the_frogs_keys_come_back_as_themselves(frog_motion: CartoonMotion):
    part = frog.frog().parts[0]
    weights = frog_motion.tracks[0].key_weights()[part.key_frames]
    assert np.abs(weights - np.eye(len(part.key_names))).max() < 0.1


def test_held_drawings_are_told(frog_motion: CartoonMotion):
    drawing = frog.frog().parts[0].drawing
    same = np.flatnonzero(np.diff(drawing) == 0) + 1
    held = frog_motion.tracks[0].held
    key = frog.frog().parts[0].key_frames[0]
    assert held[same[same > key]].all()
    assert not held[np.setdiff1d(np.arange(len(drawing)), same)][key + 1 :].any()


def test_before_the_key_a_held_drawing_is_told_of_the_second_frame_too():
    toon = frog.frog()
    part, stop = toon.parts[0], 14
    frames = clip_of(np.stack([toon.frame(t) for t in range(stop)]))
    outline = tuple(map(tuple, part.points[12].tolist()))
    motion = video.capture(Shot("frog", (Part("frog", (KeyDrawing("crouch", 12, outline),)),)), frames)
    same = np.append(False, np.diff(part.drawing[:stop]) == 0)
    still = np.append(False, np.abs(np.diff(part.points[:stop], axis=0)).max(axis=(1, 2)) < 0.2)
    held = motion.tracks[0].held
    assert held[same].all()
    assert not held[~same & ~still].any()


def test_a_layer_that_comes_back_where_it_was_is_seen_again():
    toon = ball.ball()
    shown = toon.frame(3)
    frames = np.stack([toon.frame(2), shown, toon.background, shown])
    outline = tuple(map(tuple, toon.parts[0].points[2].tolist()))
    motion = video.capture(Shot("ball", (Part("ball", (KeyDrawing("round", 0, outline),)),)), clip_of(frames))
    assert motion.tracks[0].visible.tolist() == [True, True, False, True]
    assert not motion.tracks[0].held.any()


def test_between_two_keys_the_layer_may_vanish_and_come_back_anywhere():
    toon = ball.ball()
    shown = [*range(6), *[None] * 3, *range(46, 54)]
    frames = clip_of([toon.background if t is None else toon.frame(t) for t in shown])
    part = write.shot_of(toon).parts[0]
    outline = tuple(map(tuple, toon.parts[0].points[53].tolist()))
    keys = (part.keys[0], KeyDrawing("again", len(shown) - 1, outline))
    motion = video.capture(Shot("ball", (replace(part, keys=keys),)), frames)
    seen = np.array([t is not None for t in shown])
    assert (motion.tracks[0].visible == seen).all()
    truth = toon.parts[0].points[[t for t in shown if t is not None]]
    off = np.linalg.norm(motion.points("ball")[seen, : truth.shape[1]] - truth, axis=-1)
    print(f"\nvanishing ball: median {np.median(off):.3f} px, worst frame {np.median(off, axis=1).max():.3f}")
    assert np.median(off, axis=1).max() < 0.5
    assert (motion.points("ball")[6:9] == motion.points("ball")[5]).all()


def test_parts_hang_on_each_other_and_are_found_in_the_picture():
    toon = walker.walker()
    frames = clip_of(np.stack([toon.frame(t) for t in range(8)]))
    shot = write.shot_of(toon)
    shot = replace(shot, parts=tuple(part for part in shot.parts if part.name in ("torso", "head")))
    motion = video.capture(shot, frames)
    assert [track.parent for track in motion.tracks] == ["", "torso"]
    truth = toon.part("head").points[:8]
    off = np.linalg.norm(motion.points("head")[:, : truth.shape[1]] - truth, axis=-1)
    assert np.median(off) < 0.3


def test_weights_do_not_depend_on_how_many_frames_are_read_at_a_time(monkeypatch: pytest.MonkeyPatch):
    toon = hat.hat()
    part = write.shot_of(toon).parts[0]
    frames = clip_of([toon.frame(t) for t in range(11)])
    shot = Shot("hat", (replace(part, keys=part.keys[:2]),))
    whole = video.capture(shot, frames).tracks[0]
    monkeypatch.setattr(video, "CHUNK", 4)
    pieces = video.capture(shot, frames).tracks[0]
    assert np.allclose(whole.affine, pieces.affine, atol=1e-9) and np.allclose(whole.weights, pieces.weights, atol=1e-9)


def test_the_shot_may_begin_later_than_the_clip():
    toon = ball.ball()
    frames = np.stack([toon.frame(t) for t in range(8, 16)])
    outline = tuple(map(tuple, toon.parts[0].points[12].tolist()))
    shot = Shot("ball", (Part("ball", (KeyDrawing("round", 12, outline),)),), start=8)
    motion = video.capture(shot, clip_of(frames))
    off = np.linalg.norm(motion.points("ball")[:, : len(outline)] - toon.parts[0].points[8:16], axis=-1)
    assert np.median(off, axis=1).max() < 0.3


def test_a_box_is_enough_to_start_from():
    toon = ball.ball()
    frames = clip_of(np.stack([toon.frame(t) for t in range(6)]))
    low, high = toon.parts[0].points[0].min(axis=0), toon.parts[0].points[0].max(axis=0)
    motion = video.capture(Shot("ball", (Part("ball", box=(*(low - 6), *(high - low + 12))),)), frames)
    truth = toon.parts[0].points[:6].mean(axis=1)
    assert np.linalg.norm(motion.outline("ball").mean(axis=1) - truth, axis=-1).max() < 3


def test_a_colour_is_enough_to_start_from_where_a_layer_has_one():
    flat = np.full((200, 300, 3), 230, np.uint8)
    blobs = [maps.ellipse((90 + 9 * t, 100 - 4 * t), 40 + 2 * t, 30) for t in range(6)]
    frames = [np.rint(render.paint(flat, [render.Fill(blob, (40, 130, 60))])).astype(np.uint8) for blob in blobs]
    motion = video.capture(Shot("blob", (Part("blob", color=(40, 130, 60)),)), clip_of(np.stack(frames)))
    found = motion.outline("blob")
    for blob, outline in zip(blobs, found):
        assert np.allclose(np.ptp(outline, axis=0), np.ptp(blob, axis=0), atol=1.5)
        assert np.allclose(outline.max(axis=0), blob.max(axis=0), atol=1.0)


def test_a_layer_that_leaves_is_told_and_holds_its_pose():
    toon = ball.ball()
    empty = np.tile(toon.background, (3, 1, 1, 1))
    frames = np.concatenate([np.stack([toon.frame(t) for t in range(4)]), empty])
    motion = video.capture(write.shot_of(toon), clip_of(frames))
    track = motion.tracks[0]
    assert track.visible.tolist() == [True] * 4 + [False] * 3
    assert (track.affine[4:] == track.affine[3]).all()


@pytest.mark.parametrize(
    ("part", "told"),
    [
        (Part("ball", (KeyDrawing("round", 99),), box=(1, 1, 50, 50)), "frames 0 to 2, got 99"),
        (Part("ball", box=(600, 400, 100, 100)), "must lie inside the 640 x 480 picture"),
        (Part("ball"), "outline, or a box, a colour or scribbles"),
        (Part("ball", (KeyDrawing("round", 0, ((-90, -90), (-50, -90), (-50, -40))),)), "must lie in the 640 x 480"),
        (Part("ball", color=(1, 254, 3)), "take the colour from the picture"),
    ],
)
def test_a_part_that_cannot_be_captured_is_refused_in_one_sentence(part: Part, told: str):
    toon = ball.ball()
    frames = clip_of(np.stack([toon.frame(t) for t in range(3)]))
    with pytest.raises(InputError, match=told):
        video.capture(Shot("ball", (part,)), frames)


def test_the_clip_is_not_written_into():
    toon = ball.ball()
    frames = np.stack([toon.frame(t) for t in range(3)])
    before = frames.copy()
    video.capture(replace(write.shot_of(toon), clip="memory"), clip_of(frames))
    assert (frames == before).all()
