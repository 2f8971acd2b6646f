"""Which pixels of a picture are whose: parts in front hide a part, parts beside it may have its colours.

A part is looked for in a cut-out of the picture.  What cannot be seen of it there, under parts in front and beyond
the picture's edge, is unknown: it speaks neither for a pose nor against it.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from capture.fit.pixels.layer import Layer, View
from capture.fit.pixels.model import PartModel
from capture.fit.pixels.sighting import Pose, outline
from capture.pictures import colors as color_tables
from capture.pictures import matte, patches
from capture.pictures.matte import ColorModel

EDGE = 2  # pixels beyond a part's outline that its ink and blur still colour
RIM = 8  # pixels round the posed outline that may still be the layer
NEAR_EDGE = 16  # pixels from the picture's edge within which a part may reach beyond it
FOREIGN = 0.02  # share of the matte beyond that rim which calls for a second fit
UNHEARD = 1e-5  # density of a colour in the tables below which it has not been seen; all alike would have 3e-5
MOSTLY = 0.7  # share of a part's place in colours unheard of, from which on the light has changed instead
SHIFTED = 0.08  # of a part's size: as far may it have gone from where it is expected, and a splinter is still its own
REJECTED = 0.05  # share of a part's inside, not of its colours, from which on something else is in front of it


@dataclass(frozen=True, eq=False)
class Cutout:
    """What of a picture a part is looked for in, and whose pixels they are."""

    picture: NDArray  # (h, w, 3)
    origin: NDArray  # (2,) the picture's pixel that is first here; may lie beyond the edge
    known: NDArray  # (h, w) float32, 0 where the part could not be seen even if it were there
    soft: NDArray  # (h, w) float32 matte, 0 to 1


@dataclass(frozen=True, eq=False)
class Placed:
    """Another part, as far as its place in the picture is known."""

    model: PartModel
    colors: ColorModel
    pose: Pose


def mask(parts: list[Placed], shape: tuple[int, ...], grow: int = EDGE) -> NDArray:
    """Where (H, W) the parts are, and a little round them."""
    covered = np.zeros(shape[:2], np.uint8)
    for part in parts:
        covered |= solid(part.model, part.pose, np.zeros(2), shape)
    return grown(covered, grow) if parts else covered


def cutout(
    image: NDArray,
    hidden: NDArray,
    others: list[Placed],
    colors: ColorModel,
    model: PartModel,
    expected: Pose,
    margin: float,
    reach: int = 0,
) -> Cutout:
    """The surroundings of an expected pose, `margin` pixels wide, with the part's matte; `hidden` (H, W) is 1 under
    parts in front.

    Patches of its colour belong to it that touch the expected outline, grown by `reach` pixels.
    """
    rim = outline(model, expected)
    low = np.floor(rim.min(axis=0) - margin).astype(int)
    high = np.ceil(rim.max(axis=0) + margin).astype(int) + 1
    size = np.array([image.shape[1], image.shape[0]])
    # a part far from the picture's edge is not going to be cut by it
    low = np.where(rim.min(axis=0) > NEAR_EDGE, np.maximum(low, 0), low)
    high = np.where(rim.max(axis=0) < size - NEAR_EDGE, np.minimum(high, size), high)
    picture, seen = _crop(image, low, high), _crop(1 - hidden, low, high)
    near = solid(model, expected, low, picture.shape)
    wide = grown(near, reach) if reach else near
    strange = _strange(picture, colors)
    if cv2.countNonZero(strange) and cv2.countNonZero(strange & near) < MOSTLY * cv2.countNonZero(near):
        seen = seen & (1 - strange)
    soft = matte.cut(colors, picture, wide, reach=0.0) * seen
    if others:
        soft = cv2.copyTo(soft, color_tables.looked_up(1 - not_own(colors, others), picture))
    soft = _belonging(soft, wide)
    return Cutout(picture, low.astype(float), seen.astype(np.float32), soft)


def not_own(colors: ColorModel, others: list[Placed]) -> NDArray:
    """The colours (32, 32, 32) uint8 that are ten times as common in another part as in this one."""
    theirs = np.zeros_like(colors.inside)
    for other in others:
        theirs = np.maximum(theirs, other.colors.inside)
    return (theirs > 10 * np.maximum(colors.inside, colors.outside)).astype(np.uint8)


def as_layer(view: View, part: Cutout) -> Layer:
    """The cut-out made comparable; where all can be seen, nothing is said of it."""
    all_seen = bool(part.known.all())
    telling = part.soft > 0 if all_seen else (part.soft > 0) | (part.known < 1)
    part = _within(part, patches.box_of(telling, 2**view.levels))  # farther off the smallest picture is empty too
    return view.layer(part.picture, part.soft, part.origin, None if all_seen else part.known)


def without_foreign(part: Cutout, model: PartModel, pose: Pose, colors: ColorModel, beside: list[Placed]) -> Cutout:
    """The cut-out without what has the part's colours but lies beyond its outline: the same one if that is little.

    Beyond a rim it is not the part.  Within the rim, where another part is expected that has this colour as well, it
    cannot be known whose it is.
    """
    near = patches.box_of(part.soft > 0, RIM + 1)
    close = _within(part, near)
    own = solid(model, pose, close.origin, close.soft.shape)
    kept, known = cv2.copyTo(close.soft, grown(own, RIM)), close.known
    if beside:
        theirs = _shared(close, colors, beside) & (grown(own, EDGE) == 0) & (close.soft > 0.1)
        known = np.where(theirs, np.float32(0), known) if theirs.any() else known
    everything = close.soft.sum()
    changed = everything - kept.sum() + (0 if known is close.known else (kept * (close.known - known)).sum())
    if changed <= FOREIGN * everything:
        return part
    soft, all_known = part.soft.copy(), part.known.copy()
    soft[near], all_known[near] = kept, known
    return replace(part, soft=soft, known=all_known)


def without_stranger(part: Cutout, model: PartModel, pose: Pose) -> Cutout:
    """The cut-out with what is not of the part's colours, well inside its outline, unknown: something is in front.

    The same one if that is little, or if it is most of what can be seen.
    """
    near = patches.box_of(solid(model, pose, part.origin, part.soft.shape), 2)
    close = _within(part, near)
    inner = grown(1 - solid(model, pose, close.origin, close.soft.shape), 4) == 0
    inner &= close.known > 0
    strange = inner & (close.soft < 0.3)
    share = np.count_nonzero(strange) / max(np.count_nonzero(inner), 1)
    if not REJECTED < share < 0.8:
        return part
    unknown = grown(strange.astype(np.uint8), 4) > 0  # as far as the outline, from which `inner` kept away
    known = part.known.copy()
    known[near][unknown] = 0
    return replace(part, known=known)


def solid(model: PartModel, pose: Pose, origin: NDArray, shape: tuple[int, ...]) -> NDArray:
    """The mask (H, W) of the posed outline in a picture of that shape whose first pixel is at `origin`."""
    rim = np.nan_to_num(outline(model, pose) - origin, nan=-1e4)
    return matte.fill((shape[1], shape[0]), np.clip(rim, -1e4, 1e4))


def grown(mask: NDArray, by: int) -> NDArray:
    """A mask made larger by so many pixels."""
    return cv2.dilate(mask, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * by + 1, 2 * by + 1)))


def _within(part: Cutout, box: tuple[slice, slice]) -> Cutout:
    """The rows and columns of a cut-out that a box tells."""
    origin = part.origin + (box[1].start, box[0].start)
    return Cutout(part.picture[box], origin, part.known[box], part.soft[box])


def _crop(image: NDArray, low: NDArray, high: NDArray) -> NDArray:
    """Pixels from `low` up to `high`, with zeros for what lies beyond the picture."""
    height, width = image.shape[:2]
    x0, y0 = np.clip(low, 0, (width, height))
    x1, y1 = np.clip(high, (x0, y0), (width, height))
    before, after = np.array([x0, y0]) - low, high - (x1, y1)
    return cv2.copyMakeBorder(
        image[y0:y1, x0:x1], before[1], after[1], before[0], after[0], cv2.BORDER_CONSTANT, value=0
    )


def _strange(picture: NDArray, colors: ColorModel) -> NDArray:
    """Where (h, w) there are colours neither the part has nor its surroundings had: somebody else is in front."""
    table = (np.maximum(colors.inside, colors.outside) < UNHEARD).astype(np.uint8)
    unheard = color_tables.looked_up(table, picture)
    if not cv2.countNonZero(unheard):
        return unheard
    wide = cv2.morphologyEx(unheard, cv2.MORPH_OPEN, np.ones((5, 5), np.uint8))  # not the seams between two colours
    return grown(wide, EDGE) if wide.any() else wide


def _belonging(soft: NDArray, near: NDArray) -> NDArray:
    """The patches of a matte that belong to a part expected on a mask.

    Those that have much in common with it, and splinters that lie on it, or close by: something in front may have cut
    them off.
    """
    count, labels = cv2.connectedComponents(cv2.compare(soft, 0.1, cv2.CMP_GT), ltype=cv2.CV_16U)
    if count <= 2:
        return soft
    about = grown(near, round(SHIFTED * max(cv2.boundingRect(near)[2:])))
    on, close, of = (patches.sizes_of(labels, count, where) for where in (near, about, None))
    kept = (on > 0.25 * on.max()) | (close > 0.5 * of)
    kept[0] = True  # the faint rim
    return cv2.copyTo(soft, patches.chosen(labels, kept))


def _shared(part: Cutout, colors: ColorModel, beside: list[Placed]) -> NDArray:
    """Where (h, w) another part is expected whose colours a pixel has as well."""
    shared = np.zeros(part.soft.shape, bool)
    for other in beside:
        there = solid(other.model, other.pose, part.origin, part.soft.shape)
        if there.any():
            theirs = (other.colors.inside > 0.1 * colors.inside).astype(np.uint8)
            shared |= (grown(there, EDGE) & color_tables.looked_up(theirs, part.picture)) > 0
    return shared
