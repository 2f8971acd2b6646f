"""Gradients for vector formats, which know a line and a circle, but no sheared squares and no repeats."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from capture.motion import affine
from retarget.characters.drawings.paths import Gradient

MOST_REPEATS = 16
"""A gradient that repeats is written out over this many lengths each way at most."""


@dataclass(frozen=True, eq=False)
class Round:
    """A radial gradient over T frames: the unit circle stretched by `scale`, turned by `angle`, moved to `center`."""

    center: NDArray  # (T, 2)
    angle: NDArray  # (T,) radians, from x towards y, continuous
    scale: NDArray  # (T, 2)
    focus: NDArray  # (T, 2) in the unit circle

    def inside(self, points: NDArray) -> NDArray:
        """Points of the page (T, N, 2) as the circle sees them."""
        away = points - self.center[:, None]
        return _turned(away, -self.angle) / self.scale[:, None]


def line_of(gradient: Gradient) -> NDArray:
    """Where a linear gradient starts and ends (2, 2): a line across its stripes, also where it is sheared."""
    start, way = gradient.place[:, 2], gradient.place[:, 0]
    if not _flat(gradient):
        across = affine.invert(gradient.place)[0, :2]  # t grows along this
        way = across / (across @ across)
    return np.stack([start, start + way])


def round_of(gradients: Sequence[Gradient]) -> Round:
    """A radial gradient in T frames by the singular value decomposition L = U S V' of its places.

    V' turns the circle in itself, so it moves the focus only.
    """
    places = np.stack([gradient.place for gradient in gradients])
    u, sigma, _ = np.linalg.svd(places[..., :2])
    sigma = np.maximum(sigma, 1e-3)  # pixels
    angles, scales, before = np.arctan2(u[:, 1, 0], u[:, 0, 0]), sigma.copy(), 0.0
    for t, angle in enumerate(angles):
        quarters = round((before - angle) / (np.pi / 2))
        angles[t] = before = angle + quarters * np.pi / 2
        scales[t] = sigma[t, ::-1] if quarters % 2 else sigma[t]
    foci = np.stack([affine.apply(gradient.place, gradient.focus[None])[0] for gradient in gradients])
    here = Round(places[..., 2], angles, scales, np.zeros_like(foci))
    return replace(here, focus=here.inside(foci[:, None])[:, 0])


def padded(gradients: Sequence[Gradient], points: Sequence[NDArray]) -> list[Gradient]:
    """Gradients in T frames without spread: the stops repeated as often as points (T, N, 2) see them in any frame."""
    first = gradients[0]
    if first.spread == "pad" or any(_flat(gradient) for gradient in gradients):
        return [replace(gradient, spread="pad") for gradient in gradients]
    seen = np.stack(
        [affine.apply(affine.invert(gradient.place), here) for gradient, here in zip(gradients, points, strict=True)]
    )
    if first.focus is None:
        low, high = seen[..., 0].min(), seen[..., 0].max()
    else:
        low, high = 0.0, np.linalg.norm(seen, axis=-1).max()
    start = min(max(int(np.floor(low)), -MOST_REPEATS), 0)
    stop = max(min(int(np.ceil(high)), MOST_REPEATS), 1)
    return [_repeated(gradient, start, stop) for gradient in gradients]


def finer(gradients: Sequence[Gradient], cuts: int = 8) -> list[Gradient]:
    """Gradients that fade with more stops, `cuts` for one, so that they look alike wherever they are mixed.

    Some players multiply colours by their alpha before they mix two stops, and some after.
    """
    if all(np.ptp(gradient.colors[:, 3]) == 0 for gradient in gradients):
        return list(gradients)
    count = len(gradients[0].offsets)
    at, where = np.arange(0, count - 1 + 0.5 / cuts, 1 / cuts), np.arange(count)
    return [
        replace(
            gradient,
            offsets=np.interp(at, where, gradient.offsets),
            colors=np.stack([np.interp(at, where, channel) for channel in gradient.colors.T], axis=-1),
        )
        for gradient in gradients
    ]


def _repeated(gradient: Gradient, start: int, stop: int) -> Gradient:
    """The stops of a gradient written out from t = start to stop, over a longer line or a larger circle."""
    offsets, colors = [], []
    once = np.concatenate([[0], gradient.offsets, [1]])
    painted = np.concatenate([gradient.colors[:1], gradient.colors, gradient.colors[-1:]])
    for turn in range(start, stop):
        back = gradient.spread == "reflect" and turn % 2
        offsets.append(turn + (1 - once[::-1] if back else once))
        colors.append(painted[::-1] if back else painted)
    length = stop - start
    unit, focus = np.array([[length, 0, start], [0, length, 0]], float), None
    if gradient.focus is not None:
        unit, focus = length * np.eye(2, 3), gradient.focus / length
    return replace(
        gradient,
        offsets=(np.concatenate(offsets) - start) / length,
        colors=np.concatenate(colors),
        place=affine.compose(gradient.place, unit),
        focus=focus,
        spread="pad",
    )


def _flat(gradient: Gradient) -> bool:
    return bool(abs(np.linalg.det(gradient.place[:, :2])) < 1e-9)


def _turned(points: NDArray, angle: NDArray) -> NDArray:
    """Points (T, N, 2) turned by angles (T,) about the origin."""
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    return np.stack([c * points[..., 0] - s * points[..., 1], s * points[..., 0] + c * points[..., 1]], axis=-1)
