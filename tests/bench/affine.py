"""An affine part that jumps 10 to 40 pixels on twos, before bushes of its own colour: ours, OpenCV's best, chained LK.

The whole capture is measured against the drawn truth.  Fit by fit, from the true drawing before to the next, the
peer is findTransformECCMultiScale.  It is given our layer (grey, on its own mean colour), and a sweep over its levels,
blur, iterations and how much empty ground it sees round the part picks its most accurate useful setting and its most
robust one.  (Its mask only loses: 10 points of the drawings found with 3 or 4 levels, all of them with more.)
"""

from itertools import product
from time import thread_time

import cv2
import numpy as np
from _common import LOST, captured, cut, from_key, new_drawings, off

from capture.fit.pixels import model as models
from capture.fit.pixels import track_affine
from capture.motion import affine
from capture.pictures import matte
from fixtures import jumps, write

FOUND = 1.0  # pixels of median point error up to which a single fit counts as found
USEFUL = 0.8  # share of the drawings that a setting must find before its accuracy counts
LEVELS, BLURS, ROUNDS, MARGINS = (3, 4, 5, 6), (3, 5, 9), (15, 50), (64, 120)
STANDARD = (4, 5, 50, 64)  # OpenCV's own


def rows():
    """Whole capture, then single fits, then LK."""
    toon = jumps.rigid_frog()
    clip = write.clip_in_memory(toon)
    motion, seconds, learning = captured(toon, clip)
    error = off(motion, toon)
    fresh = new_drawings(toon)
    fps = len(clip) / seconds
    return {
        "median_px": np.median(error[fresh]),
        "p95_px": np.percentile(error[fresh], 95),
        "lost": np.count_nonzero(np.median(error[fresh], axis=1) > LOST),
        "fps": fps,
        "fps_ratio_to_100": fps / 100,
        "fps_once_learnt": len(clip) / (seconds - learning),
        "learning_s": learning,
        **_single_fits(toon, clip),
        **_chained_lk(toon, clip),
    }


def _single_fits(toon, clip):
    """Ours and the peer's settings on the same pictures and mattes, in milliseconds and pixels."""
    model, part = models.learn(write.shot_of(toon).parts[0], clip), toon.parts[0]
    truth, fresh = from_key(toon), new_drawings(toon)
    seen = {margin: {t: cut(model, clip, t, part.points[t - 1], margin) for t in fresh} for margin in MARGINS}
    peers = {margin: _Peer(model, cut(model, clip, 0, part.points[0], margin)) for margin in MARGINS}

    def ours(t):
        return track_affine.align(model.rigid, model.view.layer(*seen[MARGINS[0]][t]), truth[t - 1])

    def ecc(setting):
        margin = setting[-1]
        return lambda t: peers[margin].align(seen[margin][t], truth[t - 1], *setting[:-1])

    def off(fit):
        """Median point error of each drawing, and the median milliseconds of a fit."""
        placed, spent = [], []
        for t in fresh:
            start = thread_time()
            placed.append(fit(t))
            spent.append(1e3 * (thread_time() - start))
        distance = np.linalg.norm(affine.apply(np.stack(placed), part.points[0]) - part.points[fresh], axis=-1)
        return np.median(distance, axis=1), np.median(spent)

    found = {setting: off(ecc(setting)) for setting in product(LEVELS, BLURS, ROUNDS, MARGINS)}
    settings = _best_settings(found) | {"standard": STANDARD}
    spent = _times(fresh, {"ours": ours} | {name: ecc(setting) for name, setting in settings.items()})
    error, _ = off(ours)
    figures = {"fit_found": np.mean(error < FOUND), "fit_px": np.median(error), "fit_ms": spent["ours"]}
    for name, setting in settings.items():
        good = found[setting][0] < FOUND
        figures[f"ecc_{name}_ms"] = spent[name]
        figures[f"ecc_{name}_px"] = np.median(found[setting][0][good])
        figures[f"ecc_{name}_lost"] = np.count_nonzero(~good)
        print(f"affine.ecc_{name}: levels, blur, iterations, margin = {setting}")
    good = found[settings["accurate"]][0] < FOUND  # both on the drawings that the peer finds
    figures["error_ratio_to_ecc"] = np.median(error[good]) / figures["ecc_accurate_px"]
    figures["time_ratio_to_ecc"] = spent["ours"] / min(spent["accurate"], spent["robust"])
    return figures


def _best_settings(found):
    """The settings that are most accurate, among useful ones, and most robust; of those that tie, the quickest."""
    share = {setting: np.mean(error < FOUND) for setting, (error, _) in found.items()}
    pixels = {setting: np.median(error[error < FOUND]) for setting, (error, _) in found.items() if share[setting] > 0}

    def best(among):
        close = 1.03 * min(pixels[setting] for setting in among)
        return min((setting for setting in among if pixels[setting] <= close), key=lambda setting: found[setting][1])

    most = max(share.values())
    return {
        "accurate": best([setting for setting in pixels if share[setting] >= min(USEFUL, most)]),
        "robust": best([setting for setting in pixels if share[setting] == most]),
    }


def _times(fresh, fits):
    """Median milliseconds of each fit over the drawings, done in turn, the better of two rounds."""
    spent = {name: [] for name in fits}
    for t in fresh:
        for name, fit in fits.items():
            rounds = []
            for _ in range(2):
                start = thread_time()
                fit(t)
                rounds.append(1e3 * (thread_time() - start))
            spent[name].append(min(rounds))
    return {name: np.median(times) for name, times in spent.items()}


class _Peer:
    """findTransformECCMultiScale with the key prepared; making a frame's picture and matte grey is part of its time."""

    def __init__(self, model, key):
        self.weights = np.array([[0.299, 0.587, 0.114]], np.float32)  # of red, green and blue in grey
        self.ground = float(self.weights[0] @ model.view.ground)
        self.image, self.origin = self._grey(*key[:2]), key[2]

    def align(self, seen, start, levels, blur, rounds):
        """The map (2, 3) from the key, or `start` where OpenCV gives up for want of correlation."""
        picture, alpha, origin = seen
        into_key, out_of_seen = np.column_stack([np.eye(2), self.origin]), np.column_stack([np.eye(2), -origin])
        first = affine.compose(out_of_seen, affine.compose(start, into_key)).astype(np.float32)
        settings = cv2.ECCParameters()
        settings.nlevels, settings.gaussFiltSize = levels, blur
        settings.criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, rounds, 1e-6)
        try:
            _, warp = cv2.findTransformECCMultiScale(self.image, self._grey(picture, alpha), first, settings)
        except cv2.error:
            return start
        return affine.compose(affine.invert(out_of_seen), affine.compose(warp, affine.invert(into_key)))

    def _grey(self, picture, alpha):
        grey = cv2.transform(picture, self.weights)
        return np.rint(alpha * grey + (1 - alpha) * self.ground).astype(np.uint8)


def _chained_lk(toon, clip):
    """Corners in the part followed from drawing to drawing by pyramidal LK, an affine map by RANSAC, chained."""
    part = toon.parts[0]
    placed, before, error = affine.identity(), 0, []
    for t in new_drawings(toon):
        old, new = (cv2.cvtColor(clip[number], cv2.COLOR_RGB2GRAY) for number in (before, t))
        inside = matte.fill(clip.size, np.clip(affine.apply(placed, part.points[0]), -1e4, 1e4))
        corners = cv2.goodFeaturesToTrack(old, 200, 0.01, 5, mask=cv2.dilate(inside, np.ones((7, 7))))
        if corners is not None and len(corners) >= 3:
            moved, status, _ = cv2.calcOpticalFlowPyrLK(old, new, corners, None, winSize=(21, 21), maxLevel=4)
            good = status.ravel() == 1
            step = cv2.estimateAffine2D(corners[good], moved[good])[0] if good.sum() >= 3 else None
            placed = placed if step is None else affine.compose(step, placed)
        error.append(np.median(np.linalg.norm(affine.apply(placed, part.points[0]) - part.points[t], axis=-1)))
        before = t
    error = np.array(error)
    return {"lk_median_px": np.median(error), "lk_last_px": error[-1], "lk_lost": np.count_nonzero(error > LOST)}
