"""BVH files: joints over time, in degrees and in whatever unit they were captured in.

What real files do and readers stumble over: each joint has its own order of rotation channels; a position channel
replaces the joint's OFFSET, it does not add to it; end sites are joints without channels; frames go over lines.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from mocap.skeleton import Skeleton, SkeletonMotion


def read_bvh(path: str | Path) -> SkeletonMotion:
    """Read a *.bvh; anything that is not one is refused in one sentence."""
    path = Path(path)
    try:
        words = path.read_text(encoding="utf-8", errors="replace").split()
        return _motion(words)
    except FileNotFoundError:
        raise InputError(f"a skeleton must be a file that exists: there is no {path}") from None
    except (OSError, ValueError, IndexError) as error:
        raise InputError(f"{path} must be a BVH file of joints and frames, it cannot be read: {error}") from None


def _motion(words: list[str]) -> SkeletonMotion:
    if "MOTION" not in words or words[0] != "HIERARCHY":
        raise ValueError("it lacks HIERARCHY or MOTION")
    start = words.index("MOTION")
    names, parents, offsets, channels = _hierarchy(words[1:start])
    tail = words[start + 1 :]
    if [word.lower() for word in (tail[0], *tail[2:4])] != ["frames:", "frame", "time:"]:
        raise ValueError("its MOTION must begin with Frames: and Frame Time:")
    count, step = int(tail[1]), float(tail[4])
    total = sum(map(len, channels))
    values = np.array(tail[5:], float)
    if count < 1 or step <= 0 or len(values) < count * total or not np.isfinite(values).all():
        raise ValueError(f"{count} frames of {total} channels were said, there are {len(values)} numbers")
    values = values[: count * total].reshape(count, total)
    translation = np.tile(offsets, (count, 1, 1))
    rotation = np.tile([0, 0, 0, 1.0], (count, len(names), 1))
    column = 0
    for joint, own in enumerate(channels):
        _play(own, values[:, column : column + len(own)], translation[:, joint], rotation[:, joint])
        column += len(own)
    return SkeletonMotion(Skeleton(tuple(names), tuple(parents), np.array(offsets)), translation, rotation, 1 / step)


def _play(channels: list[str], values: NDArray, translation: NDArray, rotation: NDArray) -> None:
    """Fill in one joint's (T, 3) and (T, 4) from its channels' values (T, C)."""
    from scipy.spatial.transform import Rotation

    order, angles = "", []
    for name, value in zip(channels, values.T):
        axis = "XYZ".index(name[0].upper())
        if name[1:].lower() == "position":
            translation[:, axis] = value
        elif name[1:].lower() == "rotation":
            order, angles = order + name[0].upper(), [*angles, value]
        else:
            raise ValueError(f"a channel must be a position or a rotation, got {name}")
    turns = Rotation.identity(len(values))
    for axis, angle in zip(order, angles):  # each about the axes that the ones before have turned
        turns = turns * Rotation.from_euler(axis, angle[:, None], degrees=True)
    rotation[:] = turns.as_quat()


def _hierarchy(words: list[str]) -> tuple[list[str], list[int], list[list[float]], list[list[str]]]:
    names: list[str] = []
    parents: list[int] = []
    offsets: list[list[float]] = []
    channels: list[list[str]] = []
    open_joints: list[int] = []
    label: list[str] = []
    at = 0
    while at < len(words):
        word = words[at]
        if word == "{":
            parent = open_joints[-1] if open_joints else -1
            ends = label[:1] == ["End"]
            names.append(f"{names[parent]} end" if ends else " ".join(label[1:]))
            parents.append(parent)
            offsets.append([0.0, 0.0, 0.0])
            channels.append([])
            open_joints.append(len(names) - 1)
            label = []
        elif word == "}":
            open_joints.pop()
        elif word == "OFFSET":
            offsets[open_joints[-1]] = [float(number) for number in words[at + 1 : at + 4]]
            at += 3
        elif word == "CHANNELS":
            count = int(words[at + 1])
            channels[open_joints[-1]] = words[at + 2 : at + 2 + count]
            at += 1 + count
        else:
            label.append(word)
        at += 1
    if open_joints or not names:
        raise ValueError("its joints are not closed by as many } as {")
    return names, parents, offsets, channels
