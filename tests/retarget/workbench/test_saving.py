"""Documents saved by themselves: a folder is left as it was found, and what cannot be written is not lost."""

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest

from capture import files
from capture.pictures.shot import read_shot
from retarget.workbench import session as sessions
from retarget.workbench.session import Session


def content(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_undoing_all_leaves_the_folder_as_it_was_found_and_redoing_brings_all_back(hop, session, folder):
    found = content(folder)
    hop.done(session, "capture.box", part="character", frame=0, box=[10, 20, 60, 50])
    hop.done(session, "capture.outline", part="character", frame=2, points=hop.ring(2))
    made = content(folder)
    assert set(made) - set(found) == {"hop.shot.toml"}
    for _ in range(3):
        hop.done(session, "undo")
    assert content(folder) == found
    for _ in range(3):
        hop.done(session, "redo")
    assert content(folder) == made


def test_undoing_all_leaves_a_shot_that_was_there_as_it_was(hop, folder):
    (folder / "hop.shot.toml").write_text('clip = "hop.mp4"\n[[parts]]\nname = "bean"\n[[parts.keys]]\nframe = 2\n')
    session = Session(folder, "hop.shot.toml")
    before = session.state.shot
    hop.done(session, "capture.add_part", name="hat")
    hop.done(session, "undo")
    assert read_shot(folder / "hop.shot.toml") == before


def test_what_is_only_opened_or_closed_writes_nothing(hop, session, folder):
    found = content(folder)
    hop.done(session, "folder.close")
    hop.done(session, "folder.open", file="hop.mp4")
    session.close()
    assert content(folder) == found


def test_a_shot_taken_back_that_another_program_changed_is_left_alone(hop, session, folder):
    hop.done(session, "capture.add_part", name="hat")
    (folder / "hop.shot.toml").write_text("clip = 'hop.mp4'\n")
    events = hop.done(session, "undo")
    assert any(event["kind"] == "told" and event["why"] == "elsewhere" for event in events)
    assert (folder / "hop.shot.toml").read_text() == "clip = 'hop.mp4'\n"


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EACCES, errno.EROFS])
def test_what_cannot_be_written_is_told_kept_and_written_when_it_can_be(hop, session, folder, monkeypatch, number):
    heard = []
    session.listen(heard.append)
    monkeypatch.setattr(sessions, "TRIED_AGAIN", 0.05)
    hop.done(session, "capture.add_part", name="hat")
    before = content(folder)

    def refused(*given):
        raise OSError(number, os.strerror(number))

    with monkeypatch.context() as patched:
        patched.setattr(files.os, "replace", refused)
        hop.done(session, "capture.add_part", name="arm")
        (told,) = [event for event in heard if event["kind"] == "told"]
        assert told["why"] == "unwritable" and told["sentence"].startswith("not saved yet, but kept here")
        hop.done(session, "capture.add_part", name="leg")
        assert len([event for event in heard if event["kind"] == "told"]) == 1  # it is said once
        assert content(folder) == before and len(session.state.shot.parts) == 4
    hop.until(lambda: heard[-1]["kind"] == "told", seconds=5)
    assert heard[-1]["why"] == "saved"
    assert read_shot(folder / "hop.shot.toml").parts == session.state.shot.parts


def test_a_file_that_cannot_be_taken_away_is_told_as_well(hop, session, monkeypatch):
    hop.done(session, "capture.add_part", name="hat")

    def refused(*given, **more):
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(Path, "unlink", refused)
    events = hop.done(session, "undo")
    assert any(event["kind"] == "told" and "Permission denied" in event["sentence"] for event in events)
    monkeypatch.undo()
    assert session.save() == []


FULL = """
import resource, sys
from retarget.workbench.session import Session
session = Session(sys.argv[1], "hop.mp4")
session.act({"do": "capture.add_part", "name": "hat"})
resource.setrlimit(resource.RLIMIT_FSIZE, (150, resource.RLIM_INFINITY))
events = session.act({"do": "capture.outline", "part": "hat", "frame": 0, "points": eval(sys.argv[2])})
told = [event["sentence"] for event in events if event["kind"] == "told"]
resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
print(len(told), told[0], sorted(path.name for path in session.state.folder.iterdir()))
session.close()
"""


@pytest.mark.skipif(os.name != "posix", reason="the size of files is limited as POSIX has it")
def test_on_a_disk_without_room_nothing_is_half_written(hop, folder):
    command = [sys.executable, "-c", FULL, str(folder), repr(hop.ring())]
    root = str(Path(__file__).resolve().parents[3])
    said = subprocess.run(command, capture_output=True, text=True, cwd=root, check=True).stdout
    assert said.startswith("1 not saved yet") and "disk" in said and "['hop.mp4', 'hop.shot.toml']" in said
    assert len(read_shot(folder / "hop.shot.toml").parts[1].keys[0].outline) > 10  # later there was room


def test_a_document_that_cannot_be_written_keeps_none_of_the_others_from_it(hop, tmp_path):
    session = Session(tmp_path)
    hop.done(session, "posing.begin", who="human")
    hop.done(session, "posing.drag", joint=len(session.state.figure.skeleton) - 1, to=[0.5, 1.0, 0.2])
    before = (tmp_path / "human.posing.json").read_text()
    (tmp_path / "human.postures.json").write_text("{}")  # by another program
    events = hop.done(session, "posing.keep", name="reach")
    assert any(event["kind"] == "told" and event["why"] == "elsewhere" for event in events)
    assert (tmp_path / "human.postures.json").read_text() == "{}"
    assert (tmp_path / "human.posing.json").read_text() != before


def test_undoing_all_at_the_posing_desk_leaves_the_folder_as_it_was_found(hop, tmp_path):
    session = Session(tmp_path)
    hop.done(session, "posing.begin", who="human")
    assert content(tmp_path) == {}
    hop.done(session, "posing.put", posture=session.state.figure.pool.names()[0], beat=1.0)
    made = content(tmp_path)
    assert set(made) == {"human.postures.json", "human.dance.toml"}  # a dance is played with the postures of a file
    hop.done(session, "posing.drag", joint=3, to=[0.5, 1.0, 0.2])
    for _ in range(2):
        hop.done(session, "undo")
    assert content(tmp_path) == {}
    hop.done(session, "redo")
    assert content(tmp_path) == made
