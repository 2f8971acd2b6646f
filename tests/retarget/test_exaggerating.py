"""`tooncap exaggerate`: from motion file to motion file."""

import numpy as np
import pytest

from capture.motion import tracks
from fixtures import write
from fixtures.frog import frog
from retarget import cli


@pytest.fixture
def hop(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    tracks.save(write.motion_of(frog()), "hop.motion.json")
    return tracks.load("hop.motion.json")


def test_a_hop_is_exaggerated_and_says_by_how_much(hop, capsys):
    assert cli.main(["exaggerate", "hop.motion.json", "-o", "big.motion.json", "--amount", "1.5"]) == 0
    said = capsys.readouterr().out
    ours = tracks.load("big.motion.json")
    apart = np.abs(ours.outline("frog") - hop.outline("frog")).max(axis=(1, 2))
    assert apart.max() > 20
    assert said == f"big.motion.json: 80 frames, moved by up to {apart.max():.0f} px at frame {apart.argmax()} (frog)\n"


def test_nothing_asked_is_nothing_done(hop):
    assert cli.main(["exaggerate", "hop.motion.json", "--amount", "0"]) == 0
    ours = tracks.load("hop.exaggerated.motion.json")
    np.testing.assert_array_equal(ours.track("frog").affine, hop.track("frog").affine)


def test_it_can_be_eased_pushed_and_put_on_threes(hop):
    given = ["--away", "1.5", "--ease", "0.5", "--drawings", "8", "--slide", "--seconds", "0.1"]
    assert cli.main(["exaggerate", "hop.motion.json", "-o", "new.motion.json", *given]) == 0
    track = tracks.load("new.motion.json").track("frog")
    assert (~track.held).sum() <= 27 and track.held[1::3].all() and track.held[2::3].all()


@pytest.mark.parametrize("given", [["--seconds", "0"], ["--ease", "9"], ["--drawings", "0"]])
def test_what_cannot_be_done_is_said_in_one_line_and_nothing_is_written(hop, tmp_path, capsys, given):
    assert cli.main(["exaggerate", "hop.motion.json", *given]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert [file.name for file in tmp_path.iterdir()] == ["hop.motion.json"]
