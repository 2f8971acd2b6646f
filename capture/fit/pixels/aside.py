"""What a picture shows otherwise than the keys do, a closed eye or an open mouth, is set aside and the fit repeated.

Such a place is no outlier to a fit: where the dark of an eye meets the dark of a lid, its pixels agree in part and
pull the whole part along.  So the place is taken out as a whole, with what lies round it.
"""

from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from capture.fit.pixels import descend, layer, trust
from capture.fit.pixels.layer import Layer
from capture.fit.pixels.model import PartModel
from capture.fit.pixels.sighting import Pose, outline
from capture.motion import affine

STRANGE = 40.0  # grey levels, beyond what noise and ink of another width make
ROUND = 8  # pixels round a strange one that go with it
ROUNDS = 6  # what is strange shows itself only as the rest comes right; two or three are usual
MOST = 0.4  # share of the part that may be set aside: more, and it is the pose that is wrong
STILL = 0.05  # pixels
AGREED = 0.95  # share of agreeing pixels from which on there is nothing to set aside


def refitted(model: PartModel, frame: Layer, pose: Pose) -> Pose:
    """The pose fitted again without what the picture shows otherwise; the same where that is nothing, or no better."""
    if pose.agreeing >= AGREED:
        return pose
    found = pose
    for _ in range(ROUNDS):
        strange, share = _strange(model, frame, found)
        if not 0 < share < MOST:
            break
        before, found = found, descend.polish(model, _without(frame, strange), found)
        if not np.isfinite(found.placed).all():
            return pose
        if np.abs(outline(model, found) - outline(model, before)).max() < STILL:
            break
    found = descend.judged(model, frame, found)
    return found if found.misfit < pose.misfit and found.agreeing > pose.agreeing - 0.03 else pose


def _strange(model: PartModel, frame: Layer, pose: Pose) -> tuple[NDArray, float]:
    """Where (h, w) of the half-size picture something else is shown, and the share of the part's pixels that is."""
    level = min(1, len(frame.levels) - 1)
    points, values = descend.appearance(model, level, pose.alpha)
    at = affine.apply(pose.placed, points)
    differs = trust.size_of(frame.sample(level, at) - values) > STRANGE
    known = frame.sample_known(level, at)
    if known is not None:
        differs &= known > 0.5
    mask = np.zeros(frame.levels[level].shape[:2], np.uint8)
    x, y = np.round((at[differs] - frame.origin) / 2**level).astype(int).T
    inside = (x >= 0) & (y >= 0) & (x < mask.shape[1]) & (y < mask.shape[0])
    mask[y[inside], x[inside]] = 1
    reach = max(ROUND // 2**level, 1)
    brush = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1, 2 * reach + 1))
    return cv2.dilate(mask, brush), float(differs.mean())


def _without(frame: Layer, strange: NDArray) -> Layer:
    """The picture with a mask (h, w), of its half or full size, unknown."""
    height, width = frame.levels[0].shape[:2]
    free = 1 - cv2.resize(strange, (width, height), interpolation=cv2.INTER_NEAREST).astype(np.float32)
    known = layer.halved(free, len(frame.levels))
    if frame.known is not None:
        known = tuple(here * before for here, before in zip(known, frame.known))
    return replace(frame, known=known)
