"""Patches of a mask: which of them are the layer, where they touch something else, and what they enclose."""

import cv2
import numpy as np
from numpy.typing import NDArray

STAYS = 0.15  # of its area: how much better the layer must fit at the farthest place than where it was
THIN = 7  # pixels: what is thinner so far off is a bridge, or the rim of something else
EDGE = 24  # grey levels across a border: more than grain and codecs make
NECK = 0.5  # of its size across: with less contact than that, a piece hangs on by a neck
CONTEST = 3.0  # times the slack: how far round something foreign its border with the layer may lie
SMALLEST = 0.05  # of the largest patch: smaller ones are grain, wherever they lie


def touching(mask: NDArray, near: NDArray, reach: float = 0.25) -> NDArray:
    """The patches of a mask (H, W) uint8 that are the layer, where `near` (H, W) expects it.

    A patch must touch `near`, and either be no smaller there than `reach` of the largest, or lie there for the most
    part: an arm or a broad line may cut a layer into pieces of very different size.
    """
    count, labels = cv2.connectedComponents(mask, connectivity=4, ltype=cv2.CV_16U)
    if count < 2:
        return mask
    home = _box(near, 0)
    there = _sizes(labels[home], count, near[home])
    most = there.max()
    if most == 0:
        return np.zeros_like(mask)
    wanted = there >= max(reach * most, 1)
    if (wanted != (there > 0)).any():
        wanted |= (there >= SMALLEST * most) & (there > 0.5 * _sizes(labels, count))
    return _chosen(labels, wanted)


def largest(mask: NDArray, reach: float = 0.25) -> NDArray:
    """The largest patch of a mask (H, W) uint8, and those not smaller than `reach` of it."""
    count, labels = cv2.connectedComponents(mask, connectivity=4, ltype=cv2.CV_16U)
    if count < 2:
        return mask
    sizes = _sizes(labels, count)
    return _chosen(labels, sizes >= reach * sizes.max())


def without_holes(mask: NDArray, near: NDArray | None = None) -> NDArray:
    """The mask (H, W) uint8 with everything it encloses; with `near` (H, W) only what lies there for the most part."""
    framed = cv2.copyMakeBorder(mask, 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=0)
    cv2.floodFill(framed, None, (0, 0), 2)
    solid = cv2.compare(framed[1:-1, 1:-1], 2, cv2.CMP_NE) & 1
    if near is None or not cv2.countNonZero(solid & (1 - near)):
        return solid
    count, labels = cv2.connectedComponents(solid - mask, connectivity=4, ltype=cv2.CV_16U)
    return mask | _chosen(labels, _sizes(labels, count, near) > 0.5 * _sizes(labels, count))


def filled(size: tuple[int, int], outline: NDArray) -> NDArray:
    """Mask (H, W) uint8 of a closed outline (B, 2), for a picture of (width, height)."""
    mask = np.zeros((size[1], size[0]), np.uint8)
    return cv2.fillPoly(mask, [np.round(np.asarray(outline) * 16).astype(np.int32)], 1, shift=4)


def disc(radius: int) -> NDArray:
    """A round brush."""
    return cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * radius + 1, 2 * radius + 1))


def moved(near: NDArray, mask: NDArray, most: int = 64) -> NDArray:
    """A mask `near` (H, W) shifted, at most by `most` pixels, to where it covers another best and little beyond.

    Compared at a quarter of the size, which is exact enough to tell apart what moved from what was there.
    """
    small = (mask.shape[1] // 4, mask.shape[0] // 4)
    goal, shape = (cv2.resize(m.astype(np.float32), small, interpolation=cv2.INTER_AREA) for m in (mask, near))
    rows, columns = np.nonzero(shape > 0.5)
    if len(rows) == 0:
        return near
    ring = cv2.dilate(shape, disc(4)) - shape  # what lies round the layer is not it
    low = np.maximum(np.array([rows.min(), columns.min()]) - 4, 0)
    high = np.array([rows.max(), columns.max()]) + 5
    pattern = (shape - ring)[low[0] : high[0], low[1] : high[1]]
    reach = most // 4
    field = cv2.copyMakeBorder(goal, reach, reach, reach, reach, cv2.BORDER_CONSTANT, value=0)
    field = field[low[0] : high[0] + 2 * reach, low[1] : high[1] + 2 * reach]
    score = cv2.matchTemplate(field, pattern, cv2.TM_CCORR) / shape.sum()
    dy, dx = np.indices(score.shape) - reach
    score -= STAYS * np.hypot(dx, dy) / reach
    row, column = np.unravel_index(score.argmax(), score.shape)
    shift = np.float32([[1, 0, 4 * (column - reach)], [0, 1, 4 * (row - reach)]])
    return cv2.warpAffine(near, shift, (near.shape[1], near.shape[0]), flags=cv2.INTER_NEAREST)


def parted(image: NDArray, mask: NDArray, doubted: NDArray, near: NDArray, slack: float) -> NDArray:
    """The share of a mask (H, W) that is the layer's, where something else of its colour touches it.

    What lies more than `slack` pixels beyond `near` is not the layer, if it is `doubted`; what lies as deep inside
    is, and so is what lies less far out but nowhere near to what is not.  Between them regions grow and meet at the
    picture's edges (Meyer's watershed): a change of shade, an ink line, or half-way where there is none.
    """
    whole, box = mask, _box(mask, 2)
    image, mask, doubted, near = (np.ascontiguousarray(each[box]) for each in (image, mask, doubted, near))
    away = _distance_to(near)
    thick = cv2.morphologyEx(mask, cv2.MORPH_OPEN, disc(THIN // 2))
    beyond = (away > slack) & ((doubted > 0) | (thick < mask))
    if np.count_nonzero(beyond) < 16 or not near.any():
        return whole
    depth = cv2.distanceTransform(near, cv2.DIST_L2, 3)
    sure = (depth > min(slack, 0.6 * float(depth.max()))) | ((_distance_to(beyond) > CONTEST * slack) & (near > 0))
    sure &= (mask > 0) & ~beyond
    if not sure.any():
        return whole
    markers = np.where(mask > 0, 0, 3).astype(np.int32)
    markers[sure] = 1
    markers[beyond] = 2
    contested = _box(markers == 0, 2)
    markers[contested] = cv2.watershed(cv2.cvtColor(image[contested], cv2.COLOR_RGB2BGR), markers[contested].copy())
    # pixels that the background has won, or on a line where regions meet, go to whoever is nearer
    ours, theirs = _distance_to(markers == 1), _distance_to(markers == 2)
    kept = np.zeros_like(whole)
    kept[box] = mask & (ours < theirs).astype(np.uint8)
    return kept


def evident(image: NDArray, mask: NDArray, kept: NDArray) -> NDArray:
    """`kept`, with those pieces of the mask (H, W) back that nothing in the picture parts from it.

    A piece is something else if there is an edge along its border, or if it hangs on by a neck; a layer that has
    grown has neither.
    """
    box = _box(mask & (1 - kept), 4)
    lost, beside = (mask & (1 - kept))[box], cv2.dilate(kept[box], disc(2))
    count, labels = cv2.connectedComponents(lost, connectivity=4, ltype=cv2.CV_16U)
    if count < 2:
        return kept
    edge = cv2.morphologyEx(image[box], cv2.MORPH_GRADIENT, disc(2)).max(axis=-1)
    border = labels * (beside & lost)
    contact = np.bincount(border.ravel(), minlength=count)
    sharp = np.bincount(border[edge > EDGE], minlength=count)
    foreign = (sharp > 0.5 * contact) | (contact < NECK * np.sqrt(_sizes(labels, count)))
    foreign[0] = True
    back = kept.copy()
    back[box] |= _chosen(labels, ~foreign)
    return back


def _distance_to(mask: NDArray) -> NDArray:
    """How far (H, W) each pixel is from a mask, in pixels."""
    return cv2.distanceTransform(1 - mask.astype(np.uint8), cv2.DIST_L2, 3)


def _box(mask: NDArray, margin: int) -> tuple[slice, slice]:
    """Rows and columns that hold a mask and a margin round it."""
    x, y, width, height = cv2.boundingRect(mask.astype(np.uint8))
    return slice(max(y - margin, 0), y + height + margin), slice(max(x - margin, 0), x + width + margin)


def _sizes(labels: NDArray, count: int, where: NDArray | None = None) -> NDArray:
    """Pixels of each patch (count,), those of a mask only if one is given; what is no patch counts nothing."""
    sizes = np.bincount(labels.ravel() if where is None else labels[where > 0], minlength=count)
    sizes[0] = 0
    return sizes


def _chosen(labels: NDArray, wanted: NDArray) -> NDArray:
    return wanted.astype(np.uint8)[labels]
