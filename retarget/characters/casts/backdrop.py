"""What a performance is seen before: a colour, a picture, or a clip that runs along with it."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.pictures.clip import Clip
from retarget.characters.photos.photo import read_image

STILLS = (".png", ".jpg", ".jpeg", ".webp")
EARLY = 1e-3  # seconds: a frame that begins so little later is meant, times are rounded in files


def read_background(name: str | Path) -> str | NDArray | Clip:
    """A colour's name as it is, a picture's pixels (H, W, 4), or the clip of that name."""
    from capture.pictures.decode import read_clip

    path = Path(name)
    if is_color(str(name)):
        return str(name)
    if path.suffix.lower() in STILLS:
        return read_image(path)
    if not path.exists():
        raise InputError(
            f"a background must be a colour such as white or #ffeedd, a picture or a clip, got {name!s:.80}"
        )
    return read_clip(path)


def is_color(text: str) -> bool:
    from matplotlib.colors import is_color_like

    return is_color_like(text)


def behind(background: Any, t: int, seconds: float, size: tuple[int, int]) -> NDArray:
    """What is seen behind frame t, as a colour (3,) or pixels (H, W, 3) of the page's size (width, height).

    A clip runs by its own clock, whatever its frame rate, and holds its last frame; any other sequence of pictures is
    taken frame by frame.
    """
    if isinstance(background, Clip):
        background = background[frame_at(background, seconds)]
    elif not isinstance(background, str) and np.ndim(background[0]) == 3:
        background = background[min(t, len(background) - 1)]
    return _drawn(background, size)


def frame_at(clip: Clip, seconds: float) -> int:
    """The number of the frame that is on screen then; the last one stays."""
    return int(np.clip(np.searchsorted(clip.edges, seconds + EARLY, side="right") - 1, 0, len(clip) - 1))


def filling(picture: NDArray, size: tuple[int, int]) -> NDArray:
    """A picture (H, W, C) so large that it fills a page of `size` (width, height), what is over cut off evenly."""
    import cv2

    width, height = size
    zoom = max(width / picture.shape[1], height / picture.shape[0])
    if picture.shape[1::-1] == (width, height):
        return picture
    wanted = max(width, round(picture.shape[1] * zoom)), max(height, round(picture.shape[0] * zoom))
    larger = cv2.resize(picture, wanted, interpolation=cv2.INTER_AREA if zoom < 1 else cv2.INTER_LINEAR)
    left, top = (wanted[0] - width) // 2, (wanted[1] - height) // 2
    return larger[top : top + height, left : left + width]


def _drawn(background: Any, size: tuple[int, int]) -> NDArray:
    """A colour (3,) or an image (H, W, 3) of the page's size; an image's own alpha is laid on white."""
    if isinstance(background, str):
        from matplotlib.colors import to_rgb

        if not is_color(background):
            raise InputError(f"a background must be a colour such as white or #ffeedd, or an image, got {background!r}")
        return np.round(255 * np.array(to_rgb(background)))
    background = np.asarray(background)
    if background.ndim == 1 and len(background) >= 3:
        return background[:3]
    if background.ndim != 3 or background.shape[2] not in (3, 4):
        raise InputError(f"a background image must be (H, W, 3 or 4), got an array of shape {background.shape}")
    background = filling(background, size)
    if background.shape[2] == 4:
        alpha = background[..., 3:] / 255
        background = np.round(background[..., :3] * alpha + 255 * (1 - alpha))
    return background[..., :3]
