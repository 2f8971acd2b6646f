"""What a cast may say: the words it may use, and what must hold of its fields."""

from pathlib import Path

import numpy as np

from capture.errors import InputError
from capture.motion import keys
from retarget.characters.casts.castlist import Cast, CastBody, CastKeep, CastPart
from retarget.characters.models import lift
from retarget.characters.models.meshfiles import MODELS

BEND = "bend"
BETWEEN = {"rigid": keys.rigid, "straight": keys.straight}
TALLEST = 1000.0  # times the source's height
DEPTHS = {"kept": lift.kept, "even": lift.even, "volume": lift.keeping_volume}


def checked(cast: Cast) -> Cast:
    """The cast itself; what is impossible in it is refused by its name."""
    if cast.follow and (len(cast.follow) < 2 or not np.isfinite(cast.follow).all()):
        raise InputError(f"follow must be a path of 2 or more points [x, y] of the stage, it has {len(cast.follow)}")
    for body in cast.bodies:
        _check_body(body)
    for keep in cast.keep:
        _check_keep(keep, cast)
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
                said = list(getattr(part, name))
                raise InputError(f"part {part.name!r}: {name} must be finite numbers, it is {said}")
        missing = [f"key {key.name!r} of part {part.name!r}" for key in part.keys if not key.drawing]
        if not part.drawing and (missing or not part.keys):
            whose = missing[0] if missing else f"part {part.name!r}"
            raise InputError(f'{whose} must have a drawing, it has none: add drawing = "file.svg"')
    return cast


def _check_body(body: CastBody) -> None:
    said = f"body {body.drawing!r}"
    if not body.drawing:
        raise InputError('a body must have a drawing: add drawing = "file.svg"')
    if body.between not in BETWEEN or body.depth not in DEPTHS:
        raise InputError(f"{said}: between must be one of {', '.join(BETWEEN)}, and depth of {', '.join(DEPTHS)}")
    lift.view(body.plane)  # refuses a plane that is none
    if not 0 < body.height <= TALLEST or not (body.seam is None or 0 < body.seam < np.inf):
        raise InputError(f"{said}: height and seam must be above 0, they are {body.height} and {body.seam}")
    names = [limb.name for limb in body.parts]
    if len(set(names)) < len(names):
        raise InputError(f"{said}: each part must be named once, its parts are {', '.join(names)}")
    for limb in body.parts:
        if len(limb.line) not in (0, 2) or len(limb.region) in (1, 2):
            raise InputError(
                f"{said}: a line must have 2 points and a region 3 or more, part {limb.name!r} has {len(limb.line)} "
                f"and {len(limb.region)}"
            )
        if not np.isfinite([*sum(limb.line + limb.region, ()), *(limb.pivot or ())]).all():
            raise InputError(f"{said}: points of part {limb.name!r} must be finite numbers")


def _check_keep(keep: CastKeep, cast: Cast) -> None:
    played = [part.name for part in (*cast.parts, *(limb for body in cast.bodies for limb in body.parts))]
    anybody = any(not body.parts for body in cast.bodies)
    said = f"keep of part {keep.part!r}"
    if keep.part not in played and not anybody:
        raise InputError(f"{said}: the part must be one that is played, name one of {', '.join(played) or 'none'}")
    if keep.frames is not None and not 0 <= keep.frames[0] <= keep.frames[1]:
        raise InputError(f"{said}: frames must be the first and the last, from 0, they are {list(keep.frames)}")
    if keep.at is not None and keep.frames is None:
        raise InputError(f"{said}: a place needs the frames in which it is kept: add frames = [first, last]")
    if len(keep.point) not in (0, 2, 3) or not np.isfinite([*keep.point, *(keep.at or ())]).all():
        raise InputError(f"{said}: point and at must be [x, y], or a point [x, y, z] of a model, in finite numbers")
    if keep.bend is not None and len(keep.bend) not in (0, 2):
        raise InputError(
            f"{said}: bend must name two parts, the thigh and the shin, or none, it names {len(keep.bend)}"
        )
    if not 0 <= keep.stretch < np.inf:
        raise InputError(f"{said}: stretch must be 0 or more, a share of the leg's length, it is {keep.stretch}")


def _check_space(part: CastPart) -> None:
    """Fields that only a model has, and a pivot of as many numbers as the drawing has directions."""
    files = [key.drawing or part.drawing for key in part.keys] or [part.drawing]
    solid = any(Path(file).suffix.lower() in (*MODELS, ".bvh") for file in files)
    if part.pivot is not None and len(part.pivot) != (3 if solid else 2):
        wanted = "[x, y, z] in a model" if solid else "[x, y] in a drawing"
        raise InputError(f"part {part.name!r}: pivot must be {wanted}, it is {list(part.pivot)}")
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
