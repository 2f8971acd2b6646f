"""Long work at the workbench, in processes of their own: captured, mended, cancelled, killed."""

import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import shapely

from capture.motion import tracks
from capture.pictures.encode import write_clip
from capture.pictures.shot import read_shot
from retarget.cli import main
from retarget.workbench.capturing import work
from retarget.workbench.session import Session


@pytest.fixture(scope="module")
def captured(hop, clip):
    """A folder in which the bean was captured at the workbench, from a box; and the events of that."""
    folder = clip.parent
    session = Session(folder, "hop.mp4")
    heard = []
    session.listen(heard.append)
    hop.done(session, "capture.box", part="character", frame=0, box=hop.around(0))
    for name, fields in (("capture.suggest", {"part": "character", "residual": 0.8}), ("capture.capture", {})):
        assert session.act({"work": name, **fields})[-1]["kind"] == "done"
        hop.finished(session)
    return session, heard


def test_the_bean_is_captured_from_a_box_and_lies_where_it_was_drawn(hop, captured):
    session, heard = captured
    motion = tracks.load(session.state.folder / "hop.motion.json")
    assert len(session.state.shot.parts[0].keys) > 1 and session.state.motion is not None
    for t in (0, 7, 20, hop.frames - 1):
        off = shapely.distance(shapely.points(motion.outline("character")[t]), shapely.LinearRing(hop.drawn_at(t)))
        assert np.median(off) < 2.2 and off.max() < 5  # a traced outline lies round the ink, at its tips the farthest
    shares = [event["done"] / event["total"] for event in heard if event["kind"] == "progress" and event["total"]]
    assert shares and 0 < max(shares) <= 1  # how many are heard depends on how busy the machine is
    assert not (session.state.folder / "hop.motion.json.part").exists()


def test_a_mended_frame_becomes_a_key_that_lies_where_it_was_captured(hop, captured):
    session, _ = captured
    key_frames = {key.frame for key in session.state.shot.parts[0].keys}
    frame = next(t for t in range(hop.frames) if t not in key_frames)
    shown = session.shown()["changed"]["capture"]
    assert not shown["stale"]
    hop.done(session, "capture.fix_frame", part="character", frame=frame)
    key = session.state.shot.parts[0].keys[-1]
    count = len(key.outline)
    assert key.frame == frame
    assert np.allclose(key.outline, session.state.motion.points("character")[frame, :count], atol=1e-3)
    assert session.shown()["changed"]["capture"]["stale"]
    hop.done(session, "undo")
    assert not session.shown()["changed"]["capture"]["stale"]


def test_a_mended_frame_is_tracked_again_between_its_keys_and_the_rest_stays(hop, folder):
    frames = 26
    write_clip(folder / "hop.mp4", [hop.picture(t) for t in range(frames)], 24)
    session, told = Session(folder, "hop.mp4"), []
    for t in (0, 12, 24):
        hop.done(session, "capture.outline", part="character", frame=t, points=hop.ring(t))
    assert "capture first" in hop.refused(session, {"work": "capture.again"})
    session.act({"work": "capture.capture"})
    hop.finished(session)
    before = session.state.motion
    hop.done(session, "capture.fix_frame", part="character", frame=18)
    shown = session.shown()["changed"]["capture"]
    assert shown["stale"] and shown["again"] == {
        "ranges": [{"part": "character", "first": 12, "last": 24}],
        "whole": "",
    }
    session.listen(told.append)
    session.act({"work": "capture.again"})
    hop.finished(session)
    assert told[-1]["sentence"] == "Tracked again: character in 12 to 24." and told[-1]["made"]
    after = session.state.motion
    outside = [*range(13), *range(24, frames)]
    assert np.abs(after.points("character") - before.points("character"))[outside].max() < 1e-6
    assert np.abs(after.points("character")[18, : hop.points] - before.points("character")[18, : hop.points]).max() < 1
    assert not session.shown()["changed"]["capture"]["stale"]
    again = Session(folder, "hop.shot.toml")
    assert not again.shown()["changed"]["capture"]["stale"]  # the motion's own file tells what it is of
    hop.done(session, "undo")
    assert session.state.motion is before
    assert Session(folder, "hop.shot.toml").shown()["changed"]["capture"]["stale"]
    hop.done(session, "capture.drag_point", part="character", key="rest", index=0, to=[91.0, 130.0])
    assert "first key" in session.shown()["changed"]["capture"]["again"]["whole"]
    session.act({"work": "capture.again"})
    hop.finished(session)
    assert told[-1]["sentence"].startswith("The whole was captured, for the first key")


def test_the_command_line_tracks_again_what_the_shot_s_file_says_was_changed(hop, captured, tmp_path, capsys):
    for name in ("hop.mp4", "hop.shot.toml", "hop.motion.json"):
        (tmp_path / name).write_bytes((captured[0].state.folder / name).read_bytes())
    shot, out = str(tmp_path / "hop.shot.toml"), str(tmp_path / "hop.motion.json")
    assert main(["capture", shot, "-o", out, "--again"]) == 0
    assert "nothing had to be tracked again" in capsys.readouterr().out
    assert main(["capture", shot, "-o", out, "--again", "--refine"]) == 2
    assert main(["capture", shot, "-o", str(tmp_path / "none.motion.json"), "--again"]) == 2
    said = capsys.readouterr().err.strip().splitlines()
    assert len(said) == 2 and "give one of the two" in said[0] and "there is no" in said[1]


def test_a_part_told_by_a_box_keeps_its_drawings_when_a_frame_is_mended(hop, folder):
    session = Session(folder, "hop.mp4")
    hop.done(session, "capture.box", part="character", frame=0, box=hop.around(0))
    session.act({"work": "capture.capture"})
    hop.finished(session)
    hop.done(session, "capture.fix_frame", part="character", frame=20)
    assert session.shown()["changed"]["capture"]["again"]["ranges"] == [{"part": "character", "first": 0, "last": 35}]
    hop.done(session, "capture.pivot", part="character", at=[50, 120])
    assert session.state.shot.parts[0].pivot == (50, 120)
    hop.done(session, "capture.pivot", part="character")
    assert session.state.shot.parts[0].pivot is None


def test_refining_is_offered_only_where_it_can_be_done(hop, session, monkeypatch):
    hop.done(session, "capture.outline", part="character", frame=0, points=hop.ring())
    monkeypatch.setattr(work, "find_spec", lambda name: None)
    work.why_not_refined.cache_clear()
    assert "torch" in session.shown()["changed"]["capture"]["refining"]
    assert "pip install" in hop.refused(session, {"work": "capture.capture", "refined": True})
    monkeypatch.undo()
    work.why_not_refined.cache_clear()


def test_undoing_a_capture_takes_its_file_and_redoing_it_brings_it_back(hop, captured):
    session, _ = captured
    path = session.state.folder / "hop.motion.json"
    before = path.read_text()
    hop.done(session, "undo")
    assert not path.exists() and session.state.motion is None
    hop.done(session, "redo")
    assert path.read_text() == before


def test_opened_again_the_work_is_where_it_was(hop, captured):
    session, _ = captured
    again = Session(session.state.folder, "hop.shot.toml")
    assert again.state.shot.parts == session.state.shot.parts
    assert np.array_equal(again.state.motion.tracks[0].affine, session.state.motion.tracks[0].affine)
    assert again.shown()["changed"]["capture"]["parts"] == session.shown()["changed"]["capture"]["parts"]


def test_a_cancelled_capture_keeps_what_it_has_and_goes_on(hop, session, folder):
    told = []
    session.listen(told.append)
    hop.done(session, "capture.outline", part="character", frame=0, points=hop.ring())
    session.act({"work": "capture.capture"})
    assert "one thing at a time" in hop.refused(session, {"work": "capture.capture"})
    hop.until(lambda: any(event["kind"] == "progress" and event["done"] > 3 for event in told))
    hop.done(session, "cancel")
    hop.finished(session)
    assert told[-1]["kind"] == "ended" and told[-1]["sentence"] == "stopped"
    assert session.state.motion is None and session.shown()["changed"]["capture"]["kept"]
    told.clear()
    session.act({"work": "capture.capture"})
    hop.finished(session)
    assert session.state.motion is not None
    first = next(event for event in told if event["kind"] == "progress" and event["done"])
    assert first["done"] > 3  # it did not begin anew


def test_what_is_changed_while_a_capture_runs_is_kept_and_makes_it_stale(hop, folder):
    session = Session(folder, "hop.mp4")
    hop.done(session, "capture.outline", part="character", frame=0, points=hop.ring())
    session.act({"work": "capture.capture"})
    hop.done(session, "capture.drag_point", part="character", key="rest", index=0, to=[91.0, 130.0])
    hop.finished(session)
    assert session.state.motion is not None and session.shown()["changed"]["capture"]["stale"]
    assert hop.outline_of(session)[0].tolist() == [91.0, 130.0]
    hop.done(session, "undo")  # the capture; what was changed meanwhile stays
    assert hop.outline_of(session)[0].tolist() == [91.0, 130.0]


SERVED = """
import sys, time
from retarget.workbench.session import Session
session = Session(sys.argv[1], "hop.mp4")
session.listen(lambda event: print(event["kind"], event.get("done", ""), flush=True))
session.act({"do": "capture.outline", "part": "character", "frame": 0, "points": eval(sys.argv[2])})
session.act({"work": "capture.capture"})
drag = {"part": "character", "key": "rest", "index": 0, "gesture": "g"}
for step in range(10 ** 6):
    if sys.argv[3] == "drags":
        session.act({"do": "capture.drag_point", **drag, "to": [90.0 + 0.001 * (step % 9000), 130.0]})
    time.sleep(0.01)
"""


def killed_in_a_capture(hop, folder, meanwhile):
    """How many frames were told as done, and when, by a workbench that was killed (SIGKILL) while it captured."""
    root = str(Path(__file__).resolve().parents[3])
    command = [sys.executable, "-c", SERVED, str(folder), repr(hop.ring()), meanwhile]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=root) as killed:
        done = 0
        for line in killed.stdout:
            kind, _, number = line.strip().partition(" ")
            done = max(done, int(number or 0) if kind == "progress" else 0)
            if done > 4:
                break
        at = time.time()
        killed.kill()
    hop.until(lambda: (folder / "hop.motion.json.part").exists() or (folder / "hop.motion.json").exists())
    return done, at


@pytest.mark.skipif(os.name != "posix", reason="a process is killed as POSIX has it")
def test_killed_in_the_middle_of_a_drag_the_server_loses_less_than_a_second(hop, folder):
    _, at = killed_in_a_capture(hop, folder, "drags")
    assert at - (folder / "hop.shot.toml").stat().st_mtime < 1
    assert read_shot(folder / "hop.shot.toml").parts[0].keys[0].outline[0] != tuple(hop.ring()[0])


@pytest.mark.skipif(os.name != "posix", reason="a process is killed as POSIX has it")
def test_killed_in_the_middle_of_a_capture_the_server_loses_no_finished_frame(hop, folder):
    done, _ = killed_in_a_capture(hop, folder, "rests")
    again, told = Session(folder, "hop.shot.toml"), []
    if (folder / "hop.motion.json").exists():
        pytest.skip("the capture was over before it could be killed")
    assert again.shown()["changed"]["capture"]["kept"]
    again.listen(told.append)
    again.act({"work": "capture.capture"})
    hop.finished(again)
    first = next(event["done"] for event in told if event["kind"] == "progress" and event["done"])
    assert first > done and again.state.motion is not None
