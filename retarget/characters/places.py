"""Where a character stands: as tall as the source, on the same ground; and the pose that it was drawn in."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from capture.motion import affine
from capture.motion.tracks import CartoonMotion, total_affine


def box_of(outline: NDArray) -> NDArray:
    """Least and greatest corner (2, 2) of points (B, 2)."""
    return np.stack([outline.min(axis=0), outline.max(axis=0)])


def foot_of(box: NDArray) -> NDArray:
    """The middle (2,) of a box's lower edge."""
    return np.array([box[:, 0].mean(), box[1, 1]])


def onto(here: NDArray, there: NDArray) -> NDArray:
    """The similarity (2, 3) that stands a box on another: as tall, on the same ground."""
    # a source as flat as a line has no height to go by
    axis = 1 if there[1, 1] - there[0, 1] > 1e-3 * (there[1, 0] - there[0, 0]) else 0
    scale = (there[1, axis] - there[0, axis]) / (here[1, axis] - here[0, axis])
    linear = scale * np.eye(2)
    return np.column_stack([linear, foot_of(there) - linear @ foot_of(here)])


def rest_frame(motion: CartoonMotion, parts: Sequence[str]) -> int:
    """The frame in which the parts stand nearest to their keys 0, all together: the pose they were drawn in."""
    off = np.zeros(len(motion.times))
    for part in parts:
        keyset = motion.keyset(part)
        rest = keyset.points[0, keyset.outline]
        moved = affine.apply(total_affine(motion, part), rest)
        off += ((moved - rest) ** 2).sum(axis=(1, 2)) / len(rest)
    return int(off.argmin())


def from_frame(motion: CartoonMotion, frame: int) -> CartoonMotion:
    """The tracks as seen from a frame: their maps move the pose of that frame, about where its joints are there.

    With l the map of a part relative to its parent q, M the map of q in the picture, and 0 the frame, it becomes
    M(0) l(t) l(0)^-1 M(0)^-1.  The key sets stay as they are.
    """
    found = []
    for track in motion.tracks:
        local = affine.about(track.affine, track.pivot)
        since = affine.compose(local, affine.invert(local[frame]))
        if track.parent:
            outer = total_affine(motion, track.parent)[frame]
            since = affine.compose(outer, affine.compose(since, affine.invert(outer)))
        pivot = affine.apply(total_affine(motion, track.part)[frame], track.pivot[None])[0]
        found.append(replace(track, affine=affine.from_about(since, pivot), pivot=pivot))
    return replace(motion, tracks=tuple(found))
