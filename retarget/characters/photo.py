"""Photographs made ready to play: read at a size that can be bent quickly, and cut out by a box."""

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError

LARGEST = 8_000_000  # pixels of a picture that are kept; no page shows more of a character
CUT_AT = 700  # pixels of the longer edge at which a photograph is cut out: what belongs together shows there, quickly
ORIENTATION = 0x0112  # EXIF: which way up a camera was held; 5 to 8 lie on their side
SOFT = 1.0  # pixels of that size: how soft the cut is


@dataclass(frozen=True, eq=False)
class Photo:
    """A picture's pixels, maybe fewer than it has, and how large it is."""

    pixels: NDArray  # (h, w, 4) uint8, straight alpha
    size: tuple[int, int]  # its own width and height
    notes: tuple[str, ...] = ()  # what a user should be told

    def from_own(self, points: NDArray) -> NDArray:
        """Points (..., 2) of the picture as points of its pixels."""
        return (np.asarray(points, float) + 0.5) * self._scale() - 0.5

    def to_own(self, points: NDArray) -> NDArray:
        """Points (..., 2) of the pixels as points of the picture."""
        return (np.asarray(points, float) + 0.5) / self._scale() - 0.5

    def _scale(self) -> NDArray:
        return np.array(self.pixels.shape[1::-1]) / self.size


def read_photo(path: str | Path) -> Photo:
    """An image file, turned upright if it says so; more than 8 megapixels are scaled down, and that is noted."""
    from PIL import Image, ImageOps, UnidentifiedImageError

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)  # large is what photographs are
            with Image.open(path) as image:
                lies = image.getexif().get(ORIENTATION, 1)
                size = image.size if lies < 5 else image.size[::-1]
                times = int(np.ceil(np.sqrt(size[0] * size[1] / LARGEST)))
                if times > 1:
                    image.draft("RGB", (image.width // times, image.height // times))  # a JPEG can be read smaller
                left = int(np.ceil(np.sqrt(image.width * image.height / LARGEST)))
                small = _eight_bits(image)
                small = small.reduce(left) if left > 1 else small  # before anything else copies it
                small.getexif()[ORIENTATION] = lies
                pixels = np.array(ImageOps.exif_transpose(small).convert("RGBA"))
    except FileNotFoundError:
        raise InputError(f"a picture must be a file that exists: there is no {path}") from None
    except (OSError, UnidentifiedImageError, ValueError) as error:
        raise InputError(f"{path} must be a picture such as PNG or JPG, it cannot be read: {error}") from None
    except Image.DecompressionBombError:
        raise InputError(f"{path} must have no more than 178 megapixels, it has: make it smaller") from None
    height, width = pixels.shape[:2]
    if (width, height) == size:
        return Photo(pixels, size)
    large = size[0] * size[1] / 1e6
    note = f"{path}: {size[0]} x {size[1]} pixels ({large:.0f} megapixels) are scaled down to {width} x {height}"
    return Photo(pixels, size, (note,))


def _eight_bits(image: Any) -> Any:
    """A Pillow image in grey or colours of 8 bits, with alpha where it has some."""
    from PIL import Image

    if image.mode in ("RGB", "RGBA", "L") and "transparency" not in image.info:
        return image
    if image.mode.startswith("I"):  # 16 bits: Pillow's own conversion cuts off what is brighter than 255
        deep = np.clip(np.asarray(image), 0, 65535).astype(np.uint32)
        return Image.fromarray(((deep * 255 + 32767) // 65535).astype(np.uint8))
    return image.convert("RGBA")


def cut_out(photo: Photo, box: tuple[float, float, float, float], name: str = "the photograph") -> Photo:
    """The photo with everything transparent but what a box (x, y, width, height), in its own pixels, is drawn round.

    What belongs together in the box and differs from its surroundings is found by grabCut.  Colours of the rim are
    taken from farther in, for in a photograph the background shines into them.
    """
    import cv2

    from capture.pictures import matte

    height, width = photo.pixels.shape[:2]
    small = min(1.0, CUT_AT / max(height, width))
    size = max(1, round(width * small)), max(1, round(height * small))
    picture = cv2.resize(photo.pixels[..., :3], size, interpolation=cv2.INTER_AREA)
    corners = np.array([box[:2], np.add(box[:2], box[2:])]) * size / photo.size
    low, high = corners
    if not (min(box[2:]) > 0 and (low >= -0.5).all() and (high <= np.array(size) + 0.5).all()):  # NaN is in no picture
        raise InputError(
            f"{name}: a box (x, y, width, height) must lie inside the {photo.size[0]} x {photo.size[1]} picture, got "
            f"({', '.join(f'{edge:g}' for edge in box)}): draw it round what is to be cut out"
        )
    low, high = np.clip(low, 0, size), np.clip(high, 0, size)
    seed = matte.seed_box(picture, (*low, *(high - low)))
    solid = cv2.morphologyEx(seed.inside, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    solid = seed.inside if not solid.any() else solid
    soft = cv2.resize(cv2.GaussianBlur(solid.astype(np.float32), (0, 0), 2 * SOFT), (width, height))
    sharp = max(1.0, small * min(3.0, 1 / small) / SOFT)
    alpha = np.clip((soft - 0.5) * 2.5 * sharp + 0.5, 0, 1)
    deep = cv2.resize(cv2.erode(solid, np.ones((5, 5), np.uint8)), (width, height), interpolation=cv2.INTER_NEAREST)
    alpha = alpha * (photo.pixels[..., 3] / 255)
    pixels = np.dstack([_from_inside(photo.pixels[..., :3], deep > 0), np.round(255 * alpha).astype(np.uint8)])
    return Photo(pixels, photo.size, photo.notes)


def _from_inside(colors: NDArray, deep: NDArray) -> NDArray:
    """Colours (H, W, 3) with those outside the deep mask (H, W) taken from its nearest pixel."""
    import cv2

    if not deep.any():
        return colors
    _, label = cv2.distanceTransformWithLabels((~deep).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    color_of = np.zeros((label.max() + 1, 3), np.uint8)
    color_of[label[deep]] = colors[deep]
    return np.where(deep[..., None], colors, color_of[label])
