"""Posing without a screen: what an animator does to a figure, message by message, with everything to be undone.

A message is a plain dictionary, so is its answer, so that any interface can sit on it, in a browser or in a test:

    {"do": "drag", "joint": "RightHand", "to": [x, y, z]}   as often as the pointer moves; "drop" ends the drag
    {"do": "pin" | "unpin", "joint": "LeftFoot"}            without a joint, unpin takes all pins out
    {"do": "keep" | "take" | "forget", "name": "jump"}      keep the posture, go back to a kept one
    {"do": "undo" | "redo" | "look"}
    {"do": "feel", "quick": 2, "damping": 0.7}              how elastic joints are; also "clumsy", "stiff" and "wild"
    {"do": "play", "seconds": 0.5, "fps": 24}               through all kept postures at once, as elastic joints go
    {"do": "next", "seconds": 0.04, "each": 0.5}            live: so much later, on the way round the kept postures
    {"do": "stop"}                                          next begins anew

What it feels like may be changed between one "next" and the other: it swings on from where it is.  All states but that
are kept and none is ever changed: undo is going back in a list.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from capture.errors import InputError
from mocap.posing import elastic, playing, poses, springs, ties
from mocap.posing.limits import JointLimits
from mocap.posing.poses import Pose
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion

FEEL = {"quick": 2.5, "damping": 1.0, "clumsy": 0.0, "stiff": 0.0, "wild": 0.0}
"""How elastic joints are before anybody says so: Hz, a damping ratio, and -1 to 1 (`elastic.styled`)."""


@dataclass(frozen=True, eq=False)
class State:
    """What undo goes back to."""

    pose: Pose
    pinned: tuple[int, ...] = ()
    kept: tuple[tuple[str, Pose], ...] = ()  # named postures, in the order in which they are played


@dataclass
class Session:
    """A figure that is being posed; `begun` makes one."""

    skeleton: Skeleton
    limits: tuple[JointLimits, ...]
    past: list[State]  # the last one is what is seen, unless a joint is being dragged
    future: list[State] = field(default_factory=list)
    held: tuple[int, Pose] | None = None  # the joint that is being dragged, and what has come of it so far
    feel: dict[str, float] = field(default_factory=lambda: dict(FEEL))
    live: playing.Playing | None = None  # where "next" has come to

    def send(self, message: dict[str, Any]) -> dict[str, Any]:
        """Do what a message says and answer with what is seen; a message that cannot be followed changes nothing.

        An answer has "positions" (J lists of x, y, z), "pinned" and "kept" (names), "undo" and "redo" (how often they
        will work), "feel", "error" (a sentence, or nothing), for "play" also "frames" and "fps", for "next" one frame.
        """
        error, more = "", {}
        try:
            what = message.get("do") if isinstance(message, dict) else None
            if not isinstance(what, str) or what not in _DOES:
                raise InputError(f"a message must say what to do, one of {', '.join(_DOES)}, it says {message!r}")
            more = _DOES[what](self, message) or {}
        except InputError as refused:
            error = str(refused)
        return {**self._seen(), **more, "error": error}

    @property
    def now(self) -> State:
        """The state that was last settled: during a drag, that before it."""
        return self.past[-1]

    @property
    def pose(self) -> Pose:
        """The pose that is seen."""
        return self.now.pose if self.held is None else self.held[1]

    def motion(self, seconds: float = 0.5, fps: float = 24.0) -> SkeletonMotion:
        """The kept postures played one after the other; without any, the pose that is seen."""
        return playing.through(self.skeleton, self._played(), seconds, fps, self.springs)

    @property
    def springs(self) -> elastic.Elastic:
        """The elastic joints as they feel now."""
        return _springs(self.feel)

    def _played(self) -> list[Pose]:
        return [pose for _, pose in self.now.kept] or [self.pose]

    def _seen(self) -> dict[str, Any]:
        return {
            "positions": self.pose.positions.tolist(),
            "pinned": [self.skeleton.names[joint] for joint in self.now.pinned],
            "kept": [name for name, _ in self.now.kept],
            "undo": len(self.past) - 1 + (self.held is not None),
            "redo": len(self.future),
            "feel": dict(self.feel),
        }


def begun(skeleton: Skeleton, pose: Pose | None = None, limits: Sequence[JointLimits] = ()) -> Session:
    """A session that begins with a pose, or with the skeleton at rest; InputError for a skeleton in several pieces."""
    ties.tree_of(skeleton.parents, np.asarray(skeleton.offsets, float))
    return Session(skeleton, tuple(limits), [State(poses.rest_of(skeleton) if pose is None else pose)])


def _drag(session: Session, message: dict[str, Any]) -> None:
    """Every move goes on from the one before, so that nothing jumps; springs are at rest where the drag began."""
    joint = _joint(session, message)
    target = _numbers(message, "to", 3)
    if session.held is not None and session.held[0] != joint:
        _drop(session, message)
    now = session.now
    come = None if session.held is None else session.held[1]
    posed = springs.drag(session.skeleton.parents, now.pose, joint, target, now.pinned, session.limits, come=come)
    session.held = (joint, posed)


def _drop(session: Session, _: dict[str, Any]) -> None:
    if session.held is not None:
        pose, session.held = session.held[1], None
        if pose is not session.now.pose:
            _settle(session, replace(session.now, pose=pose))


def _pin(session: Session, message: dict[str, Any]) -> None:
    joint = _joint(session, message)
    _drop(session, message)
    if joint not in session.now.pinned:
        _settle(session, replace(session.now, pinned=(*session.now.pinned, joint)))


def _unpin(session: Session, message: dict[str, Any]) -> None:
    which = {_joint(session, message)} if "joint" in message else set(session.now.pinned)
    _drop(session, message)
    left = tuple(joint for joint in session.now.pinned if joint not in which)
    if left != session.now.pinned:
        _settle(session, replace(session.now, pinned=left))


def _keep(session: Session, message: dict[str, Any]) -> None:
    """A name that is there already gets the new posture in its old place."""
    name = _name(message)
    _drop(session, message)
    kept = dict(session.now.kept) | {name: session.pose}
    _settle(session, replace(session.now, kept=tuple(kept.items())))


def _take(session: Session, message: dict[str, Any]) -> None:
    pose = dict(session.now.kept)[_kept_name(session, message)]
    _drop(session, message)
    _settle(session, replace(session.now, pose=pose))


def _forget(session: Session, message: dict[str, Any]) -> None:
    name = _kept_name(session, message)
    _drop(session, message)
    _settle(session, replace(session.now, kept=tuple(pair for pair in session.now.kept if pair[0] != name)))


def _undo(session: Session, _: dict[str, Any]) -> None:
    """In the middle of a drag, back to where it began."""
    if session.held is not None:
        session.held = None
    elif len(session.past) > 1:
        session.future.append(session.past.pop())
        session.live = None


def _redo(session: Session, message: dict[str, Any]) -> None:
    _drop(session, message)
    if session.future:
        session.past.append(session.future.pop())
        session.live = None


def _look(session: Session, _: dict[str, Any]) -> None:
    """Nothing: the answer says what is seen."""


def _play(session: Session, message: dict[str, Any]) -> dict[str, Any]:
    seconds, fps = (float(_numbers(message, name, 1, usual)[0]) for name, usual in (("seconds", 0.5), ("fps", 24.0)))
    if not 0 < seconds <= 60 or not 1 <= fps <= 240:
        raise InputError(f"a way must take 0 to 60 seconds, at 1 to 240 frames a second, not {seconds} s at {fps}")
    return {"frames": session.motion(seconds, fps).positions().tolist(), "fps": fps}


def _feel(session: Session, message: dict[str, Any]) -> None:
    """Not a matter of undo: it may be changed thirty times a second, by a slider, while the figure plays."""
    unknown = [name for name in message if name != "do" and name not in FEEL]
    if unknown or len(message) < 2:
        raise InputError(f"to feel otherwise say some of {', '.join(FEEL)}, not {', '.join(unknown) or 'nothing'}")
    told = {name: float(_numbers(message, name, 1)[0]) for name in message if name != "do"}
    feel = session.feel | told
    if not all(abs(value) <= 1000 for value in feel.values()) or any(abs(feel[name]) > 4 for name in _STYLES):
        raise InputError(f"{', '.join(_STYLES)} must be -4 to 4, 1 is much; quick and damping are numbers, not {told}")
    _springs(feel)
    session.feel = feel


def _next(session: Session, message: dict[str, Any]) -> dict[str, Any]:
    pace = (("seconds", 1 / 24), ("each", 0.5))
    seconds, each = (float(_numbers(message, name, 1, usual)[0]) for name, usual in pace)
    if not 0 <= seconds <= 60 or not 0.01 <= each <= 60:
        raise InputError(f"next must be 0 to 60 seconds later, and postures last 0.01 to 60, not {seconds} and {each}")
    _drop(session, message)
    live = session.live or playing.begun(session.skeleton, session._played())
    session.live = playing.later(live, session.springs, seconds, each)
    return {"frames": playing.seen(session.live).positions().tolist()}


def _stop(session: Session, _: dict[str, Any]) -> None:
    session.live = None


def _springs(feel: dict[str, float]) -> elastic.Elastic:
    return elastic.styled(elastic.felt(feel["quick"], feel["damping"]), *(feel[name] for name in _STYLES))


def _settle(session: Session, state: State) -> None:
    if state.kept is not session.now.kept:
        session.live = None  # its postures are others now
    session.past.append(state)
    session.future.clear()


def _joint(session: Session, message: dict[str, Any]) -> int:
    return joint_named(session.skeleton, message.get("joint"))


def joint_named(skeleton: Skeleton, name: object) -> int:
    """The joint of a name, or of a number; case does not matter, nor what stands before a colon."""
    if isinstance(name, int) and not isinstance(name, bool) and 0 <= name < len(skeleton):
        return name
    names = list(skeleton.names)
    if isinstance(name, str):
        for plain in (str, str.lower, lambda text: text.lower().rsplit(":", 1)[-1]):
            found = [joint for joint, other in enumerate(names) if plain(other) == plain(name)]
            if len(found) == 1:
                return found[0]
    some = ", ".join(names[:8]) + (", ..." if len(names) > 8 else "")
    raise InputError(f"a joint must be one of {some}, there is no {name!r}")


def _name(message: dict[str, Any]) -> str:
    name = message.get("name")
    if not isinstance(name, str) or not name.strip():
        raise InputError(f"a posture must have a name, it has {name!r}")
    return name.strip()


def _kept_name(session: Session, message: dict[str, Any]) -> str:
    name = _name(message)
    if name not in dict(session.now.kept):
        there = ", ".join(other for other, _ in session.now.kept) or "none yet"
        raise InputError(f"a posture must be kept before it is asked for, there is no {name!r}: kept are {there}")
    return name


def _numbers(message: dict[str, Any], name: str, count: int, usual: float | None = None) -> np.ndarray:
    """So many numbers of a message; whether they are finite is told by who uses them."""
    given = message.get(name, usual)
    try:
        numbers = np.atleast_1d(np.asarray(given, float))
    except (TypeError, ValueError):
        numbers = np.empty(0)
    if numbers.shape != (count,):
        raise InputError(f"{name!r} must be {count} number{'s' * (count > 1)}, it is {given!r}")
    return numbers


_STYLES = ("clumsy", "stiff", "wild")
_DOES: dict[str, Callable[[Session, dict[str, Any]], dict[str, Any] | None]] = {
    "drag": _drag,
    "drop": _drop,
    "pin": _pin,
    "unpin": _unpin,
    "keep": _keep,
    "take": _take,
    "forget": _forget,
    "undo": _undo,
    "redo": _redo,
    "feel": _feel,
    "play": _play,
    "next": _next,
    "stop": _stop,
    "look": _look,
}
