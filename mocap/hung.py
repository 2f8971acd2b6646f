"""Bones of a marked drawing put end to end: where its joints come to lie, and the map of every sub-link."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from capture.motion import affine
from mocap.bones import Bone
from mocap.marks import Marks

END, STUB = "end", 0.6
"""What lies beyond a limb's last joint is a part of its own, so many sub-links long: "left_hand end" is the hand."""

SWING = 1.8
"""Hz at which what nobody plays, such as a tail, swings after the body."""

DIES = 0.3
"""How soon that swing dies away: 0 never, 1 without a swing back."""


@dataclass(frozen=True, eq=False)
class Lie:
    """How a bone's n pieces lie on the page, frame by frame, against the drawing."""

    turn: NDArray  # (T, n) radians, clockwise as y is down
    stretch: NDArray  # (T, n) along the bone
    thickness: NDArray  # (T, n) across it
    depth: NDArray  # (T,) metres nearer to the viewer than what its limb hangs on


@dataclass(frozen=True, eq=False)
class Part:
    """A sub-link, or the root."""

    name: str  # the joint it leads to, with a number where the bone is cut, or END
    parent: str  # the part before it, or ""
    limb: str  # what is drawn as one
    start: NDArray  # (2,) in the drawing
    stop: NDArray  # (2,)
    maps: NDArray  # (T, 2, 3) from the drawing to where it goes while the root stays


@dataclass(frozen=True, eq=False)
class Hung:
    """All parts, parents first, and where the J marked joints are."""

    parts: tuple[Part, ...]
    places: NDArray  # (T, J, 2) while the root stays

    def part(self, name: str) -> Part:
        """The part of a name."""
        return next(part for part in self.parts if part.name == name)


def hung(marks: Marks, bones: tuple[Bone, ...], lies: dict[int, Lie], pelvis: NDArray) -> Hung:
    """Bones that lie as `lies` says, by their marks; what nobody plays goes with what it hangs on.

    `pelvis` (T,) is how far the root's own part is turned.
    """
    of_mark = {bone.mark: bone for bone in bones}
    places = np.repeat(marks.places[None], len(pelvis), axis=0).astype(float)
    parts: list[Part] = []
    carries: dict[int, int] = {}  # the number of the part that ends in each joint
    for joint, parent in enumerate(marks.parents):
        here = marks.places[joint]
        if parent < 0:
            parts.append(_part(marks.names[joint], "", "trunk", here, here, _linear(pelvis, 0.0), places[:, joint]))
        elif joint not in of_mark:  # marked in its parent's place
            places[:, joint], carries[joint] = places[:, parent], carries[parent]
            continue
        else:
            lie, start = lies.get(joint), places[:, parent]
            above = parts[carries[parent]]
            step = (here - marks.places[parent]) / (1 if lie is None else lie.turn.shape[1])
            for k, name in enumerate(_names(marks.names[joint], lie)):
                drawn = marks.places[parent] + k * step
                if lie is None:
                    linear = _linear(affine.turn(above.maps), 0.0)
                else:
                    linear = _linear(lie.turn[:, k], _angle(step), lie.stretch[:, k], lie.thickness[:, k])
                above = _part(name, above.name, of_mark[joint].limb, drawn, drawn + step, linear, start)
                parts.append(above)
                start = start + linear @ step
            places[:, joint] = start
            if lie is not None and lie.turn.shape[1] > 1 and joint not in marks.parents:
                drawn, linear = (here, here + STUB * step), _linear(lie.turn[:, -1], 0.0)
                stub = _part(f"{marks.names[joint]} {END}", above.name, of_mark[joint].limb, *drawn, linear, start)
                parts.append(stub)  # a hand or a foot: it turns with its limb, and keeps its size
        carries[joint] = len(parts) - 1
    return Hung(tuple(parts), places)


def swung(body: Hung, marks: Marks, played: set[int], way: NDArray, fps: float) -> Hung:
    """What nobody plays, and nothing played hangs on, swings after the body, which travels along `way` (T, 2)."""
    from mocap.rubber.followthrough import follow

    free = [joint for joint in range(len(marks)) if not played & set(_below(joint, marks.parents))]
    free = [joint for joint in free if marks.parents[joint] >= 0]
    if not free or len(way) < 3:
        return body
    nodes = sorted({*free, *(marks.parents[joint] for joint in free)})
    number = {joint: k for k, joint in enumerate(nodes)}
    parents = tuple(number[marks.parents[joint]] if joint in free else -1 for joint in nodes)
    flat = body.places[:, nodes] + way[:, None]
    space = np.concatenate([flat, np.zeros((*flat.shape[:2], 1))], axis=-1)
    after = follow(space, parents, fps, SWING, DIES)[..., :2] - way[:, None]
    places, parts = body.places.copy(), {part.name: part for part in body.parts}
    places[:, nodes] = after
    for joint in free:
        part = parts.get(marks.names[joint])
        if part is None:
            continue
        drawn, step = part.stop - part.start, after[:, number[joint]] - after[:, parents[number[joint]]]
        stretch = np.maximum(np.linalg.norm(step, axis=1) / np.linalg.norm(drawn), 0.1)
        turn = np.arctan2(step[:, 1], step[:, 0]) - _angle(drawn)
        linear = _linear(turn, _angle(drawn), stretch, 1 / np.sqrt(stretch))
        shift = after[:, parents[number[joint]]] - linear @ part.start
        parts[part.name] = replace(part, maps=np.concatenate([linear, shift[..., None]], axis=-1))
    return Hung(tuple(parts.values()), places)


def _names(joint: str, lie: Lie | None) -> list[str]:
    count = 1 if lie is None else lie.turn.shape[1]
    return [joint] if count == 1 else [f"{joint} {k + 1}" for k in range(count)]


def _part(name: str, parent: str, limb: str, start: NDArray, stop: NDArray, linear: NDArray, place: NDArray) -> Part:
    """A part whose start goes to `place` (T, 2) and that is turned and stretched by `linear` (T, 2, 2)."""
    maps = np.concatenate([linear, (place - linear @ start)[..., None]], axis=-1)
    return Part(name, parent, limb, np.asarray(start, float), np.asarray(stop, float), maps)


def _linear(turn: NDArray, drawn: float, along: NDArray | float = 1.0, across: NDArray | float = 1.0) -> NDArray:
    """Maps (T, 2, 2) that stretch along the drawn direction and across it, then turn."""
    turn = np.asarray(turn, float)
    sizes = np.stack([np.broadcast_to(size, turn.shape) for size in (along, across)], axis=-1)
    return _rotations(turn + drawn) * sizes[:, None, :] @ _rotations(np.full(turn.shape, -drawn))


def _rotations(angle: NDArray) -> NDArray:
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([np.stack([c, -s], -1), np.stack([s, c], -1)], -2)


def _angle(vector: NDArray) -> float:
    return float(np.arctan2(vector[1], vector[0]))


def _below(joint: int, parents: tuple[int, ...]) -> list[int]:
    """The joint and all that hang on it."""
    inside = {joint}
    for other in range(joint + 1, len(parents)):
        if parents[other] in inside:
            inside.add(other)
    return sorted(inside)
