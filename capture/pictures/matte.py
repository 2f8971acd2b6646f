"""The layer's soft matte in a picture, from its colours and from where it is expected.

Read `colors` (what colours a layer has), `seeds` (what is known of it in a key frame) and `patches` (masks) with it.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.pictures import colors, patches
from capture.pictures.colors import ColorModel as ColorModel
from capture.pictures.colors import Seed as Seed
from capture.pictures.colors import adapt as adapt
from capture.pictures.colors import learn as learn
from capture.pictures.patches import filled as fill  # noqa: F401
from capture.pictures.seeds import seed_box as seed_box
from capture.pictures.seeds import seed_color as seed_color
from capture.pictures.seeds import seed_outline as seed_outline
from capture.pictures.seeds import seed_scribbles as seed_scribbles

ALIKE = 24.0  # grey levels between two colours: too near to tell how they are mixed, in grain
SQUARE = np.ones((3, 3), np.uint8)
TOO_MUCH = 1.5  # times what is expected: then something has come that the colours were not learnt against
TWICE = 2.0  # no drawing grows so much over the one before
FOREIGN = 0.02  # share of what is expected: as much of something else does no harm


def cut(
    model: ColorModel, image: NDArray, near: NDArray | None = None, reach: float = 0.25, slack: float | None = None
) -> NDArray:
    """The soft matte (H, W), 0-1 float32, of the layer in an RGB image.

    `near` (H, W) is a mask of where it is expected: patches that touch it are kept, the others dropped, and so is
    anything smaller than `reach` of the largest patch.  Where that makes far more than is expected, something else
    of the same colour touches the layer, and is parted from it: `near` is laid where it fits best, and its outline
    is then trusted to `slack` pixels.  Without `near` the largest patch is the layer.
    Holes are filled: eyes and highlights belong to the layer whatever their colour.
    """
    chance, hard = _chance(model, image)
    if near is None:
        return _soft(image, chance, patches.largest(hard, reach))
    layer = patches.touching(hard, near, reach)
    too_much = cv2.countNonZero(layer) > TOO_MUCH * cv2.countNonZero(near)
    doubted = layer if too_much else layer & colors.is_shared(model, image)
    if cv2.countNonZero(doubted) <= FOREIGN * cv2.countNonZero(near):
        return _soft(image, chance, layer)
    there = patches.moved(near, layer)
    trusted = slack is not None
    if not trusted:
        slack = max(8.0, 0.08 * max(cv2.boundingRect(near)[2:]))
    parted = patches.parted(image[..., :3], layer, doubted, there, slack)
    if not trusted and cv2.countNonZero(layer) < TWICE * cv2.countNonZero(near):
        parted = patches.evident(image[..., :3], layer, parted)
    return _soft(image, chance, parted, there)


def cut_key(model: ColorModel, seed: Seed) -> NDArray:
    """The soft matte (H, W) in a key frame, from what is known there: patches that touch the seed's inside."""
    chance, hard = _chance(model, seed.image)
    return _soft(seed.image, chance, patches.touching(hard, seed.inside)) * seed.limit


def _chance(model: ColorModel, image: NDArray) -> tuple[NDArray, NDArray]:
    """By colour alone: the chance (H, W) of each pixel to be the layer, and the mask uint8 of those above a half."""
    chance = cv2.GaussianBlur(colors.chance(model, image), (0, 0), 0.7)
    return chance, cv2.compare(chance, 0.5, cv2.CMP_GT) & 1


def _soft(image: NDArray, chance: NDArray, layer: NDArray, near: NDArray | None = None) -> NDArray:
    """The coverage (H, W) of a mask uint8, its holes filled, with a rim as soft as the picture's.

    In the rim a colour is a mixture of what lies deeper inside and farther outside, and tells in what proportion.
    Where those two look alike, or the layer is too thin to have an inside, the chance has to do.
    """
    alpha = np.zeros(layer.shape, np.float32)
    x, y, width, height = cv2.boundingRect(layer)
    if width == 0:
        return alpha
    box = slice(max(y - 4, 0), y + height + 4), slice(max(x - 4, 0), x + width + 4)
    solid = patches.without_holes(layer[box], near if near is None else near[box])
    deep, near_by = cv2.erode(solid, SQUARE, iterations=2), cv2.dilate(solid, SQUARE)
    rim = np.flatnonzero(near_by - deep)
    seen = cv2.cvtColor(np.ascontiguousarray(image[box][..., :3]), cv2.COLOR_RGB2RGBA).astype(np.float32)
    inside, beside = _mean_near(seen, deep, rim)
    outside, round_about = _mean_near(seen, 1 - near_by, rim)
    apart = inside - outside
    contrast = (apart**2).sum(axis=1)
    share = ((seen.reshape(-1, 4)[rim, :3] - outside) * apart).sum(axis=1) / np.maximum(contrast, 1)
    known = (contrast > ALIKE**2) & beside & round_about
    guess = np.where(known, share, (np.ascontiguousarray(chance[box]).ravel()[rim] - 0.1) / 0.8)
    covered = deep.astype(np.float32)
    covered.ravel()[rim] = np.clip(guess, 0, 1)
    alpha[box] = covered
    return alpha


def _mean_near(seen: NDArray, mask: NDArray, rim: NDArray) -> tuple[NDArray, NDArray]:
    """For the pixels (R,) of a rim: the mean colour (R, 3) of the nearest pixels of a mask, and if any are near."""
    total = cv2.GaussianBlur(cv2.copyTo(seen, mask), (7, 7), 1.0).reshape(-1, 4)[rim]
    weight = total[:, 3:] / 255  # the fourth channel is 255 in all pixels
    return total[:, :3] / np.maximum(weight, 1e-6), weight[:, 0] > 1e-3


def trace(matte: NDArray, step: float = 1.0) -> NDArray:
    """The matte's longest outline (B, 2) at half opacity, sub-pixel, a point about every `step` pixels."""
    from skimage.measure import find_contours

    from capture.motion.triangulate import resample

    contours = find_contours(np.pad(matte, 1), 0.5)
    if not contours:
        raise InputError("a matte must hold something to be traced, this one is empty: choose another box or colour")
    contour = max(contours, key=len)[:-1, ::-1] - 1
    length = np.linalg.norm(np.diff(contour, axis=0), axis=1).sum()
    return resample(contour, max(8, round(length / step)))
