"""A is to A' as B is to B' (Wu et al. 2008): what was done to one motion, done to another."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from mocap.analogy import align, cover, rhythm, transfer
from mocap.analogy import curves as curving
from mocap.analogy.carry import carried, grounded
from mocap.analogy.cover import some
from mocap.analogy.curves import Curves
from mocap.analogy.feet import calm, meant, slide, standing
from mocap.skeletons.skeleton import SkeletonMotion

ROUNDS = 5
"""Feet made to stand stand in other frames than before: so often it is looked whether they do as well as B's."""


@dataclass(frozen=True)
class Knobs:
    """How much of the analogy is made."""

    style: float = 1.0  # 0 is B, 1 is B', beyond it more
    keep: float = transfer.KEEP  # how strongly B's own way of moving is kept
    space: bool = True  # how it moves ...
    time: bool = True  # ... and when
    only: tuple[str, ...] = ()  # joints or parts of the body that change; all by default
    on: tuple[str, ...] = ()  # those that say which frame is which; all that move by default
    slope: int = align.SLOPE
    free: float = 0.0  # seconds of A and A' that may be left out at their starts and ends
    turn: bool = True  # repeat what comes round until it covers B
    feet: bool = True  # feet that stand do not slide; for skeletons


ALL = Knobs()
"""The whole analogy."""


@dataclass(frozen=True, eq=False)
class Made:
    """The curves of B', and how they came about."""

    curves: Curves
    moments: NDArray  # (T_B', 3) the frames of A, A' and B, at B's rate, that each of its frames comes of
    changed: tuple[str, ...]  # owners whose channels are not B's
    notes: tuple[str, ...]


def analogy(one: SkeletonMotion, two: SkeletonMotion, three: SkeletonMotion, knobs: Knobs = ALL) -> SkeletonMotion:
    """The motion B' on B's skeleton: `two` is to `one` as it is to `three`; all upright, in metres.

    Joints are matched by name, whatever prefix they carry; sizes are told in the length of the skeleton.  What has no
    match stays as in B.  `notes` say what was matched and repeated.
    """
    made, start = skeleton_curves(one, two, three, knobs)
    moved = curving.to_skeleton(made.curves, start, three)
    if knobs.feet:
        moved = _on_its_feet(moved, one, two, three, made, knobs)
    return replace(moved, notes=made.notes)


def _on_its_feet(
    moved: SkeletonMotion,
    one: SkeletonMotion,
    two: SkeletonMotion,
    three: SkeletonMotion,
    made: Made,
    knobs: Knobs,
) -> SkeletonMotion:
    """B' carried by the feet that are meant to stand, which then stand as well as those of B."""
    others = (one, two) if knobs.style > 0.5 else (three, three)  # half a style: it is still B that walks
    feet, stand, heights = meant(*others, three, made.moments, made.changed)
    if not feet:
        return moved
    as_well = slide(three)
    moved = grounded(carried(moved, feet, stand, max(slide(two), as_well)), feet, stand, heights)
    aim = as_well
    for _ in range(ROUNDS):
        now_stand = calm(moved, feet, stand)
        moved = standing(moved, feet, now_stand, aim, np.where(stand, heights, moved.positions()[:, feet, 1]))
        now = slide(moved)
        if now <= as_well:
            break
        aim *= as_well / now
    return moved


def skeleton_curves(
    one: SkeletonMotion, two: SkeletonMotion, three: SkeletonMotion, knobs: Knobs = ALL
) -> tuple[Made, curving.Start]:
    """What `analogy` makes before it becomes a skeleton again, and where B sets off."""
    from mocap.analogy.lend import lent
    from mocap.analogy.match import called

    for name, motion in (("A", one), ("A'", two), ("B", three)):
        if not (np.isfinite(motion.rotation).all() and np.isfinite(motion.translation).all()):
            raise InputError(f"{name} must hold finite numbers, it holds others: mend the file")
    neutral = curving.neutral(three)
    goal, start = curving.of_skeleton(three, neutral)
    told, notes = [], []
    for name, motion in (("A", one), ("A'", two)):
        named, note = lent(motion, three, one)
        notes.append(f"{name}: {note}")
        own, _ = curving.of_skeleton(named, neutral, curving.first_turns(three, neutral))
        told.append(own)
    knobs = replace(knobs, only=called(knobs.only, three), on=called(knobs.on, three))
    made = curve_analogy(told[0], told[1], goal, knobs)
    return replace(made, notes=(*notes, *made.notes)), start


def curve_analogy(one: Curves, two: Curves, three: Curves, knobs: Knobs = ALL) -> Made:
    """The same of any curves; channels are matched by owner and kind, at B's frame rate."""
    _check(one, two, three)
    fps = three.fps
    one, two = (curving.at_rate(curve, fps) for curve in (one, two))
    names = three.named()
    shared = [name for name in names if name in set(one.named()) & set(two.named())]
    if not shared:
        raise InputError(
            f"the motions must share joints or parts, these share none: A has {some(one.owners)}, "
            f"A' {some(two.owners)}, B {some(three.owners)}: rename them alike"
        )
    picked = [np.array([names_of.index(name) for name in shared]) for names_of in map(_listed, (one, two, three))]
    values = [curve.values[:, columns] for curve, columns in zip((one, two, three), picked)]
    weight = cover.telling(shared, values, knobs.on)
    covers, notes = cover.covering(values, weight, fps, knobs.slope, knobs.free, knobs.turn)
    to = []
    for covering in covers:
        own, goal = cover.features(covering.values, weight), cover.features(values[2], weight)
        found = align.align(own, goal, knobs.slope, (covering.spare, covering.spare))
        to.append(align.time_curve(found.pairs, len(three), fps))
    chosen = [k for k, (owner, _) in enumerate(shared) if not knobs.only or owner in knobs.only]
    if not chosen:
        raise InputError(
            f"only must name joints or parts of B, it names {some(knobs.only)}: B has {some(three.owners)}"
        )
    when = rhythm.rhythm(*to, knobs.style) if knobs.time else np.arange(len(three), dtype=float)
    here = rhythm.moments(when)
    result = curving.sampled(three.values, here)
    if knobs.space:
        far = [shared[k][1] in curving.RATES for k in chosen]
        told = [(covering.values[:, chosen], at) for covering, at in zip(covers, to)]
        result[:, picked[2][chosen]] = _told(told, values[2][:, chosen], here, far, fps, knobs)
    rates = np.isin(three.kinds, curving.RATES)
    result[:, rates] /= np.interp(here, np.arange(len(three)), rhythm.pace(when, fps))[:, None]
    frames = [
        covering.frames[np.round(_between(at, here)).astype(int).clip(0, len(covering.frames) - 1)]
        for covering, at in zip(covers, to)
    ]
    changed = tuple(dict.fromkeys(shared[k][0] for k in chosen)) if knobs.space else ()
    return Made(replace(three, values=result), np.stack([*frames, here], axis=-1), changed, tuple(notes))


def _told(
    told: Sequence[tuple[NDArray, NDArray]], three: NDArray, here: NDArray, far: NDArray, fps: float, knobs: Knobs
) -> NDArray:
    """Channels (T_B', C) of B', in B's time where they are `far` (C,): lengths of steps, and turns, in one frame of B.

    `told` are the channels of A and of A' and the time curve of each.  The scale is found in B's time, but A, A' and B
    are taken where a frame of B' comes from: resampled once, not twice, no quick move of A' is lost.
    """
    same, there = [], []
    for values, at in told:
        rate = np.where(far, rhythm.pace(at, fps)[:, None], 1.0)
        same.append(curving.sampled(values, at) * rate)
        there.append(curving.sampled(values, _between(at, here)) * curving.sampled(rate, here))
    for pair in (same, there):
        pair[1] = pair[0] + knobs.style * (pair[1] - pair[0])
    scale, _ = transfer.model(*same, fps, knobs.keep)
    held = np.where(far, 0.0, transfer.holding(scale, *same, three))  # to stand still is no speed, whoever goes
    return transfer.transferred(curving.sampled(scale, here), *there, curving.sampled(three, here), held)


def _between(at: NDArray, here: NDArray) -> NDArray:
    """A time curve (m,) at frames that may lie between its own."""
    return np.interp(here, np.arange(len(at)), at)


def _check(one: Curves, two: Curves, three: Curves) -> None:
    for name, curve in (("A", one), ("A'", two), ("B", three)):
        if len(curve) < 2:
            raise InputError(f"{name} must have two frames or more, it has {len(curve)}: take a longer clip")
        if not np.isfinite(curve.values).all():
            bad = sorted({curve.owners[c] for c in np.flatnonzero(~np.isfinite(curve.values).all(axis=0))})
            raise InputError(f"{name} must hold finite numbers, {some(bad)} holds others: mend the file")


def _listed(curves: Curves) -> list[tuple[str, str]]:
    return list(curves.named())
