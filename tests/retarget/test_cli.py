"""The command: what it leaves, and that bad input is one sentence, exit code 2 and nothing half-written."""

import json
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from capture.motion import tracks
from capture.pictures import clip as clip_module
from capture.pictures.clip import clip_of
from capture.pictures.contours import make, write_contours
from capture.pictures.decode import read_clip
from capture.pictures.encode import write_clip
from capture.pictures.shot import read_shot, write_shot
from fixtures import ball, broom, hat, write
from retarget.cli import main

BOX = ["--box", "20", "320", "120", "110"]


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the first frames of the ball: ball.mp4, ball.shot.toml, ball.motion.json and a drawing."""
    folder = tmp_path_factory.mktemp("short")
    toon = ball.ball()
    write.write_toon(toon, folder, clip_of(np.stack([toon.frame(t) for t in range(8)])))
    assert main(["capture", str(folder / "ball.shot.toml"), "-o", str(folder / "ball.motion.json")]) == 0
    square = (
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9"><path d="M1 1 L8 1 L8 8 L1 8 Z" fill="#c33"/></svg>'
    )
    (folder / "square.svg").write_text(square)
    return folder


def refused(capsys: pytest.CaptureFixture, folder: Path, *arguments: object) -> str:
    """Run the command, which must refuse in one sentence and leave the folder as it was; returns the sentence."""
    before = sorted(folder.rglob("*"))
    capsys.readouterr()
    assert main([str(argument) for argument in arguments]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert len(said.err.strip().splitlines()) == 1
    assert "Traceback" not in said.err and "Errno" not in said.err
    assert sorted(folder.rglob("*")) == before
    return said.err


def test_a_shot_is_captured_and_the_closing_line_says_how_well(short: Path, tmp_path: Path, capsys):
    out = tmp_path / "a.motion.json"
    assert main(["capture", str(short / "ball.shot.toml"), "-o", str(out)]) == 0
    (line,) = capsys.readouterr().out.strip().splitlines()
    assert line.startswith(f"{out}: 1 part, 8 frames, worst misfit ")
    assert len(tracks.load(out).times) == 8


def test_a_clip_is_captured_straight_from_a_box_and_its_shot_is_written(short: Path, tmp_path: Path, capsys):
    out = tmp_path / "b.motion.json"
    points = ball.ball().parts[0].points[0]
    low, size = points.min(axis=0) - 6, np.ptp(points, axis=0) + 12
    box = [str(round(float(v))) for v in (*low, *size)]
    assert main(["capture", str(short / "ball.mp4"), "--box", *box, "--name", "ball", "-o", str(out)]) == 0
    assert read_shot(tmp_path / "b.shot.toml").parts[0].name == "ball"
    again = tmp_path / "again.motion.json"
    assert main(["capture", str(tmp_path / "b.shot.toml"), "-o", str(again)]) == 0
    assert np.array_equal(tracks.load(out).tracks[0].affine, tracks.load(again).tracks[0].affine)


def test_a_box_that_cuts_through_the_layer_is_told(short: Path, tmp_path: Path, capsys):
    """Grey beyond the box is background, and so is grey inside it: only the white on it is found."""
    picture = np.full((120, 160, 3), (200, 220, 240), np.uint8)
    picture[20:110, 10:150] = 150
    picture[50:70, 60:90] = 250
    write_clip(tmp_path / "two.mp4", [picture] * 3)
    for box, cut in ((("30", "30", "100", "60"), True), (("4", "12", "152", "104"), False)):
        out = tmp_path / f"{cut}.motion.json"
        assert main(["capture", str(tmp_path / "two.mp4"), "--box", *box, "-o", str(out)]) == 0
        assert ("draw the box wider" in capsys.readouterr().err) == cut


def test_keys_are_suggested_and_the_shot_file_can_be_captured(tmp_path: Path, capsys):
    toon = hat.hat()
    shown = (0, 2, 4, 6, 8, 10, 14, 18, 22, 26, 28, 30, 32)
    write_clip(tmp_path / "hat.mp4", [toon.frame(t) for t in shown])
    points = toon.parts[0].points[0]
    box = [str(round(float(v))) for v in (*(points.min(axis=0) - 6), *(np.ptp(points, axis=0) + 12))]
    out = tmp_path / "hat.shot.toml"
    asked = ["suggest", str(tmp_path / "hat.mp4"), "--box", *box, "--name", "hat", "--residual", "2", "-o", str(out)]
    assert main(asked) == 0
    *why, line = capsys.readouterr().out.strip().splitlines()
    part = read_shot(out).parts[0]
    assert part.name == "hat" and 2 <= len(part.keys) <= 4
    assert part.outlines().shape[0] == len(part.keys)
    assert [told.split(":")[0] for told in why] == [key.name for key in part.keys] and "without it" in why[0]
    assert line.startswith(f"{out}: {len(part.keys)} keys for 13 frames, worst residual ")
    assert all((tmp_path / f"hat.{kind}.png").stat().st_size > 1000 for kind in ("keys", "residual"))
    assert main(["capture", str(out), "-o", str(tmp_path / "hat.motion.json")]) == 0
    track = tracks.load(tmp_path / "hat.motion.json").tracks[0]
    assert track.keys == tuple(key.name for key in part.keys) and track.visible.all()
    assert np.median(track.residual) < 2.5


def test_a_clip_that_is_only_moved_and_squashed_gets_one_key(short: Path, tmp_path: Path, capsys):
    points = ball.ball().parts[0].points[0]
    box = [str(round(float(v))) for v in (*(points.min(axis=0) - 6), *(np.ptp(points, axis=0) + 12))]
    assert main(["suggest", str(short / "ball.mp4"), "--box", *box, "-o", str(tmp_path / "b.shot.toml")]) == 0
    assert "1 key for 8 frames" in capsys.readouterr().out
    assert len(read_shot(tmp_path / "b.shot.toml").parts[0].keys) == 1


def test_an_overlay_shows_every_frame_and_names_the_worst(short: Path, tmp_path: Path, capsys):
    out = tmp_path / "proof.mp4"
    assert main(["overlay", str(short / "ball.shot.toml"), str(short / "ball.motion.json"), "-o", str(out)]) == 0
    assert "8 frames, worst at frame" in capsys.readouterr().out
    assert len(read_clip(out)) == 8
    assert (tmp_path / "proof.misfit.png").stat().st_size > 1000


@pytest.mark.parametrize("name", ["new.mp4", "new.webm", "new.gif", "new", "new.csv"])
def test_a_motion_is_lent_to_a_drawing_in_every_format(short: Path, tmp_path: Path, name: str):
    out = tmp_path / name
    asked = ["retarget", str(short / "ball.motion.json"), "--drawing", str(short / "square.svg"), "-o", str(out)]
    assert main(asked) == 0
    if out.suffix == ".csv":
        assert len(out.read_text().splitlines()) == 9
    else:
        made = read_clip(out)
        assert len(made) == 8
        assert made.size == (640, 480)
        assert made.has_alpha == (name != "new.mp4")


@pytest.mark.parametrize(
    ("name", "begins"),
    [
        ("ball.json", '{"v":'),
        ("ball.svg", "<?xml"),
        ("drawings/0000.svg", "<?xml"),
        ("ball.jsx", "(function"),
        ("ball.curves.json", "{\n"),
    ],
)
def test_a_retarget_can_stay_a_drawing_or_be_curves(short: Path, tmp_path: Path, capsys, name: str, begins: str):
    asked = ["retarget", str(short / "ball.motion.json"), "--drawing", str(short / "square.svg"), "--size", "320"]
    assert main([*asked, "--background", "white", "-o", str(tmp_path / name)]) == 0
    assert str(tmp_path / name) in capsys.readouterr().out
    text = (tmp_path / name).read_text(encoding="utf-8")
    assert text.startswith(begins)
    assert "curves" in name or "320" in text


def test_a_captured_motion_is_never_taken_for_a_lottie_file(short: Path, tmp_path: Path, capsys):
    asked = (short / "ball.motion.json", "--drawing", short / "square.svg", "-o", short / "ball.motion.json")
    before = (short / "ball.motion.json").read_bytes()
    assert ".mp4" in refused(capsys, tmp_path, "retarget", *asked)
    assert (short / "ball.motion.json").read_bytes() == before


def test_a_retarget_can_be_a_body_for_3d_programs(short: Path, tmp_path: Path, capsys):
    asked = ["retarget", str(short / "ball.motion.json"), "--drawing", str(short / "square.svg"), "-o"]
    assert main([*asked, str(tmp_path / "square.glb")]) == 0
    assert (tmp_path / "square.glb").read_bytes()[:8] == b"glTF\x02\0\0\0"
    assert main([*asked, str(tmp_path / "square.gltf")]) == 0
    assert json.loads((tmp_path / "square.gltf").read_text(encoding="utf-8"))["asset"]["version"] == "2.0"
    assert "8 frames" in capsys.readouterr().out.splitlines()[-1]


def test_the_size_asked_for_is_the_size_made(short: Path, tmp_path: Path):
    asked = ["retarget", str(short / "ball.motion.json"), "--drawing", str(short / "square.svg"), "--size", "320"]
    assert main([*asked, "--background", "#fed", "-o", str(tmp_path / "small.mp4")]) == 0
    assert read_clip(tmp_path / "small.mp4").size == (320, 240)


def test_contours_are_captured_and_their_keys_found(tmp_path: Path, capsys):
    part = hat.hat().parts[0]
    write_contours(make(list(part.points[::3]), True, 8.0), tmp_path / "hat.json")
    out = tmp_path / "hat.motion.json"
    assert main(["contour", str(tmp_path / "hat.json"), "-o", str(out), "--name", "hat", "--smooth", "0.05"]) == 0
    assert "its keys are k" in capsys.readouterr().out
    motion = tracks.load(out)
    assert len(motion.times) == len(part.points[::3])
    assert motion.track("hat").residual.max() < 1.5


def test_a_line_of_action_bends_a_drawing(tmp_path: Path, capsys):
    lines = broom.broom().line[:24:3]
    write_contours(make(list(lines), False, 8.0), tmp_path / "broom.json")
    motion, out = tmp_path / "broom.motion.json", tmp_path / "flower.webm"
    assert main(["contour", str(tmp_path / "broom.json"), "-o", str(motion)]) == 0
    flower = write.CHARACTERS / "flower.svg"
    assert main(["retarget", str(motion), "--drawing", str(flower), "--bend", "-o", str(out)]) == 0
    alpha = np.stack([frame[..., 3] for frame in read_clip(out)]) > 127
    tops = [np.argwhere(frame)[0] for frame in alpha]
    leans = lines[:, -1, 0] - lines[:, 0, 0]
    feet = lines[:, 0, 0]
    assert np.corrcoef([top[1] for top in tops] - feet, leans)[0, 1] > 0.9  # the head goes where the line's top goes


def test_crossing_contours_are_refused(tmp_path: Path, capsys):
    bow = np.array([(0, 0), (40, 40), (40, 0), (0, 40)], float)
    (tmp_path / "bow.json").write_text(json.dumps({"frames": [bow.tolist()] * 3}))
    assert "cross" in refused(capsys, tmp_path, "contour", tmp_path / "bow.json", "-o", tmp_path / "a.json")


def test_fixtures_are_written_with_their_truth(tmp_path: Path):
    toon = ball.ball()
    write.write_toon(toon, tmp_path, clip_of(np.stack([toon.frame(t) for t in range(2)])))
    truth = np.load(tmp_path / "ball.truth.npz")
    assert np.array_equal(truth["ball/points"], toon.parts[0].points)
    assert np.allclose(
        read_shot(tmp_path / "ball.shot.toml").parts[0].outlines()[0], toon.parts[0].points[0], atol=1e-3
    )


def test_a_truncated_clip_is_used_as_far_as_it_goes_and_that_is_said(short: Path, tmp_path: Path, capsys):
    toon = ball.ball()
    rng = np.random.default_rng(0)
    noisy = [
        np.clip(toon.frame(t) + rng.normal(0, 8, toon.background.shape), 0, 255).astype(np.uint8) for t in range(8)
    ]
    write_clip(tmp_path / "whole.mp4", noisy)
    whole = (tmp_path / "whole.mp4").read_bytes()
    assert whole.find(b"moov") < whole.find(b"mdat")  # or a cut file had no index
    (tmp_path / "cut.mp4").write_bytes(whole[: int(0.7 * len(whole))])
    shot = replace(read_shot(short / "ball.shot.toml"), clip=str(tmp_path / "cut.mp4"))
    write_shot(shot, tmp_path / "cut.shot.toml")
    assert main(["capture", str(tmp_path / "cut.shot.toml"), "-o", str(tmp_path / "cut.motion.json")]) == 0
    said = capsys.readouterr()
    kept = len(tracks.load(tmp_path / "cut.motion.json").times)
    assert 1 <= kept < 8
    assert f"the first {kept}" in said.err


def test_a_missing_clip_is_refused(tmp_path: Path, capsys):
    assert "no such file" in refused(
        capsys, tmp_path, "capture", tmp_path / "none.mp4", *BOX, "-o", tmp_path / "a.json"
    )


def test_a_file_that_is_no_video_is_refused(tmp_path: Path, capsys):
    (tmp_path / "text.mp4").write_text("this is not a video")
    assert "text.mp4" in refused(capsys, tmp_path, "capture", tmp_path / "text.mp4", *BOX, "-o", tmp_path / "a.json")


def test_an_empty_video_is_refused(tmp_path: Path, capsys):
    (tmp_path / "empty.mp4").touch()
    assert "empty.mp4" in refused(capsys, tmp_path, "capture", tmp_path / "empty.mp4", *BOX, "-o", tmp_path / "a.json")


def test_a_clip_without_box_or_colour_is_refused(short: Path, capsys):
    assert "--box or --color" in refused(capsys, short, "capture", short / "ball.mp4", "-o", short / "a.json")


def test_keys_without_a_box_or_with_an_impossible_bound_are_refused(short: Path, capsys):
    clip, out = short / "ball.mp4", short / "a.shot.toml"
    assert "--box or --color" in refused(capsys, short, "suggest", clip, "-o", out)
    assert "above 0 pixels" in refused(capsys, short, "suggest", clip, *BOX, "--residual", "0", "-o", out)
    assert "at least 1 key" in refused(capsys, short, "suggest", clip, *BOX, "--keys", "0", "-o", out)


def test_a_box_outside_the_picture_is_refused(short: Path, capsys):
    box = ["--box", "600", "400", "200", "200"]
    said = refused(capsys, short, "capture", short / "ball.mp4", *box, "-o", short / "a.json")
    assert "inside the 640 x 480 picture" in said


def test_a_key_frame_beyond_the_end_is_refused(short: Path, capsys):
    said = refused(capsys, short, "capture", short / "ball.mp4", *BOX, "--frame", "88", "-o", short / "a.json")
    assert "frames 0 to 7, got 88" in said


def test_a_key_frame_beyond_the_end_in_a_shot_file_is_refused(short: Path, tmp_path: Path, capsys):
    shot = read_shot(short / "ball.shot.toml")
    late = replace(shot.parts[0].keys[0], frame=500)
    write_shot(replace(shot, parts=(replace(shot.parts[0], keys=(late,)),)), tmp_path / "late.shot.toml")
    assert "got 500" in refused(capsys, tmp_path, "capture", tmp_path / "late.shot.toml", "-o", tmp_path / "a.json")


def test_a_target_whose_keys_do_not_match_is_refused(short: Path, tmp_path: Path, capsys):
    (tmp_path / "other.svg").write_bytes((short / "square.svg").read_bytes())
    text = '[[parts]]\nname = "ball"\n[[parts.keys]]\nname = "flat"\ndrawing = "other.svg"\n'
    (tmp_path / "x.cast.toml").write_text(text)
    arguments = ["--cast", tmp_path / "x.cast.toml", "-o", tmp_path / "a.mp4"]
    said = refused(capsys, tmp_path, "retarget", short / "ball.motion.json", *arguments)
    assert "the motion uses keys round, the target has flat" in said


def test_an_output_that_cannot_be_written_is_refused(short: Path, capsys):
    nowhere = short / "no" / "such" / "folder" / "a.motion.json"
    assert "a.motion.json" in refused(capsys, short, "capture", short / "ball.shot.toml", "-o", nowhere)


def test_an_output_of_an_unknown_kind_is_refused(short: Path, capsys):
    arguments = ["--drawing", short / "square.svg", "-o", short / "a.docx"]
    assert ".mp4" in refused(capsys, short, "retarget", short / "ball.motion.json", *arguments)


def test_a_file_that_is_no_motion_is_refused(short: Path, capsys):
    arguments = ["--drawing", short / "square.svg", "-o", short / "a.mp4"]
    assert "written by tooncap" in refused(capsys, short, "retarget", short / "ball.shot.toml", *arguments)


@pytest.mark.parametrize("words", [["dance"], ["capture"], ["capture", "a.mp4", "--box", "1", "2"], ["demo", "--loud"]])
def test_a_misspelt_command_is_refused(tmp_path: Path, capsys, words: list[str], monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    refused(capsys, tmp_path, *words)


@pytest.mark.parametrize("said", ["", "interrupted at frame 7"])
def test_an_interrupt_is_told_in_one_sentence(short: Path, tmp_path: Path, capsys, monkeypatch, said: str):
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt(*([said] if said else []))

    monkeypatch.setattr(tracks, "save", interrupted)
    assert main(["capture", str(short / "ball.shot.toml"), "-o", str(tmp_path / "a.motion.json")]) == 130
    assert capsys.readouterr().err == f"tooncap: {said or 'interrupted; nothing half-written is left'}\n"


def test_an_interrupted_capture_goes_on_from_where_it_was(short: Path, tmp_path: Path, capsys, monkeypatch):
    command = ["capture", str(short / "ball.shot.toml"), "-o", str(tmp_path / "a.motion.json")]
    seen: list[int] = []
    look = clip_module.Clip.__getitem__

    def looked(clip, t):
        seen.append(t)
        if len(seen) == 6:
            raise KeyboardInterrupt
        return look(clip, t)

    monkeypatch.setattr(clip_module.Clip, "__getitem__", looked)
    assert main(command) == 130
    assert "the same command again" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["a.motion.json.part"]
    assert main(command) == 0
    assert [path.name for path in tmp_path.iterdir()] == ["a.motion.json"]
    assert np.array_equal(
        tracks.load(tmp_path / "a.motion.json").tracks[0].affine,
        tracks.load(short / "ball.motion.json").tracks[0].affine,
    )


@pytest.mark.parametrize("name", ["capture", "batch"])
def test_a_capture_can_be_refined(short: Path, tmp_path: Path, capsys, monkeypatch, name: str):
    """The shot is handed on with the device chosen; what refining does with it is told in test_refine."""
    from capture.fit import batch
    from capture.fit import refine as refining

    def moved(motion, shot, clip, device):
        assert (shot.parts[0].name, len(clip), device) == ("ball", 8, "cpu")
        return replace(motion, tracks=(replace(motion.tracks[0], residual=motion.tracks[0].residual + 100),))

    monkeypatch.setattr(batch, "processes", ThreadPoolExecutor)
    monkeypatch.setattr(refining, "refine", moved)
    monkeypatch.setattr(refining, "device_of", str)  # torch need not be there
    (tmp_path / "ball.shot.toml").write_bytes((short / "ball.shot.toml").read_bytes())
    (tmp_path / "ball.mp4").write_bytes((short / "ball.mp4").read_bytes())
    out = ["-o", str(tmp_path / "ball.motion.json")] if name == "capture" else []
    assert main([name, str(tmp_path / "ball.shot.toml"), *out, "--refine", "--device", "cpu"]) == 0
    assert (tracks.load(tmp_path / "ball.motion.json").tracks[0].residual >= 100).all()


@pytest.mark.parametrize("name", ["capture", "batch"])
def test_a_device_with_nothing_to_do_or_unknown_is_refused(short: Path, capsys, name: str):
    said = refused(capsys, short, name, short / "ball.shot.toml", "--device", "cuda")
    assert "add --refine" in said
    assert "tpu" in refused(capsys, short, name, short / "ball.shot.toml", "--refine", "--device", "tpu")


def test_without_torch_refining_is_refused_before_anything_is_captured(
    short: Path, tmp_path: Path, capsys, monkeypatch
):
    monkeypatch.setitem(sys.modules, "torch", None)
    said = refused(capsys, tmp_path, "capture", short / "ball.shot.toml", "--refine", "-o", tmp_path / "a.motion.json")
    assert "tooncap[torch]" in said


def test_the_help_is_quick_and_names_every_command():
    said = subprocess.run(
        [sys.executable, "-X", "importtime", "-m", "retarget.cli", "--help"], capture_output=True, text=True
    )
    assert said.returncode == 0
    for command in ("demo", "fixtures", "suggest", "capture", "batch", "overlay", "retarget"):
        assert command in said.stdout
    loaded = {line.split("|")[-1].strip() for line in said.stderr.splitlines()}
    assert not loaded & {"torch", "kornia", "cvxpy", "numba", "matplotlib.pyplot", "scipy.optimize", "cv2", "numpy"}


def test_another_projects_capture_in_our_place_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys):
    (tmp_path / "mocap").mkdir()
    (tmp_path / "mocap" / "__init__.py").touch()
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "mocap", raising=False)
    assert main(["fixtures", str(tmp_path / "out")]) == 2
    assert "uninstall the other project named 'mocap'" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
