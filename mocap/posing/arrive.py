"""Arriving on the beat: elastic joints set out early enough to be in a posture when its beat sounds.

Angles x follow their target a as Chen et al.'s elastic joints do (eq. 14, the target entering as torque k a):

    x'' + 2 zeta w x' + w^2 (x - a) = 0,   w = sqrt(k / m),  zeta = c / (2 sqrt(k m))

From a moment to a later one that is linear, with P and Q known in closed form: x - a = P(t) (x0 - a) + Q(t) v0.  So a
move sets out as early as its spring needs to come near (within NEAR of the way), and towards such a target that at the
beat it is exactly there, whatever still swings; from the beat on the target is the posture itself.  Nothing is stepped
through frames: what is shown does not depend on their rate.
"""

import numpy as np
from numpy.typing import NDArray

NEAR = 0.02
"""How much of a move may be left when its spring's own time is over; the aim takes care of that."""

KEPT = 0.045
"""Seconds that a posture is kept at least, so that the frame nearest to the beat shows it."""

BRIEFEST = 0.12
"""Seconds that a move takes at least, however long the posture before it is to be held."""


def arriving(
    goals: NDArray,
    when: NDArray,
    at: NDArray,
    frequency: NDArray | float = 2.2,
    damping: NDArray | float = 0.8,
    hold: NDArray | float = 0.0,
    start: NDArray | None = None,
) -> NDArray:
    """Curves (T, n) at moments `at` (T,) seconds, that are at goals (M, n) at the moments `when` (M,), rising.

    `frequency` in hertz and `damping` (1 does not swing, below it overshoots) are a number or (n,).  A posture is held
    for `hold` seconds, a number or (M,), before the move to the next may begin.  Springs too soft for the time they
    have are stiffer for that move.  At moment 0 the curves are at `start` (n,), zeros if not given, and at rest; a goal
    at moment 0 or before is where they start.
    """
    goals, when, at = np.asarray(goals, float), np.asarray(when, float), np.asarray(at, float)
    frequency, damping = (np.broadcast_to(value, goals.shape[1:]).astype(float) for value in (frequency, damping))
    hold = np.maximum(np.broadcast_to(hold, when.shape), KEPT)
    needed = settling(damping)
    before = np.flatnonzero(when <= 0)
    first = before[-1] + 1 if len(before) else 0
    place = np.zeros(goals.shape[1]) if start is None else np.asarray(start, float)
    place = goals[first - 1] if first else place
    speed, target, here = np.zeros_like(place), place, np.zeros_like(place)  # `here`: since when each curve's part runs
    stiff = 2 * np.pi * frequency
    free = when[first - 1] + hold[first - 1] if first else 0.0
    curves, shown = np.empty((len(at), len(place))), 0
    for move in range(first, len(when)):
        earlier = when[move - 1] if move else 0.0
        room = when[move] - np.clip(free, max(earlier, 0.0), max(earlier, when[move] - BRIEFEST, 0.0))
        w = np.maximum(2 * np.pi * frequency, needed / room)
        leave = when[move] - needed / w
        stop = shown + np.searchsorted(at[shown:], when[move])
        early = at[shown:stop, None] < leave
        waits = _swung(place, speed, target, stiff, damping, np.where(early, at[shown:stop, None] - here, 0.0))[0]
        place, speed = _swung(place, speed, target, stiff, damping, leave - here)
        p, q, _, _ = response(w, damping, when[move] - leave)
        target = (goals[move] - p * place - q * speed) / (1 - p)
        goes = _swung(place, speed, target, w, damping, np.where(early, 0.0, at[shown:stop, None] - leave))[0]
        curves[shown:stop] = np.where(early, waits, goes)
        place, speed = _swung(place, speed, target, w, damping, when[move] - leave)
        target, stiff, here, shown = goals[move], w, np.full_like(place, when[move]), stop
        free = when[move] + hold[move]
    curves[shown:] = _swung(place, speed, target, stiff, damping, at[shown:, None] - here)[0]
    return curves


def settling(damping: NDArray, near: float = NEAR) -> NDArray:
    """w t (n,) after which a spring let go at rest stays within a share `near` of the way from its target."""
    damping = np.asarray(damping, float)
    longest = (4 + np.log(1 / near)) * np.max(np.maximum(1 / damping, 2 * damping))
    moments = np.linspace(0, longest, 4000)
    left = np.abs(response(1.0, damping.reshape(-1, 1), moments)[0])
    last = len(moments) - 1 - np.argmax(left[:, ::-1] > near, axis=1)
    return moments[np.minimum(last + 1, len(moments) - 1)].reshape(damping.shape)


def response(w: NDArray | float, damping: NDArray, seconds: NDArray) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """P, Q and their slopes after some seconds: x - a = P (x0 - a) + Q v0, x' = P' (x0 - a) + Q' v0."""
    w, damping, seconds = np.broadcast_arrays(w, damping, seconds)
    root = w * np.sqrt(np.abs(1 - damping**2))
    small = root * seconds < 1e-6  # no swing, or critically damped: sin(x) / x is 1
    swing = damping < 1
    angle = np.minimum(root * seconds, 300.0)
    fade = np.exp(-damping * w * seconds)
    with np.errstate(over="ignore"):
        # beyond the critical damping cosh and sinh grow while fade falls: taken together, they do not overflow
        grow, fall = np.exp((root - damping * w) * seconds), np.exp(-(root + damping * w) * seconds)
    cos = np.where(swing, fade * np.cos(angle), 0.5 * (grow + fall))
    sin = np.where(swing, fade * np.sin(angle), 0.5 * (grow - fall))
    over = np.where(small, fade * seconds, sin / np.where(small, 1.0, root))
    p, q = cos + damping * w * over, over
    return p, q, -w * w * over, cos - damping * w * over


def _swung(
    place: NDArray, speed: NDArray, target: NDArray, w: NDArray, damping: NDArray, seconds: NDArray
) -> tuple[NDArray, NDArray]:
    """Where curves (n,) that follow their targets are after some seconds, and how fast they go."""
    p, q, slope_p, slope_q = response(w, damping, seconds)
    away = place - target
    return target + p * away + q * speed, slope_p * away + slope_q * speed
