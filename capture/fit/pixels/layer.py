"""What is compared: a layer over a constant colour, smoothed once, at several sizes.

The paper cuts its sum down to the matte (eq. 16) and so throws the silhouette away.  Here the layer is
composited over its own mean colour instead: the edge stays a signal and the background is gone.  Alpha
joins as a fourth channel; on small pictures it widens the reach, at full size it is used only as far as the
layer itself is too flat to be tracked by its colours.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from capture.fit.pixels import kernels

ALPHA_GAIN = 128.0  # grey levels from clear to opaque
RIM = 4  # pixels: how wide the rim is that makes a silhouette


@dataclass(frozen=True, eq=False)
class Layer:
    """One picture of a layer, from full size to small; sampled at full-size pixel positions."""

    levels: tuple[NDArray, ...]  # (h, w, 4) float32: colour 0-255 and alpha, each level half the one before
    origin: NDArray  # (2,) the full-size pixel of every level's first pixel
    ground: NDArray  # (4,) what lies beyond
    known: tuple[NDArray, ...] | None = None  # (h, w) float32 each: 0 where the layer cannot be seen, 1 where it can

    def sample(self, level: int, points: NDArray) -> NDArray:
        """Values (P, 4) at full-size points (P, 2)."""
        at = ((points - self.origin) / 2**level).astype(np.float32)
        return sample(self.levels[level], at, self.ground)

    def sample_known(self, level: int, points: NDArray) -> NDArray | None:
        """How far (P,) the layer could be seen at full-size points (P, 2), 0 to 1; None where it could everywhere."""
        if self.known is None:
            return None
        at = ((points - self.origin) / 2**level).astype(np.float32)
        return sample(self.known[level], at, np.ones(1))[:, 0]

    def sample_slopes(self, level: int, points: NDArray) -> tuple[NDArray, NDArray]:
        """The level's own x- and y-slopes (P, 4), per full-size pixel, at full-size points (P, 2)."""
        return self.sample_with_slopes(level, points)[1:]

    def sample_with_slopes(self, level: int, points: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        """Values and their x- and y-slopes (P, 4), per full-size pixel, at full-size points (P, 2)."""
        step = np.float32(2**level)
        values, gx, gy = kernels.look_with_slopes(self.levels[level], (points - self.origin) / step, self.ground)
        return values, gx / step, gy / step

    def affine_pass(
        self, level: int, placed: NDArray, pixels: tuple[NDArray, ...], huber: float, gone: float
    ) -> tuple[NDArray, NDArray, NDArray]:
        """`kernels.affine_pass` for a map (2, 3) from key pixels to full-size pixels."""
        inner = (placed - np.column_stack([np.zeros((2, 2)), self.origin])) / 2**level
        known = None if self.known is None else self.known[level]
        return kernels.affine_pass(self.levels[level], known, self.ground, inner, pixels, huber, gone)


@dataclass(frozen=True, eq=False)
class View:
    """How a picture of the layer is prepared, the same for templates and frames."""

    ground: NDArray  # (3,) the colour behind the layer
    flatness: float  # how far alpha counts at full size
    levels: int

    def layer(self, image: NDArray, alpha: NDArray, origin: NDArray, known: NDArray | None = None) -> Layer:
        """A picture (H, W, 3) and its matte (H, W) made comparable; `known` (H, W) is 0 under what covers the layer."""
        composed = composite(image, alpha, self.ground)
        return layer(composed, origin, self.ground, self.levels, self.flatness, known)


def gradient(image: NDArray, level: int) -> tuple[NDArray, NDArray]:
    """x- and y-slopes (H, W, C) of a level's image, per full-size pixel."""
    gy, gx = np.gradient(image, axis=(0, 1)) if min(image.shape[:2]) > 1 else (0 * image, 0 * image)
    return gx / np.float32(2**level), gy / np.float32(2**level)


def sample(image: NDArray, at: NDArray, ground: NDArray) -> NDArray:
    """Bilinear values (P, C) of an image at its own pixels (P, 2); columns are wrapped, OpenCV bounds their length."""
    width = 1024
    count = len(at)
    rows = -(-count // width)
    padded = np.zeros((rows * width, 2), np.float32)
    padded[:count] = at
    values = cv2.remap(
        image,
        padded.reshape(rows, width, 2),
        None,
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=tuple(float(g) for g in ground),
    )
    return values.reshape(rows * width, -1)[:count]


def composite(image: NDArray, matte: NDArray, ground: NDArray) -> NDArray:
    """The layer (H, W, 4) float32 of an RGB image over a colour `ground` (3,), alpha beside it."""
    return kernels.composite(image, matte, ground, ALPHA_GAIN)


def layer(
    composed: NDArray, origin: NDArray, ground: NDArray, levels: int, flatness: float, known: NDArray | None = None
) -> Layer:
    """Smooth and halve a composite (H, W, 4); at full size alpha counts by `flatness` (0 ... 1).

    `known` (H, W) is 0 where something else covers the layer.
    """
    if known is not None:
        return _seen_in_part(composed, origin, ground, levels, flatness, known)
    pyramid = [cv2.GaussianBlur(composed, (0, 0), 1.0)]
    for _ in range(levels - 1):
        pyramid.append(cv2.pyrDown(pyramid[-1]))
    pyramid[0][..., 3] *= flatness  # only now: the smaller ones keep it whole
    return Layer(tuple(pyramid), np.asarray(origin, float), np.append(ground, 0.0))


def _seen_in_part(
    composed: NDArray, origin: NDArray, ground: NDArray, levels: int, flatness: float, known: NDArray
) -> Layer:
    """The same where some pixels are hidden: every smoothed pixel is the mean of those that are seen.

    A pixel of which a quarter or more is hidden does not count all the same: it is the mean of one side only.
    """
    seen = known.astype(np.float32)
    parts, shares = [cv2.GaussianBlur(composed * seen[..., None], (0, 0), 1.0)], [cv2.GaussianBlur(seen, (0, 0), 1.0)]
    for _ in range(levels - 1):
        parts.append(cv2.pyrDown(parts[-1]))
        shares.append(cv2.pyrDown(shares[-1]))
    beyond = np.append(ground, 0.0).astype(np.float32)
    pyramid = [
        np.where(share[..., None] > 0.01, part / np.maximum(share, 0.01)[..., None], beyond)
        for part, share in zip(parts, shares)
    ]
    pyramid[0][..., 3] *= flatness
    counts = tuple(np.clip(4 * share - 3, 0, 1) for share in shares)
    return Layer(tuple(pyramid), np.asarray(origin, float), np.append(ground, 0.0), counts)


def halved(known: NDArray, levels: int) -> tuple[NDArray, ...]:
    """A map (H, W) of what can be seen, at all sizes."""
    pyramid = [known.astype(np.float32)]
    for _ in range(levels - 1):
        pyramid.append(cv2.pyrDown(pyramid[-1]))
    return tuple(pyramid)


def mean_color(image: NDArray, matte: NDArray) -> NDArray:
    """The layer's mean colour (3,)."""
    weight = matte[..., None] / max(float(matte.sum()), 1e-9)
    return (image[..., :3] * weight).sum(axis=(0, 1)).astype(np.float32)


def flatness(image: NDArray, matte: NDArray, ground: NDArray) -> float:
    """How far the silhouette needs alpha to be seen, 0 to 1.

    1 where the layer's rim has the colour of what it is laid over, 0 where it stands out by 30 grey levels: a rim of
    ink does, a grey rabbit on grey does not, however dark its eye.
    """
    solid = (matte > 0.9).astype(np.uint8)
    rim = solid & (1 - cv2.erode(solid, np.ones((3, 3), np.uint8), iterations=RIM))
    colors = image[..., :3][rim > 0].astype(float)
    contrast = np.sqrt(np.mean((colors - ground) ** 2)) if len(colors) else 0.0
    return float(np.clip(1.5 - contrast / 20.0, 0, 1))


def levels_for(outline: NDArray, most: int = 6) -> int:
    """How many sizes a layer with this outline (B, 2) is looked at: in the smallest it is 9 to 18 pixels across.

    There a turn by 45 degrees moves its rim little further than the smoothing reaches.  Still smaller, and it runs
    into what lies beside it.
    """
    across = float(np.ptp(outline, axis=0).max())
    return int(np.clip(np.floor(np.log2(across / 9.0)) + 1, 1, most))


def window(outline: NDArray, size: tuple[int, int], margin: float) -> tuple[slice, slice]:
    """Rows and columns of a picture (width, height) that hold an outline (B, 2) and a margin round it."""
    low = np.floor(outline.min(axis=0) - margin).astype(int)
    high = np.ceil(outline.max(axis=0) + margin).astype(int) + 1
    x0, y0 = np.clip(low, 0, (size[0] - 1, size[1] - 1))
    x1, y1 = np.clip(high, (x0 + 1, y0 + 1), size)
    return slice(int(y0), int(y1)), slice(int(x0), int(x1))


def points_of(level: int, shape: tuple[int, ...], origin: NDArray) -> NDArray:
    """Full-size positions (H, W, 2) of a level's pixels."""
    y, x = np.mgrid[: shape[0], : shape[1]]
    return np.stack([x, y], -1) * 2.0**level + origin
