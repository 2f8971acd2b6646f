"""The filters on a captured cartoon: its own curves, exaggerated (Wang et al. 2006; Kwon and Lee 2008, eqs. 1-3).

A part's map is taken apart, so that a turn stays a turn and no stretch becomes negative: how it turns, the logarithm
of its stretch, how it travels; with them go its weights, whose sum stays 1.  An area that was kept is kept.

Drawings are filtered, not frames: on twos stays on twos.  Only a pause is given new drawings, in the clip's own rhythm,
since what comes before a leap is drawn while the frog still sits.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from capture.motion import keys
from capture.motion.tracks import CartoonMotion, Track
from mocap.curves import filters, joint_filters

PAUSE = 4
"""A drawing shown for so many frames, and for twice as many as usual, is a pause."""

BEYOND = 0.3
"""How far key weights may go beyond 0 to 1; where the source itself goes further, as far as there."""

STRETCH = 2.5
"""How far a part may be stretched or squashed; likewise."""

NOTHING = 1e-3
"""Changes below this, of a part's size, a radian and a weight, are none: a pause does not creep."""

Filter = Callable[[NDArray, float, float], NDArray]
"""Curves (T, n), frames a second, and seconds that the part comes later, to curves (T, n)."""


def cartoon(
    motion: CartoonMotion,
    amount: float = 1.0,
    sigma: float | None = None,
    follow: float = 0.04,
    anticipation: float = 1.0,
    overshoot: float = 1.0,
) -> CartoonMotion:
    """The motion with anticipation and follow-through, by the cartoon animation filter.

    sigma in seconds, the `pace` of the motion if not given; `follow` is how many seconds later each part comes than the
    one it hangs on.
    """
    sigma = pace(motion) if sigma is None else sigma
    said = {"anticipation": anticipation, "overshoot": overshoot}
    return _changed(motion, lambda curves, fps, late: filters.cartoon(curves, fps, amount, sigma, late, **said), follow)


def exaggerated(motion: CartoonMotion, omega: float = 2.0, sigma: float = 0.15) -> CartoonMotion:
    """The motion pushed `omega` times as far from its average over sigma seconds (Kwon and Lee 2008, eq. 1)."""

    def push(curves: NDArray, fps: float, late: float) -> NDArray:
        return omega * curves + (1 - omega) * filters.average(curves, fps, sigma)

    return _changed(motion, push, 0.0)


def pace(motion: CartoonMotion) -> float:
    """The width in seconds that is tuned to what is seen most of the motion, all parts together."""
    moves = []
    for track, keyset in zip(motion.tracks, motion.keysets):
        shapes = keys.shapes(keys.with_rows(keyset, track.rows))
        size = np.sqrt(shapes.var(axis=1).sum(axis=-1).mean())  # what a radian, or a doubling, moves: pixels
        linear, _ = _laid_out(track.affine[..., :-1])
        bent = np.tensordot(track.weights, shapes[:, keyset.outline[::8]], axes=1)
        bent = bent.reshape(len(bent), -1) / np.sqrt(bent.shape[1])
        curves = np.hstack([size * linear, track.affine[..., -1], bent])
        starts = drawings(track.held)
        even = np.arange(motion.times[0], motion.times[-1] + 1e-9, 1 / motion.fps)
        moves.append(_between(motion.times[starts], curves[starts], even))
    return filters.pace(np.hstack(moves), motion.fps)


def drawings(held: NDArray) -> NDArray:
    """The frames at which a drawing begins, from held (T,); a pause is cut into drawings as long as the others."""
    starts = np.flatnonzero(~held | (np.arange(len(held)) == 0))
    lengths = np.diff(starts, append=len(held))
    usual = int(np.median(lengths))
    long = max(PAUSE, 2 * usual)
    cut = [np.arange(start, start + n, usual if n >= long else n) for start, n in zip(starts, lengths)]
    return np.concatenate(cut)


def _changed(motion: CartoonMotion, change: Filter, follow: float) -> CartoonMotion:
    tracks = []
    for track, keyset in zip(motion.tracks, motion.keysets):
        size = float(np.sqrt(keyset.points[0].var(axis=0).sum()))
        tracks.append(_filtered(track, size, follow * _depth(motion, track), motion, change))
    return replace(motion, tracks=tuple(tracks))


def _depth(motion: CartoonMotion, track: Track) -> int:
    """How many parts a part hangs on, one on the other."""
    return 1 + _depth(motion, motion.track(track.parent)) if track.parent else 0


def _filtered(track: Track, size: float, late: float, motion: CartoonMotion, change: Filter) -> Track:
    """A track whose curves are changed; while it is not seen it does nothing, and nothing is announced."""
    laid, put_back = _laid_out(track.affine[..., :-1])
    curves = np.hstack([laid, track.affine[..., -1], track.weights])
    added = np.zeros_like(curves)
    for first, stop in _runs(track.visible):
        starts = first + drawings(track.held[first:stop])
        times = motion.times[starts]
        even = times[0] + np.arange(1 + round((motion.times[stop - 1] - times[0]) * motion.fps)) / motion.fps
        plain = _between(times, curves[starts], even)
        more = _between(even, change(plain, motion.fps, late) - plain, times)
        added[first:stop] = more[np.searchsorted(starts, np.arange(first, stop), side="right") - 1]
    linear, travel, weights = np.split(added, np.cumsum([laid.shape[1], track.affine.shape[1]]), axis=1)
    still = np.abs(np.hstack([linear, travel / size, weights])).max(axis=1) < NOTHING
    added[still] = 0  # and in the three, which are views of it
    affine = np.concatenate([put_back(linear), (track.affine[..., -1] + travel)[..., None]], axis=-1)
    weights = _within(track, weights)
    same = np.zeros(len(track), bool)
    same[1:] = (affine[1:] == affine[:-1]).all(axis=(1, 2)) & (weights[1:] == weights[:-1]).all(axis=1)
    return replace(track, affine=affine, weights=weights, held=track.held & same)


def _runs(seen: NDArray) -> list[tuple[int, int]]:
    """Start and stop of runs of frames of seen (T,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], seen.astype(int), [0]])))
    return [(int(start), int(stop)) for start, stop in edges.reshape(-1, 2)]


def _between(times: NDArray, values: NDArray, at: NDArray) -> NDArray:
    """Curves (E, n) known at `times` (E,), at other times (M, n); straight between, so that weights still sum to 1."""
    return np.stack([np.interp(at, times, curve) for curve in values.T], axis=-1)


def _within(track: Track, added: NDArray) -> NDArray:
    """Weights (T, D) with as much of what is to be added as leaves their keys near what was drawn."""
    own, more = track.key_weights(), keys.fold(track.rows, added, len(track.keys))
    low, high = np.minimum(own.min(), -BEYOND), np.maximum(own.max(), 1 + BEYOND)
    room = np.where(more > 0, high - own, own - low)
    share = np.divide(room, np.abs(more), out=np.ones_like(more), where=np.abs(more) > room)
    return track.weights + share.min(axis=1, keepdims=True) * added


def _laid_out(linear: NDArray) -> tuple[NDArray, Callable[[NDArray], NDArray]]:
    """Curves (T, n) of maps (T, d, d), the turn and then the logarithm of the stretch, and what puts changes back on.

    Mirrored throughout, a part is stretched in the mirror.  Where it turns over, flat for a moment, no logarithm is:
    its numbers are then its curves.
    """
    d = linear.shape[-1]
    flip = np.ones(d)
    if (np.linalg.det(linear) < 0).all():
        flip[0] = -1
    u, sizes, vt = np.linalg.svd(linear * flip)
    turns = u @ vt
    if (np.linalg.det(turns) < 0).any() or (sizes[:, -1] < 1e-3 * sizes[:, 0]).any():
        return linear.reshape(len(linear), -1), lambda added: linear + added.reshape(linear.shape)
    logs = np.einsum("tji,tj,tjk->tik", vt, np.log(sizes), vt)
    upper = np.triu_indices(d)
    around = _angles(turns)
    most = max(np.abs(np.log(sizes)).max(), np.log(STRETCH))

    def put_back(added: NDArray) -> NDArray:
        further, bent = np.split(added, [around.shape[1]], axis=1)
        total = np.zeros_like(logs)
        total[:, *upper] = bent
        total += np.swapaxes(np.triu(total, 1), -1, -2) + logs
        size, axes = np.linalg.eigh(total)
        size *= most / np.maximum(np.abs(size).max(axis=1, keepdims=True), most)
        stretch = np.einsum("tij,tj,tkj->tik", axes, np.exp(size), axes)
        out = turns @ _turns(further) @ stretch * flip
        return np.where(added.any(axis=1)[:, None, None], out, linear)

    return np.hstack([around, logs[:, *upper]]), put_back


def _angles(turns: NDArray) -> NDArray:
    """Angles (T, 1) of turns (T, 2, 2), or small turns laid out (T, 3) of (T, 3, 3)."""
    if turns.shape[-1] == 2:
        return np.unwrap(np.arctan2(turns[:, 1, 0], turns[:, 0, 0]))[:, None]
    from scipy.spatial.transform import Rotation

    return joint_filters.developed(Rotation.from_matrix(turns).as_quat()[:, None])[:, 0]


def _turns(angles: NDArray) -> NDArray:
    """The turns (T, d, d) by angles (T, 1), or by rotation vectors (T, 3)."""
    if angles.shape[1] == 1:
        cos, sin = np.cos(angles[:, 0]), np.sin(angles[:, 0])
        return np.moveaxis(np.array([[cos, -sin], [sin, cos]]), -1, 0)
    from scipy.spatial.transform import Rotation

    return Rotation.from_rotvec(angles).as_matrix()
