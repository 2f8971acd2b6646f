"""`*.cast.toml`: which character plays which part.

    background = "white"                 # a colour, a picture or a clip; optional
    ground = true                        # feet stand where the source's feet stand; false leaves them as they come

    [[parts]]
    name = "frog"
    between = "rigid"                    # in-betweens as rigid as possible, "straight" lines, or "bend":
                                         # one drawing bent along a captured line of action
    height = 1.0                         # times the source's height
    pivot = [120.0, 80.0]                # where it turns, in the first key's drawing; the source's without it
    box = [40, 20, 300, 280]             # x, y, width, height: cuts a photograph out of its background

    [[parts.keys]]
    name = "sit"
    drawing = "bunny_sit.svg"            # relative to this file; a PNG or JPG may add outline = [[x, y], ...]

A drawing may be a 3-D model: a GLB, glTF, OBJ or PLY.  Its in-betweens go straight, its pivot is a point [x, y, z] of
it, and it has these fields more:

    plane = "zy"                         # seen from its side; "xy" its front, "-zy", "-xy", or [x, y, z] to the viewer
    depth = "volume"                     # what squash does to depth: "kept", "even", or keeping the "volume"
    distance = 4.0                       # of the viewer, times the model's size; no perspective without it
    carried = true                       # with no keys: they are made of the model's one shape, after the source's
    morphs = { Smile = 1.0 }             # of a key: its morph targets, where none has the key's own name
    animation = "Run"                    # of a key: a moment of one of the model's animations ("motion" in a BVH);
    time = 0.4                           # in seconds; joints then mix by angles
    joints = { elbow = [0, 0, 90] }      # of a key: joints turned from there, degrees about their own axes

A part with a `drawing` of its own and no keys keeps its shape: only the captured affine map is lent to it.
With keys, the part's `drawing` serves every key that names none; a picture that serves all of them and has no outlines
is bent as the captured keys are.
"""

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from capture.errors import InputError
from capture.files import written_beside
from capture.motion import keys
from retarget.characters import lift
from retarget.characters.backdrop import is_color
from retarget.characters.meshfiles import MODELS
from retarget.characters.target import REST

BEND = "bend"
BETWEEN = {"rigid": keys.rigid, "straight": keys.straight}
TALLEST = 1000.0  # times the source's height
DEPTHS = {"kept": lift.kept, "even": lift.even, "volume": lift.keeping_volume}


@dataclass(frozen=True)
class CastKey:
    """The drawing of one key; an outline, in its pixels, is for pictures, morph targets and poses are for models."""

    name: str
    drawing: str = ""
    outline: tuple[tuple[float, float], ...] = ()
    morphs: dict[str, float] = field(default_factory=dict)
    animation: str = ""
    time: float = 0.0
    joints: dict[str, tuple[float, float, float]] = field(default_factory=dict)


@dataclass(frozen=True)
class CastPart:
    """Who plays one part, and how."""

    name: str
    keys: tuple[CastKey, ...] = ()
    drawing: str = ""
    between: str = "rigid"
    height: float = 1.0
    pivot: tuple[float, ...] | None = None
    box: tuple[float, float, float, float] | None = None
    plane: str | tuple[float, float, float] = "xy"
    depth: str = "kept"
    distance: float | None = None
    carried: bool = False


@dataclass(frozen=True)
class Cast:
    """The characters of a performance; drawings are found from `folder`."""

    parts: tuple[CastPart, ...] = ()
    background: str = ""
    folder: Path = field(default=Path(), compare=False)
    ground: bool = True


def read_cast(path: str | Path) -> Cast:
    """Read a `*.cast.toml`; a misspelt, missing or impossible field is refused by its name."""
    import msgspec

    path = Path(path)
    try:
        stored = msgspec.toml.decode(path.read_bytes())
        cast = msgspec.convert(stored, Cast)
    except FileNotFoundError:
        raise InputError(f"a cast file must exist: there is no {path}") from None
    except (OSError, UnicodeDecodeError, msgspec.MsgspecError) as error:
        raise InputError(f"{path} must be a *.cast.toml that names parts and drawings: {error}") from None
    try:
        _refuse_unknown(stored)
        return _checked(replace(cast, folder=path.parent))
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def write_cast(cast: Cast, path: str | Path) -> None:
    """Write a `*.cast.toml`; drawings stay the same files, named from the new file's folder."""
    lines = []
    if cast.background:
        named = cast.background if is_color(cast.background) else _from(path, cast, cast.background)
        lines += [f"background = {_text(named)}", ""]
    if not cast.ground:
        lines += ["ground = false", ""]
    for part in cast.parts:
        lines += ["[[parts]]", f"name = {_text(part.name)}"]
        if part.drawing:
            lines.append(f"drawing = {_text(_from(path, cast, part.drawing))}")
        lines += [f"between = {_text(part.between)}", f"height = {float(part.height)!r}"]
        if part.pivot is not None:
            lines.append(f"pivot = {_numbers(part.pivot)}")
        if part.box is not None:
            lines.append(f"box = {_numbers(part.box)}")
        if part.plane != "xy":
            lines.append(f"plane = {_text(part.plane) if isinstance(part.plane, str) else _numbers(part.plane)}")
        if part.depth != "kept":
            lines.append(f"depth = {_text(part.depth)}")
        if part.distance is not None:
            lines.append(f"distance = {float(part.distance)!r}")
        if part.carried:
            lines.append("carried = true")
        for key in part.keys:
            lines += ["", "[[parts.keys]]", f"name = {_text(key.name)}"]
            if key.drawing:
                lines.append(f"drawing = {_text(_from(path, cast, key.drawing))}")
            if key.outline:
                lines.append(f"outline = [{', '.join(map(_numbers, key.outline))}]")
            if key.morphs:
                shares = (f"{_text(name)} = {float(share)!r}" for name, share in key.morphs.items())
                lines.append(f"morphs = {{ {', '.join(shares)} }}")
            if key.animation:
                lines += [f"animation = {_text(key.animation)}", f"time = {float(key.time)!r}"]
            if key.joints:
                turns = (f"{_text(name)} = {_numbers(turn)}" for name, turn in key.joints.items())
                lines.append(f"joints = {{ {', '.join(turns)} }}")
        lines.append("")
    with written_beside(path) as temporary:
        Path(temporary).write_text("\n".join(lines), encoding="utf-8")


def _checked(cast: Cast) -> Cast:
    for part in cast.parts:
        if part.between not in (*BETWEEN, BEND):
            known = ", ".join((*BETWEEN, BEND))
            raise InputError(f"part {part.name!r}: between must be one of {known}, it is {part.between!r}")
        if part.depth not in DEPTHS:
            raise InputError(f"part {part.name!r}: depth must be one of {', '.join(DEPTHS)}, it is {part.depth!r}")
        _check_space(part)
        if not 0 < part.height <= TALLEST:
            raise InputError(
                f"part {part.name!r}: height must be above 0 and at most {TALLEST:g}, times the source's, it is "
                f"{part.height}"
            )
        for name in ("pivot", "box"):
            if not np.isfinite(getattr(part, name) or 0.0).all():
                numbers = _numbers(getattr(part, name))
                raise InputError(f"part {part.name!r}: {name} must be finite numbers, it is {numbers}")
        for key in part.keys or (CastKey(REST),):
            if not (key.drawing or part.drawing):
                whose = f"key {key.name!r} of part {part.name!r}" if part.keys else f"part {part.name!r}"
                raise InputError(f'{whose} must have a drawing, it has none: add drawing = "file.svg"')
    return cast


def _check_space(part: CastPart) -> None:
    """Fields that only a model has, and a pivot of as many numbers as the drawing has directions."""
    files = [key.drawing or part.drawing for key in part.keys] or [part.drawing]
    solid = any(Path(file).suffix.lower() in (*MODELS, ".bvh") for file in files)
    if part.pivot is not None and len(part.pivot) != (3 if solid else 2):
        wanted = "[x, y, z] in a model" if solid else "[x, y] in a drawing"
        raise InputError(f"part {part.name!r}: pivot must be {wanted}, it is {_numbers(part.pivot)}")
    if part.carried and (not solid or part.keys):
        raise InputError(
            f"part {part.name!r}: carried is for a model without keys: give the part one model as its drawing"
        )
    if not solid and (part.plane != "xy" or part.depth != "kept" or part.distance is not None):
        raise InputError(
            f"part {part.name!r}: plane, depth and distance are for models, its drawing is none: leave them"
        )
    if part.box is not None and (solid or any(Path(file).suffix.lower() == ".svg" for file in files)):
        raise InputError(f"part {part.name!r}: box cuts out photographs (PNG, JPG), its drawing is none: leave it out")
    if part.distance is not None and not 1 < part.distance < np.inf:
        raise InputError(f"part {part.name!r}: distance must be above 1, times the model's size, it is {part.distance}")
    lift.view(part.plane)  # refuses a plane that is none


def _refuse_unknown(stored: dict[str, Any]) -> None:
    """Fields that are none are typing slips and would be passed over silently."""
    levels = [(Cast, stored)]
    parts = stored.get("parts", [])
    for part in parts if isinstance(parts, list) else []:
        levels.append((CastPart, part))
        keys = part.get("keys", []) if isinstance(part, dict) else []
        levels += [(CastKey, key) for key in keys if isinstance(keys, list)]
    for kind, table in levels:
        known = [one.name for one in fields(kind) if one.name != "folder"]
        unknown = [name for name in table if name not in known] if isinstance(table, dict) else []
        if unknown:
            raise InputError(
                f"{unknown[0]!r} is no field of a cast here, there are {', '.join(known)}: correct its name"
            )


def _from(path: str | Path, cast: Cast, drawing: str) -> str:
    """A drawing's name as seen from the folder of the file `path`."""
    return Path(os.path.relpath(cast.folder / drawing, Path(path).parent)).as_posix()


def _text(text: str) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _numbers(numbers: Sequence[float]) -> str:
    return f"[{', '.join(repr(float(number)) for number in numbers)}]"
