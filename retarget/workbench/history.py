"""Undo and redo: states are frozen, so the past is a list of them.

Changes of one gesture, such as all the places that a dragged point comes through, are one step.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

from retarget.workbench.state import State

STEPS = 200  # that can be undone


class Step(NamedTuple):
    """What was done, in words, and the state from before or after it."""

    label: str
    state: State


@dataclass(frozen=True, eq=False)
class History:
    """The state, and what lies before and after it."""

    state: State
    past: tuple[Step, ...] = ()  # the latest is last
    future: tuple[Step, ...] = ()  # the next is last
    gesture: str = ""  # that the latest step belongs to


def done(history: History, state: State, label: str, gesture: str = "") -> History:
    """With a new state; within one gesture the step is the one that began it."""
    if state is history.state:
        return history
    if state.name != history.state.name or state.folder != history.state.folder:
        return History(state)  # another piece of work has a past of its own
    if gesture and gesture == history.gesture:
        return replace(history, state=state, future=())
    return History(state, (*history.past, Step(label, history.state))[-STEPS:], (), gesture)


def base(history: History, gesture: str = "") -> State:
    """The state that an action acts on: of one in a gesture, the state from before that gesture began.

    So the end of a drag does not depend on how many of its places came through.
    """
    return history.past[-1].state if gesture and gesture == history.gesture else history.state


def undo(history: History) -> History:
    """One step back; as it was where there is none."""
    if not history.past:
        return history
    label, state = history.past[-1]
    return History(state, history.past[:-1], (*history.future, Step(label, history.state)))


def redo(history: History) -> History:
    """One step forward again; as it was where there is none."""
    if not history.future:
        return history
    label, state = history.future[-1]
    return History(state, (*history.past, Step(label, history.state)), history.future[:-1])
