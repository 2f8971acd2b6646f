"""Kept postures played by elastic joints: all at once, or moment by moment with springs that change on the way.

Joints turn against the first posture, and each posture's turns are those nearest to the posture's before, so that
nothing whirls round.  What is not turned, where the figure stands, hangs on springs of its own.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from mocap.posing import elastic, poses, postures
from mocap.posing.elastic import Elastic
from mocap.posing.poses import Pose
from mocap.skeletons import rotations
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion


@dataclass(frozen=True, eq=False)
class Playing:
    """A figure on its way from posture to posture, and after the last to the first again."""

    skeleton: Skeleton
    rest: NDArray  # (J, 4) joints' turns on their parents in the first posture
    goals: NDArray  # (n, 2 J, 3) turns against it, radians, and after them joints' places on their parents
    state: elastic.State  # (2 J, 3)
    elapsed: float = 0.0  # seconds


def through(skeleton: Skeleton, kept: Sequence[Pose], seconds: float, fps: float, springs: Elastic) -> SkeletonMotion:
    """A motion that is in each posture exactly, `seconds` after the one before, as springs go from one to the next."""
    playing = begun(skeleton, kept)
    _refuse_no_time(seconds, fps)
    count = len(kept) - 1
    at = np.arange(round(count * seconds * fps) + 1) / fps
    if not count:
        return _shown(playing, playing.goals, fps)
    return _shown(playing, elastic.through(springs, at, seconds * np.arange(count + 1), playing.goals).turns, fps)


def begun(skeleton: Skeleton, kept: Sequence[Pose]) -> Playing:
    """At rest in the first of the kept postures."""
    if not kept:
        raise InputError("a motion needs postures, there are none: keep one first")
    keys = poses.motion_of(skeleton, kept, 1.0)
    turns = np.zeros((len(kept), len(skeleton), 3))
    for n in range(1, len(kept)):
        own = rotations.turns_between(keys.rotation[n - 1], keys.rotation[n])  # the short way from posture to posture
        there = rotations.turns_between(keys.rotation[0], keys.rotation[n])
        turns[n] = rotations.nearest(there, turns[n - 1] + own)
    goals = np.concatenate([turns, keys.translation], axis=1)
    return Playing(skeleton, keys.rotation[0], goals, elastic.still(goals[0]))


def later(playing: Playing, springs: Elastic, seconds: float, each: float) -> Playing:
    """So many seconds later, by springs as they are now; each posture is made for during `each` seconds, then the next.

    Where it is and how it swings is kept, so that springs that change do so while it plays; and the outcome does not
    depend on how the time is cut.
    """
    if not seconds >= 0 or not each > 0 or not seconds / each < 1e4:
        raise InputError(f"time must go on, a moment at a time, and postures must last, got {seconds:g} and {each:g} s")
    state, now, end = playing.state, playing.elapsed, playing.elapsed + seconds
    while now < end:
        change = (np.floor(now / each + 1e-9) + 1) * each
        until = min(change, end)
        goal = playing.goals[(round(change / each)) % len(playing.goals)]  # the first is where it began
        state = elastic.step(springs, state, until - now, goal)
        now = until
    return Playing(playing.skeleton, playing.rest, playing.goals, state, end)


def seen(playing: Playing, fps: float = 24.0) -> SkeletonMotion:
    """The figure as it is now, a motion of one frame."""
    return _shown(playing, playing.state.turns[None], fps)


def _shown(playing: Playing, values: NDArray, fps: float) -> SkeletonMotion:
    """Frames (T, 2 J, 3) as a motion."""
    joints = len(playing.skeleton)
    rotation = postures.turned(playing.rest, values[:, :joints])
    return SkeletonMotion(playing.skeleton, np.ascontiguousarray(values[:, joints:]), rotation, fps)


def _refuse_no_time(seconds: float, fps: float) -> None:
    if not seconds > 0 or not fps > 0:
        raise InputError(
            f"a motion needs seconds from one posture to the next and a frame rate, got {seconds} and {fps}"
        )
