"""One descent of a part from a start, coarse to fine, and how much of the part a picture then shows."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from capture.fit.pixels import model as models
from capture.fit.pixels import outside, track_affine, track_keys, track_shape
from capture.fit.pixels.layer import ALPHA_GAIN, Layer
from capture.fit.pixels.model import PartModel
from capture.fit.pixels.sighting import Pose
from capture.motion import affine

CLEARLY = 60.0  # grey levels; where a pixel differs this much it speaks against the part, and more is no worse

BLUNTER = 1.3  # times the misfit: what lies nearest to the drawing's outline never fits its inside quite as well


class Evidence(NamedTuple):
    """How much of a part a picture shows, measured by what tells the part from nothing at all."""

    shown: float  # share of what can be seen of the part that is there; 0 for an empty picture, or below
    known: float  # share of the part that can be seen, 0 to 1


def fit(model: PartModel, frame: Layer, start: NDArray) -> Pose:
    """From a map (2, 3): affine for one key; eigen-images, then the bent template, for several."""
    if model.shape is None:
        return judged(model, frame, Pose(track_affine.align(model.rigid, frame, start), np.zeros(0)))
    placed, alpha = track_keys.acquire(model.shape.eigen, frame, start)
    alpha = np.clip(alpha, *_alpha_range(model))
    return polish(model, frame, Pose(placed, alpha))


def rough(model: PartModel, frame: Layer, start: NDArray, finest: int = 2) -> Pose:
    """The same on small pictures only, which is quick and right to a pixel or two."""
    if model.shape is None:
        finest = min(finest, len(model.rigid.levels) - 1)
        return Pose(track_affine.align(model.rigid, frame, start, finest=finest), np.zeros(0))
    placed, alpha = track_keys.acquire(model.shape.eigen, frame, start, finest)
    return Pose(placed, np.clip(alpha, *_alpha_range(model)))


def polish(model: PartModel, frame: Layer, pose: Pose) -> Pose:
    """From a pose that is nearly right: the fine levels alone."""
    shape = model.shape
    if shape is None:
        placed = track_affine.align(model.rigid, frame, pose.placed, coarsest=2)
        return judged(model, frame, Pose(placed, pose.alpha))
    placed, alpha = pose.placed, pose.alpha
    for coarsest, finest in ((2, 1), (0, 0)):  # at full size with the textures that the rough shape calls for
        mixed = models.amounts(shape, alpha)
        placed, alpha = track_shape.refine(shape.bent, frame, placed, alpha, mixed, coarsest, finest)
    return judged(model, frame, Pose(placed, alpha))


def finish(model: PartModel, frame: Layer, pose: Pose) -> Pose:
    """A fit that was chosen, once more by way of the drawing itself where that lies outside what the keys can say."""
    shape = model.shape
    if shape is None:
        return pose
    mixed = models.amounts(shape, pose.alpha)
    placed, alpha = outside.by_way_of_the_drawing(shape.loose, frame, pose.placed, pose.alpha, mixed, pose.misfit)
    if placed is pose.placed:
        return pose
    found = judged(model, frame, replace(pose, placed=placed, alpha=alpha))
    return found if found.misfit < BLUNTER * pose.misfit else pose


def judged(model: PartModel, frame: Layer, pose: Pose) -> Pose:
    """The pose with what it is worth at full size."""
    if not np.isfinite(pose.placed).all():
        return Pose(affine.identity() * np.nan, pose.alpha, np.inf, 0.0)
    if model.shape is None:
        judgement = track_affine.judged(model.rigid, frame, pose.placed)
    else:
        mixed = models.amounts(model.shape, pose.alpha)
        judgement = track_shape.judged(model.shape.bent, frame, pose.placed, pose.alpha, mixed)
    return replace(pose, misfit=judgement.misfit, agreeing=judgement.agreeing)


def evidence(model: PartModel, frame: Layer, pose: Pose, level: int = 1) -> Evidence:
    """How much of the posed part a picture shows.

    Differences are cut off at `CLEARLY`, so that a stranger in front costs what it covers and no more.  A pixel
    counts by how far it would differ were there nothing: flat surroundings of a part prove nothing.  What the key did
    not show of the part proves nothing either, but where it would be in sight and is not, it speaks against the pose.
    """
    points, values = appearance(model, level, pose.alpha)
    level = min(level, len(model.rigid.levels) - 1)
    at = affine.apply(pose.placed, points)
    known = frame.sample_known(level, at)
    agrees = likeness(frame.sample(level, at) - values)
    telling = 1 - likeness(frame.ground - values)
    weight = np.ones(len(at)) if known is None else known
    share = float((weight * telling).sum() / max(telling.sum(), 1e-9))
    if share < 1e-3:
        return Evidence(0.0, 0.0)
    shown = float((weight * (agrees - 1 + telling)).sum() / (weight * telling).sum())
    return Evidence(shown * (1 - bare(model, frame, pose)), share)


def bare(model: PartModel, frame: Layer, pose: Pose) -> float:
    """The share of what should be in sight of a posed part that was hidden in its key and is missing here."""
    if model.shape is not None or not model.guessed.any():
        return 0.0
    at = affine.apply(pose.placed, model.inner)
    level = min(1, len(frame.levels) - 1)  # at full size alpha may not be told
    known = frame.sample_known(level, at)
    weight = np.ones(len(at)) if known is None else known
    missing = frame.sample(level, at)[:, 3] < 0.5 * ALPHA_GAIN
    return float((weight * (missing & model.guessed)).sum() / max(weight.sum(), 1e-9))


def worth(pose: Pose, seen: Evidence) -> float:
    """0 to 1: how far a fit can be believed, by all of the part's pixels and by those that tell."""
    return max(seen.shown, 0.0) * pose.agreeing


def appearance(model: PartModel, level: int, alpha: NDArray) -> tuple[NDArray, NDArray]:
    """What the part looks like at a level: pixels (P, 2) in its own frame and their values (P, 4)."""
    level = min(level, len(model.rigid.levels) - 1)
    if model.shape is None:
        return model.rigid.levels[level].points, model.rigid.levels[level].values
    at, mixed = model.shape.bent.levels[level], models.amounts(model.shape, alpha)
    return at.points + at.modes @ alpha, np.tensordot(mixed.astype(np.float32), at.textures, axes=1)


def likeness(difference: NDArray) -> NDArray:
    """1 for pixels (..., C) that do not differ, 0 for those that clearly do."""
    return 1 - np.minimum((difference**2).mean(axis=-1) / CLEARLY**2, 1)


def _alpha_range(model: PartModel) -> tuple[NDArray, NDArray]:
    """Mode weights (L,) a little beyond what any row has: how far a rough guess may go."""
    low = model.shape.space.coefficients.min(axis=0)
    high = model.shape.space.coefficients.max(axis=0)
    return low - 0.25 * (high - low), high + 0.25 * (high - low)
