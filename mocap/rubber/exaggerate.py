"""Where joints go is pushed away from where they are on average (Kwon & Lee 2008, section 4.1).

A clip's ends are continued by odd reflection, P(-i) = 2 P(0) - P(i), over and over: so a straight walk stays straight
to its last frame, the first and last pose stay as they are, and the filter may be wider than the clip.

`omega`, `sigma` and `calm` are one number, or one for each joint (J,), for each frame (T, 1), or for both (T, J).
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capture.errors import InputError
from mocap.ends import travel_of

CALM = 0.04
"""Seconds: what goes to and fro quicker is noise in mocap of 75 frames a second and more."""

REACH = 6
"""A Gaussian ends after so many standard deviations."""


def exaggerated(
    positions: NDArray,
    fps: float,
    omega: ArrayLike = 5.0,
    sigma: ArrayLike = 0.15,
    calm: ArrayLike | None = None,
    parents: tuple[int, ...] | None = None,
    loop: bool = False,
    travel: NDArray | None = None,
) -> NDArray:
    """Places (T, J, 3) exaggerated `omega` times, e = j + (omega - 1) (j * g_calm - j * g_sigma).

    Eq. 1 (`extrapolated`) multiplies all noise by omega, this leaves alone what is quicker than `calm` seconds; if not
    given, `calm_of` the frame rate.  With `parents`, each link has an omega of its own: a joint is carried along by
    its parent, and its omega acts on the way from there.  Where all joints have one omega that changes nothing.
    """
    calm = calm_of(fps, sigma) if calm is None else calm
    return pushed(positions, deviation(positions, fps, sigma, calm, loop, travel), omega, parents)


def extrapolated(
    positions: NDArray, fps: float, omega: ArrayLike = 5.0, sigma: ArrayLike = 0.15, loop: bool = False
) -> NDArray:
    """Places (T, J, 3) by eq. 1 to the letter, e = omega j + (1 - omega) a.

    It shortens no link, for an average of vectors of one length is not longer; but where the average takes in frames
    reflected at an end of the clip, it may.  Erratum: eq. 3 prints exp(+t^2 / 2 sigma^2); a Gaussian needs the minus.
    """
    return pushed(positions, deviation(positions, fps, sigma, 0.0, loop), omega)


def calm_of(fps: float, sigma: ArrayLike = 0.15) -> NDArray:
    """Seconds below which a movement is left alone: CALM, not less than three frames, not more than 2/3 sigma.

    Three frames are 0.1 s at 30 frames a second, where real kicks and steps are but a few frames long: at omega = 5 and
    sigma = 0.15 their jerk is then at most 1.5 times what it was, with 0.067 s 1.7 to 2.2 times.
    """
    return np.minimum(max(CALM, 3 / fps), np.asarray(sigma, float) * 2 / 3)


def deviation(
    positions: NDArray,
    fps: float,
    sigma: ArrayLike = 0.15,
    calm: ArrayLike = 0.0,
    loop: bool = False,
    travel: NDArray | None = None,
) -> NDArray:
    """How far places (T, J, 3), averaged over `calm` seconds, are from their average over `sigma` (eqs. 2 and 3).

    In a loop the frame after the last is the first, `travel` (3,) further on, or as far as the first joint goes.
    """
    shape = positions.shape[:2]
    wide, narrow = _fitting(sigma, shape, "sigma") * fps, _fitting(calm, shape, "calm") * fps
    if min(wide.min(), narrow.min()) < 0:
        raise InputError("sigma and calm must be seconds, 0 or more, a negative one came: take its size")
    if len(positions) < 3:
        return np.zeros_like(positions)
    rest = positions - _straight(positions, loop, travel)
    if any(width.ndim == 2 and len(width) > 1 for width in (narrow, wide)):
        narrow, wide = np.broadcast_to(narrow, shape), np.broadcast_to(wide, shape)
        return _averaged_in_time(rest, narrow, loop) - _averaged_in_time(rest, wide, loop)
    return _averaged(rest, narrow, loop, less=wide)


def pushed(
    positions: NDArray, deviations: NDArray, omega: ArrayLike, parents: tuple[int, ...] | None = None
) -> NDArray:
    """Places (T, J, 3) pushed omega - 1 times along their deviations (T, J, 3); with `parents`, link by link."""
    more = _fitting(omega, positions.shape[:2], "omega") - 1
    if parents is None or more.ndim == 0:
        return positions + more[..., None] * deviations
    more = np.broadcast_to(more, positions.shape[:2])[..., None]
    push = more * deviations
    for joint, parent in enumerate(parents):
        if parent >= 0:
            push[:, joint] += push[:, parent] - more[:, joint] * deviations[:, parent]
    return positions + push


def averaged(curves: NDArray, width: float, loop: bool = False) -> NDArray:
    """The local average (T, ...) of curves (T, ...) over a Gaussian of `width` frames, with the ends of this file."""
    flat = np.asarray(curves, float).reshape(len(curves), -1, 1)
    if len(flat) < 3:
        return flat.reshape(np.shape(curves))
    straight = _straight(flat, loop, np.zeros(1))
    return (straight + _averaged(flat - straight, np.array(width), loop)).reshape(np.shape(curves))


def _fitting(values: ArrayLike, shape: tuple[int, int], name: str) -> NDArray:
    values = np.asarray(values, float)
    try:
        np.broadcast_to(values, shape)
    except ValueError:
        values = np.full((1, 1), np.nan)
    if not np.isfinite(values).all():
        raise InputError(
            f"{name} must be a number, or one for each of {shape[1]} joints ({shape[1]},), for each of {shape[0]} "
            f"frames ({shape[0]}, 1), or for both: give it that shape"
        )
    return values


def _straight(positions: NDArray, loop: bool, travel: NDArray | None) -> NDArray:
    """What is not averaged (T, J, 3): the line between the ends; in a loop, how the body travels, alike for all."""
    along = np.linspace(0, 1, len(positions))[:, None, None]
    if not loop:
        return (1 - along) * positions[0] + along * positions[-1]
    return along * (1 - 1 / len(positions)) * (travel_of(positions[:, 0]) if travel is None else travel)


def _averaged(rest: NDArray, widths: NDArray, loop: bool, less: NDArray | None = None) -> NDArray:
    """The local average (T, J, 3) over widths () or (J,) in frames, less that over others."""
    from scipy import fft

    both = [widths] if less is None else [widths, less]
    reach = _reach(np.concatenate([width.ravel() for width in both]))
    frames, sign = _beyond(np.arange(-reach, len(rest) + reach), len(rest), loop)
    longer = rest[frames] * sign[:, None, None]
    period = fft.next_fast_len(len(longer), real=True)  # longer by the filter's reach: what comes round is cut off
    gains = [_responses(width, period) for width in both]
    waves = fft.rfft(longer, period, axis=0) * (gains[0] - gains[1] if len(gains) > 1 else gains[0])[..., None]
    return fft.irfft(waves, period, axis=0)[reach : reach + len(rest)]


def _responses(widths: NDArray, period: int) -> NDArray:
    """How much of each wave (period // 2 + 1, 1 or J) Gaussians of widths () or (J,) frames leave."""
    several, column = np.unique(widths.ravel(), return_inverse=True)
    at = np.arange(-_reach(several), _reach(several) + 1)
    kernels = np.stack([np.bincount(at % period, own, period) for own in _gaussian(several, at)], axis=-1)
    return np.fft.rfft(kernels, axis=0).real[:, column]


def _averaged_in_time(rest: NDArray, widths: NDArray, loop: bool) -> NDArray:
    """The local average (T, J, 3) where its width (T, J), in frames, changes over time."""
    from scipy import sparse

    count = len(rest)
    result = np.empty_like(rest)
    columns, of_joint = np.unique(widths, axis=1, return_inverse=True)
    for column, own in enumerate(columns.T):
        at = np.arange(-_reach(own), _reach(own) + 1)
        frames, sign = _beyond(np.arange(count)[:, None] + at, count, loop)
        rows = np.repeat(np.arange(count), len(at))
        weights = (_gaussian(own, at) * sign).ravel()
        average = sparse.csr_matrix((weights, (rows, frames.ravel())), shape=(count, count))
        joints = np.flatnonzero(of_joint.ravel() == column)
        result[:, joints] = (average @ rest[:, joints].reshape(count, -1)).reshape(count, -1, 3)
    return result


def _beyond(frames: NDArray, count: int, loop: bool) -> tuple[NDArray, NDArray]:
    """Which of `count` frames stand for frames beyond the ends, and their signs: on the way back all is mirrored."""
    frames = frames % (count if loop else 2 * (count - 1))
    back = frames >= count
    return np.where(back, 2 * (count - 1) - frames, frames), np.where(back, -1.0, 1.0)


def _gaussian(widths: NDArray, at: NDArray) -> NDArray:
    """Weights (W, R), of sum 1, of frames `at` (R,), counted from the middle, for widths (W,) in frames (eq. 3)."""
    weights = np.exp(-0.5 * (at / np.maximum(widths, 1e-3)[:, None]) ** 2)
    return weights / weights.sum(axis=1, keepdims=True)


def _reach(widths: NDArray) -> int:
    return int(np.ceil(REACH * widths.max())) + 1
