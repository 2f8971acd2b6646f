"""Two runs made one: the cheapest way through both, against all ways there are."""

from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest

from capture.fit import poses as tables
from capture.fit.meet import _runs, cheapest_way, joined
from capture.fit.pixels.find import Pose
from capture.fit.poses import Poses


def price(taken: np.ndarray, costs: np.ndarray, change: np.ndarray) -> float:
    way = np.concatenate([[False], taken, [True]])
    return float(costs[np.arange(len(costs)), taken.astype(int)].sum() + change[way[1:] != way[:-1]].sum())


@pytest.mark.parametrize("seed", range(20))
def test_no_other_way_is_cheaper(seed: int):
    rng = np.random.default_rng(seed)
    costs, change = rng.exponential(1.0, (8, 2)), rng.exponential(2.0, 9)
    best = min(price(np.array(taken), costs, change) for taken in product([False, True], repeat=8))
    assert price(cheapest_way(costs, change), costs, change) == pytest.approx(best)


def test_runs_that_fit_alike_change_where_they_are_nearest():
    change = np.array([9.0, 7, 5, 3, 1, 4, 6])
    assert cheapest_way(np.ones((6, 2)), change).tolist() == [False] * 4 + [True] * 2


SQUARE = SimpleNamespace(points=np.array([[[0.0, 0], [9, 0], [9, 9], [0, 9]]]), outline=np.arange(4))
PART = SimpleNamespace(shape=None, keyset=SQUARE)


def run(xs: list[float], seen: list[int] | None = None, misfit: float = 0.1, held: tuple[int, ...] = ()) -> Poses:
    """A square at the places `xs` (T,), NaN where the run has not been, and `seen` in those frames."""
    poses = tables.empty(len(xs), Pose(np.eye(2, 3), np.zeros(0)))
    for t, x in enumerate(xs):
        if np.isfinite(x):
            placed = np.array([[1.0, 0, x], [0, 1, 0]])
            visible = seen is None or bool(seen[t])
            tables.put(poses, t, Pose(placed, np.zeros(0), misfit, visible=visible, held=t in held))
    return poses


NAN = float("nan")


def test_a_run_that_drifts_away_from_the_next_key_is_left_where_it_begins_to():
    forward = run([0, 0, 0, 5, 10, 15, 20, 25, 0])
    backward = run([NAN, 0, 0, 0, 0, 0, 0, 0, NAN])
    assert joined(PART, forward, backward).columns["placed"][:, 0, 2].tolist() == [0] * 9


def test_of_two_runs_far_apart_the_one_that_fits_better_is_taken_whole():
    forward, backward = run([0, 30, 30, 30, 30, 30, 30, 0], misfit=4.0), run([NAN, 0, 0, 0, 0, 0, 0, NAN], misfit=0.1)
    assert joined(PART, forward, backward).columns["placed"][:, 0, 2].tolist() == [0] * 8


def test_what_neither_saw_holds_the_pose_before_even_if_that_was_found_backwards():
    forward = run([0, 0, 50, 50, 50, 50, 9], [1, 0, 0, 0, 0, 0, 1])
    backward = run([NAN, 2, 4, 9, 9, 9, NAN], [0, 1, 1, 0, 0, 1, 0])
    poses = joined(PART, forward, backward)
    assert poses.columns["visible"].tolist() == [True, True, True, False, False, True, True]
    assert poses.columns["placed"][:, 0, 2].tolist() == [0, 2, 4, 4, 4, 9, 9]


def test_a_drawing_that_is_held_in_either_run_is_held_and_is_not_cut_in_two():
    forward = run([0, 1, 1, 1, 1, 1, 0], held=(2, 4))
    backward = run([NAN, 0, 0, 0, 0, 0, NAN], misfit=0.1, held=(1, 3, 5))
    poses = joined(PART, forward, backward)
    x = poses.columns["placed"][:, 0, 2]
    held = poses.columns["held"]
    assert (x[1:][held[1:]] == x[:-1][held[1:]]).all()
    assert held.any()


def test_a_mask_falls_into_its_unbroken_stretches():
    assert _runs(np.array([1, 1, 0, 0, 1, 0, 1], bool)) == [(0, 2), (4, 5), (6, 7)]
    assert _runs(np.zeros(3, bool)) == []
