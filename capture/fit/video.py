"""Video capture of a whole shot: every part found in every frame (Bregler et al. 2002, section 3.3).

Parts are learnt from their key frames; the clip is gone through forwards, from key to key, and backwards where that
falls short; what was tracked is read as weights over the keys and their in-betweens.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from capture.fit import contour, meet, passes, source
from capture.fit.checkpoint import Keep, keep_of
from capture.fit.pixels import model as models
from capture.fit.pixels.find import Pose
from capture.fit.pixels.model import PartModel
from capture.fit.pixels.outside import UNSAID
from capture.fit.poses import Poses
from capture.motion import affine
from capture.motion.tracks import CartoonMotion, Track, relative_to_parents, track_of
from capture.pictures.clip import Clip
from capture.pictures.decode import read_clip
from capture.pictures.shot import Part, Shot

LOOSE = 0.2  # pixels of misfit worth a weight of 1 on rows beside the three of eq. 7
CHUNK = 512  # frames whose meshes are in memory at a time


def capture(shot: Shot, clip: Clip | None = None, keep: str | Path | None = None, stays: bool = False) -> CartoonMotion:
    """Capture all parts of a shot: where each is in every frame, and which of its keys it looks like.

    Every part is followed from its key frames through the whole clip; the more keys, the surer, and any frame will do,
    not only the first.  Frames in which a part cannot be seen are marked (`Track.visible`) and hold the last pose.
    `clip` may be given where the frames are not in a file.

    A long capture may be interrupted: with `keep`, the path of a file, what is done is put there every few seconds,
    and the same call again goes on from there to the very same result.  The file is removed at the end, unless it
    `stays` until its owner has put the motion away.
    """
    from threadpoolctl import threadpool_limits

    clip = open_clip(shot) if clip is None else clip
    kept = None if keep is None else keep_of(keep, shot, clip)
    with threadpool_limits(1):  # matrices here are small: BLAS threads would only wait for each other
        followed = follow(shot.parts, clip, shot.start, kept)
    motion = CartoonMotion(
        tracks=tuple(track for track, _ in followed),
        keysets=tuple(model.keyset for _, model in followed),
        times=np.array(clip.times, float),
        fps=float(clip.fps),
        size=clip.size,
    )
    motion = source.stamped(relative_to_parents(motion), shot)
    if kept is not None and not stays:
        kept.remove()
    return motion


def open_clip(shot: Shot) -> Clip:
    """The stretch of the clip that the shot is about."""
    return read_clip(shot.clip, start=shot.start, stop=shot.stop, tile=shot.tile, fps=shot.fps)


def follow(
    parts: tuple[Part, ...], clip: Clip, first: int = 0, keep: Keep | None = None
) -> list[tuple[Track, PartModel]]:
    """Parts through all frames of a clip: their tracks, about their pivots but not yet relative to their parents.

    The clip's frame 0 is number `first` of the shot's numbering.
    """
    learnt = [models.learn(part, clip, first, parts) for part in parts]
    keys = [key_poses(model, clip, first) for model in learnt]
    done = passes.go_through(learnt, keys, clip, keep)
    runs = zip(learnt, done.forward, done.backward)
    return [(as_track(model, meet.joined(model, *of_part)), model) for model, *of_part in runs]


def key_poses(model: PartModel, clip: Clip, first: int = 0) -> dict[int, Pose]:
    """What is known of a part without looking: its pose in each key frame, by frame, the earliest first."""
    frames = models.key_frames(model.part, clip, first)
    poses = {frame: Pose(model.keyset.removed[key], _key_alpha(model, key)) for key, frame in enumerate(frames)}
    return dict(sorted(poses.items()))


def as_track(model: PartModel, poses: Poses) -> Track:
    """Tracked shapes as weights over rows, which any target can redraw: contour capture of the tracked mesh.

    Its maps are those of the picture, about the part's pivot.
    """
    keyset, part, column = model.keyset, model.part, poses.columns
    placed, weights = column["placed"], np.ones((len(poses.known), 1))
    if model.shape is not None:
        starts = range(CHUNK, len(placed), CHUNK)
        chunks = zip(*(np.split(column[name], starts) for name in ("placed", "alpha", "misfit")))
        placed, weights = map(np.concatenate, zip(*(_as_weights(model, *chunk) for chunk in chunks)))
    return track_of(
        part.name,
        keyset,
        placed,
        weights,
        column["misfit"],
        pivot=part.pivot,
        parent=part.parent,
        order=part.order,
        visible=column["visible"],
        held=column["held"],
    )


def _as_weights(model: PartModel, placed: NDArray, alphas: NDArray, misfit: NDArray) -> tuple[NDArray, NDArray]:
    """Three rows, as in eq. 7; where the picture is not quite any mix of keys, a little of all rows beside them.

    Of frames in a row with the same pose, which show one drawing, the first is worked out.
    """
    both = np.column_stack([placed.reshape(len(placed), -1), alphas])
    first = np.append(True, (both[1:] != both[:-1]).any(axis=1))
    tracked = affine.apply(placed[first], np.stack([models.mesh_shape(model, alpha) for alpha in alphas[first]]))
    starts, weights = contour.capture_points(tracked, model.keyset, placed[first])
    outside = misfit[first] > UNSAID
    if outside.any():
        loose = contour.loosened(tracked[outside], model.keyset, starts[outside], weights[outside], LOOSE)
        starts[outside], weights[outside] = loose
    shown = np.cumsum(first) - 1
    return starts[shown], weights[shown]


def _key_alpha(model: PartModel, key: int) -> NDArray:
    return np.zeros(0) if model.shape is None else model.shape.space.coefficients[key]
