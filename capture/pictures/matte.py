"""The layer's soft matte from a probabilistic colour model (Bregler et al. 2002, section 3.3, sub-part layers).

Usually a cartoon layer has its own colours.  Two mixtures of Gaussians, of the colours inside and outside,
are baked into tables over a coarse colour cube, so that a frame costs one look-up; the tables then
follow the clip slowly, for film that fades and flickers.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError

BINS = 32  # per channel
REACH_OF_COLOR = 6.0  # grey levels: how far film grain and flicker carry a flat colour


@dataclass(frozen=True, eq=False)
class ColorModel:
    """How likely each colour is inside and outside the layer."""

    inside: NDArray  # (32, 32, 32) float32, sums to 1
    outside: NDArray  # (32, 32, 32) float32, sums to 1

    def probability(self) -> NDArray:
        """Chance (32, 32, 32) that a pixel of this colour belongs to the layer, at even odds."""
        return self.inside / (self.inside + self.outside)


@dataclass(frozen=True, eq=False)
class Seed:
    """What is known of the layer in one picture."""

    image: NDArray  # (H, W, 3) RGB
    inside: NDArray  # (H, W) uint8, surely the layer
    outside: NDArray  # (H, W) uint8, surely not
    limit: NDArray  # (H, W) uint8, nothing of the layer lies beyond


def learn(seeds: list[Seed], colors: int = 6) -> ColorModel:
    """A colour model from the pixels known to be in and out, in one or several pictures.

    Colours that occur on both sides count as the layer's: a patch of the same colour elsewhere is told apart by
    where it is, but a hole in the layer is lost.
    """
    inside = np.concatenate([seed.image[seed.inside > 0] for seed in seeds])[:, :3]
    outside = np.concatenate([seed.image[seed.outside > 0] for seed in seeds])[:, :3]
    for name, pixels in (("inside", inside), ("outside", outside)):
        if len(pixels) < 16:
            raise InputError(
                f"a matte needs at least 16 pixels known to be {name} the layer, the region gives {len(pixels)}: "
                "draw a larger box or outline that leaves some background"
            )
    layer = _bake(inside, colors)
    typical = layer >= np.percentile(layer.ravel()[_index(inside)], 10)
    shared = _neighbours(typical).ravel()[_index(outside)]
    if shared.mean() < 0.5:
        outside = outside[~shared]
    return ColorModel(layer, _bake(outside, colors))


def seed_outline(image: NDArray, outline: NDArray, margin: int = 3) -> Seed:
    """From an outline (B, 2): pixels within `margin` of it are in doubt, for ink has width."""
    mask = fill((image.shape[1], image.shape[0]), outline)
    brush = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * margin + 1, 2 * margin + 1))
    inner, outer = cv2.erode(mask, brush), cv2.dilate(mask, brush)
    return Seed(image, inner if inner.any() else mask, 1 - outer, cv2.dilate(outer, brush))


def seed_box(image: NDArray, box: tuple[float, float, float, float], rounds: int = 4) -> Seed:
    """From a box (x, y, width, height) drawn round the layer.

    What lies round the box is background; what in the box does not look like it is the layer, learnt again
    a few times.
    """
    height, width = image.shape[:2]
    x, y, w, h = box
    x0, y0, x1, y1 = round(x), round(y), round(x + w), round(y + h)
    if w <= 0 or h <= 0 or x0 < 0 or y0 < 0 or x1 > width or y1 > height:
        raise InputError(
            f"a box (x, y, width, height) must lie inside the {width} x {height} picture, got "
            f"({x:g}, {y:g}, {w:g}, {h:g})"
        )
    within = np.zeros((height, width), np.uint8)
    within[y0:y1, x0:x1] = 1
    outside = 1 - within
    if outside.sum() < 16:
        raise InputError("a box must leave some background round the layer, this one covers the whole picture")
    yy, xx = np.mgrid[:height, :width]
    across = (2 * xx - x0 - x1 + 1) / (x1 - x0), (2 * yy - y0 - y1 + 1) / (y1 - y0)
    inside = within * (across[0] ** 2 + across[1] ** 2 < 1)
    for _ in range(rounds):
        model = learn([Seed(image, inside, outside, within)])
        found = ((_look_up(model, image) > 0.5) & (within > 0)).astype(np.uint8)
        if np.count_nonzero(found) < 16:
            break
        inside = _components(found, found)
    return Seed(image, inside, outside, within)


def seed_color(image: NDArray, color: tuple[int, int, int], tolerance: float = 40.0) -> Seed:
    """From an RGB colour: the largest patch within `tolerance` grey levels of it, and the rest."""
    distance = np.linalg.norm(image[..., :3].astype(float) - color, axis=-1)
    near = (distance < tolerance).astype(np.uint8)
    if np.count_nonzero(near) < 16:
        raise InputError(
            f"a colour must occur in the frame it is picked from: fewer than 16 pixels are within {tolerance:g} "
            f"grey levels of {tuple(color)}, take the colour from the picture itself"
        )
    inside = _components(near, near)
    outside = (1 - cv2.dilate(inside, np.ones((5, 5)))) & (distance > 0.5 * tolerance)
    return Seed(image, inside, outside.astype(np.uint8), np.ones_like(inside))


def seed_scribbles(image: NDArray, inside: list[NDArray], outside: list[NDArray], width: int = 5) -> Seed:
    """From strokes, each (N, 2), drawn on the layer and on the rest with a brush `width` pixels wide."""
    masks = []
    for strokes in (inside, outside):
        mask = np.zeros(image.shape[:2], np.uint8)
        for stroke in strokes:
            cv2.polylines(mask, [np.round(np.asarray(stroke)).astype(np.int32)], False, 1, width)
        masks.append(mask)
    return Seed(image, masks[0], masks[1], 1 - masks[1])


def cut(model: ColorModel, image: NDArray, near: NDArray | None = None, reach: float = 0.25) -> NDArray:
    """The soft matte (H, W), 0-1 float32, of the layer in an RGB image.

    `near` (H, W) is a mask of where it is expected: patches that touch it are kept, the others dropped, and so is
    anything smaller than `reach` of the largest patch.  Where that makes far more than is expected, thin bridges to
    something else of the same colour are cut.  Without `near` the largest patch is the layer.
    Holes are filled: eyes and highlights belong to the layer whatever their colour.
    """
    chance = cv2.GaussianBlur(_look_up(model, image), (0, 0), 0.7)
    hard = (chance > 0.5).astype(np.uint8)
    layer = _components(hard, hard if near is None else near, reach)
    if near is not None and layer.sum() > 1.5 * near.sum():
        layer = _without_bridges(layer, near, reach)
    solid = _fill_holes(layer)
    rim = cv2.dilate(solid, np.ones((3, 3), np.uint8))
    soft = np.where(solid > layer, 1.0, chance).astype(np.float32)
    return np.clip((soft * rim - 0.1) / 0.8, 0, 1)


def adapt(model: ColorModel, image: NDArray, matte: NDArray, rate: float = 0.05) -> ColorModel:
    """The model moved a little (`rate`) towards the colours of this frame's sure pixels."""
    sure_in, sure_out = matte > 0.95, matte < 0.05
    if min(np.count_nonzero(sure_in), np.count_nonzero(sure_out)) < 64:
        return model
    tables = []
    for table, sure in ((model.inside, sure_in), (model.outside, sure_out)):
        seen = np.bincount(_index(image[sure]), minlength=BINS**3).reshape(BINS, BINS, BINS)
        seen = _smooth(seen.astype(np.float32))
        tables.append((1 - rate) * table + rate * seen / seen.sum())
    return ColorModel(*tables)


def fill(size: tuple[int, int], outline: NDArray) -> NDArray:
    """Mask (H, W) uint8 of a closed outline (B, 2), for a picture of (width, height)."""
    mask = np.zeros((size[1], size[0]), np.uint8)
    return cv2.fillPoly(mask, [np.round(np.asarray(outline) * 16).astype(np.int32)], 1, shift=4)


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


def _neighbours(cells: NDArray) -> NDArray:
    """Cells of the colour cube and those that touch them, for flicker moves a colour that far."""
    from scipy.ndimage import binary_dilation

    return binary_dilation(cells, np.ones((3, 3, 3)))


def _bake(pixels: NDArray, colors: int) -> NDArray:
    """Density table (32, 32, 32) of RGB pixels (P, 3) as a mixture of Gaussians."""
    import warnings

    from sklearn.mixture import GaussianMixture
    from threadpoolctl import threadpool_limits

    some = pixels.reshape(-1, 3)
    if len(some) > 4000:
        some = some[np.random.default_rng(0).choice(len(some), 4000, replace=False)]
    some = some.astype(float)
    colors = min(colors, len(np.unique(some, axis=0)), len(some) // 2)
    mixture = GaussianMixture(max(colors, 1), reg_covar=REACH_OF_COLOR**2, max_iter=40, random_state=0)
    # one thread: for matrices this small BLAS threads only wait for each other
    with threadpool_limits(1), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # flat colours give fewer clusters than asked for: nothing is wrong
        mixture.fit(some)
    centres = (np.arange(BINS) + 0.5) * (256 / BINS) - 0.5
    grid = np.stack(np.meshgrid(centres, centres, centres, indexing="ij"), -1).reshape(-1, 3)
    score = mixture.score_samples(grid)
    tables = [np.exp(heat - heat.max()) for heat in (score, score / 16)]  # the second has four times the width:
    near, far = (table / table.sum() for table in tables)  # colours nobody has seen go to whoever is nearer
    table = 0.98 * near + 0.02 * far + 1e-30  # not 0: far from all colours seen, both sides are as unlikely
    return table.astype(np.float32).reshape(BINS, BINS, BINS)


def _index(image: NDArray) -> NDArray:
    """Flat table index of every pixel's colour."""
    bins = (image[..., :3] >> 3).astype(np.int32)
    return (bins[..., 0] * BINS + bins[..., 1]) * BINS + bins[..., 2]


def _look_up(model: ColorModel, image: NDArray) -> NDArray:
    return model.probability().ravel()[_index(image)].astype(np.float32)


def _smooth(table: NDArray) -> NDArray:
    from scipy.ndimage import gaussian_filter

    return gaussian_filter(table, 0.7) + 1e-9


def _components(mask: NDArray, near: NDArray, reach: float = 0.25) -> NDArray:
    """The patches of a mask (uint8) that touch `near` and are not much smaller than the largest of those."""
    count, labels = cv2.connectedComponents(mask, connectivity=4)
    if count < 2:
        return mask
    touching = np.bincount(labels[near > 0], minlength=count)
    touching[0] = 0
    if not touching.any():
        return np.zeros_like(mask)
    return (touching >= max(reach * touching.max(), 1))[labels].astype(np.uint8)


def _without_bridges(mask: NDArray, near: NDArray, reach: float, width: int = 7) -> NDArray:
    """The patches of a mask that still touch `near` when whatever is thinner than `width` is taken away."""
    brush = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (width, width))
    thick = cv2.morphologyEx(mask, cv2.MORPH_OPEN, brush)
    kept = _components(thick, near, reach)
    return mask & cv2.dilate(kept, brush) if kept.any() else mask


def _fill_holes(mask: NDArray) -> NDArray:
    """The mask with everything it encloses."""
    framed = np.pad(mask, 1)
    cv2.floodFill(framed, None, (0, 0), 2)
    return (framed[1:-1, 1:-1] != 2).astype(np.uint8)
