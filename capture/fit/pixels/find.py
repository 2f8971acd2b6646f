"""All parts of a shot in one picture: from the front to the back, each looked for where its parent carries it.

A drawing that is held is recognised and costs nothing.  When a fit shows too little of the part, other starts are
tried; when the best of those does no better, the part is not seen, and keeps its pose or goes with its parent.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from capture.fit.pixels import aside, cover, descend, expect, search
from capture.fit.pixels.belief import HIDDEN, IN_SIGHT, gap, is_clear, is_seen, preference
from capture.fit.pixels.cover import Cutout, Placed
from capture.fit.pixels.descend import Evidence, worth
from capture.fit.pixels.held import is_unchanged, rests
from capture.fit.pixels.sighting import Pose, Sighting, is_sane, margin
from capture.motion import affine
from capture.pictures import matte
from capture.pictures.held import is_held

__all__ = ["Pose", "Sighting", "find"]

FAR = 32  # pixels round the expected pose that are searched where nothing of the part's colour touches it
REMEMBERED = 100  # misfits that say what is ordinary
STIRRED = 4.0  # pixels: starts nearer to each other lead to the same fit
WORSE = 0.1  # by how much a doubtful fit must have lost in worth before other starts are tried once more


@dataclass(frozen=True, eq=False)
class Look:
    """One part to be found in one picture, and what is known of the others there."""

    image: NDArray  # (H, W, 3)
    part: Sighting
    expected: Pose  # where it is looked for first
    carried: Pose  # where it is if it is not seen: where it was, or where its parent takes it
    joint: NDArray | None  # (2,) where its parent holds it
    hidden: NDArray  # (H, W) uint8, 1 under parts in front
    others: list[Placed]


Found = tuple[Pose, Cutout, Evidence]  # a fit, the pixels it came from, and what they prove


def find(image: NDArray, parts: tuple[Sighting, ...]) -> tuple[Sighting, ...]:
    """All parts in the next picture (H, W, 3), in their order."""
    poses, parents = expect.expected(image, parts), expect.parents_of(parts)
    found: dict[int, Sighting] = {}
    for number in sorted(range(len(parts)), key=lambda number: -expect.order(parts[number])):
        part, parent, carried, joint = parts[number], parents[number], parts[number].pose, None
        if parent is not None:
            above = found[parent].pose if parent in found else poses[parent]
            carried = expect.carried(part, parts[parent].pose, above)
            joint = expect.joint(part, carried, above)
            poses[number] = carried if parent in found else poses[number]
        front = [other for other in found.values() if expect.order(other) > expect.order(part) and other.pose.visible]
        hidden = cover.mask([expect.placed(other) for other in front], image.shape)
        others = [
            Placed(other.model, other.colors, found[n].pose if n in found else poses[n])
            for n, other in enumerate(parts)
            if n != number
        ]
        found[number] = _next(Look(image, part, poses[number], carried, joint, hidden, others))
    return tuple(found[number] for number in range(len(parts)))


def _next(look: Look) -> Sighting:
    image, part = look.image, look.part
    if is_unchanged(image, part) or rests(image, part, look.hidden):
        return replace(part, pose=replace(part.pose, held=part.pose.visible, visible=True))
    if part.searched is not None and is_held(part.searched, image, (slice(None), slice(None))):
        return replace(part, pose=replace(look.carried, visible=False, held=False))
    pose, cut, seen = first = _first(look)
    doubted = 1.0
    if not is_clear(part, pose, seen):
        doubted = min(part.doubted, worth(pose, seen))
        covered = part.pose.visible and seen.known < HIDDEN
        if not part.pose.visible or (not covered and worth(pose, seen) < part.doubted - WORSE):
            pose, cut, seen = _best_of(look, first)
            doubted = worth(pose, seen)
    if not is_seen(part, look.expected, look.joint, pose, seen):
        return replace(part, pose=replace(look.carried, visible=False, held=False), searched=image, doubted=1.0)
    colors = part.colors
    if is_clear(part, pose, seen):
        colors = matte.adapt(colors, cut.picture, np.where(cut.known > 0, cut.soft, 0.5))
    return Sighting(
        part.model,
        colors,
        replace(pose, visible=True, held=False),
        misfits=(*part.misfits, pose.misfit)[-REMEMBERED:],
        drawn=image,
        hidden=look.hidden,
        before=part.pose.placed if part.pose.visible else None,
        doubted=doubted,
    )


def _first(look: Look) -> Found:
    """The fit from where the part is expected; if that is in doubt and elsewhere, from where it was as well."""
    pose, _, seen = first = _tried(look, look.expected)
    if is_clear(look.part, pose, seen) or gap(look.part, look.expected, look.part.pose) < STIRRED:
        return first
    return max(first, _tried(look, look.part.pose), key=lambda one: _preference(look, one))


def _tried(look: Look, start: Pose) -> Found:
    """The fit from one start, the pixels it came from, and what they prove."""
    part, model = look.part, look.part.model
    cut = _cutout(look, start)
    if cut.soft.max() < 0.5:
        cut = _cutout(look, start, FAR)
    frame = cover.as_layer(model.view, cut)
    pose = descend.fit(model, frame, start.placed)
    if not is_sane(model, pose):
        return start, cut, Evidence(0.0, 1.0)
    cleaned = cover.without_foreign(cut, model, pose, part.colors, look.others)
    if cleaned is not cut:
        cut, frame = cleaned, cover.as_layer(model.view, cleaned)
        pose = _if_sane(part, descend.fit(model, frame, pose.placed), pose)
    pose = _if_sane(part, aside.refitted(model, frame, pose), pose)
    seen = descend.evidence(model, frame, pose)
    at_first = descend.evidence(model, frame, start).known if frame.known is not None else 1.0
    if is_clear(part, pose, seen) and (frame.known is None or seen.known >= IN_SIGHT * at_first):
        return pose, cut, seen
    tries = [(pose, seen)]
    # small pictures mix what is in front with the part: the large ones alone may know better
    again = [descend.polish(model, frame, start)]
    for begin in (start, pose):
        freed = cover.without_stranger(cut, model, begin)
        if freed is not cut:
            again.append(descend.polish(model, cover.as_layer(model.view, freed), begin))
    tries += [(other, descend.evidence(model, frame, other)) for other in again if is_sane(model, other)]
    return max(((pose, cut, seen) for pose, seen in tries), key=lambda one: _preference(look, one))


def _best_of(look: Look, first: Found) -> Found:
    """The best of a doubtful fit and those from other starts."""
    part = look.part
    likely = [look.expected, part.pose]
    if part.before is not None:
        onward = affine.compose(part.pose.placed, affine.invert(part.before))
        likely.append(replace(part.pose, placed=affine.compose(onward, part.pose.placed)))
    tries = [first]
    for start in search.starts(look.image, look.hidden, part.model, part.colors, likely, look.joint):
        tries.append(_tried(look, start))
        pose, _, seen = tries[-1]
        if is_clear(part, pose, seen) and is_seen(part, look.expected, look.joint, pose, seen):
            break
    return max(tries, key=lambda one: _preference(look, one))


def _preference(look: Look, one: Found) -> tuple[bool, float]:
    return preference(look.part, look.expected, look.joint, one[0], one[2])


def _cutout(look: Look, start: Pose, reach: int = 0) -> Cutout:
    model = look.part.model
    return cover.cutout(look.image, look.hidden, look.others, look.part.colors, model, start, margin(model), reach)


def _if_sane(part: Sighting, pose: Pose, other: Pose) -> Pose:
    return pose if is_sane(part.model, pose) else other
