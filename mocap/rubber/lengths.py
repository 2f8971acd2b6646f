"""Links that were stretched too far are brought back towards their length (Kwon & Lee 2008, section 4.2).

`lengths` (J,) are those at rest, in metres.  Links of length 0, and joints that hang on none, have no ratio: they go
along with their parent as they are.
"""

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError


def ratios(positions: NDArray, parents: tuple[int, ...], lengths: NDArray) -> NDArray:
    """How long the link above each joint of (T, J, 3) is, times its length at rest (T, J); 1 where it has none."""
    links = _links(parents, lengths)
    ratio = np.ones(positions.shape[:2])
    ratio[:, links] = _norm(positions[:, links] - positions[:, np.array(parents)[links]]) / lengths[links]
    return ratio


def clamped(
    positions: NDArray,
    parents: tuple[int, ...],
    lengths: NDArray,
    least: float = 1.0,
    most: float = 1.0,
    soft: float = 0.0,
) -> NDArray:
    """Places (T, J, 3) whose links are at least `least` and at most `most` times their length, in one pass.

    From the root outwards each link keeps its direction.  With `soft`, 0 to 1, the last so much of the way to a bound
    is taken ever more slowly, so that a limb that reaches it does not stop dead.
    """
    ratio = bounded(ratios(positions, parents, lengths), least, most, soft)
    return stretched(positions, parents, lengths, ratio)


def bounded(ratio: NDArray, least: float, most: float, soft: float = 0.0) -> NDArray:
    """Ratios (T, J) kept between `least` and `most`; in their logarithms, half as long is as far as twice as long."""
    if not (0 < least <= 1 <= most < np.inf and 0 <= soft <= 1):
        raise InputError(
            f"links may be 0 < least <= 1 <= most times their length, softly 0 to 1, they came as {least:g}, {most:g} "
            f"and {soft:g}: choose others"
        )
    return np.exp(_slowed(np.log(np.maximum(ratio, 1e-9)), np.log(least), np.log(most), soft))


def stretched(positions: NDArray, parents: tuple[int, ...], lengths: NDArray, ratio: NDArray) -> NDArray:
    """Places (T, J, 3) whose links have their directions, and are `ratio` (T, J) times as long as at rest."""
    result = np.array(positions, float)
    there = set(_links(parents, lengths).tolist())
    for joint, parent in enumerate(parents):
        if parent < 0:
            continue
        way = positions[:, joint] - positions[:, parent]
        if joint in there:  # a link that is a point in some frame has no direction: it stays one
            way = way * (ratio[:, joint] * lengths[joint] / np.maximum(_norm(way), 1e-12))[:, None]
        result[:, joint] = result[:, parent] + way
    return result


def corrected(
    positions: NDArray,
    parents: tuple[int, ...],
    lengths: NDArray,
    threshold: float = 0.0,
    delta: float = 0.5,
    rounds: int = 500,
) -> NDArray:
    """The paper's own way (Fig. 4): in every round all joints go a little towards their parents, all at once.

    A frame is done when its links are off by at most `threshold` metres on average.  Erratum: Fig. 4 measures by the
    rest length alone, which never halts and collapses the body; a link's error is |w| - |v|, and the frame's is summed
    over absolute values.
    """
    result = np.array(positions, float)
    links = _links(parents, lengths)
    above, rest = np.array(parents)[links], lengths[links]
    carried = [joint for joint, parent in enumerate(parents) if parent >= 0 and joint not in set(links.tolist())]
    busy = np.arange(len(result) if len(links) else 0)
    for _ in range(rounds):
        w = result[np.ix_(busy, above)] - result[np.ix_(busy, links)]
        length = _norm(w)
        off = (1 - delta) * np.abs(length - rest).mean(axis=1) > threshold
        busy, w, length = busy[off], w[off], length[off]
        if not len(busy):
            break
        result[np.ix_(busy, links)] += (delta * (length - rest) / np.maximum(length, 1e-12))[..., None] * w
        for joint in carried:
            way = positions[busy, joint] - positions[busy, parents[joint]]
            result[busy, joint] = result[busy, parents[joint]] + way
    return result


def _slowed(value: NDArray, low: float, high: float, soft: float) -> NDArray:
    """Values kept between bounds; with `soft` they near them as 1 - exp(-x) nears 1."""
    if soft < 1e-6:  # no room to slow down in
        return np.clip(value, low, high)
    result = np.array(value)
    for bound, sign in ((high, 1.0), (-low, -1.0)):
        knee, room = bound * (1 - soft), bound * soft
        over = sign * value > knee
        if room > 0:
            result[over] = sign * (knee - room * np.expm1(-(sign * value[over] - knee) / room))
        else:
            result[over] = sign * bound
    return result


def _links(parents: tuple[int, ...], lengths: NDArray) -> NDArray:
    """The joints that a link of some length lies above."""
    return np.flatnonzero((np.array(parents) >= 0) & (lengths > 0))


def _norm(vectors: NDArray) -> NDArray:
    return np.sqrt(np.einsum("...i,...i", vectors, vectors))
