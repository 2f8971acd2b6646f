"""Keys become one mesh in several shapes, freed of the affine maps between them, which are kept."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from capture.errors import InputError
from capture.motion import keys
from fixtures import hat, maps

relaxed = settings(deadline=None, max_examples=20, derandomize=True)
REST = maps.ellipse((100, 80), 40, 30, 40)


def bent(points, by):
    """Shifted sideways by the square of the height: no affine map does that."""
    points = np.asarray(points, float)
    return points + np.stack([by * ((points[..., 1] - 80) / 30) ** 2, 0 * points[..., 1]], -1)


@st.composite
def some_map(draw):
    angle, shear = draw(st.floats(-3, 3)), draw(st.floats(-0.5, 0.5))
    linear = maps.turn(angle) @ [[draw(st.floats(0.5, 2)), shear], [0, draw(st.floats(0.5, 2))]]
    return maps.place(linear, (100, 80), (draw(st.floats(-300, 300)), draw(st.floats(-300, 300))))


@given(some_map())
@relaxed
def test_a_key_that_differs_by_an_affine_map_is_the_same_key_and_the_map_is_kept(moved):
    made = keys.keyset(("rest", "moved"), np.stack([REST, maps.move(moved, REST)]))
    assert np.allclose(made.points[1], made.points[0], atol=1e-6)
    assert np.allclose(made.removed, [np.eye(2, 3), moved], atol=1e-8)


@given(some_map(), st.floats(-30, 30))
@relaxed
def test_what_alignment_takes_out_it_can_put_back(moved, by):
    drawn = np.stack([REST, maps.move(moved, bent(REST, by)), maps.move(maps.undo(moved), bent(REST, -by))])
    aligned, removed = keys.align(drawn, np.arange(40))
    assert np.allclose(maps.move(removed, aligned), drawn)
    assert np.array_equal(aligned[0], REST) and np.array_equal(removed[0], np.eye(2, 3))


@given(some_map(), st.floats(-30, 30))
@relaxed
def test_alignment_does_not_depend_on_how_a_key_was_placed(moved, by):
    here, _ = keys.align(np.stack([REST, bent(REST, by)]), np.arange(40))
    there, _ = keys.align(np.stack([REST, maps.move(moved, bent(REST, by))]), np.arange(40))
    assert np.allclose(here, there, atol=1e-8)


def test_alignment_is_measured_on_the_outline_alone():
    """A target has other inner points than the source: they must not have a say."""
    inside = np.array([(100.0, 80.0), (110.0, 90.0)])
    drawn = np.stack([np.vstack([REST, inside]), np.vstack([bent(REST, 20) + 50, inside * 7])])
    without, _ = keys.align(drawn[:, :40], np.arange(40))
    assert np.allclose(keys.align(drawn, np.arange(40))[0][:, :40], without)


def test_a_keyset_keeps_the_drawn_points_first():
    drawn = np.stack([REST, maps.move(maps.place(maps.turn(0.4), (0, 0), (3, 4)), bent(REST, 15)), bent(REST, -15)])
    made = keys.keyset(("a", "b", "c"), drawn)
    assert np.allclose(maps.move(made.removed, made.points)[:, :40], drawn)
    assert np.array_equal(made.outline, np.arange(40)) and made.faces.max() == made.points.shape[1] - 1


def test_the_inside_of_a_later_key_follows_its_outline():
    drawn = np.stack([hat.bent(hat.outline(), *bend) for bend in hat.BEND])
    made = keys.keyset(("rest", "bent", "lean"), drawn)
    a, b, c = np.moveaxis(maps.move(made.removed, made.points)[:, made.faces], -2, 0)
    u, v = b - a, c - a
    assert ((u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]) > 0).all()  # nothing folds over
    inside = np.arange(100, made.points.shape[1])
    for key, bend in zip(maps.move(made.removed, made.points), hat.BEND):
        true = hat.bent(made.points[0, inside], *bend)
        assert np.median(np.linalg.norm(key[inside] - true, axis=1)) < 2  # of 188 pixels


@pytest.mark.parametrize("count", range(1, 6))
@pytest.mark.parametrize("steps", [0, 1, 5])
def test_every_pair_is_counted_once(count, steps):
    """Erratum to section 3.1.3: K + K (K - 1) / 2 M rows, where the paper's count gives none for two keys."""
    rows = keys.inbetween_rows(count, steps)
    assert len(rows) == count + count * (count - 1) // 2 * steps
    assert np.array_equal(rows[:count], [(i, i, 0) for i in range(count)])
    assert len(np.unique(rows, axis=0)) == len(rows)
    assert ((rows[count:, 0] < rows[count:, 1]) & (rows[count:, 2] > 0) & (rows[count:, 2] < 1)).all()


def test_in_betweens_are_evenly_spread():
    assert np.allclose(keys.inbetween_rows(2, 3)[2:], [(0, 1, 0.25), (0, 1, 0.5), (0, 1, 0.75)])


@given(st.integers(1, 5), st.integers(0, 5), st.integers(0, 10**6))
@relaxed
def test_folded_weights_keep_their_sum(count, steps, seed):
    rows = keys.inbetween_rows(count, steps)
    weights = np.random.default_rng(seed).normal(size=(7, len(rows)))
    folded = keys.fold(rows, weights, count)
    assert folded.shape == (7, count) and np.allclose(folded.sum(1), weights.sum(1))


def test_a_row_is_folded_by_its_way_between_the_keys():
    rows = np.array([(0, 0, 0), (2, 2, 0), (0, 2, 0.25), (1, 2, -0.5)])
    assert np.allclose(keys.fold(rows, np.eye(4), 3), [(1, 0, 0), (0, 0, 1), (0.75, 0, 0.25), (0, 1.5, -0.5)])


def test_folding_is_exact_for_straight_in_betweens():
    made = keys.keyset(("a", "b", "c"), np.stack([REST, bent(REST, 20), bent(REST, -10)]))
    weights = np.random.default_rng(0).dirichlet(np.ones(len(made.rows)), 4)
    straight = keys.shapes(made, keys.straight)
    by_keys = np.tensordot(keys.fold(made.rows, weights, 3), made.points, axes=1)
    assert np.allclose(np.tensordot(weights, straight, axes=1), by_keys)


def test_shapes_hold_the_keys_and_follow_the_rule_given():
    made = keys.keyset(("a", "b"), np.stack([REST, bent(REST, 20)]), inbetweens=1)
    assert np.allclose(keys.shapes(made)[:2], made.points)
    assert np.allclose(keys.shapes(made, keys.straight)[2], made.points.mean(axis=0))


def test_in_betweens_are_aligned_to_key_0_as_the_keys_are():
    stretched = maps.move(maps.place([[1.3, 0.4], [-0.2, 0.6]], (0, 0), (50, 9)), bent(REST, 20))
    made = keys.keyset(("a", "b"), np.stack([REST, stretched]))
    for rule in (keys.rigid, keys.straight):
        outlines = keys.shapes(made, rule)[:, made.outline]
        assert np.allclose([maps.best_affine(REST, outline) for outline in outlines], np.eye(2, 3), atol=1e-8)


@given(st.floats(-3, 3), st.floats(-300, 300), st.booleans())
@relaxed
def test_in_betweens_do_not_care_where_a_key_was_drawn_nor_which_way_it_faces(angle, x, mirrored):
    """Half-way to its own mirror image a drawing would have no width: facing about must not come into it."""
    away = maps.place(maps.turn(angle) @ np.diag([-1 if mirrored else 1, 1]), (100, 80), (x, 50))
    here = keys.keyset(("a", "b"), np.stack([REST, bent(REST, 20)]))
    there = keys.keyset(("a", "b"), np.stack([REST, maps.move(away, bent(REST, 20))]))
    assert np.allclose(keys.shapes(here), keys.shapes(there), atol=1e-6)


def test_other_rows_can_be_asked_for():
    made = keys.keyset(("a", "b"), np.stack([REST, bent(REST, 20)]))
    again = keys.with_rows(made, [(0, 1, 0.3)])
    assert again.rows.shape == (1, 3) and len(made.rows) == 7 and again.points is made.points
    assert len(keys.shapes(again)) == 1


def test_one_key_alone_is_a_keyset():
    made = keys.keyset(("only",), REST[None])
    assert np.array_equal(made.rows, [(0, 0, 0)]) and np.array_equal(keys.shapes(made), made.points)


@pytest.mark.parametrize(
    "names, outlines, words",
    [
        (("a",), np.stack([REST, REST]), "one outline each"),
        (("a", "b"), REST, "one outline each"),
        (("a",), REST[None, :2], "3 or more"),
        (("a", "b"), np.stack([REST, np.full_like(REST, 5.0)]), "flat"),
        (("a", "b"), np.stack([REST, REST * (1, 0)]), "flat"),
        (("a", "b"), np.stack([REST, REST * np.nan]), "finite"),
    ],
)
def test_keys_that_are_no_shapes_are_refused(names, outlines, words):
    with pytest.raises(InputError, match=words):
        keys.keyset(names, outlines)


def test_the_drawn_outlines_are_left_as_they_were():
    drawn = np.stack([REST, bent(REST, 20)])
    before = drawn.copy()
    made = keys.keyset(("a", "b"), drawn)
    replace(made, points=made.points + 1)
    assert np.array_equal(drawn, before)
