"""Video capture of a whole shot: every part found in every frame (Bregler et al. 2002, section 3.3).

A part is followed from its first key's frame to the clip's end and then back to its start.  Held drawings are
recognised and cost nothing; in the others the part is looked for from the pose before.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from capture.fit import contour
from capture.fit.pixels import model as models
from capture.fit.pixels.find import Pose, Sighting, find
from capture.fit.pixels.model import PartModel
from capture.motion import affine
from capture.motion.tracks import CartoonMotion, Track, relative_to_parents, track_of
from capture.pictures.clip import Clip
from capture.pictures.decode import read_clip
from capture.pictures.shot import Part, Shot
from capture.progress import progress


def capture(shot: Shot, clip: Clip | None = None) -> CartoonMotion:
    """Capture all parts of a shot; `clip` may be given where the frames are not in a file."""
    from threadpoolctl import threadpool_limits

    clip = open_clip(shot) if clip is None else clip
    with threadpool_limits(1):  # matrices here are small: BLAS threads would only wait for each other
        followed = follow(shot.parts, clip, shot.start)
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


def follow(parts: tuple[Part, ...], clip: Clip, first: int = 0) -> list[tuple[Track, PartModel]]:
    """Parts through all frames of a clip: their tracks, about their pivots but not yet relative to their parents.

    The clip's frame 0 is number `first` of the shot's numbering.
    """
    learnt = [models.learn(part, clip, first, parts) for part in parts]
    starts = [models.key_frames(part, clip, first)[0] for part in parts]
    forward = _run(learnt, starts, clip, range(min(starts), len(clip)))
    backward = _run(learnt, starts, clip, range(max(starts), -1, -1))
    return [(_as_track(model, _joined(*runs)), model) for model, *runs in zip(learnt, forward, backward)]


def _run(learnt: list[PartModel], starts: list[int], clip: Clip, frames: range) -> list[list[Pose]]:
    """The poses of every part in the frames, in the order given, from its own start on."""
    sightings: list[Sighting | None] = [None] * len(learnt)
    poses: list[list[Pose]] = [[] for _ in learnt]
    names = ", ".join(model.part.name for model in learnt)
    for t in progress(frames, names, len(frames)):
        for number, (model, start) in enumerate(zip(learnt, starts)):
            if t == start:
                sightings[number] = Sighting(model, model.colors, Pose(affine.identity(), _key_alpha(model, 0)))
        image = np.asarray(clip[t])[..., :3]
        begun = [number for number, sighting in enumerate(sightings) if sighting is not None]
        for number, sighting in zip(begun, find(image, tuple(sightings[number] for number in begun))):
            sightings[number] = sighting
            poses[number].append(sighting.pose)
    return poses


def _joined(forward: list[Pose], backward: list[Pose]) -> list[Pose]:
    """All frames' poses from a run forward and one backward that begin at the same frame."""
    held = [False] + [pose.held for pose in backward[:0:-1]]  # backwards a frame is like the one after it
    poses, key = backward[:0:-1] + forward, len(backward) - 1
    poses[: key + 1] = [replace(pose, held=like) for pose, like in zip(poses[: key + 1], held)]
    return poses


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


def _key_alpha(model: PartModel, key: int) -> NDArray:
    return np.zeros(0) if model.shape is None else model.shape.space.coefficients[key]
