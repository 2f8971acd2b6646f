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
from numpy.typing import NDArray

from capture.errors import InputError
from capture.files import written_beside
from capture.motion import keys
from capture.motion.keys import KeySet
from capture.motion.tracks import CartoonMotion, Track
from capture.pictures.clip import Clip
from retarget.characters import lift
from retarget.characters.backdrop import is_color, read_background
from retarget.characters.bend import read_bent
from retarget.characters.carried import carried_shapes
from retarget.characters.drawing import read_drawing
from retarget.characters.mesh import mesh, read_mesh
from retarget.characters.meshfiles import MODELS, read_model
from retarget.characters.picture import read_picture
from retarget.characters.puppet import KeyPose, read_puppet
from retarget.characters.target import REST, Target

BEND = "bend"
BETWEEN = {"rigid": keys.rigid, "straight": keys.straight}
PICTURES = (".png", ".jpg", ".jpeg", ".webp")
DRAWINGS = (".svg", *PICTURES, *MODELS)
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


def cast_of(drawings: str | Path | Sequence[str | Path], motion: CartoonMotion) -> Cast:
    """A cast straight from drawings: one file for a part with one key, or a folder or list of files by name.

    One picture, or one 3-D model, can serve all keys of the only part.  Else a file plays the key its stem ends in
    (bunny_sit.svg plays sit); with several parts the stem ends in part_key, or in the part alone for one key.
    """
    named = [drawings] if isinstance(drawings, (str, Path)) else list(drawings)
    files = [file for name in named for file in _drawings_at(Path(name))]
    if len(motion.tracks) == 1 and len(files) == len(motion.tracks[0].keys) == 1:
        track = motion.tracks[0]
        return Cast((CastPart(track.part, (CastKey(track.keys[0], str(files[0])),)),))
    if len(motion.tracks) == len(files) == 1 and files[0].suffix.lower() in PICTURES:
        track = motion.tracks[0]
        return Cast((CastPart(track.part, tuple(CastKey(key) for key in track.keys), str(files[0])),))
    if len(motion.tracks) == 1 and len(files) == 1 and files[0].suffix.lower() in MODELS:
        return Cast((_alone(motion.tracks[0], files[0]),))
    found: dict[tuple[str, str], Path] = {}
    for file in files:
        role = _role_of(file, motion)
        if role in found:
            raise InputError(
                f"a key must have one drawing: {found[role].name} and {file.name} both end in the name of "
                f"key {role[1]!r} of part {role[0]!r}; keep one"
            )
        found[role] = file
    parts = []
    for track in motion.tracks:
        chosen = tuple(
            CastKey(name, str(found[track.part, name])) for name in track.keys if (track.part, name) in found
        )
        if chosen:
            parts.append(CastPart(track.part, chosen))
    return Cast(tuple(parts))


def _alone(track: Track, file: Path) -> CastPart:
    """One model for all keys: by its morph targets of their names, or bent after the source."""
    named = {name.lower() for name in read_model(file).morphs} & {name.lower() for name in track.keys}
    keys = tuple(CastKey(name) for name in track.keys) if named else ()
    return CastPart(track.part, keys, str(file), carried=not named)


def targets(cast: Cast, motion: CartoonMotion) -> list[Target]:
    """The characters of a cast, drawings read, keys in the motion's order."""
    return [_target(part, cast, motion) for part in cast.parts]


def backdrop(cast: Cast) -> str | NDArray | Clip | None:
    """The cast's background as `draw2d` takes it: a colour, a picture (H, W, 4), a clip, or None."""
    if is_color(cast.background):
        return cast.background
    return None if not cast.background else read_background(cast.folder / cast.background)


def _target(part: CastPart, cast: Cast, motion: CartoonMotion) -> Target:
    if part.between == BEND:
        target = _bent(part, cast, motion)
    elif part.carried:
        target = _carried(part, cast, motion)
    else:
        target = _keyed(part, cast, motion.track(part.name), motion.keyset(part.name))
    pivot = None if part.pivot is None else np.array(part.pivot, float)
    return replace(target, height=part.height, pivot=pivot)


def _bent(part: CastPart, cast: Cast, motion: CartoonMotion) -> Target:
    """The part's one SVG, bent along the captured line of action."""
    if part.keys or Path(part.drawing).suffix.lower() != ".svg":
        raise InputError(
            f"part {part.name!r}: a drawing that bends along a line must be one SVG and no keys, it has "
            f"{len(part.keys)} keys and drawing {part.drawing!r}: give the part drawing = an SVG file alone"
        )
    return read_bent(part.name, motion.keyset(part.name), cast.folder / part.drawing)


def _carried(part: CastPart, cast: Cast, motion: CartoonMotion) -> Target:
    """The part's one model, with keys carried over from the source's."""
    model, source = read_model(cast.folder / part.drawing), motion.keyset(part.name)
    shapes = carried_shapes(model, source, part.plane)
    target = mesh(part.name, source.names, model, shapes, part.plane, DEPTHS[part.depth])
    return replace(target, distance=part.distance)


def _keyed(part: CastPart, cast: Cast, track: Track, source: KeySet) -> Target:
    rest = not part.keys
    played = {key.name: key for key in part.keys}
    if not rest and (set(played) != set(track.keys) or len(played) < len(part.keys)):
        raise InputError(
            f"part {part.name!r}: the motion uses keys {', '.join(track.keys)}, the target has "
            f"{', '.join(key.name for key in part.keys)}: name each of the motion's keys once, "
            "or give the part one drawing and no keys to lend it the affine motion alone"
        )
    names = (REST,) if rest else track.keys
    keys = [CastKey(REST)] if rest else [played[name] for name in names]
    files = [cast.folder / (key.drawing or part.drawing) for key in keys]
    kinds = {file.suffix.lower() for file in files}
    between = BETWEEN[part.between]
    if kinds == {".svg"}:
        return read_drawing(part.name, names, files, between)
    if kinds <= set(PICTURES):
        outlines = [np.array(key.outline, float) if key.outline else None for key in keys]
        return read_picture(part.name, names, files, outlines, between, part.box, source)
    if any(key.animation or key.joints for key in keys):
        if len(set(files)) > 1 or any(key.morphs for key in keys):
            raise InputError(
                f"part {part.name!r}: a figure's poses must be of one file and without morphs: give it one"
            )
        poses = [KeyPose(key.animation, key.time, key.joints) for key in keys]
        puppet = read_puppet(part.name, names, files[0], poses, part.plane, DEPTHS[part.depth])
        return replace(puppet, body=replace(puppet.body, distance=part.distance))
    if kinds <= set(MODELS):
        morphs = [key.morphs for key in keys]
        model = read_mesh(part.name, names, files, morphs, part.plane, DEPTHS[part.depth])
        return replace(model, distance=part.distance)
    raise InputError(
        f"part {part.name!r}: its drawings must all be SVG, all pictures ({', '.join(PICTURES)}), or all models, "
        f"these are {', '.join(sorted(kinds))}: convert the others"
    )


def _checked(cast: Cast) -> Cast:
    for part in cast.parts:
        if part.between not in (*BETWEEN, BEND):
            known = ", ".join((*BETWEEN, BEND))
            raise InputError(f"part {part.name!r}: between must be one of {known}, it is {part.between!r}")
        if part.depth not in DEPTHS:
            raise InputError(f"part {part.name!r}: depth must be one of {', '.join(DEPTHS)}, it is {part.depth!r}")
        _check_space(part)
        if not 0 < part.height < np.inf:
            raise InputError(f"part {part.name!r}: height must be above 0, times the source's, it is {part.height}")
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


def _drawings_at(path: Path) -> list[Path]:
    """The file itself, or the drawings in a folder in order of their names."""
    if path.is_dir():
        files = sorted(file for file in path.iterdir() if file.suffix.lower() in DRAWINGS)
        if not files:
            raise InputError(f"{path} must hold drawings ({', '.join(DRAWINGS)}), it has none")
        return files
    if not path.is_file():
        raise InputError(f"a drawing must be a file that exists: there is no {path}")
    return [path]


def _role_of(file: Path, motion: CartoonMotion) -> tuple[str, str]:
    """The part and key a file's name ends in; the longest ending wins."""
    endings = {}
    for track in motion.tracks:
        for key in track.keys:
            endings[f"{track.part}_{key}"] = (track.part, key)
            if len(motion.tracks) == 1:
                endings[key] = (track.part, key)
        if len(track.keys) == 1:
            endings[track.part] = (track.part, track.keys[0])
    stem = _plain(file.stem)
    fitting = [end for end in endings if f"_{stem}".endswith(f"_{_plain(end)}")]
    if not fitting:
        raise InputError(
            f"a drawing's name must end in what it plays: {file.name} ends in none of {', '.join(endings)}; "
            "rename it, or write a cast file"
        )
    return endings[max(fitting, key=len)]


def _plain(name: str) -> str:
    return name.lower().replace("-", "_").replace(" ", "_")


def _from(path: str | Path, cast: Cast, drawing: str) -> str:
    """A drawing's name as seen from the folder of the file `path`."""
    return Path(os.path.relpath(cast.folder / drawing, Path(path).parent)).as_posix()


def _text(text: str) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _numbers(numbers: Sequence[float]) -> str:
    return f"[{', '.join(repr(float(number)) for number in numbers)}]"
