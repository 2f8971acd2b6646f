"""What the capture benches share: one timed capture, its error against the drawn truth, and one fit from a start."""

from functools import lru_cache
from time import process_time

import numpy as np

from capture.fit import video
from capture.fit.pixels import descend, layer
from capture.fit.pixels import model as models
from capture.motion import affine
from capture.pictures import matte
from fixtures import jumps, variants, write

LOST = 3.0  # pixels of median point error in a frame from which on a drawing counts as lost


def captured(toon, clip=None):
    """A cartoon's captured motion, with the seconds of processor time it took, and how many of them for learning."""
    _warm(len(toon.parts[0].key_names) > 1)
    clip = write.clip_in_memory(toon) if clip is None else clip
    shot = write.shot_of(toon)
    start = process_time()
    for part in shot.parts:
        models.learn(part, clip)
    learning = process_time() - start
    start = process_time()
    motion = video.capture(shot, clip)
    return motion, process_time() - start, learning


@lru_cache
def _warm(bending):
    """Compile what is compiled at first use, on a small clip."""
    toon = jumps.bending_frog(count=24) if bending else jumps.rigid_frog(count=6)
    toon = variants.zoomed(toon, 0.5)
    video.capture(write.shot_of(toon), write.clip_in_memory(toon))


def off(motion, toon):
    """Distances (T, N) in pixels between the captured and the drawn outline of the first part."""
    part = toon.parts[0]
    return np.linalg.norm(motion.points(part.name)[:, : part.points.shape[1]] - part.points, axis=-1)


def new_drawings(toon):
    """The frames that show a drawing for the first time, but for the first frame."""
    return np.flatnonzero(np.diff(toon.parts[0].drawing)) + 1


def cut(model, clip, t, outline, margin=64):
    """The picture of frame t round an outline, its matte as we cut it, and where it starts."""
    window = layer.window(outline, clip.size, margin)
    picture = clip[t][window]
    alpha = matte.cut(model.colors, picture, matte.fill(clip.size, outline)[window])
    return picture, alpha, np.array([window[1].start, window[0].start])


def fitted(model, frame, start):
    """The outline (B, 2) that one descent from a map (2, 3) ends with."""
    pose = descend.fit(model, frame, start)
    return models.outline_at(model, pose.placed, pose.alpha)


def from_key(toon):
    """True plain maps (T, 2, 3) of the first part from its first key."""
    return affine.about(toon.parts[0].affine, toon.parts[0].pivot)
