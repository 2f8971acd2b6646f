"""A clip gone through for all its parts together: forwards from key to key, then backwards where that falls short.

At its key frames a part's pose is known.  Forwards it is followed from its first key to the clip's end; where it comes
to a key frame it is compared with what is known, and starts anew from the key if it has gone astray.  Backwards the
part is looked for before its first key, and between two keys where it was lost or arrived astray, until both runs are
of one mind.  `meet` then makes one run of the two.

Of a clip that was captured before, only some ways may be gone through (`Before`): elsewhere the parts stand as they
were captured.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from time import monotonic

import numpy as np
from numpy.typing import NDArray

from capture.fit import poses as tables
from capture.fit.checkpoint import Keep
from capture.fit.pixels import find as finding
from capture.fit.pixels.find import Pose, Sighting
from capture.fit.pixels.model import PartModel
from capture.fit.poses import Poses
from capture.pictures.clip import Clip
from capture.progress import progress

ASTRAY = 2.0  # pixels off a known pose, beyond what fit and hand-drawn key differ by
OF_ONE_MIND = 0.5  # pixels between the two runs, below which they are in the same place
KEPT_EVERY = 5.0  # seconds of work that an interruption may cost

KeyPoses = dict[int, Pose]  # of one part: what is known, by key frame
Stretch = tuple[int, int]  # from, to: a part is looked for backwards in from - 1, ..., to
Way = tuple[int, int]  # first, last: frames in which a part is looked for


@dataclass(frozen=True, eq=False)
class Before:
    """What an earlier capture has found of one part, and where it is to be looked for again."""

    poses: Poses  # known wherever they stay as they are
    ways: tuple[Way, ...]  # in order; two may share a key frame
    sure: frozenset[int]  # key frames at the ends of ways, whose captured poses stay


@dataclass(frozen=True, eq=False)
class Task:
    """What is to be done about one part."""

    known: KeyPoses
    ways: tuple[Way, ...]
    sure: frozenset[int]

    def starts(self) -> dict[int, int]:
        """The ends of the ways forward, by the key frames that they begin at."""
        return {min(t for t in self.known if low <= t <= high): high for low, high in self.ways}


@dataclass(frozen=True, eq=False)
class State:
    """How far a clip has been gone through: all that is needed to go on."""

    frame: int  # the next to look at; below 0 when all is done
    back: bool  # whether it is gone through backwards
    done: int  # frames looked at so far
    sightings: tuple[Sighting | None, ...]  # of each part; None while it is not looked for
    forward: tuple[Poses, ...]
    backward: tuple[Poses, ...]
    arrived: tuple[NDArray, ...]  # (T,) bool of each part: False at key frames that it came to astray


def go_through(
    learnt: list[PartModel],
    keys: list[KeyPoses],
    clip: Clip,
    keep: Keep | None = None,
    before: list[Before] | None = None,
) -> State:
    """Look for all parts in all frames: the state when all is done, with the poses of both runs.

    With `keep` the state is put on disk every few seconds and when something interrupts, and a state found there is
    gone on from.  With what was captured `before` of each part, only its ways are gone through.
    """
    tasks = tasks_of(keys, len(clip), before)
    state = (keep.read(learnt) if keep else None) or beginning(tasks, len(clip), before)
    first = saved = state
    at, names = monotonic(), ", ".join(model.part.name for model, task in zip(learnt, tasks) if task.ways)

    def total() -> int:
        return state.done + _ahead(tasks, state)

    try:
        for latest in progress(_onward(learnt, tasks, clip, state), names, total, first.done):
            state = latest
            if keep and monotonic() - at > KEPT_EVERY:
                keep.write(state, learnt)
                at, saved = monotonic(), state
    except BaseException as error:
        if keep and state is not saved:
            keep.write(state, learnt)
        if keep and isinstance(error, KeyboardInterrupt) and keep.path.exists():
            raise KeyboardInterrupt(keep.goes_on(state)) from None
        raise
    if keep and saved is not state:
        keep.write(state, learnt)
    return state


def tasks_of(keys: list[KeyPoses], frames: int, before: list[Before] | None = None) -> list[Task]:
    """What is to be done about each part: all of the clip, or only the ways of what was captured before."""
    if before is None:
        return [Task(known, ((0, frames - 1),), frozenset()) for known in keys]
    sure = [{t: tables.at(old.poses, t) for t in old.sure} for old in before]
    return [Task({**known, **stay}, old.ways, old.sure) for known, stay, old in zip(keys, sure, before)]


def beginning(tasks: list[Task], frames: int, before: list[Before] | None = None) -> State:
    """Nothing looked at yet, in a clip of so many frames."""
    backward = [tables.empty(frames, next(iter(task.known.values()))) for task in tasks]
    forward = backward if before is None else [old.poses for old in before]
    runs = [tuple(tables.copy(run) for run in runs) for runs in (forward, backward)]
    nobody = (None,) * len(tasks)
    start = min(start for task in tasks for start in task.starts())
    return State(start, False, 0, nobody, *runs, tuple(np.ones(frames, bool) for _ in tasks))


def stretches(known: KeyPoses, forward: Poses, arrived: NDArray, ways: tuple[Way, ...] | None = None) -> list[Stretch]:
    """Where a part must be looked for backwards after the run forward, the latest first; in the whole clip, or `ways`.

    Before its first key; between two keys from the later one if the part came there astray; else from where it was
    found again after it was lost.
    """
    found = []
    for first, last in ((0, len(arrived) - 1),) if ways is None else ways:
        frames = sorted(t for t in known if first <= t <= last)
        found += [(frames[0], first)] if frames[0] > first else []
        for begin, end in pairwise(frames):
            if not arrived[end]:
                found.append((end, begin + 1))
                continue
            lost = ~forward.columns["visible"][begin + 1 : end]
            again = np.flatnonzero(lost & ~np.append(lost[1:], False)) + begin + 2  # the frames after the losses
            found += [(int(frame), int(low)) for low, frame in zip([begin + 1, *(again + 1)], again)]
    return found[::-1]


def _onward(learnt: list[PartModel], tasks: list[Task], clip: Clip, state: State) -> Iterator[State]:
    """The states after each frame that is looked at."""
    wanted = _wanted(tasks, state)
    while state.frame >= 0:
        picture = np.asarray(clip[state.frame])[..., :3]
        if state.back:
            state = _backwards(learnt, wanted, picture, state)
        else:
            state = _forwards(learnt, tasks, picture, state)
            wanted = _wanted(tasks, state)
        if state.back and not any(state.sightings):  # on to where somebody is wanted next
            begins = [begin for of_part in wanted for begin, _ in of_part if begin <= state.frame]
            state = replace(state, frame=max(begins, default=-1))
        yield state


def _wanted(tasks: list[Task], state: State) -> list[list[Stretch]]:
    """Of each part, where it must be looked for backwards; that is known when the run forward is over."""
    if not state.back:
        return []
    runs = zip(tasks, state.forward, state.arrived)
    return [stretches(task.known, forward, arrived, task.ways) for task, forward, arrived in runs]


def _forwards(learnt: list[PartModel], tasks: list[Task], picture: NDArray, state: State) -> State:
    """One frame on: parts that begin here, parts on their way, and parts that come to a key frame."""
    t = state.frame
    starts = [task.starts() for task in tasks]
    looked = [before is not None or t in begin for before, begin in zip(state.sightings, starts)]
    known = [task.known.get(t) if looks else None for task, looks in zip(tasks, looked)]
    drawn = [picture if t in task.sure else None for task in tasks]
    start = [Sighting(model, model.colors, pose, drawn=picture) if pose is not None else None
             for model, pose, picture in zip(learnt, known, drawn)]  # fmt: skip
    begun = [before or (fresh if looks else _standing(model, run, t, picture))
             for before, fresh, looks, model, run
             in zip(state.sightings, start, looked, learnt, state.forward)]  # fmt: skip
    found = _found(picture, begun)
    astray = [pose is not None and not _there(now, pose) for now, pose in zip(found, known)]
    if any(astray):
        again = _found(picture, [fresh if off else now for fresh, now, off in zip(start, found, astray)])
        found = [_held_to(new, pose, picture) if off else now
                 for new, pose, now, off in zip(again, known, found, astray)]  # fmt: skip
    for number, task in enumerate(tasks):
        if not looked[number]:
            found[number] = None
            continue
        state.arrived[number][t] = not astray[number]
        if t not in task.sure:
            tables.put(state.forward[number], t, found[number].pose)
        if t in starts[number]:
            found[number] = start[number] if t in task.sure else found[number]
        elif any(t == last for _, last in task.ways):
            found[number] = None
    follows = [start for begin in starts for start in begin if start > t]
    onward = t + 1 if any(found) else min(follows, default=len(state.arrived[0]))
    if onward == len(state.arrived[0]):
        return replace(state, frame=onward - 1, back=True, done=state.done + 1, sightings=(None,) * len(found))
    return replace(state, frame=onward, done=state.done + 1, sightings=tuple(found))


def _backwards(learnt: list[PartModel], wanted: list[list[Stretch]], picture: NDArray, state: State) -> State:
    """One frame back for the parts that are wanted there; the others stand where the run forward found them."""
    t = state.frame
    sightings, looked = list(state.sightings), [sighting is not None for sighting in state.sightings]
    known: list[Pose | None] = [None] * len(learnt)
    for number, (model, run) in enumerate(zip(learnt, state.forward)):
        begins = any(begin == t for begin, _ in wanted[number])
        if begins:
            known[number] = tables.at(run, t)
            sightings[number] = Sighting(model, model.colors, known[number])
        elif not looked[number]:
            sightings[number] = _standing(model, run, t, picture)
    found = _found(picture, sightings)
    for number, (model, run) in enumerate(zip(learnt, state.forward)):
        if known[number] is not None:
            found[number] = _held_to(found[number], known[number], picture)
        elif looked[number]:
            tables.put(state.backward[number], t, found[number].pose)
            end = next(end for begin, end in wanted[number] if end <= t < begin)
            if t == end or _of_one_mind(model, run, found[number].pose, t, end):
                found[number] = None
        else:
            found[number] = None
    return replace(state, frame=t - 1, done=state.done + 1, sightings=tuple(found))


def _standing(model: PartModel, run: Poses, t: int, picture: NDArray) -> Sighting | None:
    """A part where a run has found it: drawn here, so like a held drawing it costs nothing, and may cover or carry."""
    if not (run.known[t] and run.columns["visible"][t]):
        return None
    return Sighting(model, model.colors, tables.at(run, t), drawn=picture)


def _found(picture: NDArray, sightings: list[Sighting | None]) -> list[Sighting | None]:
    """`find`, for those parts that are looked for."""
    new = iter(finding.find(picture, tuple(sighting for sighting in sightings if sighting is not None)))
    return [None if sighting is None else next(new) for sighting in sightings]


def _there(found: Sighting, known: Pose) -> bool:
    return found.pose.visible and tables.apart(found.model, found.pose, known) <= ASTRAY


def _held_to(found: Sighting, known: Pose, picture: NDArray) -> Sighting:
    """A part found in a frame where its pose is known: as found if that is the place, else as known."""
    if _there(found, known):
        return found
    pose = replace(known, misfit=found.pose.misfit, visible=True, held=False)
    return Sighting(found.model, found.model.colors, pose, drawn=picture)


def _of_one_mind(model: PartModel, forward: Poses, pose: Pose, t: int, end: int) -> bool:
    """Whether the run backwards has come to where the other one was, and that one was not lost before."""
    if not (forward.known[t] and pose.visible and forward.columns["visible"][end : t + 1].all()):
        return False
    return tables.apart(model, pose, tables.at(forward, t)) < OF_ONE_MIND


def _ahead(tasks: list[Task], state: State) -> int:
    """How many frames are still to be looked at; backwards it may be fewer, forwards more, if parts get lost."""
    forward, back = (np.zeros(len(state.arrived[0]), bool) for _ in range(2))
    if not state.back:
        for task in tasks:
            for (first, _), (start, last) in zip(task.ways, task.starts().items()):
                forward[start : last + 1] = True
                back[first : start + 1] |= start > first
        return int(forward[state.frame :].sum() + back.sum())
    for of_part in _wanted(tasks, state):
        for begin, end in of_part:
            back[end : begin + 1] = True
    return int(back[: state.frame + 1].sum())
