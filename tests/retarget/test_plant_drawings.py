"""A plant's drawing, whose joints are called as the plant's, stands, leans and sways as the plant does."""

import numpy as np
import pytest

from capture.motion.tracks import total_affine
from fixtures import plants
from fixtures.write import CHARACTERS
from mocap.bvh import write_bvh
from mocap.posing import postures, starting
from mocap.posing.wind import Wind, sway
from mocap.skeleton import Skeleton
from mocap.to_tracks import to_tracks
from retarget.characters.markfiles import read_marked
from retarget.cli import main

MARKED = CHARACTERS / "flower.marks.toml"


@pytest.fixture(scope="module")
def flower():
    made = plants.flower()
    return Skeleton(made.names, made.parents, made.offsets)


def lent(motion):
    return to_tracks(motion, read_marked(MARKED).marks)


def turned(motion, part):
    """By how many degrees clockwise a part is turned on the page (T,)."""
    maps = total_affine(motion, part)
    return np.degrees(np.arctan2(maps[:, 1, 0], maps[:, 0, 0]))


def test_at_rest_it_is_as_it_was_drawn(flower):
    motion = lent(postures.posed(flower, np.zeros((2, len(flower), 3)), 24))
    for track in motion.tracks:
        assert total_affine(motion, track.part)[:, :, :2] == pytest.approx(np.tile(np.eye(2), (2, 1, 1)), abs=1e-6)


def test_it_leans_by_as_much_as_the_plant_does(flower):
    """Six of the stem's seven equal turns are below its last link; about z they are seen in full."""
    pool = starting.plant(flower)
    turns = np.stack([postures.turns_of(pool[name], flower) for name in ("lean left", "lean right")])
    motion = lent(postures.posed(flower, turns, 24))
    assert turned(motion, "stem 8") == pytest.approx([50 * 6 / 7, -50 * 6 / 7], abs=2)
    assert turned(motion, "leaf b 3")[0] == pytest.approx(50 * 3 / 7, abs=4)  # on the fourth link from the ground
    assert turned(motion, "stem 2") == pytest.approx([0, 0], abs=1e-6)


def test_the_wind_sways_the_drawing_and_its_base_stays(flower):
    motion = lent(sway(flower, Wind(12.0, seed=3), 2.0, 24, settle=1.0))
    head, base = turned(motion, "stem 8"), total_affine(motion, "stem 1")
    assert np.ptp(head) > 10
    assert np.abs(base - base[:1]).max() < 1e-9


def test_a_swaying_plant_plays_its_drawing_on_the_command_line(flower, tmp_path):
    write_bvh(sway(flower, Wind(12.0), 0.3, 24, settle=0.2), tmp_path / "flower.bvh")
    out = tmp_path / "flower.gif"
    assert (
        main(["mocap", "play", str(tmp_path / "flower.bvh"), str(MARKED), "--stiff", "-o", str(out), "--size", "90"])
        == 0
    )
    assert out.stat().st_size > 1000
