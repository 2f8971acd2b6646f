"""A capture done again only where its shot was changed since: from key to key round what was mended.

A key that was added, moved or taken away touches the frames between the keys on either side of it, and all frames that
are drawn with it.  There the part is tracked anew, in the space of the keys as they are now, from the poses that were
captured at those two keys; everywhere else all parts stay as they were captured, to the last bit, their weights told
over the rows that there are now.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.fit import batch, meet, passes, source, video
from capture.fit.checkpoint import keep_of, kept_shot
from capture.fit.passes import Before, Way
from capture.fit.pixels import model as models
from capture.fit.pixels.model import PartModel
from capture.fit.poses import Poses
from capture.motion import affine, tracks
from capture.motion.keys import KeySet
from capture.motion.tracks import CartoonMotion, Track, total_affine
from capture.pictures.clip import Clip
from capture.pictures.shot import Part, Shot

SAME = 2e-3  # pixels: outlines in a shot are rounded to a thousandth
DRAWN = 1e-9  # a weight that counts
OF_CLIP = ("start", "stop", "fps", "tile")


@dataclass(frozen=True)
class Change:
    """What of one part can stay, and what must be tracked again; frames are the motion's, counted from 0."""

    kept: Mapping[int, int]  # from the number of a key that stays as it was to its number now
    ways: tuple[Way, ...] = ()  # first, last: from key to key round what was changed
    sure: frozenset[int] = frozenset()  # key frames at the ends of ways, whose poses stay


@dataclass(frozen=True)
class Plan:
    """What a changed shot asks for: a change of every part, or all to be captured anew."""

    changes: Mapping[str, Change]
    whole: str = ""  # why all must be captured anew, where that is so

    def ranges(self, first: int = 0) -> list[tuple[str, int, int]]:
        """Part, first and last frame of every way, in the clip's numbers; the motion's frame 0 is number `first`."""
        return [(part, a + first, b + first) for part, change in self.changes.items() for a, b in change.ways]


def plan(shot: Shot, motion: CartoonMotion, before: Shot | None = None) -> Plan:
    """What must be tracked again in a motion that was captured from another shot, `before`.

    If that is not given it is the one that the motion itself tells.  New names of keys and new pivots ask for nothing.
    """
    before = source.shot_of(motion) if before is None else before
    why = _why_whole(shot, motion, before)
    changes = {}
    for old, new in [] if why else zip(before.parts, shot.parts):
        kept = _kept(old, new, motion.keyset(new.name))
        if kept.get(0) != 0 or list(kept.values()) != sorted(kept.values()):
            return Plan({}, f"the first key of {new.name}, or the order of its keys, was changed")
        changes[new.name] = change = _change(old, new, motion.track(new.name), kept, shot.start)
        if change.ways and not change.sure:
            return Plan({}, f"all that was captured of {new.name} is drawn with the key that was changed")
    return Plan(changes, why)


def capture_again(
    shot: Shot,
    motion: CartoonMotion,
    clip: Clip | None = None,
    before: Shot | None = None,
    keep: str | Path | None = None,
    stays: bool = False,
) -> CartoonMotion:
    """The motion that was captured before, with what was changed in the shot since then tracked again.

    What `plan` says must be captured whole is refused.  With `keep` an interrupted run goes on, as in `video.capture`.
    """
    from threadpoolctl import threadpool_limits

    planned = plan(shot, motion, before)
    if planned.whole:
        raise InputError(f"what was captured must be able to stay in part, but {planned.whole}: capture the whole shot")
    clip = video.open_clip(shot) if clip is None else clip
    if len(clip) != len(motion.times):
        raise InputError(
            f"what was captured must be of the same clip: the clip has {len(clip)} frames, the motion "
            f"{len(motion.times)}; capture the whole shot"
        )
    kept = None if keep is None else keep_of(keep, shot, clip, source.digest(motion))
    with threadpool_limits(1):  # matrices here are small: BLAS threads would only wait for each other
        learnt = [models.learn(part, clip, shot.start, shot.parts) for part in shot.parts]
        olds = [_told_anew(motion, model, planned.changes[model.part.name]) for model in learnt]
        befores = [_before(*old, model, planned.changes[model.part.name]) for old, model in zip(olds, learnt)]
        if planned.ranges():
            known = [video.key_poses(model, clip, shot.start) for model in learnt]
            done = passes.go_through(learnt, known, clip, kept, befores)
            runs = zip(olds, learnt, befores, done.forward, done.backward)
            olds = [_with(*old, model, before, meet.joined(model, *both)) for old, model, before, *both in runs]
    moved = _relative(motion, olds, [~before.poses.known for before in befores])
    again = replace(motion, tracks=moved, keysets=tuple(model.keyset for model in learnt))
    if kept is not None and not stays:
        kept.remove()
    return source.stamped(again, shot)


def capture_again_to(
    out: Path, shot: Shot, clip: Clip | None = None, before: Shot | None = None
) -> tuple[CartoonMotion, str]:
    """Capture again, into its file, what was changed in the shot since that was captured, or all where it must be.

    Returns the motion, and what was done, in words.  After an interrupt the same call goes on from there.
    """
    motion, keep = tracks.load(out), batch.keep_beside(out)
    planned = plan(shot, motion, before)
    if planned.whole:
        motion, said = video.capture(shot, clip, keep, stays=True), f"the whole was captured, for {planned.whole}"
    else:
        motion = capture_again(shot, motion, clip, before, keep, stays=True)
        said = ", ".join(f"{part} in {first} to {last}" for part, first, last in planned.ranges(shot.start))
        said = f"tracked again: {said}" if said else "nothing had to be tracked again"
    batch.put(motion, out)
    return motion, said


def go_on(out: Path, shot: Shot, clip: Clip) -> str:
    """Finish, into its file, a capture that was interrupted and whose shot was changed since, so that nothing is lost.

    It is captured as it was begun, and what was changed is tracked again.  Returns what was done, in words; "" where
    there is no such capture, or too much was changed: then nothing is done.
    """
    begun = kept_shot(batch.keep_beside(out), clip)
    if begun is None or replace(shot, clip="") == begun:
        return ""
    same = [replace(old.keys[0], name="") == replace(new.keys[0], name="") for old, new in zip(begun.parts, shot.parts)]
    if _why_changed(shot, begun) or not all(same):
        return ""
    motion = video.capture(replace(begun, clip=shot.clip), clip, batch.keep_beside(out), stays=True)
    batch.put(motion, out)
    return capture_again_to(out, shot, clip)[1]


def _why_whole(shot: Shot, motion: CartoonMotion, before: Shot | None) -> str:
    """Why nothing of a capture can stay, or ""."""
    if before is None:
        return "it is not known what the motion was captured from"
    told = [(part.name, tuple(key.name for key in part.keys)) for part in before.parts]
    if told != [(track.part, track.keys) for track in motion.tracks]:
        return "the motion was captured from other parts or keys"
    frames = {key.frame - shot.start for part in (*before.parts, *shot.parts) for key in part.keys}
    if not frames <= set(range(len(motion.times))):
        return "a key lies in none of the frames that were captured"
    return _why_changed(shot, before)


def _why_changed(shot: Shot, before: Shot) -> str:
    """Why nothing of what was captured from a shot `before` can stay, as far as the two shots tell, or ""."""
    if [getattr(shot, name) for name in OF_CLIP] != [getattr(before, name) for name in OF_CLIP]:
        return "another stretch of the clip is to be captured"
    if [part.name for part in shot.parts] != [part.name for part in before.parts]:
        return "parts have come, gone, or been renamed"
    for old, new in zip(before.parts, shot.parts):
        if (old.parent, old.order) != (new.parent, new.order):
            return f"{new.name} hangs on another part, or lies before or behind others than it did"
    return ""


def _kept(old: Part, new: Part, keyset: KeySet) -> dict[int, int]:
    """Which keys stay as they were: from their numbers before to their numbers now."""
    if not new.keys[0].outline:  # traced, so the only key: it is the same if it is found in the same way
        same = replace(old, name=new.name, pivot=new.pivot) == new
        return {0: 0} if same else {}
    drawn = affine.apply(keyset.removed, keyset.points)
    traced = not old.keys[0].outline
    kept = {}
    for k, key in enumerate(old.keys):
        outline = drawn[k, keyset.outline] if traced else drawn[k, : len(key.outline)]
        for n, other in enumerate(new.keys):
            here = other.frame == key.frame and len(other.outline) == len(outline)
            if here and np.abs(np.array(other.outline) - outline).max() < SAME:
                kept[k] = n
    return kept


def _change(old: Part, new: Part, track: Track, kept: Mapping[int, int], first: int) -> Change:
    """The ways round the frames that a change touches, between key frames that it does not touch."""
    gone = [k for k in range(len(old.keys)) if k not in kept]
    fresh = [n for n in range(len(new.keys)) if n not in kept.values()]
    touched = (np.abs(track.weights[:, _drawn_with(track.rows, gone)]) > DRAWN).any(axis=1)
    sure = [t for t in (new.keys[n].frame - first for n in kept.values()) if not touched[t]]
    touched[[key.frame - first for key in (*(old.keys[k] for k in gone), *(new.keys[n] for n in fresh))]] = True
    ends = sorted({0, *sure, len(touched) - 1})
    ways = tuple((a, b) for a, b in pairwise(ends) if touched[a : b + 1].any())
    return Change(kept, ways, frozenset(t for t in sure if any(t in way for way in ways)))


def _drawn_with(rows: NDArray, some: list[int]) -> NDArray:
    """Which rows (D,) are made of any of some keys."""
    return np.isin(rows[:, 0], some) | np.isin(rows[:, 1], some)


def _told_anew(motion: CartoonMotion, model: PartModel, change: Change) -> tuple[Track, NDArray]:
    """A track over the rows of the keys as they are now, and its plain maps (T, 2, 3) in the picture."""
    track, keyset = motion.track(model.part.name), model.keyset
    weights = np.zeros((len(track), len(keyset.rows)))
    for d in np.flatnonzero(~_drawn_with(track.rows, [k for k in range(len(track.keys)) if k not in change.kept])):
        i, j, s = track.rows[d]
        row = (change.kept[int(i)], change.kept[int(j)], s)
        weights[:, np.abs(keyset.rows - row).sum(axis=1).argmin()] += track.weights[:, d]
    pivot = keyset.points[0, keyset.outline].mean(axis=0) if model.part.pivot is None else np.array(model.part.pivot)
    same = {"keys": keyset.names, "rows": keyset.rows, "weights": weights}
    return replace(track, **same, pivot=pivot), total_affine(motion, track.part)


def _before(track: Track, plain: NDArray, model: PartModel, change: Change) -> Before:
    """What the passes need to know of a captured part: its poses, but not those that are to be found again."""
    known = np.ones(len(track), bool)
    for a, b in change.ways:
        known[a : b + 1] = False
    known[list(change.sure)] = True
    modes = np.zeros((len(track), 0)) if model.shape is None else track.weights @ model.shape.space.coefficients
    columns = {
        "placed": plain,
        "alpha": modes,
        "misfit": track.residual,
        "agreeing": np.ones(len(track)),
        "visible": track.visible,
        "held": track.held,
    }
    return Before(Poses(columns, known), change.ways, change.sure)


def _with(track: Track, plain: NDArray, model: PartModel, before: Before, poses: Poses) -> tuple[Track, NDArray]:
    """A track and its plain maps with the poses that were found in its ways."""
    new = np.flatnonzero(~before.poses.known)
    if not len(new):
        return track, plain
    found = video.as_track(
        model, Poses({name: column[new] for name, column in poses.columns.items()}, poses.known[new])
    )
    plain, columns = plain.copy(), {}
    plain[new] = affine.about(found.affine, found.pivot)
    for name in ("weights", "residual", "visible", "held"):
        columns[name] = getattr(track, name).copy()
        columns[name][new] = getattr(found, name)
    # the drawing that is held over a key frame at the end of a way has the pose that it has there
    same = columns["held"] & columns["visible"] & np.append(False, columns["visible"][:-1])
    for t in new[same[new]]:
        plain[t], columns["weights"][t] = plain[t - 1], columns["weights"][t - 1]
    for t in new[::-1][np.append(same[1:], False)[new[::-1]]]:
        plain[t], columns["weights"][t] = plain[t + 1], columns["weights"][t + 1]
    return replace(track, **columns), plain


def _relative(motion: CartoonMotion, olds: list[tuple[Track, NDArray]], changed: list[NDArray]) -> tuple[Track, ...]:
    """Tracks relative to their parents again, where they or those have changed.

    What hangs on a part that was tracked again stays where it was seen; where it was not seen it goes along.
    """
    now, moved, done = {}, {}, {}
    left = list(zip(olds, changed))
    while left:
        (track, plain), new = left.pop(0)
        if track.parent and track.parent not in now:
            left.append(((track, plain), new))
            continue
        before = motion.track(track.part)
        above, touched = now.get(track.parent), new | moved.get(track.parent, np.zeros(len(new), bool))
        if above is not None and (along := touched & ~new & ~track.visible).any():
            plain = plain.copy()
            plain[along] = affine.compose(above[along], affine.about(before.affine[along], before.pivot))
        local = plain if above is None else affine.compose(affine.invert(above), plain)
        maps = affine.from_about(local, track.pivot)
        if np.array_equal(track.pivot, before.pivot):
            maps = np.where(touched[:, None, None], maps, before.affine)
        now[track.part], moved[track.part], done[track.part] = plain, touched, replace(track, affine=maps)
    return tuple(done[track.part] for track in motion.tracks)
