"""Clips that come round: one cycle cut out, and repeated (Wu et al. 2008, section 3.2).

A walk of three steps and one of nine are aligned cycle by cycle or not at all.
"""

import numpy as np
from numpy.typing import NDArray

ROUND = 0.5
"""A clip comes round where, a period later, it differs by less than this from itself, in units of its spread."""

ONCE = 0.35
"""A clip that is one cycle ends so near to where it began: there are no others to bear it out."""

LEAST = 0.4
"""Seconds: no cycle is shorter."""


LIKE = 0.8
"""The same for what may come round, if something else bears it out."""

LEAST = 0.4
"""Seconds: no cycle is shorter."""


LIKE = 0.8
"""The same, where something like it is known to come round as often."""


def period(values: NDArray, fps: float) -> int:
    """Frames of one cycle of curves (T, C), 0 where they do not come round at least once and a bit.

    The shortest at which the curves, shifted against themselves, agree nearly as well as anywhere.
    """
    dips, apart = _dips(values, fps)
    good = dips[apart < ROUND]
    if not len(good):
        return 0
    best = apart[apart < ROUND].min()
    return int(good[apart[apart < ROUND] <= max(np.sqrt(3) * best, ROUND / 4)][0])


def periods(values: NDArray, fps: float) -> NDArray:
    """All numbers of frames after which curves (T, C) may come round, the shortest first."""
    dips, apart = _dips(values, fps)
    return dips[apart < LIKE]


def exactly(values: NDArray, frames: int, fps: float) -> float:
    """A cycle's length in frames and parts of one: the whole way of as many cycles as there are, by their number."""
    dips, apart = _dips(values, fps)
    number = np.round(dips / frames)
    close = (number > 0) & (np.abs(dips / np.maximum(number, 1) - frames) < 1) & (apart < LIKE)
    return float(dips[close][-1] / number[close][-1]) if close.any() else float(frames)


def _dips(values: NDArray, fps: float) -> tuple[NDArray, NDArray]:
    """Shifts (n,) in frames at which curves (T, C) are nearest to themselves, and how near (n,), in their spread."""
    count, least = len(values), max(2, round(LEAST * fps))
    spread = values.std(axis=0)
    moving = spread > 0.05 * spread.max() if spread.max() > 0 else np.zeros(0, bool)
    shifts = np.arange(least, count - max(2, count // 12))
    if not moving.any() or len(shifts) < 3:
        return np.zeros(0, int), np.zeros(0)
    scaled = (values[:, moving] - values[:, moving].mean(axis=0)) / np.sqrt((spread[moving] ** 2).sum())
    apart = np.sqrt(_apart(scaled)[shifts])
    dips = 1 + np.flatnonzero((apart[1:-1] <= apart[:-2]) & (apart[1:-1] < apart[2:]))
    return shifts[dips], apart[dips]


def loop(values: NDArray, fps: float) -> int:
    """Frames of a clip (T, C) that is one cycle: where its end is like its start, and goes on like it; or 0."""
    least = max(2, round(LEAST * fps))
    if len(values) < least + 2:
        return 0
    spread = np.sqrt((values.std(axis=0) ** 2).sum()) or 1.0
    speed = np.gradient(values, axis=0)
    usual = np.sqrt((speed**2).sum(axis=1).mean()) or 1.0
    ends = np.arange(least, len(values))
    apart = np.linalg.norm(values[ends] - values[0], axis=1) / spread
    bent = np.linalg.norm(speed[ends] - speed[0], axis=1) / usual
    best = int(np.argmin(apart + bent / 2))
    # at the very ends of a short clip speeds are known from one side only: places then decide
    return int(ends[best]) if apart[best] < ONCE or (apart[best] < 2 * ONCE and bent[best] < 1) else 0


def cut(values: NDArray, frames: int) -> tuple[int, NDArray]:
    """One cycle (frames, C) out of curves (T, C), and the frame at which it begins.

    It is where its ends meet best; the rest of the gap is shared along it.
    """
    if len(values) <= frames:
        return len(values) - frames, values[-frames:]
    speed = np.gradient(values, axis=0)
    gaps = ((values[frames:] - values[:-frames]) ** 2).sum(axis=1) + ((speed[frames:] - speed[:-frames]) ** 2).sum(
        axis=1
    )
    start = int(np.argmin(gaps))
    gap = values[start + frames] - values[start]
    return start, values[start : start + frames] - np.linspace(0, 1, frames, endpoint=False)[:, None] * gap


def repeated(cycle: NDArray, frames: int) -> NDArray:
    """A cycle (P, C) again and again, `frames` long."""
    return cycle[np.arange(frames) % len(cycle)]


def _apart(values: NDArray) -> NDArray:
    """Half the mean square between curves (T, C) and themselves p frames later, for every p: (T,)."""
    count = len(values)
    spectrum = np.fft.rfft(values, 2 * count, axis=0)
    alike = np.fft.irfft((np.abs(spectrum) ** 2).sum(axis=1), 2 * count)[:count]
    energy = np.concatenate([[0], np.cumsum((values**2).sum(axis=1))])
    both = energy[count] - energy[:count] + energy[count:0:-1]  # of frames p to T and of frames 0 to T - p
    return np.maximum(both / 2 - alike, 0) / np.arange(count, 0, -1)
