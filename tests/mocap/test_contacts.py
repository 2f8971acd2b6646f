"""Feet whose stands are known: the figure's, on the flat, on a stair, on tiptoe, jumping, large, small and noisy."""

from dataclasses import replace

import numpy as np
import pytest

from fixtures import skeletons
from mocap.bodies.contacts import find_contacts, floors
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion

TOES = ("LeftToeBase", "RightToeBase")


def _toes(figure):
    return [figure.joint(name) for name in TOES]


def _off(found, figure):
    """Seconds in which a foot is said to stand that does not, or the reverse, at most about any one event."""
    wrong = found != figure.stands
    longest = 0
    for foot in range(2):
        ends = np.flatnonzero(np.diff(np.concatenate([[0], wrong[:, foot].astype(int), [0]])))
        longest = max([longest, *(ends[1::2] - ends[::2])])
    return longest / figure.fps


@pytest.mark.parametrize("fps", [24.0, 30.0, 60.0, 120.0])
@pytest.mark.parametrize("draw", [skeletons.walk, skeletons.kick])
def test_feet_stand_when_they_stand_at_any_rate(draw, fps):
    figure = draw(fps=fps)
    found = find_contacts(figure.positions, _toes(figure), fps)
    assert _off(found, figure) <= 1.01 / min(fps, 30)


def test_a_motion_knows_its_own_feet():
    figure = skeletons.walk()
    skeleton = Skeleton(figure.names, figure.parents, figure.offsets)
    motion = SkeletonMotion(skeleton, figure.translation, figure.rotation, figure.fps)
    by_hand = find_contacts(figure.positions, _toes(figure), figure.fps)
    np.testing.assert_array_equal(find_contacts(motion), by_hand)
    with pytest.raises(TypeError, match="fps"):
        find_contacts(figure.positions, _toes(figure))


@pytest.mark.parametrize("scale", [0.4, 3.0])
def test_a_child_and_a_giant_stand_in_proportion(scale):
    """A giant's feet would be too high and too quick for a person's, a child's lifted feet low enough."""
    figure = skeletons.walk()
    skeleton = Skeleton(figure.names, figure.parents, scale * figure.offsets)
    motion = SkeletonMotion(skeleton, scale * figure.translation, figure.rotation, figure.fps)
    assert _off(find_contacts(motion), figure) <= 1.01 / 30
    alone = find_contacts(scale * figure.positions, _toes(figure), figure.fps, tall=scale * 1.71)
    assert _off(alone, figure) <= 1.01 / 30


@pytest.mark.parametrize("rise", [0.0, 0.3, -7.0])
def test_the_floor_may_be_anywhere_and_one_sensor_higher_than_the_other(rise):
    figure = skeletons.walk()
    places = figure.positions + [0, rise, 0]
    places[:, _toes(figure)[1], 1] += 0.02
    assert _off(find_contacts(places, _toes(figure), figure.fps), figure) <= 1.01 / 30
    under = floors(places[:, _toes(figure)], figure.fps)
    np.testing.assert_allclose(under, np.tile([0.025 + rise, 0.045 + rise], (len(places), 1)), atol=1e-9)


def test_a_platform_is_a_floor():
    """Half-way through it stands on a step of 40 cm, for two seconds."""
    figure = skeletons.kick(seconds=0.9)
    times = np.arange(240) / 60
    rise = 0.4 * np.clip((times - 1.0) / 0.3, 0, 1)
    places = np.repeat(figure.positions[:1], 240, axis=0)
    places[..., 1] += rise[:, None]
    found = find_contacts(places, _toes(figure), 60.0)
    assert found[:55].all() and not found[66:75].any() and found[85:].all()


def test_who_jumps_stands_not():
    """Both feet leave the floor for 0.6 seconds: a flight as gravity has it."""
    figure = skeletons.kick(seconds=0.9)
    times = np.arange(180) / 60
    air = np.clip(times - 1.2, 0, 0.6)
    places = np.repeat(figure.positions[:1], 180, axis=0)
    places[..., 1] += (4.905 * air * (0.6 - air))[:, None]
    found = find_contacts(places, _toes(figure), 60.0)
    flies = (air > 0) & (air < 0.6)
    assert found[times < 1.15].all() and found[times > 1.85].all()
    assert not found[flies & (np.abs(times - 1.5) < 0.25)].any()


def _one_toe(height, ahead):
    """A toe at these heights and places ahead over time, and another that stands."""
    toes = np.zeros((len(height), 2, 3))
    toes[:, 0, 1], toes[:, 0, 2] = height, ahead
    toes[:, 1, 0] = 0.3
    return toes


def test_a_foot_that_brushes_the_floor_or_touches_it_for_an_instant_does_not_stand():
    times = np.arange(120) / 60
    dip = np.clip(np.abs(times - 1.0) / 0.15, 0, 1)
    brushing = _one_toe(0.03 + 0.2 * (dip >= 1), 0.42 * times)  # low, and as slow as may be, but never slower
    touching = _one_toe(np.where(np.abs(times - 1.0) < 0.035, 0.0, 0.25), 0 * times)
    resting = _one_toe(np.where(np.abs(times - 1.0) < 0.15, 0.0, 0.25), 0 * times)
    assert [find_contacts(toes, [0, 1], 60.0)[:, 0].any() for toes in (brushing, touching, resting)] == [
        False,
        False,
        True,
    ]
    assert find_contacts(brushing, [0, 1], 60.0)[:, 1].all()


def test_a_frame_that_jumps_does_not_cut_a_stand_in_two():
    jumped = _one_toe(np.zeros(60), np.where(np.arange(60) == 30, 0.03, 0))
    assert find_contacts(jumped, [0, 1], 60.0).all()


def test_noise_does_not_break_a_stand():
    figure = skeletons.walk(seconds=6.0)
    places = figure.positions + np.random.default_rng(0).normal(0, 0.0015, figure.positions.shape)
    found = find_contacts(places, _toes(figure), figure.fps)
    for foot in range(2):
        stands = np.diff(found[:, foot].astype(int)) == 1
        truly = np.diff(figure.stands[:, foot].astype(int)) == 1
        assert stands.sum() == truly.sum()
    assert _off(found, figure) <= 0.06


def test_one_frame_and_no_feet_are_no_trouble():
    figure = skeletons.walk(seconds=0.1)
    assert find_contacts(figure.positions[:1], _toes(figure), 60.0).shape == (1, 2)
    assert find_contacts(figure.positions, [], 60.0).shape == (len(figure.positions), 0)
    still = np.tile([0, 0, 0, 1.0], (4, 1, 1))
    rope = SkeletonMotion(Skeleton(("a",), (-1,), np.zeros((1, 3))), np.zeros((4, 1, 3)), still, 25)
    assert find_contacts(rope).shape == (4, 0) and find_contacts(replace(rope, fps=120)).shape == (4, 0)
