"""A mended frame of a long clip tracked again from key to key, against the whole captured anew."""

from dataclasses import replace
from time import thread_time

import numpy as np

from capture.fit import again, video
from capture.pictures.clip import clip_of
from capture.pictures.shot import KeyDrawing
from fixtures import frog, write

THERE, ROUNDS = 48, 3  # frames of the frog, to and fro
MENDED = 2 * (THERE - 1) + 12  # the crouch, the second time


def rows():
    """Shares of a whole capture's frames and time, and how far the worst frame between the keys is off, in pixels."""
    toon = frog.frog()
    shown = ([*range(THERE), *range(THERE - 2, 0, -1)] * ROUNDS)[: ROUNDS * 2 * (THERE - 1)]
    pictures = [toon.frame(t) for t in range(THERE)]
    clip, truth = clip_of([pictures[t] for t in shown]), toon.parts[0].points[shown]
    shot = write.shot_of(toon)
    begins = [KeyDrawing(f"again{t}", t, tuple(map(tuple, truth[t].tolist()))) for t in (MENDED - 12, MENDED + 14)]
    keys = [*(key for key in shot.parts[0].keys if key.name != "crouch"), *begins]
    mended = KeyDrawing("mended", MENDED, tuple(map(tuple, truth[MENDED].tolist())))
    few, more = (replace(shot, parts=(replace(shot.parts[0], keys=tuple(some)),)) for some in (keys, [*keys, mended]))
    before, _ = _timed(video.capture, few, clip)
    after, spent = _timed(again.capture_again, more, before, clip)
    whole, all_spent = _timed(video.capture, more, clip)
    ((_, first, last),) = again.plan(more, before).ranges()
    off = [np.median(np.linalg.norm(motion.points("frog")[:, : truth.shape[1]] - truth, axis=-1), axis=1)
           for motion in (before, after, whole)]  # fmt: skip
    worst = dict(zip(("before_px", "again_px", "whole_px"), (one[first + 1 : last].max() for one in off)))
    return {"share_of_frames": (last - first) / len(clip), "share_of_time": spent / all_spent, **worst}


def _timed(work, *given):
    begun = thread_time()
    return work(*given), thread_time() - begun
