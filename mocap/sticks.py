"""Stick figures: what a skeleton or a rubber motion does, as pictures to look at.

Links are drawn from back to front, as thick as they are, the further away the paler, so that depth is seen without a
renderer.  A view is fixed once and used for all motions that are to be compared.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

PAPER, GROUND = (250, 249, 246), (214, 210, 202)
MIDDLE, LEFT, RIGHT = (62, 60, 66), (214, 92, 58), (44, 110, 176)
FINE = 2  # pictures are drawn this many times larger: OpenCV's own smooth lines have no joints
SHIFT = 4  # and given in sixteenths of those pixels


@dataclass(frozen=True, eq=False)
class View:
    """An orthographic view over T frames (or one for all): what is in its middle, and how large a metre is."""

    size: tuple[int, int]  # width and height in pixels
    scale: float  # pixels a metre
    middle: NDArray  # (T, 3) or (1, 3) metres, in the middle of the picture
    turn: float  # radians that the figure is turned about the vertical before it is looked at along -z


def view_of(
    positions: NDArray, size: tuple[int, int] = (240, 240), turn: float = 0.5, follow: bool = True, margin: float = 0.12
) -> View:
    """The view that holds all of positions (T, S, 3); with `follow` it goes along with the figure, but not up and down.

    `margin` is the share of the picture left free on each side.
    """
    low, high = positions.min(axis=1), positions.max(axis=1)  # (T, 3)
    middle = np.tile(0.5 * (low.min(axis=0) + high.max(axis=0)), (len(positions), 1))
    if follow:
        middle[:, [0, 2]] = positions.mean(axis=1)[:, [0, 2]]
    reach = np.abs(_turned(positions - middle[:, None], turn)).max(axis=(0, 1))
    width, height = size
    scale = (0.5 - margin) * min(width / max(reach[0], 1e-9), height / max(reach[1], 1e-9))
    return View(size, float(scale), middle, turn)


def draw(
    positions: NDArray,
    parents: tuple[int, ...],
    view: View,
    radius: NDArray | float = 0.03,
    colors: NDArray | None = None,
    ground: float | None = 0.0,
) -> Iterator[NDArray]:
    """A picture (H, W, 3), uint8 RGB, for every frame of positions (T, S, 3).

    `radius` is half a link's thickness in metres, one for all, (S,) or (T, S), and a link has that of its far end;
    `colors` (S, 3) likewise.  `ground` is the height at which a line is drawn, None for none.
    """
    frames, count = positions.shape[:2]
    radius = np.broadcast_to(radius, (frames, count))
    colors = np.tile(MIDDLE, (count, 1)) if colors is None else np.asarray(colors, float)
    seen = project(positions, view)
    for t in range(frames):
        yield _frame(seen[t], parents, view, radius[t] * view.scale, colors, _level(view, t, ground))


def project(positions: NDArray, view: View) -> NDArray:
    """Pixels and pixels towards the viewer (T, S, 3) of positions (T, S, 3)."""
    seen = view.scale * _turned(positions - view.middle[:, None], view.turn)
    seen[..., 1] *= -1
    seen[..., :2] += (np.array(view.size) - 1) / 2
    return seen


def sides(names: tuple[str, ...]) -> NDArray:
    """Colours (S, 3) by what joints are called: warm on the left of the body, cool on its right, grey between."""
    colors = []
    for name in names:
        plain = name.rsplit(":", 1)[-1].lower().removesuffix(" end")
        left = "left" in plain or (plain[:1] == "l" and plain[1:2] != "o") or plain.endswith(("_l", ".l"))
        right = "right" in plain or (plain[:1] == "r" and not plain.startswith("root")) or plain.endswith(("_r", ".r"))
        colors.append(LEFT if left else RIGHT if right else MIDDLE)
    return np.array(colors, float)


def _turned(points: NDArray, turn: float) -> NDArray:
    cos, sin = np.cos(turn), np.sin(turn)
    return points @ np.array([[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]]).T


def _level(view: View, t: int, ground: float | None) -> float | None:
    """The row of the picture at which the ground is."""
    if ground is None:
        return None
    middle = view.middle[min(t, len(view.middle) - 1)]
    return (view.size[1] - 1) / 2 - view.scale * (ground - middle[1])


def _frame(
    seen: NDArray, parents: tuple[int, ...], view: View, radius: NDArray, colors: NDArray, level: float | None
) -> NDArray:
    width, height = view.size
    picture = np.empty((FINE * height, FINE * width, 3), np.uint8)
    picture[:] = PAPER
    if level is not None and level < height:
        picture[max(round(FINE * level), 0) :] = GROUND
    links = [(child, parent) for child, parent in enumerate(parents) if parent >= 0]
    links.sort(key=lambda link: seen[link[0], 2] + seen[link[1], 2])
    reach = max(np.abs(seen[:, 2]).max(), 1e-9)
    for child, parent in links:
        near = 0.5 + 0.25 * (seen[child, 2] + seen[parent, 2]) / reach  # 0 at the back, 1 in front
        shade = tuple(float(c) for c in np.array(PAPER) + (0.55 + 0.45 * near) * (colors[child] - np.array(PAPER)))
        first = radius[parent] if parents[parent] >= 0 else radius[child]
        _capsule(picture, seen[parent, :2], seen[child, :2], first, radius[child], shade)
    return cv2.resize(picture, view.size, interpolation=cv2.INTER_AREA)


def _capsule(picture: NDArray, start: NDArray, end: NDArray, first: float, last: float, color: tuple) -> None:
    """A link with round ends, as thick at its ends as the links it goes between."""
    along = end - start
    length = np.linalg.norm(along)
    across = np.array([-along[1], along[0]]) / length if length > 1e-9 else np.zeros(2)
    corners = np.array([start + first * across, end + last * across, end - last * across, start - first * across])
    cv2.fillConvexPoly(picture, _fixed(corners), color, cv2.LINE_AA, SHIFT)
    for middle, radius in ((start, first), (end, last)):
        at = _fixed(middle)
        size = max(round(FINE * (1 << SHIFT) * float(radius)), 1)
        cv2.circle(picture, (int(at[0]), int(at[1])), size, color, cv2.FILLED, cv2.LINE_AA, SHIFT)


def _fixed(pixels: NDArray) -> NDArray:
    """Pixels of the picture as sixteenths of the larger one's: both have whole numbers in the middles of pixels."""
    return np.rint(((pixels + 0.5) * FINE - 0.5) * (1 << SHIFT)).astype(np.int32)
