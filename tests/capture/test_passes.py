"""How a clip is gone through, with a tracker that can be made to fail: which frames, from where, and what comes of it."""

import re
from dataclasses import fields, replace
from types import SimpleNamespace

import numpy as np
import pytest

from capture.fit import meet, passes
from capture.fit import poses as tables
from capture.fit.checkpoint import Keep
from capture.fit.passes import State
from capture.fit.pixels.find import Pose
from capture.pictures.clip import Clip, clip_of

SQUARE = np.array([[0.0, 0], [20, 0], [20, 20], [0, 20]])
REACH = 10.0  # pixels: how far from the pose before the tracker below looks


def part(name: str = "box") -> SimpleNamespace:
    """What the passes ask of a learnt part: a square of one key."""
    keyset = SimpleNamespace(points=SQUARE[None], outline=np.arange(4))
    return SimpleNamespace(part=SimpleNamespace(name=name), colors=None, shape=None, keyset=keyset)


def standing(x: float, **more) -> Pose:
    return Pose(np.array([[1.0, 0, x], [0, 1, 0]]), np.zeros(0), **more)


def counting_clip(frames: int) -> Clip:
    """Pictures that hold nothing but their number."""
    return clip_of([np.full((2, 2, 3), t, np.uint8) for t in range(frames)])


@pytest.fixture
def tracker(monkeypatch: pytest.MonkeyPatch):
    """A tracker that finds a part at `way[name][t]` if that is near its last pose; NaN is nowhere.

    It notes the frames it was asked for, and whom it was handed.
    """
    world = SimpleNamespace(way={}, asked=[], fails_at=None)

    def find(picture, sightings):
        t = int(picture[0, 0, 0])
        if len(world.asked) == world.fails_at:
            raise world.error
        world.asked.append((t, {s.model.part.name: s for s in sightings}))
        return tuple(_next(world.way[s.model.part.name][t], s, picture) for s in sightings)

    monkeypatch.setattr(passes.finding, "find", find)
    return world


def _next(x, sighting, picture):
    pose = sighting.pose
    if sighting.drawn is picture:  # like a held drawing
        return replace(sighting, pose=replace(pose, held=True))
    if not abs(x - pose.placed[0, 2]) <= REACH:
        return replace(sighting, pose=replace(pose, visible=False))
    return replace(sighting, pose=standing(x, misfit=0.1), drawn=picture)


def gone_through(way: dict, keys: dict, keep: Keep | None = None, learnt: list | None = None) -> tuple[State, dict]:
    """The state when all is done, and for each part where it was found (T,), NaN where it was not seen."""
    learnt = learnt or [part(name) for name in way]
    frames = len(next(iter(way.values())))
    known = [{t: standing(way[name][t]) for t in keys[name]} for name in way]
    state = passes.go_through(learnt, known, counting_clip(frames), keep)
    found = {}
    for model, forward, backward in zip(learnt, state.forward, state.backward):
        poses = meet.joined(model, forward, backward)
        assert poses.known.all()
        x = poses.columns["placed"][:, 0, 2]
        found[model.part.name] = np.where(poses.columns["visible"], x, np.nan)
    return state, found


def asked_frames(tracker) -> list[int]:
    return [t for t, _ in tracker.asked]


def test_a_part_that_is_never_lost_is_looked_for_once_in_every_frame(tracker):
    tracker.way = {"box": 3.0 * np.arange(9)}
    _, found = gone_through(tracker.way, {"box": [0, 5]})
    assert asked_frames(tracker) == list(range(9))
    assert np.array_equal(found["box"], tracker.way["box"])


def test_from_a_key_in_the_middle_it_goes_on_and_back(tracker):
    tracker.way = {"box": 3.0 * np.arange(9)}
    _, found = gone_through(tracker.way, {"box": [4]})
    assert asked_frames(tracker) == [4, 5, 6, 7, 8, 4, 3, 2, 1, 0]
    assert np.array_equal(found["box"], tracker.way["box"])


def test_what_is_out_of_reach_is_found_from_the_key_behind_it(tracker):
    tracker.way = {"box": np.where(np.arange(12) < 5, 0.0, 300.0)}
    _, found = gone_through(tracker.way, {"box": [0, 9]})
    assert np.array_equal(found["box"], tracker.way["box"])
    # forwards, at the key once more from the key itself, and back from there
    assert asked_frames(tracker) == [*range(10), 9, 10, 11, *range(9, 0, -1)]


def test_backwards_ends_where_both_runs_are_of_one_mind(tracker):
    way = np.zeros(30)
    way[20] = np.nan
    way[21:] = 300.0
    tracker.way = {"box": way}
    _, found = gone_through(tracker.way, {"box": [0, 24]})
    assert np.array_equal(found["box"], way, equal_nan=True)
    way[10:20] = 5.0  # seen from both sides: the run backwards meets the other at 19 and stops
    way[20:] = 12.0
    tracker.asked.clear()
    _, found = gone_through(tracker.way, {"box": [0, 24]})
    assert np.array_equal(found["box"], way)
    assert asked_frames(tracker) == list(range(30))


def test_a_loss_between_keys_is_looked_at_from_behind_even_if_the_part_was_found_again(tracker, monkeypatch):
    way = np.zeros(16)
    plain = passes.finding.find
    going = {"last": -1}

    def shy(picture, sightings):  # in frames 6 and 7 it can be seen only by who comes from behind
        t = int(picture[0, 0, 0])
        back, going["last"] = t < going["last"], t
        tracker.way = {"box": np.where((not back) & np.isin(np.arange(16), (6, 7)), np.nan, way)}
        return plain(picture, sightings)

    monkeypatch.setattr(passes.finding, "find", shy)
    _, found = gone_through({"box": way}, {"box": [0, 12]})
    assert np.array_equal(found["box"], way)
    assert asked_frames(tracker) == [*range(16), 8, 7, 6, 5]


def test_frames_in_which_nobody_sees_the_part_hold_the_pose_before(tracker):
    way = np.append(np.zeros(5), [np.nan] * 4 + [8.0] * 6)
    tracker.way = {"box": way}
    state, found = gone_through(tracker.way, {"box": [0, 12]})
    assert np.array_equal(found["box"], way, equal_nan=True)
    poses = meet.joined(part(), state.forward[0], state.backward[0])
    assert poses.columns["placed"][:, 0, 2].tolist() == [0.0] * 9 + [8.0] * 6


def test_a_part_that_begins_later_is_looked_for_before_its_key_while_the_others_stand_still(tracker):
    tracker.way = {"box": np.zeros(8), "ball": 2.0 * np.arange(8)}
    _, found = gone_through(tracker.way, {"box": [0], "ball": [5]})
    assert np.array_equal(found["ball"], tracker.way["ball"])
    t, handed = tracker.asked[-2]
    assert t == 1 and handed["box"].pose.visible and handed["box"].drawn is not None
    assert [set(handed) for t, handed in tracker.asked[:5]] == [{"box"}] * 5


def test_a_key_pose_holds_where_the_tracker_does_not_find_it(tracker):
    way = np.zeros(8)
    tracker.way = {"box": np.where(np.arange(8) == 4, 5.0, way)}  # drawn to something else in the key frame
    learnt, clip = [part()], counting_clip(8)
    state = passes.go_through(learnt, [{0: standing(0.0), 4: standing(0.0)}], clip)
    assert tables.at(state.forward[0], 4).placed[0, 2] == 0.0
    assert not state.arrived[0][4] and state.arrived[0][[0, 1, 2, 3, 5, 6, 7]].all()


@pytest.mark.parametrize("error", [RuntimeError("a crash"), KeyboardInterrupt()])
def test_wherever_it_is_interrupted_it_goes_on_to_the_same_poses(tracker, tmp_path, capsys, error):
    way = {"box": np.where(np.arange(12) < 5, 0.0, 300.0), "ball": 2.0 * np.arange(12)}
    keys = {"box": [2, 9], "ball": [3]}
    tracker.way, tracker.error = way, error
    whole, found = gone_through(way, keys)
    steps = len(tracker.asked)
    for fails_at in range(1, steps):
        tracker.asked.clear()
        tracker.fails_at = fails_at
        keep, learnt = Keep(tmp_path / f"{fails_at}.part", "the same", first=100), [part(name) for name in way]
        with pytest.raises(type(error)) as told:
            gone_through(way, keys, keep, learnt)
        if isinstance(error, KeyboardInterrupt):
            assert re.search(r"same command again goes (on|back) from frame 1\d\d$", str(told.value))
        tracker.fails_at = None
        state, again = gone_through(way, keys, keep, learnt)
        assert steps <= len(tracker.asked) <= steps + 1  # a second look in one frame may have been lost, no more
        assert all(np.array_equal(found[name], again[name], equal_nan=True) for name in way)
        for run in ("forward", "backward"):
            for one, other in zip(getattr(whole, run), getattr(state, run)):
                assert all(np.array_equal(one.columns[field.name], other.columns[field.name]) for field in fields(Pose))
    assert "is left from a capture that was interrupted: this one goes" in capsys.readouterr().err


def test_when_all_frames_are_done_nothing_is_looked_at_again(tracker, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(passes, "KEPT_EVERY", 0)
    tracker.way = {"box": 3.0 * np.arange(9)}
    keep, learnt = Keep(tmp_path / "x.part", "the same"), [part()]
    _, found = gone_through(tracker.way, {"box": [0]}, keep, learnt)
    tracker.asked.clear()
    _, again = gone_through(tracker.way, {"box": [0]}, keep, learnt)
    assert tracker.asked == [] and np.array_equal(found["box"], again["box"])
    assert "this one has all frames" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("way", "key_frames", "totals"),
    [
        (3.0 * np.arange(12), [2], {10 + 3}),  # forwards from the key, and back from it
        (3.0 * np.arange(12), [0, 9], {12}),
        (np.where(np.arange(12) < 5, 0.0, 300.0), [0, 9], {12, 12 + 9}),  # what must be mended shows at the end
    ],
)
def test_the_bar_counts_the_frames_of_both_ways(tracker, way, key_frames, totals):
    tracker.way = {"box": way}
    learnt, tasks = [part()], passes.tasks_of([{t: standing(way[t]) for t in key_frames}], 12)
    state = passes.beginning(tasks, 12)
    seen = [state, *passes._onward(learnt, tasks, counting_clip(12), state)]
    assert {after.done + passes._ahead(tasks, after) for after in seen} == totals
    assert seen[-1].done == max(totals)


def captured_before(way: np.ndarray, ways: tuple, sure: set) -> passes.Before:
    """What a capture found of a part, all of it but the frames of some ways."""
    poses = tables.empty(len(way), standing(0.0))
    for t, x in enumerate(way):
        tables.put(poses, t, standing(x, visible=bool(np.isfinite(x))))
    for a, b in ways:
        poses.known[[t for t in range(a, b + 1) if t not in sure]] = False
    return passes.Before(poses, ways, frozenset(sure))


def test_again_only_the_ways_are_gone_through_and_start_and_end_where_it_was_captured(tracker):
    tracker.way = {"box": 3.0 * np.arange(20), "hat": np.full(20, 50.0)}
    old = [captured_before(tracker.way["box"] - 0.25, ((4, 9), (9, 12)), {4, 9, 12}),
           captured_before(tracker.way["hat"], (), set())]  # fmt: skip
    keys = [{t: standing(3.0 * t) for t in (4, 6, 9, 10, 12)}, {0: standing(50.0)}]
    learnt = [part("box"), part("hat")]
    state = passes.go_through(learnt, keys, counting_clip(20), before=old)
    assert asked_frames(tracker) == [*range(4, 13)]
    assert all(set(seen) == {"box", "hat"} for _, seen in tracker.asked)
    assert all(seen["hat"].drawn is not None for _, seen in tracker.asked)  # it stands, and is not looked for
    poses = meet.joined(learnt[0], state.forward[0], state.backward[0])
    shown = poses.columns["placed"][:, 0, 2] - tracker.way["box"]
    assert np.array_equal(shown, np.where(np.isin(np.arange(20), (5, 6, 7, 8, 10, 11)), 0, -0.25))


def test_again_what_arrives_astray_is_looked_for_from_the_captured_pose_behind_it(tracker):
    way = np.where(np.arange(20) < 9, 0.0, 300.0)
    tracker.way = {"box": way}
    old = captured_before(way, ((3, 14),), {3, 14})
    state = passes.go_through([part()], [{3: standing(0.0), 6: standing(0.0)}], counting_clip(20), before=[old])
    assert asked_frames(tracker) == [*range(3, 15), 14, *range(14, 6, -1)]
    poses = meet.joined(part(), state.forward[0], state.backward[0])
    assert np.array_equal(poses.columns["placed"][:, 0, 2], way) and poses.columns["visible"].all()


def test_again_before_the_first_key_it_is_looked_for_backwards_to_the_clip_s_begin(tracker):
    way = 3.0 * np.arange(12)
    tracker.way = {"box": way}
    old = captured_before(way, ((0, 7),), {7})
    state = passes.go_through([part()], [{3: standing(9.0), 9: standing(27.0)}], counting_clip(12), before=[old])
    assert asked_frames(tracker) == [*range(3, 8), *range(3, -1, -1)]
    poses = meet.joined(part(), state.forward[0], state.backward[0])
    assert np.array_equal(poses.columns["placed"][:, 0, 2], way)
