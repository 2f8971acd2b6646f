"""Captures refined as a whole, against the motion that was drawn."""

import sys
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from capture.errors import InputError
from capture.fit import video
from capture.fit.refine import refine
from capture.fit.whole.stack import PICTURES
from capture.motion import affine
from capture.motion.tracks import CartoonMotion, check
from capture.pictures.clip import Clip, clip_of
from capture.pictures.shot import KeyDrawing, Part, Shot
from fixtures import ball, frog, hat, walker, write
from fixtures.toon import ToonPart

pytest.importorskip("torch", reason="refining needs the extra torch")
pytest.importorskip("kornia", reason="refining needs the extra torch")

FRAMES = 48  # of the frog: the first hop, its landing in 43 and what follows


def errors(motion: CartoonMotion, part: ToonPart) -> np.ndarray:
    """How far (T, N, 2) captured outline points are from where they were drawn, in pixels."""
    return motion.points(part.name)[:, : part.points.shape[1]] - part.points[: len(motion.times)]


def distances(motion: CartoonMotion, part: ToonPart) -> np.ndarray:
    return np.linalg.norm(errors(motion, part), axis=-1)


def jitter(values: np.ndarray, part: ToonPart) -> float:
    """Root mean square of the second differences of values (T, ..., n) from drawing to drawing."""
    new = np.flatnonzero(np.diff(part.drawing[: len(values)], prepend=-1))
    return float(np.sqrt((np.diff(values[new], n=2, axis=0) ** 2).sum(axis=-1).mean()))


@cache
def noisy() -> tuple[ToonPart, Clip, CartoonMotion, CartoonMotion]:
    """The frog under sensor noise, captured, and refined; the bench does it before a busy background as well."""
    toon = frog.frog(noise=5.0)
    clip = clip_of(np.stack([toon.frame(t) for t in range(FRAMES)]))
    motion = video.capture(write.shot_of(toon), clip)
    return toon.parts[0], clip, motion, refine(motion, write.shot_of(toon), clip, "cpu")


def test_jitter_is_at_least_halved():
    part, _, before, after = noisy()
    was, now = (jitter(errors(motion, part), part) for motion in (before, after))
    weights = [m.tracks[0].key_weights() - part.weights[:FRAMES] for m in (before, after)]
    was_weights, now_weights = (jitter(off, part) for off in weights)
    print(f"\njitter {was:.3f} -> {now:.3f} px, of the key weights {was_weights:.4f} -> {now_weights:.4f}")
    assert now <= 0.5 * was
    assert now_weights <= 0.5 * was_weights


def test_nothing_of_the_accuracy_is_lost():
    part, _, before, after = noisy()
    was, now = distances(before, part), distances(after, part)
    print(f"\nmedian {np.median(was):.3f} -> {np.median(now):.3f}, 95 % {np.percentile(was, 95):.3f} -> ", end="")
    print(f"{np.percentile(now, 95):.3f}, worst frame {was.mean(1).max():.3f} -> {now.mean(1).max():.3f}")
    assert np.median(now) <= min(np.median(was), 0.15)
    assert np.percentile(now, 95) <= np.percentile(was, 95)
    assert now.mean(axis=1).max() <= was.mean(axis=1).max()


def test_the_landing_is_not_flattened():
    part, _, _, after = noisy()
    middle = after.outline("frog").mean(axis=1)[40:], part.points[40:FRAMES].mean(axis=1)
    found, drawn = (np.diff(way[:, 1], n=2) for way in middle)
    assert np.abs(drawn).max() > 5  # pixels a frame and frame: it is hard
    assert np.abs(found - drawn).max() < 0.5


def test_a_refined_motion_is_a_motion_like_the_captured_one():
    _, _, before, after = noisy()
    check(after)
    held = after.tracks[0].held
    assert (held == before.tracks[0].held).all()
    assert (np.diff(after.tracks[0].affine, axis=0)[held[1:]] == 0).all()
    assert (np.diff(after.tracks[0].weights, axis=0)[held[1:]] == 0).all()
    assert after.tracks[0].visible.all()
    assert (after.tracks[0].weights >= -0.5 - 1e-9).all()
    assert (after.tracks[0].weights <= 1.5 + 1e-9).all()


def test_without_looseness_three_rows_are_used():
    _, clip, before, _ = noisy()
    strict = refine(before, write.shot_of(frog.frog()), clip, "cpu", loose=0)
    assert (np.abs(strict.tracks[0].weights) > 1e-9).sum(axis=1).max() <= 3


@pytest.fixture(scope="module")
def flight() -> tuple[ToonPart, Shot, np.ndarray]:
    """The ball in the air, 14 frames from its launch on, and a shot of it that begins there."""
    toon = ball.ball(noise=3.0)
    part = replace(toon.parts[0], points=toon.parts[0].points[13:31], drawing=np.arange(18))
    outline = tuple(map(tuple, part.points[0].tolist()))
    shot = Shot("ball", (Part("ball", (KeyDrawing("round", 0, outline),)),))
    return part, shot, np.stack([toon.frame(t) for t in range(13, 31)])


def hidden(frames: np.ndarray, start: int, stop: int) -> np.ndarray:
    frames = frames.copy()
    frames[start:stop] = ball.ball().background
    return frames


def test_the_captures_own_jitter_is_forgotten(flight):
    part, shot, frames = flight
    clip = clip_of(frames)
    before = video.capture(shot, clip)
    rng = np.random.default_rng(3)
    shaken = before.tracks[0].affine.copy()
    shaken[..., 2] += rng.normal(0, 1.5, (18, 2))
    shaken[..., :2] += rng.normal(0, 0.02, (18, 2, 2))
    start = replace(before, tracks=(replace(before.tracks[0], affine=shaken),))
    settled, again = (refine(motion, shot, clip, "cpu") for motion in (before, start))
    assert np.median(distances(start, part)) > 1
    assert np.linalg.norm(again.points("ball") - settled.points("ball"), axis=-1).max() < 0.02


def test_a_short_occlusion_is_bridged_and_stays_marked_as_not_visible(flight):
    part, shot, frames = flight
    clip = clip_of(hidden(frames, 8, 12))
    before = video.capture(shot, clip)
    after = refine(before, shot, clip, "cpu")
    was, now = (np.median(distances(motion, part), axis=1) for motion in (before, after))
    print(f"\nhidden frames: {was[8:12].round(1)} -> {now[8:12].round(1)} px")
    gone = np.isin(np.arange(18), range(8, 12))
    assert (before.tracks[0].visible == ~gone).all()
    assert (after.tracks[0].visible == ~gone).all()
    assert (after.tracks[0].residual[gone] == 0).all()
    assert now[~gone].max() < 0.2
    assert now[gone].max() < 0.25 * was[gone].max()


def test_after_a_long_absence_nothing_is_made_up(flight):
    _, shot, frames = flight
    clip = clip_of(hidden(frames, 14, 18), fps=24)
    after = refine(video.capture(shot, clip), shot, clip, "cpu")
    assert after.tracks[0].visible.tolist() == [True] * 14 + [False] * 4
    assert (after.tracks[0].affine[14:] == after.tracks[0].affine[13]).all()
    slow = clip_of(hidden(frames, 6, 10), fps=6)  # four frames are more than half a second
    held = refine(video.capture(shot, slow), shot, slow, "cpu").tracks[0]
    assert (held.affine[6:10] == held.affine[5]).all()


def test_a_drawing_the_capture_got_wrong_is_found_from_its_neighbours(flight):
    part, shot, frames = flight
    clip = clip_of(frames)
    before = video.capture(shot, clip)
    astray = before.tracks[0].affine.copy()
    astray[7, :, 2] += (31, -22)
    start = replace(before, tracks=(replace(before.tracks[0], affine=astray),))
    after = refine(start, shot, clip, "cpu")
    assert np.median(distances(start, part), axis=1)[7] > 30
    assert np.median(distances(after, part), axis=1).max() < 0.2


def test_a_bar_that_passes_over_a_part_pulls_at_it_little(flight):
    part, shot, frames = flight
    barred = frames.copy()
    for t in range(5, 13):
        left = int(part.points[t, :, 0].min()) - 16 + 12 * (t - 5)
        barred[t, :, left : left + 18] = (90, 80, 160)  # a fifth of the ball
    clip = clip_of(barred)
    before = video.capture(shot, clip)
    after = refine(before, shot, clip, "cpu")
    was, now = (np.median(distances(motion, part), axis=1) for motion in (before, after))
    print(f"\nbehind the bar and after: {was[5:].round(2)} -> {now[5:].round(2)} px")
    assert np.median(now[5:13]) <= 0.5
    assert now[13:].max() <= 0.2


def test_keys_that_do_not_fit_well_are_no_reason_to_go_elsewhere():
    """A hat that bends, captured as if it could not: which map is best is a matter of taste, but none is far."""
    toon = hat.hat()
    part, shot = toon.parts[0], write.shot_of(toon)
    shot = replace(shot, parts=(replace(shot.parts[0], keys=shot.parts[0].keys[:1]),))
    clip = clip_of(np.stack([toon.frame(t) for t in range(24)]))
    before = video.capture(shot, clip)
    was, now = (distances(motion, part) for motion in (before, refine(before, shot, clip, "cpu")))
    print(f"\nworst frame {was.mean(axis=1).max():.2f} -> {now.mean(axis=1).max():.2f} px")
    assert np.median(now) <= 1.1 * np.median(was)
    assert now.mean(axis=1).max() <= 1.1 * was.mean(axis=1).max()


def test_twice_the_same_comes_out(flight):
    _, shot, frames = flight
    clip = clip_of(frames[:8])
    before = video.capture(shot, clip)
    first, second = (refine(before, shot, clip, "cpu").tracks[0] for _ in range(2))
    assert (first.affine == second.affine).all()
    assert (first.residual == second.residual).all()


def test_a_graphics_card_comes_to_the_same():
    import torch

    if not torch.cuda.is_available():
        pytest.skip("there is no graphics card that torch can use: CPU and GPU are not compared")
    _, clip, before, after = noisy()
    there = refine(before, write.shot_of(frog.frog()), clip, "cuda")
    assert np.linalg.norm(there.points("frog") - after.points("frog"), axis=-1).max() < 1e-3


def test_what_lies_over_a_part_does_not_pull_at_it():
    toon = walker.walker(noise=3.0)
    shot = write.shot_of(toon)
    shot = replace(shot, parts=tuple(part for part in shot.parts if part.name in ("torso", "head", "near leg")))
    clip = clip_of(np.stack([toon.frame(t) for t in range(8)]))
    before = video.capture(shot, clip)
    after = refine(before, shot, clip, "cpu")
    for name in ("head", "near leg"):
        was, now = (np.median(distances(motion, toon.part(name))) for motion in (before, after))
        print(f"\n{name}: {was:.3f} -> {now:.3f} px")
        assert now <= was
    assert [track.parent for track in after.tracks] == [track.parent for track in before.tracks]


def test_long_holds_are_looked_at_in_a_few_pictures_only(flight):
    _, shot, frames = flight
    looked = []
    still = np.repeat(frames[:1], 30, axis=0)
    base = clip_of(still)
    before = video.capture(shot, base)
    clip = replace(base, _fetch=lambda t: (looked.append(t), still[t])[1])
    after = refine(before, shot, clip, "cpu")
    assert before.tracks[0].held.sum() == 29
    assert len(set(looked)) <= PICTURES + 1
    assert np.abs(affine.apply(after.tracks[0].affine, np.zeros((1, 2)))).max() < 0.1


@pytest.mark.parametrize(
    ("device", "told"), [("gpu", "must be auto, cpu or cuda, got 'gpu'"), ("cuda", "choose cpu or auto")]
)
def test_a_device_that_is_not_there_is_refused(flight, device, told):
    import torch

    if device == "cuda" and torch.cuda.is_available():
        pytest.skip("there is a graphics card here")
    _, shot, frames = flight
    clip = clip_of(frames[:3])
    with pytest.raises(InputError, match=told):
        refine(video.capture(shot, clip), shot, clip, device)


@pytest.mark.parametrize("missing", ["torch", "kornia"])
def test_what_is_not_installed_is_named_with_the_extra_that_brings_it(flight, missing, monkeypatch):
    _, shot, frames = flight
    motion = video.capture(shot, clip_of(frames[:3]))
    monkeypatch.setitem(sys.modules, missing, None)
    with pytest.raises(InputError, match=rf"{missing} is not installed: pip install 'tooncap\[torch\]'"):
        refine(motion, shot, clip_of(frames[:3]))


def test_a_motion_of_another_clip_is_refused(flight):
    _, shot, frames = flight
    motion = video.capture(shot, clip_of(frames[:4]))
    with pytest.raises(InputError, match="the clip has 3 frames, the motion 4"):
        refine(motion, shot, clip_of(frames[:3]))
    other = replace(motion, tracks=(replace(motion.tracks[0], part="egg"),))
    with pytest.raises(InputError, match="no part 'ball'"):
        refine(other, shot, clip_of(frames[:4]))


def test_torchs_threads_are_left_as_they_were(flight):
    import torch

    _, shot, frames = flight
    clip, before = clip_of(frames[:3]), torch.get_num_threads()
    refine(video.capture(shot, clip), shot, clip)
    assert torch.get_num_threads() == before
