"""Who plays: a cast's drawings, pictures and models become targets; a cast can be made of drawings by their names."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.motion.keys import KeySet
from capture.motion.tracks import CartoonMotion, Track
from capture.pictures.clip import Clip
from retarget.characters.bodies.body import Body, Limb, body
from retarget.characters.casts.backdrop import is_color, read_background
from retarget.characters.casts.castcheck import BEND, BETWEEN, DEPTHS
from retarget.characters.casts.castlist import Cast, CastBody, CastKey, CastLimb, CastPart
from retarget.characters.drawings.bend import read_bent
from retarget.characters.drawings.drawing import read_drawing
from retarget.characters.figures.puppet import KeyPose, read_puppet
from retarget.characters.models.mesh import mesh, read_mesh
from retarget.characters.models.meshfiles import MODELS, read_model
from retarget.characters.photos.picture import read_picture
from retarget.characters.proposed.carried import carried_shapes
from retarget.characters.target import REST, Target

PICTURES = (".png", ".jpg", ".jpeg", ".webp")
DRAWINGS = (".svg", *PICTURES, *MODELS)


def cast_of(drawings: str | Path | Sequence[str | Path], motion: CartoonMotion) -> Cast:
    """A cast straight from drawings: one file for a part with one key, or a folder or list of files by name.

    One picture, or one 3-D model, can serve all keys of the only part, and one drawing whose name says nothing else
    plays all of several parts as one body.  Else a file plays the key its stem ends in
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
    if len(motion.tracks) > 1 and len(files) == 1 and not _endings(files[0], motion):
        return Cast(bodies=(CastBody(str(files[0])),))
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


def targets(cast: Cast, motion: CartoonMotion) -> list[Target]:
    """The characters of a cast, drawings read, keys in the motion's order."""
    return [*(_target(part, cast, motion) for part in cast.parts), *(_body(one, cast, motion) for one in cast.bodies)]


def backdrop(cast: Cast) -> str | NDArray | Clip | None:
    """The cast's background as `draw2d` takes it: a colour, a picture (H, W, 4), a clip, or None."""
    if is_color(cast.background):
        return cast.background
    return None if not cast.background else read_background(cast.folder / cast.background)


def _alone(track: Track, file: Path) -> CastPart:
    """One model for all keys: by its morph targets of their names, or bent after the source."""
    named = {name.lower() for name in read_model(file).morphs} & {name.lower() for name in track.keys}
    keys = tuple(CastKey(name) for name in track.keys) if named else ()
    return CastPart(track.part, keys, str(file), carried=not named)


def _target(part: CastPart, cast: Cast, motion: CartoonMotion) -> Target:
    if part.between == BEND:
        target = _bent(part, cast, motion)
    elif part.carried:
        target = _carried(part, cast, motion)
    else:
        target = _keyed(part, cast, motion.track(part.name), motion.keyset(part.name))
    pivot = None if part.pivot is None else np.array(part.pivot, float)
    return replace(target, height=part.height, pivot=pivot)


def _body(told: CastBody, cast: Cast, motion: CartoonMotion) -> Body:
    """One drawing for several parts, in one shape."""
    file = cast.folder / told.drawing
    kind = file.suffix.lower()
    between, limbs = BETWEEN[told.between], {limb.name: _limb(limb) for limb in told.parts}
    name, keys = told.drawing, (REST,)
    if kind == ".svg":
        apart = [limb.elements for limb in told.parts if limb.elements]
        inner = read_drawing(name, keys, [file], between, apart)
    elif kind in PICTURES:
        inner = read_picture(name, keys, [file], [None], between, told.box)
    elif kind in MODELS:
        inner = read_mesh(name, keys, [file], (), told.plane, DEPTHS[told.depth])
    else:
        raise InputError(f"a body's drawing must be one of {', '.join(DRAWINGS)}, it is {told.drawing!r}: convert it")
    return replace(body(inner, motion, limbs, told.seam, told.frame, told.turned), height=told.height)


def _limb(told: CastLimb) -> Limb:
    line, region = (np.array(points, float) if points else None for points in (told.line, told.region))
    return Limb(line, region, None if told.pivot is None else np.array(told.pivot, float), told.elements)


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
    endings = _names(motion)
    fitting = _endings(file, motion)
    if not fitting:
        raise InputError(
            f"a drawing's name must end in what it plays: {file.name} ends in none of {', '.join(endings)}; "
            "rename it, write a cast file, or let tooncap propose draw all keys from it"
        )
    return endings[max(fitting, key=len)]


def _endings(file: Path, motion: CartoonMotion) -> list[str]:
    stem = _plain(file.stem)
    return [end for end in _names(motion) if f"_{stem}".endswith(f"_{_plain(end)}")]


def _names(motion: CartoonMotion) -> dict[str, tuple[str, str]]:
    """What a file's name may end in, and the part and key that it then plays."""
    endings = {}
    for track in motion.tracks:
        for key in track.keys:
            endings[f"{track.part}_{key}"] = (track.part, key)
            if len(motion.tracks) == 1:
                endings[key] = (track.part, key)
        if len(track.keys) == 1:
            endings[track.part] = (track.part, track.keys[0])
    return endings


def _plain(name: str) -> str:
    return name.lower().replace("-", "_").replace(" ", "_")
