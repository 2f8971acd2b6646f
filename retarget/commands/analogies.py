"""The command that does to one motion what was done to another."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from retarget.console import Failed, Out, captured, folder_at, one_line, stem, tell

if TYPE_CHECKING:
    from mocap.analogy.analogy import Knobs
    from mocap.skeletons.skeleton import SkeletonMotion

CARTOON, SKELETON = ".motion.json", ".bvh"
FILMS = (".mp4", ".webm", ".mov", ".gif")


def analogy(
    *motions: Path,
    out: Out = None,
    style: float = 1.0,
    keep: float = 1e-3,
    only: tuple[str, ...] = (),
    on: tuple[str, ...] = (),
    space: bool = False,
    time: bool = False,
    slide: bool = False,
    once: bool = False,
    free: float = 0.0,
    slope: int = 3,
) -> str:
    """Do to B what turns A into A': walk.bvh run.bvh tired_walk.bvh makes a tired run.

    Parameters
    ----------
    motions
        A, A' and B, as *.bvh or as *.motion.json of captured cartoons; further pairs before B are done one after the
        other.  B may be a folder: then it is done to every motion in it.
    out
        The motion B' to write, or a film of it as a stick figure (.mp4, .webm, .mov, .gif); a folder for a folder.
        B.analogy.bvh if not given.
    style
        How much: 0 is B, 1 is B', 2 does twice as much.
    keep
        How strongly B's own way of moving is kept; 1 is strong.
    only
        Joints or parts (spine, "left arm", legs, ...) that change; all if not given.
    on
        Joints or parts that tell which frame of A is which of B; all if not given.
    space
        Change how it moves only, not when.
    time
        Change its timing only.
    slide
        Let feet slide where the analogy takes them.
    once
        Do not repeat clips that come round, such as a walk, to cover B.
    free
        Seconds of A and A' that may be left out at their starts and ends.
    slope
        One frame answers at most so many.
    """
    from capture.errors import InputError
    from mocap.analogy.analogy import Knobs

    if len(motions) < 3 or len(motions) % 2 == 0:
        raise InputError(
            f"an analogy needs A, A' and B, or several pairs A and A' and then B, it was given {len(motions)} motions: "
            "such as walk.bvh run.bvh tired.bvh"
        )
    if not style >= 0 or not keep >= 0 or not free >= 0 or slope < 1:
        raise InputError(
            f"style, keep and free must be 0 or more and the slope 1 or more, they are {style}, {keep}, {free} and "
            f"{slope}"
        )
    knobs = Knobs(style, keep, space or not time, time or not space, only, on, slope, free, not once, not slide)
    *examples, last = motions
    kind = _kind(examples)
    if last.is_dir():
        return _folder(examples, last, out, kind, knobs)
    _kind([*examples, last])
    target = out or last.with_name(stem(last) + ".analogy" + kind)
    _check_target(target, motions, kind)
    said, notes = _made(_read(examples, kind), last, target, kind, knobs)
    tell(notes)
    return said


def _folder(examples: Sequence[Path], folder: Path, out: Path | None, kind: str, knobs: "Knobs") -> str:
    """The same for every motion of a folder; one that fails is told, and does not stop the rest."""
    from capture.errors import InputError

    found = sorted(path for path in folder.iterdir() if path.name.lower().endswith(kind))
    if not found:
        raise InputError(f"a folder of motions must hold *{kind} files as A does, {folder} has none")
    if out is None or out.suffix:
        raise InputError(f"the motions of a folder go into another: name one with -o, not {out or 'none'}")
    if out.resolve() == folder.resolve():
        raise InputError(f"what is made must not replace what it is made of: name another folder than {folder} with -o")
    pairs = _read(examples, kind)
    folder_at(out)
    failed = []
    for path in found:
        try:
            said, notes = _made(pairs, path, out / path.name, kind, knobs)
        except InputError as error:
            failed.append(path.name)
            said, notes = f"{path}: failed: {one_line(error)}", ()
        tell(f"{path}: {note}" for note in notes)
        print(said, file=sys.stdout, flush=True)
    closing = f"{len(found) - len(failed)} of {len(found)} motions made"
    if failed:
        raise Failed(f"{closing}, {len(failed)} failed: {', '.join(failed)}")
    return closing


def _made(pairs: Sequence, given: Path, target: Path, kind: str, knobs: "Knobs") -> tuple[str, Sequence[str]]:
    """Make B' of one file and write it; the line to print, and what else there is to say."""
    return (_made_cartoon if kind == CARTOON else _made_skeleton)(pairs, given, target, knobs)


def _made_skeleton(pairs: Sequence, given: Path, target: Path, knobs: "Knobs") -> tuple[str, Sequence[str]]:
    import numpy as np

    from mocap.analogy.analogy import analogy as analogous
    from mocap.analogy.feet import slide
    from mocap.skeletons.bvh import read_bvh
    from mocap.skeletons.units import upright

    raw = read_bvh(given)
    three = made = upright(raw)
    notes = [f"{given}: {note}" for note in three.notes]
    matched = ""
    for one, two in pairs:
        made = analogous(one, two, made, knobs)
        matched = made.notes[0].removeprefix("A: ")
        notes += made.notes
    unit = np.abs(raw.skeleton.offsets).max() / max(np.abs(three.skeleton.offsets).max(), 1e-12)
    _write_skeleton(made, target, unit)
    feet = f", feet slide {100 * slide(made):.1f} cm/s (B: {100 * slide(three):.1f})" if slide(three) else ""
    return f"{target}: {_length(made)} (B: {_length(three)}){feet}, {matched}", notes


def _made_cartoon(pairs: Sequence, given: Path, target: Path, knobs: "Knobs") -> tuple[str, Sequence[str]]:
    from capture.motion import tracks
    from mocap.analogy.cartoons import cartoon_analogy, of_cartoon

    three = made = tracks.load(given)
    notes: list[str] = []
    matched = 0
    for one, two in pairs:
        matched = len({track.part for track in one.tracks} & {track.part for track in made.tracks})
        matched = max(matched, int(len(one.tracks) == len(made.tracks) == 1))
        made, told = cartoon_analogy(one, two, made, knobs)
        notes += told
    tracks.save(made, target)
    lengths = [f"{len(motion.times)} frames, {len(of_cartoon(motion)) / motion.fps:.2f} s" for motion in (made, three)]
    parts = f"{matched} of B's {len(three.tracks)} parts are matched"
    return f"{target}: {lengths[0]} (B: {lengths[1]}), {parts}", notes


def _read(examples: Sequence[Path], kind: str) -> list[tuple]:
    """The pairs A, A' of the files."""
    from capture.motion import tracks

    read = [captured(path) if kind == SKELETON else tracks.load(path) for path in examples]
    return list(zip(read[0::2], read[1::2]))


def _write_skeleton(motion: "SkeletonMotion", target: Path, unit: float) -> None:
    """Write a motion in metres in the unit that is so many times smaller, or a film of it."""
    from dataclasses import replace

    from capture.pictures.encode import write_clip
    from mocap import sticks
    from mocap.analogy.curves import hips
    from mocap.skeletons.bvh import write_bvh

    if target.suffix.lower() == SKELETON:
        skeleton = replace(motion.skeleton, offsets=unit * motion.skeleton.offsets)
        write_bvh(replace(motion, skeleton=skeleton, translation=unit * motion.translation), target)
        return
    above = motion.skeleton.path(hips(motion))[:-1]
    shown = [joint for joint in range(len(motion.skeleton)) if joint not in above]
    parents = tuple(
        shown.index(motion.skeleton.parents[k]) if motion.skeleton.parents[k] in shown else -1 for k in shown
    )
    places = motion.positions()[:, shown]
    colors = sticks.sides(tuple(motion.skeleton.names[k] for k in shown))
    view = sticks.view_of(places, (480, 480), turn=0.9)
    write_clip(target, sticks.draw(places, parents, view, 0.035, colors), motion.fps)


def _kind(paths: Sequence[Path]) -> str:
    """What all the files are, by their names."""
    from capture.errors import InputError

    kinds = [next((kind for kind in (CARTOON, SKELETON) if path.name.lower().endswith(kind)), None) for path in paths]
    if None in kinds:
        odd = paths[kinds.index(None)]
        raise InputError(f"motions must be *{SKELETON} or *{CARTOON} files, {odd} is neither")
    if len(set(kinds)) > 1:
        raise InputError(
            f"the motions of an analogy must be of one kind, all *{SKELETON} or all *{CARTOON}: these differ"
        )
    return kinds[0]


def _check_target(target: Path, motions: Sequence[Path], kind: str) -> None:
    """Refuse what cannot be written, before anything is made."""
    from capture.errors import InputError

    allowed = (SKELETON, *FILMS) if kind == SKELETON else (CARTOON,)
    if not target.name.lower().endswith(allowed):
        raise InputError(f"what is made of *{kind} must be written as {' or '.join(allowed)}, not as {target.name}")
    if any(path.exists() and target.exists() and path.samefile(target) for path in motions):
        raise InputError(f"what is made must not replace what it is made of: name another file than {target} with -o")


def _length(motion: "SkeletonMotion") -> str:
    return f"{len(motion)} frames, {len(motion) / motion.fps:.2f} s"
