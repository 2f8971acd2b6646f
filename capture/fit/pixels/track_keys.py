"""Affine and key-shape capture with eigen-images (Bregler et al. 2002, eqs. 14-16).

The template is no longer one picture but a mean and L eigen-images of all rows.  `acquire` finds map and
eigen-weights together, inverse compositional (Baker & Matthews 2004), with weights for pixels that are hidden or
somebody else's: its reach is wide, so it is used on small pictures to find a frame's rough pose and shape.
`joint_step` is eqs. 14-15 as they stand, and `eliminated_step` the same with the weights solved away: both take the
same steps.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from capture.fit.pixels import trust
from capture.fit.pixels.layer import Layer, gradient, points_of
from capture.fit.pixels.track_affine import affine_slopes, small_map, telling
from capture.fit.shapes.keyspace import KeySpace
from capture.motion import affine

FINEST = 2  # the level down to which a frame is found by eigen-images; from there on the template is bent


@dataclass(frozen=True, eq=False)
class EigenLevel:
    """Mean and eigen-images at one size, on the pixels that tell something."""

    points: NDArray  # (P, 2) full-size positions in key 0's frame
    mean: NDArray  # (P, C)
    images: NDArray  # (P * C, L) orthonormal eigen-images
    both: NDArray  # (P * C, 6 + L) float32: rows of eq. 11 about the centre in units of the scale, then eigen-images
    normal: NDArray  # (6, 6) how sharply all pixels together tell the map
    to_modes: NDArray  # (L, M) from eigen-weights to the M modes of shape


@dataclass(frozen=True, eq=False)
class EigenTemplate:
    """Eigen-images at several sizes; maps are measured about `centre` in units of `scale`."""

    levels: tuple[EigenLevel | None, ...]  # None where the rows have no picture of that size
    centre: NDArray  # (2,)
    scale: float


def eigen_template(rows: list[Layer], outline: NDArray, space: KeySpace, most: int = 10) -> EigenTemplate:
    """Eigen-images of the rows' pictures: at most L = 10 at every level (section 3.3)."""
    centre = 0.5 * (outline.min(axis=0) + outline.max(axis=0))
    scale = 0.5 * float(np.ptp(outline, axis=0).max())
    levels = []
    for number in range(len(rows[0].levels)):
        if not rows[0].levels[number].size:
            levels.append(None)
            continue
        stack = np.stack([row.levels[number] for row in rows])  # (D, h, w, C)
        mean = stack.mean(axis=0)
        gx, gy = gradient(mean, number)
        chosen = telling((gx**2 + gy**2).sum(axis=-1) + stack.var(axis=0).sum(axis=-1), 1.0)
        points = points_of(number, mean.shape, rows[0].origin)[chosen]
        slopes = affine_slopes(gx[chosen], gy[chosen], points, centre, scale).reshape(-1, 6)
        spread = (stack - mean)[:, chosen].reshape(len(rows), -1)
        images, weights = _principal(spread, most)
        both = np.column_stack([slopes, images]).astype(np.float32)
        to_modes = _ridge(weights, space.coefficients)
        normal = slopes.T @ slopes
        levels.append(EigenLevel(points, mean[chosen], images, both, normal, to_modes))
    return EigenTemplate(tuple(levels), centre, scale)


def acquire(template: EigenTemplate, frame: Layer, start: NDArray, finest: int = FINEST) -> tuple[NDArray, NDArray]:
    """The plain map (2, 3) and the mode weights (M,) of a frame, coarse to fine from `start`."""
    placed, weights = np.asarray(start, float), np.zeros(0)
    made = [number for number, level in enumerate(template.levels) if level is not None]
    finest = min(max(finest, made[0]), made[-1])
    for number in range(len(template.levels) - 1, finest - 1, -1):
        placed, weights = _descend(template, frame, placed, number)
    return placed, weights @ template.levels[finest].to_modes


def _descend(template: EigenTemplate, frame: Layer, first: NDArray, number: int) -> tuple[NDArray, NDArray]:
    """Map (2, 3) and eigen-weights (L,) improved at one level, from the map `first`: increment and weights together."""
    level, placed, gone = template.levels[number], first, None
    still = 0.1 * 2**number / template.scale
    way, weights = np.zeros(6), None  # from `first`, in the unknowns of a step
    weighted = np.empty_like(level.both)
    for _ in range(25):
        at = affine.apply(placed, level.points)
        difference, known = frame.sample(number, at) - level.mean, frame.sample_known(number, at)
        if weights is None:
            weights = difference.ravel() @ level.images
        left = difference - (level.images @ weights).reshape(difference.shape)
        weight = trust.weights(left, known, gone).astype(np.float32)
        np.multiply(level.both.reshape(len(weight), -1), weight[:, None], out=weighted.reshape(len(weight), -1))
        normal, right = (weighted.T @ level.both).astype(float), (difference.ravel() @ weighted).astype(float)
        hold = trust.slack(number) * level.normal
        normal[:6, :6] += hold
        right[:6] += hold @ way
        normal[np.diag_indices_from(normal)] *= 1 + 1e-5
        normal[np.diag_indices_from(normal)] += 1e-9
        step, weights = np.split(np.linalg.solve(normal, right), [6])
        placed = affine.compose(placed, affine.invert(small_map(step, template.centre, template.scale)))
        way = way - step
        moved = np.abs(step).max()
        if gone is None and moved < trust.NEAR * still and number <= trust.SHARPEST:
            gone = trust.gone_at(trust.size_of(left), known)
        elif moved < still:
            break
    return placed, weights


def joint_step(template: EigenTemplate, frame: Layer, placed: NDArray, level: int) -> tuple[NDArray, NDArray]:
    """One iteration of eqs. 14-15: the next map (2, 3) and the eigen-weights (L,), solved together.

    Errata: theta is the increment and negated, the block of eigen-images is [H, -E], the mean image is subtracted.
    """
    at = template.levels[level]
    h, z = _linearise(template, frame, placed, level)
    theta = -np.linalg.lstsq(np.column_stack([h, -at.images]), z, rcond=None)[0]
    return placed + np.column_stack([theta[:4].reshape(2, 2), theta[4:6]]), theta[6:]


def eliminated_step(template: EigenTemplate, frame: Layer, placed: NDArray, level: int) -> tuple[NDArray, NDArray]:
    """The step of `joint_step` with the weights eliminated: H and Z are freed of the eigen-images first."""
    e = template.levels[level].images
    h, z = _linearise(template, frame, placed, level)
    theta = -np.linalg.lstsq(h - e @ (e.T @ h), z - e @ (e.T @ z), rcond=None)[0]
    return placed + np.column_stack([theta[:4].reshape(2, 2), theta[4:]]), e.T @ (z + h @ theta)


def _linearise(template: EigenTemplate, frame: Layer, placed: NDArray, level: int) -> tuple[NDArray, NDArray]:
    """H (P C, 6) of the frame's own gradient at the warped pixels (eq. 11), and Z (P C,) against the mean."""
    at = template.levels[level]
    warped = affine.apply(placed, at.points)
    values, gx, gy = frame.sample_with_slopes(level, warped)
    h = affine_slopes(gx, gy, at.points, np.zeros(2), 1.0).reshape(-1, 6)
    return h, (values - at.mean).ravel()


def _principal(spread: NDArray, most: int) -> tuple[NDArray, NDArray]:
    """Eigen-images (P C, L) and the weights (D, L) of D centred pictures (D, P C), by the small D x D problem."""
    spread = spread.astype(float)  # summed in single precision, the weaker images come out 1 % from orthogonal
    power, vectors = np.linalg.eigh(spread @ spread.T)
    order = np.argsort(power)[::-1][:most]
    order = order[power[order] > 1e-6 * max(power.max(), 1e-12)]
    images = spread.T @ (vectors[:, order] / np.sqrt(power[order]))
    return images, vectors[:, order] * np.sqrt(power[order])


def _ridge(weights: NDArray, coefficients: NDArray) -> NDArray:
    """The linear map (L, M) from eigen-weights (D, L) to shape modes (D, M) over the rows they share."""
    normal = weights.T @ weights
    normal[np.diag_indices_from(normal)] += 1e-4 * np.trace(normal) / max(len(normal), 1)
    return np.linalg.solve(normal, weights.T @ coefficients)
