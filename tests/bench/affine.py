"""Affine alignment of one drawing: from the true pose before to the next drawing, ours and OpenCV's best.

The peer, findTransformECCMultiScale, is given our layer (grey, on its own mean colour) and the better of the
settings that did best on such clips: it is not held back by what it was not made for.
"""

from time import thread_time

import cv2
import numpy as np

from capture.fit.pixels import layer, track_affine
from capture.fit.pixels import model as models
from capture.motion import affine
from capture.pictures import matte
from fixtures import ball, write

FOUND = 1.0  # pixels of median point error up to which a drawing counts as found


def rows():
    """Medians over the clip: milliseconds (pyramid and fit), pixels, and the share of drawings found."""
    toon = ball.ball(busy=True, noise=2.0)
    clip, part = write.clip_in_memory(toon), toon.parts[0]
    model = models.learn(write.shot_of(toon).parts[0], clip)
    truth = affine.about(part.affine, part.pivot)
    key = _cut(model, clip, 0, part.points[0])
    found = {"ours": [], "ecc": []}
    for t in range(1, len(clip)):
        seen = _cut(model, clip, t, part.points[t - 1])
        for name, fit in (("ours", _ours), ("ecc", _ecc)):
            start = thread_time()
            placed = fit(model, key, seen, truth[t - 1])
            spent = 1e3 * (thread_time() - start)
            off = np.linalg.norm(affine.apply(placed, part.points[0]) - part.points[t], axis=-1)
            found[name].append((spent, float(np.median(off))))
    figures = {}
    for name, pairs in found.items():
        spent, off = np.array(pairs).T
        good = off < FOUND
        figures |= {f"{name}_ms": np.median(spent), f"{name}_found": good.mean(), f"{name}_px": np.median(off[good])}
    figures["time_ours_to_ecc"] = figures["ours_ms"] / figures["ecc_ms"]
    figures["error_ours_to_ecc"] = figures["ours_px"] / figures["ecc_px"]
    return figures


def _cut(model, clip, t, outline):
    """The picture round an outline, its matte, and where it starts."""
    window = layer.window(outline, clip.size, 64)
    near = matte.fill(clip.size, outline)[window]
    picture = clip[t][window]
    return picture, matte.cut(model.colors, picture, near), np.array([window[1].start, window[0].start])


def _ours(model, key, seen, start):
    return track_affine.align(model.rigid, model.view.layer(*seen), start)


def _ecc(model, key, seen, start):
    grey = [cv2.cvtColor(_over_mean(model, *pair[:2]), cv2.COLOR_RGB2GRAY) for pair in (key, seen)]
    into_key = np.column_stack([np.eye(2), key[2]])
    out_of_seen = np.column_stack([np.eye(2), -seen[2]])
    first = affine.compose(out_of_seen, affine.compose(start, into_key))
    settings = cv2.ECCParameters()
    settings.nlevels, settings.gaussFiltSize = 5, 5
    try:
        _, warp = cv2.findTransformECCMultiScale(grey[0], grey[1], first.astype(np.float32), settings)
    except cv2.error:  # it gives up where the correlation is low
        warp = first
    return affine.compose(affine.invert(out_of_seen), affine.compose(warp, affine.invert(into_key)))


def _over_mean(model, picture, alpha):
    return layer.composite(picture, alpha, model.view.ground)[..., :3].astype(np.uint8)
