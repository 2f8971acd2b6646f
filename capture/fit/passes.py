"""A clip gone through for all its parts together: forwards from key to key, then backwards where that falls short.

At its key frames a part's pose is known.  Forwards it is followed from its first key to the clip's end; where it comes
to a key frame it is compared with what is known, and starts anew from the key if it has gone astray.  Backwards the
part is looked for before its first key, and between two keys where it was lost or arrived astray, until both runs are
of one mind.  `meet` then makes one run of the two.
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


def go_through(learnt: list[PartModel], keys: list[KeyPoses], clip: Clip, keep: Keep | None = None) -> State:
    """Look for all parts in all frames: the state when all is done, with the poses of both runs.

    With `keep` the state is put on disk every few seconds and when something interrupts, and a state found there is
    gone on from.
    """
    state = (keep.read(learnt) if keep else None) or beginning(learnt, keys, len(clip))
    first = saved = state
    at, names = monotonic(), ", ".join(model.part.name for model in learnt)

    def total() -> int:
        return state.done + _ahead(keys, state)

    try:
        for latest in progress(_onward(learnt, keys, clip, state), names, total, first.done):
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
    if keep and saved is not first:
        keep.write(state, learnt)
    return state


def beginning(learnt: list[PartModel], keys: list[KeyPoses], frames: int) -> State:
    """Nothing looked at yet, in a clip of so many frames."""
    runs = [tuple(tables.empty(frames, next(iter(known.values()))) for known in keys) for _ in range(2)]
    nobody = (None,) * len(learnt)
    return State(min(map(min, keys)), False, 0, nobody, *runs, tuple(np.ones(frames, bool) for _ in keys))


def stretches(known: KeyPoses, forward: Poses, arrived: NDArray) -> list[Stretch]:
    """Where a part must be looked for backwards after the run forward, the latest first.

    Before its first key; between two keys from the later one if the part came there astray; else from where it was
    found again after it was lost.
    """
    frames = sorted(known)
    found = [(frames[0], 0)] if frames[0] > 0 else []
    for begin, end in pairwise(frames):
        if not arrived[end]:
            found.append((end, begin + 1))
            continue
        lost = ~forward.columns["visible"][begin + 1 : end]
        again = np.flatnonzero(lost & ~np.append(lost[1:], False)) + begin + 2  # the frames after the losses
        found += [(int(frame), int(low)) for low, frame in zip([begin + 1, *(again + 1)], again)]
    return found[::-1]


def _onward(learnt: list[PartModel], keys: list[KeyPoses], clip: Clip, state: State) -> Iterator[State]:
    """The states after each frame that is looked at."""
    wanted = _wanted(keys, state)
    while state.frame >= 0:
        picture = np.asarray(clip[state.frame])[..., :3]
        if state.back:
            state = _backwards(learnt, wanted, picture, state)
        else:
            state = _forwards(learnt, keys, picture, state)
            wanted = _wanted(keys, state)
        if state.back and not any(state.sightings):  # on to where somebody is wanted next
            begins = [begin for of_part in wanted for begin, _ in of_part if begin <= state.frame]
            state = replace(state, frame=max(begins, default=-1))
        yield state


def _wanted(keys: list[KeyPoses], state: State) -> list[list[Stretch]]:
    """Of each part, where it must be looked for backwards; that is known when the run forward is over."""
    return [stretches(*of_part) for of_part in zip(keys, state.forward, state.arrived)] if state.back else []


def _forwards(learnt: list[PartModel], keys: list[KeyPoses], picture: NDArray, state: State) -> State:
    """One frame on: parts that begin here, parts on their way, and parts that come to a key frame."""
    t, last = state.frame, len(state.arrived[0]) - 1
    known = [of_part.get(t) for of_part in keys]
    start = [Sighting(model, model.colors, pose) if pose is not None else None for model, pose in zip(learnt, known)]
    begun = [before or (fresh if t == min(of_part) else None)
             for before, fresh, of_part in zip(state.sightings, start, keys)]  # fmt: skip
    found = _found(picture, begun)
    astray = [pose is not None and not _there(now, pose) for now, pose in zip(found, known)]
    if any(astray):
        again = _found(picture, [fresh if off else now for fresh, now, off in zip(start, found, astray)])
        found = [_held_to(new, pose, picture) if off else now
                 for new, pose, now, off in zip(again, known, found, astray)]  # fmt: skip
    for number, now in enumerate(found):
        if now is not None:
            tables.put(state.forward[number], t, now.pose)
            state.arrived[number][t] = not astray[number]
    if t == last:
        return replace(state, frame=last, back=True, done=state.done + 1, sightings=(None,) * len(found))
    return replace(state, frame=t + 1, done=state.done + 1, sightings=tuple(found))


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
        elif not looked[number] and run.known[t] and run.columns["visible"][t]:
            # already drawn here, so like a held drawing it costs nothing, and may cover or carry others
            sightings[number] = Sighting(model, model.colors, tables.at(run, t), drawn=picture)
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


def _ahead(keys: list[KeyPoses], state: State) -> int:
    """How many frames are still to be looked at; backwards it may be fewer, forwards more, if parts get lost."""
    if not state.back:
        first = max(map(min, keys))
        return len(state.arrived[0]) - state.frame + (first + 1 if first else 0)
    wanted = np.zeros(len(state.arrived[0]), bool)
    for of_part in _wanted(keys, state):
        for begin, end in of_part:
            wanted[end : begin + 1] = True
    return int(wanted[: state.frame + 1].sum())
