"""Key frames chosen by the program: the fewest drawings of a clip whose mixes redraw all the others.

How far a drawing is from a set of keys is measured as contour capture would redraw it: after the best affine map and
the best mix of the keys and their in-betweens (Bregler et al. 2002, section 3.2), as the root mean square over
the outline's points, in pixels.  So a drawing that is merely turned, squashed or sheared is no new key.

The keys are found greedily, always the drawing that is farthest from what there is; then whatever has become
superfluous is dropped, and two keys give way to one where one will do.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.fit import contour
from capture.motion import affine, keys
from capture.pictures.shot import KeyDrawing, Part

ROUNDS = 2  # of contour capture's alternation: enough to compare sets of keys

Distance = Callable[[tuple[int, ...]], NDArray]
"""Pixels (U,) by which each of U drawings is off the mixes of the keys with these numbers, which rise."""


@dataclass(frozen=True, eq=False)
class Suggestion:
    """Which frames are to be keys, and what each of them is good for."""

    key_frames: NDArray  # (K,) int, rising but for the first, whose outline is one that does not cross itself
    residual: NDArray  # (T,) pixels, with all keys
    residual_without: NDArray  # (K, T) pixels, with key k left out; inf where no key could be the first without it
    residual_by_count: NDArray  # (C,) pixels, the worst frame with the first 1, 2, ... C keys of the greedy search
    held: NDArray  # (T,) bool, the same drawing as the frame before
    most_residual: float  # what was asked for, pixels

    def met(self) -> bool:
        """Whether every frame is as near as was asked for."""
        return bool(self.residual.max() <= self.most_residual)


def suggest(
    outlines: NDArray, most_residual: float = 1.0, most_keys: int = 8, whole: NDArray | None = None
) -> Suggestion:
    """The smallest set of key frames, `most_keys` at most, that redraws corresponding outlines (T, N, 2).

    No frame is to be off by more than `most_residual` pixels.  Frames that are not `whole` (T,) bool, such as
    drawings half hidden, are neither chosen nor counted.
    """
    outlines = np.asarray(outlines, float)
    _check(outlines, most_residual, most_keys)
    held = held_outlines(outlines)
    whole = np.ones(len(outlines), bool) if whole is None else np.asarray(whole, bool)
    drawn = np.flatnonzero(whole & ~held) if (whole & ~held).any() else np.flatnonzero(whole)
    simple = _simple(outlines[drawn])
    if not simple.any():
        raise InputError(
            "the first key's outline must be a closed curve that does not cross itself, in none of the "
            f"{len(outlines)} frames is it: trace the drawing again, or choose another box or colour"
        )
    distance = _distance(outlines[drawn], simple)
    found, by_count = _farthest_first(distance, _nearest_mean(outlines[drawn], simple), most_residual, most_keys)
    found = _without_idle(distance, found, most_residual)
    found = _merged(distance, found, most_residual)
    chosen, shown = _in_order(found, simple), _shown(drawn, len(outlines))
    return Suggestion(
        key_frames=drawn[list(chosen)],
        residual=distance(found)[shown],
        residual_without=np.stack([distance(_less(found, k))[shown] for k in chosen]),
        residual_by_count=np.array(by_count),
        held=held,
        most_residual=float(most_residual),
    )


def with_keys(part: Part, outlines: NDArray, suggestion: Suggestion, first: int = 0) -> Part:
    """The part with the suggested drawings as its keys, named k0, k12, ... after their frames.

    Frame 0 of outlines (T, N, 2) is number `first` of the shot's numbering.  Box, colour and scribbles are left out:
    the outlines say more.
    """
    found = tuple(
        KeyDrawing(
            f"k{frame + first}", int(frame) + first, tuple((float(x), float(y)) for x, y in np.round(outline, 3))
        )
        for frame, outline in zip(suggestion.key_frames, outlines[suggestion.key_frames], strict=True)
    )
    return replace(part, keys=found, box=None, color=None, inside=(), outside=())


def reasons(suggestion: Suggestion, first: int = 0) -> list[str]:
    """For every key, in words, what the clip would lose without it."""
    told = []
    for frame, off in zip(suggestion.key_frames, suggestion.residual_without, strict=True):
        worst = int(np.argmax(off))
        lost = f"without it {off[worst]:.1f} px at frame {worst + first}"
        told.append(f"k{frame + first}: " + (lost if np.isfinite(off[worst]) else "the only key"))
    return told


def held_outlines(outlines: NDArray) -> NDArray:
    """Frames (T,) whose outline (T, N, 2) is the one of the frame before, point by point."""
    still = np.abs(np.diff(outlines, axis=0)).max(axis=(1, 2)) < 1e-6 * np.ptp(outlines, axis=1).max()
    return np.concatenate([[False], still])


def _distance(outlines: NDArray, simple: NDArray) -> Distance:
    """How far each of U outlines (U, N, 2) is from a set of keys among them; a set is tried once."""

    @cache
    def distance(chosen: tuple[int, ...]) -> NDArray:
        if not simple[list(chosen)].any():
            return np.full(len(outlines), np.inf)
        keyset, seen = contour.outline_keys(outlines, np.array(_in_order(chosen, simple)))
        placed, weights = contour.capture_points(seen, keyset, rounds=ROUNDS)
        redrawn = affine.apply(placed, np.tensordot(weights, keys.shapes(keyset), axes=1))
        return np.sqrt(((redrawn - seen) ** 2).sum(axis=-1).mean(axis=-1))

    return distance


def _farthest_first(
    distance: Distance, start: int, most_residual: float, most_keys: int
) -> tuple[tuple[int, ...], list[float]]:
    """Keys added one by one, each the drawing that is worst without it, and the worst distance after each."""
    found, by_count = (start,), []
    while True:
        off = distance(found)
        by_count.append(float(off.max()))
        if by_count[-1] <= most_residual or len(found) == most_keys:
            return found, by_count
        farthest = int(np.argmax(off))
        if farthest in found:  # a bound finer than a key itself can be redrawn
            return found, by_count
        found = _more(found, farthest)


def _without_idle(distance: Distance, found: tuple[int, ...], most_residual: float) -> tuple[int, ...]:
    """Keys less those that can go, the least needed first, with everything still within the bound."""
    while len(found) > 1:
        worst = {k: distance(_less(found, k)).max() for k in found}
        idle = min(worst, key=worst.get)
        if worst[idle] > most_residual:
            return found
        found = _less(found, idle)
    return found


def _merged(distance: Distance, found: tuple[int, ...], most_residual: float) -> tuple[int, ...]:
    """Two keys exchanged for one, as long as that keeps the bound; tried among the three that are needed least."""
    while len(found) > 2 and distance(found).max() <= most_residual:
        needed = sorted(found, key=lambda k: distance(_less(found, k)).max())
        for pair in combinations(needed[:3], 2):
            fewer = _less(found, *pair)
            one = int(np.argmax(distance(fewer)))
            if one not in fewer and distance(_more(fewer, one)).max() <= most_residual:
                found = _without_idle(distance, _more(fewer, one), most_residual)
                break
        else:
            break
    return found


def _nearest_mean(outlines: NDArray, simple: NDArray) -> int:
    """Which outline of (U, N, 2) is nearest the mean shape, affine maps taken out; one of the `simple` (U,)."""
    mean = outlines[int(np.argmax(simple))]
    for _ in range(2):
        mean = affine.apply(affine.fit(outlines, np.broadcast_to(mean, outlines.shape)), outlines).mean(axis=0)
    off = affine.apply(affine.fit(np.broadcast_to(mean, outlines.shape), outlines), mean) - outlines
    return int(np.argmin(np.where(simple, (off**2).sum(axis=(1, 2)), np.inf)))


def _simple(outlines: NDArray) -> NDArray:
    """Which outlines (U,) of (U, N, 2) have an inside and do not cross themselves: only those can be meshed.

    The others, such as a body with a leg drawn across it, can still be keys: the mesh of the first is carried there.
    """
    import shapely

    polygons = shapely.polygons(outlines)
    return shapely.is_valid(polygons) & (shapely.area(polygons) > 1e-9)


def _in_order(found: tuple[int, ...], simple: NDArray) -> tuple[int, ...]:
    """The keys with the first of the `simple` (U,) ones put in front."""
    first = next(k for k in found if simple[k])
    return (first, *_less(found, first))


def _shown(drawn: NDArray, frames: int) -> NDArray:
    """For each frame (T,) which of the drawings, first shown in frames `drawn` (U,), is seen in it."""
    return np.maximum(np.searchsorted(drawn, np.arange(frames), side="right") - 1, 0)


def _more(found: tuple[int, ...], key: int) -> tuple[int, ...]:
    return tuple(sorted((*found, key)))


def _less(found: tuple[int, ...], *gone: int) -> tuple[int, ...]:
    return tuple(k for k in found if k not in gone)


def _check(outlines: NDArray, most_residual: float, most_keys: int) -> None:
    if outlines.ndim != 3 or outlines.shape[1] < 3 or outlines.shape[2] != 2 or not len(outlines):
        raise InputError(
            "outlines must come as (frames, points, 2), with 3 points or more that correspond from frame to frame, "
            f"got an array of shape {outlines.shape}"
        )
    if not np.isfinite(outlines).all():
        frame = int(np.flatnonzero(~np.isfinite(outlines).all(axis=(1, 2)))[0])
        raise InputError(
            f"the points of an outline must be finite numbers, those of frame {frame} are not: leave it out"
        )
    if not most_residual > 0:
        raise InputError(f"the residual asked for must be above 0 pixels, got {most_residual:g}; try 1")
    if most_keys < 1:
        raise InputError(f"there must be room for at least 1 key, got {most_keys}")
