"""Proof pictures: what was captured, drawn over the clip, and how well it fits over time.

A frame shows the tracked outline and its points, the grid of the affine map (Bregler 2002, figure 3) and the
key weights as small bars, to the left of their line where they are negative.
"""

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.motion import affine
from capture.motion.tracks import CartoonMotion, total_affine

COLORS = ((228, 46, 46), (30, 110, 235), (236, 140, 10), (140, 60, 205), (10, 150, 140), (200, 50, 130))
CELLS = 6  # of the affine grid, across
BAR, ROW = 56, 12  # pixels of weight 1, and height of a bar's row
DOTS_APART = 14  # pixels between the points that are drawn
SHIFT = 4  # fractional bits of OpenCV's drawing positions


def draw_over(frames: Iterable[NDArray], motion: CartoonMotion, first: int = 0) -> Iterator[NDArray]:
    """The frames of a clip (H, W, 3 | 4) with the captured motion drawn over each: RGB uint8 (H, W, 3).

    The motion's frame 0 is number `first` of the clip.
    """
    outlines = [motion.outline(track.part) for track in motion.tracks]
    grids = [_grid(motion, track.part) for track in motion.tracks]
    weights = [track.key_weights() for track in motion.tracks]
    count = 0
    for t, frame in enumerate(frames):
        if t >= len(motion.times):
            raise InputError(f"the clip must have as many frames as the motion, {len(motion.times)}, it has more")
        picture = np.array(frame[..., :3], order="C")  # a copy: the clip keeps its frames
        for number, track in enumerate(motion.tracks):
            color = COLORS[number % len(COLORS)] if track.visible[t] else (128, 128, 128)
            _lines(picture, grids[number][t], color, 0.35)
            _outline(picture, outlines[number][t], color)
        for number, track in enumerate(motion.tracks):
            if len(track.keys) > 1:
                _bars(picture, track.keys, weights[number][t], COLORS[number % len(COLORS)], number)
        worst = max(motion.tracks, key=lambda track: track.residual[t])
        held = " held" if all(track.held[t] for track in motion.tracks) else ""
        lost = " LOST" if not all(track.visible[t] for track in motion.tracks) else ""
        _label(picture, f"{t + first}  {worst.residual[t]:.1f} px{held}{lost}", (8, picture.shape[0] - 10))
        count += 1
        yield picture
    if count < len(motion.times):
        raise InputError(
            f"the clip must have as many frames as the motion, {len(motion.times)}, it has {count}: give the shot that "
            "the motion was captured with"
        )


def residual_plot(motion: CartoonMotion, path: str | Path, worst: int = 3, first: int = 0) -> list[int]:
    """Plot every part's misfit over the frames into a PNG; the worst frames are named in it and returned.

    The motion's frame 0 is number `first` of the clip.
    """
    from matplotlib.figure import Figure

    from capture.files import written_beside

    total = np.max([track.residual for track in motion.tracks], axis=0)
    frames = np.arange(len(total)) + first
    named = [int(t) for t in _peaks(total)[:worst]]
    figure = Figure(figsize=(9, 3), layout="constrained")
    axes = figure.add_subplot()
    for number, track in enumerate(motion.tracks):
        color = tuple(channel / 255 for channel in COLORS[number % len(COLORS)])
        axes.plot(frames, track.residual, color=color, label=track.part, linewidth=1.4)
        lost = np.flatnonzero(~track.visible)
        axes.plot(frames[lost], track.residual[lost], "x", color=color)
    for t in named:
        axes.annotate(
            f"frame {t + first}", (t + first, total[t]), (0, 5), textcoords="offset points", ha="center", fontsize=8
        )
    axes.set(xlabel="frame", ylabel="misfit (px)", ylim=(0, max(1.2 * float(total.max()), 0.5)))
    axes.legend(loc="upper right", fontsize=8, frameon=False)
    axes.spines[["top", "right"]].set_visible(False)
    with written_beside(path) as temporary:
        figure.savefig(temporary, dpi=120, format="png")
    return [t + first for t in named]


def key_sheet(
    pictures: Sequence[NDArray], outlines: NDArray, captions: Sequence[str], width: int = 480, numbers: int = 24
) -> NDArray:
    """Key drawings (H, W, 3 | 4) cut out round their outlines (K, N, 2), with every so many points numbered: RGB uint8.

    The same number is the same place of the character in all of them.
    """
    low, high = outlines.min(axis=1), outlines.max(axis=1)
    reach = 0.56 * np.max(high - low, axis=0) + 8
    zoom = width / (2 * reach[0])
    size = (width, round(2 * reach[1] * zoom))
    tiles = []
    for picture, outline, middle, caption in zip(pictures, outlines, 0.5 * (low + high), captions, strict=True):
        shift = zoom * (reach - middle)
        place = np.column_stack([zoom * np.eye(2), shift])
        color = np.ascontiguousarray(picture[..., :3])
        tile = cv2.warpAffine(color, place, size, flags=cv2.INTER_LINEAR, borderValue=(255, 255, 255))
        _outline(tile, affine.apply(place, outline), COLORS[0])
        for n in range(0, len(outline), max(1, len(outline) // numbers)):
            x, y = affine.apply(place, outline[n : n + 1])[0]
            _label(tile, str(n), (round(x) + 4, round(y) - 4), 0.38)
        _label(tile, caption, (8, 18))
        tiles.append(tile)
    return contact_sheet(tiles, min(4, len(tiles)), width)


def key_curves(
    path: str | Path, names: Sequence[str], residual: NDArray, without: NDArray, by_count: NDArray, asked: float
) -> None:
    """Plot into a PNG how well keys redraw a clip: residual (T,) with all of them and (K, T) without each, over time.

    Beside it the worst frame `by_count` (C,) of keys.  All in pixels; `asked` is the bound.
    """
    from matplotlib.figure import Figure

    from capture.files import written_beside

    figure = Figure(figsize=(11, 3.4), layout="constrained")
    over_time, over_count = figure.subplots(1, 2, width_ratios=[4, 1])
    for number, (name, off) in enumerate(zip(names, without, strict=True)):
        color = tuple(channel / 255 for channel in COLORS[number % len(COLORS)])
        style = ("-", "--", ":")[number // len(COLORS) % 3]
        if np.isfinite(off).all():
            over_time.plot(off, style, color=color, linewidth=0.9, label=f"without {name}")
    over_time.plot(residual, color="black", linewidth=1.8, label="with all keys")
    over_time.set(xlabel="frame", ylabel="residual (px)", ylim=(0, None))
    over_time.legend(fontsize=7, frameon=False, ncols=2)
    over_count.plot(np.arange(1, len(by_count) + 1), by_count, "o-", color="black", markersize=4, linewidth=1.2)
    over_count.set(xlabel="keys", ylabel="worst residual (px)", ylim=(0, None), xticks=np.arange(1, len(by_count) + 1))
    for axes in (over_time, over_count):
        axes.axhline(asked, color="0.6", linewidth=0.8, linestyle="--")
        axes.spines[["top", "right"]].set_visible(False)
    with written_beside(path) as temporary:
        figure.savefig(temporary, dpi=120, format="png")


def side_by_side(rows: Iterable[Sequence[NDArray]], height: int | None = None) -> Iterator[NDArray]:
    """Pictures of equal height put next to each other, frame by frame: RGB uint8."""
    for pictures in rows:
        tall = height or pictures[0].shape[0]
        yield np.concatenate([_scaled(picture, tall) for picture in pictures], axis=1)


def contact_sheet(pictures: Sequence[NDArray], columns: int = 4, width: int = 480) -> NDArray:
    """Pictures in rows, each scaled to `width` pixels: one RGB uint8 picture to look at."""
    tall = round(pictures[0].shape[0] * width / pictures[0].shape[1])
    tiles = [cv2.resize(picture[..., :3], (width, tall), interpolation=cv2.INTER_AREA) for picture in pictures]
    tiles += [np.full_like(tiles[0], 255)] * (-len(tiles) % columns)
    rows = [np.concatenate(tiles[start : start + columns], axis=1) for start in range(0, len(tiles), columns)]
    return np.concatenate(rows)


def _grid(motion: CartoonMotion, part: str) -> NDArray:
    """Lines (T, 2 (CELLS + 1), CELLS + 1, 2) of a square grid round key 0, moved by the part's map."""
    keyset = motion.keyset(part)
    outline = keyset.points[0, keyset.outline]
    middle = 0.5 * (outline.min(axis=0) + outline.max(axis=0))
    reach = 0.55 * np.ptp(outline, axis=0).max()
    ticks = np.linspace(-reach, reach, CELLS + 1)
    across = np.stack(np.meshgrid(ticks, ticks), -1) + middle
    lines = np.concatenate([across, across.swapaxes(0, 1)])
    maps = total_affine(motion, part)
    return affine.apply(maps, lines.reshape(-1, 2)).reshape(len(maps), *lines.shape)


def _lines(picture: NDArray, lines: NDArray, color: tuple[int, int, int], strength: float) -> None:
    """Draw polylines (n, m, 2), mixed into the picture by `strength`."""
    over = picture.copy()
    cv2.polylines(over, list(_fixed(lines)), False, color, 1, cv2.LINE_AA, SHIFT)
    cv2.addWeighted(over, strength, picture, 1 - strength, 0, picture)


def _outline(picture: NDArray, points: NDArray, color: tuple[int, int, int]) -> None:
    cv2.polylines(picture, [_fixed(points)], True, (255, 255, 255), 3, cv2.LINE_AA, SHIFT)
    cv2.polylines(picture, [_fixed(points)], True, color, 2, cv2.LINE_AA, SHIFT)
    length = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    every = max(1, round(DOTS_APART * len(points) / max(length, 1)))
    for point in _fixed(points[::every]):
        cv2.circle(picture, tuple(int(v) for v in point), 3 << SHIFT, (255, 255, 255), -1, cv2.LINE_AA, SHIFT)
        cv2.circle(picture, tuple(int(v) for v in point), 2 << SHIFT, color, -1, cv2.LINE_AA, SHIFT)


def _bars(picture: NDArray, names: Sequence[str], weights: NDArray, color: tuple[int, int, int], number: int) -> None:
    """A row for every key: its name, a line at 0, and a bar as long as its weight."""
    left, top = 8 + number * (BAR + 110), 8
    zero = left + 74 + BAR // 4
    panel = picture[top : top + ROW * len(names) + 6, left : zero + BAR + 22]
    panel[:] = (0.25 * panel + 0.75 * 255).astype(np.uint8)
    for row, (name, weight) in enumerate(zip(names, weights)):
        y = top + 3 + row * ROW
        cv2.putText(picture, name[:11], (left + 3, y + 9), cv2.FONT_HERSHEY_SIMPLEX, 0.33, (40, 40, 40), 1, cv2.LINE_AA)
        end = zero + round(float(np.clip(weight, -0.35, 1.35)) * BAR)
        cv2.rectangle(picture, (min(zero, end), y + 2), (max(zero, end), y + ROW - 3), color, -1)
        cv2.line(picture, (zero, y), (zero, y + ROW - 1), (40, 40, 40), 1)


def _label(picture: NDArray, text: str, at: tuple[int, int], size: float = 0.5) -> None:
    """Dark text with a light rim; a thicker stroke would also be set wider, so the rim is the same text moved."""
    around = [(x, y) for x in (-1, 0, 1) for y in (-1, 0, 1) if x or y]
    for (x, y), color in [*((way, (255, 255, 255)) for way in around), ((0, 0), (30, 30, 30))]:
        cv2.putText(picture, text, (at[0] + x, at[1] + y), cv2.FONT_HERSHEY_SIMPLEX, size, color, 1, cv2.LINE_AA)


def _fixed(points: NDArray) -> NDArray:
    """Positions as OpenCV's fixed-point integers; far-off ones are held at a bound it can take."""
    return np.round(np.clip(points, -8e3, 8e3) * 2**SHIFT).astype(np.int32)


def _peaks(values: NDArray) -> NDArray:
    """Frames that are worse than their neighbours, worst first."""
    padded = np.pad(values, 1, constant_values=-np.inf)
    peak = (values >= padded[:-2]) & (values > padded[2:])
    order = np.argsort(-values, kind="stable")
    return order[peak[order]]


def _scaled(picture: NDArray, height: int) -> NDArray:
    if picture.shape[0] == height:
        return picture[..., :3]
    width = round(picture.shape[1] * height / picture.shape[0])
    return cv2.resize(picture[..., :3], (width, height), interpolation=cv2.INTER_AREA)
