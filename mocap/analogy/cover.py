"""What two motions are aligned by, and clips that come round repeated until they cover a third."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from mocap.analogy import cycles


@dataclass(frozen=True, eq=False)
class Cover:
    """A motion as it is aligned with B."""

    values: NDArray  # (n, C) its shared channels, one after the other as often as it comes round
    frames: NDArray  # (n,) the frames of the motion, at B's rate, that these are
    spare: int  # so many frames may be left out at the start and at the end


def covering(
    values: Sequence[NDArray], weight: NDArray, fps: float, slope: int, free: float, turn: bool
) -> tuple[list[Cover], list[str]]:
    """A and A' of `values` (A, A' and B) as they are where A covers B; else a cycle of each, as often as B has cycles.

    And what was done, if anything was.
    """
    plain = [Cover(curve, np.arange(len(curve)), round(free * fps)) for curve in values[:2]]
    if not turn:
        return plain, []
    told = [features(curve, weight) for curve in values]
    own = _periods(told, fps)
    fits = [len(curve) <= slope * len(values[2]) and len(values[2]) <= slope * len(curve) for curve in values[:2]]
    if all(fits) and not (own[0] and own[2] and abs(len(values[0]) / own[0] - len(values[2]) / own[2]) > 0.5):
        return plain, []
    own = [period or cycles.loop(curve, fps) for period, curve in zip(own, told)]
    if not own[0] or not own[1]:
        return plain, []  # the alignment says what does not fit
    times = len(values[2]) / (cycles.exactly(told[2], own[2], fps) if own[2] else own[0])
    turned = [_turned(values[k], own[k], times, values[2], weight) for k in (0, 1)]
    seconds = " and ".join(f"{period / fps:.2f} s" for period in own[:2])
    return turned, [f"A and A' come round every {seconds}; one cycle of each was repeated {times:.1f} times to cover B"]


def _periods(told: Sequence[NDArray], fps: float) -> list[int]:
    """Frames of a cycle of A, A' and B, 0 for what does not come round; of the latter the ones most like A's cycle."""
    first = cycles.period(told[0], fps)
    if not first:
        return [0, cycles.period(told[1], fps), cycles.period(told[2], fps)]
    goal = cycles.cut(told[0], first)[1]
    return [first, _alike(told[1], goal, fps) or cycles.period(told[1], fps), _alike(told[2], goal, fps)]


def _alike(told: NDArray, goal: NDArray, fps: float) -> int:
    """The period of features (T, C) whose cycle is the most like one (P, C), so that one step is not taken for two.

    0 if none is nearly as long.
    """
    may = cycles.periods(told, fps)
    may = may[(may > len(goal) / 3) & (may < 3 * len(goal))]
    if not len(may):
        return 0
    costs = []
    for period in may:
        cycle = cycles.cut(told, period)[1]
        again = cycles.repeated(cycle, len(cycle) + 1)
        steps = np.linspace(0, period, len(goal), endpoint=False)
        even = np.stack([np.interp(steps, np.arange(period + 1), column) for column in again.T], axis=-1)
        costs.append(min(((np.roll(even, k, axis=0) - goal) ** 2).sum() for k in range(len(goal))))
    return int(may[int(np.argmin(costs))])


def _turned(values: NDArray, period: int, times: float, goal: NDArray, weight: NDArray) -> Cover:
    """One cycle of curves (T, C), repeated so many `times`, setting off where it is most like `goal` (m, C)."""
    start, cycle = cycles.cut(values, period)
    count = max(2, round(times * period))
    even = np.linspace(0, count - 1, len(goal))
    costs = []
    told = features(goal, weight)
    for first in range(period):
        here = np.round(first + even).astype(int) % period
        costs.append(((features(cycle[here], weight) - told) ** 2).sum())
    frames = (int(np.argmin(costs)) + np.arange(count)) % period
    return Cover(cycle[frames], start + frames, 0)


def telling(shared: Sequence[tuple[str, str]], values: Sequence[NDArray], on: Sequence[str]) -> NDArray:
    """How much each shared channel (C,) says about which frame is which: 0 what is not asked or does not move.

    A joint near the root swings what hangs on it: a channel weighs by how much it moves in the stillest of the motions.
    """
    unknown = set(on) - {owner for owner, _ in shared}
    if unknown:
        raise InputError(
            f"the motions must share the joints that align them, they do not share {some(sorted(unknown))}: "
            f"they share {some([owner for owner, _ in shared])}"
        )
    moves = np.min([curve.std(axis=0) for curve in values], axis=0)
    asked = np.array([owner in on if on else kind.startswith("turn ") or kind == "height" for owner, kind in shared])
    if not (asked & (moves > 0)).any():
        asked = np.ones(len(shared), bool)
    weight = np.where(asked, moves, 0.0)
    return weight / weight.max() if weight.max() > 0 else asked.astype(float)


def features(values: NDArray, weight: NDArray) -> NDArray:
    """Channels (T, C) without their own mean and size, so that a strong and a weak step are the same step."""
    spread = values.std(axis=0)
    return (values - values.mean(axis=0)) / np.where(spread > 1e-9, spread, 1.0) * weight


def some(names: Sequence[str]) -> str:
    """A few names for a sentence."""
    names = list(dict.fromkeys(names))
    return ", ".join(names[:6]) + (f" and {len(names) - 6} more" if len(names) > 6 else "")
