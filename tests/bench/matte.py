"""The matte against OpenCV's grabCut: the same window, and the same outline of the drawing before to start from.

grabCut is told what both are told, in its own words: deep inside the outline is the layer, far outside is not, and
between them it shall find out.  It is run with five rounds, its usual number, and with one.
"""

from time import thread_time

import cv2
import numpy as np

from capture.fit.pixels import layer
from capture.pictures import matte
from fixtures import ball, frog, hat

REACH = 12  # pixels: how far the outline of the drawing before is trusted, by both
EVERY = 6  # frames from one that is measured to the next


def rows():
    """Medians over drawings: overlap with the true coverage, least overlap, and milliseconds, ours and grabCut's."""
    figures, spent = {}, {"ours": [], "grabcut": [], "grabcut_once": []}
    alike = {"plain": [], "busy": []}
    second, theirs = [], []
    for make in (ball.ball, hat.hat, frog.frog):
        for ground in alike:
            toon = make(busy=ground == "busy", noise=2.0)
            for t, found in _drawings(toon, spent).items():
                truth = toon.matte(t, toon.parts[0].name)[found["window"]]
                alike[ground].append(_overlap(found["ours"], truth))
                second.append(_overlap(found["second"], truth))
                theirs.append(_overlap(found["grabcut"], truth))
    every = alike["plain"] + alike["busy"]
    figures |= {"iou": np.median(every), "iou_least": min(every), "iou_grabcut": np.median(theirs)}
    # once the part has been fitted its outline is known to a few pixels; here it is the true one
    figures |= {"iou_fitted": np.median(second), "iou_fitted_least": min(second)}
    figures |= {f"iou_{ground}": np.median(found) for ground, found in alike.items()}
    figures |= {f"{name}_ms": np.median(times) for name, times in spent.items()}
    figures["time_ratio_to_grabcut"] = figures["ours_ms"] / figures["grabcut_ms"]
    figures["time_ratio_to_grabcut_once"] = figures["ours_ms"] / figures["grabcut_once_ms"]
    return figures


def _drawings(toon, spent):
    """Frame to its window and mattes; the times are added to `spent`."""
    part, found = toon.parts[0], {}
    pictures = [toon.frame(int(frame)) for frame in part.key_frames]
    seeds = [matte.seed_outline(image, part.points[frame]) for image, frame in zip(pictures, part.key_frames)]
    model = matte.learn(seeds)
    for t in range(EVERY, len(toon), EVERY):
        before = part.points[t - 1]
        window = layer.window(before, toon.size, 64)
        image, near = toon.frame(t)[window], matte.fill(toon.size, before)[window]
        start = thread_time()
        ours = matte.cut(model, image, near)
        model = matte.adapt(model, image, ours)
        spent["ours"].append(1e3 * (thread_time() - start))
        fitted = matte.fill(toon.size, part.points[t])[window]
        second = matte.cut(model, image, fitted, slack=4.0)
        theirs = {}
        for name, rounds in (("grabcut", 5), ("grabcut_once", 1)):
            start = thread_time()
            theirs[name] = _grabcut(image, near, rounds)
            spent[name].append(1e3 * (thread_time() - start))
        found[t] = {"window": window, "ours": ours, "second": second, "grabcut": theirs["grabcut"]}
    return found


def _grabcut(image, near, rounds):
    marks = np.where(near > 0, cv2.GC_PR_FGD, cv2.GC_PR_BGD).astype(np.uint8)
    brush = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * REACH + 1, 2 * REACH + 1))
    marks[cv2.erode(near, brush) > 0] = cv2.GC_FGD
    models = np.zeros((1, 65)), np.zeros((1, 65))
    cv2.grabCut(np.ascontiguousarray(image), marks, None, *models, rounds, cv2.GC_INIT_WITH_MASK)
    return np.isin(marks, (cv2.GC_FGD, cv2.GC_PR_FGD)).astype(float)


def _overlap(found, truth):
    return float(((found > 0.5) & (truth > 0.5)).sum() / ((found > 0.5) | (truth > 0.5)).sum())
