"""All parts of a shot in one picture: from the front to the back, each looked for where its parent carries it.

A drawing that is held is recognised and costs nothing.  When a fit shows too little of the part, other starts are
tried; when the best of those does no better, the part is not seen, and keeps its pose or goes with its parent.
"""

from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from capture.fit.pixels import cover, descend, layer, search
from capture.fit.pixels.cover import Cutout, Placed
from capture.fit.pixels.descend import Evidence, worth
from capture.fit.pixels.sighting import Pose, Sighting, is_sane, outline
from capture.motion import affine
from capture.pictures import matte

__all__ = ["Pose", "Sighting", "find", "is_held"]

# what a fit is worth: the share of the part that is there, of what can be seen of it, times that of its telling pixels
CLEAR = 0.7  # from here on nothing else is tried
SEEN = 0.22  # below it the part is lost
BACK = 0.4  # this much is asked for a part that was lost, or that is not where it was expected
# shares of the part that must be in sight for a picture to say anything about it
HIDDEN, HIDDEN_BACK = 0.1, 0.3
FAR = 32  # pixels round the expected pose that are searched where nothing of its colour touches it
REACH = 64.0  # pixels a drawing may jump between frames, beyond its own size's share
REMEMBERED = 100  # misfits that say what is ordinary


def find(image: NDArray, parts: tuple[Sighting, ...]) -> tuple[Sighting, ...]:
    """All parts in the next picture (H, W, 3), in their order."""
    expected = _expected(image, parts)
    found: dict[int, Sighting] = {}
    for number in sorted(range(len(parts)), key=lambda number: -_order(parts[number])):
        part = parts[number]
        front = [_placed(other) for other in found.values() if _order(other) > _order(part) and other.pose.visible]
        others = [
            Placed(other.model, other.colors, found[n].pose if n in found else expected[n])
            for n, other in enumerate(parts)
            if n != number
        ]
        hidden = cover.mask(front, image.shape)
        found[number] = _next(image, part, expected[number], hidden, others)
    return tuple(found[number] for number in range(len(parts)))


def is_held(before: NDArray, image: NDArray, window: tuple[slice, slice], where: NDArray | None = None) -> bool:
    """Whether a picture shows the same drawing as the one before: nothing but noise has changed in the window.

    `where` (H, W), if given, says which pixels of the window count.
    """
    change = cv2.absdiff(before[window], image[window]).max(axis=-1)
    change = cv2.GaussianBlur(change.astype(np.float32), (0, 0), 1.5)
    if where is not None:
        change = change[where[window] > 0]
    most, usual = np.percentile(change, [99.5, 50])
    return bool(most < 3.0 or most < min(4.0 * usual, 16.0))


def _expected(image: NDArray, parts: tuple[Sighting, ...]) -> list[Pose]:
    """Where every part is looked for: parents are roughly found first, and carry what hangs on them."""
    numbers = {part.model.part.name: number for number, part in enumerate(parts)}
    parents = [numbers.get(part.model.part.parent) for part in parts]
    expected: dict[int, Pose] = {}
    carried: dict[int, NDArray] = {}  # maps from where a part was to where it is
    while len(expected) < len(parts):
        for number, (part, parent) in enumerate(zip(parts, parents)):
            if number in expected or (parent is not None and parent not in expected):
                continue
            pose = part.pose
            if parent is not None:
                pose = replace(pose, placed=affine.compose(carried[parent], pose.placed))
                pose = pose if is_sane(part.model, pose) else part.pose
            if number in parents and pose.visible and not _unchanged(image, part):
                in_front = [_placed(other) for other in parts if _order(other) > _order(part) and other.pose.visible]
                others = [_placed(other) for other in parts if other is not part]
                pose = _roughly(image, part, pose, cover.mask(in_front, image.shape, FAR // 4), others)
            expected[number] = pose
            carried[number] = affine.compose(pose.placed, affine.invert(part.pose.placed))
    return [expected[number] for number in range(len(parts))]


def _roughly(image: NDArray, part: Sighting, start: Pose, hidden: NDArray, others: list[Placed]) -> Pose:
    """A part's pose from small pictures; the start where they show too little."""
    model = part.model
    cut = cover.cutout(image, hidden, others, part.colors, model, start, _margin(part))
    frame = cover.as_layer(model.view, cut)
    pose = replace(descend.rough(model, frame, start.placed), visible=True)
    if not is_sane(model, pose) or descend.evidence(model, frame, pose, 2).shown < CLEAR:
        return start
    return pose


def _next(image: NDArray, part: Sighting, expected: Pose, hidden: NDArray, others: list[Placed]) -> Sighting:
    """One part in the next picture, in which other parts hide some pixels (H, W) and lie beside it or behind."""
    last = part.pose
    if _unchanged(image, part) or _rests(image, part, hidden):
        # one that was lost is back where it was
        return replace(part, pose=replace(last, held=last.visible, visible=True))
    if part.searched is not None and is_held(part.searched, image, (slice(None), slice(None))):
        return replace(part, pose=replace(expected, visible=False, held=False))
    pose, cut, seen = first = _tried(image, part, expected, hidden, others)
    doubted = 1.0
    if not _is_clear(part, pose, seen):
        doubted = min(part.doubted, worth(pose, seen))
        if not part.pose.visible or seen.known >= HIDDEN and worth(pose, seen) < part.doubted - 0.1:
            pose, cut, seen = _best_of(image, part, expected, hidden, others, first)
            doubted = worth(pose, seen)
    if not _is_seen(part, expected, pose, seen):
        return replace(part, pose=replace(expected, visible=False, held=False), searched=image, doubted=1.0)
    colors = part.colors
    if worth(pose, seen) > CLEAR:
        colors = matte.adapt(colors, cut.picture, np.where(cut.known > 0, cut.soft, 0.5))
    return replace(
        part,
        pose=replace(pose, visible=True),
        colors=colors,
        misfits=(*part.misfits, pose.misfit)[-REMEMBERED:],
        drawn=image,
        hidden=hidden,
        before=last.placed if last.visible else None,
        searched=None,
        doubted=doubted,
    )


def _unchanged(image: NDArray, part: Sighting) -> bool:
    """Whether nothing has changed anywhere near the part since it was last found."""
    if part.drawn is None:
        return False
    size = (image.shape[1], image.shape[0])
    return is_held(part.drawn, image, layer.window(outline(part.model, part.pose), size, _margin(part)))


def _rests(image: NDArray, part: Sighting, hidden: NDArray) -> bool:
    """Whether the part itself is as it was, though others move about it: what is in sight of it has not changed."""
    if part.drawn is None or not part.pose.visible or part.hidden is None:
        return False
    rim = outline(part.model, part.pose)
    own = cover.grown(cover.solid(part.model, part.pose, np.zeros(2), image.shape), cover.EDGE)
    free = own & (1 - cover.grown(hidden | part.hidden, cover.EDGE))
    at = np.round(rim).astype(int)
    at = at[((at >= 0) & (at < (image.shape[1], image.shape[0]))).all(axis=1)]
    if free.sum() < 0.25 * own.sum() or free[at[:, 1], at[:, 0]].sum() < 0.25 * len(rim):
        return False  # too little to go by
    return is_held(part.drawn, image, layer.window(rim, (image.shape[1], image.shape[0]), cover.RIM), free)


def _tried(
    image: NDArray, part: Sighting, start: Pose, hidden: NDArray, others: list[Placed]
) -> tuple[Pose, Cutout, Evidence]:
    """The fit from one start, the pixels it came from, and what they prove."""
    model = part.model
    cut = cover.cutout(image, hidden, others, part.colors, model, start, _margin(part))
    if cut.soft.max() < 0.5:
        cut = cover.cutout(image, hidden, others, part.colors, model, start, _margin(part), FAR)
    frame = cover.as_layer(model.view, cut)
    pose = descend.fit(model, frame, start.placed)
    if not is_sane(model, pose):
        return start, cut, Evidence(0.0, 1.0)
    cleaned = cover.without_foreign(cut, model, pose, part.colors, others)
    if cleaned is not cut:
        cut, frame = cleaned, cover.as_layer(model.view, cleaned)
        pose = _if_sane(part, descend.fit(model, frame, pose.placed), pose)
    seen = descend.evidence(model, frame, pose)
    if _is_clear(part, pose, seen):
        return pose, cut, seen
    tries = [(pose, seen)]
    freed = cover.without_stranger(cut, model, pose)
    free = frame if freed is cut else cover.as_layer(model.view, freed)
    # small pictures mix what is in front with the part: the large ones alone may know better
    for begin in (start, pose) if freed is not cut else (start,):
        again = _if_sane(part, descend.polish(model, free, begin), pose)
        tries.append((again, descend.evidence(model, frame, again)))
    pose, seen = max(tries, key=lambda one: _likely(part, start, *one))
    return pose, cut, seen


def _best_of(
    image: NDArray,
    part: Sighting,
    expected: Pose,
    hidden: NDArray,
    others: list[Placed],
    first: tuple[Pose, Cutout, Evidence],
) -> tuple[Pose, Cutout, Evidence]:
    """The best of a doubtful fit and those from other starts."""
    likely = [expected, part.pose]
    if part.before is not None:
        onward = affine.compose(affine.compose(part.pose.placed, affine.invert(part.before)), part.pose.placed)
        likely.append(replace(part.pose, placed=onward))
    tries = [first]
    for start in search.starts(image, hidden, part.model, part.colors, likely):
        tries.append(_tried(image, part, start, hidden, others))
        if _is_clear(part, tries[-1][0], tries[-1][2]):
            break
    return max(tries, key=lambda one: _likely(part, expected, one[0], one[2]))


def _is_clear(part: Sighting, pose: Pose, seen: Evidence) -> bool:
    """Whether a fit leaves no doubt: much of the part is there, and no worse drawn than before."""
    return seen.known >= HIDDEN and worth(pose, seen) >= CLEAR and (pose.misfit <= _ordinary(part) or seen.shown > 0.9)


def _is_seen(part: Sighting, expected: Pose, pose: Pose, seen: Evidence) -> bool:
    """Whether the part is in the picture: where it was lost, or is found elsewhere, that takes more than where not."""
    if part.pose.visible and not _is_far(part, expected, pose):
        return seen.known >= HIDDEN and worth(pose, seen) >= SEEN
    return seen.known >= HIDDEN_BACK and worth(pose, seen) >= BACK and pose.misfit <= _ordinary(part)


def _likely(part: Sighting, expected: Pose, pose: Pose, seen: Evidence) -> tuple[bool, float]:
    """For choosing among fits: one that can be believed comes first, then what it is worth and how much it explains."""
    return _is_seen(part, expected, pose, seen), worth(pose, seen) * seen.known


def _is_far(part: Sighting, expected: Pose, pose: Pose) -> bool:
    """Whether a pose lies further from the expected one than half the part's size."""
    gap = np.abs(outline(part.model, pose) - outline(part.model, expected)).max()
    return bool(gap > 0.5 * np.ptp(part.model.keyset.points[0], axis=0).max())


def _ordinary(part: Sighting) -> float:
    """A misfit in pixels that is not out of the ordinary, after what has been seen so far."""
    return 2.5 * float(np.median(part.misfits)) + 0.2 if len(part.misfits) >= 3 else 0.8


def _if_sane(part: Sighting, pose: Pose, other: Pose) -> Pose:
    return pose if is_sane(part.model, pose) else other


def _margin(part: Sighting) -> float:
    return REACH + 0.25 * float(np.ptp(part.model.keyset.points[0], axis=0).max())


def _order(part: Sighting) -> int:
    return part.model.part.order


def _placed(part: Sighting) -> Placed:
    return Placed(part.model, part.colors, part.pose)
