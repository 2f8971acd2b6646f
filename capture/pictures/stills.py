"""Pictures as clips: animated GIF, PNG and WebP, folders, sprite sheets, and a single still."""

import io
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Lock

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageOps

from capture.errors import InputError
from capture.pictures.clip import CACHED_BYTES, DEFAULT_FPS, Clip, remembering

FORMATS = ("GIF", "PNG", "WEBP", "JPEG", "BMP")
SUFFIXES = (".png", ".jpg", ".jpeg", ".webp", ".bmp")
DAMAGE = (OSError, EOFError, SyntaxError, ValueError, Image.DecompressionBombError)  # what Pillow raises
ORIENTATION = 0x0112  # EXIF: 5 to 8 lie on their side
BROWSERS_PAUSE = 0.1  # seconds: what players make of a delay under 0.02


def is_picture(path: Path) -> bool:
    """Whether the file is a still or an animated picture, by its content and not its name."""
    try:
        with Image.open(path, formats=FORMATS):
            return True
    except Image.UnidentifiedImageError:
        return False
    except Image.DecompressionBombError:
        return True


def read_picture(path: Path, tile: tuple[int, int] | None) -> Clip:
    """One picture file: an animation if it has several frames, a sheet if `tile` is given, else one frame."""
    with _damage_told(path):
        image = Image.open(io.BytesIO(path.read_bytes()), formats=FORMATS)  # no file is left open
        animated = image.format in ("GIF", "PNG", "WEBP") and image.n_frames > 1
        if animated and tile is not None:
            raise InputError(f"{path}: a tile needs a single picture, this has several frames; leave it out")
        if animated:
            return _animation(path, image)
        sheet = pixels(image)
    return _still(path, sheet) if tile is None else _sheet(path, sheet, tile)


def read_folder(path: Path) -> Clip:
    """The pictures of a folder as frames, in the order of the numbers in their names; all of one size."""
    files = sorted(
        (p for p in path.iterdir() if p.suffix.lower() in SUFFIXES and not p.name.startswith(".")),
        key=_natural_order,
    )
    if not files:
        raise InputError(f"{path}: a folder must hold pictures ({', '.join(SUFFIXES)}), this has none; fill it")
    has_alpha, size = False, None
    for file in files:
        with _damage_told(file), Image.open(file, formats=FORMATS) as image:
            on_its_side = image.getexif().get(ORIENTATION, 1) > 4
            this = image.size[::-1] if on_its_side else image.size
            has_alpha |= image.has_transparency_data
        size = size or this
        if this != size:
            raise InputError(
                f"{path}: all pictures must be {size[0]}x{size[1]} like {files[0].name}, {file.name} is "
                f"{this[0]}x{this[1]}; scale it or take it out"
            )

    def fetch(i: int) -> NDArray:
        with _damage_told(files[i]), Image.open(files[i], formats=FORMATS) as image:
            return pixels(image, has_alpha)

    edges = np.arange(len(files) + 1) / DEFAULT_FPS
    return Clip(str(path), size, DEFAULT_FPS, edges, has_alpha, (), remembering(fetch, size))


def pixels(image: Image.Image, with_alpha: bool | None = None) -> NDArray:
    """A Pillow image of any mode as uint8 RGB (H, W, 3), or RGBA (H, W, 4) if it has or is to have alpha."""
    image = ImageOps.exif_transpose(image)
    if with_alpha is None:
        with_alpha = image.has_transparency_data
    if image.mode.startswith("I"):  # 16 bits a pixel: Pillow's own conversion would clip, not scale
        deep = np.clip(np.asarray(image), 0, 65535).astype(np.uint32)
        image = Image.fromarray(((deep * 255 + 32767) // 65535).astype(np.uint8))
    return np.asarray(image.convert("RGBA" if with_alpha else "RGB"))


def _natural_order(path: Path) -> tuple:
    """frame2 before frame10, and names that differ only in leading zeros in a fixed order."""
    words = re.split(r"(\d+)", path.stem.lower())
    return tuple(int(word) if k % 2 else word for k, word in enumerate(words)), path.name


def _animation(path: Path, image: Image.Image) -> Clip:
    """One pass for the durations and for how much of the file decodes; Pillow applies the disposals."""
    first = 1 if image.info.get("default_image") else 0  # an APNG's stand-in for viewers that cannot play it
    promised = image.n_frames - first
    durations, has_alpha = [], False
    for k in range(first, image.n_frames):
        try:
            image.seek(k)
            image.load()
        except DAMAGE:
            break
        seconds = image.info.get("duration", 0) / 1000
        durations.append(seconds if seconds >= 0.015 else BROWSERS_PAUSE)
        has_alpha |= image.has_transparency_data and pixels(image, True)[..., 3].min() < 255
    count = len(durations)
    if count == 0:
        raise InputError(f"{path}: a clip must hold frames, none of {promised} decodes; make the file again")
    notes = () if count == promised else (told_short(path, promised, count),)
    lock, passed = Lock(), {}
    room = max(CACHED_BYTES // (4 * image.width * image.height), 2)

    def decoded(i: int) -> NDArray:
        image.seek(first + i)
        return pixels(image, bool(has_alpha))

    def fetch(i: int) -> NDArray:
        with lock, _damage_told(path):
            if first + i > image.tell():
                return decoded(i)
            if i not in passed:  # every step back starts from the first frame: take many frames at once
                passed.clear()
                passed.update((n, decoded(n)) for n in range(max(i - room + 1, 0), i + 1))
            return passed[i]

    edges = np.concatenate([[0.0], np.cumsum(durations)])
    fps = round(count / float(edges[-1]), 6)
    return Clip(str(path), image.size, fps, edges, bool(has_alpha), notes, remembering(fetch, image.size))


def told_short(path: Path, promised: int, count: int) -> str:
    """The note about a clip of which only the first `count` frames can be had."""
    return f"{path.name} is damaged or ends early: it promises {promised} frames, the first {count} are used."


def _still(path: Path, picture: NDArray) -> Clip:
    size, edges = (picture.shape[1], picture.shape[0]), np.arange(2) / DEFAULT_FPS
    return Clip(str(path), size, DEFAULT_FPS, edges, picture.shape[2] == 4, (), remembering(lambda i: picture, size))


def _sheet(path: Path, sheet: NDArray, tile: tuple[int, int]) -> Clip:
    """Tiles row by row; those at the end of one colour, or wholly transparent, are padding and dropped."""
    (width, height), (H, W) = tile, sheet.shape[:2]
    if not (1 <= width <= W and 1 <= height <= H):
        raise InputError(
            f"{path}: a tile must be at least 1x1 and fit the {W}x{H} sheet, it is {width}x{height}; "
            "give the width and height of one sprite"
        )
    columns, rows = W // width, H // height

    def fetch(i: int) -> NDArray:
        y, x = (i // columns) * height, (i % columns) * width
        return sheet[y : y + height, x : x + width]

    count = columns * rows
    while count and _is_blank(fetch(count - 1)):
        count -= 1
    if count == 0:
        raise InputError(f"{path}: a sheet must hold drawings, all its tiles are blank; check their size")
    notes = ()
    if W % width or H % height:
        notes = (
            f"{path.name} is {W}x{H}: tiles of {width}x{height} leave {W % width} columns "
            f"and {H % height} rows of pixels over.",
        )
    edges = np.arange(count + 1) / DEFAULT_FPS
    fetch = remembering(fetch, tile)
    return Clip(str(path), (width, height), DEFAULT_FPS, edges, sheet.shape[2] == 4, notes, fetch)


def _is_blank(tile: NDArray) -> bool:
    if tile.shape[2] == 4 and not tile[..., 3].any():
        return True
    return bool((tile == tile[0, 0]).all())


@contextmanager
def _damage_told(path: Path) -> Iterator[None]:
    try:
        yield
    except InputError:
        raise
    except DAMAGE as error:
        raise InputError(
            f"{path}: the picture must decode, it does not ({error}); save it again or leave it out"
        ) from error
