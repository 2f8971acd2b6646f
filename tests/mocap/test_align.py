"""Laws of time alignment: the best path, within its limits; what it says of the frames."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from capture.errors import InputError
from mocap.analogy import align

rng = np.random.default_rng(5)


def curve(at):
    return np.stack([np.sin(at), np.cos(1.7 * at), 0.3 * np.sin(3.1 * at)], axis=-1)


@settings(max_examples=40, deadline=None)
@given(
    st.integers(2, 14), st.integers(2, 14), st.integers(2, 4), st.integers(0, 2), st.integers(0, 2), st.integers(0, 99)
)
def test_the_path_costs_what_the_plain_recursion_finds_and_keeps_its_limits(n, m, slope, before, after, seed):
    random = np.random.default_rng(seed)
    one, other = random.normal(size=(n, 2)), random.normal(size=(m, 2))
    if n - before - after > slope * m or m > slope * n or before + after >= n:
        return
    best = align.plain(one, other, slope, (before, after))
    if not np.isfinite(best):
        with pytest.raises(InputError, match="path of slope"):
            align.align(one, other, slope, (before, after))
        return
    found = align.align(one, other, slope, (before, after))
    steps = np.diff(found.pairs, axis=0)
    own = ((one[found.pairs[:, 0]] - other[found.pairs[:, 1]]) ** 2).sum()
    np.testing.assert_allclose([found.cost * len(found.pairs), own], best)
    assert {tuple(step) for step in steps} <= {(1, 1), (1, 0), (0, 1)}
    for column in (0, 1):
        assert np.bincount(found.pairs[:, column]).max() <= slope
    assert found.pairs[0, 1] == 0 and found.pairs[-1, 1] == m - 1
    assert found.pairs[0, 0] <= before and found.pairs[-1, 0] >= n - 1 - after


def test_a_known_warp_is_found():
    """One curve played at another's time: the time curve gives that time back."""
    when = np.linspace(0, 1, 240)
    warp = 12 * (when + 0.12 * np.sin(2 * np.pi * when))
    found = align.align(curve(np.linspace(0, 12, 300)), curve(warp))
    at = align.time_curve(found.pairs, 240, 60.0)
    np.testing.assert_allclose(at / 299 * 12, warp, atol=0.06)
    assert (np.diff(at) > 0).all() and at[0] == pytest.approx(0) and at[-1] == pytest.approx(299)


def test_a_motion_answers_itself_frame_by_frame():
    values = rng.normal(size=(80, 5)).cumsum(axis=0)
    found = align.align(values, values)
    np.testing.assert_array_equal(found.pairs, np.stack([np.arange(80)] * 2, axis=-1))
    np.testing.assert_allclose(align.time_curve(found.pairs, 80, 30.0), np.arange(80), atol=1e-9)


def test_a_long_clip_is_aligned_near_a_coarse_path_as_well_as_in_full(monkeypatch):
    one, other = curve(np.linspace(0, 40, 700)), curve(np.linspace(0, 1, 600) ** 1.2 * 40)
    full = align.align(one, other)
    monkeypatch.setattr(align, "CELLS", 1000)
    quick = align.align(one, other)
    assert quick.cost <= full.cost * 1.05 + 1e-9


def test_the_papers_three_cases():
    """One for one is taken; many for one are averaged; one for many goes on to its neighbours."""
    values = np.arange(6.0)[:, None] ** 2
    pairs = np.array([[0, 0], [1, 1], [2, 1], [3, 2], [4, 3], [4, 4], [4, 5], [5, 6]])
    out = align.warped(values, pairs, 7)[:, 0]
    np.testing.assert_allclose(out[[0, 1, 2, 6]], [0, (1 + 4) / 2, 9, 25], atol=1e-9)
    np.testing.assert_allclose(out[3:6], (4 + np.array([-1, 0, 1]) / 3) ** 2, atol=0.02)


def test_lengths_that_no_slope_can_bring_together_are_named():
    with pytest.raises(InputError, match=r"3 times as long .* 100\s+and 20 frames"):
        align.align(np.zeros((100, 1)), np.zeros((20, 1)))
    with pytest.raises(InputError, match="two frames"):
        align.align(np.zeros((1, 1)), np.zeros((20, 1)))
