"""Pictures that are moved but never bent, for vector formats: cut out once, then only placed.

A plane's affine map is a travel, a turn, a slant of its uprights and a stretch, in this order from the outside: the
four words that SVG and Lottie both have for it.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from capture.motion import affine
from retarget.characters.photos.picture import DrawnPicture
from retarget.export.elements import Element
from retarget.stage.draw2d import draw_things

BENT = 0.05
"""A picture counts as not bent while an affine map brings all its points within this many pixels."""

TEXELS = 2.0
"""Picture pixels for a pixel of the page, at most."""


@dataclass(frozen=True, eq=False)
class Still:
    """A cut-out picture, and where its top-left corner, its rows and its columns go in T frames."""

    pixels: NDArray  # (h, w, 4) uint8, straight alpha
    travel: NDArray  # (T, 2) pixels of the page, from its corner
    turn: NDArray  # (T,) degrees, from x towards y, continuous
    slant: NDArray  # (T,) degrees
    stretch: NDArray  # (T, 2)

    def maps(self) -> NDArray:
        """The affine maps (T, 2, 3) that the four make together."""
        c, s = np.cos(np.radians(self.turn)), np.sin(np.radians(self.turn))
        turn = np.stack([np.stack([c, -s], axis=-1), np.stack([s, c], axis=-1)], axis=-2)
        slant = np.tile(np.eye(2), (len(turn), 1, 1))
        slant[:, 0, 1] = np.tan(np.radians(self.slant))
        return np.concatenate([turn @ slant * self.stretch[:, None], self.travel[..., None]], axis=-1)


def still_of(element: Element) -> Still | None:
    """A picture in T frames as a still, or nothing where it bends or melts into another."""
    first = element.drawn[0]
    if not isinstance(first, DrawnPicture):
        return None
    if any(len(picture.layers) > 1 or picture.layers[0][0] is not first.layers[0][0] for picture in element.drawn):
        return None
    layer = first.layers[0][0]
    points = np.stack(element.curve("points"))
    place = affine.fit(layer.points, points)
    if np.abs(affine.apply(place, layer.points) - points).max() > BENT:
        return None
    size = min(1.0, TEXELS * float(np.linalg.norm(place[..., :2], axis=1).max()))
    low = np.floor(layer.points.min(axis=0)) - 1
    width, height = np.ceil((np.ptp(layer.points, axis=0) + 3) * size).astype(int).tolist()
    corner = (layer.points - low + 0.5) * size  # from the cut-out's own corner
    pixels = draw_things([replace(first, points=corner - 0.5, scale=size)], (width, height))
    return _told(pixels, affine.fit(corner, points))


def _told(pixels: NDArray, maps: NDArray) -> Still:
    """Maps (T, 2, 3) in the four words: the first column is a turn and a stretch, the second says the rest."""
    linear = maps[..., :2]
    angle = np.unwrap(np.arctan2(linear[:, 1, 0], linear[:, 0, 0]))
    c, s = np.cos(angle), np.sin(angle)
    across = np.maximum(np.hypot(linear[:, 0, 0], linear[:, 1, 0]), 1e-9)
    aside = c * linear[:, 0, 1] + s * linear[:, 1, 1]
    down = c * linear[:, 1, 1] - s * linear[:, 0, 1]
    down = np.where(np.abs(down) < 1e-9, 1e-9, down)
    slant = np.degrees(np.arctan(aside / down))
    return Still(pixels, maps[..., 2], np.degrees(angle), slant, np.stack([across, down], axis=-1))
