"""A capture done again only where its shot was changed: what stays, what is tracked, and what must be captured whole."""

from dataclasses import replace

import numpy as np
import pytest

from capture.errors import InputError
from capture.fit import again, batch, source, video
from capture.motion import tracks
from capture.motion.tracks import CartoonMotion
from capture.pictures.clip import Clip, clip_of
from capture.pictures.shot import KeyDrawing, Part, Shot
from capture.progress import listening
from fixtures import frog, walker, write

FRAMES = 30


def without(shot: Shot, *names: str, part: int = 0) -> Shot:
    """The shot without some keys of a part."""
    parts = list(shot.parts)
    parts[part] = replace(parts[part], keys=tuple(key for key in parts[part].keys if key.name not in names))
    return replace(shot, parts=tuple(parts))


def frame_errors(motion: CartoonMotion, name: str, truth: np.ndarray) -> np.ndarray:
    """How far the outline's points are off in each frame (T,), the median, in pixels."""
    return np.median(np.linalg.norm(motion.points(name)[:, : truth.shape[1]] - truth, axis=-1), axis=1)


def moved(shot: Shot, name: str, by: tuple[float, float]) -> Shot:
    """The shot with one key of its first part drawn elsewhere."""
    part = shot.parts[0]
    keys = [
        replace(key, outline=tuple((x + by[0], y + by[1]) for x, y in key.outline)) if key.name == name else key
        for key in part.keys
    ]
    return replace(shot, parts=(replace(part, keys=tuple(keys)), *shot.parts[1:]))


@pytest.fixture(scope="module")
def clip() -> Clip:
    toon = frog.frog()
    return clip_of([toon.frame(t) for t in range(FRAMES)])


@pytest.fixture(scope="module")
def shot() -> Shot:
    """Keys sit, crouch and leap in frames 0, 12 and 26 of 30."""
    return without(write.shot_of(frog.frog()), "tuck")


@pytest.fixture(scope="module")
def poor(clip: Clip, shot: Shot) -> CartoonMotion:
    """Captured without the crouch, which it therefore cannot draw."""
    return video.capture(without(shot, "crouch"), clip)


@pytest.fixture(scope="module")
def mended(clip: Clip, shot: Shot, poor: CartoonMotion) -> CartoonMotion:
    """The crouch put in afterwards, as by hand: last in the list."""
    return again.capture_again(_last(shot, "crouch"), poor, clip)


def _last(shot: Shot, name: str) -> Shot:
    part = shot.parts[0]
    return replace(shot, parts=(replace(part, keys=tuple(sorted(part.keys, key=lambda key: key.name == name))),))


def test_a_new_key_asks_for_the_frames_between_its_neighbours(shot: Shot, poor: CartoonMotion):
    assert again.plan(_last(shot, "crouch"), poor).ranges() == [("frog", 0, 26)]
    assert again.plan(without(shot, "crouch"), poor).ranges() == []


def test_outside_them_every_drawing_stays_where_it_was(poor: CartoonMotion, mended: CartoonMotion):
    outside = [0, *range(26, FRAMES)]
    before, after = (motion.points("frog")[outside] for motion in (poor, mended))
    assert np.abs(after - before).max() < 1e-6
    for name in ("affine", "residual", "visible", "held"):
        assert np.array_equal(getattr(mended.tracks[0], name)[outside], getattr(poor.tracks[0], name)[outside])
    weights = mended.tracks[0].key_weights()[outside]
    assert np.allclose(weights[:, :2], poor.tracks[0].key_weights()[outside], atol=1e-12) and not weights[:, 2].any()


def test_between_them_it_is_as_good_as_captured_whole(
    clip: Clip, shot: Shot, poor: CartoonMotion, mended: CartoonMotion
):
    truth = frog.frog().parts[0].points[:FRAMES]
    whole = video.capture(_last(shot, "crouch"), clip)
    before, after, all_anew = (frame_errors(motion, "frog", truth)[1:26] for motion in (poor, mended, whole))
    print(f"\nworst frame: before {before.max():.2f}, again {after.max():.2f}, whole {all_anew.max():.2f} px")
    assert before.max() > 2 and after.max() < 0.5
    assert after.max() <= all_anew.max() + 0.02 and after.mean() <= all_anew.mean() + 0.02
    jumps = np.linalg.norm(np.diff(mended.points("frog")[:28], axis=0), axis=-1).max(axis=1)
    held = mended.tracks[0].held[1:28]
    assert (jumps[held] < 1e-6).all()  # a drawing that is held over the join does not stir


def test_only_the_frames_between_are_looked_at(clip: Clip, shot: Shot, poor: CartoonMotion):
    asked = []

    def noted(t: int) -> np.ndarray:
        asked.append(t)
        return clip[t]

    again.capture_again(_last(shot, "crouch"), poor, replace(clip, _fetch=noted))
    assert set(asked) == {*range(27)}


def test_a_key_taken_away_again_leaves_what_was_before(
    clip: Clip, shot: Shot, poor: CartoonMotion, mended: CartoonMotion
):
    back = without(shot, "crouch")
    assert again.plan(back, mended).ranges() == [("frog", 0, 26)]
    found = again.capture_again(back, mended, clip)
    assert np.abs(found.points("frog")[26:] - poor.points("frog")[26:]).max() < 1e-6
    truth = frog.frog().parts[0].points[:FRAMES]
    assert frame_errors(found, "frog", truth).max() <= frame_errors(poor, "frog", truth).max() + 0.05


def test_a_key_that_is_moved_is_tracked_again_wherever_it_is_drawn_with(shot: Shot, mended: CartoonMotion):
    (part, first, last) = again.plan(moved(_last(shot, "crouch"), "crouch", (2, 0)), mended).ranges()[0]
    assert (part, first, last) == ("frog", 0, 26)
    ranges = again.plan(moved(_last(shot, "crouch"), "leap", (2, 0)), mended).ranges()
    with_leap = np.flatnonzero(mended.tracks[0].key_weights()[:, 1] > 1e-9)
    assert all(any(a <= t <= b for _, a, b in ranges) for t in with_leap)


def test_a_pivot_moves_without_any_tracking(clip: Clip, shot: Shot, poor: CartoonMotion):
    other = without(shot, "crouch")
    other = replace(other, parts=(replace(other.parts[0], pivot=(200.0, 300.0)),))
    assert again.plan(other, poor).ranges() == []
    nothing = clip_of([np.zeros((480, 640, 3), np.uint8)])
    part = shot.parts[0]
    with pytest.raises(InputError, match="1 frames, the motion 30"):
        again.capture_again(other, poor, nothing)
    found = again.capture_again(other, poor, clip)
    assert np.allclose(found.points(part.name), poor.points(part.name), atol=1e-9)
    assert found.tracks[0].pivot.tolist() == [200, 300] and not np.allclose(
        found.tracks[0].affine, poor.tracks[0].affine
    )


def _keyed_at(shot: Shot, frame: int) -> Shot:
    part = shot.parts[0]
    return replace(shot, parts=(replace(part, keys=(*part.keys, replace(part.keys[0], name="late", frame=frame))),))


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (lambda shot: moved(shot, "sit", (1, 1)), "the first key of frog"),
        (lambda shot: replace(shot, stop=60), "another stretch"),
        (lambda shot: _keyed_at(shot, 99), "none of the frames"),
        (lambda shot: replace(shot, parts=(*shot.parts, Part("hat", box=(1, 1, 50, 50)))), "parts have come"),
        (lambda shot: replace(shot, parts=(replace(shot.parts[0], order=3),)), "before or behind"),
    ],
)
def test_what_changes_all_is_refused_with_the_reason(shot: Shot, poor: CartoonMotion, clip: Clip, change, why: str):
    other = change(without(shot, "crouch"))
    assert why in again.plan(other, poor).whole
    with pytest.raises(InputError, match=why):
        again.capture_again(other, poor, clip)


def test_a_motion_tells_its_shot_also_from_its_file_until_it_is_changed(shot: Shot, poor: CartoonMotion, tmp_path):
    tracks.save(poor, tmp_path / "frog.motion.json")
    read = tracks.load(tmp_path / "frog.motion.json")
    assert source.shot_of(read) == replace(without(shot, "crouch"), clip="") == source.shot_of(poor)
    assert source.shot_of(tracks.trim(read, 3, 20)) is None
    wider = replace(read, tracks=(replace(read.tracks[0], affine=1.01 * read.tracks[0].affine),))
    assert source.shot_of(wider) is None and "not known" in again.plan(shot, wider).whole
    assert again.plan(shot, wider, without(shot, "crouch")).ranges()  # unless one is told


def test_a_part_told_by_a_box_can_be_mended_too():
    toon = frog.frog()
    truth = toon.parts[0].points[:12]
    frames = clip_of([toon.frame(t) for t in range(12)])
    low, high = truth[0].min(axis=0) - 6, truth[0].max(axis=0) + 6
    boxed = Shot("frog", (Part("frog", box=(*low, *(high - low))),))
    rough = video.capture(boxed, frames)
    keyset, outlines = rough.keysets[0], rough.outline("frog")
    drawn = {0: keyset.points[0, keyset.outline], 9: outlines[9]}
    keyed = [KeyDrawing(f"k{t}", t, tuple(map(tuple, outline.tolist()))) for t, outline in drawn.items()]
    told = Shot("frog", (Part("frog", tuple(keyed)),))
    assert again.plan(told, rough).ranges() == [("frog", 0, 11)]
    found = again.capture_again(told, rough, frames)
    assert np.abs(found.outline("frog")[0] - outlines[0]).max() < 1e-6
    assert np.abs(found.outline("frog")[9] - outlines[9]).max() < 1


@pytest.fixture(scope="module")
def walking() -> tuple[Clip, Shot, CartoonMotion]:
    """A torso with a head on it, the head of one key."""
    toon = walker.walker()
    frames = clip_of([toon.frame(t) for t in range(14)])
    shot = write.shot_of(toon)
    shot = replace(shot, parts=tuple(part for part in shot.parts if part.name in ("torso", "head")))
    return frames, shot, video.capture(shot, frames)


def test_of_several_parts_only_the_changed_one_is_tracked_and_its_child_stays_where_it_was_seen(walking):
    frames, shot, motion = walking
    torso = next(part for part in shot.parts if part.name == "torso")
    outline = tuple(map(tuple, motion.points("torso")[8, : len(torso.keys[0].outline)].tolist()))
    mended = replace(torso, keys=(*torso.keys, KeyDrawing("k8", 8, outline)))
    other = replace(shot, parts=tuple(mended if part is torso else part for part in shot.parts))
    begin = max(key.frame for key in torso.keys if key.frame < 8)
    assert again.plan(other, motion).ranges() == [("torso", begin, 13)]
    found = again.capture_again(other, motion, frames)
    assert np.abs(found.points("head") - motion.points("head")).max() < 1e-6
    assert np.abs(found.points("torso")[: begin + 1] - motion.points("torso")[: begin + 1]).max() < 1e-6
    truth = walker.walker().part("torso").points[:14]
    assert frame_errors(found, "torso", truth).max() < frame_errors(motion, "torso", truth).max() + 0.1


def test_what_was_not_seen_goes_along_with_what_it_hangs_on(walking):
    motion = walking[2]
    head = next(n for n, track in enumerate(motion.tracks) if track.part == "head")
    unseen = motion.tracks[head].visible.copy()
    unseen[10] = False
    listed = list(motion.tracks)
    listed[head] = replace(listed[head], visible=unseen)
    lost = replace(motion, tracks=tuple(listed))
    plain = {track.part: tracks.total_affine(lost, track.part) for track in lost.tracks}
    shifted = plain["torso"].copy()
    shifted[9:12, 0, 2] += 7
    changed = [np.isin(np.arange(14), (9, 10, 11)) & (track.part == "torso") for track in lost.tracks]
    olds = [(track, shifted if track.part == "torso" else plain["head"]) for track in lost.tracks]
    found = replace(lost, tracks=again._relative(lost, olds, changed))
    by = (found.points("head") - lost.points("head")).mean(axis=1)
    assert np.allclose(by[10], (7, 0), atol=1e-9) and np.allclose(np.delete(by, 10, axis=0), 0, atol=1e-9)


def test_an_interrupted_one_goes_on_to_the_same_motion(clip: Clip, shot: Shot, poor, mended, tmp_path, capsys):
    def unplugged(t: int) -> np.ndarray:
        if t == 21:
            raise RuntimeError("the disk was unplugged")
        return clip[t]

    keep = tmp_path / "frog.motion.json.part"
    told = _last(shot, "crouch")
    with pytest.raises(RuntimeError):
        again.capture_again(told, poor, replace(clip, _fetch=unplugged), keep=keep)
    assert keep.exists()
    found = again.capture_again(told, poor, clip, keep=keep)
    assert "goes on from frame 21" in capsys.readouterr().err and not keep.exists()
    assert np.array_equal(found.tracks[0].affine, mended.tracks[0].affine)
    assert np.array_equal(found.tracks[0].weights, mended.tracks[0].weights)


def test_into_a_file_it_says_what_was_done(clip: Clip, shot: Shot, poor, mended, tmp_path):
    out, told = tmp_path / "frog.motion.json", _last(shot, "crouch")
    tracks.save(poor, out)
    motion, said = again.capture_again_to(out, told, clip)
    assert said == "tracked again: frog in 0 to 26"
    assert np.array_equal(tracks.load(out).tracks[0].affine, mended.tracks[0].affine)
    assert np.array_equal(motion.tracks[0].affine, mended.tracks[0].affine)
    assert again.capture_again_to(out, told, clip)[1] == "nothing had to be tracked again"
    assert [path.name for path in tmp_path.iterdir()] == ["frog.motion.json"]


def test_an_interrupt_before_it_is_saved_keeps_what_is_done(clip: Clip, shot: Shot, tmp_path):
    def stop(label: str, done: int, total: int | None) -> None:
        if label == "saving":
            raise KeyboardInterrupt

    out, few = tmp_path / "frog.motion.json", clip_of([clip[t] for t in range(3)])
    only_sit = without(shot, "crouch", "leap")
    with listening(stop), pytest.raises(KeyboardInterrupt):
        batch.capture_to(out, only_sit, few)
    assert [path.name for path in tmp_path.iterdir()] == ["frog.motion.json.part"]
    looked = []
    with listening(lambda label, done, total: looked.append(label)):
        batch.capture_to(out, only_sit, few)
    assert [path.name for path in tmp_path.iterdir()] == ["frog.motion.json"]
    assert looked == ["frog", "saving"]  # no frame was looked at again


def test_a_capture_that_was_interrupted_is_finished_though_its_shot_was_changed(clip: Clip, shot: Shot, poor, tmp_path):
    out, begun, done = tmp_path / "frog.motion.json", without(shot, "crouch"), []

    def until_frame_8(label: str, number: int, total: int | None) -> None:
        if number >= 8:
            raise KeyboardInterrupt

    with listening(until_frame_8), pytest.raises(KeyboardInterrupt):
        batch.capture_to(out, begun, clip)
    assert again.go_on(out, begun, clip) == "" == again.go_on(out, moved(begun, "sit", (3, 0)), clip)
    with listening(lambda label, number, total: label == "frog" and done.append(number)):
        assert again.go_on(out, _last(shot, "crouch"), clip) == "tracked again: frog in 0 to 26"
    assert next(number for number in done if number) >= 8  # the first that was looked at now
    found = tracks.load(out)
    assert np.abs(found.points("frog")[26:] - poor.points("frog")[26:]).max() < 1e-6
    assert [path.name for path in tmp_path.iterdir()] == ["frog.motion.json"]
