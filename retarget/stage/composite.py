"""A performance put into a picture, so that it belongs there: its edges as soft, its colours as warm, its shadow.

    figure over backdrop:   (1 - a) (backdrop, shaded) + a (figure, toned)

What is decided is decided once for a shot; a figure whose colours are matched anew in every frame would flicker.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from retarget.characters.casts import backdrop
from retarget.stage.draw2d import draw, page_size
from retarget.stage.perform import Performance

LOOKED_AT = 7  # frames of a shot by which the tone is set
MOST_CONTRAST = 1.5  # times, either way, that matching changes a figure's own contrast
LEANS, LIES = 0.55, 0.22  # a shadow falls so far to the right, and so far up, for one of the figure's height
HAZE = 0.012  # of the picture's height: how soft a shadow's edge is


@dataclass(frozen=True)
class Blend:
    """How a figure is made to belong; as it stands, it is laid over the picture as it was drawn."""

    soften: float = 0.0  # pixels its edges are blurred by; film is softer than a drawing
    match: float = 0.0  # 0-1, how far its brightness and colours go to those of the picture
    shadow: float = 0.0  # 0-1, how dark a shadow it throws on the ground it stands on

    def __post_init__(self) -> None:
        for name, most in (("soften", 50), ("match", 1), ("shadow", 1)):
            value = getattr(self, name)
            if not 0 <= value <= most:
                raise InputError(f"{name} must lie in 0 to {most}, it is {value}: choose a value between them")


def over(
    performance: Performance,
    background: Any,
    size: int | None = None,
    blend: Blend | None = None,
    front: Callable[[int], NDArray] | None = None,
) -> Iterator[NDArray]:
    """All frames uint8 (H, W, 3), `size` pixels wide, of a performance before a colour, a picture or a clip.

    `front` gives what is seen before the performers in frame t, (H, W, 4) uint8 with straight alpha.
    """
    blend = Blend() if blend is None else blend
    page = page_size(performance, size)
    zoom = page[0] / performance.size[0]
    times = performance.times

    def there(t: int) -> tuple[NDArray, NDArray]:
        seen = backdrop.behind(background, t, float(times[t]), page)
        return draw(performance, t, size=page), np.broadcast_to(seen, (page[1], page[0], 3)).astype(np.uint8)

    sampled = np.unique(np.linspace(0, len(times) - 1, LOOKED_AT).astype(int)) if blend.match else ()
    look = tone([there(t) for t in sampled], blend.match)
    ground = (_ground(performance) + 0.5) * zoom - 0.5
    for t in range(len(times)):
        figure, behind = there(t)
        behind = shaded(behind, figure[..., 3], ground, blend.shadow)
        made = laid(softened(toned(figure, look), blend.soften), behind)
        yield made if front is None else laid(backdrop.filling(front(t), page), made)


def laid(figure: NDArray, behind: NDArray) -> NDArray:
    """A figure uint8 (H, W, 4), straight alpha, over a picture uint8 (H, W, 3)."""
    if not figure[..., 3].any():
        return behind
    alpha = figure[..., 3:].astype(np.float32) / 255
    mixed = behind + alpha * (figure[..., :3].astype(np.float32) - behind)
    return np.round(mixed).astype(np.uint8)


def softened(figure: NDArray, pixels: float) -> NDArray:
    """The figure with its edges blurred by so many pixels; its inside stays sharp."""
    import cv2

    if pixels <= 0:
        return figure
    alpha = figure[..., 3].astype(np.float32) / 255
    whole = np.dstack([figure[..., :3] * alpha[..., None], alpha]).astype(np.float32)
    blurred = cv2.GaussianBlur(whole, (0, 0), pixels)
    around = blurred[..., :3] / np.maximum(blurred[..., 3:], 1e-4)  # what is just outside takes its neighbours' colour
    colors = figure[..., :3] * alpha[..., None] + around * (1 - alpha[..., None])
    return np.round(np.dstack([np.clip(colors, 0, 255), 255 * blurred[..., 3]])).astype(np.uint8)


def tone(pairs: list[tuple[NDArray, NDArray]], match: float) -> NDArray | None:
    """Gain and offset (2, 3) in Lab that take the figures' mean and spread to those behind them, as far as `match`.

    After Reinhard et al. 2001, "Color transfer between images", with bounds: a red cup stays red before a meadow.
    """
    import cv2

    seen = [(figure, behind) for figure, behind in pairs if (figure[..., 3] > 127).sum() > 16]
    if match <= 0 or not seen:
        return None
    own = np.concatenate([_lab(figure[..., :3])[figure[..., 3] > 127] for figure, _ in seen])
    others = np.concatenate([cv2.resize(_lab(behind), (64, 64), interpolation=cv2.INTER_AREA) for _, behind in seen])
    others = others.reshape(-1, 3)
    strength = match * np.array([0.7, 0.5, 0.5])  # of lightness, green to red, blue to yellow
    contrast = np.clip(others.std(axis=0) / np.maximum(own.std(axis=0), 1), 1 / MOST_CONTRAST, MOST_CONTRAST)
    contrast[1:] = np.minimum(contrast[1:], 1)  # colours are muted where the picture's are, never made louder
    gain = 1 + strength * (contrast - 1)
    towards = own.mean(axis=0) + strength * (others.mean(axis=0) - own.mean(axis=0))
    return np.stack([gain, towards - gain * own.mean(axis=0)])


def toned(figure: NDArray, look: NDArray | None) -> NDArray:
    """The figure in another tone (2, 3), in Lab."""
    import cv2

    if look is None:
        return figure
    lab = (_lab(figure[..., :3]) * look[0] + look[1]).astype(np.float32)
    lab[..., 0] = np.clip(lab[..., 0], 0, 100)
    rgb = np.round(255 * np.clip(cv2.cvtColor(lab, cv2.COLOR_LAB2RGB), 0, 1)).astype(np.uint8)
    return np.dstack([rgb, figure[..., 3]])


def shaded(behind: NDArray, alpha: NDArray, ground: float, darkness: float) -> NDArray:
    """The picture uint8 (H, W, 3) with the shadow of a figure's alpha uint8 (H, W) on the ground at row `ground`.

    The light comes from the upper left, in front: what is higher falls farther off, so a jump leaves its shadow.
    """
    import cv2

    if darkness <= 0 or not alpha.any():
        return behind
    height, width = alpha.shape
    falls = np.array([[1, -LEANS, LEANS * ground], [0, LIES, (1 - LIES) * ground]])
    cast = cv2.warpAffine(alpha, falls, (width, height), flags=cv2.INTER_LINEAR)
    cast = cv2.GaussianBlur(cast.astype(np.float32) / 255, (0, 0), max(0.5, HAZE * height))
    return np.round(behind * (1 - darkness * cast[..., None])).astype(np.uint8)


def _ground(performance: Performance) -> float:
    """The row (stage pixels) that the performers mostly stand on."""
    feet = [role.points[role.visible, :, 1].max(axis=1) for role in performance.roles if role.visible.any()]
    return float(max((np.percentile(rows, 75) for rows in feet), default=performance.size[1]))


def _lab(picture: NDArray) -> NDArray:
    import cv2

    return cv2.cvtColor(np.ascontiguousarray(picture, np.float32) / 255, cv2.COLOR_RGB2LAB)
