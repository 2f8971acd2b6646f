"""Lines out of drawings: clean line art, and pencil tests scanned from grey, uneven paper.

A drawing becomes ink, 0-1; ink is thinned to a skeleton; the skeleton is a graph whose branches run on smoothly
through their crossings, its short spurs cut; and every stroke is then moved onto the middle of its ink.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.pictures import contours
from capture.pictures.contours import Contours
from capture.pictures.thinning import branches, joined

SPUR = 1.5  # widths of the line: a shorter loose end is the skeleton's, not the artist's
PAPER = 0.08  # of the picture's longer side: lines are thinner, the paper's unevenness is wider


@dataclass(frozen=True, eq=False)
class Stroke:
    """One line of a drawing."""

    points: NDArray  # (n, 2) pixels, about one a pixel
    closed: bool
    width: float  # pixels, of the ink across the line


def strokes_of(image: NDArray) -> list[Stroke]:
    """The strokes of line art (H, W), (H, W, 3) or (H, W, 4) uint8, black on white or on nothing, longest first."""
    ink = _ink(image)
    ink = np.maximum(ink - np.median(ink), 0)
    peak = np.percentile(ink[ink > 0.2], 90) if (ink > 0.2).any() else 0.0
    if peak == 0:
        raise InputError(
            "line art must hold dark lines on light or clear ground, this picture is empty: draw or choose another"
        )
    ink = np.clip(ink / peak, 0, 1)
    ridge = (ink > 0.25) & (ink > 0.8 * cv2.dilate(ink, np.ones((3, 3))))  # a thin line is pale between two pixels
    return _strokes(ink, (ink > 0.5) | ridge, "line art")


def pencil_lines(image: NDArray) -> list[Stroke]:
    """The strokes of a scanned pencil test (H, W[, C]) uint8, longest first: grey lines on uneven, grainy paper.

    The paper, a wide median, is divided out; a line is what is darker than the grain by far, with all that hangs on
    it and is still darker than the grain.
    """
    from skimage.filters import apply_hysteresis_threshold
    from skimage.morphology import remove_small_objects

    light = 1 - _ink(image)
    dark = np.clip(1 - light / np.maximum(_paper(light), 0.05), 0, 1)
    dark = cv2.GaussianBlur(dark.astype(np.float32), (0, 0), 1.2).astype(float)
    grain = 1.4826 * float(np.median(np.abs(dark - np.median(dark)))) + 0.004
    dark = np.maximum(dark - np.median(dark), 0)
    sure = dark > max(8 * grain, 0.04)
    if not sure.any():
        raise InputError(
            "a pencil test must hold lines darker than its paper, none stand out here: scan it with more contrast"
        )
    peak = float(np.percentile(dark[sure], 75))
    mask = apply_hysteresis_threshold(dark, max(4 * grain, 0.3 * peak), max(8 * grain, 0.5 * peak))
    mask = remove_small_objects(mask, max_size=max(12, int(0.02 * max(mask.shape)) ** 2 // 4))
    if not mask.any():
        raise InputError(
            "a pencil test must hold lines longer than specks of dust, there are none here: scan it larger"
        )
    mask = cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8)) > 0
    return _strokes(np.clip(dark / peak, 0, 1), mask, "a pencil test")


def contours_of_drawings(
    images: Iterable[NDArray], lines: Callable[[NDArray], list[Stroke]] = strokes_of, fps: float = 24.0
) -> Contours:
    """The longest stroke of every drawing; `lines` is `strokes_of` or `pencil_lines`.

    Where most are closed, a nearly closed one is closed as well.
    """
    found = []
    for t, image in enumerate(images):
        try:
            found.append(lines(image)[0])
        except InputError as error:
            raise InputError(f"frame {t}: {error}") from None
    closed = 2 * sum(stroke.closed for stroke in found) > len(found)
    for t, stroke in enumerate(found):
        gap = np.linalg.norm(stroke.points[0] - stroke.points[-1])
        if stroke.closed != closed and not (closed and gap < 0.1 * contours.arcs(stroke.points, False)[-1]):
            raise InputError(
                "the longest lines must all be closed or all be open, "
                f"that of frame {t} is {'open' if closed else 'closed'}: mend the drawing"
            )
    return contours.make([stroke.points for stroke in found], closed, fps, "the drawings", crossing=True)


def _ink(image: NDArray) -> NDArray:
    """How dark the picture is (H, W), 0-1, on white; where it has no other darkness, how opaque."""
    image = np.asarray(image)
    if image.ndim not in (2, 3) or not image.size or (image.ndim == 3 and image.shape[2] not in (1, 3, 4)):
        raise InputError(f"a drawing must be a picture (height, width[, 1, 3 or 4 channels]), got shape {image.shape}")
    if not np.isfinite(image).all():
        raise InputError("a drawing must hold finite numbers, this one holds NaN or infinity: save it anew")
    values = image.astype(float) / (255 if image.dtype == np.uint8 else max(float(image.max()), 1.0))
    if image.ndim == 2:
        return 1 - values
    dark = 1 - values[..., :3].mean(axis=2)
    if image.shape[2] < 4:
        return dark
    alpha = values[..., 3]
    return dark * alpha if (dark * alpha).max() > 0.3 else alpha


def _paper(light: NDArray) -> NDArray:
    """What the paper alone would look like (H, W): a wide median of a small copy, then smoothed."""
    height, width = light.shape
    small = min(1.0, 200 / max(height, width))
    copy = cv2.resize((255 * light).astype(np.uint8), None, fx=small, fy=small, interpolation=cv2.INTER_AREA)
    reach = 2 * int(PAPER * max(copy.shape) / 2) + 1
    copy = cv2.GaussianBlur(cv2.medianBlur(copy, max(reach, 3)).astype(np.float32), (0, 0), max(reach / 4, 1))
    return cv2.resize(copy, (width, height), interpolation=cv2.INTER_CUBIC).astype(float) / 255


def _strokes(ink: NDArray, mask: NDArray, name: str) -> list[Stroke]:
    from scipy.ndimage import distance_transform_edt
    from skimage.morphology import skeletonize

    depth = distance_transform_edt(np.pad(mask, 1))[1:-1, 1:-1]
    skeleton = skeletonize(mask)
    width = max(2 * float(np.median(depth[skeleton])) - 1, 1.0)
    paths = joined(branches(skeleton), spur=SPUR * width + 2)
    found = []
    for path, closed in paths:
        if len(path) > max(2 * width, 8):
            found.append(_centred(path, closed, ink, width))
    if not found:
        raise InputError(
            f"{name} must hold at least one line longer than it is wide, there is none: draw one, or scan it larger"
        )
    return sorted(found, key=lambda stroke: -contours.arcs(stroke.points, stroke.closed)[-1])


def _centred(path: NDArray, closed: bool, ink: NDArray, width: float, rounds: int = 3) -> Stroke:
    """The path (n, 2) moved to the middle of its ink: across each point, the mean place weighted by ink."""
    from scipy.ndimage import gaussian_filter1d, map_coordinates

    points = _smoothed(path.astype(float), closed, 1.5)
    reach = 0.5 * width + 1.5
    across = np.linspace(-reach, reach, 2 * int(np.ceil(2 * reach)) + 1)
    window = np.clip(reach + 0.5 - np.abs(across), 0, 1)
    for _ in range(rounds):
        count = max(round(contours.arcs(points, closed)[-1]), 8)
        points = contours.evenly(points, count, closed)
        ahead = _smoothed(_differences(points, closed), closed, 1.5)
        normal = np.column_stack([-ahead[:, 1], ahead[:, 0]]) / np.maximum(np.linalg.norm(ahead, axis=1), 1e-9)[:, None]
        sampled = points[:, None] + across[:, None] * normal[:, None]
        weight = map_coordinates(ink, [sampled[..., 1], sampled[..., 0]], order=1, mode="nearest") * window
        shift = (weight * across).sum(axis=1) / np.maximum(weight.sum(axis=1), 1e-6)
        shift = gaussian_filter1d(np.clip(shift, -1, 1), 1.0, mode="wrap" if closed else "nearest")
        points = points + shift[:, None] * normal
    width = float(np.median(weight.sum(axis=1)) * (across[1] - across[0]))
    if not closed:
        points = _ended(_ended(points, ink, width)[::-1], ink, width)[::-1]
    return Stroke(points, closed, width)


def _ended(points: NDArray, ink: NDArray, width: float) -> NDArray:
    """The line (n, 2), its last point moved along it to half a width before the ink ends; inside ink it stays."""
    from scipy.ndimage import map_coordinates

    reach = width + 3
    base = points[max(len(points) - 1 - round(reach), 0)]
    ahead = (points[-1] - base) / max(float(np.linalg.norm(points[-1] - base)), 1e-9)
    at = np.arange(-reach / 2, reach, 0.1)
    ray = points[-1] + at[:, None] * ahead
    gone = np.flatnonzero(map_coordinates(ink, [ray[:, 1], ray[:, 0]], order=1, cval=0.0) < 0.5)
    if not len(gone) or gone[0] == 0:
        return points
    end = points[-1] + (at[gone[0]] - 0.05 - width / 2) * ahead
    tail = np.arange(len(points)) > len(points) - 2 * reach
    beyond = tail & ((points - end) @ ahead > -0.5)
    return np.vstack([points[~beyond], end]) if not beyond.all() else points


def _differences(points: NDArray, closed: bool) -> NDArray:
    if closed:
        return np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0)
    return np.gradient(points, axis=0)


def _smoothed(points: NDArray, closed: bool, sigma: float) -> NDArray:
    """The points (n, 2) smoothed along the curve; an open one keeps its ends (odd reflection)."""
    from scipy.ndimage import gaussian_filter1d

    if closed:
        return gaussian_filter1d(points, sigma, axis=0, mode="wrap")
    reach = min(int(4 * sigma), len(points) - 1)
    long = np.vstack([2 * points[0] - points[reach:0:-1], points, 2 * points[-1] - points[-2 : -reach - 2 : -1]])
    return gaussian_filter1d(long, sigma, axis=0)[reach : reach + len(points)]
