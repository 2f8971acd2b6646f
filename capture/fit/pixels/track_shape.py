"""The fine fit: the template itself is bent through the key-shape space (Bregler et al. 2002, eq. 2 put into eq. 8).

A pixel x of the mean shape is found in the frame at A (x + sum_l alpha_l E_l(x)) + D.  Map and mode weights are
solved together with robust pixel weights and a Gaussian prior on the modes; without the prior a quarter
of the drawings diverge.  Eigen-images alone stay at about 0.4 px, this comes to about 0.1.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from capture.fit.pixels import kernels, trust
from capture.fit.pixels.judge import Judgement, judge
from capture.fit.pixels.keyimages import MeshMap
from capture.fit.pixels.layer import Layer, gradient, points_of
from capture.fit.pixels.track_affine import telling
from capture.fit.shapes.keyspace import KeySpace
from capture.motion import affine

PRIOR = 1e4  # squared grey levels: how strongly the modes are held to what the rows do, at the most
AREA = 10.0  # pixels that differ together: so much less do differences tell than if each were by itself


@dataclass(frozen=True, eq=False)
class ShapeLevel:
    """The keys' textures in the mean shape at one size, and how the modes move its pixels."""

    points: NDArray  # (P, 2) full-size positions in the mean shape
    textures: NDArray  # (K, P, C)
    modes: NDArray  # (P, 2, L)
    gradient_power: float  # mean squared slope per full-size pixel
    normal: NDArray  # (6 + L, 6 + L) how sharply all pixels together tell map and modes


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
    centre = 0.5 * (space.mean.min(axis=0) + space.mean.max(axis=0))
    scale = 0.5 * float(np.ptp(space.mean, axis=0).max())
    levels = []
    for number in range(len(textures[0].levels)):
        stack = np.stack([texture.levels[number] for texture in textures])
        gx, gy = gradient(stack.mean(axis=0), number)
        power = (gx**2 + gy**2).sum(axis=-1)
        chosen = telling(power, keep if number == 0 else 1.0)
        points = points_of(number, power.shape, textures[0].origin)[chosen]
        step = 2**number
        modes = fields[::step, ::step][chosen].astype(np.float32)
        normal = _own_normal(points, modes, gx[chosen], gy[chosen], centre, scale)
        levels.append(ShapeLevel(points, stack[:, chosen], modes, float(power[chosen].mean()), normal))
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
        still = 0.01 if number == 0 else 0.05 * 2**number  # pixels, root mean square
        hold, first, gone = _hold(level, placed, number), placed, None
        bent = _bent(level, alpha)
        at = affine.apply(placed, bent)
        for _ in range(15):
            values, gx, gy = frame.sample_with_slopes(number, at)
            difference, known = values - target, frame.sample_known(number, at)
            weight = trust.weights(difference, known, gone)
            normal, right = _equations(template, level, bent, placed, alpha, (gx, gy, weight, difference))
            right[:6] += hold[:6, :6] @ _way(template, first, placed)
            placed, alpha = _moved(template, placed, alpha, -np.linalg.solve(normal + hold, right))
            before, bent = at, _bent(level, alpha)
            at = affine.apply(placed, bent)
            moved = np.sqrt(np.mean((at - before) ** 2))
            if gone is None and moved < trust.NEAR * still and number <= trust.SHARPEST:
                gone = trust.gone_at(trust.size_of(difference), known)
            elif moved < still:
                break
    return placed, alpha


def judged(
    template: ShapeTemplate, frame: Layer, placed: NDArray, alpha: NDArray, amounts: NDArray, level: int = 0
) -> Judgement:
    """How well the picture agrees with the bent template."""
    at = template.levels[level]
    target = np.tensordot(amounts.astype(np.float32), at.textures, axes=1)
    seen = affine.apply(placed, _bent(at, alpha))
    return judge(frame.sample(level, seen) - target, at.gradient_power, frame.sample_known(level, seen))


def _equations(
    template: ShapeTemplate,
    level: ShapeLevel,
    bent: NDArray,
    placed: NDArray,
    alpha: NDArray,
    seen: tuple[NDArray, NDArray, NDArray, NDArray],
) -> tuple[NDArray, NDArray]:
    """Normal matrix (6 + L, 6 + L) and right side (6 + L,) for a step [a1 a2 a3 a4 dx dy, modes].

    `seen` is what the frame shows: slopes, weights, difference.  A step acts on (bent - centre) / scale.
    """
    points = ((bent - template.centre) / template.scale).astype(np.float32)
    normal, right = kernels.bent_sums(points, level.modes, placed[:, :2] / template.scale, *seen)
    normal, right = template.scale**2 * normal, template.scale * right
    prior = min(PRIOR, AREA * trust.mean_square(seen[3], seen[2])) / template.spread**2
    index = np.arange(6, len(normal))
    normal[index, index] += prior
    right[6:] += prior * alpha
    # every unknown by its own measure, for those of the map are a million times stiffer than the modes
    normal[np.diag_indices_from(normal)] *= 1 + 1e-6
    normal[np.diag_indices_from(normal)] += 1e-6  # off the picture: stay
    return normal, right


def _bent(level: ShapeLevel, alpha: NDArray) -> NDArray:
    """The template's pixels (P, 2) where the modes lead them."""
    return level.points + (level.modes.reshape(2 * len(level.points), -1) @ alpha.astype(np.float32)).reshape(-1, 2)


def _way(template: ShapeTemplate, first: NDArray, now: NDArray) -> NDArray:
    """How far (6,) a map has moved from another, in the unknowns of a step."""
    change = now - first
    return np.append(change[:, :2], (change[:, :2] @ template.centre + change[:, 2]) / template.scale)


def _moved(template: ShapeTemplate, placed: NDArray, alpha: NDArray, step: NDArray) -> tuple[NDArray, NDArray]:
    """The increment acts on (bent - centre) / scale and adds to the frame's position."""
    linear, shift = step[:4].reshape(2, 2), template.scale * step[4:6]
    return placed + np.column_stack([linear, shift - linear @ template.centre]), alpha + step[6:]


def _hold(level: ShapeLevel, placed: NDArray, number: int) -> NDArray:
    """The price (6 + L, 6 + L) of leaving the map a level began with: a small share of what all its pixels would say.

    The template's own normal matrix is carried to where the map has led it.  Modes have their own prior.
    """
    price, back = np.zeros_like(level.normal), np.linalg.pinv(placed[:, :2])
    turn = np.zeros((6, 6))
    turn[:4, :4], turn[4:, 4:] = np.kron(back, np.eye(2)), back
    price[:6, :6] = trust.slack(number) * turn.T @ level.normal[:6, :6] @ turn
    return price


def _own_normal(points: NDArray, modes: NDArray, gx: NDArray, gy: NDArray, centre: NDArray, scale: float) -> NDArray:
    """The normal matrix (6 + L, 6 + L) of the template with itself."""
    local = ((points - centre) / scale).astype(np.float32)
    every = np.ones(len(points), np.float32)
    return scale**2 * kernels.bent_sums(local, modes, np.eye(2) / scale, gx, gy, every, 0 * gx)[0]
