"""`*.cast.toml`: which character plays which part.

    background = "white"                 # a colour, a picture or a clip; optional
    ground = true                        # feet stand where the source's feet stand; false leaves them as they come
    follow = [[60, 400], [580, 360]]     # a path along the stage that the whole goes, from end to end; optional

    [[parts]]
    name = "frog"
    between = "rigid"                    # in-betweens as rigid as possible, "straight" lines, or "bend":
                                         # one drawing bent along a captured line of action
    height = 1.0                         # times the source's height
    pivot = [120.0, 80.0]                # where it turns, in the first key's drawing; the source's without it
    order = 3                            # higher is drawn later; in every frame the source's own without it
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

One drawing, photograph or model can play several parts, or all of them, and bend softly where they meet:

    [[bodies]]
    drawing = "figure.svg"
    seam = 30.0                          # pixels of the stage over which it bends; as the slimmest part is wide without
    height = 1.0
    frame = 0                            # it is drawn in the source's pose of this frame; of its keys 0 without it
    turned = true                        # its limbs are turned first to lie as the source's do, by their lines

    [[bodies.parts]]                     # none of them: it plays all parts, and is divided as the source is
    name = "near arm"
    line = [[90, 120], [40, 210]]        # from its joint to its end, in the drawing; or for all parts
    region = [[80, 110], [100, 120], ...]  # an outline round it, in the drawing
    pivot = [90, 120]                    # where it turns, if there is no line; the source's without it
    elements = ["arm", "hand"]           # ids in an SVG: elements and groups that are all this part, and cross others

A body has between, box, plane, depth and order as a part has.  Its drawing is one, so it has no keys.

What is to stay in a place says so, and all but the part can be left out:

    [[keep]]
    part = "shin"
    frames = [12, 20]                    # first and last, from 0; while the source's is on the ground without them
    point = [88.0, 301.0]                # in the first key's drawing; what is lowest without it
    at = [320.0, 400.0]                  # where on the stage; where it has come to without it
    bend = ["thigh", "shin"]             # the two parts that give way; the part and what it hangs on without it, the
                                         # whole figure where that hangs on nothing, or with bend = []
    stretch = 0.0                        # by what share of its length the leg may get longer, out of reach
"""

import json
import os
from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from capture.errors import InputError
from capture.files import written_beside
from capture.records import read_record
from retarget.characters.casts.backdrop import is_color
from retarget.characters.casts.castcheck import checked
from retarget.characters.casts.castlist import Cast, CastBody, CastKeep, CastKey, CastLimb, CastPart


def read_cast(path: str | Path) -> Cast:
    """Read a `*.cast.toml`; a misspelt, missing or impossible field is refused by its name."""

    def known(cast: Cast, stored: Any) -> Cast:
        _refuse_unknown(stored)
        return checked(replace(cast, folder=Path(path).parent))

    return read_record(path, Cast, known, "a cast", "a *.cast.toml that names parts and drawings")


def write_cast(cast: Cast, path: str | Path) -> None:
    """Write a `*.cast.toml`; drawings stay the same files, named from the new file's folder."""
    lines = []
    if cast.background:
        named = cast.background if is_color(cast.background) else _from(path, cast, cast.background)
        lines += [f"background = {_text(named)}", ""]
    if not cast.ground:
        lines += ["ground = false", ""]
    if cast.follow:
        lines += [f"follow = [{', '.join(map(_numbers, cast.follow))}]", ""]
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
        if part.order is not None:
            lines.append(f"order = {part.order}")
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
    for body in cast.bodies:
        lines += _body_lines(body, _from(path, cast, body.drawing))
    for keep in cast.keep:
        lines += _keep_lines(keep)
    with written_beside(path) as temporary:
        Path(temporary).write_text("\n".join(lines), encoding="utf-8")


def _keep_lines(keep: CastKeep) -> list[str]:
    lines = ["[[keep]]", f"part = {_text(keep.part)}"]
    if keep.frames is not None:
        lines.append(f"frames = [{keep.frames[0]}, {keep.frames[1]}]")
    lines += [f"{name} = {_numbers(place)}" for name, place in (("point", keep.point), ("at", keep.at)) if place]
    if keep.bend is not None:
        lines.append(f"bend = [{', '.join(map(_text, keep.bend))}]")
    return [*lines, f"stretch = {float(keep.stretch)!r}", ""]


def _body_lines(body: CastBody, drawing: str) -> list[str]:
    lines = ["[[bodies]]", f"drawing = {_text(drawing)}"]
    for one in fields(CastBody):
        value = getattr(body, one.name)
        if one.name not in ("drawing", "parts") and value != one.default:
            lines.append(f"{one.name} = {_value(value)}")
    for limb in body.parts:
        lines += ["", "[[bodies.parts]]", f"name = {_text(limb.name)}"]
        lines += [f"line = [{', '.join(map(_numbers, limb.line))}]"] if limb.line else []
        lines += [f"region = [{', '.join(map(_numbers, limb.region))}]"] if limb.region else []
        lines += [f"pivot = {_numbers(limb.pivot)}"] if limb.pivot is not None else []
        lines += [f"elements = [{', '.join(map(_text, limb.elements))}]"] if limb.elements else []
    return [*lines, ""]


def _value(value: str | bool | int | float | Sequence[float]) -> str:
    """A plain value as TOML has it."""
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, bool):
        return str(value).lower()
    return repr(value) if isinstance(value, (int, float)) else _numbers(value)


def _refuse_unknown(stored: dict[str, Any]) -> None:
    """Fields that are none are typing slips and would be passed over silently."""
    keeps = stored.get("keep", [])
    levels = [(Cast, stored), *((CastKeep, keep) for keep in keeps if isinstance(keeps, list))]
    for body in stored.get("bodies", []):
        levels += [(CastBody, body), *((CastLimb, limb) for limb in body.get("parts", []))]
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
