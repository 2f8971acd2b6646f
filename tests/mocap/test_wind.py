"""No wind moves nothing, an even one bends as far as statics says, gusts come and go, and nothing ever breaks."""

import numpy as np
import pytest

from capture.errors import InputError
from fixtures import plants
from mocap.posing import wind as winds
from mocap.posing.modes import MOST
from mocap.posing.wind import Wind, blowing, sway
from mocap.rotations import turns_between
from mocap.skeleton import Skeleton

EVEN = Wind(3.0, gusts=0.0, aside=0.0)
SQUALLS = Wind(12.0, gusts=0.8, seed=5)


def skeleton_of(made):
    return Skeleton(made.names, made.parents, made.offsets)


def rod(length=0.8):
    return Skeleton(("ground", "rod", "tip"), (-1, 0, 1), np.array([[0, 0, 0], [0, 0.0, 0], [0, length, 0]]))


FLOWER = skeleton_of(plants.flower())


def test_no_wind_moves_nothing_whatever_hangs_on_it():
    for skeleton in (FLOWER, skeleton_of(plants.lamp()), skeleton_of(plants.reed())):
        for gravity in (0.0, 9.8):
            motion = sway(skeleton, Wind(0.0), 0.5, 24, gravity=gravity, settle=0.5)
            assert np.abs(motion.rotation - [0, 0, 0, 1]).max() < 1e-12
    caught_none = sway(FLOWER, SQUALLS, 1.0, 24, catch=0.0)
    assert np.abs(caught_none.rotation - [0, 0, 0, 1]).max() < 1e-12


def test_an_even_wind_bends_a_rod_as_far_as_statics_says():
    """Torque c v^2 l^2 / 2 against k = (2 pi f)^2 I, I = l^3 / 3 and 0.01 l^3 for its thickness, for 1 kg a metre."""
    length, frequency, catch = 0.8, 1.2, 0.02
    motion = sway(rod(length), EVEN, 0.2, 24, frequency=frequency, catch=catch, damping=0.5, settle=12.0)
    way = motion.positions()[-1, 2] - motion.positions()[-1, 1]
    k = (2 * np.pi * frequency) ** 2 * (1 / 3 + 0.01) * length**3
    truth = catch * 3.0**2 * length**2 / 2 / k
    assert truth > 0.001
    assert np.arctan2(way[0], way[1]) == pytest.approx(truth, rel=0.01)
    assert abs(way[2]) < 1e-9


def test_what_the_modes_leave_over_the_joints_take_up():
    """Bent by an even wind a flower is as bent with one mode of the whole as with all of them."""
    few, all_of_them = (
        sway(FLOWER, EVEN, 0.1, 12, count=count, damping=0.7, settle=5.0).positions()[-1] for count in (1, None)
    )
    still = sway(FLOWER, Wind(0.0), 0.1, 24, settle=0.0).positions()[-1]
    assert np.abs(all_of_them - still).max() > 0.002
    assert np.abs(few - all_of_them).max() < 0.03 * np.abs(all_of_them - still).max()


def test_the_motion_is_the_same_at_12_24_and_60_frames_a_second():
    fine = sway(FLOWER, SQUALLS, 1.5, 60, settle=1.0).positions()
    for fps in (12, 30):
        coarse = sway(FLOWER, SQUALLS, 1.5, fps, settle=1.0).positions()
        assert np.abs(fine[:: 60 // fps] - coarse).max() < 1e-9


def test_a_plant_swings_to_and_fro_about_where_it_leans():
    tip = sway(skeleton_of(plants.reed()), SQUALLS, 8.0, 24, settle=1.0).positions()[:, -1, 0]
    assert tip.mean() > 0.02
    assert ((tip[1:-1] - tip[:-2]) * (tip[2:] - tip[1:-1]) < 0).sum() >= 7


def test_the_same_seed_is_the_same_wind_and_another_is_another():
    again, other = (sway(FLOWER, Wind(8.0, seed=seed), 1.0, 24, settle=1.0).positions() for seed in (0, 1))
    assert np.array_equal(again, sway(FLOWER, Wind(8.0), 1.0, 24, settle=1.0).positions())
    assert np.abs(again - other).max() > 0.005


@pytest.mark.parametrize("speed", [20.0, 80.0])
def test_no_storm_breaks_a_plant(speed):
    motion = sway(FLOWER, Wind(speed, gusts=1.0, seed=2), 3.0, 24, gravity=9.8, ground=0.0, settle=0.5)
    assert np.isfinite(motion.rotation).all()
    assert np.linalg.norm(turns_between([0, 0, 0, 1], motion.rotation), axis=-1).max() <= MOST + 1e-9
    places = motion.positions()
    links = np.linalg.norm(places[:, 1:] - places[:, list(FLOWER.parents[1:])], axis=-1)
    assert links == pytest.approx(np.tile(FLOWER.lengths()[1:], (len(motion), 1)))


def test_what_is_bent_falls_further_by_its_weight_and_what_is_upright_does_not():
    reed = skeleton_of(plants.reed())
    light, heavy = (
        sway(reed, Wind(6, gusts=0.0, aside=0.0), 0.2, 24, gravity=g, damping=0.6, settle=5) for g in (0.0, 5.0)
    )
    assert heavy.positions()[-1, -1, 0] > 1.05 * light.positions()[-1, -1, 0]


def test_a_branch_that_is_blown_down_lies_on_the_ground():
    names = ("base", "branch 1", "branch 2", "branch 3", "branch end")
    offsets = np.array([[0, 0, 0], [0, 0.1, 0], [0.3, 0, 0], [0.3, 0, 0], [0.3, 0, 0]])
    branch, down = Skeleton(names, (-1, 0, 1, 2, 3), offsets), Wind(20.0, (0, -1, 0), gusts=0.2, aside=0.0)
    free, lies = (sway(branch, down, 2.0, 24, ground=ground).positions()[..., 1].min() for ground in (None, 0.0))
    assert free < -0.25
    assert lies > -0.04  # it sinks in a little: the ground is soft


def test_gusts_are_about_the_mean_never_backwards_and_travel_with_the_wind():
    t = np.arange(0, 400, 0.05)
    here = blowing(SQUALLS, np.zeros(3), t)
    assert here[:, 0].mean() == pytest.approx(12.0, rel=0.05)
    assert here[:, 0].min() > 0 and here[:, 0].std() > 0.2 * 12
    assert np.abs(here[:, 1:].mean(axis=0)).max() < 0.6
    there = blowing(SQUALLS, np.array([6.0, 0, 0]), t)
    assert there[10:] == pytest.approx(here[:-10])  # 6 m further, half a second later
    beside = blowing(SQUALLS, np.array([0, 0, 6.0]), t)
    assert np.abs(beside - here).max() > 1


def test_an_even_wind_is_its_speed_everywhere_and_always():
    places = np.random.default_rng(0).normal(size=(4, 3))
    for toward in ((1, 0, 0), (0, -2, 0), (1, 1, 1)):
        way = np.array(toward) / np.linalg.norm(toward)
        found = blowing(Wind(3.0, toward, gusts=0, aside=0), places, 2.7)
        assert found == pytest.approx(np.tile(3 * way, (4, 1)))


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Wind(-1.0), "speed, gusts and turns aside of 0 or more"),
        (lambda: Wind(float("nan")), "speed, gusts and turns aside of 0 or more"),
        (lambda: Wind(between=0.0), "time between gusts above 0"),
        (lambda: Wind(toward=(0.0, 0.0, 0.0)), "must blow to somewhere"),
        (lambda: sway(FLOWER, Wind(), 0.0, 24), "seconds of a plant in the wind must be above 0"),
        (lambda: sway(FLOWER, Wind(), 1.0, 0), "frame rate of a plant"),
        (lambda: sway(FLOWER, Wind(), 1.0, 24, catch=-1.0), "catch of a plant"),
        (lambda: sway(FLOWER, Wind(), 1.0, 24, damping=-1.0), "damping of an elastic joint must be 0 or more"),
        (lambda: sway(FLOWER, Wind(), 1.0, 24, frequency=0.0), "must be above 0 Hz"),
    ],
)
def test_bad_input_is_refused(make, said):
    with pytest.raises(InputError, match=said):
        make()


def test_waves_are_as_strong_as_said():
    strength, *_ = winds._waves(3, 2.5)
    assert (strength**2).sum(axis=1) / 2 == pytest.approx(1.0)
