"""The capture desk: tell the parts of a clip, choose and correct their keys, capture, and look where it is worst."""

from dataclasses import asdict, replace
from functools import cache, lru_cache
from importlib.util import find_spec
from itertools import count
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np
from msgspec import Meta

from capture.errors import InputError
from capture.motion import tracks
from capture.motion.tracks import CartoonMotion
from capture.pictures.shot import KeyDrawing, Part, Shot, check
from retarget.workbench import parts, pictures
from retarget.workbench.desks import Desk, Seen, Work
from retarget.workbench.state import MOTION, State, file_of

Number = Annotated[int, Meta(ge=0, le=10_000_000)]
Place = Annotated[float, Meta(ge=-1e5, le=1e5)]
At = tuple[Place, Place]
Line = Annotated[list[At], Meta(min_length=1, max_length=5000)]
Name = Annotated[str, Meta(min_length=1, max_length=60)]
_numbers = count(1)  # of motions, so that the page knows one from another
MARKED = 5  # worst frames that the page marks
MATTE = (62, 150, 255)  # what the page lays over a part's pixels


def shown(state: State) -> dict[str, Any]:
    """The clip, the parts, and what the capture came to."""
    if state.shot is None:
        motion = _motion_shown(state.motion, 0)
        return {"clip": None, "parts": [], "motion": motion, "stale": False, "again": None, "kept": False}
    stale = state.motion is not None and not _same(state.captured, state.shot)
    return {
        "clip": _clip_shown(state.shot),
        "parts": _parts_shown(state.shot),
        "motion": _motion_shown(state.motion, state.shot.start),
        "stale": stale,
        "again": _again_shown(state.motion, state.captured, state.shot) if stale else None,
        "kept": file_of(state, MOTION + ".part").exists(),
        "refining": _why_not_refined(),
    }


# --- actions: (state, fields) -> state ----------------------------------------------------------------------------


def add_part(state: State, name: Name, frame: Number = 0) -> State:
    """Add a part."""
    shot = _shot(state)
    return replace(state, shot=check(replace(shot, parts=(*shot.parts, Part(name, (KeyDrawing("rest", frame),))))))


def remove_part(state: State, part: Name) -> State:
    """Remove a part."""
    shot, gone = _shot(state), parts.part_of(_shot(state), part)
    left = tuple(replace(one, parent=gone.parent) if one.parent == part else one for one in shot.parts if one != gone)
    return replace(state, shot=check(replace(shot, parts=left)))


def rename_part(state: State, part: Name, to: Name) -> State:
    """Rename a part."""
    shot = _shot(state)
    renamed = replace(parts.part_of(shot, part), name=to)
    others = tuple(replace(one, parent=to) if one.parent == part else one for one in shot.parts)
    return replace(state, shot=parts.with_part(replace(shot, parts=others), renamed, part))


def hang_part(state: State, part: Name, parent: str = "", order: int | None = None) -> State:
    """Say what a part hangs on, and whether it is in front."""
    one = parts.part_of(_shot(state), part)
    return _with(state, replace(one, parent=parent, order=one.order if order is None else order))


def box(state: State, part: Name, frame: Number, box: tuple[Place, Place, Place, Place]) -> State:
    """Draw a box round a part."""
    width, height = pictures.clip_of(_shot(state)).size
    x, y, w, h = box
    left, top = max(min(x, x + w), 0.0), max(min(y, y + h), 0.0)
    right, bottom = min(max(x, x + w), width), min(max(y, y + h), height)
    if right - left < 4 or bottom - top < 4:
        raise InputError("a box must have some size: drag from one corner of the part to the other")
    inside = (round(left, 1), round(top, 1), round(right - left, 1), round(bottom - top, 1))
    return _with(state, parts.told(parts.part_of(_shot(state), part), frame, box=inside))


def color(state: State, part: Name, frame: Number, at: At) -> State:
    """Pick a part's colour."""
    picture = pictures.frame(_shot(state), frame)
    x, y = round(at[0]), round(at[1])
    if not (0 <= x < picture.shape[1] and 0 <= y < picture.shape[0]):
        raise InputError("a colour must be picked inside the picture: click on the part")
    around = picture[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2, :3].reshape(-1, 3)
    picked = tuple(int(channel) for channel in np.median(around, axis=0))
    return _with(state, parts.told(parts.part_of(_shot(state), part), frame, color=picked))


def scribble(state: State, part: Name, frame: Number, stroke: Line, inside: bool = True) -> State:
    """Scribble on a part, or on what is not the part."""
    one = parts.part_of(_shot(state), part)
    if not (one.inside or one.outside) or one.keys[0].frame != frame or one.keys[0].outline:
        one = parts.told(one, frame)
    line = tuple((round(x, 1), round(y, 1)) for x, y in stroke)
    more = {"inside": (*one.inside, line)} if inside else {"outside": (*one.outside, line)}
    return _with(state, replace(one, **more))


def outline(state: State, part: Name, frame: Number, points: Line) -> State:
    """Draw a part's outline."""
    one = parts.part_of(_shot(state), part)
    return _with(state, parts.outlined(one, frame, np.array(points, float)))


def drag_point(state: State, part: Name, key: Name, index: Number, to: At, reach: Place = 0.0) -> State:
    """Drag a point of a key's outline."""
    one = parts.part_of(_shot(state), part)
    drawn = parts.key_of(one, key)
    if index >= len(drawn.outline):
        raise InputError(f"key {key!r} has {len(drawn.outline)} points, there is no point {index}")
    moved = parts.dragged(np.array(drawn.outline), index, to, reach)
    return _with(state, parts.with_key(one, replace(drawn, outline=parts.rounded(moved))))


def fix_frame(state: State, part: Name, frame: Number) -> State:
    """Make a captured frame a key, to correct it."""
    if state.motion is None:
        raise InputError("a frame can be mended once something was captured: capture first, or draw an outline here")
    one = parts.part_of(_shot(state), part)
    return _with(state, parts.fixed(one, state.motion, frame, _shot(state).start))


def pivot(state: State, part: Name, at: At | None = None) -> State:
    """Move a part's pivot."""
    one = parts.part_of(_shot(state), part)
    return _with(state, replace(one, pivot=None if at is None else (round(at[0], 2), round(at[1], 2))))


def remove_key(state: State, part: Name, key: Name) -> State:
    """Remove a key."""
    one = parts.part_of(_shot(state), part)
    left = tuple(other for other in one.keys if other != parts.key_of(one, key))
    if not left:
        raise InputError("the last key of a part cannot go: remove the part, or draw it anew")
    return _with(state, replace(one, keys=left))


def rename_key(state: State, part: Name, key: Name, to: Name) -> State:
    """Rename a key."""
    one = parts.part_of(_shot(state), part)
    return _with(state, parts.with_key(one, replace(parts.key_of(one, key), name=to), key))


def stretch(state: State, start: Number, stop: Number | None = None) -> State:
    """Choose the stretch of the clip to capture."""
    shot = _shot(state)
    frames = len(pictures.clip_of(shot))
    end = frames if stop is None else stop
    if not start < end <= frames:
        raise InputError(f"the stretch must begin before it ends and lie in 0 to {frames}, got {start} to {end}")
    shot = replace(shot, parts=tuple(one if _is_told(one) else parts.told(one, start) for one in shot.parts))
    outside = [f"{p.name} {k.name}" for p in shot.parts for k in p.keys if not start <= k.frame < end]
    if outside:
        raise InputError(f"key drawings must lie in the stretch, {outside[0]} does not: choose more, or remove it")
    return replace(state, shot=replace(shot, start=start, stop=None if end == frames else end))


# --- looks: (state, fields) -> bytes; nothing changes ---------------------------------------------------------------


def frame(state: State, frame: Number) -> Seen:
    """A frame of the clip."""
    return pictures.encoded(_shot(state), frame)


def matte(state: State, part: Name, key: str = "") -> Seen:
    """Which pixels are taken for a part's, in one of its keys' frames: a PNG to lay over the frame."""
    one = parts.part_of(_shot(state), part)
    drawn = next((drawn for drawn in one.keys if drawn.name == key), one.keys[0])
    return _matte(replace(_shot(state), parts=(replace(one, parent="", keys=(drawn,)),)))


@lru_cache(maxsize=16)
def _matte(shot: Shot) -> Seen:
    """The matte of a shot's one part in its one key."""
    from capture.fit.pixels import model
    from capture.pictures import matte as mattes

    (part,) = shot.parts
    number = part.keys[0].frame
    seed = model.seed(part, [pictures.frame(shot, number)[..., :3]])[0]
    alpha = mattes.cut_key(mattes.learn([seed]), seed)
    over = np.empty((*alpha.shape, 4), np.uint8)
    over[..., :3] = MATTE
    over[..., 3] = np.round(255 * alpha)
    return Seen("image/png", pictures.png(over), {"frame": number, "covers": int((alpha > 0.5).sum())})


def captured(state: State, part: Name) -> Seen:
    """A part's captured outline in all frames: float32 (T, B, 2), little end first."""
    if state.motion is None:
        raise InputError("nothing was captured yet")
    points = state.motion.outline(part).astype("<f4")
    return Seen("application/octet-stream", points.tobytes(), {"shape": list(points.shape)})


# --- work: long, in a process of its own ----------------------------------------------------------------------------


def suggest(shot: dict[str, Any], part: str, residual: float, keys: int) -> dict[str, Any]:
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
    return {"part": part, "keys": drawn}


def suggested(state: State, part: str, keys: list[dict[str, Any]]) -> State:
    """Take the suggested keys."""
    drawn = [KeyDrawing(key["name"], key["frame"], tuple((x, y) for x, y in key["outline"])) for key in keys]
    one = parts.part_of(_shot(state), part)
    return _with(state, replace(one, keys=tuple(drawn), box=None, color=None, inside=(), outside=()))


def capture(shot: dict[str, Any], out: str, refined: bool = False) -> dict[str, Any]:
    """Capture the shot."""
    from capture.fit import again, batch, video

    told = msgspec.convert(shot, Shot)
    clip = video.open_clip(told)
    said = "" if refined else again.go_on(Path(out), told, clip)
    if said:
        said = f"The capture that was interrupted is finished; {said}."
    else:
        batch.capture_to(Path(out), told, clip, refined)
    return {"motion": out, "shot": shot, "written": [MOTION], "said": said}


def capture_again(shot: dict[str, Any], out: str, captured: dict[str, Any]) -> dict[str, Any]:
    """Track again what was changed."""
    from capture.fit import again

    told, before = (msgspec.convert(one, Shot) for one in (shot, captured))
    _, said = again.capture_again_to(Path(out), told, before=before)
    return {"motion": out, "shot": shot, "written": [MOTION], "said": f"{said[:1].upper()}{said[1:]}."}


def now_captured(state: State, motion: str, shot: dict[str, Any]) -> State:
    """Take what was captured; the shot may have been changed since the capture began."""
    return replace(state, motion=tracks.load(motion), captured=msgspec.convert(shot, Shot))


def _prepare_suggest(
    state: State, part: Name, residual: Annotated[float, Meta(gt=0, le=100)] = 1.0, keys: Number = 8
) -> dict[str, Any]:
    _tellable(parts.part_of(_shot(state), part))
    return {"shot": asdict(_shot(state)), "part": part, "residual": residual, "keys": keys}


def _prepare_capture(state: State, refined: bool = False) -> dict[str, Any]:
    for part in _shot(state).parts:
        _tellable(part)
    if refined and (why := _why_not_refined()):
        raise InputError(why)
    return {"shot": asdict(_shot(state)), "out": str(file_of(state, MOTION)), "refined": refined}


def _prepare_again(state: State) -> dict[str, Any]:
    if state.motion is None or state.captured is None:
        raise InputError("there must be something captured that can be tracked again: capture first")
    asked = _prepare_capture(state)
    return {"shot": asked["shot"], "out": asked["out"], "captured": asdict(state.captured)}


DESK = Desk(
    "capture",
    shown,
    actions={
        one.__name__: one
        for one in (
            *(add_part, remove_part, rename_part, hang_part),
            *(box, color, scribble, outline, stretch),
            *(drag_point, fix_frame, remove_key, rename_key, pivot),
        )
    },
    looks={"frame": frame, "matte": matte, "captured": captured},
    work={
        "suggest": Work(_prepare_suggest, suggest, suggested),
        "capture": Work(_prepare_capture, capture, now_captured),
        "again": Work(_prepare_again, capture_again, now_captured),
    },
)


def _same(captured: Shot | None, shot: Shot) -> bool:
    """Whether two shots ask for the same capture; their clip may be named from another folder."""
    return captured is None or replace(captured, clip=shot.clip) == shot


def _shot(state: State) -> Shot:
    if state.shot is None:
        raise InputError("a clip must be open for this: open one first")
    return state.shot


def _with(state: State, part: Part) -> State:
    return replace(state, shot=parts.with_part(_shot(state), part))


def _is_told(part: Part) -> bool:
    """Whether it is said which pixels are the part's."""
    return bool(part.keys[0].outline or part.box or part.color or part.inside)


def _tellable(part: Part) -> None:
    if not _is_told(part):
        raise InputError(f"part {part.name!r} must be shown first: draw a box round it, or its outline")


def _clip_shown(shot: Shot) -> dict[str, Any]:
    clip = pictures.clip_of(shot)
    stop = len(clip) if shot.stop is None else shot.stop
    size = {"width": clip.size[0], "height": clip.size[1]}
    return {
        "name": Path(shot.clip).name,
        **size,
        "frames": len(clip),
        "fps": clip.fps,
        "start": shot.start,
        "stop": stop,
    }


@lru_cache(maxsize=8)
def _again_shown(motion: CartoonMotion, captured: Shot, shot: Shot) -> dict[str, Any]:
    """Which frames would be tracked again, {"part", "first", "last"} of each stretch; or why all must be captured."""
    from capture.fit import again

    planned = again.plan(shot, motion, captured)
    ranges = [{"part": part, "first": first, "last": last} for part, first, last in planned.ranges(shot.start)]
    return {"ranges": ranges, "whole": planned.whole}


@cache
def _why_not_refined() -> str:
    """Why a capture cannot be refined here, or ""; told without importing what takes seconds."""
    missing = [name for name in ("torch", "kornia") if find_spec(name) is None]
    if not missing:
        return ""
    return f"refining needs torch and kornia, {missing[0]} is not installed: pip install 'tooncap[torch]'"


@lru_cache(maxsize=8)
def _parts_shown(shot: Shot) -> list[dict[str, Any]]:
    return [asdict(part) for part in shot.parts]  # msgspec leaves out what came by default


@lru_cache(maxsize=8)
def _motion_shown(motion: CartoonMotion | None, first: int) -> dict[str, Any] | None:
    """What the timeline shows; frames are the clip's own numbers."""
    if motion is None:
        return None
    total = np.max([track.residual for track in motion.tracks], axis=0)
    inner = np.pad(total, 1, constant_values=-1)
    peaks = np.flatnonzero((total >= inner[:-2]) & (total > inner[2:]))
    worst = peaks[np.argsort(-total[peaks], kind="stable")][:MARKED]
    parts_shown = [
        {
            "name": track.part,
            "keys": list(track.keys),
            "residual": np.round(track.residual, 3).tolist(),
            "lost": np.flatnonzero(~track.visible).tolist(),
            "held": np.flatnonzero(track.held).tolist(),
            "weights": np.round(track.key_weights(), 3).tolist(),
        }
        for track in motion.tracks
    ]
    return {
        "number": next(_numbers),
        "first": first,
        "frames": len(motion.times),
        "parts": parts_shown,
        "worst": [int(t) + first for t in worst],
        "said": tracks.summary(motion, first),
    }
