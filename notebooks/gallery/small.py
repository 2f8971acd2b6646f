"""Small pictures: panels cut to where something moves, in few colours that do not flicker, at their true times."""

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from capture.files import written_beside
from capture.pictures.encode import write_clip

MOVES = 40  # of 255: a pixel that changes by less does not move; video leaves some noise
MARGIN = 0.04  # of a picture's width, left free round what moves
NOISE, HELD = 12, 6  # of 255: how far video strays from what stands still, and from what a pixel just was
DRAWN_ANEW = 24  # of 255: where no pixel changes by more, the drawing is held
INK = (43, 43, 43)
BAND = 22  # pixels
MOST_LOOKED_AT = 40  # frames


def write_gif(file: Path, frames: Sequence[NDArray], fps: float, colours: int, hold: float) -> None:
    """Write frames (H, W, 3) in so many colours; the last one stays `hold` seconds longer."""
    edges = np.append(np.arange(len(frames)) / fps, len(frames) / fps + hold)
    write_clip(file, few(frames, colours), fps, edges)


def write_png(file: Path, picture: NDArray, colours: int = 128) -> None:
    """Write one picture (H, W, 3) in so many colours: drawings and pages have few."""
    palette = _palette([picture], colours)
    entries = Image.new("P", (1, 1))
    entries.putpalette(palette.tobytes())
    image = Image.fromarray(picture).quantize(palette=entries, dither=Image.Dither.NONE)
    with written_beside(file) as temporary:
        image.save(temporary, format="PNG", optimize=True)


def few(frames: Sequence[NDArray], colours: int) -> list[NDArray]:
    """The frames in one palette of so many colours; what stands still keeps its colour."""
    from scipy.spatial import KDTree

    frames = settled(frames)
    palette = _palette(frames, colours)
    cells = np.stack(np.meshgrid(*[np.arange(2, 256, 4)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    nearest = KDTree(palette.astype(float)).query(cells)[1]
    return [palette[nearest[_packed(frame >> 2, bits=6)]].reshape(frame.shape) for frame in frames]


def settled(frames: Sequence[NDArray]) -> list[NDArray]:
    """The frames without video's noise: a pixel that is nearly as it mostly is, or as it just was, is so exactly."""
    usual = np.median(np.stack(frames[:: len(frames) // MOST_LOOKED_AT + 1]), axis=0).astype(np.uint8)
    made: list[NDArray] = []
    for frame in frames:
        as_usual = np.abs(frame.astype(int) - usual).max(axis=-1, keepdims=True) <= NOISE
        frame = np.where(as_usual, usual, frame)
        if made:
            stays = np.abs(frame.astype(int) - made[-1]).max(axis=-1, keepdims=True) <= HELD
            frame = np.where(stays & ~as_usual, made[-1], frame)
            if np.abs(frame.astype(int) - made[-1]).max() <= DRAWN_ANEW:
                frame = made[-1]
        made.append(frame)
    return made


def scaled(frames: Sequence[NDArray], width: int) -> list[NDArray]:
    """Frames so many pixels wide."""
    height = round(frames[0].shape[0] * width / frames[0].shape[1])
    return [cv2.resize(frame[..., :3], (width, height), interpolation=cv2.INTER_AREA) for frame in frames]


def named(frames: Sequence[NDArray], name: str) -> list[NDArray]:
    """The frames under a band with a name."""
    from matplotlib import font_manager

    font = ImageFont.truetype(font_manager.findfont("DejaVu Sans"), 12)
    band = Image.new("RGB", (frames[0].shape[1], BAND), tuple(map(int, frames[0][0, 0])))
    ImageDraw.Draw(band).text((8, BAND / 2), name, INK, font, "lm")
    return [np.concatenate([np.asarray(band), frame]) for frame in frames]


def cut(
    clips: Sequence[Sequence[NDArray]], by: Sequence[Sequence[NDArray]] = (), shape: float = 0.0
) -> list[list[NDArray]]:
    """Clips of one size, all cut to the same window: what moves in any of them, or in `by`, with a margin.

    `shape` is the least width of the window by its height.
    """
    height, width = clips[0][0].shape[:2]
    boxes = np.array([box for frames in by or clips if (box := moving(frames)) is not None])
    margin = round(MARGIN * width)
    left, top = np.maximum(boxes[:, :2].min(axis=0) - margin, 0)
    right, bottom = np.minimum(boxes[:, 2:].max(axis=0) + margin, (width, height))
    if right - left < shape * (bottom - top):
        wide = min(round(shape * (bottom - top)), width)
        left = int(np.clip((left + right - wide) // 2, 0, width - wide))
        right = left + wide
    return [[frame[top:bottom, left:right, :3] for frame in frames] for frames in clips]


def moving(frames: Sequence[NDArray]) -> tuple[int, int, int, int] | None:
    """Left, top, right and bottom of the pixels that change in a clip; None where nothing does."""
    first = frames[0][..., :3].astype(int)
    changed = np.zeros(first.shape[:2], bool)
    for frame in frames:
        changed |= np.abs(frame[..., :3] - first).max(axis=-1) > MOVES
    sure = cv2.morphologyEx(changed.astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    rows, columns = np.flatnonzero(sure.any(axis=1)), np.flatnonzero(sure.any(axis=0))
    if len(rows) == 0:
        return None
    return int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1


def beside(*clips: Sequence[NDArray]) -> list[NDArray]:
    """Clips of equal height next to each other, frame by frame."""
    return [np.concatenate([frame[..., :3] for frame in row], axis=1) for row in zip(*clips, strict=True)]


def above(*clips: Sequence[NDArray]) -> list[NDArray]:
    """Clips of equal width, the first on top."""
    return [np.concatenate([frame[..., :3] for frame in row], axis=0) for row in zip(*clips, strict=True)]


def _palette(frames: Sequence[NDArray], colours: int) -> NDArray:
    """So many colours (n, 3); each that is seen has a say by the root of its area, lest small parts lose theirs."""
    seen, counts = np.unique(np.concatenate([_packed(frame).ravel() for frame in frames]), return_counts=True)
    each = np.stack([seen >> 16, seen >> 8 & 255, seen & 255], axis=-1).astype(np.uint8)
    if len(seen) <= colours:
        return each
    cell = _packed(each >> 3, bits=5)
    area = np.bincount(cell, counts)[cell]
    say = counts / np.sqrt(area)
    pixels = np.repeat(each, np.ceil(say * 2**17 / say.sum()).astype(int), axis=0)[None]
    small = Image.fromarray(pixels).quantize(colours, Image.Quantize.MEDIANCUT, kmeans=2)
    return np.array(small.getpalette()[: 3 * colours], np.uint8).reshape(-1, 3)


def _packed(colour: NDArray, bits: int = 8) -> NDArray:
    """RGB (..., 3) of so many bits each as one integer (...)."""
    wide = colour[..., :3].astype(np.int32)
    return wide[..., 0] << 2 * bits | wide[..., 1] << bits | wide[..., 2]
