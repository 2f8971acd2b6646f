"""One run made of two: a part followed forwards and, where that fell short, backwards, joined where they are nearest.

Each frame takes the run that fits better, but every change from one to the other is a jump and costs as much as the
two are apart there: the cheapest way through the stretch, found exactly (Viterbi).
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from capture.fit import poses as tables
from capture.fit.pixels.model import PartModel
from capture.fit.poses import Poses

LOST = 10.0  # pixels of misfit that a frame without a pose is as bad as
DISAGREEING = 4.0  # pixels of misfit that a wholly disagreeing picture is as bad as
WITHIN_HELD = 2.0  # pixels: a change in the middle of a held drawing, which would move it


def joined(model: PartModel, forward: Poses, backward: Poses) -> Poses:
    """All frames' poses: forwards where nothing else is known, backwards where only that is, the better where both are.

    A frame of which neither knows the place, between two keys, holds the pose before, or goes on as the run forward has
    it.
    """
    back = backward.known & ~forward.known
    both = forward.known & backward.known
    for low, high in _runs(both):
        back[low:high] = _better(model, forward, backward, low, high)
    columns = {
        name: np.where(back.reshape(-1, *[1] * (column.ndim - 1)), backward.columns[name], column)
        for name, column in forward.columns.items()
    }
    columns["held"] = _held(forward, backward, back)
    after = back.copy()  # where it is lost, the run backwards holds the pose after: not what is to be held
    for t in np.flatnonzero(both & ~columns["visible"]):
        after[t] |= after[t - 1]
        for name in ("placed", "alpha"):
            columns[name][t] = columns[name][t - 1] if after[t] else columns[name][t]
    return replace(forward, columns=columns, known=forward.known | backward.known)


def cheapest_way(costs: NDArray, change: NDArray) -> NDArray:
    """Which of two runs to take in each frame (T,), True for the second, from the first run to the second.

    `costs` (T, 2) are those of each frame in each run, `change` (T + 1,) of changing between the runs before each
    frame and after the last.
    """
    best = np.array([0.0, np.inf])
    came = np.zeros((len(costs) + 1, 2), int)  # the run of the frame before
    for t in range(len(costs) + 1):
        ways = best + change[t] * (1 - np.eye(2))  # [to, from]
        came[t] = ways.argmin(axis=1)
        best = ways.min(axis=1) + (costs[t] if t < len(costs) else 0)
    taken, run = np.zeros(len(costs), bool), 1
    for t in range(len(costs), 0, -1):
        run = came[t, run]
        taken[t - 1] = run
    return taken


def _better(model: PartModel, forward: Poses, backward: Poses, low: int, high: int) -> NDArray:
    """Whether to take the run backwards in frames low ... high - 1, which lie between a start of each run."""
    frames = range(low, high)
    seen = [run.columns["visible"][low:high] for run in (forward, backward)]
    apart = np.array([tables.apart(model, *(tables.at(run, t) for run in (forward, backward))) for t in frames])
    apart[~(seen[0] & seen[1])] = 0  # what is not seen cannot jump
    around = apart[[0, *range(high - low), -1]]  # each run is of one piece with the key that it comes from
    change = np.minimum(around[:-1], around[1:])
    change[:-1] += WITHIN_HELD * forward.columns["held"][low:high]
    change[1:] += WITHIN_HELD * backward.columns["held"][low:high]
    costs = np.column_stack([_cost(run, low, high) for run in (forward, backward)])
    return cheapest_way(costs, change)


def _cost(run: Poses, low: int, high: int) -> NDArray:
    """How bad a run's poses are (T,), in pixels."""
    misfit, agreeing, seen = (run.columns[name][low:high] for name in ("misfit", "agreeing", "visible"))
    return np.where(seen, misfit + DISAGREEING * (1 - agreeing), LOST)


def _held(forward: Poses, backward: Poses, back: NDArray) -> NDArray:
    """Whether each frame (T,) shows the drawing of the frame before; backwards a frame is like the one after it."""
    held = forward.columns["held"] & ~back
    held[1:] &= ~back[:-1]
    held[1:] |= back[:-1] & backward.columns["held"][:-1]
    return held


def _runs(mask: NDArray) -> list[tuple[int, int]]:
    """Where a mask (T,) is set without a break: from, and to (exclusive)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(int)))
    return [(int(low), int(high)) for low, high in zip(edges[::2], edges[1::2])]
