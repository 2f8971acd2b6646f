"""What colours a layer has: a probabilistic model (Bregler et al. 2002, section 3.3, sub-part layers).

Usually a cartoon layer has its own colours.  Two mixtures of Gaussians, of the colours inside and outside,
are baked into tables over a coarse colour cube, so that a frame costs one look-up; the tables then
follow the clip slowly, for film that fades and flickers.
"""

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError

BINS = 32  # per channel
REACH_OF_COLOR = 6.0  # grey levels: how far film grain and flicker carry a flat colour
OURS = 0.01  # share of the layer from which on a colour is its own, wherever else it occurs
LIKELY = 0.85  # chance from which on a colour is taken for the layer's own again
ENOUGH = 2**15  # pixels teach as much as four times as many
SPECK = 8.0  # pixels of a colour that are no more than grain or a soft edge
SPREAD = np.array([[1, 2, 1]], np.float32) / 4  # over the cells of one channel: the same reach, when adapting


@dataclass(frozen=True, eq=False)
class ColorModel:
    """How likely each colour is inside and outside the layer."""

    inside: NDArray  # (32, 32, 32) float32, sums to 1
    outside: NDArray  # (32, 32, 32) float32, sums to 1
    shared: NDArray  # (32, 32, 32) uint8, 1 for colours of the layer that have been seen elsewhere too

    def probability(self) -> NDArray:
        """Chance (32, 32, 32) that a pixel of this colour belongs to the layer, at even odds."""
        return self._chance

    @cached_property
    def _chance(self) -> NDArray:
        return (self.inside / (self.inside + self.outside)).astype(np.float32)

    @cached_property
    def _table(self) -> NDArray:
        """The chances (65536,) as OpenCV looks them up: it wants one for every 16-bit number, ours have 15 bits."""
        return np.tile(self._chance.ravel(), 2)


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
    typical = layer >= np.percentile(layer.ravel()[cells(inside[None])[0]], 10)
    elsewhere = cells(outside[None])
    twin = _neighbours(typical).ravel()[elsewhere[0]]
    if twin.mean() < 0.5:
        outside = outside[~twin]
    shared = _seen(elsewhere, np.uint8(255 * twin)[None]) > SPECK
    return ColorModel(layer, _bake(outside, colors), shared.astype(np.uint8))


def adapt(model: ColorModel, image: NDArray, matte: NDArray, rate: float = 0.05) -> ColorModel:
    """The model moved a little (`rate`) towards the colours of this frame's sure pixels.

    As when learning, what has the layer's colour elsewhere teaches nothing about the rest, if the colour is more
    usual in the layer: a twin that stays in the window would eat holes into it.
    """
    if matte.size > ENOUGH:
        image, matte = image[::2, ::2], np.ascontiguousarray(matte[::2, ::2])
    seen = cells(image)
    alike = cv2.compare(cv2.LUT(seen, model._table), LIKELY, cv2.CMP_GT)  # smoke before a layer is not the layer
    inside, outside = cv2.compare(matte, 0.95, cv2.CMP_GT), cv2.compare(matte, 0.05, cv2.CMP_LT)
    inside &= alike
    if min(cv2.countNonZero(inside), cv2.countNonZero(outside)) < 64:
        return model
    ours, others = _seen(seen, inside), _seen(seen, outside)
    twins = (ours > OURS * ours.sum()) & (ours * others.sum() > others * ours.sum()) & (model.probability() > 0.5)
    shared = model.shared | (twins & (others > SPECK))
    others[twins] = 0
    return ColorModel(_moved(model.inside, ours, rate), _moved(model.outside, others, rate), shared.astype(np.uint8))


def chance(model: ColorModel, image: NDArray) -> NDArray:
    """Chance (H, W) float32 of every pixel of an RGB image to be the layer's, by its colour alone."""
    return cv2.LUT(cells(image), model._table)


def is_shared(model: ColorModel, image: NDArray) -> NDArray:
    """Mask (H, W) uint8 of the pixels whose colour the layer shares with something else."""
    return cv2.LUT(cells(image), np.tile(model.shared.ravel(), 2))


def cells(image: NDArray) -> NDArray:
    """The cell (H, W) uint16 of the colour cube in which each pixel of an RGB image lies: 5 bits of each channel."""
    packed = cv2.cvtColor(np.ascontiguousarray(image[..., :3]), cv2.COLOR_RGB2BGR555)
    return packed.view(np.uint16)[..., 0]


def unlike(image: NDArray, where: NDArray) -> NDArray:
    """Mask (H, W) uint8 of the pixels of an RGB image whose colours do not occur in a mask, nor any near to them."""
    seen = cells(image)
    counts = cv2.calcHist([seen], [0], where.astype(np.uint8), [BINS**3], [0, BINS**3]).reshape(BINS, BINS, BINS)
    return cv2.LUT(seen, np.tile((~_neighbours(counts > 1)).astype(np.uint8).ravel(), 2))


def _moved(table: NDArray, counts: NDArray, rate: float) -> NDArray:
    fresh = counts + np.float32(1e-9)
    return cv2.addWeighted(table, 1 - rate, fresh, rate / float(fresh.sum()), 0)


def _seen(seen: NDArray, where: NDArray) -> NDArray:
    """How often (32, 32, 32) each colour occurs in a mask, shared with the neighbouring cells."""
    counts = cv2.calcHist([seen], [0], where, [BINS**3], [0, BINS**3])
    for _ in range(3):  # each turn spreads along the last channel and brings the next one there
        counts = cv2.filter2D(counts.reshape(-1, BINS), -1, SPREAD, borderType=cv2.BORDER_REPLICATE)
        counts = np.ascontiguousarray(counts.reshape(BINS, BINS, BINS).transpose(2, 0, 1))
    return counts


def _neighbours(cube: NDArray) -> NDArray:
    """Cells of the colour cube and those that touch them, for flicker moves a colour that far."""
    from scipy.ndimage import binary_dilation

    return binary_dilation(cube, np.ones((3, 3, 3)))


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
