"""Video capture of a whole shot: every part found in every frame (Bregler et al. 2002, section 3.3).

A part is followed from its first key's frame to the clip's end and then back to its start.  Held drawings are
recognised and cost nothing; in the others the part is looked for from the pose before.
"""

from collections.abc import Iterable
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from capture.fit import contour
from capture.fit.pixels import layer
from capture.fit.pixels import model as models
from capture.fit.pixels.find import Pose, find
from capture.fit.pixels.model import PartModel
from capture.motion import affine
from capture.motion.tracks import CartoonMotion, Track, relative_to_parents, track_of
from capture.pictures import matte
from capture.pictures.clip import Clip
from capture.pictures.decode import read_clip
from capture.pictures.shot import Part, Shot
from capture.progress import progress

REACH = 64.0  # pixels a drawing may jump between frames, beyond its own size's share


def capture(shot: Shot, clip: Clip | None = None) -> CartoonMotion:
    """Capture all parts of a shot; `clip` may be given where the frames are not in a file."""
    from threadpoolctl import threadpool_limits

    clip = open_clip(shot) if clip is None else clip
    with threadpool_limits(1):  # matrices here are small: BLAS threads would only wait for each other
        followed = [follow(part, clip, shot.start) for part in shot.parts]
    motion = CartoonMotion(
        tracks=tuple(track for track, _ in followed),
        keysets=tuple(model.keyset for _, model in followed),
        times=np.array(clip.times, float),
        fps=float(clip.fps),
        size=clip.size,
    )
    return relative_to_parents(motion)


def open_clip(shot: Shot) -> Clip:
    """The stretch of the clip that the shot is about."""
    return read_clip(shot.clip, start=shot.start, stop=shot.stop, tile=shot.tile, fps=shot.fps)


def follow(part: Part, clip: Clip, first: int = 0) -> tuple[Track, PartModel]:
    """One part through all frames of a clip: its track, about its pivot but not yet relative to a parent.

    The clip's frame 0 is number `first` of the shot's numbering.
    """
    model = models.learn(part, clip, first)
    key = models.key_frames(part, clip, first)[0]
    start = Pose(affine.identity(), _key_alpha(model, 0))
    forward = list(_run(model, clip, range(key, len(clip)), start))
    backward = list(_run(model, clip, range(key, -1, -1), start))
    poses = backward[:0:-1] + forward
    held = [False] + [pose.held for pose in backward[:0:-1]]  # backwards a frame is like the one after it
    poses[: key + 1] = [replace(pose, held=like) for pose, like in zip(poses[: key + 1], held)]
    return _as_track(model, poses), model


def _run(model: PartModel, clip: Clip, frames: range, pose: Pose) -> Iterable[Pose]:
    """Poses of the frames in the order given, the first of which is near `pose`."""
    colors, drawn, typical = model.colors, None, []
    for t in progress(frames, model.part.name, len(frames)):
        image = np.asarray(clip[t])[..., :3]
        window = layer.window(models.outline_at(model, pose.placed, pose.alpha), clip.size, _margin(model))
        if drawn is not None and is_held(drawn, image, window):
            pose = replace(pose, held=pose.visible, visible=True)  # one that was lost is back where it was
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


def _as_track(model: PartModel, poses: list[Pose]) -> Track:
    """Tracked shapes as weights over rows, which any target can redraw: contour capture of the tracked mesh."""
    placed = np.stack([pose.placed for pose in poses])
    keyset, part = model.keyset, model.part
    weights = np.ones((len(poses), 1))
    if model.shape is not None:
        shapes = np.stack([models.mesh_shape(model, pose.alpha) for pose in poses])
        placed, weights = contour.capture_points(affine.apply(placed, shapes), keyset, placed)
    return track_of(
        part.name,
        keyset,
        placed,
        weights,
        np.array([pose.misfit for pose in poses]),
        pivot=part.pivot,
        parent=part.parent,
        order=part.order,
        visible=np.array([pose.visible for pose in poses]),
        held=np.array([pose.held for pose in poses]),
    )


def _margin(model: PartModel) -> float:
    return REACH + 0.25 * float(np.ptp(model.keyset.points[0], axis=0).max())


def _limit(misfits: list[float]) -> float:
    """A misfit that is out of the ordinary, after what has been seen so far."""
    return 2.5 * float(np.median(misfits)) + 0.2 if len(misfits) >= 3 else 0.8


def _key_alpha(model: PartModel, key: int) -> NDArray:
    return np.zeros(0) if model.shape is None else model.shape.space.coefficients[key]
