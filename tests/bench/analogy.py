"""Motion analogies: the banded solution against the dense one, alignment, and how cost grows with channels and frames."""

from time import perf_counter

import numpy as np

from mocap.analogy import align, transfer

FRAMES = 600


def rows():
    """Milliseconds, the ratio to dense normal equations, and slopes of cost in a log-log plot (1 is linear)."""
    one, two = _wander(FRAMES, 1), _wander(FRAMES, 1, seed=1)
    banded = _best(lambda: transfer.model(one, two, 60.0))
    dense = _best(lambda: transfer.model_dense(one[:, 0], two[:, 0], 60.0), rounds=3)
    first, second = _wander(600, 60), _wander(500, 60, seed=2)
    align.align(first, second)  # compiled
    aligned = _best(lambda: align.align(first, second))
    by_frames = [_transfer_time(frames, 60) for frames in (1000, 4000)]
    by_channels = [_transfer_time(1000, channels) for channels in (60, 240)]
    by_length = [_align_time(frames) for frames in (4000, 16000)]  # near a coarse path from 2,000 frames on
    return {
        "banded_ratio_to_dense": dense / banded,
        "ms_banded_600_frames": 1e3 * banded,
        "ms_align_600_500_frames_60_channels": 1e3 * aligned,
        "slope_frames": _slope(by_frames),
        "slope_channels": _slope(by_channels),
        "slope_align_frames": _slope(by_length),
    }


def _wander(frames, channels, seed=0):
    return np.random.default_rng(seed).normal(size=(frames, channels)).cumsum(axis=0)


def _transfer_time(frames, channels):
    one, two = _wander(frames, channels), _wander(frames, channels, seed=1)
    return _best(lambda: transfer.model(one, two, 60.0), rounds=3)


def _align_time(frames):
    one, two = _wander(frames, 8), _wander(frames, 8, seed=3)
    return _best(lambda: align.align(one, two), rounds=2)


def _slope(times):
    return float(np.log2(times[1] / times[0]) / 2)  # four times as much


def _best(act, rounds=5):
    times = []
    for _ in range(rounds):
        start = perf_counter()
        act()
        times.append(perf_counter() - start)
    return min(times)
