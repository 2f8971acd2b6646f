"""Changes to a cast, as a person makes them; every function makes a new cast."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.motion import triangulate
from capture.motion.tracks import CartoonMotion
from retarget.characters.casts import cast as casting
from retarget.characters.casts.castfile import Cast, CastKeep, CastKey, CastPart
from retarget.characters.target import parts_of
from retarget.stage import staging
from retarget.stage.perform import Performance, Role


def played_by(files: Sequence[Path], motion: CartoonMotion, before: Cast | None) -> Cast:
    """A cast of drawings by their names; what stands behind, and where, stays as it was."""
    made = casting.cast_of(list(files), motion)
    return made if before is None else replace(made, background=before.background, ground=before.ground)


def standing(cast: Cast, name: str, **how: object) -> Cast:
    """The cast with a part or body, called by its part's name or its drawing's, made to stand otherwise."""
    parts = tuple(replace(part, **how) if part.name == name else part for part in cast.parts)
    bodies = tuple(replace(body, **how) if body.drawing == name else body for body in cast.bodies)
    if parts == cast.parts and bodies == cast.bodies and name not in names(cast):
        raise InputError(f"who plays must be one of {', '.join(names(cast))}, got {name[:60]!r}")
    return replace(cast, parts=parts, bodies=bodies)


def names(cast: Cast) -> list[str]:
    """What the cast's parts and bodies are called here."""
    return [*(part.name for part in cast.parts), *(body.drawing for body in cast.bodies)]


def key_of(cast: Cast, part: str, key: str) -> tuple[CastPart, CastKey]:
    """A part of the cast and its key of a name."""
    for one in cast.parts:
        for drawn in one.keys:
            if (one.name, drawn.name) == (part, key):
                return one, drawn
    known = ", ".join(f"{one.name} {drawn.name}" for one in cast.parts for drawn in one.keys)
    raise InputError(f"a key must be one of {known or 'none, for this cast has none'}; got {part[:40]} {key[:40]}")


def with_key(cast: Cast, part: str, key: CastKey) -> Cast:
    """The cast with a part's key of the same name in the place of the one there was."""
    one, old = key_of(cast, part, key.name)
    keyed = replace(one, keys=tuple(key if other is old else other for other in one.keys))
    return replace(cast, parts=tuple(keyed if other is one else other for other in cast.parts))


def pinned(cast: Cast, performance: Performance, frame: int, at: Sequence[float], last: int) -> Cast:
    """The cast with the point that is seen at `at` in a frame kept where it is, up to the frame `last`."""
    for role in sorted(performance.roles, key=lambda role: -role.order[frame]):
        found = _under(role, frame, np.array(at, float))
        if found is not None:
            part, point = found
            x, y = round(float(at[0]), 2), round(float(at[1]), 2)
            keep = CastKeep(part, (frame, max(last, frame)), tuple(round(float(v), 3) for v in point), (x, y))
            return replace(cast, keep=(*cast.keep, keep))
    raise InputError("a pin must be put on the character: click on the place that is to stay")


def pin_places(performance: Performance, cast: Cast, motion: CartoonMotion) -> list[list[float] | None]:
    """Where on the stage each kept point is in its first frame; None for those that the source's contacts tell."""
    from retarget.stage.direct import stays_of

    places = []
    for keep in cast.keep:
        if keep.frames is None:
            places.append(None)
            continue
        (stay,) = stays_of(performance, keep, motion)
        places.append([round(float(v), 2) for v in staging.foot_of(performance, stay)[stay.start]])
    return places


def _under(role: Role, frame: int, at: NDArray) -> tuple[str, NDArray] | None:
    """The part and the point of its first key that are seen at a place (2,) of a frame; None where it is not."""
    if not role.visible[frame]:
        return None
    mesh, keys = role.mesh()[frame], role.target.keys
    if mesh.shape[-1] == 3:
        nearest = int(np.linalg.norm(mesh[:, :2] - at, axis=1).argmin())
        size = np.ptp(mesh[:, :2], axis=0).max()
        if np.linalg.norm(mesh[nearest, :2] - at) > 0.05 * size:
            return None
        return parts_of(role.target)[0], keys.points[0, nearest]
    face, shares = triangulate.locate(at[None], mesh, keys.faces)
    corners = keys.faces[face[0]]
    if np.linalg.norm(shares[0] @ mesh[corners] - at) > 0.02 * np.ptp(mesh, axis=0).max():
        return None
    own = next((part for part in parts_of(role.target) if corners[shares[0].argmax()] in role.of(part)), None)
    return own or role.target.part, shares[0] @ keys.points[0, corners]
