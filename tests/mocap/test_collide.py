"""Limbs go no deeper into each other than they were captured."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import binary_dilation
from scipy.optimize import minimize

from mocap.rubber import capsules, collide

FPS = 60.0
PUSHES = capsules.run, capsules.compiled()
points = st.tuples(*[st.floats(-2, 2)] * 12).map(lambda numbers: np.array(numbers).reshape(4, 3))


@settings(max_examples=60, deadline=None)
@given(points)
def test_nearest_points_of_segments_are_the_minimum_of_the_distance(ends):
    a, b, c, d = ends

    def distance(shares):
        return np.linalg.norm(a + shares[0] * (b - a) - c - shares[1] * (d - c))

    found = min(
        minimize(distance, start, bounds=[(0, 1)] * 2).fun for start in ((0, 0), (1, 1), (0, 1), (1, 0), (0.5, 0.5))
    )
    way, (one, other) = capsules.nearest_points(*(point[None] for point in ends))
    np.testing.assert_allclose(np.linalg.norm(way), found, atol=1e-4)
    np.testing.assert_allclose(way[0], a + one[0] * (b - a) - c - other[0] * (d - c), atol=1e-12)


def crossing(leg, standing, count=150):
    """The right leg swings through the left one and back."""
    sub = leg()
    places = standing(sub, count)
    swing = 0.22 * np.sin(np.linspace(0, np.pi, count))
    right = [s for s, joint in enumerate(sub.joint) if joint in (6, 7, 8)]
    down = 1 - places[0, right, 1]
    places[:, right, 0] += swing[:, None] * down
    return sub, places


def test_legs_that_cross_are_pushed_apart(leg, standing):
    sub, places = crossing(leg, standing)
    captured = standing(sub, len(places))[:, sub.ends]
    before = collide.overlaps(places[:, sub.ends], captured, sub.skeleton)
    assert before.max() > 0.03
    after = collide.pushed_apart(places, captured, sub, FPS)
    assert collide.overlaps(after[:, sub.ends], captured, sub.skeleton).max() < 0.2 * before.max()
    near = binary_dilation(before > 0, iterations=round(0.25 * FPS))
    np.testing.assert_allclose(after[~near], places[~near], atol=1e-9)
    assert (~near).sum() > 10


def test_a_leg_that_swings_through_the_other_is_pushed_to_one_side_and_softly(leg, standing):
    """To the side on which it was captured: pushed the shortest way it would be thrown from side to side."""
    sub, places = crossing(leg, standing, 120)
    places[:, :, 2] += np.linspace(-0.4, 0.4, 120)[:, None] * (1 - places[:, :, 1]) * (places[:, :, 0] < 0.08)
    captured = standing(sub, len(places))[:, sub.ends]
    after = collide.pushed_apart(places, captured, sub, 120.0)
    away = (after - places)[:, sub.ends[6:8], 0]  # the right knee and ankle, from the left
    assert away.min() < -0.02 and away.max() < 0.002
    jerk = np.abs(np.diff(after - places, 3, axis=0)).max() * 120**3
    assert jerk < np.pi**3 / 0.1**3 * np.abs(away).max()  # as much as a sine of half a round in a tenth of a second


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**31))
def test_machine_code_pushes_as_numpy_does(seed):
    rng = np.random.default_rng(seed)
    parents = np.array([-1, 0, 1, 2, 0, 4, 5])
    joints, captured = rng.normal(size=(2, 5, 7, 3))
    captured = joints + 0.1 * captured
    pairs, fast = np.array([(3, 6), (2, 6), (3, 5), (6, 1)]), np.array([1, 1, 0, 0, 1, 0, 0], bool)
    thick = rng.uniform(0.05, 0.8, 7)
    for one, other in zip(*(push(joints, captured, pairs, parents, fast, thick) for push in PUSHES)):
        np.testing.assert_allclose(one, other, atol=1e-9)


def test_what_was_captured_crossing_may_stay(leg, standing):
    sub, places = crossing(leg, standing)
    captured = places[:, sub.ends]
    assert collide.overlaps(captured, captured, sub.skeleton).max() == 0
    np.testing.assert_array_equal(collide.pushed_apart(places, captured, sub, FPS), places)


def test_links_that_meet_are_no_pair(leg):
    sub = leg()
    pairs = collide._pairs(sub.skeleton)
    names = sub.skeleton.names
    met = {frozenset((names[one], names[other])) for one, other in pairs}
    assert frozenset(("left knee", "right knee")) in met and frozenset(("left knee", "left ankle")) not in met
