"""What time says of a clip's drawings: straight ways, landings, gaps, and a second solver."""

import numpy as np
import pytest

from capture.fit.whole import in_time
from capture.fit.whole.descend import Look


def look(at: np.ndarray, precision: float) -> Look:
    """Pictures that tell all unknowns (G, M) to so many per square pixel."""
    count, size = at.shape
    information = np.tile(precision * np.eye(size), (count, 1, 1))
    return Look(at, information, np.zeros((count, size)), np.ones(count), np.zeros(count))


def settled(at: np.ndarray, seen: np.ndarray, precision: float = 100.0, middle: np.ndarray | None = None) -> np.ndarray:
    middle = np.arange(len(at), dtype=float) if middle is None else middle
    return in_time.settle(look(at, precision), middle, np.zeros(at.shape[1]), seen)


def test_a_gap_in_an_even_motion_is_filled_exactly_whatever_the_drawings_spacing():
    middle = np.cumsum([0, 1, 2, 2, 1, 1, 2, 3, 1, 2.0])
    straight = np.outer(middle, [3.0, -1.0]) + 7
    seen = ~np.isin(np.arange(10), [4, 5, 6])
    astray = np.where(seen[:, None], straight, 99)
    assert np.abs(settled(astray, seen, middle=middle) - straight).max() < 1e-4


def test_a_gap_in_a_throw_is_filled_to_a_pixel():
    t = np.arange(24.0)
    throw = np.column_stack([6 * t, 0.5 * 1.8 * (t - 12) ** 2])
    seen = ~np.isin(t, [9, 10, 11, 12])
    held = np.where(seen[:, None], throw, throw[8])
    assert np.abs(settled(held, seen) - throw).max() < 1
    assert np.abs(held - throw).max() > 10


def test_a_landing_that_the_pictures_tell_is_not_flattened():
    t = np.arange(40.0)
    fall = np.column_stack([2 * t, np.minimum(9 * t, 180)])  # stops dead in frame 20
    rng = np.random.default_rng(5)
    found = settled(fall + rng.normal(0, 0.1, fall.shape), np.ones(40, bool))
    assert np.abs(found - fall)[17:24].max() < 0.3


def test_noise_is_evened_out_where_the_motion_is_even():
    t = np.arange(80.0)
    way = np.column_stack([20 * np.sin(t / 12), 0.3 * t])
    noisy = way + np.random.default_rng(2).normal(0, 0.5, way.shape)
    found = settled(noisy, np.ones(80, bool), precision=4.0)
    assert np.sqrt(np.mean((found - way) ** 2)) < 0.6 * np.sqrt(np.mean((noisy - way) ** 2))


def test_the_banded_solver_solves_what_a_dense_one_does():
    rng = np.random.default_rng(8)
    count, size = 9, 4
    roots = rng.normal(size=(count, size, size))
    information, right = roots @ np.swapaxes(roots, 1, 2), rng.normal(size=(count, size))
    rows, around = in_time._second(np.cumsum(rng.integers(1, 4, count)).astype(float))
    strength = around[:, None] * rng.uniform(0.5, 2, (count - 2, size))
    dense = np.zeros((count * size, count * size))
    for g in range(count):
        dense[g * size : (g + 1) * size, g * size : (g + 1) * size] += information[g]
    for g in range(count - 2):
        bend = np.zeros((size, count * size))
        for k in range(3):
            bend[:, (g + k) * size : (g + k + 1) * size] = rows[g, k] * np.eye(size)
        dense += bend.T @ np.diag(strength[g]) @ bend
    expected = np.linalg.solve(dense, right.ravel()).reshape(count, size)
    assert np.allclose(in_time._solved(information, right, rows, strength), expected, atol=1e-6)


def test_windows_do_not_show(monkeypatch: pytest.MonkeyPatch):
    t = np.arange(150.0)
    way = np.column_stack([30 * np.sin(t / 9), 0.01 * t**2]) + np.random.default_rng(1).normal(0, 0.2, (150, 2))
    seen = ~np.isin(t, [94, 95, 96, 97])
    in_windows = settled(way, seen, precision=25.0)
    monkeypatch.setattr(in_time, "WINDOW", 1000)
    assert np.abs(settled(way, seen, precision=25.0) - in_windows).max() < 1e-3


def test_stretches_reach_over_short_gaps_only():
    seen = np.array([0, 1, 1, 0, 0, 1, 0, 0, 0, 0, 1, 1, 0], bool)
    assert in_time.stretches(seen, np.arange(13.0), 4) == [slice(1, 6), slice(10, 12)]
    assert in_time.stretches(~seen & False, np.arange(13.0), 4) == []
    held = np.array([0, 40, 80.0])  # drawings held for long are no gap
    assert in_time.stretches(np.ones(3, bool), held, 12) == [slice(0, 3)]
