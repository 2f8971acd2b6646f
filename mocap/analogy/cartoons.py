"""Captured cartoons as curves: make this bounce like that bounce.

A part's affine map is told as where it is, how it is turned and how it is stretched (the logarithm of the symmetric
part), its shape by its key weights; so half of a squash is half a squash, and a mixture of turns a turn.
"""

from collections.abc import Callable, Collection
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.motion.tracks import CartoonMotion, Track
from mocap.analogy.analogy import ALL, Knobs, curve_analogy
from mocap.analogy.curves import Curves

FLAT = 0.05
"""A part is not taken to be flatter than this: no logarithm is beyond."""


def cartoon_analogy(
    one: CartoonMotion, two: CartoonMotion, three: CartoonMotion, knobs: Knobs = ALL
) -> tuple[CartoonMotion, tuple[str, ...]]:
    """The motion B': `two` is to `one` as it is to `three`; and what there is to say of it.

    Parts are matched by name, key weights by the keys' names; with one part each, names do not matter.  Travel is told
    in sizes of the part.  What is seen, held and in front comes from B, at its moments of B'.
    """
    for name, motion in (("A", one), ("A'", two), ("B", three)):
        if any(track.affine.shape[1] != 2 for track in motion.tracks):
            raise InputError(f"{name} must be a motion in the plane, it is one in space: give motions of drawings")
    called = [_called(motion, three) for motion in (one, two, three)]
    spinning = frozenset(track.part for motion in called for track in motion.tracks if _spins(track.affine))
    made = curve_analogy(*(of_cartoon(motion, spinning) for motion in called), knobs)
    return to_cartoon(made.curves, made.moments[:, 2], three, spinning), made.notes


def of_cartoon(motion: CartoonMotion, spinning: Collection[str] = ()) -> Curves:
    """A captured motion as curves.

    A part is stretched along its own axes, as a limb is; one that is `spinning`, such as a ball, along the page's.
    """
    columns, owners, kinds = [], [], []
    for track in motion.tracks:
        told = {**_place(track, _size(motion, track.part)), **_shape(track.affine, track.part in spinning)}
        for kind, values in told.items():
            columns.append(values)
            kinds.append(kind)
        columns += list(track.key_weights().T)
        kinds += [f"key {name}" for name in track.keys]
        owners += [track.part] * (len(told) + len(track.keys))
    return Curves(np.stack(columns, axis=-1), tuple(owners), tuple(kinds), motion.fps)


def to_cartoon(curves: Curves, moments: NDArray, model: CartoonMotion, spinning: Collection[str] = ()) -> CartoonMotion:
    """The captured motion that curves tell, for the parts of `model`; its frames come of those at `moments` (T,)."""
    count = len(curves)
    nearest = np.round(moments).astype(int)
    column = {name: k for k, name in enumerate(curves.named())}
    tracks = []
    for track in model.tracks:

        def of(kind: str, part: str = track.part) -> NDArray:
            return curves.values[:, column[part, kind]]

        shift = np.stack([of("x"), of("y")], axis=-1) * _size(model, track.part) + track.affine[0, :, 2]
        placed = np.concatenate(
            [_linear(of, track.part in spinning) * _mirror(track.affine), shift[..., None]], axis=-1
        )
        tracks.append(
            replace(
                track,
                affine=placed,
                weights=_weights(np.stack([of(f"key {name}") for name in track.keys], axis=-1), track, nearest),
                residual=track.residual[nearest],
                visible=track.visible[nearest],
                held=track.held[nearest] & np.r_[False, np.diff(nearest) <= 1],
                order=track.order[nearest],
            )
        )
    return replace(model, tracks=tuple(tracks), times=np.arange(count) / curves.fps + model.times[0])


def _place(track: Track, size: float) -> dict[str, NDArray]:
    """Where the pivot is, in sizes of the part, from where it is first."""
    shift = (track.affine[:, :, 2] - track.affine[0, :, 2]) / size
    return {"x": shift[:, 0], "y": shift[:, 1]}


def _spins(maps: NDArray) -> bool:
    """Whether a part goes more than half round."""
    return float(np.ptp(_shape(maps, False)["turn"])) > np.pi


def _shape(maps: NDArray, spinning: bool) -> dict[str, NDArray]:
    """Turn and log-stretch of maps (T, 2, 3); a mirrored part is stretched in the mirror."""
    linear = maps[:, :, :2] * _mirror(maps)
    u, sizes, vt = np.linalg.svd(linear)
    turn = u @ vt
    turn[np.linalg.det(turn) < 0] *= -1  # turned over for a moment: the flattest way through
    axes = np.swapaxes(turn @ np.swapaxes(vt, 1, 2), 1, 2) if spinning else vt
    logs = np.einsum("tji,tj,tjk->tik", axes, np.log(np.maximum(sizes, FLAT)), axes)
    angle = np.unwrap(np.arctan2(turn[:, 1, 0], turn[:, 0, 0]))
    return {"turn": angle, "stretch x": logs[:, 0, 0], "stretch y": logs[:, 1, 1], "slant": logs[:, 0, 1]}


def _mirror(maps: NDArray) -> NDArray:
    return np.array([-1.0, 1.0]) if (np.linalg.det(maps[:, :, :2]) < 0).all() else np.ones(2)


def _linear(of: Callable[[str], NDArray], spinning: bool) -> NDArray:
    angle = of("turn")
    turn = np.stack([np.cos(angle), -np.sin(angle), np.sin(angle), np.cos(angle)], axis=-1).reshape(-1, 2, 2)
    logs = np.stack([of("stretch x"), of("slant"), of("slant"), of("stretch y")], axis=-1).reshape(-1, 2, 2)
    size, axes = np.linalg.eigh(logs)
    stretch = np.einsum("tij,tj,tkj->tik", axes, np.exp(np.clip(size, np.log(FLAT), -np.log(FLAT))), axes)
    return stretch @ turn if spinning else turn @ stretch


def _weights(keyed: NDArray, track: Track, nearest: NDArray) -> NDArray:
    """Weights (T, D): B's own at its moments, and what the keys (T, K) gained over them on the rows of the keys."""
    gained = keyed - track.key_weights()[nearest]
    gained -= gained.mean(axis=1, keepdims=True)  # they go on summing to 1
    weights = track.weights[nearest].copy()
    for key in range(len(track.keys)):
        own = (track.rows[:, 0] == key) & ((track.rows[:, 1] == key) | (track.rows[:, 2] == 0))
        weights[:, np.flatnonzero(own)[0]] += gained[:, key]
    return weights


def _size(motion: CartoonMotion, part: str) -> float:
    keyset = motion.keyset(part)
    return float(np.ptp(keyset.points[0, keyset.outline], axis=0).max())


def _called(motion: CartoonMotion, goal: CartoonMotion) -> CartoonMotion:
    """The motion with its one part called as B's one part."""
    if len(motion.tracks) == len(goal.tracks) == 1:
        return replace(motion, tracks=(replace(motion.tracks[0], part=goal.tracks[0].part),))
    return motion
