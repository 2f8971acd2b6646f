"""Video capture of a whole shot: every part found in every frame (Bregler et al. 2002, section 3.3).

A part is followed from its first key's frame to the clip's end and then back to its start.  A frame's matte is
cut, held drawings are recognised and cost nothing, the others are fitted coarse to fine from the pose before.
When the fit comes out bad, other starts are tried: the matte's own place and size, and the keys.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.fit import contour, layer, track_affine, track_keys, track_shape
from capture.fit import model as models
from capture.fit.layer import Layer
from capture.fit.model import PartModel
from capture.motion import affine
from capture.motion.tracks import CartoonMotion, Track
from capture.pictures import matte
from capture.pictures.clip import Clip
from capture.pictures.decode import read_clip
from capture.pictures.matte import ColorModel
from capture.pictures.shot import Part, Shot
from capture.progress import progress

REACH = 64.0  # pixels a drawing may jump between frames, beyond its own size's share
OVERLAP = 0.3  # of matte and outline together; below this the part is not seen


@dataclass(frozen=True, eq=False)
class Pose:
    """Where a part is in one frame."""

    placed: NDArray  # (2, 3) plain map of the aligned shape
    alpha: NDArray  # (L,) mode weights, empty for one key
    misfit: float = 0.0  # pixels
    visible: bool = True
    held: bool = False


def capture(shot: Shot, clip: Clip | None = None) -> CartoonMotion:
    """Capture all parts of a shot; `clip` may be given where the frames are not in a file."""
    clip = open_clip(shot) if clip is None else clip
    followed = [follow(part, clip, shot.start) for part in shot.parts]
    motion = CartoonMotion(
        tracks=tuple(track for track, _ in followed),
        keysets=tuple(model.keyset for _, model in followed),
        times=np.array(clip.times, float),
        fps=float(clip.fps),
        size=clip.size,
    )
    return _relative_to_parents(motion)


def open_clip(shot: Shot) -> Clip:
    """The stretch of the clip that the shot is about."""
    return read_clip(shot.clip, start=shot.start, stop=shot.stop, tile=shot.tile, fps=shot.fps)


def follow(part: Part, clip: Clip, first: int = 0) -> tuple[Track, PartModel]:
    """One part through all frames of a clip: its track, about its pivot but not yet relative to a parent.

    The clip's frame 0 is number `first` of the shot's numbering.
    """
    model = models.learn(part, clip, first)
    first = models.key_frames(part, clip, first)[0]
    start = Pose(affine.identity(), _key_alpha(model, 0))
    forward = list(_run(model, clip, range(first, len(clip)), start))
    backward = list(_run(model, clip, range(first, -1, -1), start))[1:]
    return _as_track(model, backward[::-1] + forward), model


def _run(model: PartModel, clip: Clip, frames: range, pose: Pose) -> Iterable[Pose]:
    """Poses of the frames in the order given, the first of which is near `pose`."""
    colors, drawn, typical = model.colors, None, []
    for t in progress(frames, model.part.name, len(frames)):
        image = np.asarray(clip[t])[..., :3]
        window = layer.window(models.outline_at(model, pose.placed, pose.alpha), clip.size, _margin(model))
        if drawn is not None and is_held(drawn, image, window):
            pose = replace(pose, held=True)
            yield pose
            continue
        pose, alpha = find(model, colors, image, window, pose, _limit(typical))
        if pose.visible:
            drawn = image
            typical.append(pose.misfit)
            colors = matte.adapt(colors, image[window], alpha)
        yield pose


def is_held(before: NDArray, image: NDArray, window: tuple[slice, slice]) -> bool:
    """Whether a picture shows the same drawing as the one before, in the window: nothing but noise has changed."""
    change = cv2.absdiff(before[window], image[window]).max(axis=-1)
    change = cv2.GaussianBlur(change.astype(np.float32), (0, 0), 1.5)
    most, usual = np.percentile(change, [99.5, 50])
    return bool(most < 3.0 or most < min(4.0 * usual, 16.0))


def find(
    model: PartModel, colors: ColorModel, image: NDArray, window: tuple[slice, slice], last: Pose, limit: float
) -> tuple[Pose, NDArray]:
    """The pose in a picture from the pose before, and the window's matte; `limit` is a misfit that is suspicious."""
    origin = np.array([window[1].start, window[0].start])
    size = (image.shape[1], image.shape[0])
    near = matte.fill(size, models.outline_at(model, last.placed, last.alpha))[window]
    alpha = matte.cut(colors, image[window], near)
    if alpha.max() < 0.5:
        alpha = matte.cut(colors, image[window], _grown(near, 32))
    if alpha.max() < 0.5:
        return replace(last, visible=False, held=False), alpha
    frame = model.view.layer(image[window], alpha, origin)
    pose = _fit(model, frame, last.placed)
    if pose.misfit > limit or _overlap(model, pose, alpha, origin) < 0.8:
        starts = _other_starts(model, alpha, origin, last)
        pose = min([pose, *(_fit(model, frame, start) for start in starts)], key=lambda pose: pose.misfit)
    outline = models.outline_at(model, pose.placed, pose.alpha) - origin
    solid = _grown(matte.fill((alpha.shape[1], alpha.shape[0]), outline), 8)
    if (alpha * (1 - solid)).sum() > 0.02 * alpha.sum():  # something else of this colour touches the layer
        alpha = alpha * solid
        pose = _fit(model, model.view.layer(image[window], alpha, origin), pose.placed)
    if _overlap(model, pose, alpha, origin) < OVERLAP:
        return replace(last, visible=False, held=False), alpha
    return pose, alpha


def _fit(model: PartModel, frame: Layer, start: NDArray) -> Pose:
    """One descent from a start: affine for one key; eigen-images, then the bent template, for several."""
    shape = model.shape
    if shape is None:
        placed = track_affine.align(model.rigid, frame, start)
        return Pose(placed, np.zeros(0), track_affine.misfit(model.rigid, frame, placed))
    placed, alpha = track_keys.acquire(shape.eigen, frame, start)
    alpha = np.clip(alpha, *_alpha_range(model))
    for coarsest in (2, 1):  # the second time with the textures that the first time's shape calls for
        mixed = models.amounts(shape, alpha)
        placed, alpha = track_shape.refine(shape.bent, frame, placed, alpha, mixed, coarsest)
    return Pose(placed, alpha, track_shape.misfit(shape.bent, frame, placed, alpha, mixed))


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
    """Intersection over union of the posed outline and the matte."""
    outline = models.outline_at(model, pose.placed, pose.alpha) - origin
    size = np.linalg.det(pose.placed[:, :2])
    if not np.isfinite(outline).all() or np.abs(outline).max() > 1e4 or not 1 / 8 < size < 8:
        return 0.0  # mirrored, or out of all proportion
    solid = matte.fill((alpha.shape[1], alpha.shape[0]), outline) > 0
    seen = alpha > 0.5
    return float((solid & seen).sum() / max((solid | seen).sum(), 1))


def _as_track(model: PartModel, poses: list[Pose]) -> Track:
    """Tracked shapes as weights over rows, which any target can redraw: contour capture of the tracked mesh."""
    placed = np.stack([pose.placed for pose in poses])
    keyset, part = model.keyset, model.part
    weights = np.ones((len(poses), 1))
    if model.shape is not None:
        shapes = np.stack([models.mesh_shape(model, pose.alpha) for pose in poses])
        placed, weights = contour.capture_points(affine.apply(placed, shapes), keyset, placed)
    outline = keyset.points[0, keyset.outline]
    pivot = np.array(part.pivot, float) if part.pivot is not None else outline.mean(axis=0)
    return Track(
        part=part.name,
        parent=part.parent,
        pivot=pivot,
        keys=keyset.names,
        rows=keyset.rows,
        affine=affine.from_about(placed, pivot),
        weights=weights,
        residual=np.array([pose.misfit for pose in poses]),
        visible=np.array([pose.visible for pose in poses]),
        held=np.array([pose.held for pose in poses]),
        order=np.full(len(poses), part.order),
    )


def _relative_to_parents(motion: CartoonMotion) -> CartoonMotion:
    """Tracks measured in the picture, as maps relative to the part they hang on."""
    plain = {track.part: affine.about(track.affine, track.pivot) for track in motion.tracks}
    tracks = []
    for track in motion.tracks:
        local = plain[track.part]
        if track.parent:
            local = affine.compose(affine.invert(plain[track.parent]), local)
        tracks.append(replace(track, affine=affine.from_about(local, track.pivot)))
    return replace(motion, tracks=tuple(tracks))


def _margin(model: PartModel) -> float:
    return REACH + 0.25 * float(np.ptp(model.keyset.points[0], axis=0).max())


def _limit(misfits: list[float]) -> float:
    """A misfit that is out of the ordinary, after what has been seen so far."""
    return 2.5 * float(np.median(misfits)) + 0.2 if len(misfits) >= 3 else 0.8


def _grown(mask: NDArray, by: int) -> NDArray:
    """A mask made larger by so many pixels."""
    return cv2.dilate(mask, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * by + 1, 2 * by + 1)))


def _key_alpha(model: PartModel, key: int) -> NDArray:
    return np.zeros(0) if model.shape is None else model.shape.space.coefficients[key]


def _alpha_range(model: PartModel) -> tuple[NDArray, NDArray]:
    """Mode weights (L,) a little beyond what any row has: how far a rough guess may go."""
    low = model.shape.space.coefficients.min(axis=0)
    high = model.shape.space.coefficients.max(axis=0)
    return low - 0.25 * (high - low), high + 0.25 * (high - low)


def part_of(clip: Clip, **given: object) -> Part:
    """A one-key part for a clip without a shot file: from a box, a colour or an outline in its first frame."""
    if not any(value is not None for value in given.values()):
        raise InputError("a clip without a shot file needs --box or --color, to say what in it to capture")
    return Part(**{name: value for name, value in given.items() if value is not None})


