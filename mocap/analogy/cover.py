"""What two motions are aligned by, and clips that come round repeated until they cover a third."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from mocap.analogy import cycles


@dataclass(frozen=True, eq=False)
class Cover:
    """A motion as it is aligned with B."""

    values: NDArray  # (n, C) its shared channels, one after the other as often as it comes round
    frames: NDArray  # (n,) the frames of the motion, at B's rate, that these are
    spare: int  # so many frames may be left out at the start and at the end


def covering(
    values: Sequence[NDArray], weight: NDArray, fps: float, slope: int, free: float, turn: bool
) -> tuple[list[Cover], list[str]]:
    """A and A' of `values` (A, A' and B) as they are where A covers B; else a cycle of each, as often as B has cycles.

    And what was done, if anything was.
    """
    plain = [Cover(curve, np.arange(len(curve)), round(free * fps)) for curve in values[:2]]
    if not turn:
        return plain, []
    own = [cycles.period(features(curve, weight), fps) for curve in values]
    fits = [len(curve) <= slope * len(values[2]) and len(values[2]) <= slope * len(curve) for curve in values[:2]]
    if all(fits) and not (own[0] and own[2] and abs(len(values[0]) / own[0] - len(values[2]) / own[2]) > 0.5):
        return plain, []
    own = [period or cycles.loop(features(curve, weight), fps) for period, curve in zip(own, values)]
    if not own[0] or not own[1]:
        return plain, []  # the alignment says what does not fit
    times = max(1, round(len(values[2]) / (own[2] or own[0])))
    turned = []
    for curve, period in zip(values, own[:2]):
        start, cycle = cycles.cut(curve, period)
        count = (times + 1) * period  # one more: the alignment chooses where in the cycle it sets off
        turned.append(Cover(cycles.repeated(cycle, count), start + np.arange(count) % period, period))
    seconds = " and ".join(f"{period / fps:.2f} s" for period in own[:2])
    often = "once" if times == 1 else f"{times} times"
    return turned, [f"A and A' come round every {seconds}; one cycle of each was repeated {often} to cover B"]


def telling(shared: Sequence[tuple[str, str]], values: Sequence[NDArray], on: Sequence[str]) -> NDArray:
    """How much each shared channel (C,) says about which frame is which: 0 what is not asked or does not move.

    A joint near the root swings what hangs on it: a channel weighs by how much it moves in the stillest of the motions.
    """
    unknown = set(on) - {owner for owner, _ in shared}
    if unknown:
        raise InputError(
            f"the motions must share the joints that align them, they do not share {some(sorted(unknown))}: "
            f"they share {some([owner for owner, _ in shared])}"
        )
    moves = np.min([curve.std(axis=0) for curve in values], axis=0)
    asked = np.array([owner in on if on else kind.startswith("turn ") or kind == "height" for owner, kind in shared])
    if not (asked & (moves > 0)).any():
        asked = np.ones(len(shared), bool)
    weight = np.where(asked, moves, 0.0)
    return weight / weight.max() if weight.max() > 0 else asked.astype(float)


def features(values: NDArray, weight: NDArray) -> NDArray:
    """Channels (T, C) without their own mean and size, so that a strong and a weak step are the same step."""
    spread = values.std(axis=0)
    return (values - values.mean(axis=0)) / np.where(spread > 1e-9, spread, 1.0) * weight


def some(names: Sequence[str]) -> str:
    """A few names for a sentence."""
    names = list(dict.fromkeys(names))
    return ", ".join(names[:6]) + (f" and {len(names) - 6} more" if len(names) > 6 else "")
