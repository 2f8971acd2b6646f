"""The fine fit: the template itself is bent through the key-shape space (Bregler et al. 2002, eq. 2 put into eq. 8).

A pixel x of the mean shape is found in the frame at A (x + sum_l alpha_l E_l(x)) + D.  Map and mode weights are
solved together with robust pixel weights and a Gaussian prior on the modes; without the prior a quarter
of the drawings diverge.  Eigen-images alone stay at about 0.4 px, this comes to about 0.1.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from capture.fit.pixels.judge import Judgement, judge
from capture.fit.pixels.keyimages import MeshMap
from capture.fit.pixels.layer import Layer, gradient, points_of, sample
from capture.fit.pixels.track_affine import huber, telling
from capture.fit.shapes.keyspace import KeySpace
from capture.motion import affine

PRIOR = 1e4  # squared grey levels: how strongly the modes are held to what the rows do


@dataclass(frozen=True, eq=False)
class ShapeLevel:
    """The keys' textures in the mean shape at one size, and how the modes move its pixels."""

    points: NDArray  # (P, 2) full-size positions in the mean shape
    textures: NDArray  # (K, P, C)
    modes: NDArray  # (P, 2, L)
    gradient_power: float  # mean squared slope per full-size pixel


@dataclass(frozen=True, eq=False)
class ShapeTemplate:
    """What is bent, coarse to fine, about a centre in units of `scale`."""

    levels: tuple[ShapeLevel, ...]
    centre: NDArray  # (2,)
    scale: float
    spread: NDArray  # (L,) of the mode weights


def shape_template(textures: list[Layer], place: MeshMap, space: KeySpace, keep: float = 0.3) -> ShapeTemplate:
    """Prepare K textures, each a layer on the grid of the mean shape's mesh map."""
    count = len(space.modes)
    carried = place.carry(space.modes.transpose(1, 2, 0).reshape(len(space.mean), -1))
    fields = carried.reshape(*carried.shape[:2], 2, count)
    levels = []
    for number in range(len(textures[0].levels)):
        stack = np.stack([texture.levels[number] for texture in textures])
        gx, gy = gradient(stack.mean(axis=0), number)
        power = (gx**2 + gy**2).sum(axis=-1)
        chosen = telling(power, keep if number == 0 else 1.0)
        points = points_of(number, power.shape, textures[0].origin)[chosen]
        step = 2**number
        levels.append(ShapeLevel(points, stack[:, chosen], fields[::step, ::step][chosen], float(power[chosen].mean())))
    centre = 0.5 * (space.mean.min(axis=0) + space.mean.max(axis=0))
    scale = 0.5 * float(np.ptp(space.mean, axis=0).max())
    return ShapeTemplate(tuple(levels), centre, scale, np.maximum(space.spread, 1e-6))


def refine(
    template: ShapeTemplate,
    frame: Layer,
    placed: NDArray,
    alpha: NDArray,
    amounts: NDArray,
    coarsest: int = 2,
    finest: int = 0,
) -> tuple[NDArray, NDArray]:
    """Map (2, 3) and mode weights (L,) improved; `amounts` (K,) says how the keys' textures are mixed."""
    placed, alpha = np.array(placed, float), np.array(alpha, float)
    for number in range(min(coarsest, len(template.levels) - 1), finest - 1, -1):
        level = template.levels[number]
        target = np.tensordot(amounts.astype(np.float32), level.textures, axes=1)
        slopes = gradient(frame.levels[number], number)
        still = 0.01 if number == 0 else 0.05 * 2**number
        for _ in range(12):
            bent = level.points + level.modes @ alpha
            at = affine.apply(placed, bent)
            difference = frame.sample(number, at) - target
            inner = ((at - frame.origin) / 2**number).astype(np.float32)
            gx, gy = (sample(slope, inner, np.zeros(4)) for slope in slopes)
            placed, alpha = _step(template, level, bent, placed, alpha, difference, gx, gy)
            moved = affine.apply(placed, level.points + level.modes @ alpha) - at
            if np.abs(moved).max() < still:
                break
    return placed, alpha


def judged(
    template: ShapeTemplate, frame: Layer, placed: NDArray, alpha: NDArray, amounts: NDArray, level: int = 0
) -> Judgement:
    """How well the picture agrees with the bent template."""
    at = template.levels[level]
    target = np.tensordot(amounts.astype(np.float32), at.textures, axes=1)
    seen = affine.apply(placed, at.points + at.modes @ alpha)
    return judge(frame.sample(level, seen) - target, at.gradient_power, frame.sample_known(level, seen))


def _step(
    template: ShapeTemplate,
    level: ShapeLevel,
    bent: NDArray,
    placed: NDArray,
    alpha: NDArray,
    difference: NDArray,
    gx: NDArray,
    gy: NDArray,
) -> tuple[NDArray, NDArray]:
    """One robust Gauss-Newton step in the moment form: channels are summed before anything is multiplied out."""
    weight = huber(difference)[:, None]
    xx, xy, yy = ((weight * a * b).sum(1).astype(float) for a, b in ((gx, gx), (gx, gy), (gy, gy)))
    bx, by = ((weight * g * difference).sum(1).astype(float) for g in (gx, gy))
    x, y = ((bent - template.centre) / template.scale).T
    one, zero = np.ones_like(x), np.zeros_like(x)
    modes = placed[:, :2] @ level.modes / template.scale  # (P, 2, L) in the frame, per scale
    move_x = np.column_stack([x, y, zero, zero, one, zero, modes[:, 0]])  # d(position) / d(unknown)
    move_y = np.column_stack([zero, zero, x, y, zero, one, modes[:, 1]])
    scale = template.scale
    normal = scale**2 * (
        move_x.T @ (xx[:, None] * move_x + xy[:, None] * move_y)
        + move_y.T @ (xy[:, None] * move_x + yy[:, None] * move_y)
    )
    right = scale * (bx @ move_x + by @ move_y)
    prior = PRIOR / template.spread**2
    index = np.arange(6, len(normal))
    normal[index, index] += prior
    right[6:] += prior * alpha
    normal[np.diag_indices_from(normal)] += 1e-5 * np.trace(normal[:6, :6]) / 6 + 1e-6  # off the picture: stay
    step = -np.linalg.solve(normal, right)
    # the increment acts on (bent - centre) / scale and adds to the frame's position
    linear, shift = step[:4].reshape(2, 2), scale * step[4:6]
    moved = placed + np.column_stack([linear, shift - linear @ template.centre])
    return moved, alpha + step[6:]
