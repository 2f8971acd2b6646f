"""Arriving on the beat: elastic joints set out early enough to be in a posture when its beat sounds.

From a moment to a later one an elastic joint (`elastic.step`) is linear in its target.  So a move sets out as early as
its springs need to come near (NEAR of the way), and towards such a target that at the beat it is exactly there,
whatever still swings; from the beat on the target is the posture itself.  Nothing is stepped through frames: what is
shown does not depend on their rate.
"""

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from mocap.posing.elastic import Elastic, State, arrival, step, still

NEAR = 0.02
"""How much of a move may be left when its springs' own time is over; the aim takes care of that."""

KEPT = 0.045
"""Seconds that a posture is kept at least, so that the frame nearest to the beat shows it."""

BRIEFEST = 0.12
"""Seconds that a move takes at least, however long the posture before it is to be held."""


def arriving(springs: Elastic, at: NDArray, when: NDArray, postures: NDArray, hold: NDArray | float = 0.0) -> NDArray:
    """How J joints are turned (T, J, 3) at moments `at` (T,): by postures (M, J, 3) at the moments `when` (M,), rising.

    All in seconds.  The springs are one for all joints; too soft ones are stiffer for a move that has too little time.
    A posture is held for `hold` seconds, a number or (M,), before the move to the next may begin.  Joints are at rest
    at moment 0, in the last posture of those at moment 0 or before if there is one.
    """
    at, when, postures = np.asarray(at, float), np.asarray(when, float), np.asarray(postures, float)
    if not (np.diff(when) > 0).all():
        raise InputError(f"the moments of postures must rise, got {when[:6].tolist()}: sort them, one posture each")
    free = when + np.maximum(hold, KEPT)
    first = np.searchsorted(when, 0, side="right")  # the first that is moved to
    needed = float(arrival(springs, NEAR))
    state = still(postures[first - 1] if first else np.zeros(postures.shape[1:]))
    target, since, own = state.turns, 0.0, springs
    turns, shown = np.empty((len(at), *postures.shape[1:])), 0

    def show(until: float) -> None:
        nonlocal shown
        stop = shown + int(np.searchsorted(at[shown:], until))
        turns[shown:stop] = step(own, state, at[shown:stop] - since, target).turns
        shown = stop

    for move in range(first, len(when)):
        begins = max(when[move - 1], 0.0) if move else 0.0
        begins = max(begins, min(free[move - 1] if move else 0.0, when[move] - BRIEFEST))
        leave = max(begins, when[move] - needed)
        show(leave)
        state = step(own, state, leave - since, target)
        seconds, since, own = when[move] - leave, leave, _stiffer(springs, needed / (when[move] - leave))
        target = _aim(own, state, seconds, postures[move])
        show(when[move])
        state, target, since = step(own, state, seconds, target), postures[move], when[move]
    show(np.inf)
    return turns


def _aim(springs: Elastic, state: State, seconds: float, goal: NDArray) -> NDArray:
    """The target (J, 3) with which joints are at a goal (J, 3) after some seconds."""
    passed = step(springs, state, seconds, 0.0).turns
    effect = step(springs, still(np.zeros((1, 3))), seconds, 1.0).turns
    return (goal - passed) / effect


def _stiffer(springs: Elastic, quicker: float) -> Elastic:
    """Springs that swing so many times as quick, and die away alike."""
    return (
        Elastic(springs.inertia, springs.damping * quicker, springs.stiffness * quicker**2) if quicker > 1 else springs
    )
