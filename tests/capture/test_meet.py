"""Two runs made one: the cheapest way through both, against all ways there are."""

from itertools import product

import numpy as np
import pytest

from capture.fit.meet import _runs, cheapest_way


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


def test_a_mask_falls_into_its_unbroken_stretches():
    assert _runs(np.array([1, 1, 0, 0, 1, 0, 1], bool)) == [(0, 2), (4, 5), (6, 7)]
    assert _runs(np.zeros(3, bool)) == []
