"""What `tooncap retarget` is told about the one drawing it is given, without a cast."""

from pathlib import Path

import numpy as np
import pytest

from capture.errors import InputError
from capture.motion import tracks
from capture.pictures.decode import read_clip
from fixtures import ball, write
from retarget.commands.lending import retarget


@pytest.fixture
def motion(tmp_path: Path) -> Path:
    tracks.save(write.motion_of(ball.ball()), tmp_path / "ball.motion.json")
    return tmp_path / "ball.motion.json"


def crate(folder: Path) -> Path:
    """A box twice as deep and as tall as it is wide."""
    corners = [(x, y, z) for x in (0, 1) for y in (0, 2) for z in (0, 2)]
    sides = ["1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4"]
    text = [*("v {} {} {}".format(*corner) for corner in corners), *(f"f {side}" for side in sides)]
    (folder / "crate.obj").write_text("\n".join(text))
    return folder / "crate.obj"


@pytest.mark.parametrize(("side", "wide"), [("front", 0.5), ("right", 1.0), ("back", 0.5), ("left", 1.0)])
def test_a_model_is_as_tall_and_seen_from_the_side_that_is_asked_for(tmp_path: Path, motion: Path, side, wide):
    retarget(motion, tmp_path / "out", drawing=(crate(tmp_path),), side=side, height=0.5, size=320)
    tall = np.ptp(ball.ball().parts[0].points[0], axis=0)[1] / 4  # half as tall, on half the page
    rows, columns = np.nonzero(read_clip(tmp_path / "out")[0][..., 3] > 127)
    assert np.ptp(rows) + 1 == pytest.approx(tall, abs=2)
    assert np.ptp(columns) + 1 == pytest.approx(wide * tall, abs=2)


def test_sides_and_heights_that_cannot_be_are_refused(tmp_path: Path, motion: Path):
    square = write.CHARACTERS / "pumpkin.svg"
    for flags, said in (
        ({"drawing": (square,), "side": "left"}, "3-D model"),
        ({"cast": tmp_path / "a.cast.toml", "side": "left"}, "a cast says plane"),
        ({"drawing": (square,), "height": 0.0}, "above 0"),
        ({"cast": tmp_path / "a.cast.toml", "height": 2.0}, "a cast says it itself"),
    ):
        with pytest.raises(InputError, match=said):
            retarget(motion, tmp_path / "a.mp4", **flags)
    assert not (tmp_path / "a.mp4").exists()
