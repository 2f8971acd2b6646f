"""Affine maps are a group, the fits find what was hidden, and degenerate points do not break them."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from capture.motion import affine

relaxed = settings(deadline=None, max_examples=40, derandomize=True)
number = st.floats(-100, 100, allow_subnormal=False)
points = arrays(float, (7, 2), elements=number)


@st.composite
def maps(draw, d=2):
    """A map (d, d + 1) that can be undone: turned, stretched between a third and three times, and moved."""
    seed = draw(st.integers(0, 2**32 - 1))
    rng = np.random.default_rng(seed)
    u, _, vt = np.linalg.svd(rng.normal(size=(d, d)))
    stretch = [draw(st.floats(1 / 3, 3)) for _ in range(d)]
    return np.column_stack([(u * stretch) @ vt, [draw(number) for _ in range(d)]])


def by_hand(m, p):
    """v = L x + t, one point at a time."""
    return np.array([m[:, :-1] @ x + m[:, -1] for x in p])


def turned(angle, scale=1.0, shift=(0, 0)):
    c, s = scale * np.cos(angle), scale * np.sin(angle)
    return np.array([[c, -s, shift[0]], [s, c, shift[1]]])


@given(maps(), points)
@relaxed
def test_a_map_acts_on_rows_as_l_x_plus_t(m, p):
    assert np.allclose(affine.apply(m, p), by_hand(m, p))


@given(maps(), maps(), maps(), points)
@relaxed
def test_maps_form_a_group(a, b, c, p):
    one = affine.identity()
    assert np.allclose(affine.apply(affine.compose(a, b), p), affine.apply(a, affine.apply(b, p)))
    assert np.allclose(affine.compose(affine.compose(a, b), c), affine.compose(a, affine.compose(b, c)))
    assert np.allclose(affine.compose(a, one), a) and np.allclose(affine.compose(one, a), a)
    assert np.allclose(affine.compose(a, affine.invert(a)), one, atol=1e-9)
    assert np.allclose(affine.compose(affine.invert(a), a), one, atol=1e-9)


@given(maps(d=3), maps(d=3))
@relaxed
def test_the_group_holds_in_space_too(a, b):
    p = np.random.default_rng(0).normal(size=(5, 3))
    assert np.allclose(affine.apply(affine.compose(a, b), p), by_hand(a, by_hand(b, p)))
    assert np.allclose(affine.compose(a, affine.invert(a)), affine.identity(3), atol=1e-9)


def test_a_flattening_map_has_no_inverse():
    with pytest.raises(np.linalg.LinAlgError):
        affine.invert([[1, 0, 5], [0, 0, 5]])


@given(maps(), arrays(float, 2, elements=number), points)
@relaxed
def test_a_map_about_a_pivot_moves_the_pivot_by_its_shift_alone(m, pivot, p):
    plain = affine.about(m, pivot)
    assert np.allclose(affine.apply(plain, p), (p - pivot) @ m[:, :2].T + pivot + m[:, 2])
    assert np.allclose(affine.apply(plain, pivot[None])[0], pivot + m[:, 2])
    assert np.allclose(affine.from_about(plain, pivot), m) and np.allclose(
        affine.about(affine.from_about(m, pivot), pivot), m
    )


def test_a_turn_about_a_pivot_leaves_it_where_it_is():
    quarter = affine.about(turned(np.pi / 2), [10.0, 20.0])
    assert np.allclose(affine.apply(quarter, [[10, 20], [11, 20]]), [[10, 20], [10, 21]])  # x turns towards y, down


@given(maps(), points)
@relaxed
def test_a_fit_recovers_the_map_exactly(m, p):
    assume(np.linalg.svd(p - p.mean(0), compute_uv=False)[-1] > 1)
    assert np.allclose(affine.fit(p, affine.apply(m, p)), m, atol=1e-6)


@pytest.mark.parametrize("seed", range(10))
def test_a_fit_of_noisy_points_is_the_least_squares_one(seed):
    rng = np.random.default_rng(seed)
    source, target = rng.normal(size=(2, 20, 2)) * 40
    padded = np.column_stack([source, np.ones(20)])
    assert np.allclose(affine.fit(source, target), np.linalg.lstsq(padded, target, rcond=None)[0].T)


@given(st.floats(-3, 3), st.floats(0.3, 3), st.floats(-3, 3), st.integers(2, 30))
@relaxed
def test_a_straight_line_of_points_is_turned_and_scaled_and_never_flattened(angle, scale, slope, count):
    """The erratum to eq. 6: the minimum norm alone would leave no width across a line of action."""
    line = np.linspace(-50, 50, count)[:, None] * (np.cos(slope), np.sin(slope)) + (200, 100)
    true = turned(angle, scale, (30, -12))
    found = affine.fit(line, affine.apply(true, line))
    assert np.allclose(found, true, atol=1e-6)
    assert np.linalg.det(found[:, :2]) == pytest.approx(scale**2)


def test_an_almost_straight_line_keeps_its_scale_across():
    """Across a line that is straight but for rounding nothing can be measured: noise there must not be blown up."""
    x = np.linspace(-50, 50, 40)
    rng = np.random.default_rng(1)
    found = affine.fit(
        np.column_stack([x, 1e-4 * rng.normal(size=40)]), np.column_stack([x, 0.3 * rng.normal(size=40)])
    )
    assert np.allclose(np.linalg.svd(found[:, :2], compute_uv=False), 1, atol=0.02)


def test_a_single_point_is_moved_and_nothing_else():
    assert np.allclose(affine.fit([[3.0, 4.0]], [[10.0, 2.0]]), [[1, 0, 7], [0, 1, -2]])
    assert np.allclose(affine.fit_similarity([[3.0, 4.0]] * 3, [[10.0, 2.0]] * 3), [[1, 0, 7], [0, 1, -2]])


@given(st.floats(-3.1, 3.1), st.floats(0.1, 10), number, number, points)
@relaxed
def test_a_similarity_is_recovered_exactly(angle, scale, x, y, p):
    assume(np.ptp(p, axis=0).max() > 1)
    true = turned(angle, scale, (x, y))
    assert np.allclose(affine.fit_similarity(p, affine.apply(true, p)), true, atol=1e-6)


@given(points, points)
@relaxed
def test_a_similarity_never_mirrors_not_even_a_mirrored_shape(p, q):
    for target in (q, p * (-1, 1), np.zeros_like(p)):
        linear = affine.fit_similarity(p, target)[:, :2]
        assert np.linalg.det(linear) >= -1e-9
        assert np.allclose(linear @ linear.T, linear[0] @ linear[0] * np.eye(2), atol=1e-6)  # a turn and a scale
        assert np.allclose(np.linalg.det(affine.fit_similarity(p, target, scaled=False)[:, :2]), 1)


@pytest.mark.parametrize("seed", range(10))
def test_no_other_turn_and_scale_fits_better(seed):
    rng = np.random.default_rng(seed)
    source, target = rng.normal(size=(2, 12, 2))

    def gap(m):
        return np.sum((affine.apply(m, source) - target) ** 2)

    best = affine.fit_similarity(source, target)
    for _ in range(50):
        nudge = turned(*(rng.normal(scale=0.01) + k for k in (0, 1)), rng.normal(size=2, scale=0.01))
        assert gap(affine.compose(nudge, best)) >= gap(best)


def test_a_batch_is_the_same_as_a_loop():
    rng = np.random.default_rng(3)
    many, other = rng.normal(size=(2, 4, 3, 2, 3))
    p, q = rng.normal(size=(2, 4, 3, 9, 2))
    pivot = rng.normal(size=(4, 3, 2))
    for batched, single in (
        (affine.apply(many, p), lambda at: affine.apply(many[at], p[at])),
        (affine.compose(many, other), lambda at: affine.compose(many[at], other[at])),
        (affine.invert(many), lambda at: affine.invert(many[at])),
        (affine.about(many, pivot), lambda at: affine.about(many[at], pivot[at])),
        (affine.from_about(many, pivot), lambda at: affine.from_about(many[at], pivot[at])),
        (affine.fit(p, q), lambda at: affine.fit(p[at], q[at])),
        (affine.fit(p[0, 0], q), lambda at: affine.fit(p[0, 0], q[at])),
        (affine.fit(p, q[0, 0]), lambda at: affine.fit(p[at], q[0, 0])),
        (affine.fit_similarity(p, q), lambda at: affine.fit_similarity(p[at], q[at])),
        (affine.turn(many), lambda at: affine.turn(many[at])),
    ):
        assert np.allclose(batched, [[single((i, j)) for j in range(3)] for i in range(4)])


@given(st.floats(-3.1, 3.1), st.floats(0.2, 4), st.floats(0.2, 4), st.floats(-3, 3))
@relaxed
def test_the_turn_of_a_stretched_and_turned_map_is_its_turn(angle, long, wide, way):
    stretch = turned(way)[:, :2] @ np.diag([long, wide]) @ turned(-way)[:, :2]
    assert affine.turn(np.column_stack([turned(angle)[:, :2] @ stretch, [5, 6]])) == pytest.approx(angle)
