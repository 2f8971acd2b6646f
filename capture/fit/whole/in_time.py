"""What time says of a clip's drawings: they go on as they went, unless the pictures tell of a change.

The pictures' terms (`descend.Look`) and a prior on acceleration make one banded system for the drawings of a stretch,
solved in windows that overlap.  How large accelerations are is learnt from the clip itself, for every unknown, and
they follow a Student distribution: a landing is rare and large, and is not flattened.
"""

import numpy as np
from numpy.typing import NDArray

from capture.fit.whole.descend import Look

FREEDOM = 3.0  # of the Student distribution
WINDOW, OVERLAP = 96, 24  # drawings
SLOWEST = 1e-3  # pixels a frame and frame: no motion is evener than that


def settle(look: Look, middle: NDArray, prior: NDArray, seen: NDArray, rounds: int = 8) -> NDArray:
    """Unknowns (G, M) of the drawings shown at `middle` (G,), in frames, by their pictures and their neighbours.

    `prior` (M,) is the precision of the unknowns about 0; the pictures of drawings not `seen` (G,) count for nothing.
    """
    information = np.where(seen[:, None, None], look.information, 0)
    right = np.einsum("gij,gj->gi", information, look.at) - np.where(seen[:, None], look.pull, 0)
    information = information + np.diag(prior)
    if len(middle) < 3:
        return np.where(seen[:, None], look.at, look.at[seen].mean(axis=0) if seen.any() else look.at)
    rows, around = _second(middle)
    usual = _usual(look, rows, around, seen, information)
    trust = np.ones((len(middle) - 2, len(prior)))
    for _ in range(rounds):
        found = _solved(information, right, rows, around[:, None] * trust / usual)
        bend = around[:, None] * _bends(rows, found) ** 2 / usual
        trust = (FREEDOM + 1) / (FREEDOM + bend)
    return found


def stretches(seen: NDArray, middle: NDArray, longest: float) -> list[slice]:
    """Runs of drawings (G,) that belong together: from one seen to one seen, with no gap over `longest` frames."""
    at = np.flatnonzero(seen)
    if not len(at):
        return []
    cuts = np.flatnonzero((np.diff(middle[at]) > longest) & (np.diff(at) > 1))
    starts, stops = np.append(at[0], at[cuts + 1]), np.append(at[cuts], at[-1])
    return [slice(int(a), int(b) + 1) for a, b in zip(starts, stops)]


def _second(middle: NDArray) -> tuple[NDArray, NDArray]:
    """Accelerations as sums over three drawings: factors (G - 2, 3), and the frames (G - 2,) each stands for."""
    before, after = np.diff(middle)[:-1], np.diff(middle)[1:]
    around = 0.5 * (before + after)
    return np.column_stack([1 / before, -1 / before - 1 / after, 1 / after]) / around[:, None], around


def _bends(rows: NDArray, values: NDArray) -> NDArray:
    """Accelerations (G - 2, M) of values (G, M), a frame and frame."""
    return sum(rows[:, k, None] * values[k : len(values) - 2 + k] for k in range(3))


def _usual(look: Look, rows: NDArray, around: NDArray, seen: NDArray, information: NDArray) -> NDArray:
    """The squared accelerations (M,) that are usual in this clip, less what the pictures' noise adds to them."""
    all_seen = seen[:-2] & seen[1:-1] & seen[2:]
    if not all_seen.any():
        return np.full(look.at.shape[1], 1.0)
    noise = np.zeros_like(look.at)
    noise[seen] = np.diagonal(np.linalg.inv(information[seen] + 1e-9 * np.eye(look.at.shape[1])), axis1=1, axis2=2)
    noise = sum(rows[:, k, None] ** 2 * noise[k : len(noise) - 2 + k] for k in range(3))
    square = around[:, None] * _bends(rows, look.at) ** 2
    median = np.median(square[all_seen], axis=0) / 0.455  # of a squared normal variate of variance 1
    added = np.median((around[:, None] * noise)[all_seen], axis=0)
    return np.maximum(np.maximum(median - added, 0.05 * median), SLOWEST**2)


def _solved(information: NDArray, right: NDArray, rows: NDArray, strength: NDArray) -> NDArray:
    """(information + D' strength D) u = right, a window of the drawings at a time."""
    count = len(right)
    found = np.empty_like(right)
    for begin in range(0, count, WINDOW):
        end = min(begin + WINDOW, count)
        low, high = max(begin - OVERLAP, 0), min(end + OVERLAP, count)
        inner = slice(low, high - 2)
        part = _window(information[low:high], right[low:high], rows[inner], strength[inner])
        found[begin:end] = part[begin - low : end - low]
    return found


def _window(information: NDArray, right: NDArray, rows: NDArray, strength: NDArray) -> NDArray:
    from scipy.linalg import solveh_banded

    count, size = right.shape
    bands = np.zeros((3 * size, count * size))  # upper form: bands[last + i - j, j] holds the matrix's (i, j)
    last = 3 * size - 1
    i, j = np.triu_indices(size)
    for g in range(count):
        bands[last + i - j, g * size + j] += information[g, i, j]
    diagonals = [np.zeros((count, size)) for _ in range(3)]
    for a in range(3):
        for b in range(a, 3):
            diagonals[b - a][b : count - 2 + b] += rows[:, a, None] * rows[:, b, None] * strength
    for offset, values in enumerate(diagonals):
        bands[last - offset * size] += values.ravel()
    bands[last] += 1e-9
    return solveh_banded(bands, right.ravel()).reshape(count, size)
