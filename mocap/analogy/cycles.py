"""Clips that come round: one cycle cut out, and repeated (Wu et al. 2008, section 3.2).

A walk of three steps and one of nine are aligned cycle by cycle or not at all.
"""

import numpy as np
from numpy.typing import NDArray

ROUND = 0.35
"""A clip comes round where, a period later, it differs by less than this from itself, in units of its spread."""

LEAST = 0.4
"""Seconds: no cycle is shorter."""


def period(values: NDArray, fps: float) -> int:
    """Frames of one cycle of curves (T, C), 0 where they do not come round at least once and a bit.

    The shortest at which the curves, shifted against themselves, agree nearly as well as anywhere.
    """
    count, least = len(values), max(2, round(LEAST * fps))
    spread = values.std(axis=0)
    moving = spread > 0.05 * spread.max() if spread.max() > 0 else np.zeros(0, bool)
    if count < least + 3 or not moving.any():
        return 0
    scaled = (values[:, moving] - values[:, moving].mean(axis=0)) / np.sqrt((spread[moving] ** 2).sum())
    most = count - max(2, count // 12)
    shifts = np.arange(least, most)
    if not len(shifts):
        return 0
    apart = _apart(scaled)[least:most]
    dips = 1 + np.flatnonzero((apart[1:-1] <= apart[:-2]) & (apart[1:-1] < apart[2:]))
    good = [dip for dip in dips if apart[dip] < ROUND**2]
    if not good:
        return 0
    best = min(apart[dip] for dip in good)
    return int(shifts[next(dip for dip in good if apart[dip] <= max(3 * best, (ROUND / 4) ** 2))])


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
    return int(ends[best]) if apart[best] < ROUND or (apart[best] < 2 * ROUND and bent[best] < 1) else 0


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
