"""The starting pool on every real skeleton, whatever its file's rest pose is, and real dancers who swing after."""

import numpy as np
import pytest

from mocap.body import find_body
from mocap.bvh import read_bvh
from mocap.posing import modes, postures, starting
from mocap.posing.rest import rested
from mocap.posing.standing import planted
from mocap.units import upright

NAMES = [
    *("ad_cmu1_jumping_jacks", "ad_fair1_dab", "ad_fair1_wave_hello", "ad_rokoko_jesse_dance", "bandai1_kick"),
    *("bandai1_run_normal", "bandai1_walk_tired", "bvhpython_freebvh", "bvhpython_mocapbank", "cmu21_dance"),
    *("cmu21_swim", "cmu_12_01_walk"),
]


@pytest.mark.parametrize("name", NAMES)
def test_postures_do_what_they_are_called_on_real_skeletons(name, data):
    skeleton, rest = rested(upright(read_bvh(data / "bvh" / f"{name}.bvh")))
    assert starting.kind_of(skeleton, rest) == "human"
    pool = starting.starting_pool(skeleton, rest)
    asked = ("arms up", "left knee up", "crouch", "lean left")
    turns = np.stack([np.zeros((len(skeleton), 3)), *(postures.turns_of(pool[one], skeleton) for one in asked)])
    posed = postures.posed(skeleton, turns, 24, rest)
    still, up, knee, _, lean = posed.positions()
    body = find_body(skeleton, still)
    tall = np.ptp(still[:, 1])
    assert still[:, 1].min() == pytest.approx(0, abs=1e-6)
    assert all(up[hand, 1] > up[body.parts["head"][0], 1] for hand in body.hands)
    left, right = (body.parts[f"{side} leg"] for side in ("left", "right"))
    assert knee[left[-1], 1] > still[left[-1], 1] + 0.1 * tall
    assert knee[right[-1]] == pytest.approx(still[right[-1]], abs=1e-9)
    assert lean[body.parts["head"][-1], 0] > still[body.parts["head"][-1], 0] + 0.05 * tall
    sunk = planted(posed.part(3, 4), body, still).positions()[0]
    assert sunk[left[0], 1] < still[left[0], 1] - 0.03 * tall
    assert np.abs(sunk[list(body.feet)] - still[list(body.feet)]).max() < 0.02 * tall


@pytest.mark.parametrize("name", ["ad_rokoko_jesse_dance", "cmu21_kick", "bandai1_kick"])
def test_real_dancers_swing_after_without_jitter(name, data):
    motion = upright(read_bvh(data / "bvh" / f"{name}.bvh")).part(60, 260)
    after = modes.follow(motion, modes.of_skeleton(*rested(motion), frequency=2.0), 0.35).positions()
    places = motion.positions()

    def rough(curves):
        return np.sqrt((np.diff(curves, 3, axis=0) ** 2).mean())

    assert 0.02 < np.abs(after - places).max() < 0.4
    assert rough(after) < 1.5 * rough(places)
