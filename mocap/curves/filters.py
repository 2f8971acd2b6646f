"""The cartoon animation filter: anticipation and follow-through for any curve (Wang et al. 2006).

    x*(t) = x(t) - A (x * g_sigma)''(t - shift)

Before a move the curve goes back a little, after it too far, the more the quicker the move is.  The gain A is chosen so
that `amount` 1 doubles the movement that the width is tuned to, sqrt(2) / sigma radians a second, in whatever units.
Later by `shift`, a part drags behind its parent.

Curves are arrays (T, ...): joint angles, positions, or what a drawing's affine map is made of.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capture.errors import InputError
from mocap.curves.ends import extended

REACH = 5
"""A Gaussian ends after so many standard deviations."""

LEAST, MOST = 0.04, 0.3
"""Seconds between which `pace` keeps a width: quicker is noise in mocap, slower is not a move but a scene."""


def cartoon(
    curves: NDArray,
    fps: float,
    amount: float = 1.0,
    sigma: float | None = None,
    shift: ArrayLike = 0.0,
    anticipation: float = 1.0,
    overshoot: float = 1.0,
    loop: bool = False,
    travel: ArrayLike = 0.0,
) -> NDArray:
    """Curves (T, ...) with anticipation and follow-through; sigma in seconds, the `pace` of the curves if not given.

    `shift`, in seconds, is one for all or one for each curve (...).  `anticipation` and `overshoot` scale what comes
    before a move, where it gathers speed, and after it.  What goes straight on at one speed stays as it is.
    """
    curves = _checked(curves, fps)
    sigma = pace(curves, fps) if sigma is None else sigma
    if not 0 < sigma < np.inf:
        raise InputError(f"the filter's width must be above 0 seconds, got {sigma:g}: the usual are 0.05 to 0.3")
    if not np.isfinite([amount, anticipation, overshoot]).all():
        raise InputError("how much a filter does must be a number, one that is infinite or none came: 1 is the usual")
    push = -(0.5 * np.e * sigma**2) * amount * bend(curves, fps, sigma, shift, loop, travel)
    if anticipation == overshoot:
        return curves + anticipation * push
    gathers = _gathers(curves, fps, sigma, shift, loop, travel)
    return curves + (gathers * anticipation + (1 - gathers) * overshoot) * push


def pace(curves: NDArray, fps: float, loop: bool = False) -> float:
    """The width in seconds that is tuned to what is seen most of curves (T, ...) of one unit.

    That is the mean frequency of their speed, each as strong as it is: sigma = sqrt(2) / omega.  What all frames have
    in common, to go straight on, is not seen.
    """
    curves = _checked(curves, fps)
    fine = max(LEAST, 1 / fps)
    speed = (slope(curves, fps, fine, loop=loop).var(axis=0) * len(curves)).sum()
    turns = (bend(curves, fps, fine, loop=loop) ** 2).sum()
    if speed <= 0 or turns <= 0:
        return MOST / 2
    return float(np.clip(np.sqrt(2 * speed / turns), max(LEAST, 1 / fps), MOST))


def bend(
    curves: NDArray,
    fps: float,
    sigma: float,
    shift: ArrayLike = 0.0,
    loop: bool = False,
    travel: ArrayLike = 0.0,
) -> NDArray:
    """The smoothed second derivative (T, ...) a second squared, by a kernel that is exact for parabolas."""
    return fps**2 * _filtered(curves, 2, sigma * fps, np.asarray(shift) * fps, loop, travel)


def slope(
    curves: NDArray,
    fps: float,
    sigma: float,
    shift: ArrayLike = 0.0,
    loop: bool = False,
    travel: ArrayLike = 0.0,
) -> NDArray:
    """The smoothed first derivative (T, ...) a second."""
    return fps * _filtered(curves, 1, sigma * fps, np.asarray(shift) * fps, loop, travel)


def average(curves: NDArray, fps: float, sigma: float, loop: bool = False, travel: ArrayLike = 0.0) -> NDArray:
    """The local average (T, ...) over a Gaussian of sigma seconds (Kwon and Lee 2008, eqs. 2 and 3)."""
    curves = np.asarray(curves, float)
    return curves[0] + _filtered(curves, 0, sigma * fps, np.zeros(()), loop, travel)


def kernel(order: int, width: float, shift: float = 0.0) -> tuple[NDArray, NDArray]:
    """Frames (n,), counted back from now, and weights (n,): a Gaussian `width` frames wide, or a derivative of it.

    A parabola times the Gaussian whose sums are those of a derivative: on few samples those of the formula are not, and
    then straight lines would be bent.  The result depends on the frame rate no more than the samples do.
    """
    width = max(width, 0.5)
    first, last = np.floor(shift - REACH * width), np.ceil(shift + REACH * width)
    frames = np.arange(first, last + 1)
    away = frames - shift
    powers = away ** np.arange(3)[:, None]
    shape = np.exp(-0.5 * (away / width) ** 2)
    if order == 0:
        return frames.astype(int), shape / shape.sum()
    wanted = np.zeros(3)
    wanted[order] = (-1.0) ** order * (1, 1, 2)[order]
    return frames.astype(int), np.linalg.solve((powers * shape) @ powers.T, wanted) @ powers * shape


def _filtered(curves: NDArray, order: int, width: float, shifts: NDArray, loop: bool, travel: ArrayLike) -> NDArray:
    """The kernel's answer (T, ...) to curves (T, ...) that begin at 0."""
    from scipy.signal import oaconvolve

    curves = np.asarray(curves, float)
    flat = curves.reshape(len(curves), -1)
    shifts = np.broadcast_to(shifts, curves.shape[1:]).reshape(-1)
    travel = np.broadcast_to(np.asarray(travel, float), curves.shape[1:]).reshape(-1)
    out = np.empty_like(flat)
    for shift in np.unique(shifts):
        own = shifts == shift
        frames, weights = kernel(order, width, shift)
        longer = extended(flat[:, own] - flat[0, own], max(frames[-1], 0), max(-frames[0], 0), loop, travel[own])
        start = max(frames[-1], 0) - frames[-1]  # a kernel that looks at the past only needs no frames to come
        longer = longer[start : start + len(flat) + len(frames) - 1]
        out[:, own] = oaconvolve(longer, weights[:, None], mode="valid", axes=0)
    return out.reshape(curves.shape)


def _gathers(curves: NDArray, fps: float, sigma: float, shift: ArrayLike, loop: bool, travel: ArrayLike) -> NDArray:
    """How far curves (T, ...) gather speed: 1 where acceleration and speed agree, 0 where they are opposed.

    The last axis of (T, J, d) is a vector, and goes together.
    """
    speed = slope(curves, fps, sigma, shift, loop, travel) * np.sqrt(2) / sigma
    turn = bend(curves, fps, sigma, shift, loop, travel)
    together = (curves.ndim > 2) * (-1,)
    along, total = speed * turn, speed**2 + turn**2
    if together:
        along, total = along.sum(axis=-1, keepdims=True), total.sum(axis=-1, keepdims=True)
    return 0.5 + np.divide(along, total, out=np.zeros_like(total), where=total > 0)


def _checked(curves: NDArray, fps: float) -> NDArray:
    curves = np.asarray(curves, float)
    if curves.ndim < 2 or not len(curves) or not np.isfinite(curves).all() or not 0 < fps < np.inf:
        raise InputError(
            "curves must be finite, frames first (T, ...), at a frame rate above 0, "
            f"they came with shape {curves.shape} at {fps:g}"
        )
    return curves
