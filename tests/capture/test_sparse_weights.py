"""Exact means exact: no solver and no search through all choices finds a nearer mix."""

from itertools import combinations

import numpy as np
import pytest

from capture.errors import InputError
from capture.fit.shapes import sparse_weights, weights
from capture.motion.keys import inbetween_rows

LOW, HIGH = -0.5, 1.5
ROWS, SHAPES = inbetween_rows(3, 1), np.random.default_rng(0).normal(size=(6, 7, 2))


def problem(seed, count, frames=2, points=9):
    """Shapes (D, N, 2) of unit size and tracked ones (T, N, 2), near the shapes or far off so that bounds bite."""
    rng = np.random.default_rng(seed)
    shapes = rng.normal(size=(count, points, 2)) / np.sqrt(2 * points)
    mixed = np.tensordot(rng.dirichlet(np.ones(count), frames), shapes, axes=1)
    return mixed + (0.1, 1.0)[seed % 2] * rng.normal(size=mixed.shape) / np.sqrt(2 * points), shapes


def gap(weights, shapes, tracked):
    return np.sum((np.tensordot(weights, shapes, axes=1) - tracked) ** 2, axis=(-1, -2))


def by_clarabel(tracked, shapes):
    """The least gap over weights of these rows, by an interior-point solver with tight tolerances."""
    import clarabel
    from scipy import sparse

    count = len(shapes)
    flat, goal = shapes.reshape(count, -1), tracked.ravel()
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-12
    matrix = np.vstack([np.ones((1, count)), np.eye(count), -np.eye(count)])
    limits = np.concatenate([[1.0], np.full(count, HIGH), np.full(count, -LOW)])
    cones = [clarabel.ZeroConeT(1), clarabel.NonnegativeConeT(2 * count)]
    quadratic = sparse.csc_matrix(np.triu(2 * flat @ flat.T))
    solver = clarabel.DefaultSolver(quadratic, -2 * flat @ goal, sparse.csc_matrix(matrix), limits, cones, settings)
    return gap(np.array(solver.solve().x), shapes, tracked)


@pytest.mark.parametrize("seed", range(50))
def test_dense_weights_agree_with_an_independent_solver(seed):
    tracked, shapes = problem(seed, (3, 8, 14)[seed % 3])
    found = weights.fit_dense(tracked, shapes)
    best = np.array([by_clarabel(frame, shapes) for frame in tracked])
    assert np.abs(gap(found, shapes, tracked) - best).max() < 1e-8
    assert np.allclose(found.sum(axis=1), 1, atol=1e-9) and found.min() >= LOW and found.max() <= HIGH


@pytest.mark.parametrize("seed", range(50))
def test_at_most_three_of_seven_agree_with_brute_force(seed):
    tracked, shapes = problem(seed, 7)
    found = weights.fit_any(tracked, shapes, 3)
    best = [min(by_clarabel(v, shapes[list(c)]) for c in combinations(range(7), 3)) for v in tracked]
    assert np.abs(gap(found, shapes, tracked) - best).max() < 1e-8
    assert ((found != 0).sum(axis=1) <= 3).all() and np.allclose(found.sum(axis=1), 1, atol=1e-9)
    assert found.min() >= LOW - 1e-9 and found.max() <= HIGH + 1e-9


@pytest.mark.parametrize("seed", range(50))
def test_rows_of_chains_agree_with_brute_force(seed):
    most = (1, 2, 3, 4)[seed % 4]
    rows = inbetween_rows(4, 1)
    tracked, shapes = problem(seed, len(rows))
    found = weights.fit_weights(tracked, shapes, rows, most, simpler=1.0)
    best = [min(by_clarabel(v, shapes[c]) for c in weights.supports(rows, most)) for v in tracked]
    assert np.abs(gap(found, shapes, tracked) - best).max() < 1e-8


@pytest.mark.parametrize("seed", range(6))
def test_six_rows_with_bounds_that_bite_agree_too(seed):
    """With a far goal several weights of one support break their bounds at a time."""
    rng = np.random.default_rng(seed)
    _, shapes = problem(seed, 6)
    tracked = 5 * rng.normal(size=(20, *shapes.shape[1:]))
    found = weights.fit_any(tracked, shapes, 6)
    best = [by_clarabel(frame, shapes) for frame in tracked]
    assert np.allclose(gap(found, shapes, tracked), best, rtol=1e-9, atol=1e-8)
    assert np.abs(gap(weights.fit_dense(tracked, shapes), shapes, tracked) - best).max() < 1e-7


def test_the_three_largest_dense_weights_are_another_answer():
    """Why supports are searched: solving again over the three largest rows is worse in many frames."""
    tracked, shapes = problem(1, 8, frames=60)
    exact = gap(weights.fit_any(tracked, shapes, 3), shapes, tracked)
    dense = weights.fit_dense(tracked, shapes)
    kept = np.argsort(-np.abs(dense), axis=1)[:, :3]
    again = [by_clarabel(v, shapes[rows]) for v, rows in zip(tracked, kept)]
    assert (again > exact - 1e-8).all() and np.mean(again > exact + 1e-6) > 0.1


def test_the_few_best_supports_come_best_first():
    tracked, shapes = problem(3, 6, frames=5)
    choices = [list(c) for c in combinations(range(6), 2)]
    given = sparse_weights.problem(tracked, shapes)
    number, score = sparse_weights.best_supports(given, sparse_weights.as_supports(choices), (LOW, HIGH), few=4)
    every = np.array([[by_clarabel(v, shapes[c]) for c in choices] for v in tracked])
    assert np.array_equal(number, np.argsort(every, axis=1)[:, :4])
    assert np.allclose(score * given.unit, np.sort(every, axis=1)[:, :4], atol=1e-7)


def test_long_clips_in_pieces_are_the_same(monkeypatch):
    tracked, shapes = problem(5, 8, frames=50)
    whole = weights.fit_any(tracked, shapes, 3)
    monkeypatch.setattr(sparse_weights, "TABLE", 500)
    assert np.array_equal(weights.fit_any(tracked, shapes, 3), whole)


def test_rows_that_depend_on_each_other_do_no_harm():
    tracked, shapes = problem(2, 5, frames=10)
    twice = np.concatenate([shapes, shapes])
    for found in (weights.fit_dense(tracked, twice), weights.fit_any(tracked, twice, 5)):
        best = [by_clarabel(frame, twice) for frame in tracked]
        assert np.abs(gap(found, twice, tracked) - best).max() < 1e-7
        assert np.isfinite(found).all() and np.allclose(found.sum(axis=1), 1)
    same = weights.fit_dense(tracked, np.stack([shapes[0]] * 3))
    assert np.allclose(same, 1 / 3, atol=1e-4)  # none has more of a right than the others


# -- what cannot be used is refused in one sentence ---------------------------------------------------------------


def refused(words, call, *args, **options):
    with pytest.raises(InputError, match=words) as error:
        call(*args, **options)
    sentence = str(error.value)
    assert ". " not in sentence and "\n" not in sentence and ": " in sentence


@pytest.mark.parametrize("most", [0, -1, 7])
def test_more_rows_at_a_time_than_there_are_or_fewer_than_one_are_refused(most):
    refused("between 1 and the 6", weights.fit_any, SHAPES, SHAPES, most)
    refused("between 1 and the 3", weights.fit_weights, SHAPES, SHAPES, ROWS, most)
    refused("between 1 and the 3", weights.fit_smooth, SHAPES, SHAPES, ROWS, 2.0, most)


@pytest.mark.parametrize("bounds", [(0.0, 0.2), (-1.0, 0.3), (0.6, 1.5), (0.5, -0.5), (np.nan, 1.0)])
def test_bounds_that_exclude_sum_1_are_refused(bounds):
    refused("sum to 1", weights.fit_weights, SHAPES, SHAPES, ROWS, bounds=bounds)
    refused("sum to 1", weights.fit_smooth, SHAPES, SHAPES, ROWS, 2.0, bounds=bounds)
    refused("sum to 1", weights.fit_any, SHAPES, SHAPES, 3, bounds)
    refused("sum to 1", weights.fit_dense, SHAPES[:3], SHAPES[:3], bounds)
    two = inbetween_rows(2, 4)  # no more than two of these six rows may be mixed
    refused("2 weights", weights.fit_weights, SHAPES, SHAPES, two, bounds=(0.0, 0.4))


def test_bounds_without_0_are_refused_where_rows_go_unused():
    refused("hold 0", weights.fit_any, SHAPES, SHAPES, 3, (0.1, 1.0))
    assert np.allclose(weights.fit_dense(SHAPES, SHAPES, (0.1, 1.0)).sum(axis=1), 1)


def test_what_is_not_finite_is_refused_by_its_number():
    broken = SHAPES.copy()
    broken[4, 2, 0] = np.nan
    refused("number 4 ", weights.fit_weights, broken, SHAPES, ROWS)
    refused("number 4 ", weights.fit_dense, SHAPES, broken)
    refused("number 4 ", weights.fit_smooth, broken, SHAPES, ROWS, 1.0)


def test_other_points_than_the_rows_have_are_refused():
    refused("points", weights.fit_any, SHAPES[:, :-1], SHAPES, 2)
    refused("points", weights.fit_dense, SHAPES[0], SHAPES)
    refused("points", weights.fit_smooth, SHAPES[:0], SHAPES, ROWS, 1.0)


def test_a_negative_smoothness_and_too_few_drawing_numbers_are_refused():
    refused("smoothness", weights.fit_smooth, SHAPES, SHAPES, ROWS, -1.0)
    refused("smoothness", weights.fit_smooth, SHAPES, SHAPES, ROWS, np.nan)
    refused("drawing", weights.fit_smooth, SHAPES, SHAPES, ROWS, 1.0, drawing=np.arange(3))


def test_more_choices_than_can_be_looked_through_are_refused():
    many = np.random.default_rng(1).normal(size=(150, 4, 2))
    refused("choices", weights.fit_any, many[:2], many, 5)
