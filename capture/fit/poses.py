"""The poses of one part over a clip, as a table: a column for each field of a pose, a row for each frame.

A table is small, 100 to 200 bytes a frame, whatever the length of the clip and the number of pictures looked at.
"""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from capture.fit.pixels import model as models
from capture.fit.pixels.find import Pose
from capture.fit.pixels.model import PartModel


@dataclass(frozen=True, eq=False)
class Poses:
    """Poses over T frames; the one kind of array here that is written into, as the clip is gone through."""

    columns: dict[str, NDArray]  # (T, ...) for each field of a pose
    known: NDArray  # (T,) bool, whether the frame has a pose yet


def empty(frames: int, like: Pose) -> Poses:
    """A table for so many frames, without a pose in it; `like` shows the fields' shapes."""
    shown = {field.name: np.asarray(getattr(like, field.name)) for field in fields(like)}
    columns = {name: np.zeros((frames, *value.shape), value.dtype) for name, value in shown.items()}
    return Poses(columns, np.zeros(frames, bool))


def copy(poses: Poses) -> Poses:
    """A table of its own, to be written into."""
    return Poses({name: column.copy() for name, column in poses.columns.items()}, poses.known.copy())


def put(poses: Poses, t: int, pose: Pose) -> None:
    """Write frame t's pose into the table."""
    for name, column in poses.columns.items():
        column[t] = getattr(pose, name)
    poses.known[t] = True


def at(poses: Poses, t: int) -> Pose:
    """Frame t's pose."""
    return Pose(
        **{name: column[t].copy() if column.ndim > 1 else column[t].item() for name, column in poses.columns.items()}
    )


def apart(model: PartModel, one: Pose, other: Pose) -> float:
    """How far two poses of a part are from each other: the mean distance of their outlines' points, in pixels."""
    outlines = [models.outline_at(model, pose.placed, pose.alpha) for pose in (one, other)]
    return float(np.linalg.norm(outlines[0] - outlines[1], axis=-1).mean())
