"""Real files in metres and y up: figures as tall as people, on a floor, whatever their makers' unit and axes."""

import numpy as np
import pytest

from mocap.bodies.body import find_body
from mocap.skeletons.bvh import read_bvh
from mocap.skeletons.units import stature, upright

CLIPS = {  # a clip, what its makers counted in, and which axis they had up
    "ad_cmu1_jumping_jacks": ("5.64 cm", "y"),
    "ad_fair1_zombie": ("inches", "z"),
    "ad_rokoko_jesse_dance": ("centimetres", "y"),
    "bandai1_walk_normal": ("centimetres", "y"),
    "bvhpython_freebvh": ("centimetres", "y"),
    "bvhpython_mocapbank": ("centimetres", "y"),
    "cmu21_kick": ("centimetres", "y"),
    "cmu_12_01_walk": ("5.64 cm", "y"),
}


@pytest.mark.parametrize("name", CLIPS)
def test_a_real_figure_stands_on_a_floor_and_is_as_tall_as_people_are(name, data):
    unit, axis = CLIPS[name]
    motion = upright(read_bvh(data / "bvh" / f"{name}.bvh"))
    assert any(unit in note for note in motion.notes)
    assert any("z axis was up" in note for note in motion.notes) == (axis == "z")
    places = motion.positions()
    body = find_body(motion.skeleton, places)
    assert (1.5 if unit != "inches" else 1.0) < stature(motion, body) < 1.9  # fair1's are small in any unit
    lowest = places[:, list(body.feet), 1].min(axis=1)
    assert -0.06 < np.percentile(lowest, 2) < 0.1
    assert (places[:, body.parts["head"][-1], 1] > lowest).all()
