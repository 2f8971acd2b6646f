"""Limbs go no deeper into each other than they were captured."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize

from mocap.rubber import collide

FPS = 60.0
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
    way, (one, other) = collide.nearest_points(*(point[None] for point in ends))
    np.testing.assert_allclose(np.linalg.norm(way), found, atol=1e-4)
    np.testing.assert_allclose(way[0], a + one[0] * (b - a) - c - other[0] * (d - c), atol=1e-12)


def crossing(leg, standing, count=60):
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
    speed = [np.abs(np.diff(p, 2, axis=0)).max() for p in (places, after)]
    assert speed[1] < 0.02 and np.abs(after - places)[before == 0][:5].max() < 1e-6


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
