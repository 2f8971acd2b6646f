"""A body's limbs as a person sees and drags them: where each part turns on its drawing, and where it ends."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.motion import affine
from capture.motion.tracks import CartoonMotion, total_affine
from retarget.characters.bodies.body import Body
from retarget.characters.casts.castfile import Cast, CastBody, CastLimb
from retarget.characters.places import box_of, onto


def body_of(cast: Cast, who: str) -> CastBody:
    """The body that is called by its drawing."""
    for body in cast.bodies:
        if body.drawing == who:
            return body
    known = ", ".join(body.drawing for body in cast.bodies) or "none, for nobody plays several parts"
    raise InputError(f"a body must be one of {known}; got {who[:60]!r}")


def seen(body: CastBody, target: Body, motion: CartoonMotion) -> list[dict[str, Any]]:
    """Every part's joint, its end, and whether it was told or is the source's; in the drawing's pixels."""
    told = {limb.name: limb for limb in body.parts}
    shown = []
    for part, (joint, end) in _lines(target, motion).items():
        limb = told.get(part, CastLimb(part))
        if limb.line:
            joint, end = np.array(limb.line)
        if limb.pivot is not None:
            joint = np.array(limb.pivot)
        shown.append(
            {
                "part": part,
                "joint": np.round(joint, 2).tolist(),
                "end": np.round(end, 2).tolist() if limb.line else None,
                "told": bool(limb.line) or limb.pivot is not None,
            }
        )
    return shown


def jointed(cast: Cast, who: str, part: str, to: tuple[float, float], target: Body) -> Cast:
    """The cast with a part of a body turning about another place."""
    limb = _limb(cast, who, part, target)
    at = _rounded(to)
    new = replace(limb, line=(at, limb.line[1]), pivot=None) if limb.line else replace(limb, pivot=at)
    return _with(cast, who, new, target)


def ended(cast: Cast, who: str, part: str, to: tuple[float, float], target: Body) -> Cast:
    """The cast with a part of a body, that has a line, ending elsewhere."""
    limb = _limb(cast, who, part, target)
    if not limb.line:
        raise InputError(f"part {part[:40]!r} must have a line for its end to be dragged: give the limbs lines first")
    return _with(cast, who, replace(limb, line=(limb.line[0], _rounded(to))), target)


def lined(cast: Cast, who: str, target: Body, motion: CartoonMotion) -> Cast:
    """The cast with a line for every limb of a body, as the source's limbs lie; what was told stays."""
    lines = _lines(target, motion)
    for part, line in lines.items():
        limb = _limb(cast, who, part, target)
        if limb.elements or limb.line:
            continue
        start = line[0] if limb.pivot is None else limb.pivot
        new = replace(limb, line=(_rounded(start), _rounded(line[1])), pivot=None, region=())
        cast = _with(cast, who, new, target)
    return cast


def _lines(target: Body, motion: CartoonMotion) -> dict[str, NDArray]:
    """From joint to end (2, 2) of the source's parts, on the drawing: the end lies as far beyond their middle."""
    outlines = {part: motion.outline(part)[target.frame] for part in target.parts}
    back = affine.invert(onto(target.box, box_of(np.concatenate(list(outlines.values())))))
    lines = {}
    for part, outline in outlines.items():
        track = motion.track(part)
        joint = affine.apply(total_affine(motion, part)[target.frame], track.pivot[None])[0]
        end = 2 * outline.mean(axis=0) - joint
        far = outline[np.linalg.norm(outline - joint, axis=1).argmax()]
        if np.linalg.norm(end - joint) < 0.5 * np.linalg.norm(far - joint):  # it turns about its middle
            end = far
        lines[part] = affine.apply(back, np.stack([joint, end]))
    return lines


def _limb(cast: Cast, who: str, part: str, target: Body) -> CastLimb:
    if part not in target.parts:
        raise InputError(f"a part of the body must be one of {', '.join(target.parts)}, got {part[:40]!r}")
    return next((limb for limb in body_of(cast, who).parts if limb.name == part), CastLimb(part))


def _with(cast: Cast, who: str, limb: CastLimb, target: Body) -> Cast:
    body = body_of(cast, who)
    told = body.parts or tuple(CastLimb(part) for part in target.parts)
    new = replace(body, parts=tuple(limb if one.name == limb.name else one for one in told))
    return replace(cast, bodies=tuple(new if one is body else one for one in cast.bodies))


def _rounded(place: NDArray | tuple[float, float]) -> tuple[float, float]:
    return round(float(place[0]), 2), round(float(place[1]), 2)
