"""`tooncap batch`: a line for each shot in the order given, and what fails does not stop the rest."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from capture.fit import batch
from capture.motion import tracks
from capture.pictures.clip import clip_of
from fixtures import ball, write
from retarget.cli import main


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with three frames of the ball, in two shots and one whose clip is missing."""
    folder = tmp_path_factory.mktemp("drawn")
    toon = ball.ball()
    clip = clip_of(np.stack([toon.frame(t) for t in range(3)]))
    for name in ("hop", "gone", "skip"):
        write.write_toon(replace(toon, name=name), folder, clip)
    (folder / "gone.mp4").unlink()
    return folder


@pytest.fixture
def threads(monkeypatch: pytest.MonkeyPatch):
    """Threads in the place of processes, which take seconds to begin."""
    monkeypatch.setattr(batch, "processes", ThreadPoolExecutor)


def refused(capsys: pytest.CaptureFixture, folder: Path, *words: object) -> str:
    """Run the command, which must refuse in one sentence and leave the folder as it was; returns the sentence."""
    before = sorted(folder.rglob("*"))
    assert main(["batch", *(str(word) for word in words)]) == 2
    said = capsys.readouterr()
    assert said.out == "" and len(said.err.strip().splitlines()) == 1 and "Traceback" not in said.err
    assert sorted(folder.rglob("*")) == before
    return said.err


def test_every_shot_gets_its_motion_and_its_line(drawn, threads, capsys):
    shots = [drawn / "skip.shot.toml", drawn / "hop.shot.toml"]
    assert main(["batch", *map(str, shots)]) == 0
    skip, hop, closing = capsys.readouterr().out.splitlines()
    assert skip.startswith(f"{shots[0]}: 1 part, 3 frames, worst misfit ")
    assert hop.startswith(f"{shots[1]}: 1 part, 3 frames, worst misfit ")
    assert closing == "2 of 2 shots captured"
    for name in ("skip", "hop"):
        assert len(tracks.load(drawn / f"{name}.motion.json").times) == 3
        (drawn / f"{name}.motion.json").unlink()


@pytest.mark.parametrize("where", ["processes", "cluster"])
def test_a_shot_that_fails_is_told_and_the_exit_code_says_so(where, drawn, tmp_path, capsys, monkeypatch, request):
    flags = ["--jobs", "1"] if where == "processes" else ["--scheduler", request.getfixturevalue("cluster")]
    monkeypatch.chdir(drawn)  # where the workers of a cluster do not stand
    assert main(["batch", "*.shot.toml", "-o", str(tmp_path / "out"), *flags]) == 1
    said = capsys.readouterr()
    gone, hop, skip = said.out.splitlines()
    assert gone.startswith("gone.shot.toml: failed: ") and "the clip must exist" in gone
    assert hop.startswith("hop.shot.toml: 1 part") and skip.startswith("skip.shot.toml: 1 part")
    assert said.err == "tooncap: 2 of 3 shots captured, 1 failed: gone.shot.toml\n"
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["hop.motion.json", "skip.motion.json"]


def test_an_interrupted_batch_says_how_to_go_on_and_passes_over_what_is_there(
    drawn, threads, tmp_path, capsys, monkeypatch
):
    words = [
        "batch",
        *(str(drawn / f"{name}.shot.toml") for name in ("hop", "skip")),
        "--jobs",
        "1",
        "-o",
        str(tmp_path),
    ]

    def one_and_no_more(jobs, executor, **_):
        yield batch.attempt(batch.capture, jobs[0])
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(batch, "run", one_and_no_more)
        assert main(words) == 130
    said = capsys.readouterr()
    assert said.err == "tooncap: interrupted; the same command with --missing goes on from where it was\n"
    (tmp_path / "hop.motion.json").write_text("as it was")
    assert main([*words, "--missing"]) == 0
    line, closing = capsys.readouterr().out.splitlines()
    assert line.startswith(f"{drawn / 'skip.shot.toml'}: 1 part")
    assert closing == "1 of 1 shots captured, 1 passed over whose motion is there"
    assert (tmp_path / "hop.motion.json").read_text() == "as it was"
    assert main([*words, "--missing"]) == 0
    assert capsys.readouterr().out == "no shot left to capture, 2 passed over whose motion is there\n"


def test_two_shots_that_would_write_one_file_are_refused_before_anything_runs(drawn, tmp_path, capsys):
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "hop.shot.toml").write_bytes((drawn / "hop.shot.toml").read_bytes())
    shots = [drawn / "hop.shot.toml", tmp_path / "other" / "hop.shot.toml"]
    said = refused(capsys, tmp_path, *shots, "-o", tmp_path / "out")
    assert all(str(shot) in said for shot in shots) and str(tmp_path / "out" / "hop.motion.json") in said
    assert "a file of its own" in refused(capsys, tmp_path, shots[0], drawn / "." / "hop.shot.toml")


def test_what_cannot_be_meant_is_refused(drawn, tmp_path, capsys):
    hop = drawn / "hop.shot.toml"
    assert f"there is no {tmp_path / 'hup.shot.toml'}" in refused(capsys, tmp_path, hop, tmp_path / "hup.shot.toml")
    assert "there is no" in refused(capsys, tmp_path, tmp_path / "*.shot.toml")
    assert "at least one file" in refused(capsys, tmp_path)
    assert "at least 1 shot at a time, got 0" in refused(capsys, tmp_path, hop, "--jobs", "0")
    both = ["--jobs", "2", "--scheduler", "tcp://127.0.0.1:9"]
    assert "leave one of the two out" in refused(capsys, tmp_path, hop, *both, "-o", tmp_path / "out")
