"""A dance: every posture on its beat, on the floor, and mirrored."""

import time
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from capture.errors import InputError
from fixtures import plants, skeletons
from mocap.bodies.body import find_body
from mocap.posing import beats, mirror
from mocap.posing.choreography import Dance, Phrase, Step, unrolled
from mocap.posing.dance import danced
from mocap.posing.invent import invented
from mocap.posing.postures import Pool, Posture, turned, turns_of, unturned
from mocap.posing.starting import standing, starting_pool
from mocap.skeletons.rotations import turns_between
from mocap.skeletons.skeleton import Skeleton


def skeleton_of(figure):
    return Skeleton(figure.names, figure.parents, figure.offsets)


HUMAN, FLOWER, LAMP = map(skeleton_of, (skeletons.walk(0.1), plants.flower(), plants.lamp()))
MUSIC = beats.steady(120, 8)


def of(*steps, **more):
    return Dance((Phrase(steps, **more),))


def angles(motion, rest, truth):
    """How far each joint is, in radians, from turns (J, 3) against rest, in every frame (T, J)."""
    return np.linalg.norm(turns_between(turned(rest, truth)[None], motion.rotation), axis=-1)


@pytest.mark.parametrize("bpm", [48, 60, 75, 97, 120, 135, 160, 200, 240])
@pytest.mark.parametrize("skeleton", [HUMAN, FLOWER, LAMP], ids=["human", "flower", "lamp"])
def test_on_its_beat_each_joint_has_less_than_5_percent_of_its_move_left(bpm, skeleton):
    """The truth is the pool's own turns, added; a move is from the posture before, at 24 frames a second."""
    rest = standing(skeleton)
    pool = starting_pool(skeleton, rest)
    music = beats.steady(bpm, 16 * 60 / bpm, first=0.13)
    dance = invented(pool, skeleton, 16, bpm, rest)
    pairs = mirror.counterparts(skeleton, find_body(skeleton))
    motion = danced(skeleton, pool, dance, music, rest=rest)
    at_rest = danced(skeleton, pool, of(Step(0, "rest")), music, rest=rest).world()[0]
    axis = mirror.across(at_rest[..., 3], pairs)
    before, worst = np.zeros((len(skeleton), 3)), 0.0
    steps = unrolled(dance, 15)
    for beat in sorted({step.beat for step in steps}):
        goal = np.zeros_like(before)
        for step in (step for step in steps if step.beat == beat):
            turns = turns_of(pool[step.posture], skeleton, step.extent)
            goal += mirror.mirrored(turns, pairs, axis, at_rest[..., :3]) if step.mirror else turns
        frame = round(float(music.at(beat)) * 24)
        move, left = np.linalg.norm(goal - before, axis=-1), angles(motion, rest, goal)[frame]
        moves = move > 0.1
        worst = max(worst, (left[moves] / move[moves]).max(initial=0))
        assert left[~moves].max(initial=0) < 0.02  # radians; the knees come up from half a radian
        before = goal
    assert worst < 0.05


def test_music_that_changes_its_tempo_is_danced_on_its_beats():
    music = beats.Beats(np.array([0.2, 0.8, 1.4, 1.8, 2.2, 2.45, 3.2]), 100.0, 4.0)
    pool = starting_pool(HUMAN)
    motion = danced(HUMAN, pool, of(Step(0, "bow"), Step(1, "rest"), beats=2), music)
    for beat, when in enumerate(music.times):
        goal = turns_of(pool["bow"], HUMAN, 1.0 if beat % 2 == 0 else 0.0)
        far = np.linalg.norm(turns_of(pool["bow"], HUMAN), axis=-1).max()
        assert angles(motion, unturned(HUMAN), goal)[round(24 * when)].max() < 0.05 * far


def test_between_beats_the_pulse_goes_down_and_on_them_there_is_none():
    pool = starting_pool(HUMAN)
    dance = of(Step(0, "arms up"), beats=4, pulse="crouch", depth=0.5)
    hips = danced(HUMAN, pool, dance, MUSIC, fps=48).positions()[:, 0, 1]
    tall = danced(HUMAN, pool, of(Step(0, "arms up")), MUSIC).positions()[0, 0, 1]
    on, off = np.arange(2, 15) * 24, np.arange(2, 15) * 24 + 12
    np.testing.assert_allclose(hips[on], tall, atol=0.002)
    assert (hips[off] < tall - 0.03).all()


def test_a_part_dances_alone_and_the_rest_goes_on():
    rest = standing(HUMAN)
    pool = starting_pool(HUMAN, rest)
    motion = danced(HUMAN, pool, of(Step(0, "bow"), Step(2, "arms up", part="left arm"), beats=16), MUSIC, rest=rest)
    frame = round(24 * 1.2)
    both = turns_of(pool["bow"], HUMAN)
    own = np.array([name.startswith("LeftArm") for name in HUMAN.names])
    both[own] = turns_of(pool["arms up"], HUMAN)[own]
    assert angles(motion, rest, both)[frame].max() < 0.05


def test_extent_goes_to_half_of_the_posture_and_beyond():
    pool = starting_pool(HUMAN)
    for extent, whole in ((0.5, 1.0), (1.0, 1.5)):
        motion = danced(HUMAN, pool, of(Step(1, "bow", extent)), MUSIC, extent=whole)
        assert angles(motion, unturned(HUMAN), turns_of(pool["bow"], HUMAN, extent * whole))[12].max() < 0.01


@pytest.mark.parametrize("seed", range(5))
def test_the_mirror_image_of_a_dance_is_the_dance_in_a_mirror(seed):
    rest = standing(HUMAN)
    pool = starting_pool(HUMAN, rest)
    dance = invented(pool, HUMAN, 16, seed, rest)
    phrases = [replace(p, steps=tuple(replace(s, mirror=not s.mirror) for s in p.steps)) for p in dance.phrases]
    one, other = (danced(HUMAN, pool, d, MUSIC, rest=rest).positions() for d in (dance, Dance(tuple(phrases))))
    pairs = mirror.counterparts(HUMAN, find_body(HUMAN))
    np.testing.assert_allclose(other[:, pairs], one * [-1, 1, 1], atol=1e-6)


@pytest.mark.parametrize("seed", range(8))
def test_a_dancer_is_on_the_floor_on_every_beat_and_its_standing_foot_does_not_slide(seed):
    rest = standing(HUMAN)
    body = find_body(HUMAN)
    dance = invented(starting_pool(HUMAN, rest), HUMAN, 32, seed, rest)
    motion = danced(HUMAN, starting_pool(HUMAN, rest), dance, beats.steady(120, 16), rest=rest)
    feet = motion.positions()[:, list(body.feet)]
    floor = feet[0, :, 1].min()
    assert feet[..., 1].min() > floor - 0.02  # metres: a foot that turns goes on its edge
    assert np.abs(feet[::12, :, 1].min(axis=1) - floor).max() < 0.02
    stands = (np.ptp(feet[..., 1], axis=1) > 0.08) & (feet[..., 1].min(axis=1) < floor + 0.02)  # on one foot alone
    lowest = feet[np.arange(len(feet)), feet[..., 1].argmin(axis=1)]
    same = stands[1:] & stands[:-1] & (feet[1:, :, 1].argmin(axis=1) == feet[:-1, :, 1].argmin(axis=1))
    slides = np.linalg.norm(np.diff(lowest[:, [0, 2]], axis=0), axis=1)[same]
    assert slides.max(initial=0) < 0.01


def test_from_leg_to_leg_a_dancer_hops_and_does_not_sink():
    rest = standing(HUMAN)
    pool = starting_pool(HUMAN, rest)
    kicks = of(Step(0, "left leg raised"), Step(1, "left leg raised", mirror=True), beats=2)
    motion = danced(HUMAN, pool, kicks, MUSIC, rest=rest)
    hips, feet = motion.positions()[:, 0, 1], motion.positions()[:, list(find_body(HUMAN).feet), 1].min(axis=1)
    assert hips.min() > hips[0] - 0.01 and hips.max() < hips[0] + 0.15
    assert feet.max() > feet[0] + 0.05 and np.abs(feet[::12] - feet[0]).max() < 0.01


@pytest.mark.parametrize("seed", [0, 3, 7])
def test_a_dancer_who_changes_legs_is_not_thrown_about(seed):
    """At 24 frames a second hips go nowhere and back within four frames: less than a hand's breadth."""
    rest = standing(HUMAN)
    pool = starting_pool(HUMAN, rest)
    motion = danced(HUMAN, pool, invented(pool, HUMAN, 32, seed, rest), beats.steady(120, 16), rest=rest)
    hips = motion.positions()[:, 0, [0, 2]]
    there_and_back = np.linalg.norm(hips[2:-2] - 0.5 * (hips[:-4] + hips[4:]), axis=1)
    assert there_and_back.max() < 0.1


def test_a_flower_and_a_lamp_stay_where_they_grow():
    for skeleton in (FLOWER, LAMP):
        pool = starting_pool(skeleton)
        motion = danced(skeleton, pool, invented(pool, skeleton, 16, 2), MUSIC)
        places = motion.positions()
        assert np.abs(places[:, 0]).max() < 1e-9 and np.ptp(places[:, -1], axis=0).max() > 0.05


def test_the_same_seed_makes_the_same_dance_and_another_one_another():
    pool = starting_pool(HUMAN)
    dances = [invented(pool, HUMAN, 32, seed) for seed in (1, 1, 2)]
    assert dances[0] == dances[1] != dances[2]
    assert 32 <= dances[0].beats < 40
    assert all(phrase.beats * phrase.repeats == 8 for phrase in dances[0].phrases)
    assert dances[0].phrases[0] == dances[0].phrases[1]  # it comes again


@pytest.mark.parametrize("seed", range(40))
def test_an_invented_dance_keeps_a_foot_on_the_floor_on_every_beat(seed):
    """Two raised legs at once would be a dancer who sits in the air: what is lowest must be a foot."""
    rest = standing(HUMAN)
    pool, body = starting_pool(HUMAN, rest), find_body(HUMAN)
    music = beats.steady(120, 6)
    motion = danced(HUMAN, pool, invented(pool, HUMAN, 12, seed, rest), music, fps=12, rest=rest)
    places = motion.positions()
    hips, feet = places[:, 0, 1], places[:, list(body.feet), 1]
    assert (hips - feet.min(axis=1) > 0.5).all()


def test_a_pool_of_one_posture_is_danced():
    pool = Pool((Posture("lean", {"Spine": (0.0, 0.0, 0.3)}),))
    motion = danced(HUMAN, pool, invented(pool, HUMAN, 8), MUSIC)
    assert np.abs(Rotation.from_quat(motion.rotation[:, 1]).as_rotvec()[:, 2]).max() == pytest.approx(0.3, rel=0.1)


def test_what_cannot_be_danced_is_refused():
    pool = starting_pool(HUMAN)
    for dance, said in (
        (of(Step(0, "no such")), "no such"),
        (of(Step(0, "bow", part="left wing")), "left wing"),
        (Dance(()), "must have steps"),
    ):
        with pytest.raises(InputError, match=said):
            danced(HUMAN, pool, dance, MUSIC)
    with pytest.raises(InputError, match="1 to 1000"):
        danced(HUMAN, pool, of(Step(0, "bow")), MUSIC, fps=0)


def test_minutes_of_dance_take_seconds():
    rest = standing(HUMAN)
    pool = starting_pool(HUMAN, rest)
    music = beats.steady(120, 120)
    start = time.thread_time()
    danced(HUMAN, pool, invented(pool, HUMAN, 240), music, rest=rest)
    assert time.thread_time() - start < 6


def test_a_stretch_of_a_dance_is_that_stretch_of_the_whole():
    rest = standing(HUMAN)
    pool = starting_pool(HUMAN, rest)
    dance = invented(pool, HUMAN, 16, 3, rest)
    whole = danced(HUMAN, pool, dance, MUSIC, rest=rest)
    some = danced(HUMAN, pool, dance, MUSIC, rest=rest, between=(2.0, 5.0))
    assert len(some) == 72
    apart = np.linalg.norm(some.positions()[8:-8] - whole.positions()[56:112], axis=-1)
    assert apart.max() < 0.03
    with pytest.raises(InputError, match="some of its 8 s"):
        danced(HUMAN, pool, dance, MUSIC, rest=rest, between=(9.0, 10.0))
