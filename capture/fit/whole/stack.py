"""Pictures of a part side by side: the layers of many drawings on canvases of one size."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from capture.fit.pixels import layer
from capture.fit.pixels import model as models
from capture.fit.pixels.model import PartModel
from capture.fit.whole.course import Course, placed_of
from capture.pictures import matte
from capture.pictures.clip import Clip
from capture.pictures.matte import ColorModel

MARGIN = 32  # pixels round the outline
PICTURES = 4  # of a held drawing are averaged: half the noise of one, at no more cost however long it is held
SMEARED = 2  # pixels over which the smoothing carries what covers a layer
DOUBT = 4  # pixels by which an outline may still be off where the layer is said to be covered
LEVELS = 3  # from full size
BYTES = 2**25  # of the full-size canvases that are looked at together

Covers = Callable[[int], list[NDArray]]
"""The outlines (B, 2) of whatever lies over a part in a frame."""


@dataclass(frozen=True, eq=False)
class Stack:
    """Layers of B drawings."""

    numbers: NDArray  # (B,) of the drawings
    levels: tuple[NDArray, ...]  # (B, 5, h, w) float32: colour and alpha less the ground's, and 1 where they are known
    origins: NDArray  # (B, 2) the full-size pixel of each canvas's first pixel


def stacks(model: PartModel, clip: Clip, course: Course, start: int, covers: Covers) -> Iterator[Stack]:
    """Yield the course's drawings a stack at a time, from drawing `start` on and then back from it.

    The colours are those of drawing `start` and follow the clip slowly either way, as they do in the capture.
    """
    placed, alpha = placed_of(course.unknowns, model)
    outlines = [models.outline_at(model, *pose) for pose in zip(placed, alpha)]
    most = np.array(clip.size) + 2 * MARGIN
    width, height = np.minimum(np.ceil(np.max([np.ptp(o, axis=0) for o in outlines], axis=0)) + 2 * MARGIN, most)
    shape = (int(height), int(width))
    count = max(1, BYTES // (20 * shape[0] * shape[1]))
    for way in (np.arange(start, len(outlines)), np.arange(start - 1, -1, -1)):
        colors = model.colors
        for begin in range(0, len(way), count):
            numbers, layers = way[begin : begin + count], []
            for g in numbers:
                seen, colors = _drawing(model, clip, course, g, outlines[g], shape, colors, covers)
                layers.append(seen)
            yield _stacked(numbers, layers)


def only(stack: Stack, chosen: NDArray) -> Stack:
    """Some drawings (B,) of a stack."""
    return Stack(stack.numbers[chosen], tuple(level[chosen] for level in stack.levels), stack.origins[chosen])


def _drawing(
    model: PartModel,
    clip: Clip,
    course: Course,
    number: int,
    outline: NDArray,
    shape: tuple[int, int],
    colors: ColorModel,
    covers: Covers,
) -> tuple[layer.Layer, ColorModel]:
    """The layer of one drawing, the mean of its pictures, on a canvas that may reach beyond the picture."""
    middle = 0.5 * (outline.min(axis=0) + outline.max(axis=0))
    origin = np.round(middle - 0.5 * np.array(shape[::-1])).astype(int)
    low = np.clip(origin, 0, clip.size)
    high = np.clip(origin + shape[::-1], 0, clip.size)
    ground = np.append(model.view.ground, 0).astype(np.float32)
    composed, known = np.tile(ground, (*shape, 1)), np.zeros(shape, np.uint8)
    if (high > low).all():
        window = slice(low[1], high[1]), slice(low[0], high[0])
        inner = tuple(slice(a - o, b - o) for a, b, o in zip(low[::-1], high[::-1], origin[::-1]))
        size = tuple(int(side) for side in high - low)
        near = matte.fill(size, np.clip(outline - low, -1e4, 1e4))
        shown = _shown(course, number)
        pictures = []
        for frame in shown:
            picture = np.asarray(clip[int(frame)])[window][..., :3]
            alpha = matte.cut(colors, picture, near)
            pictures.append(layer.composite(picture, alpha, model.view.ground))
        composed[inner] = np.mean(pictures, axis=0)
        if course.seen[number]:
            colors = matte.adapt(colors, picture, alpha)
        free = np.ones(size[::-1], np.uint8)
        if course.seen[number]:
            # where the layer should be well inside but is not, something of another colour lies over it
            free &= 1 - (cv2.erode(near, _brush(DOUBT)) & (alpha < 0.5))
        for cover in covers(int(shown[0])):
            free &= 1 - matte.fill(size, np.clip(cover - low, -1e4, 1e4))
        known[inner] = free
    known = cv2.erode(known, _brush(SMEARED), borderType=cv2.BORDER_CONSTANT, borderValue=0)
    levels = min(LEVELS, model.view.levels)
    return layer.layer(composed, origin, model.view.ground, levels, model.view.flatness, known), colors


def _brush(reach: int) -> NDArray:
    return np.ones((2 * reach + 1, 2 * reach + 1), np.uint8)


def _shown(course: Course, number: int) -> NDArray:
    """The frames of a drawing that are looked at, evenly spread over the time it is held."""
    held = int(course.held[number])
    steps = np.arange(held) if held <= PICTURES else np.round(np.linspace(0, held - 1, PICTURES)).astype(int)
    return course.first[number] + steps


def _stacked(numbers: NDArray, layers: list[layer.Layer]) -> Stack:
    levels = []
    for number in range(len(layers[0].levels)):
        values = np.stack([seen.levels[number] for seen in layers]) - layers[0].ground.astype(np.float32)
        known = np.stack([seen.known[number] for seen in layers])[..., None]
        levels.append(np.ascontiguousarray(np.concatenate([values, known], axis=-1).transpose(0, 3, 1, 2)))
    return Stack(numbers, tuple(levels), np.stack([seen.origin for seen in layers]))
