"""Real walks: feet stand more than half of the time and skate a little, as all captured feet do."""

import numpy as np
import pytest

from mocap.bodies.contacts import find_contacts
from mocap.report import report
from mocap.skeletons.bvh import read_bvh
from mocap.skeletons.units import upright

WALKS = ["bandai1_walk_normal", "bandai1_walk_tired", "cmu21_walk", "cmu_12_01_walk", "bvhpython_freebvh"]


@pytest.mark.parametrize("name", WALKS)
def test_the_feet_of_a_walk_stand_in_turn_and_hardly_skate(name, data):
    """4.5 to 9 cm/s were measured by hand with 3.5 cm and 0.5 m/s."""
    motion = upright(read_bvh(data / "bvh" / f"{name}.bvh"))
    card = report(motion)
    assert 0.45 < card.stands < 0.7 and 3 < card.skate < 10.5
    walking = find_contacts(motion)[round(motion.fps) :]
    assert walking.any(axis=1).mean() > 0.9
    assert (np.diff(walking.astype(int), axis=0) == 1).sum(axis=0).min() >= 1


@pytest.mark.parametrize("name", ["ad_fair1_wave_hello", "cmu21_swim"])
def test_who_stands_stands_all_the_time(name, data):
    assert find_contacts(upright(read_bvh(data / "bvh" / f"{name}.bvh"))).mean() > 0.99
