"""Follow-through: sub-joints hang on springs behind where the motion wants them (Kwon & Lee 2008, section 5.3).

    x'' = -k (x - y) - c (x' - y') + links        anchored to the exaggerated sub-joint y(t)
    links: -(k_l (d - l) + c_l (d' - l')) along the link, with d its length and l that of the exaggerated sub-link

The paper gives no formulas.  Erratum: with drag against the world instead of the anchor the whole body trails behind by
c v / k; with the skeleton's own lengths instead of l(t) the links would undo the exaggeration.

An animator says how quick the swing is (Hz) and how soon it dies away (damping: 0 never, 1 without a swing back).  The
anchor's springs are stepped exactly, with y a cubic between frames, so no stiffness is too great; the links' springs
kick in between, in steps of a length that does not depend on the frame rate.
"""

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from mocap.curves.ends import extended, travel_of
from mocap.rubber import suspended

STEPS = 240
"""Steps a second that links are stepped in, or a multiple of it: all usual frame rates divide it."""

MOST_STEPS = 1920
"""Stiffer links than these steps can follow are made as stiff as they can: nobody sees a swing of 100 Hz."""

REACH = 0.25
"""How far in radians the quickest swing of the links gets in a step: the error of a step goes with its square / 24."""

QUARTER = np.pi / 2
"""How far in radians a sub-joint's own swing gets in a step: near half a round links would push it ever further.

What is quicker than the shortest steps is held so firmly that links do not move it."""


def follow(
    positions: NDArray,
    parents: tuple[int, ...],
    fps: float,
    frequency: NDArray | float = 3.5,
    damping: NDArray | float = 0.4,
    links: float = 1.0,
    blend: NDArray | float | None = None,
    loop: bool = False,
    preroll: float = 0.5,
    travel: NDArray | float | None = None,
) -> NDArray:
    """Sub-joints (T, S, 3) that swing after positions (T, S, 3), the same at any frame rate.

    `frequency` in Hz and `damping` are for all or for each (S,); `links` is how stiff links are, times their lower
    end's anchor.  `blend`, for all or (S,), is how much of the swing is taken: without it nothing at roots and all of
    it at the tip furthest from them.  `preroll` seconds are played first, the motion reflected oddly.  With `loop`
    frame T is frame 0 again, `travel` (3,) further on (as far as the first sub-joint goes, if not given), and the swing
    comes back to where it began.
    """
    away, _ = swing(positions, parents, fps, frequency, damping, links, loop, preroll, travel)
    share = reach(positions, parents) if blend is None else np.broadcast_to(np.asarray(blend, float), len(parents))
    return positions + share[:, None] * away


def reach(positions: NDArray, parents: tuple[int, ...]) -> NDArray:
    """How far sub-joints are from their root along the links (S,), by mean lengths: 0 at roots, 1 where furthest."""
    far = np.zeros(len(parents))
    for child, parent in enumerate(parents):
        if parent >= 0:
            link = positions[:, child] - positions[:, parent]
            far[child] = far[parent] + np.sqrt(np.einsum("td,td->t", link, link)).mean()
    return far / far.max() if far.any() else far


def swing(
    positions: NDArray,
    parents: tuple[int, ...],
    fps: float,
    frequency: NDArray | float = 3.5,
    damping: NDArray | float = 0.4,
    links: float = 1.0,
    loop: bool = False,
    preroll: float = 0.5,
    travel: NDArray | float | None = None,
    compiled: bool = True,
) -> tuple[NDArray, NDArray]:
    """How far (T, S, 3) sub-joints on springs are from their anchors, and how quickly (T, S, 3) that changes."""
    positions = _checked(positions, parents, fps, frequency, damping, links, loop, preroll)
    frames, count, _ = positions.shape
    travel = travel_of(positions[:, 0]) if travel is None else travel
    early = 0 if loop else min(round(preroll * fps), frames - 1)
    anchors = extended(positions, early, int(loop), loop, travel)  # a loop's last interval leads to frame 0
    closed = None
    if loop:
        wide = extended(positions, 2, 3, loop, travel)
        closed = (wide[:2], wide[-2:])
    omega = 2 * np.pi * np.broadcast_to(np.asarray(frequency, float), count)
    zeta = np.broadcast_to(np.asarray(damping, float), count)
    child = np.array([c for c, parent in enumerate(parents) if parent >= 0], int)
    tied = (child, np.array([parents[c] for c in child], int))
    steps, pull, drag = _links(tied, links, omega, zeta, fps)
    spring = _half_step(omega, zeta, 0.5 / (fps * steps))
    run = suspended.compiled() if compiled else suspended.run
    path = (anchors, _slopes(anchors, closed))
    state = np.zeros((2, count, 3))
    if loop:
        for _ in range(_rounds(omega, zeta, frames / fps)):
            before, state = state, run(*path, state, *tied, pull, drag, spring, fps, steps)[:, -1].copy()
            if np.abs(state - before).max() <= 1e-9 * np.abs(state).max():
                break
    away, speed = run(*path, state, *tied, pull, drag, spring, fps, steps)
    return away[early : early + frames], speed[early : early + frames]


def _slopes(anchors: NDArray, closed: tuple[NDArray, NDArray] | None) -> NDArray:
    """How far anchors (T, S, 3) go in a frame, by differences of fourth order; at open ends of third.

    A loop is `closed` by the two frames before and the two after.
    """
    if len(anchors) < 4:
        return np.gradient(anchors, axis=0) if len(anchors) > 1 else np.zeros_like(anchors)
    if closed is None:
        first, last = anchors[:4], anchors[:-5:-1]  # the cubic through four frames goes on
        before, after = ([4 * a - 6 * b + 4 * c - d, 10 * a - 20 * b + 15 * c - 4 * d] for a, b, c, d in (first, last))
        closed = (np.stack(before[::-1]), np.stack(after))
    wide = np.concatenate([closed[0], anchors, closed[1]])
    return (8 * (wide[3:-1] - wide[1:-3]) - (wide[4:] - wide[:-4])) / 12


def _half_step(omega: NDArray, zeta: NDArray, step: float) -> NDArray:
    """What a free suspended particle does in `step` seconds (S, 2, 4), exactly.

    From its offset from the anchor, its speed against it, the anchor's acceleration and what that changes by in a
    second; to offset and speed.  Stiffness scales the speed, so that the matrix stays tame.
    """
    from scipy.linalg import expm

    (found, back) = np.unique(np.stack([omega, zeta]), axis=1, return_inverse=True)
    out = []
    for w, damped in found.T:
        rate = np.zeros((4, 4))
        rate[0, 1], rate[1, 0], rate[1, 1], rate[1, 2], rate[2, 3] = w, -w, -2 * damped * w, -1 / w, 1
        moved = expm(rate * step)[:2]
        out.append(moved * [[1, 1 / w, 1, 1], [w, 1, w, w]])
    return np.array(out)[back.reshape(-1)]


def _links(
    tied: tuple[NDArray, NDArray], links: float, omega: NDArray, zeta: NDArray, fps: float
) -> tuple[int, NDArray, NDArray]:
    """Steps in a frame, and for every link how hard it pulls and drags, each (L,)."""
    child, parent = tied
    pull = links * omega[child] ** 2
    if not pull.any():
        return 1, pull, pull
    drag = 2 * np.minimum(zeta[child], 1) * np.sqrt(pull)
    meet = np.bincount(np.concatenate([child, parent]), minlength=len(omega))
    share = (meet[child] + meet[parent]).max()  # what hangs together swings quicker: Gershgorin's bound
    quickest = max(np.sqrt(pull.max() * share), drag.max() * share)
    wanted = max(quickest / REACH, omega.max() / QUARTER)
    steps = min(STEPS * np.ceil(wanted / STEPS), MOST_STEPS)
    tame = min(2 * REACH * steps / quickest, 1.0)
    in_frame = max(int(np.ceil(steps / fps - 0.01)), 1)
    firm = omega > QUARTER * in_frame * fps
    tame = np.where(firm[child] | firm[parent], 0.0, tame)
    return in_frame, tame**2 * pull, tame * drag


def _rounds(omega: NDArray, zeta: NDArray, period: float) -> int:
    """How many times round a loop until what was there at first is gone."""
    slowest = (omega * np.where(zeta > 1, zeta - np.sqrt(np.maximum(zeta**2 - 1, 0)), zeta)).min()
    return int(np.ceil(25 / (slowest * period)))


def _checked(
    positions: NDArray,
    parents: tuple[int, ...],
    fps: float,
    frequency: NDArray | float,
    damping: NDArray | float,
    links: float,
    loop: bool,
    preroll: float,
) -> NDArray:
    positions = np.ascontiguousarray(positions, float)
    if positions.ndim != 3 or positions.shape[1:] != (len(parents), 3) or not np.isfinite(positions).all():
        raise InputError(
            f"positions must be finite, (x, y, z) a frame for each of the {len(parents)} sub-joints, they came with "
            f"shape {positions.shape}"
        )
    least = 0.01 if loop else 0.0  # without damping a loop never comes round
    asked = [
        ("the frame rate", fps, 1e-3, 1e6),
        ("the frequency of a swing, in Hz,", frequency, 1e-3, 1e6),
        ("the damping of a swing" + " that loops" * loop, damping, least, 1e3),
        ("the stiffness of links, times their anchors',", links, 0, 1e12),
        ("the pre-roll, in seconds,", preroll, 0, 1e3),
    ]
    for name, came, low, high in asked:
        if not _within(came, low, high):
            raise InputError(f"{name} must be between {low:g} and {high:g}, got {came}: leave it out for the usual")
    return positions


def _within(numbers: NDArray | float, least: float, most: float) -> bool:
    return bool(np.all((np.asarray(numbers) >= least) & (np.asarray(numbers) <= most)))
