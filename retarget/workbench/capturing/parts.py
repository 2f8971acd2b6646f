"""Changes to the parts of a shot, as a person makes them; every function makes a new shot."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.fit.curves import correspond
from capture.motion.tracks import CartoonMotion
from capture.pictures.shot import KeyDrawing, Part, Shot, check

SPACING = 6.0  # pixels between the points of an outline, as `capture.fit.outlines` has them
Point = tuple[float, float]


def part_of(shot: Shot, name: str) -> Part:
    """The part of that name; another is refused with the names there are."""
    found = next((part for part in shot.parts if part.name == name), None)
    if found is None:
        raise InputError(f"a part must be one of {', '.join(part.name for part in shot.parts)}, got {name[:60]!r}")
    return found


def key_of(part: Part, name: str) -> KeyDrawing:
    """The key of that name; another is refused with the names there are."""
    found = next((key for key in part.keys if key.name == name), None)
    if found is None:
        raise InputError(f"a key must be one of {', '.join(key.name for key in part.keys)}, got {name[:60]!r}")
    return found


def with_part(shot: Shot, part: Part, name: str = "") -> Shot:
    """The shot with a part in the place of the one called `name`, or of its own name."""
    name = name or part.name
    return check(replace(shot, parts=tuple(part if one.name == name else one for one in shot.parts)))


def with_key(part: Part, key: KeyDrawing, name: str = "") -> Part:
    """The part with a key in the place of the one called `name`, or of its own name."""
    name = name or key.name
    return replace(part, keys=tuple(key if one.name == name else one for one in part.keys))


def told(part: Part, frame: int, **how: object) -> Part:
    """The part told anew, by box, colour or scribbles in one frame; its keys go, for they were of something else."""
    blank = {"box": None, "color": None, "inside": (), "outside": ()}
    return replace(part, keys=(KeyDrawing("rest", frame),), **{**blank, **how})


def outlined(part: Part, frame: int, points: NDArray) -> Part:
    """The part with a drawn outline (B, 2) in a frame.

    Where it has outlines already the new one gets points that correspond to theirs; the key of that frame is drawn
    anew, or one is added.
    """
    if len(points) < 3:
        raise InputError(f"an outline must have 3 points or more, this one has {len(points)}: draw round the part")
    if not np.ptp(points, axis=0).min() > 2:
        raise InputError("an outline must enclose something, this one is a line: draw round the part")
    others = [key for key in part.keys if key.outline and key.frame != frame]
    if not others:
        from capture.motion.triangulate import resample

        around = np.linalg.norm(np.diff(points, axis=0, append=points[:1]), axis=1).sum()
        even = resample(points, int(np.clip(round(around / SPACING), 16, 120)))
        return replace(told(part, frame), keys=(KeyDrawing("rest", frame, rounded(even)),))
    nearest = min(others, key=lambda key: abs(key.frame - frame))
    positions = correspond.match(np.array(nearest.outline), points)
    return keyed(part, frame, correspond.places(points, positions, True))


def keyed(part: Part, frame: int, points: NDArray) -> Part:
    """The part with outline points (B, 2) that correspond to its others as the key of a frame."""
    here = next((key for key in part.keys if key.frame == frame), None)
    if here is not None:
        return with_key(part, replace(here, outline=rounded(points)))
    names = {key.name for key in part.keys}
    name = next(name for name in (f"k{frame}", *(f"k{frame}-{n}" for n in range(2, 99))) if name not in names)
    return replace(part, keys=(*part.keys, KeyDrawing(name, frame, rounded(points))))


def fixed(part: Part, motion: CartoonMotion, frame: int, first: int = 0) -> Part:
    """The part with what was captured in a frame as a key there, to be corrected; the motion's frame 0 is `first`.

    A part that was told by box, colour or scribbles gets the outline that was traced for its first key as well.
    """
    t = frame - first
    if not 0 <= t < len(motion.times):
        raise InputError(f"frame {frame} lies outside what was captured, {first} to {first + len(motion.times) - 1}")
    if any(key.frame == frame and key.outline for key in part.keys):
        raise InputError(f"part {part.name!r} has a key in frame {frame} already: drag its points")
    count = len(part.keys[0].outline)
    if not count:
        keyset, (key, *_) = motion.keyset(part.name), part.keys
        traced = tuple((float(x), float(y)) for x, y in keyset.points[0, keyset.outline])  # to the last bit: it stays
        told = replace(part, keys=(replace(key, outline=traced),), box=None, color=None, inside=(), outside=())
        return keyed(told, frame, motion.outline(part.name)[t])
    points = motion.points(part.name)[t]
    if count > len(points):
        raise InputError(f"part {part.name!r} was drawn anew since it was captured: capture it again first")
    return keyed(part, frame, points[:count])  # a mesh begins with the points of the outline that it was made of


def dragged(outline: NDArray, index: int, to: Point, reach: float) -> NDArray:
    """The outline (B, 2) with a point put elsewhere; its neighbours within `reach` pixels go along, less and less."""
    steps = np.linalg.norm(np.diff(outline, axis=0, append=outline[:1]), axis=1)
    at = np.concatenate([[0.0], np.cumsum(steps)])
    away = np.abs(at[:-1] - at[index])
    away = np.minimum(away, at[-1] - away)
    share = np.where(away < reach, 0.5 + 0.5 * np.cos(np.pi * np.minimum(away / max(reach, 1e-9), 1)), 0.0)
    share[index] = 1.0
    return outline + share[:, None] * (np.array(to) - outline[index])


def rounded(points: NDArray) -> tuple[Point, ...]:
    """Points (B, 2) as a shot keeps them: to a thousandth of a pixel."""
    return tuple((float(x), float(y)) for x, y in np.round(points, 3))
