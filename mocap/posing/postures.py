"""Postures with an extent, that mix, and the pools they are kept in (Chen et al. 2004, section 4.2).

A posture says how joints are turned against a rest pose, as rotation vectors in the joint's own axes at rest.  Its
extent multiplies them: 0 is rest, 1 the posture, between them lies the slerp, and 2 turns as far again.  Postures that
turn different joints combine by being added, and so do those that turn the same.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.files import written_beside
from mocap import rotations
from mocap.body import Body
from mocap.skeleton import Skeleton, SkeletonMotion

VERSION = 1


@dataclass(frozen=True)
class Posture:
    """How joints are turned against rest; those that it does not name are not turned."""

    name: str
    turns: dict[str, tuple[float, float, float]] = field(default_factory=dict)  # radians, by the joint's name

    def __post_init__(self) -> None:
        if not (isinstance(self.name, str) and self.name.strip()):
            raise InputError(f"a posture must have a name, it came with {self.name!r}: name it")
        for joint, turn in self.turns.items():
            if np.shape(turn) != (3,) or not all(_is_number(angle) for angle in turn):
                raise InputError(
                    f"posture {self.name!r} must turn a joint by three finite numbers, {joint!r} came with {turn}"
                )


@dataclass(frozen=True)
class Pool:
    """Named postures of one kind of figure."""

    postures: tuple[Posture, ...]
    kind: str = ""  # "human", "quadruped", "plant", or what it is called

    def __post_init__(self) -> None:
        names = self.names()
        if not names:
            raise InputError("a pool must hold at least one posture, this one is empty: put a posture in")
        twice = [name for name in names if names.count(name) > 1]
        if twice:
            raise InputError(f"the postures of a pool must have names of their own, two are called {twice[0]!r}")

    def names(self) -> tuple[str, ...]:
        """What its postures are called, in their order."""
        return tuple(posture.name for posture in self.postures)

    def __getitem__(self, name: str) -> Posture:
        for posture in self.postures:
            if posture.name == name:
                return posture
        raise InputError(f"a posture must be one of {', '.join(self.names())}; the pool has no {name!r}")


def with_posture(pool: Pool, posture: Posture) -> Pool:
    """The pool and one posture more, in the place of the one of that name if there is one."""
    others = tuple(posture if posture.name == other.name else other for other in pool.postures)
    return Pool(others if posture in others else (*others, posture), pool.kind)


def turns_of(posture: Posture, skeleton: Skeleton, extent: float = 1.0) -> NDArray:
    """How a posture turns the joints of a skeleton to an extent (J, 3), radians; joints it has not are passed over."""
    if not _is_number(extent):
        raise InputError(f"the extent of a posture must be a number, 1 for all of it, {posture.name!r} has {extent}")
    turns = np.array([posture.turns.get(name, (0.0, 0.0, 0.0)) for name in skeleton.names], float)
    if posture.turns and not set(posture.turns) & set(skeleton.names):
        raise InputError(
            f"a posture must turn joints that the skeleton has, {posture.name!r} turns {next(iter(posture.turns))!r} "
            f"and the like, it has {', '.join(skeleton.names[:4])}, ...: take a pool made for it"
        )
    return extent * turns


def mixed(pool: Pool, extents: Mapping[str, float], skeleton: Skeleton) -> NDArray:
    """The turns (J, 3) of several postures of a pool at once, each to its extent."""
    turns = np.zeros((len(skeleton), 3))
    for name, extent in extents.items():
        turns += turns_of(pool[name], skeleton, extent)
    return turns


def combined(name: str, postures: Sequence[Posture], extents: Sequence[float] | None = None) -> Posture:
    """One posture of several, each to its extent."""
    extents = [1.0] * len(postures) if extents is None else extents
    turns: dict[str, NDArray] = {}
    for posture, extent in zip(postures, extents, strict=True):
        for joint, turn in posture.turns.items():
            turns[joint] = turns.get(joint, 0.0) + extent * np.array(turn, float)
    return Posture(name, {joint: _plain(turn) for joint, turn in turns.items()})


def only(posture: Posture, parts: Sequence[str], skeleton: Skeleton, body: Body) -> Posture:
    """What a posture does to some parts of the body, such as "left arm", fingers and all."""
    labels = set(body.label.tolist())
    unknown = [part for part in parts if part not in labels]
    if unknown:
        raise InputError(f"a part must be one of {', '.join(sorted(labels))}; this body has no {unknown[0]!r}")
    own = {name for name, label in zip(skeleton.names, body.label.tolist()) if label in parts}
    return Posture(posture.name, {joint: turn for joint, turn in posture.turns.items() if joint in own})


def posture_of(motion: SkeletonMotion, frame: int, name: str, rest: NDArray | None = None) -> Posture:
    """The pose of a frame as a posture, against joints turned as in `rest` (J, 4); where roots head is left out."""
    if not 0 <= frame < len(motion):
        raise InputError(f"a frame must be from 0 to {len(motion) - 1}, got {frame}: take another one")
    skeleton = motion.skeleton
    rest = unturned(skeleton) if rest is None else np.asarray(rest, float)
    own = motion.rotation[frame].copy()
    for root in (joint for joint, parent in enumerate(skeleton.parents) if parent < 0):
        own[root] = _ahead(own[root], rest[root])
    turns = rotations.turns_between(rest, own)
    return Posture(name, {joint: _plain(turn) for joint, turn in zip(skeleton.names, turns) if np.any(turn)})


def unturned(skeleton: Skeleton) -> NDArray:
    """A rest pose in which no joint is turned (J, 4)."""
    return np.tile([0.0, 0, 0, 1], (len(skeleton), 1))


def posed(skeleton: Skeleton, turns: NDArray, fps: float, rest: NDArray | None = None) -> SkeletonMotion:
    """The motion of joints turned by (T, J, 3) against `rest` (J, 4), roots where they are at rest."""
    turns = np.asarray(turns, float)
    rest = unturned(skeleton) if rest is None else rest
    rotation = turned(rest, turns)
    return SkeletonMotion(skeleton, np.tile(skeleton.offsets, (len(turns), 1, 1)), rotation, fps)


def turned(rotation: NDArray, turns: NDArray) -> NDArray:
    """Rotations (..., 4) and after them turns (..., 3), in the joints' own axes."""
    from scipy.spatial.transform import Rotation

    shape = np.broadcast_shapes(np.shape(rotation)[:-1], np.shape(turns)[:-1])
    first = Rotation.from_quat(np.broadcast_to(rotation, (*shape, 4)).reshape(-1, 4).copy())
    then = Rotation.from_rotvec(np.broadcast_to(turns, (*shape, 3)).reshape(-1, 3).copy())
    return (first * then).as_quat().reshape(*shape, 4)


def write_pool(pool: Pool, path: str | Path) -> None:
    """Write a `*.postures.json`, in full precision: what `read_pool` reads of it is equal."""
    stored = {
        "version": VERSION,
        "kind": pool.kind,
        "postures": [{"name": posture.name, "turns": posture.turns} for posture in pool.postures],
    }
    with written_beside(path) as beside:
        beside.write_text(json.dumps(stored, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def read_pool(path: str | Path) -> Pool:
    """Read a `*.postures.json`; a misspelt, missing or impossible field is refused by its name."""
    path = Path(path)
    try:
        stored = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(f"a pool of postures must be a file that exists: there is no {path}") from None
    except (OSError, ValueError) as error:
        raise InputError(f"{path} must be a *.postures.json, it cannot be read: {error}") from None
    try:
        _expect(stored, {"version": int, "kind": str, "postures": list}, "pool")
        if stored["version"] != VERSION:
            raise InputError(
                f"a pool must be of version {VERSION}, it is of {stored['version']}: read it with its tooncap"
            )
        postures = []
        for one in stored["postures"]:
            _expect(one, {"name": str, "turns": dict}, "posture")
            turns = {joint: tuple(turn) if isinstance(turn, list) else turn for joint, turn in one["turns"].items()}
            postures.append(Posture(one["name"], turns))
        return Pool(tuple(postures), stored["kind"])
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _expect(stored: Any, fields: dict[str, type], what: str) -> None:
    """Refuse a table with other fields, or other kinds of them."""
    if not isinstance(stored, dict):
        raise InputError(f"a {what} must be a table with {', '.join(fields)}, got {str(stored)[:40]!r}")
    for name in stored:
        if name not in fields:
            raise InputError(f"{name!r} is no field of a {what}, there are {', '.join(fields)}: correct its name")
    for name, kind in fields.items():
        if name not in stored or not isinstance(stored[name], kind) or isinstance(stored[name], bool):
            raise InputError(f"a {what} must have {name!r} as a {kind.__name__}, got {str(stored.get(name))[:40]!r}")


def _ahead(rotation: NDArray, rest: NDArray) -> NDArray:
    """A root's turn without what it turns about the vertical against rest."""
    from scipy.spatial.transform import Rotation

    from mocap import quaternions as quat

    now, start = Rotation.from_quat(rotation), Rotation.from_quat(rest)
    heading = float(quat.twist((now * start.inv()).as_quat(), np.array([0.0, 1, 0])))
    return (Rotation.from_rotvec([0, -heading, 0]) * now).as_quat()


def _plain(turn: NDArray) -> tuple[float, float, float]:
    return tuple(float(angle) for angle in turn)


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float, np.number)) and not isinstance(value, bool) and bool(np.isfinite(value))
