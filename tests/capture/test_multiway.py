"""Any number of keys are mixed as rigidly as two, and it does not matter in which order they stand."""

from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from capture.errors import InputError
from capture.motion import arap
from fixtures import maps

relaxed = settings(deadline=None, max_examples=20, derandomize=True)
LENGTH, WIDTH = 100.0, 10.0


def strip(columns=17, rows=3):
    """A strip of squares cut in two: points (N, 2) and faces (F, 3)."""
    x, y = np.meshgrid(np.linspace(0, LENGTH, columns), np.linspace(-WIDTH / 2, WIDTH / 2, rows))
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    below = corner + columns
    faces = np.concatenate([np.stack([corner, corner + 1, below + 1], -1), np.stack([corner, below + 1, below], -1)])
    return np.column_stack([x.ravel(), y.ravel()]), faces


def curled(points, total):
    """The strip wound up by `total` radians along a circle: its middle line keeps its length."""
    angle, radius = total * points[:, 0] / LENGTH, LENGTH / total
    r = radius - points[:, 1]
    return np.column_stack([r * np.sin(angle), radius - r * np.cos(angle)])


def turned(points, angle, shift=(0, 0)):
    return maps.move(maps.place(maps.turn(angle), (0, 0), shift), points)


def off(a, b):
    return np.linalg.norm(a - b, axis=-1).max()


def signed_areas(points, faces):
    a, b, c = np.moveaxis(points[..., faces, :], -2, 0)
    u, v = b - a, c - a
    return 0.5 * (u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])


def weights_of_sum_1(rng, frames, count):
    w = rng.uniform(-0.4, 1.0, (frames, count))
    w[:, 0] += 1 - w.sum(axis=1)
    return w


MESH, FACES = strip()
KEYS = np.stack([MESH, curled(MESH, 2.0) + (5, -7), curled(MESH * (1.4, 1.0), -1.2), turned(MESH * (0.7, 1.3), 0.4)])


@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_a_weight_of_one_redraws_its_key(count):
    assert off(arap.mix(KEYS[:count], FACES, np.eye(count)), KEYS[:count]) < 1e-9


@given(st.floats(-0.5, 1.5), st.floats(-5.5, 5.5).filter(lambda total: abs(total) > 0.01))
@relaxed
def test_two_keys_give_their_in_between(s, total):
    pair = np.stack([MESH, curled(MESH, total)])
    between = arap.inbetweens(pair, FACES, np.array([(0, 1, s)]))
    assert off(arap.mix(pair, FACES, np.array([(1 - s, s)])), between) < 1e-9


def test_between_two_keys_of_four_the_other_two_hardly_show():
    """They say only where misfits are measured from; a jump at weight 0 would be worse."""
    pairs = arap.inbetweens(KEYS, FACES, np.array([(0, 1, 0.5), (0, 2, 0.3)]))
    found = arap.mix(KEYS, FACES, np.array([(0.5, 0.5, 0, 0), (0.7, 0, 0.3, 0)]))
    assert off(found, pairs) < 0.01 * LENGTH
    nearly = arap.mix(KEYS, FACES, np.array([(0.5, 0.5 - 1e-6, 1e-6, 0)]))
    assert off(nearly[0], found[0]) < 1e-3


@given(st.integers(0, 10**6), st.floats(-300, 300))
@relaxed
def test_a_rigid_shape_that_keys_turn_by_different_angles_stays_rigid(seed, x):
    rng = np.random.default_rng(seed)
    angles = rng.uniform(-1.5, 1.5, 4)
    keys = np.stack([turned(MESH, angle, (x * k, 9 * k)) for k, angle in enumerate(angles)])
    weights = weights_of_sum_1(rng, 5, 4)
    centres = keys.mean(axis=1)
    for shape, w in zip(arap.mix(keys, FACES, weights), weights):
        assert off(shape - w @ centres, turned(MESH - MESH.mean(axis=0), w @ angles)) < 1e-7
        # the centre of the points is mixed too


def test_the_order_of_keys_does_not_matter():
    weights = weights_of_sum_1(np.random.default_rng(0), 6, 4)
    found = arap.mix(KEYS, FACES, weights)
    for order in permutations(range(4)):
        assert off(arap.mix(KEYS[list(order)], FACES, weights[:, list(order)]), found) < 1e-8


@given(st.floats(-3.1, 3.1), st.floats(-80, 80))
@relaxed
def test_a_mix_turns_with_its_keys(angle, x):
    weights = weights_of_sum_1(np.random.default_rng(1), 3, 4)
    plain = arap.mix(KEYS, FACES, weights)
    found = arap.mix(np.stack([turned(key, angle, (x, 3)) for key in KEYS]), FACES, weights)
    assert off(found, np.stack([turned(shape, angle, (x, 3)) for shape in plain])) < 1e-7


def test_equal_keys_give_themselves():
    keys = np.stack([KEYS[1]] * 3)
    assert off(arap.mix(keys, FACES, weights_of_sum_1(np.random.default_rng(2), 4, 3)), KEYS[1]) < 1e-8


def test_three_curls_mix_to_the_curl_between_without_a_flip():
    """A tail wound up by 0, 200 and 400 degrees: principal angles would flip triangles beyond 180."""
    winds = np.radians((1e-3, 200, 400))
    weights = np.array([(1, 1, 1), (1, 0, 1), (0, 1, 1), (2, 1, 1)]) / np.array([3, 2, 2, 4])[:, None]
    found = arap.mix(np.stack([curled(MESH, wind) for wind in winds]), FACES, weights)
    assert (signed_areas(found, FACES) > 0).all()
    for shape, wind in zip(found, weights @ winds):
        true = curled(MESH, wind)
        linear = maps.best_affine(shape, true)
        assert off(maps.move(linear, shape), true) < 0.01 * LENGTH
        assert np.allclose(linear[:, :2] @ linear[:, :2].T, np.eye(2), atol=0.02)


def test_the_mix_solves_the_equations_written_out_face_by_face():
    """A second opinion: scipy's polar decomposition, one dense row for each face, key and axis, solved by lstsq."""
    from scipy.linalg import polar

    keys = np.stack([MESH, turned(MESH * (1.3, 0.9), 0.8), curled(MESH, -1.1)])
    w = np.array([0.5, 0.7, -0.2])
    left, right = [], []
    for start in keys:
        for corners in FACES:
            edges = start[corners[1:]] - start[corners[0]]  # rows
            maps_to = [np.linalg.solve(edges, key[corners[1:]] - key[corners[0]]).T for key in keys]
            turns, stretches = zip(*(polar(m) for m in maps_to))
            angle = sum(share * np.arctan2(turn[1, 0], turn[0, 0]) for share, turn in zip(w, turns))
            goal = maps.turn(angle) @ sum(share * stretch for share, stretch in zip(w, stretches))
            weight = np.sqrt(abs(np.linalg.det(edges)) / 2)
            row = np.zeros((2, len(MESH)))
            row[:, corners[1:]] = np.linalg.inv(edges)
            row[:, corners[0]] = -row[:, corners[1:]].sum(axis=1)
            left.append(weight * row)
            right.append(weight * goal.T)
    left.append(np.full((1, len(MESH)), 1 / len(MESH)))  # and the centre
    right.append((w @ keys.mean(axis=1))[None])
    best = np.linalg.lstsq(np.vstack(left), np.vstack(right))[0]
    assert off(arap.mix(keys, FACES, w[None])[0], best) < 1e-7


def test_weights_must_sum_to_one_and_fit_the_keys():
    with pytest.raises(InputError, match="sum 1"):
        arap.mix(KEYS, FACES, np.full((2, 4), 0.3))
    with pytest.raises(InputError, match="4 keys"):
        arap.mix(KEYS, FACES, np.ones((2, 1)))
    with pytest.raises(InputError, match="sum 1"):
        arap.mix(KEYS, FACES, np.array([(np.nan, 1, 0, 0)]))


def test_the_arguments_are_left_as_they_were():
    keys, weights = KEYS.copy(), np.full((1, 4), 0.25)
    arap.mix(keys, FACES, weights)
    assert np.array_equal(keys, KEYS) and (weights == 0.25).all()
