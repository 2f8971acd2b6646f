"""A few modes carry every in-between to within the error asked for, and eq. 3's shapes span the same space."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from capture.fit.shapes import keyspace
from capture.motion import keys
from fixtures import hat

relaxed = settings(deadline=None, max_examples=25, derandomize=True)


def some_shapes(seed, count=12, points=9, d=2):
    """Shapes (D, N, d) that differ less and less from mode to mode, as in-betweens do."""
    rng = np.random.default_rng(seed)
    modes = rng.normal(size=(6, points, d)) * (20 * 0.4 ** np.arange(6))[:, None, None]
    return rng.normal(size=(points, d)) * 50 + np.tensordot(rng.normal(size=(count, 6)), modes, axes=1)


def worst(a, b):
    return np.linalg.norm(a - b, axis=-1).max()


@given(st.integers(0, 10**6), st.sampled_from((0.01, 0.3, 5.0, 1000.0)))
@relaxed
def test_no_point_of_any_row_is_off_by_more_than_the_error(seed, error):
    shapes = some_shapes(seed)
    space = keyspace.extended_space(shapes, error)
    assert worst(keyspace.mix(space, space.coefficients), shapes) == pytest.approx(space.error, abs=1e-9)
    assert space.error <= error
    count = len(space.modes)
    if count:  # and no mode is spent in vain
        fewer = keyspace.extended_space(shapes, 0.0, most=count - 1)
        assert len(fewer.modes) == count - 1 and fewer.error > error


@given(st.integers(0, 10**6), st.integers(2, 3))
@relaxed
def test_modes_are_orthonormal_and_the_mean_is_the_mean(seed, d):
    shapes = some_shapes(seed, d=d)
    space = keyspace.extended_space(shapes)
    flat = space.modes.reshape(len(space.modes), -1)
    assert np.allclose(flat @ flat.T, np.eye(len(flat)), atol=1e-9)
    assert np.allclose(space.mean, shapes.mean(axis=0))
    assert np.allclose(space.coefficients, (shapes - space.mean).reshape(len(shapes), -1) @ flat.T, atol=1e-8)
    assert np.allclose(space.spread, space.coefficients.std(axis=0))
    assert (np.diff(space.spread) <= 1e-9).all()  # the strongest first


def test_modes_are_bounded_and_the_error_left_is_told():
    shapes = some_shapes(1)
    space = keyspace.extended_space(shapes, error=0.0, most=2)
    assert len(space.modes) == 2 and space.error > 0
    assert worst(keyspace.mix(space, space.coefficients), shapes) == pytest.approx(space.error)


def test_a_plane_of_shapes_takes_two_modes():
    rng = np.random.default_rng(4)
    a, b, c = rng.normal(size=(3, 7, 2)) * 30
    mixes = rng.dirichlet((1, 1, 1), 20)
    space = keyspace.extended_space(np.tensordot(mixes, np.stack([a, b, c]), axes=1), error=0.0)
    assert len(space.modes) == 2 and space.error < 1e-9


def test_equal_shapes_take_no_mode():
    for count in (1, 5):
        space = keyspace.extended_space(np.tile(some_shapes(0)[:1], (count, 1, 1)))
        assert space.modes.shape == (0, 9, 2) and space.coefficients.shape == (count, 0) and space.error < 1e-9
        assert worst(keyspace.mix(space, np.zeros((3, 0))), space.mean) == 0


def test_weights_that_sum_to_one_over_eq_3s_shapes_give_the_same_shape():
    """Erratum: the last of them is 1 - sum over l = 1 .. L of alpha_l."""
    space = keyspace.extended_space(some_shapes(2))
    alpha = np.random.default_rng(0).normal(size=(5, len(space.modes))) * 20
    weights = np.column_stack([alpha, 1 - alpha.sum(axis=1)])
    found = np.tensordot(weights, keyspace.as_affine_combination(space), axes=1)
    assert worst(found, keyspace.mix(space, alpha)) < 1e-9


def test_mixing_one_frame_is_mixing_many_one_by_one():
    space = keyspace.extended_space(some_shapes(3))
    alpha = np.random.default_rng(1).normal(size=(2, 3, len(space.modes)))
    found = keyspace.mix(space, alpha)
    assert found.shape == (2, 3, 9, 2)
    assert np.allclose(found, [[keyspace.mix(space, frame) for frame in some] for some in alpha])


def test_the_hats_in_betweens_take_fewer_modes_than_there_are_of_them():
    drawn = np.stack([hat.bent(hat.outline(60), *bend) for bend in hat.BEND])
    rows = keys.shapes(keys.keyset(("rest", "bent", "lean"), drawn, spacing=12.0))
    space = keyspace.extended_space(rows, error=0.1)
    assert space.error <= 0.1 and 2 <= len(space.modes) <= 8 < len(rows) - 1


@given(st.integers(0, 10**6))
@relaxed
def test_map_and_weights_of_a_mix_that_is_seen_are_found_again(seed):
    """Half of the points are seen; the start is a few pixels off."""
    space, rng = keyspace.extended_space(some_shapes(seed, points=24), 0.0, most=3), np.random.default_rng(seed)
    alpha = rng.normal(size=3) * space.spread
    placed = np.array([[0.9, 0.1, 30.0], [-0.15, 1.1, -8.0]])
    at = np.arange(0, 24, 2)
    seen = keyspace.mix(space, alpha)[at] @ placed[:, :2].T + placed[:, 2]
    start = placed + 0.02 * rng.normal(size=(2, 3)) * (1, 1, 100)
    near = alpha + 0.05 * rng.normal(size=3) * space.spread
    found = keyspace.nearest(space, seen, at, start, near, rounds=12)
    mixed = keyspace.mix(space, found[1]) @ found[0][:, :2].T + found[0][:, 2]
    assert worst(mixed[at], seen) < 1e-6
