"""`tooncap mocap play`: files come out, and what cannot be played is refused in one sentence."""

import numpy as np
import pytest

from capture.motion import tracks
from capture.pictures.decode import read_clip
from fixtures import stickman
from fixtures.write import CHARACTERS
from mocap.bvh import write_bvh
from mocap.skeleton import Skeleton, SkeletonMotion
from retarget.cli import main


@pytest.fixture
def wave(tmp_path):
    """Somebody who waves for a second, at 48 frames a second."""
    swing = np.sin(np.linspace(0, 4 * np.pi, 48))[:, None] * (0, 0, 0.7)
    motion = SkeletonMotion(
        Skeleton(*stickman.skeleton()), *stickman.moving({"LeftArm": swing, "RightUpLeg": -0.5 * swing}, 48, fps=48.0)
    )
    write_bvh(motion, tmp_path / "wave.bvh")
    return tmp_path / "wave.bvh"


def _said(capsys):
    said = capsys.readouterr()
    return said.out + said.err


def test_a_wave_plays_the_tomcat_in_a_film(wave, tmp_path, capsys):
    assert (
        main(
            [
                "mocap",
                "play",
                str(wave),
                str(CHARACTERS / "tomcat.svg"),
                "-o",
                str(tmp_path / "cat.gif"),
                "--size",
                "160",
            ]
        )
        == 0
    )
    said = _said(capsys)
    assert "24 frames at 24 a second, tomcat.svg plays wave.bvh" in said and "left_elbow = LeftForeArm" in said
    clip = read_clip(tmp_path / "cat.gif")
    assert len(clip) == 24 and clip[0].shape[1] == 160
    first, later = (clip[t].astype(int) for t in (0, 4))
    assert np.abs(first - later).max() > 100


def test_the_motion_of_all_sub_links_can_be_kept(wave, tmp_path):
    out = tmp_path / "wave.motion.json"
    assert (
        main(["mocap", "play", str(wave), str(CHARACTERS / "tomcat.svg"), "-o", str(out), "--stiff", "--view", "front"])
        == 0
    )
    kept = tracks.load(out)
    assert {"root", "left_elbow 1", "left_elbow 4", "tail_tip"} <= {track.part for track in kept.tracks}


@pytest.mark.parametrize("ending", [".glb", ".svg", ".json"])
def test_it_goes_out_to_other_programs(wave, tmp_path, ending):
    out = tmp_path / f"cat{ending}"
    assert main(["mocap", "play", str(wave), str(CHARACTERS / "tomcat.svg"), "-o", str(out), "--seconds", "0.2"]) == 0
    assert out.stat().st_size > 10_000


def test_without_a_drawing_a_body_of_hoses_plays_and_goes_out_and_in_again(wave, tmp_path, capsys):
    assert main(["mocap", "play", str(wave), "-o", str(tmp_path / "hoses.glb")]) == 0
    assert "a body of hoses plays wave.bvh on" in _said(capsys)
    assert (
        main(
            ["mocap", "play", str(tmp_path / "hoses.glb"), "--stiff", "-o", str(tmp_path / "again.gif"), "--size", "90"]
        )
        == 2
    )
    assert "bake its scale" in _said(capsys)  # rubber stretches its joints


@pytest.mark.parametrize(
    ("more", "told"),
    [
        (["-o", "wave.svg"], "or add a drawing"),
        (["{characters}/bottle.svg"], "circles with ids"),
        (["{characters}/tomcat.svg", "--view", "top"], "top"),
        (["{characters}/tomcat.svg", "--start", "9"], "lasts 1.00 seconds"),
    ],
)
def test_what_cannot_be_played_is_refused_in_one_sentence(wave, capsys, more, told):
    assert main(["mocap", "play", str(wave), *(one.format(characters=CHARACTERS) for one in more)]) == 2
    assert told in _said(capsys)
