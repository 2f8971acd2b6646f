"""Whole captures of the synthetic cartoons: error against the drawn truth, frames lost, frames a second."""

from time import perf_counter

import numpy as np

from capture.fit import video
from fixtures import cartoons, write

CLEAN = ("ball", "hat", "frog")


def rows():
    """Pixels of outline error, frames more than 5 px off, and frames a second on one core."""
    figures = {}
    for name in CLEAN:
        for busy in (False, True):
            toon = cartoons.all_toons()[name](busy=busy, noise=2.0 if busy else 0.0)
            clip = write.clip_in_memory(toon)
            start = perf_counter()
            motion = video.capture(write.shot_of(toon), clip)
            spent = perf_counter() - start
            part = toon.parts[0]
            off = np.linalg.norm(motion.points(part.name)[:, : part.points.shape[1]] - part.points, axis=-1)
            row = f"{name}_{'busy' if busy else 'clean'}"
            figures[f"{row}_px"] = np.median(off)
            figures[f"{row}_lost"] = np.count_nonzero(np.median(off, axis=1) > 5)
            figures[f"{row}_fps"] = len(clip) / spent
    return figures
