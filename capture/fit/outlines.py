"""The outline of one part in every frame of a clip, cut by colour and traced, with points that correspond.

Nothing is known yet of the part's key drawings: each frame's matte is looked for where the last one was, forwards from
the frame in which the part was shown and then backwards.  A held drawing is recognised and not traced again.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from capture.fit.curves import correspond
from capture.fit.pixels import layer
from capture.fit.pixels import model as models
from capture.fit.pixels.sighting import REACH
from capture.motion import affine
from capture.pictures import matte
from capture.pictures.clip import Clip
from capture.pictures.held import is_held
from capture.pictures.matte import ColorModel
from capture.pictures.shot import Part
from capture.progress import progress

SPACING = 6.0  # pixels between the points of an outline
SIZES = (0.4, 2.5)  # times the last drawing's area: what is outside is not the part, or not all of it


@dataclass(frozen=True, eq=False)
class Outlines:
    """A part's outline in all frames of a clip; a frame without one holds the last."""

    points: NDArray  # (T, N, 2) pixels; point n is the same place of the character in every frame
    held: NDArray  # (T,) bool, the same drawing as the frame before
    whole: NDArray  # (T,) bool, found and not cut off by the picture's edge


@dataclass(frozen=True, eq=False)
class _Traced:
    """What one frame shows."""

    contour: NDArray  # (n, 2)
    solid: NDArray  # (H, W) uint8
    cut_off: bool  # it reaches the edge of the picture
    found: bool = True
    held: bool = False


def follow(part: Part, clip: Clip, first: int = 0, count: int | None = None) -> Outlines:
    """Outlines of a part through all frames; its first key says in which frame, and how, its pixels are told.

    The clip's frame 0 is number `first` of the shot's numbering.  Without `count` points are about 6 pixels apart.
    """
    shown = models.key_frames(part, clip, first)[0]
    picture = np.asarray(clip[shown])[..., :3]
    seed = models.seed(replace(part, keys=part.keys[:1]), [picture])[0]
    colors = matte.learn([seed])
    start = _traced(matte.cut_key(colors, seed), np.zeros(2), clip.size)
    forward = list(_run(part, colors, clip, range(shown, len(clip)), start))
    backward = list(_run(part, colors, clip, range(shown, -1, -1), start))[1:]
    frames = backward[::-1] + forward
    held = np.array([frame.held for frame in frames])
    held[: shown + 1] = np.append(False, held[:shown])  # backwards a frame is held that is like the one after it
    whole = np.array([frame.found for frame in frames])
    if not start.cut_off:  # a figure seen to the waist always reaches the edge: that is no fault
        whole &= ~np.array([frame.cut_off for frame in frames])
    if count is None:
        steps = np.diff(start.contour, axis=0, append=start.contour[:1])
        count = int(np.clip(np.linalg.norm(steps, axis=1).sum() / SPACING, 32, 120))
    return Outlines(corresponding([frame.contour for frame in frames], count), held, whole)


def _run(part: Part, colors: ColorModel, clip: Clip, frames: range, last: _Traced) -> Iterator[_Traced]:
    """What the frames show, in the order given, the first of which shows `last`."""
    yield last
    drawn = np.asarray(clip[frames[0]])[..., :3]
    margin = REACH + 0.25 * float(np.ptp(last.contour, axis=0).max())
    for t in progress(frames[1:], part.name, len(frames) - 1):
        image = np.asarray(clip[t])[..., :3]
        window = layer.window(last.contour, clip.size, margin)
        if is_held(drawn, image, window):
            last = replace(last, held=True)
            yield last
            continue
        alpha = _cut(colors, image[window], last.solid[window])
        if alpha is None:
            yield replace(last, found=False, held=False)
            continue
        colors, drawn = matte.adapt(colors, image[window], alpha), image
        last = _traced(alpha, np.array([window[1].start, window[0].start]), clip.size)
        yield last


def _cut(colors: ColorModel, image: NDArray, near: NDArray) -> NDArray | None:
    """The matte (h, w) of what touches the place `near` (h, w) where it last was, or is not far from it."""
    for reach in (0, 16, 48):
        brush = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1, 2 * reach + 1))
        alpha = matte.cut(colors, image, cv2.dilate(near, brush))
        if SIZES[0] < (alpha > 0.5).sum() / near.sum() < SIZES[1]:
            return alpha
    return None


def _traced(alpha: NDArray, origin: NDArray, size: tuple[int, int]) -> _Traced:
    """A matte (h, w), whose corner lies at `origin` in a picture of (width, height), as what a frame shows."""
    contour = matte.trace(alpha) + origin
    edge = (contour < 0.5).any() or (contour > np.array(size) - 1.5).any()
    return _Traced(contour, matte.fill(size, contour), bool(edge))


def corresponding(contours: list[NDArray], count: int) -> NDArray:
    """Outlines (T, count, 2) of closed contours, each (n, 2), with points that are the same place in all of them.

    Each contour is made round first and compared so: then points correspond under affine maps as well, for a squash
    makes some stretches of an outline longer than others.  One that is listed again (held) gives the same outline.
    """
    drawn = np.array([t for t in range(len(contours)) if t == 0 or contours[t] is not contours[t - 1]])
    rounding = np.stack([_rounding(contours[t]) for t in drawn])
    aligned = correspond.align_all([affine.apply(to_round, contours[t]) for to_round, t in zip(rounding, drawn)], count)
    points = affine.apply(affine.invert(rounding), aligned)
    return points[np.searchsorted(drawn, np.arange(len(contours)), side="right") - 1]


def _rounding(contour: NDArray) -> NDArray:
    """The map (2, 3) that gives the inside of a contour (n, 2) the same spread in all directions, its centre at (0, 0).

    It does not turn, and keeps the area.
    """
    middle = contour.mean(axis=0)
    moments = cv2.moments((contour - middle).astype(np.float32))
    centre = middle + np.array([moments["m10"], moments["m01"]]) / moments["m00"]
    spread = np.array([[moments["mu20"], moments["mu11"]], [moments["mu11"], moments["mu02"]]])
    size, ways = np.linalg.eigh(spread)
    linear = (ways / np.sqrt(size)) @ ways.T * np.prod(size) ** 0.25
    return np.column_stack([linear, -linear @ centre])
