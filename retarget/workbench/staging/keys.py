"""The keys of who plays, corrected by hand: an SVG pulled or redrawn, an outline's points, a body's joints."""

from dataclasses import replace
from typing import Annotated, Any, Literal

import msgspec
import numpy as np
from msgspec import Meta

from capture.errors import InputError
from capture.motion import affine
from capture.pictures.encode import over
from retarget.characters.bodies.body import Body
from retarget.characters.drawings.paths import DrawnPath
from retarget.characters.photos.picture import Picture
from retarget.workbench.capturing import parts
from retarget.workbench.desks import Seen
from retarget.workbench.fields import At, Known, Number, Place
from retarget.workbench.staging import casts, limbs, playing, redraw, thumbs
from retarget.workbench.staging.staged import (
    cast_of,
    file_of_key,
    inside,
    motion_of,
    png,
    with_cast,
)
from retarget.workbench.state import State

Line = Annotated[list[At], Meta(min_length=2, max_length=5000)]


# --- actions --------------------------------------------------------------------------------------------------------


def drag_point(state: State, part: Known, key: Known, index: Number, to: At, reach: Place = 0.0) -> State:
    """Drag a point of a key's outline."""
    drawn = casts.key_of(cast_of(state), part, key)[1]
    if index >= len(drawn.outline):
        raise InputError(f"key {key!r} has an outline of {len(drawn.outline)} points, there is no point {index}")
    moved = parts.dragged(np.array(drawn.outline), index, to, reach)
    return with_cast(state, casts.with_key(cast_of(state), part, replace(drawn, outline=parts.rounded(moved))))


def outlines(state: State, part: Known) -> State:
    """Take a picture's outlines in hand."""
    cast, motion = cast_of(state), motion_of(state)
    one = next((one for one in cast.parts if one.name == part), None)
    target = next((who for who in playing.learnt(motion, cast) if who.part == part), None)
    if one is None or not one.keys or not isinstance(target, Picture):
        raise InputError(f"part {part[:40]!r} must be played by a picture with keys, to have outlines: choose another")
    shapes = affine.apply(target.keys.removed, target.keys.points)[:, target.keys.outline]
    known = dict(zip(target.keys.names, shapes, strict=True))
    drawn = tuple(replace(key, outline=parts.rounded(known[key.name])) for key in one.keys)
    new = replace(one, keys=drawn)
    return with_cast(state, replace(cast, parts=tuple(new if other is one else other for other in cast.parts)))


def pull(state: State, part: Known, key: Known, at: At, to: At, reach: Place) -> State:
    """Pull a key drawing into shape."""
    return _edited(state, part, key, redraw.pulled(_drawn(state, part, key), np.array(at), np.array(to), reach))


def draw(state: State, part: Known, key: Known, stroke: Number, line: Line) -> State:
    """Draw a stroke of a key anew."""
    return _edited(state, part, key, redraw.redrawn(_drawn(state, part, key), stroke, np.array(line)))


def joint(state: State, who: Known, part: Known, to: At, end: bool = False) -> State:
    """Drag a body's joint."""
    drag = limbs.ended if end else limbs.jointed
    return with_cast(state, drag(cast_of(state), who, part, to, _body(state, who)))


def lines(state: State, who: Known) -> State:
    """Give a body's limbs lines."""
    return with_cast(state, limbs.lined(cast_of(state), who, _body(state, who), motion_of(state)))


# --- looks ----------------------------------------------------------------------------------------------------------


def drawing(
    state: State, part: Known, key: Known, at: At | None = None, to: At | None = None, reach: Place = 0.0
) -> Seen:
    """The drawing of a key, with a pull at it if there is one: what `pull` would make of it."""
    held = (np.array(at), np.array(to), reach) if at is not None and to is not None else None
    file = file_of_key(state, part, key)
    picture = over(redraw.picture(file, held))  # paper, so that dark lines show
    return png(picture)._replace(said={"svg": file.suffix.lower() == ".svg"})


def strokes(state: State, part: Known, key: Known) -> Seen:
    """What a pen can catch of a key's drawing: the strokes' lines, as JSON."""
    file = file_of_key(state, part, key)
    redraw.check_svg(file)
    found = [[np.round(line, 2).tolist() for line in of_path] for of_path in redraw.lines_of(file)]
    return Seen("application/json", msgspec.json.encode(found))


def body(state: State, who: Known) -> Seen:
    """A body's drawing, and beside it where its limbs are."""
    told = limbs.body_of(cast_of(state), who)
    target = _body(state, who)
    picture = over(redraw.picture(inside(state, cast_of(state), told.drawing)))
    return png(picture)._replace(said={"limbs": limbs.seen(told, target, motion_of(state))})


def thumb(state: State, part: Known, key: Known, of: Literal["source", "own"] = "own") -> Seen:
    """A key in small: the source's, or that of who plays it."""
    if of == "source":
        return png(thumbs.source(state, motion_of(state), part, key))
    return png(thumbs.small(redraw.picture(file_of_key(state, part, key))))


ACTIONS: dict[str, Any] = {one.__name__: one for one in (drag_point, outlines, pull, draw, joint, lines)}
LOOKS: dict[str, Any] = {one.__name__: one for one in (drawing, strokes, body, thumb)}


def _drawn(state: State, part: str, key: str) -> list[DrawnPath]:
    file = file_of_key(state, part, key)
    redraw.check_svg(file)
    return redraw.read(file, file.stat().st_mtime_ns)[0]


def _edited(state: State, part: str, key: str, drawn: list[DrawnPath]) -> State:
    """The state with a key drawn so, and the part's other keys where that asks for it."""
    cast = cast_of(state)
    one = casts.key_of(cast, part, key)[0]
    files = [file_of_key(state, part, other.name) for other in one.keys]
    which = [other.name for other in one.keys].index(key)
    base, new = cast.folder.resolve(), cast
    for number, file in redraw.written(files, which, drawn).items():
        file = file.resolve()
        name = file.relative_to(base) if file.is_relative_to(base) else file
        new = casts.with_key(new, part, replace(one.keys[number], drawing=str(name)))
    return with_cast(state, new)


def _body(state: State, who: str) -> Body:
    cast = cast_of(state)
    limbs.body_of(cast, who)
    found = playing.learnt(motion_of(state), cast)
    return next(target for target in found if isinstance(target, Body) and target.inner.part == who)
