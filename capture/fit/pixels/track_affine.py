"""Affine capture: the map that lays a key's layer over a frame's (Bregler et al. 2002, eqs. 8-13).

Lucas-Kanade, coarse to fine, in its inverse compositional form (Baker & Matthews 2004): the picture's
gradient is taken on the template and prepared once.  Pixels that are hidden have no weight, those that are somebody
else's lose theirs near the goal, and a level moves away from where it began only as far as the picture pays for it.
`paper_step` is eqs. 10-13 as they stand.
Residual and gradient come from the same smoothed picture; with the paper's raw residual the steps overshoot
(95 iterations against 15).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from capture.fit.pixels import trust
from capture.fit.pixels.judge import Judgement, judge
from capture.fit.pixels.layer import Layer, gradient, points_of
from capture.motion import affine


@dataclass(frozen=True, eq=False)
class Level:
    """The template at one size: its telling pixels, what they look like, and how that changes with the map."""

    points: NDArray  # (P, 2) full-size positions in the key's frame
    values: NDArray  # (P, C)
    local: NDArray  # (P, 2) float32, the same about the centre and in units of the scale
    slopes: tuple[NDArray, NDArray]  # x- and y-slopes (P, C) per full-size pixel
    normal: NDArray  # (6, 6) how sharply all pixels together tell the map, for increments [a1 a2 a3 a4 dx dy]
    gradient_power: float  # mean squared gradient per full-size pixel: turns grey levels into pixels


@dataclass(frozen=True, eq=False)
class Template:
    """A key's layer prepared for alignment; maps are measured about `centre` in units of `scale`."""

    levels: tuple[Level, ...]
    centre: NDArray  # (2,)
    scale: float  # pixels


def template(key: Layer, outline: NDArray, keep: float = 0.35) -> Template:
    """Prepare a key's layer; at full size only the `keep` share of its telling pixels with the steepest slopes."""
    centre = 0.5 * (outline.min(axis=0) + outline.max(axis=0))
    scale = 0.5 * float(np.ptp(outline, axis=0).max())
    levels = []
    for number, image in enumerate(key.levels):
        gx, gy = gradient(image, number)
        power = (gx**2 + gy**2).sum(axis=-1)
        if key.known is not None:
            # of what is hidden in the key, half known, only the silhouette tells, and only where alpha counts
            power = power * (key.known[number] > (0.9 if number < 2 else 0.4))
        chosen = telling(power, keep if number == 0 else 1.0)
        points = points_of(number, image.shape, key.origin)[chosen]
        local = ((points - centre) / scale).astype(np.float32)
        slopes = gx[chosen], gy[chosen]
        rows = affine_slopes(*slopes, points, centre, scale).reshape(-1, 6)
        normal = (rows.T @ rows).astype(float)
        levels.append(Level(points, image[chosen], local, slopes, normal, float(power[chosen].mean())))
    return Template(tuple(levels), centre, scale)


def telling(power: NDArray, keep: float) -> NDArray:
    """Mask (H, W) of the pixels that carry the signal: slopes above 1 % of the steepest, and of those a share."""
    floor = 1e-4 * float(power.max())
    count = int(np.count_nonzero(power > floor))
    few = max(int(keep * count), min(count, 1500))
    if few < count:
        floor = max(floor, float(np.partition(power.ravel(), -few)[-few]))
    return power > floor


def affine_slopes(gx: NDArray, gy: NDArray, points: NDArray, centre: NDArray, scale: float) -> NDArray:
    """Rows H of eq. 11: (P, C, 6) from gradients (P, C), for maps about the centre in units of the scale."""
    x, y = ((points - centre) / scale).T[:, :, None]
    return scale * np.stack([gx * x, gx * y, gy * x, gy * y, gx, gy], axis=-1)


def align(shape: Template, frame: Layer, start: NDArray, coarsest: int | None = None, finest: int = 0) -> NDArray:
    """The plain map (2, 3) from key pixels to frame pixels, by descent from `start` through the levels."""
    placed = np.asarray(start, float)
    top = len(shape.levels) - 1 if coarsest is None else min(coarsest, len(shape.levels) - 1)
    for number in range(top, finest - 1, -1):
        placed = _descend(shape, frame, placed, number)
    return placed


def _descend(shape: Template, frame: Layer, first: NDArray, number: int) -> NDArray:
    """The map (2, 3) improved at one level, where it began as `first`."""
    level, placed, gone = shape.levels[number], first, 0.0
    still = (0.02 if number == 0 else 0.1 * 2**number) / shape.scale
    pixels = level.points, level.local, level.values, *level.slopes
    hold = trust.slack(number) * level.normal
    damped = hold + (1e-6 * np.trace(level.normal) + 1e-12) * np.eye(6)  # what no picture tells stays put
    way = np.zeros(6)  # from `first`, in the unknowns of a step
    for _ in range(25):
        normal, right, sizes = frame.affine_pass(number, placed, pixels, trust.HUBER, gone)
        step = np.linalg.solve(shape.scale**2 * normal + damped, shape.scale * right + hold @ way)
        placed = affine.compose(placed, affine.invert(small_map(step, shape.centre, shape.scale)))
        way = way - step
        moved = np.abs(step).max()
        if gone == 0 and moved < trust.NEAR * still and number <= trust.SHARPEST:
            gone = trust.gone_at(sizes, frame.sample_known(number, affine.apply(placed, level.points)))
        elif moved < still:
            break
    return placed


def small_map(step: NDArray, centre: NDArray, scale: float) -> NDArray:
    """The plain map (2, 3) of an increment [a1 a2 a3 a4 dx dy], which acts about the centre in scale units."""
    linear = np.eye(2) + step[:4].reshape(2, 2)
    return affine.about(np.column_stack([linear, scale * step[4:6]]), centre)


def judged(shape: Template, frame: Layer, placed: NDArray, level: int = 0) -> Judgement:
    """How well the picture agrees with the map."""
    at = shape.levels[level]
    seen = affine.apply(placed, at.points)
    return judge(frame.sample(level, seen) - at.values, at.gradient_power, frame.sample_known(level, seen))


def paper_step(key: Layer, frame: Layer, points: NDArray, placed: NDArray, level: int = 0) -> NDArray:
    """One iteration of eqs. 10-13 for pixels (P, 2): the next map (2, 3).

    Errata: theta is the increment, it is -(H'H)^-1 H'Z, and the frame is sampled again at the warped pixels every
    time.  The gradient is the frame's own, at those pixels.
    """
    at = affine.apply(placed, points)
    values, gx, gy = frame.sample_with_slopes(level, at)
    h = affine_slopes(gx, gy, points, np.zeros(2), 1.0).reshape(-1, 6)  # eq. 11
    z = (values - key.sample(level, points)).ravel()
    theta = -np.linalg.lstsq(h, z, rcond=None)[0]  # eq. 12
    return placed + np.column_stack([theta[:4].reshape(2, 2), theta[4:]])
