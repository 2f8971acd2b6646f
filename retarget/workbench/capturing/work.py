"""The long work of the capture desk, in a process of its own: to find keys, to capture, and to track again."""

from dataclasses import asdict, replace
from functools import cache, lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any

import msgspec
from msgspec import Meta

from capture.errors import InputError
from capture.motion import tracks
from capture.motion.tracks import CartoonMotion
from capture.pictures.shot import KeyDrawing, Part, Shot
from retarget.workbench.capturing import parts
from retarget.workbench.desks import Done
from retarget.workbench.fields import Name, Number
from retarget.workbench.state import MOTION, State, file_of


@lru_cache(maxsize=8)
def again_shown(motion: CartoonMotion, captured: Shot, shot: Shot) -> dict[str, Any]:
    """Which frames would be tracked again, {"part", "first", "last"} of each stretch; or why all must be captured."""
    from capture.fit import again

    planned = again.plan(shot, motion, captured)
    ranges = [{"part": part, "first": first, "last": last} for part, first, last in planned.ranges(shot.start)]
    return {"ranges": ranges, "whole": planned.whole}


@cache
def why_not_refined() -> str:
    """Why a capture cannot be refined here, or ""; told without importing what takes seconds."""
    missing = [name for name in ("torch", "kornia") if find_spec(name) is None]
    if not missing:
        return ""
    return f"refining needs torch and kornia, {missing[0]} is not installed: pip install 'tooncap[torch]'"


def suggest(shot: dict[str, Any], part: str, residual: float, keys: int) -> Done:
    """Find a part's keys."""
    from capture.fit import outlines, video
    from capture.fit import suggest as choosing
    from capture.progress import working

    told = msgspec.convert(shot, Shot)
    one = parts.part_of(told, part)
    clip = video.open_clip(told)
    followed = outlines.follow(one, clip, told.start)
    with working("choosing keys"):
        found = choosing.suggest(followed.points, residual, keys, followed.whole)
    keyed = choosing.with_keys(one, followed.points, found, told.start)
    drawn = [{"name": key.name, "frame": key.frame, "outline": key.outline} for key in keyed.keys]
    return Done({"part": part, "keys": drawn})


def suggested(state: State, part: str, keys: list[dict[str, Any]]) -> State:
    """Take the suggested keys."""
    drawn = [KeyDrawing(key["name"], key["frame"], tuple((x, y) for x, y in key["outline"])) for key in keys]
    one = parts.part_of(shot_of(state), part)
    return with_part(state, replace(one, keys=tuple(drawn), box=None, color=None, inside=(), outside=()))


def capture(shot: dict[str, Any], out: str, refined: bool = False) -> Done:
    """Capture the shot."""
    from capture.fit import again, batch, video

    told = msgspec.convert(shot, Shot)
    clip = video.open_clip(told)
    said = "" if refined else again.go_on(Path(out), told, clip)
    if said:
        said = f"The capture that was interrupted is finished; {said}."
    else:
        batch.capture_to(Path(out), told, clip, refined)
    return Done({"motion": out, "shot": shot}, said, (MOTION,))


def capture_again(shot: dict[str, Any], out: str, captured: dict[str, Any]) -> Done:
    """Track again what was changed."""
    from capture.fit import again

    told, before = (msgspec.convert(one, Shot) for one in (shot, captured))
    _, said = again.capture_again_to(Path(out), told, before=before)
    return Done({"motion": out, "shot": shot}, f"{said[:1].upper()}{said[1:]}.", (MOTION,))


def now_captured(state: State, motion: str, shot: dict[str, Any]) -> State:
    """Take what was captured; the shot may have been changed since the capture began."""
    return replace(state, motion=tracks.load(motion), captured=msgspec.convert(shot, Shot))


def prepare_suggest(
    state: State, part: Name, residual: Annotated[float, Meta(gt=0, le=100)] = 1.0, keys: Number = 8
) -> dict[str, Any]:
    _tellable(parts.part_of(shot_of(state), part))
    return {"shot": asdict(shot_of(state)), "part": part, "residual": residual, "keys": keys}


def prepare_capture(state: State, refined: bool = False) -> dict[str, Any]:
    for part in shot_of(state).parts:
        _tellable(part)
    if refined and (why := why_not_refined()):
        raise InputError(why)
    return {"shot": asdict(shot_of(state)), "out": str(file_of(state, MOTION)), "refined": refined}


def prepare_again(state: State) -> dict[str, Any]:
    if state.motion is None or state.captured is None:
        raise InputError("there must be something captured that can be tracked again: capture first")
    asked = prepare_capture(state)
    return {"shot": asked["shot"], "out": asked["out"], "captured": asdict(state.captured)}


def shot_of(state: State) -> Shot:
    if state.shot is None:
        raise InputError("a clip must be open for this: open one first")
    return state.shot


def with_part(state: State, part: Part) -> State:
    return replace(state, shot=parts.with_part(shot_of(state), part))


def is_told(part: Part) -> bool:
    """Whether it is said which pixels are the part's."""
    return bool(part.keys[0].outline or part.box or part.color or part.inside)


def _tellable(part: Part) -> None:
    if not is_told(part):
        raise InputError(f"part {part.name!r} must be shown first: draw a box round it, or its outline")
