"""A is to A' as B is to B' (Wu et al. 2008): what was done to one motion, done to another."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from mocap.analogy import align, cycles, rhythm, transfer
from mocap.analogy import curves as curving
from mocap.analogy.curves import Curves
from mocap.analogy.feet import meant, standing
from mocap.skeleton import SkeletonMotion


@dataclass(frozen=True)
class Knobs:
    """How much of the analogy is made."""

    style: float = 1.0  # 0 is B, 1 is B', beyond it more
    keep: float = transfer.KEEP  # how strongly B's own way of moving is kept
    space: bool = True  # how it moves ...
    time: bool = True  # ... and when
    only: tuple[str, ...] = ()  # owners (joints, parts) whose channels change; all by default
    on: tuple[str, ...] = ()  # owners whose channels say which frame is which; all that move by default
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
    when: NDArray  # (T_B,) the frame of B' in which each of B's frames comes
    to_one: NDArray  # (T_B,) the frame of A that answers each of B's; A as it was repeated
    to_two: NDArray  # (T_B,) the same of A'
    changed: tuple[str, ...]  # owners whose channels the analogy was made on
    notes: tuple[str, ...]


def analogy(one: SkeletonMotion, two: SkeletonMotion, three: SkeletonMotion, knobs: Knobs = ALL) -> SkeletonMotion:
    """The motion B' on B's skeleton: `two` is to `one` as it is to `three`; all upright, in metres.

    Joints are matched by name, whatever prefix they carry; sizes are told in the length of the skeleton.  What has no
    match stays as in B.  `notes` say what was matched and repeated.
    """
    made, start = skeleton_curves(one, two, three, knobs)
    moved = curving.to_skeleton(made.curves, start, three)
    if knobs.feet:
        moved = standing(moved, *meant(moved, three, made.when))
    return replace(moved, notes=made.notes)


def skeleton_curves(
    one: SkeletonMotion, two: SkeletonMotion, three: SkeletonMotion, knobs: Knobs = ALL
) -> tuple[Made, curving.Start]:
    """What `analogy` makes before it becomes a skeleton again, and where B sets off."""
    from mocap.analogy.match import renamed

    for name, motion in (("A", one), ("A'", two), ("B", three)):
        if not (np.isfinite(motion.rotation).all() and np.isfinite(motion.translation).all()):
            raise InputError(f"{name} must hold finite numbers, it holds others: mend the file")
    goal, start = curving.of_skeleton(three)
    size = three.skeleton.lengths().sum()
    told, notes = [], []
    for name, motion in (("A", one), ("A'", two)):
        named, note = renamed(motion, three)
        notes.append(f"{name}: {note}")
        own, _ = curving.of_skeleton(named, _near(named, three))
        told.append(_sized(own, size / named.skeleton.lengths().sum()))
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
            f"the motions must share joints or parts, these share none: A has {_some(one.owners)}, "
            f"A' {_some(two.owners)}, B {_some(three.owners)}: rename them alike"
        )
    picked = [np.array([names_of.index(name) for name in shared]) for names_of in map(_listed, (one, two, three))]
    values = [curve.values[:, columns] for curve, columns in zip((one, two, three), picked)]
    telling = _telling(shared, values, knobs.on)
    covering, free, notes = _covering(values, telling, fps, knobs)
    to = []
    for curve, spare in zip(covering, free):
        found = align.align(_features(curve, telling), _features(values[2], telling), knobs.slope, spare)
        to.append(align.time_curve(found.pairs, len(three), fps))
    lent = [curving.sampled(curve, at) for curve, at in zip(covering, to)]
    mixed = lent[0] + knobs.style * (lent[1] - lent[0])
    chosen = [k for k, (owner, _) in enumerate(shared) if not knobs.only or owner in knobs.only]
    if not chosen:
        raise InputError(
            f"only must name joints or parts of B, it names {_some(knobs.only)}: B has {_some(three.owners)}"
        )
    result = three.values.copy()
    if knobs.space:
        told = (curve[:, chosen] for curve in (lent[0], mixed, values[2]))
        result[:, picked[2][chosen]] = transfer.transferred(*told, fps, knobs.keep)
    when = np.arange(len(three), dtype=float)
    if knobs.time:
        when = rhythm.rhythm(to[0], to[1], knobs.style)
        result = rhythm.retimed(result, when)
    changed = tuple(dict.fromkeys(shared[k][0] for k in chosen))
    return Made(replace(three, values=result), when, to[0], to[1], changed, tuple(notes))


def _covering(
    values: Sequence[NDArray], telling: NDArray, fps: float, knobs: Knobs
) -> tuple[list[NDArray], list[tuple[int, int]], list[str]]:
    """A and A' as they are where A covers B; else one cycle of each, as often as B has cycles.

    With them, how many frames may be left out at their ends, and what was done.
    """
    spare, most = round(knobs.free * fps), knobs.slope
    given = list(values[:2]), [(spare, spare)] * 2, []
    if not knobs.turn:
        return given
    own = [cycles.period(_features(curve, telling), fps) for curve in values]
    fits = [len(curve) <= most * len(values[2]) and len(values[2]) <= most * len(curve) for curve in values[:2]]
    if all(fits) and not (own[0] and own[2] and abs(len(values[0]) / own[0] - len(values[2]) / own[2]) > 0.5):
        return given
    own = [period or cycles.loop(_features(curve, telling), fps) for period, curve in zip(own, values)]
    if not own[0] or not own[1]:
        return given  # the alignment says what does not fit
    times = max(1, round(len(values[2]) / (own[2] or own[0])))
    turned = [
        cycles.repeated(cycles.cut(curve, period), (times + 1) * period) for curve, period in zip(values, own[:2])
    ]
    seconds = " and ".join(f"{period / fps:.2f} s" for period in own[:2])
    return (
        turned,
        [(period, period) for period in own[:2]],
        [f"A and A' come round every {seconds}; one cycle of each was repeated {times} times to cover B"],
    )


def _telling(shared: Sequence[tuple[str, str]], values: Sequence[NDArray], on: Sequence[str]) -> NDArray:
    """How much each shared channel (C,) says about which frame is which: 0 what is not asked or does not move.

    A joint near the root swings what hangs on it: a channel weighs by how much it moves in the stillest of the motions.
    """
    unknown = set(on) - {owner for owner, _ in shared}
    if unknown:
        raise InputError(
            f"the motions must share the joints that align them, they do not share {_some(unknown)}: "
            f"they share {_some([owner for owner, _ in shared])}"
        )
    moves = np.min([curve.std(axis=0) for curve in values], axis=0)
    asked = np.array([owner in on if on else kind.startswith("turn ") or kind == "height" for owner, kind in shared])
    if not (asked & (moves > 0)).any():
        asked = np.ones(len(shared), bool)
    weight = np.where(asked, moves, 0.0)
    return weight / weight.max() if weight.max() > 0 else asked.astype(float)


def _features(values: NDArray, telling: NDArray) -> NDArray:
    """Channels (T, C) without their own mean and size, so that a strong and a weak step are the same step."""
    spread = values.std(axis=0)
    return (values - values.mean(axis=0)) / np.where(spread > 1e-9, spread, 1.0) * telling


def _sized(curves: Curves, factor: float) -> Curves:
    """Lengths of the root's way, for a skeleton so many times as large."""
    far = np.array([kind in ("ahead", "aside", "height") for kind in curves.kinds])
    return replace(curves, values=np.where(far, factor, 1.0) * curves.values)


def _near(motion: SkeletonMotion, goal: SkeletonMotion) -> NDArray:
    """The turns (J, 3) that the first frame should be near: those of B's joints of the same names."""
    first = dict(zip(goal.skeleton.names, curving.first_turns(goal)))
    own = curving.first_turns(motion)
    return np.stack([first.get(name, turn) for name, turn in zip(motion.skeleton.names, own)])


def _check(one: Curves, two: Curves, three: Curves) -> None:
    for name, curve in (("A", one), ("A'", two), ("B", three)):
        if len(curve) < 2:
            raise InputError(f"{name} must have two frames or more, it has {len(curve)}: take a longer clip")
        if not np.isfinite(curve.values).all():
            bad = sorted({curve.owners[c] for c in np.flatnonzero(~np.isfinite(curve.values).all(axis=0))})
            raise InputError(f"{name} must hold finite numbers, {_some(bad)} holds others: mend the file")


def _listed(curves: Curves) -> list[tuple[str, str]]:
    return list(curves.named())


def _some(names: Sequence[str]) -> str:
    """A few names for a sentence."""
    names = list(dict.fromkeys(names))
    return ", ".join(names[:6]) + (f" and {len(names) - 6} more" if len(names) > 6 else "")
