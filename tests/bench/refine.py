"""The whole clip at once against the frame-by-frame capture it starts from: jitter, accuracy, gaps, cost.

The frog under sensor noise 5, before a plain and a busy background; jitter is the root mean square of the second
differences of (captured - drawn) from drawing to drawing.
"""

from time import thread_time

import numpy as np

from capture.fit import video
from capture.fit.refine import refine
from capture.pictures.clip import clip_of
from fixtures import frog, write

GAP = slice(30, 34)  # frames of the leap that are blanked


def rows():
    """Ratios of refined to captured, pixels, and milliseconds a frame on one core."""
    import torch

    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        return _rows()
    finally:
        torch.set_num_threads(threads)


def _rows():
    figures = {}
    for name, busy in (("clean", False), ("busy", True)):
        toon = frog.frog(busy=busy, noise=5.0)
        frames, shot, part = np.stack(list(toon.frames())), write.shot_of(toon), toon.parts[0]
        before = video.capture(shot, clip_of(frames))
        start = thread_time()
        after = refine(before, shot, clip_of(frames), "cpu")
        spent = 1e3 * (thread_time() - start)
        was, now = (_figures(motion, part) for motion in (before, after))
        figures |= {f"{name}_{key}_ratio": now[key] / was[key] for key in was}
        figures |= {f"{name}_{key}": now[key] for key in ("px", "p95", "worst_frame_px")}
        figures[f"{name}_worst_frame"] = np.argmax(np.median(_off(after, part), axis=1))
        figures[f"{name}_ms_a_frame"] = spent / len(frames)
        if not busy:
            half = clip_of(frames[:40])
            held = video.capture(shot, half)
            start = thread_time()
            refine(held, shot, half, "cpu")
            figures["slope_in_frames"] = np.log2(spent / (1e3 * (thread_time() - start)))  # 1 is linear, learning apart
            gone = frames.copy()
            gone[GAP] = toon.background
            holding = video.capture(shot, clip_of(gone))
            bridged = refine(holding, shot, clip_of(gone), "cpu")
            figures["gap_held_px"], figures["gap_px"] = (np.median(_off(m, part)[GAP]) for m in (holding, bridged))
            figures["gap_told"] = np.count_nonzero(~bridged.tracks[0].visible[GAP])
    return figures


def _off(motion, part):
    return np.linalg.norm(motion.points("frog")[:, : part.points.shape[1]] - part.points, axis=-1)


def _figures(motion, part):
    new = np.flatnonzero(np.diff(part.drawing, prepend=-1))
    error = (motion.points("frog")[:, : part.points.shape[1]] - part.points)[new]
    weights = (motion.tracks[0].key_weights() - part.weights)[new]
    off = np.linalg.norm(error, axis=-1)
    return {
        "jitter": _jitter(error),
        "weight_jitter": _jitter(weights),
        "px": np.median(off),
        "p95": np.percentile(off, 95),
        "worst_frame_px": np.median(off, axis=1).max(),
        "weight_error": np.median(np.abs(weights).max(axis=1)),
    }


def _jitter(values):
    return np.sqrt((np.diff(values, n=2, axis=0) ** 2).sum(axis=-1).mean())
