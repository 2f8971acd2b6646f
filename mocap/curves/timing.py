"""Timing: when a motion does what it does.  Its poses and its ways stay as they are.

Slow-in and slow-out: time is warped by the distance gone, so that poses are held longer and what lies between them is
over sooner.  On twos: a drawing is shown for two frames of film, twelve a second.

A timing is the moments (T,) of the old motion that are shown in the frames of the new, counted in frames: 12.5 is
half-way between frames 12 and 13.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.motion.tracks import CartoonMotion
from mocap.curves import filters
from mocap.rubber.rubber import RubberMotion
from mocap.skeletons.skeleton import SkeletonMotion

PACES = 0.2, 3.0
"""How slow and how quick, times as before, a motion may get: an ease is no freeze, and no jump."""


def eased(
    curves: NDArray, fps: float, strength: float = 0.5, keep: Sequence[int] = (), smooth: float = 0.08
) -> NDArray:
    """Moments (T,) that ease curves (T, ...) of one unit in and out of their poses.

    Where they go at v times their usual speed time goes v ^ strength times as quickly, so that they go at v ^ (1 +
    strength); below 0 all becomes more even.  `smooth` is over how many seconds a speed is taken.  Frames to `keep`
    (contacts, a beat) are shown when they were, as are the first and the last.
    """
    curves = np.asarray(curves, float)
    if not -1 <= strength <= 3:
        raise InputError(f"how much a motion is eased must be between -1 and 3, got {strength:g}: the usual is 0.5")
    count = len(curves)
    fixed = np.unique(np.concatenate([[0, count - 1], np.asarray(keep, int)]))
    if fixed[0] < 0 or fixed[-1] >= count:
        raise InputError(f"frames to keep must be of the motion, 0 to {count - 1}, got {fixed[0]} to {fixed[-1]}")
    moments = np.arange(count, dtype=float)
    if count < 3 or strength == 0:
        return moments
    speed = filters.slope(curves.reshape(count, -1), fps, smooth)
    speed = np.sqrt((speed**2).sum(axis=1))
    for first, last in pairwise(fixed):
        own = speed[first : last + 1]
        if last - first < 2 or own.max() <= 0:
            continue
        pace = np.clip(own / own.mean(), 1e-3, 1e3) ** strength
        spent = 1 / np.clip(pace, *PACES)  # how long a frame of the old motion is shown
        when = np.concatenate([[0], np.cumsum(0.5 * (spent[1:] + spent[:-1]))])
        shown = np.arange(last - first + 1) * when[-1] / (last - first)
        moments[first : last + 1] = first + np.interp(shown, when, np.arange(last - first + 1))
    return moments


def on_twos(count: int, fps: float, rate: float = 12.0) -> NDArray:
    """Moments (T,) of a motion of `count` frames of which `rate` drawings a second are shown, each held."""
    if not 0 < rate < np.inf:
        raise InputError(f"there must be a number of drawings a second above 0, got {rate:g}: 12 is on twos")
    frames = np.arange(count)
    drawing = np.floor(frames * min(rate / fps, 1.0) + 1e-6)
    return np.searchsorted(drawing, drawing).astype(float)


def played(curves: NDArray, moments: NDArray) -> NDArray:
    """Curves (T, ...) as they are at moments (M,), straight between frames."""
    curves = np.asarray(curves, float)
    first = np.clip(np.floor(moments).astype(int), 0, len(curves) - 1)
    share = np.clip(moments - first, 0, 1).reshape(-1, *(1,) * (curves.ndim - 1))
    return curves[first] + share * (curves[np.minimum(first + 1, len(curves) - 1)] - curves[first])


def played_joints(motion: SkeletonMotion, moments: NDArray) -> SkeletonMotion:
    """A skeleton's motion as it is at moments (M,); joints turn the short way between frames."""
    from mocap.curves.joint_filters import turned
    from mocap.skeletons.rotations import turns_between

    first = np.clip(np.floor(moments).astype(int), 0, len(motion) - 1)
    share = np.clip(moments - first, 0, 1)[:, None, None]
    start, goal = motion.rotation[first], motion.rotation[np.minimum(first + 1, len(motion) - 1)]
    rotation = turned(start, share * turns_between(start, goal))
    return replace(motion, translation=played(motion.translation, moments), rotation=rotation)


def played_rubber(made: RubberMotion, moments: NDArray) -> RubberMotion:
    """A rubber motion as it is at moments (M,): sub-joints go straight and turn the short way between frames."""
    as_joints = SkeletonMotion(made.source.skeleton, made.positions, made.rotation, made.source.fps)
    shown = played_joints(as_joints, moments)
    return replace(
        made,
        source=played_joints(made.source, moments),
        positions=shown.translation,
        rotation=shown.rotation,
        stretch=played(made.stretch, moments),
        thickness=played(made.thickness, moments),
    )


def played_drawings(motion: CartoonMotion, moments: NDArray) -> CartoonMotion:
    """A cartoon as it is at moments (T,), one for each of its frames.

    What is on twos stays drawings: a frame shows the drawing of its moment.  Where each frame has its own, new ones are
    made in between.
    """
    if len(moments) != len(motion.times):
        raise InputError(f"a cartoon of {len(motion.times)} frames must have a moment for each, got {len(moments)}")
    near = np.clip(np.floor(moments + 1e-9).astype(int), 0, len(moments) - 1)
    after = np.minimum(near + 1, len(moments) - 1)
    tracks = []
    for track in motion.tracks:
        drawing = np.cumsum(~track.held)
        between = track.visible[near] & track.visible[after] & ~track.held[near] & ~track.held[after]
        at = np.where(between, moments, near)
        shown = np.where(between & (at > near), -1 - np.arange(len(at)), drawing[near])  # what is made is new
        held = np.diff(shown, prepend=shown[0] - 1) == 0
        held |= np.diff(at, prepend=-1) == 0
        tracks.append(
            replace(
                track,
                affine=played(track.affine, at),
                weights=played(track.weights, at),
                residual=played(track.residual, at),
                visible=track.visible[near],
                order=track.order[near],
                held=held,
            )
        )
    return replace(motion, tracks=tuple(tracks))
