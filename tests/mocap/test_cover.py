"""Clips that come round cover another: as many cycles as it has, in its phase, one step not taken for two."""

import numpy as np
import pytest

from mocap.analogy import cover, cycles

FPS = 60.0


def steps(seconds, pace, phase=0.0):
    """Two legs and a nod twice a cycle."""
    beat = 2 * np.pi * pace * np.arange(round(seconds * FPS)) / FPS + phase
    return np.stack([np.sin(beat), np.sin(beat + np.pi) + 0.3 * np.sin(2 * beat), np.cos(2 * beat)], axis=-1)


@pytest.mark.parametrize(("pace", "phase"), [(1.4, 0.0), (0.7, 2.0), (1.9, 4.0)])
def test_cycles_of_other_paces_set_off_in_bs_phase_and_end_with_it(pace, phase):
    goal = steps(6.3, 1.0, 1.0)
    values = [steps(2.5, 1.1), steps(2.4, pace, phase), goal]
    covers, notes = cover.covering(values, np.ones(3), FPS, 3, 0.0, True)
    assert "repeated 6.3 times" in notes[0]
    for covering, own in zip(covers, (1.1, pace)):
        assert len(covering.values) == pytest.approx(6.3 * FPS / own, rel=0.02)
        even = np.linspace(0, len(covering.values) - 1, len(goal)).round().astype(int)
        assert np.abs(covering.values[even] - goal).mean() < 0.15


def test_what_covers_already_is_left_as_it_is():
    values = [steps(4, 1.0), steps(4, 1.0), steps(4, 1.0)]
    covers, notes = cover.covering(values, np.ones(3), FPS, 3, 0.5, True)
    assert notes == [] and all(np.array_equal(covering.values, values[0]) for covering in covers)
    assert covers[0].spare == 30


def test_a_cycles_exact_length_is_found_over_many():
    assert cycles.exactly(steps(12, 1.13), 53, FPS) == pytest.approx(FPS / 1.13, abs=0.05)
