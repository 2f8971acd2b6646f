"""The stage seen from elsewhere: what the page needs to draw models itself, and pictures for a page that cannot."""

from typing import Any

import msgspec
import numpy as np

from capture.errors import InputError
from retarget.stage.perform import Role
from retarget.workbench.desks import Seen
from retarget.workbench.fields import Number, Place
from retarget.workbench.staging import orbit, playing, solids
from retarget.workbench.staging.staged import check_frame, number_of, played_of, png
from retarget.workbench.state import State


def space(state: State) -> Seen:
    """Who is on the stage, as JSON: models by what stays of them, drawings as layers."""
    told = solids.told(played_of(state).performance)
    return Seen("application/json", msgspec.json.encode({**told, "number": number_of(state)}))


def solid(state: State, who: Number) -> Seen:
    """What stays of a model: its corners' faces, the faces beside each, and its colours."""
    data, counts = solids.packed(_solid(state, who))
    return Seen("application/octet-stream", data, {**counts, "number": number_of(state)})


def places(state: State, who: Number, first: Number, count: Number = 1) -> Seen:
    """Where a model's corners are in some frames, float32 (frames, corners, 3); as many frames as go into a piece."""
    check_frame(state, first)
    data, count = solids.places(_solid(state, who), first, max(1, count))
    return Seen("application/octet-stream", data, {"first": first, "count": count, "number": number_of(state)})


def texture(state: State, who: Number, material: Number) -> Seen:
    """A material's texture."""
    return png(solids.texture(_solid(state, who), material))


def flat(state: State, who: Number, frame: Number) -> Seen:
    """A drawing alone in a frame, on the stage's page."""
    check_frame(state, frame)
    _role(state, who)
    return _numbered(state, png(solids.flat(played_of(state).performance, who, frame)))


def turned(state: State, frame: Number, turn: Place, tilt: Place = 0.0) -> Seen:
    """A frame with its models seen from elsewhere: turned and tilted by so many degrees."""
    check_frame(state, frame)
    played = played_of(state)
    seen = orbit.seen_from(played.performance, float(np.radians(turn)), float(np.radians(tilt)))
    return png(playing.picture(played._replace(performance=seen), frame))


LOOKS: dict[str, Any] = {one.__name__: one for one in (space, solid, places, texture, flat, turned)}


def _role(state: State, who: int) -> Role:
    roles = played_of(state).performance.roles
    if who >= len(roles):
        raise InputError(f"there are {len(roles)} on the stage, counted from 0; there is no number {who}")
    return roles[who]


def _solid(state: State, who: int) -> Role:
    role = _role(state, who)
    if not solids.is_solid(role):
        raise InputError(f"number {who} on the stage must be a model to be seen in space, it is a drawing")
    return role


def _numbered(state: State, seen: Seen) -> Seen:
    return seen._replace(said={"number": number_of(state)})
