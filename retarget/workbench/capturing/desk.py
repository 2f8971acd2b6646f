"""The capture desk: tell the parts of a clip, choose and correct their keys, capture, and look where it is worst."""

from dataclasses import asdict, replace
from functools import lru_cache
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
from retarget.workbench import pictures
from retarget.workbench.capturing import parts, work
from retarget.workbench.capturing.work import shot_of, with_part
from retarget.workbench.desks import Desk, Seen, Work
from retarget.workbench.fields import At, Name, Number, Place
from retarget.workbench.state import MOTION, State, file_of

Line = Annotated[list[At], Meta(min_length=1, max_length=5000)]
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
        "again": work.again_shown(state.motion, state.captured, state.shot) if stale else None,
        "kept": file_of(state, MOTION + ".part").exists(),
        "refining": work.why_not_refined(),
    }


# --- actions: (state, fields) -> state ----------------------------------------------------------------------------


def add_part(state: State, name: Name, frame: Number = 0) -> State:
    """Add a part."""
    shot = shot_of(state)
    return replace(state, shot=check(replace(shot, parts=(*shot.parts, Part(name, (KeyDrawing("rest", frame),))))))


def remove_part(state: State, part: Name) -> State:
    """Remove a part."""
    shot, gone = shot_of(state), parts.part_of(shot_of(state), part)
    left = tuple(replace(one, parent=gone.parent) if one.parent == part else one for one in shot.parts if one != gone)
    return replace(state, shot=check(replace(shot, parts=left)))


def rename_part(state: State, part: Name, to: Name) -> State:
    """Rename a part."""
    shot = shot_of(state)
    renamed = replace(parts.part_of(shot, part), name=to)
    others = tuple(replace(one, parent=to) if one.parent == part else one for one in shot.parts)
    return replace(state, shot=parts.with_part(replace(shot, parts=others), renamed, part))


def hang_part(state: State, part: Name, parent: str = "", order: int | None = None) -> State:
    """Say what a part hangs on, and whether it is in front."""
    one = parts.part_of(shot_of(state), part)
    return with_part(state, replace(one, parent=parent, order=one.order if order is None else order))


def box(state: State, part: Name, frame: Number, box: tuple[Place, Place, Place, Place]) -> State:
    """Draw a box round a part."""
    width, height = pictures.clip_of(shot_of(state)).size
    x, y, w, h = box
    left, top = max(min(x, x + w), 0.0), max(min(y, y + h), 0.0)
    right, bottom = min(max(x, x + w), width), min(max(y, y + h), height)
    if right - left < 4 or bottom - top < 4:
        raise InputError("a box must have some size: drag from one corner of the part to the other")
    inside = (round(left, 1), round(top, 1), round(right - left, 1), round(bottom - top, 1))
    return with_part(state, parts.told(parts.part_of(shot_of(state), part), frame, box=inside))


def color(state: State, part: Name, frame: Number, at: At) -> State:
    """Pick a part's colour."""
    picture = pictures.frame(shot_of(state), frame)
    x, y = round(at[0]), round(at[1])
    if not (0 <= x < picture.shape[1] and 0 <= y < picture.shape[0]):
        raise InputError("a colour must be picked inside the picture: click on the part")
    around = picture[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2, :3].reshape(-1, 3)
    picked = tuple(int(channel) for channel in np.median(around, axis=0))
    return with_part(state, parts.told(parts.part_of(shot_of(state), part), frame, color=picked))


def scribble(state: State, part: Name, frame: Number, stroke: Line, inside: bool = True) -> State:
    """Scribble on a part, or on what is not the part."""
    one = parts.part_of(shot_of(state), part)
    if not (one.inside or one.outside) or one.keys[0].frame != frame or one.keys[0].outline:
        one = parts.told(one, frame)
    line = tuple((round(x, 1), round(y, 1)) for x, y in stroke)
    more = {"inside": (*one.inside, line)} if inside else {"outside": (*one.outside, line)}
    return with_part(state, replace(one, **more))


def outline(state: State, part: Name, frame: Number, points: Line) -> State:
    """Draw a part's outline."""
    one = parts.part_of(shot_of(state), part)
    return with_part(state, parts.outlined(one, frame, np.array(points, float)))


def drag_point(state: State, part: Name, key: Name, index: Number, to: At, reach: Place = 0.0) -> State:
    """Drag a point of a key's outline."""
    one = parts.part_of(shot_of(state), part)
    drawn = parts.key_of(one, key)
    if index >= len(drawn.outline):
        raise InputError(f"key {key!r} has {len(drawn.outline)} points, there is no point {index}")
    moved = parts.dragged(np.array(drawn.outline), index, to, reach)
    return with_part(state, parts.with_key(one, replace(drawn, outline=parts.rounded(moved))))


def fix_frame(state: State, part: Name, frame: Number) -> State:
    """Make a captured frame a key, to correct it."""
    if state.motion is None:
        raise InputError("a frame can be mended once something was captured: capture first, or draw an outline here")
    one = parts.part_of(shot_of(state), part)
    return with_part(state, parts.fixed(one, state.motion, frame, shot_of(state).start))


def pivot(state: State, part: Name, at: At | None = None) -> State:
    """Move a part's pivot."""
    one = parts.part_of(shot_of(state), part)
    return with_part(state, replace(one, pivot=None if at is None else (round(at[0], 2), round(at[1], 2))))


def remove_key(state: State, part: Name, key: Name) -> State:
    """Remove a key."""
    one = parts.part_of(shot_of(state), part)
    left = tuple(other for other in one.keys if other != parts.key_of(one, key))
    if not left:
        raise InputError("the last key of a part cannot go: remove the part, or draw it anew")
    return with_part(state, replace(one, keys=left))


def rename_key(state: State, part: Name, key: Name, to: Name) -> State:
    """Rename a key."""
    one = parts.part_of(shot_of(state), part)
    return with_part(state, parts.with_key(one, replace(parts.key_of(one, key), name=to), key))


def stretch(state: State, start: Number, stop: Number | None = None) -> State:
    """Choose the stretch of the clip to capture."""
    shot = shot_of(state)
    frames = len(pictures.clip_of(shot))
    end = frames if stop is None else stop
    if not start < end <= frames:
        raise InputError(f"the stretch must begin before it ends and lie in 0 to {frames}, got {start} to {end}")
    shot = replace(shot, parts=tuple(one if work.is_told(one) else parts.told(one, start) for one in shot.parts))
    outside = [f"{p.name} {k.name}" for p in shot.parts for k in p.keys if not start <= k.frame < end]
    if outside:
        raise InputError(f"key drawings must lie in the stretch, {outside[0]} does not: choose more, or remove it")
    return replace(state, shot=replace(shot, start=start, stop=None if end == frames else end))


# --- looks: (state, fields) -> bytes; nothing changes ---------------------------------------------------------------


def frame(state: State, frame: Number) -> Seen:
    """A frame of the clip."""
    return pictures.encoded(shot_of(state), frame)


def matte(state: State, part: Name, key: str = "") -> Seen:
    """Which pixels are taken for a part's, in one of its keys' frames: a PNG to lay over the frame."""
    one = parts.part_of(shot_of(state), part)
    drawn = next((drawn for drawn in one.keys if drawn.name == key), one.keys[0])
    return _matte(replace(shot_of(state), parts=(replace(one, parent="", keys=(drawn,)),)))


def moving(state: State, frame: Number) -> Seen:
    """A box round what moves in a frame, as JSON: [x, y, width, height]."""
    from retarget.workbench.capturing import moving

    shot = shot_of(state)
    here, last = pictures.frame(shot, frame), len(pictures.clip_of(shot)) - 1
    others = sorted({round(t) for t in np.linspace(0, last, moving.LOOKED_AT)} - {frame})
    found = moving.box([pictures.frame(shot, t) for t in others], here)
    if found is None:
        raise InputError("nothing stands out by its moving in this frame: draw a box round the part")
    return Seen("application/json", msgspec.json.encode(found))


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
    looks={"frame": frame, "matte": matte, "moving": moving, "captured": captured},
    work={
        "suggest": Work(work.prepare_suggest, work.suggest, work.suggested),
        "capture": Work(work.prepare_capture, work.capture, work.now_captured),
        "again": Work(work.prepare_again, work.capture_again, work.now_captured),
    },
)


def _same(captured: Shot | None, shot: Shot) -> bool:
    """Whether two shots ask for the same capture; their clip may be named from another folder."""
    return captured is None or replace(captured, clip=shot.clip) == shot


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
