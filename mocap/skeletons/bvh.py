"""BVH files: joints over time, in degrees and in whatever unit they were captured in.

What real files do and readers stumble over: each joint has its own order of rotation channels; a position channel
replaces the joint's OFFSET, it does not add to it, and any joint may have one; there may be several roots, hinges of
one channel, joints of none; end sites are joints without channels; frames go over lines.
"""

import re
from collections import defaultdict
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.files import written_beside
from mocap.skeletons import bvhtext, euler
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion

GUESSED_FPS = 30.0
"""Where the file does not say how long a frame lasts."""


def read_bvh(path: str | Path, strict: bool = False, fps: float | None = None) -> SkeletonMotion:
    """Read a *.bvh, in the file's own unit and with its own up axis (`units.upright` mends both).

    What had to be guessed or mended is said in the motion's `notes`, a sentence each; with `strict` any such thing is
    an InputError, as is a text in which joints and frames cannot be told apart.  `fps` overrides the file's.
    """
    path = Path(path)
    try:
        motion = _motion(*bvhtext.text_of(path), fps)
    except FileNotFoundError:
        raise InputError(f"a skeleton must be a file that exists: there is no {path}") from None
    except OSError as error:
        raise InputError(f"{path} must be a file that can be read: {error.strerror or error}") from None
    except ValueError as error:
        raise InputError(f"{path} must be a BVH file of joints and frames, it cannot be read: {error}") from None
    if strict and motion.notes:
        raise InputError(f"{path} must be a BVH without a fault, {motion.notes[0]}: mend it, or do not be strict")
    return motion


def write_bvh(motion: SkeletonMotion, path: str | Path) -> None:
    """Write a motion as *.bvh: what `read_bvh` reads of it has the same joints in the same places.

    Roots and joints that move against their parents (rubber ones do) get position channels; a leaf that never turns
    nor moves and is called "... end", as `read_bvh` calls them, is an end site.  Joints are written depth first.
    """
    skeleton = motion.skeleton
    still = np.abs(motion.translation - skeleton.offsets).max(axis=(0, 2)) <= 1e-9 * max(_reach(skeleton), 1e-9)
    unturned = (np.abs(motion.rotation[..., :3]) <= 1e-12).all(axis=(0, 2))
    angles = np.unwrap(euler.degrees_zxy(motion.rotation), period=360.0, axis=0)
    lines, columns = ["HIERARCHY"], []
    for joint, depth in _depth_first(skeleton):
        pad, root, name = "\t" * depth, skeleton.parents[joint] < 0, skeleton.names[joint]
        inner = f"{pad}\tOFFSET {' '.join(f'{number:.10g}' for number in skeleton.offsets[joint])}"
        if joint < 0:
            lines.append(pad + "}")
        elif not root and still[joint] and unturned[joint] and _is_end(skeleton, joint):
            lines += [f"{pad}End Site", f"{pad}{{", inner]
        else:
            moves = bool(root or not still[joint])
            columns += [motion.translation[:, joint]] * moves + [angles[:, joint]]
            channels = "6 Xposition Yposition Zposition" if moves else "3"
            lines += [f"{pad}{'ROOT' if root else 'JOINT'} {_plain(name)}", f"{pad}{{", inner]
            lines.append(f"{pad}\tCHANNELS {channels} Zrotation Xrotation Yrotation")
    lines += ["MOTION", f"Frames: {len(motion)}", f"Frame Time: {1 / motion.fps:.12g}"]
    row = " ".join(["%.9g"] * (3 * len(columns)))
    lines += [row % tuple(frame) for frame in np.concatenate(columns, axis=1).tolist()]
    with written_beside(path) as beside:
        beside.write_text("\n".join([*lines, ""]), encoding="utf-8")


def _motion(text: str, notes: list[str], fps: float | None) -> SkeletonMotion:
    hierarchy, frames = bvhtext.parts_of(text)
    joints = bvhtext.joints_of(hierarchy, notes)
    said_count, said_step, frames = bvhtext.heading_of(frames)
    rate = _rate(said_step, notes) if fps is None else fps
    width = sum(map(len, joints.channels))
    if width:
        values = bvhtext.frames_of(frames, width, _count(said_count, notes), notes)
    else:
        notes.append("none of its joints has a channel; it is one frame that stands still")
        values = np.zeros((1, 0))
    channels = [(joint, channel) for joint, own in enumerate(joints.channels) for channel in own]
    rest = np.array([joints.offsets[j, "XYZ".index(c[0])] if c.endswith("position") else 0.0 for j, c in channels])
    values = _held(values, rest, notes)
    skeleton = Skeleton(tuple(joints.names), tuple(joints.parents), joints.offsets)
    return SkeletonMotion(skeleton, *_played(joints.offsets, channels, values), rate, tuple(notes))


def _played(offsets: NDArray, channels: list[tuple[int, str]], values: NDArray) -> tuple[NDArray, NDArray]:
    """Translations (T, J, 3) and rotations (T, J, 4) of joints with these channels' values (T, C)."""
    translation = np.tile(offsets, (len(values), 1, 1))
    rotation = np.tile([0, 0, 0, 1.0], (len(values), len(offsets), 1))
    order: dict[int, str] = defaultdict(str)
    column: dict[int, list[int]] = defaultdict(list)
    for at, (joint, channel) in enumerate(channels):
        if channel.endswith("position"):
            translation[:, joint, "XYZ".index(channel[0])] = values[:, at]
        elif channel.endswith("rotation"):
            order[joint] += channel[0]
            column[joint].append(at)
    for turns in sorted(set(order.values())):  # all joints of one order at once
        joints = [joint for joint in order if order[joint] == turns]
        rotation[:, joints] = euler.quaternions(turns, values[:, [column[joint] for joint in joints]])
    return translation, rotation


def _held(values: NDArray, rest: NDArray, notes: list[str]) -> NDArray:
    """Values (T, C) with the last one that could be read in place of NaN, or the first; or `rest` (C,)."""
    lost = np.isnan(values)
    if not lost.any():
        return values
    notes.append(f"{lost.sum()} numbers of {lost.size} cannot be read; the one before in time is held")
    frame = np.arange(len(values))[:, None]
    last = np.maximum.accumulate(np.where(lost, -1, frame), axis=0)
    last = np.where(last < 0, (~lost).argmax(axis=0), last)
    held = np.take_along_axis(values, last, axis=0)
    return np.where(np.isnan(held), rest, held)


def _count(said: str | None, notes: list[str]) -> int | None:
    if said is not None and re.fullmatch(r"\d{1,18}", said, re.ASCII):
        return int(said)
    notes.append("it does not say how many frames it has; all there are were taken")
    return None


def _rate(said: str | None, notes: list[str]) -> float:
    """Frames a second.  Frame Time is rounded in most files: .033333 is meant to be 30 frames a second."""
    try:
        step = float((said or "").replace(",", "."))
    except ValueError:
        step = 0.0
    if not 1e-5 < step < 1e5:  # NaN compares false
        notes.append(
            f"its Frame Time is {said}; {GUESSED_FPS:g} frames a second were assumed, give the rate to read_bvh"
        )
        return GUESSED_FPS
    if step > 1:
        notes.append(
            f"its Frame Time makes a frame last {step:g} seconds; if that is not so, give the rate to read_bvh"
        )
    near, places = round(1 / step), len(said.replace(",", ".").partition(".")[2])
    meant = near > 0 and abs(1 / near - step) <= min(10.0**-places, 2e-3 * step)  # some cut digits off, some round
    return float(near) if meant else 1 / step


def _depth_first(skeleton: Skeleton) -> list[tuple[int, int]]:
    """Each joint and its depth; where a joint closes, (-1, its depth)."""
    hangs: dict[int, list[int]] = defaultdict(list)
    for joint, parent in enumerate(skeleton.parents):
        hangs[parent].append(joint)
    found, waiting = [], [(joint, 0) for joint in reversed(hangs[-1])]
    while waiting:
        joint, depth = waiting.pop()
        found.append((joint, depth))
        if joint >= 0:
            waiting.append((-1, depth))
            waiting += [(child, depth + 1) for child in reversed(hangs[joint])]
    return found


def _is_end(skeleton: Skeleton, joint: int) -> bool:
    name = f"{skeleton.names[skeleton.parents[joint]]} end"
    return (
        joint not in skeleton.parents and re.fullmatch(re.escape(name) + r"( \d+)?", skeleton.names[joint]) is not None
    )


def _plain(name: str) -> str:
    return " ".join(re.sub(r"[{}]", " ", name).split()) or "joint"


def _reach(skeleton: Skeleton) -> float:
    return float(skeleton.lengths().sum())
