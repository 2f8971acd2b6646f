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
from capture.pictures import matte
from capture.pictures.matte import ColorModel

EDGE = 2  # pixels beyond a part's outline that its ink and blur still colour
RIM = 8  # pixels round the posed outline that may still be the layer
NEAR_EDGE = 16  # pixels from the picture's edge within which a part may reach beyond it
FOREIGN = 0.02  # share of the matte beyond that rim which calls for a second fit
UNHEARD = 1e-5  # density of a colour in the tables below which it has not been seen; all alike would have 3e-5
MOSTLY = 0.7  # share of a part's place in colours unheard of, from which on the light has changed instead
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
    if strange[near > 0].sum() < MOSTLY * near.sum():
        seen = seen & (1 - strange)
    soft = matte.cut(colors, picture, wide, reach=0.0) * seen
    if others:
        soft[not_own(colors, others)[cells(picture)]] = 0
    soft = _belonging(soft, wide)
    return Cutout(picture, low.astype(float), seen.astype(np.float32), soft)


def not_own(colors: ColorModel, others: list[Placed]) -> NDArray:
    """The colours (32, 32, 32) that are ten times as common in another part as in this one."""
    theirs = np.zeros_like(colors.inside)
    for other in others:
        theirs = np.maximum(theirs, other.colors.inside)
    return theirs > 10 * np.maximum(colors.inside, colors.outside)


def as_layer(view: View, part: Cutout) -> Layer:
    """The cut-out made comparable; where all can be seen, nothing is said of it."""
    return view.layer(part.picture, part.soft, part.origin, None if part.known.all() else part.known)


def without_foreign(part: Cutout, model: PartModel, pose: Pose, colors: ColorModel, beside: list[Placed]) -> Cutout:
    """The cut-out without what has the part's colours but lies beyond its outline: the same one if that is little.

    Beyond a rim it is not the part.  Within the rim, where another part is expected that has this colour as well, it
    cannot be known whose it is.
    """
    own = solid(model, pose, part.origin, part.soft.shape)
    kept = part.soft * grown(own, RIM)
    known = part.known
    theirs = _shared(part, colors, beside) & (grown(own, EDGE) == 0) & (part.soft > 0.1)
    if theirs.any():
        known = np.where(theirs, np.float32(0), known)
    changed = np.abs(part.soft - kept).sum() + (kept * (part.known - known)).sum()
    if changed <= FOREIGN * part.soft.sum():
        return part
    return replace(part, soft=kept, known=known)


def without_stranger(part: Cutout, model: PartModel, pose: Pose) -> Cutout:
    """The cut-out with what is not of the part's colours, well inside its outline, unknown: something is in front.

    The same one if that is little, or if it is most of what can be seen.
    """
    inner = grown(1 - solid(model, pose, part.origin, part.soft.shape), 4) == 0
    inner &= part.known > 0
    strange = inner & (part.soft < 0.3)
    share = strange.sum() / max(inner.sum(), 1)
    if not REJECTED < share < 0.8:
        return part
    unknown = grown(strange.astype(np.uint8), 4) > 0  # as far as the outline, from which `inner` kept away
    return replace(part, known=np.where(unknown, np.float32(0), part.known))


def solid(model: PartModel, pose: Pose, origin: NDArray, shape: tuple[int, ...]) -> NDArray:
    """The mask (H, W) of the posed outline in a picture of that shape whose first pixel is at `origin`."""
    rim = np.nan_to_num(outline(model, pose) - origin, nan=-1e4)
    return matte.fill((shape[1], shape[0]), np.clip(rim, -1e4, 1e4))


def grown(mask: NDArray, by: int) -> NDArray:
    """A mask made larger by so many pixels."""
    return cv2.dilate(mask, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * by + 1, 2 * by + 1)))


def chance(colors: ColorModel, image: NDArray) -> NDArray:
    """How likely (H, W) each pixel's colour is the part's, at even odds."""
    return colors.probability()[cells(image)]


def cells(image: NDArray) -> tuple[NDArray, ...]:
    """Where every pixel's colour is in a table of colours."""
    return tuple((image[..., :3] >> 3).transpose(2, 0, 1))


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
    unheard = (np.maximum(colors.inside, colors.outside) < UNHEARD)[cells(picture)].astype(np.uint8)
    wide = cv2.morphologyEx(unheard, cv2.MORPH_OPEN, np.ones((5, 5), np.uint8))  # not the seams between two colours
    return grown(wide, EDGE) if wide.any() else wide


def _belonging(soft: NDArray, near: NDArray) -> NDArray:
    """The patches of a matte that belong to a part expected on a mask.

    Those that have much in common with it, and splinters that lie on it: something in front may have cut them off.
    """
    count, labels = cv2.connectedComponents((soft > 0.1).astype(np.uint8))
    if count <= 2:
        return soft
    on, of = np.bincount(labels[near > 0], minlength=count), np.bincount(labels.ravel(), minlength=count)
    on[0] = 0
    kept = (on > 0.25 * on.max()) | (on > 0.5 * of)
    kept[0] = True  # the faint rim
    return soft * kept[labels]


def _shared(part: Cutout, colors: ColorModel, beside: list[Placed]) -> NDArray:
    """Where (h, w) another part is expected whose colours a pixel has as well."""
    shared = np.zeros(part.soft.shape, bool)
    at = cells(part.picture)
    for other in beside:
        there = solid(other.model, other.pose, part.origin, part.soft.shape)
        if there.any():
            shared |= (grown(there, EDGE) > 0) & (other.colors.inside[at] > 0.1 * colors.inside[at])
    return shared
