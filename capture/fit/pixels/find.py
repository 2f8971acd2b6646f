"""All parts of a shot in one picture: mattes are cut, each part is fitted from the pose before, doubts are followed up.

A drawing that is held is recognised and costs nothing.  When the fit comes out bad, other starts are tried; when
something else of the layer's colour touches it, that is cut off and the fit repeated; when matte and outline hardly
meet, the part is not in the picture.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from capture.fit.pixels import layer, track_affine, track_keys, track_shape
from capture.fit.pixels import model as models
from capture.fit.pixels.layer import Layer
from capture.fit.pixels.model import PartModel
from capture.motion import affine
from capture.pictures import matte
from capture.pictures.matte import ColorModel

# overlaps are intersection over union of the posed outline and the matte
DOUBTFUL = 0.8  # overlap below which other starts are tried
NOT_SEEN = 0.3  # overlap below which the part is not in the picture
FAR = 32  # pixels round the last pose that are searched where nothing of its colour touches it
RIM = 8  # pixels round the posed outline that may still be the layer
REACH = 64.0  # pixels a drawing may jump between frames, beyond its own size's share
REMEMBERED = 100  # misfits that say what is ordinary
FOREIGN = 0.02  # share of the matte beyond that rim which calls for a second fit


@dataclass(frozen=True, eq=False)
class Pose:
    """Where a part is in one frame."""

    placed: NDArray  # (2, 3) plain map of the aligned shape
    alpha: NDArray  # (L,) mode weights, empty for one key
    misfit: float = 0.0  # pixels
    agreeing: float = 1.0  # share of the pixels that can be seen and agree
    visible: bool = True
    held: bool = False


@dataclass(frozen=True, eq=False)
class Sighting:
    """What is known of a part as its clip is gone through."""

    model: PartModel
    colors: ColorModel  # they follow the clip slowly
    pose: Pose  # the latest
    misfits: tuple[float, ...] = ()  # of the latest drawings, in pixels
    drawn: NDArray | None = None  # (H, W, 3) the picture the part was last found in


def find(image: NDArray, parts: tuple[Sighting, ...]) -> tuple[Sighting, ...]:
    """All parts in the next picture (H, W, 3), in their order."""
    return tuple(_next(image, part) for part in parts)


def is_held(before: NDArray, image: NDArray, window: tuple[slice, slice]) -> bool:
    """Whether a picture shows the same drawing as the one before, in the window: nothing but noise has changed."""
    change = cv2.absdiff(before[window], image[window]).max(axis=-1)
    change = cv2.GaussianBlur(change.astype(np.float32), (0, 0), 1.5)
    most, usual = np.percentile(change, [99.5, 50])
    return bool(most < 3.0 or most < min(4.0 * usual, 16.0))


def _next(image: NDArray, part: Sighting) -> Sighting:
    model, last = part.model, part.pose
    size = (image.shape[1], image.shape[0])
    window = layer.window(models.outline_at(model, last.placed, last.alpha), size, _margin(model))
    if part.drawn is not None and is_held(part.drawn, image, window):
        # one that was lost is back where it was
        return replace(part, pose=replace(last, held=last.visible, visible=True))
    pose, alpha = _found(model, part.colors, image, window, last, _limit(part.misfits))
    if not pose.visible:
        return replace(part, pose=pose)
    colors = matte.adapt(part.colors, image[window], alpha)
    return replace(part, pose=pose, colors=colors, misfits=(*part.misfits, pose.misfit)[-REMEMBERED:], drawn=image)


def _margin(model: PartModel) -> float:
    return REACH + 0.25 * float(np.ptp(model.keyset.points[0], axis=0).max())


def _limit(misfits: tuple[float, ...]) -> float:
    """A misfit that is out of the ordinary, after what has been seen so far."""
    return 2.5 * float(np.median(misfits)) + 0.2 if len(misfits) >= 3 else 0.8


def _found(
    model: PartModel, colors: ColorModel, image: NDArray, window: tuple[slice, slice], last: Pose, limit: float
) -> tuple[Pose, NDArray]:
    """The pose in a picture (H, W, 3), near `last`, and the matte of the window; a misfit above `limit` is suspicious.

    A part that is not seen keeps its last pose.
    """
    origin = np.array([window[1].start, window[0].start])
    near = _solid(model, last, np.array([0, 0]), image.shape)[window]
    alpha = matte.cut(colors, image[window], near)
    if alpha.max() < 0.5:
        alpha = matte.cut(colors, image[window], _grown(near, FAR))
    if alpha.max() < 0.5:
        return replace(last, visible=False, held=False), alpha
    pose = _fit(model, model.view.layer(image[window], alpha, origin), last.placed)
    if pose.misfit > limit or _overlap(model, pose, alpha, origin) < DOUBTFUL:
        pose = _best_of(model, image[window], alpha, origin, last, pose)
    pose, alpha = _without_foreign(model, image[window], alpha, origin, pose)
    if _overlap(model, pose, alpha, origin) < NOT_SEEN:
        return replace(last, visible=False, held=False), alpha
    return pose, alpha


def _best_of(model: PartModel, picture: NDArray, alpha: NDArray, origin: NDArray, last: Pose, pose: Pose) -> Pose:
    """The best of a doubtful pose and the fits from other starts."""
    frame = model.view.layer(picture, alpha, origin)
    fits = [_fit(model, frame, start) for start in _other_starts(model, alpha, origin, last)]
    return min([pose, *fits], key=lambda pose: pose.misfit)


def _without_foreign(
    model: PartModel, picture: NDArray, alpha: NDArray, origin: NDArray, pose: Pose
) -> tuple[Pose, NDArray]:
    """Pose and matte after cutting off what touches the layer and has its colour but lies beyond its outline."""
    kept = alpha * _grown(_solid(model, pose, origin, alpha.shape), RIM)
    if alpha.sum() - kept.sum() <= FOREIGN * alpha.sum():
        return pose, alpha
    return _fit(model, model.view.layer(picture, kept, origin), pose.placed), kept


def _fit(model: PartModel, frame: Layer, start: NDArray) -> Pose:
    """One descent from a start: affine for one key; eigen-images, then the bent template, for several."""
    shape = model.shape
    if shape is None:
        placed = track_affine.align(model.rigid, frame, start)
        judged = track_affine.judged(model.rigid, frame, placed)
        return Pose(placed, np.zeros(0), judged.misfit, judged.agreeing)
    placed, alpha = track_keys.acquire(shape.eigen, frame, start)
    alpha = np.clip(alpha, *_alpha_range(model))
    for coarsest, finest in ((2, 1), (0, 0)):  # at full size with the textures that the rough shape calls for
        mixed = models.amounts(shape, alpha)
        placed, alpha = track_shape.refine(shape.bent, frame, placed, alpha, mixed, coarsest, finest)
    judged = track_shape.judged(shape.bent, frame, placed, alpha, mixed)
    return Pose(placed, alpha, judged.misfit, judged.agreeing)


def _other_starts(model: PartModel, alpha: NDArray, origin: NDArray, last: Pose) -> list[NDArray]:
    """Maps (2, 3) to start from instead: onto the matte's middle, onto its size as well, and as the key was drawn."""
    shape = models.mesh_shape(model, last.alpha)[model.keyset.outline]
    outline = affine.apply(last.placed, shape)
    rows, columns = np.nonzero(alpha > 0.5)
    low = np.array([columns.min(), rows.min()]) + origin
    high = np.array([columns.max(), rows.max()]) + origin
    was = 0.5 * (outline.min(axis=0) + outline.max(axis=0))
    ratio = (high - low + 1) / np.maximum(np.ptp(outline, axis=0), 1)
    moved = np.column_stack([np.eye(2), 0.5 * (low + high) - was])
    scaled = affine.about(np.column_stack([np.diag(ratio), [0, 0]]), was)
    upright = np.column_stack([np.eye(2), 0.5 * (low + high) - 0.5 * (shape.min(axis=0) + shape.max(axis=0))])
    return [affine.compose(moved, start) for start in (last.placed, affine.compose(scaled, last.placed))] + [upright]


def _overlap(model: PartModel, pose: Pose, alpha: NDArray, origin: NDArray) -> float:
    """Intersection over union of the posed outline and the matte; 0 if mirrored or out of all proportion."""
    if not 1 / 8 < np.linalg.det(pose.placed[:, :2]) < 8 or np.abs(pose.placed).max() > 1e4:
        return 0.0
    solid, seen = _solid(model, pose, origin, alpha.shape) > 0, alpha > 0.5
    return float((solid & seen).sum() / max((solid | seen).sum(), 1))


def _solid(model: PartModel, pose: Pose, origin: NDArray, shape: tuple[int, ...]) -> NDArray:
    """The mask (H, W) of the posed outline in a picture of that shape whose first pixel is at `origin`."""
    outline = models.outline_at(model, pose.placed, pose.alpha) - origin
    return matte.fill((shape[1], shape[0]), np.clip(outline, -1e4, 1e4))


def _grown(mask: NDArray, by: int) -> NDArray:
    """A mask made larger by so many pixels."""
    return cv2.dilate(mask, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * by + 1, 2 * by + 1)))


def _alpha_range(model: PartModel) -> tuple[NDArray, NDArray]:
    """Mode weights (L,) a little beyond what any row has: how far a rough guess may go."""
    low = model.shape.space.coefficients.min(axis=0)
    high = model.shape.space.coefficients.max(axis=0)
    return low - 0.25 * (high - low), high + 0.25 * (high - low)
