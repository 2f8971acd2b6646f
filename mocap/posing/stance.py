"""`*.posing.json`: how a figure stands, what of it is pinned, how its springs and rubber feel, and its music.

    {
      "version": 1,
      "places": {"Hips": [0.0, 0.92, 0.0], ...},          metres, x right, y up, z to the viewer
      "turns": {"Hips": [0.0, 0.0, 0.0, 1.0], ...},       quaternions x, y, z, w, in the world
      "pinned": ["LeftFoot"],
      "extents": {"arms up": 0.5},                        of the postures that are mixed in it
      "feel": {"quick": 2.5, "omega": 3.0},               sliders that are not as they are without saying
      "music": {"file": "song.mp3", "times": [0.51, 1.02, ...], "bpm": 117.6, "seconds": 181.2, "pace": 0.5}
    }

It lies beside NAME.postures.json and NAME.dance.toml, and says with them all that was done with a figure.
"""

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np

from capture.errors import InputError
from capture.files import written_beside
from capture.records import read_record
from mocap.posing.beats import Beats, doubled, halved
from mocap.posing.poses import Pose
from mocap.skeletons.skeleton import Skeleton

VERSION = 1
PACES = (0.25, 0.5, 1.0, 2.0)
"""How many of the beats that were found are danced: every fourth, every second, all, or twice as many."""


@dataclass(frozen=True)
class Music:
    """A piece of music, and the beats that were found in it."""

    file: str  # named from where the stance lies
    times: tuple[float, ...]  # seconds
    bpm: float
    seconds: float
    pace: float = 1.0  # one of PACES

    def beats(self) -> Beats:
        """The beats to dance."""
        found = Beats(np.array(self.times, float), self.bpm, self.seconds)
        if self.pace == 2:
            return doubled(found)
        for _ in range(round(-np.log2(self.pace))):
            found = halved(found)
        return found


@dataclass(frozen=True)
class Stance:
    """What the file holds."""

    places: dict[str, tuple[float, float, float]]
    turns: dict[str, tuple[float, float, float, float]]
    pinned: tuple[str, ...] = ()
    extents: dict[str, float] = field(default_factory=dict)
    feel: dict[str, float] = field(default_factory=dict)
    music: Music | None = None
    version: int = VERSION


def stance_of(
    skeleton: Skeleton,
    pose: Pose,
    pinned: tuple[int, ...] = (),
    extents: dict[str, float] | None = None,
    feel: dict[str, float] | None = None,
    music: Music | None = None,
) -> Stance:
    """A pose and what belongs to it, by the joints' names."""
    names = skeleton.names
    places = {name: tuple(place) for name, place in zip(names, pose.positions.tolist(), strict=True)}
    turns = {name: tuple(turn) for name, turn in zip(names, pose.turns.tolist(), strict=True)}
    pinned = tuple(names[joint] for joint in pinned)
    return Stance(places, turns, pinned, dict(extents or {}), dict(feel or {}), music)


def pose_of(stance: Stance, skeleton: Skeleton) -> Pose:
    """The pose on a skeleton; InputError where that has other joints."""
    if set(skeleton.names) != set(stance.places):
        other = sorted(set(skeleton.names) ^ set(stance.places))[0]
        raise InputError(
            f"a pose must be of the figure's own joints, {other!r} is in one of the two only: move the file away, or "
            "give the figure it was made with"
        )
    places = np.array([stance.places[name] for name in skeleton.names], float)
    turns = np.array([stance.turns[name] for name in skeleton.names], float)
    return Pose(places, turns / np.linalg.norm(turns, axis=1, keepdims=True))


def pinned_of(stance: Stance, skeleton: Skeleton) -> tuple[int, ...]:
    """The joints that are pinned."""
    return tuple(skeleton.names.index(name) for name in stance.pinned)


def write_stance(stance: Stance, path: str | Path) -> None:
    """Write a `*.posing.json`, in full precision: what `read_stance` reads of it is equal."""
    stored = asdict(stance)
    lines = [f" {json.dumps(name)}: {json.dumps(stored[name], ensure_ascii=False)}" for name in ("version", *stored)]
    with written_beside(path) as beside:
        beside.write_text("{\n" + ",\n".join(dict.fromkeys(lines)) + "\n}\n", encoding="utf-8")


def read_stance(path: str | Path) -> Stance:
    """Read a `*.posing.json`; a misspelt, missing or impossible field is refused by its name."""
    return read_record(path, Stance, _checked, "a pose", "a *.posing.json")


def _checked(stance: Stance, stored: dict) -> Stance:
    for kind, table in ((Stance, stored), (Music, stored.get("music") or {})):
        unknown = [name for name in table if name not in kind.__dataclass_fields__]
        if unknown:
            known = ", ".join(kind.__dataclass_fields__)
            raise InputError(f"{unknown[0]!r} is no field of a pose, there are {known}: correct its name")
    if stance.version != VERSION:
        raise InputError(
            f"a pose must be of version {VERSION}, it is of {stance.version}: read it with the tooncap that wrote it"
        )
    if set(stance.places) != set(stance.turns) or not set(stance.pinned) <= set(stance.places):
        raise InputError("a pose must say of the same joints where they are and how they turn, and pin some of them")
    numbers = [*stance.places.values(), *stance.turns.values(), tuple(stance.extents.values())]
    if not all(abs(number) < 1e7 for row in numbers for number in row):  # false for NaN
        raise InputError("a pose must hold finite numbers, some are not")
    if not all(np.linalg.norm(turn) > 1e-6 for turn in stance.turns.values()):
        raise InputError("a pose must turn joints by quaternions, one is 0")
    music = stance.music
    if music is not None:
        rising = len(music.times) > 1 and (np.diff(music.times) > 0).all()
        if not (rising and 0 < music.seconds < 1e6 and 0 < music.bpm < 1e4 and music.pace in PACES):
            raise InputError(
                "music must have two beats or more whose times rise, a length, a tempo and a pace of "
                f"{', '.join(f'{pace:g}' for pace in PACES)}"
            )
    return stance
