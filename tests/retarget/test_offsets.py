"""Demands are met exactly, and between them nothing calmer can be found."""

import numpy as np
import pytest

from retarget.stage import offsets

TIMES = np.cumsum([0, 1, 1, 2, 2, 1, 1, 1, 2, 2, 2, 1, 1, 1, 1, 2, 1, 1]) / 24


def unrest(offset, times=TIMES, half_life=0.2):
    """What is to be least, written out drawing by drawing."""
    tau = half_life / 1.4332787816903483
    step = np.diff(times)
    counts = np.ones(len(times))
    counts[12:14] = 1e-4  # a foot that came down while another stood
    total = counts * np.append(step, np.median(step)) @ offset**2
    for t in range(1, len(times) - 1):
        before, after = times[t] - times[t - 1], times[t + 1] - times[t]
        bend = (offset[t + 1] - offset[t]) / after - (offset[t] - offset[t - 1]) / before
        total += tau**4 * bend**2 / (0.5 * (before + after))
    return total


def demands():
    fixed = np.full(len(TIMES), np.nan)
    fixed[2:5] = [4.0, 6.0, 9.0]
    return fixed, [(np.array([9, 10, 11]), np.array([0.0, -2.0, -5.0])), (np.array([12, 13]), np.array([0.0, -1.0]))]


def test_demands_are_met_exactly():
    fixed, paths = demands()
    offset = offsets.calmest(TIMES, 0.2, fixed, paths, most=np.full(len(TIMES), 8.0))
    assert (offset[2:5] == fixed[2:5]).all()
    np.testing.assert_allclose(np.diff(offset[9:12]), [-2, -3], atol=1e-12)
    assert offset[13] - offset[12] == pytest.approx(-1)
    free = np.setdiff1d(np.arange(len(TIMES)), [2, 3, 4, 9, 10, 11, 12, 13])
    assert (offset[free] <= 8.0).all()


@pytest.mark.parametrize("most", [None, 3.0, -1.0])
def test_nothing_calmer_can_be_found(most):
    """The second opinion is a general solver on the sum as it is written."""
    from scipy.optimize import minimize

    fixed, paths = demands()
    bound = None if most is None else np.full(len(TIMES), most)
    ours = offsets.calmest(TIMES, 0.2, fixed, paths, most=bound)
    rules = [
        {"type": "eq", "fun": lambda o: o[2:5] - fixed[2:5]},
        {"type": "eq", "fun": lambda o: np.diff(o[9:12]) - [-2, -3]},
        {"type": "eq", "fun": lambda o: o[13] - o[12] + 1},
    ]
    free = np.setdiff1d(np.arange(len(TIMES)), [2, 3, 4])
    if most is not None:
        rules.append({"type": "ineq", "fun": lambda o: most - o[free]})
    theirs = minimize(unrest, np.zeros(len(TIMES)), constraints=rules, method="SLSQP", options={"maxiter": 500})
    assert unrest(ours) <= unrest(theirs.x) * (1 + 1e-6)
    if most is not None:
        assert ours[free].max() <= most + 1e-9


def test_half_of_it_is_forgotten_after_the_half_life():
    times = np.arange(400) / 100
    fixed = np.full(400, np.nan)
    fixed[200] = 10.0
    offset = offsets.calmest(times, 0.3, fixed)
    assert offset[230] == pytest.approx(5, abs=0.05)
    assert np.abs(offset[:20]).max() < 0.1


def test_without_demands_nothing_moves():
    assert not offsets.calmest(TIMES, 0.2, np.full(len(TIMES), np.nan)).any()
    assert not offsets.calmest(TIMES[:2], 0.2, np.full(2, np.nan)).any()
    assert offsets.calmest(TIMES[:2], 0.2, np.array([3.0, np.nan]), most=np.array([9.0, -1.0])) == pytest.approx(
        [3, -1]
    )
