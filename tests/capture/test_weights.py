"""Weights are the best there are under the paper's three constraints, by other people's solvers too."""

from itertools import product
from math import comb

import numpy as np
import pytest

from capture.fit.shapes.weights import fit_weights, supports
from capture.motion.keys import inbetween_rows

LOW, HIGH = -0.5, 1.5


def scene(seed, count=3, steps=2, points=8):
    """Rows (D, 3) of `count` keys and shapes (D, N, 2) that lie on bent ways between them."""
    rng = np.random.default_rng(seed)
    rows = inbetween_rows(count, steps)
    drawn = rng.normal(size=(count, points, 2)) * 30
    i, j, s = rows[:, 0].astype(int), rows[:, 1].astype(int), rows[:, 2, None, None]
    bend = rng.normal(size=(count, count, points, 2)) * 8
    return rng, rows, (1 - s) * drawn[i] + s * drawn[j] + s * (1 - s) * bend[i, j]


def gap(weights, shapes, tracked):
    return np.sum((np.tensordot(weights, shapes, axes=1) - tracked) ** 2, axis=(-1, -2))


def by_slsqp(tracked, shapes):
    """The least gap (scalar) over weights of these few shapes, by scipy's sequential quadratic programming."""
    from scipy.optimize import minimize

    flat, goal = shapes.reshape(len(shapes), -1).T, tracked.ravel()
    scale = np.sum(goal**2)
    found = minimize(
        lambda w: np.sum((flat @ w - goal) ** 2) / scale,
        np.full(len(shapes), 1 / len(shapes)),
        jac=lambda w: 2 * flat.T @ (flat @ w - goal) / scale,
        bounds=[(LOW, HIGH)] * len(shapes),
        constraints={"type": "eq", "fun": lambda w: w.sum() - 1, "jac": np.ones_like},
        options={"ftol": 1e-14, "maxiter": 200},
    )
    return gap(found.x, shapes, tracked)


@pytest.mark.parametrize("seed", range(40))
def test_no_allowed_mix_comes_nearer(seed):
    """Every support is solved again by SLSQP; far-off targets make the bounds bite."""
    rng, rows, shapes = scene(seed)
    tracked = shapes.mean(axis=0) + rng.normal(size=(2, *shapes.shape[1:])) * (10, 80)[seed % 2]
    found = gap(fit_weights(tracked, shapes, rows, simpler=1.0), shapes, tracked)
    best = [min(by_slsqp(frame, shapes[support]) for support in supports(rows)) for frame in tracked]
    assert np.allclose(found, best, rtol=1e-6)


@pytest.mark.parametrize("seed", range(5))
def test_a_dense_quadratic_program_agrees_where_one_support_holds_all(seed):
    """Three keys and no in-betweens: the third opinion is cvxpy's."""
    import cvxpy

    rng, rows, shapes = scene(seed, steps=0)
    shapes = shapes[:3]
    tracked = shapes.mean(axis=0) + rng.normal(size=shapes.shape[1:]) * 60
    w = cvxpy.Variable(3)
    mix = shapes.reshape(3, -1).T @ w - tracked.ravel()
    problem = cvxpy.Problem(cvxpy.Minimize(cvxpy.sum_squares(mix)), [cvxpy.sum(w) == 1, w >= LOW, w <= HIGH])
    problem.solve(solver="CLARABEL")
    assert np.allclose(fit_weights(tracked[None], shapes, rows, simpler=1.0)[0], w.value, atol=1e-4)


@pytest.mark.parametrize("seed", range(10))
def test_the_three_constraints_hold(seed):
    rng, rows, shapes = scene(seed, count=4, steps=5)
    tracked = shapes.mean(axis=0) + rng.normal(size=(30, *shapes.shape[1:])) * 100
    weights = fit_weights(tracked, shapes, rows)
    used = weights != 0
    assert (used.sum(axis=1) <= 3).all()
    assert np.allclose(weights.sum(axis=1), 1)
    assert weights.min() >= LOW - 1e-8 and weights.max() <= HIGH + 1e-8
    allowed = [set(support) for support in supports(rows)]
    assert all(any(set(np.flatnonzero(frame)) <= support for support in allowed) for frame in used)


def test_bounds_of_ones_own_hold_too():
    rng, rows, shapes = scene(0)
    tracked = shapes.mean(axis=0) + rng.normal(size=(30, *shapes.shape[1:])) * 100
    weights = fit_weights(tracked, shapes, rows, bounds=(0.0, 1.0))
    assert weights.min() >= -1e-8 and weights.max() <= 1 + 1e-8 and np.allclose(weights.sum(axis=1), 1)
    assert (gap(weights, shapes, tracked) >= gap(fit_weights(tracked, shapes, rows), shapes, tracked) * 0.95).all()


@pytest.mark.parametrize("seed", range(10))
def test_known_weights_are_found_again(seed):
    rng, rows, shapes = scene(seed, count=4, steps=5)
    allowed = supports(rows)
    true = np.zeros((50, len(rows)))
    for frame in true:
        support = allowed[rng.integers(len(allowed))]
        w = rng.uniform(-0.4, 0.9, len(support))
        w[0] += 1 - w.sum()
        frame[support] = w if LOW < w[0] < HIGH else np.eye(len(support))[0]
    weights = fit_weights(np.tensordot(true, shapes, axes=1), shapes, rows)
    assert np.allclose(weights, true, atol=1e-5)


def test_a_key_is_a_key_and_nothing_else():
    _, rows, shapes = scene(3, count=4, steps=5)
    assert np.allclose(fit_weights(shapes, shapes, rows), np.eye(len(rows)), atol=1e-6)


def test_of_two_mixes_as_good_the_smaller_is_taken():
    """Keys on a straight line: its middle is an in-between row, and also half of either end."""
    rows = inbetween_rows(2, 1)
    ends = np.random.default_rng(0).normal(size=(2, 5, 2))
    shapes = np.concatenate([ends, ends.mean(axis=0, keepdims=True)])
    for row in range(3):
        weights = fit_weights(shapes[[row]], shapes, rows)[0]
        assert np.allclose(np.tensordot(weights, shapes, axes=1), shapes[row])
        assert np.count_nonzero(np.abs(weights) > 1e-6) <= 2


def test_equal_keys_do_no_harm():
    rng, rows, shapes = scene(1)
    shapes[:] = shapes[0]
    weights = fit_weights(shapes[:2] + rng.normal(size=shapes[:2].shape), shapes, rows)
    assert np.isfinite(weights).all() and np.allclose(weights.sum(axis=1), 1) and np.abs(weights).max() <= HIGH


def test_one_key_has_weight_one():
    shapes = np.random.default_rng(0).normal(size=(1, 5, 2))
    assert np.array_equal(fit_weights(shapes[[0, 0]] * 7, shapes, inbetween_rows(1)), [[1], [1]])


@pytest.mark.parametrize("size", [1e-3, 1e3, 1e6])
def test_weights_do_not_depend_on_the_unit(size):
    rng, rows, shapes = scene(5)
    tracked = shapes.mean(axis=0) + rng.normal(size=(9, *shapes.shape[1:])) * 20
    plain = fit_weights(tracked, shapes, rows)
    assert np.allclose(fit_weights(tracked * size + 40, shapes * size + 40, rows), plain, atol=1e-6)


def test_many_frames_are_the_same_as_one_by_one():
    rng, rows, shapes = scene(6)
    tracked = shapes.mean(axis=0) + rng.normal(size=(9, *shapes.shape[1:])) * 20
    together = fit_weights(tracked, shapes, rows)
    assert np.allclose(
        together, np.concatenate([fit_weights(frame[None], shapes, rows) for frame in tracked]), atol=1e-9
    )


# -- which rows may be mixed ----------------------------------------------------------------------------------


@pytest.mark.parametrize("count, steps", list(product((1, 2, 3, 4), (0, 1, 5))))
def test_a_support_is_a_step_of_a_chain_and_at_most_one_further_key(count, steps):
    rows = inbetween_rows(count, steps)
    found = supports(rows)
    assert len({frozenset(support) for support in found}) == len(found)
    pairs = comb(count, 2)  # also those that have no in-between of their own
    further = comb(count, 3) if steps == 0 else pairs * (steps + 1) * (count - 2)
    assert len(found) == count + pairs * (steps + 1) + further
    for support in found:
        assert 1 <= len(support) == len(set(support)) <= 3
        if len(support) >= 2:
            (i, j, s), (k, m, u) = rows[support[:2]]
            start, end = (s if i != j else 0), (u if k != m else 1)
            assert 0 <= start < end <= 1 and end - start <= 1 / (steps + 1) + 1e-9
        if len(support) == 3:
            assert rows[support[2], 0] == rows[support[2], 1]  # a key


@pytest.mark.parametrize("most", [1, 2, 3, 4, 5])
def test_at_most_so_many_rows_are_used_as_are_asked_for(most):
    rng, rows, shapes = scene(most, count=5, steps=2)
    tracked = shapes.mean(axis=0) + rng.normal(size=(20, *shapes.shape[1:])) * 40
    weights = fit_weights(tracked, shapes, rows, most, simpler=1.0)
    assert ((weights != 0).sum(axis=1) <= most).all() and np.allclose(weights.sum(axis=1), 1)
    if most > 2:  # every support of fewer rows is part of one of more
        fewer = fit_weights(tracked, shapes, rows, most - 1, simpler=1.0)
        assert (gap(weights, shapes, tracked) < gap(fewer, shapes, tracked) + 1e-6).all()


def test_one_row_at_a_time_is_the_nearest_row():
    rng, rows, shapes = scene(8, count=4, steps=3)
    tracked = shapes.mean(axis=0) + rng.normal(size=(20, *shapes.shape[1:])) * 20
    nearest = ((tracked[:, None] - shapes) ** 2).sum(axis=(2, 3)).argmin(axis=1)
    assert np.array_equal(fit_weights(tracked, shapes, rows, most=1), np.eye(len(rows))[nearest])


def test_five_rows_are_one_step_and_three_further_keys():
    found = [support for support in supports(inbetween_rows(5, 2), 5) if len(support) == 5]
    assert len(found) == comb(5, 2) * 3
    for step in found:
        (i, _, _), (_, j, _) = inbetween_rows(5, 2)[step[:2]]
        assert len({int(i), int(j), *step[2:]}) == 5


def test_a_chain_runs_by_its_parameter_however_the_rows_are_listed():
    rows = np.array([(0, 1, 0.75), (1, 1, 0), (0, 1, 0.25), (0, 0, 0)])
    assert supports(rows)[2:] == [[3, 2], [2, 0], [0, 1]]
