"""Feet of a springy dance on the spot neither slide nor leave the floor they stand on."""

import numpy as np
import pytest

from fixtures import plants
from fixtures.skeletons import walk
from mocap.body import find_body
from mocap.posing import elastic, postures, starting
from mocap.posing.standing import planted, stood
from mocap.skeleton import Skeleton

FPS = 24
DANCE = (
    {},
    {"point left": 1, "hips right": 1},
    {"crouch": 0.6},
    {"point right": 1, "hips left": 1},
    {"left knee up": 1},
)
DANCE += ({"crouch": 0.5}, {"right kick": 1}, {"arms up": 1})


@pytest.fixture(scope="module", params=[0.4, 0.8])
def dance(request):
    """A dance at 120 beats a minute on springs that swing over, where its joints rest, and its body."""
    made = walk(0.1)
    skeleton = Skeleton(made.names, made.parents, made.offsets)
    rest = starting.standing(skeleton)
    pool = starting.human(skeleton, rest)
    targets = np.stack([postures.mixed(pool, extents, skeleton) for extents in DANCE])
    times = 0.5 * np.arange(len(DANCE))
    at = np.arange(0, times[-1] + 0.5, 1 / FPS)
    turns = elastic.through(elastic.felt(2.0, request.param), at, times, targets).turns
    still = postures.posed(skeleton, 0 * turns[:1], FPS, rest).positions()[0]
    return postures.posed(skeleton, turns, FPS, rest), still, find_body(skeleton)


def slides(motion, feet):
    """How far feet go a frame (T - 1, F), and which are no more than a centimetre above the lowest then."""
    places = motion.positions()[:, list(feet)]
    near = places[..., 1] - places[..., 1].min(axis=1, keepdims=True) < 0.01
    held = np.stack([np.convolve(column, np.ones(9), "same") >= 9 for column in near.T], axis=1)  # for some time
    return np.linalg.norm(np.diff(places, axis=0), axis=-1), held[1:] & held[:-1]


def test_planted_feet_do_not_slide(dance):
    motion, still, body = dance
    moved, down = slides(stood(motion, body.feet, still), body.feet)
    assert moved[down].max() > 0.002  # there is something to mend
    moved, down = slides(planted(motion, body, still), body.feet)
    assert down.any(axis=1).mean() > 0.8
    assert moved[down].max() < 1e-4


def test_somebody_always_stands_at_the_height_of_the_floor(dance):
    motion, still, body = dance
    feet = list(body.feet)
    low = planted(motion, body, still).positions()[:, feet, 1].min(axis=1)
    assert np.abs(low - still[feet, 1].min()).max() < 0.03


def test_only_legs_and_roots_are_changed(dance):
    motion, still, body = dance
    done = planted(motion, body, still)
    legs = [joint for joint, label in enumerate(body.label) if label.endswith("leg")]
    others = np.setdiff1d(np.arange(len(motion.skeleton)), legs)
    assert np.array_equal(done.rotation[:, others], motion.rotation[:, others])
    assert np.array_equal(done.translation[:, 1:], motion.translation[:, 1:])


def test_planting_does_not_jerk(dance):
    motion, still, body = dance
    before, after = (np.abs(np.diff(one.rotation, axis=0)).max() for one in (motion, planted(motion, body, still)))
    assert after < 1.3 * before


def test_what_has_no_feet_stays_where_it_is():
    made = plants.lamp()
    skeleton = Skeleton(made.names, made.parents, made.offsets)
    motion = postures.posed(skeleton, np.zeros((3, len(skeleton), 3)), FPS)
    body = find_body(skeleton)
    assert not body.feet
    assert np.array_equal(planted(motion, body, motion.positions()[0]).positions(), motion.positions())
