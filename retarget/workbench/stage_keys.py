"""The keys of who plays, corrected by hand: an SVG pulled into shape, an outline's points, a body's joints."""

from dataclasses import replace
from typing import Any

import numpy as np

from capture.errors import InputError
from capture.pictures.encode import over
from retarget.workbench import casts, parts, redraw
from retarget.workbench.desks import Seen
from retarget.workbench.staged import At, Name, Number, Place, cast_of, file_of_key, png, with_cast
from retarget.workbench.state import State


def drag_point(state: State, part: Name, key: Name, index: Number, to: At, reach: Place = 0.0) -> State:
    """Drag a point of a key's outline."""
    drawn = casts.key_of(cast_of(state), part, key)[1]
    if index >= len(drawn.outline):
        raise InputError(f"key {key!r} has an outline of {len(drawn.outline)} points, there is no point {index}")
    moved = parts.dragged(np.array(drawn.outline), index, to, reach)
    return with_cast(state, casts.with_key(cast_of(state), part, replace(drawn, outline=parts.rounded(moved))))


def pull(state: State, part: Name, key: Name, at: At, to: At, reach: Place) -> State:
    """Pull a key drawing into shape."""
    cast = cast_of(state)
    drawn = casts.key_of(cast, part, key)[1]
    new = redraw.written(file_of_key(state, part, key), (np.array(at), np.array(to), reach))
    base = cast.folder.resolve()
    name = new.resolve().relative_to(base) if new.resolve().is_relative_to(base) else new.resolve()
    return with_cast(state, casts.with_key(cast, part, replace(drawn, drawing=str(name))))


def drawing(
    state: State, part: Name, key: Name, at: At | None = None, to: At | None = None, reach: Place = 0.0
) -> Seen:
    """The drawing of a key, with a pull at it if there is one: what `pull` would make of it."""
    held = (np.array(at), np.array(to), reach) if at is not None and to is not None else None
    file = file_of_key(state, part, key)
    picture = over(redraw.picture(file, held))  # paper, so that dark lines show
    return png(picture)._replace(said={"svg": file.suffix.lower() == ".svg"})


ACTIONS: dict[str, Any] = {one.__name__: one for one in (drag_point, pull)}
LOOKS: dict[str, Any] = {"drawing": drawing}
