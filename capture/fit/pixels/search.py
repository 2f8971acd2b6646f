"""Where else a part may be, when it is not where it was expected (Bregler et al. 2002, section 5 wishes for sampling).

Every key, turned and scaled, is laid over all places of the picture that have the part's colours, and
poses and key weights are drawn at random round what was expected; all are scored in batches on the smallest
picture of the pyramid.  Only the best few are worth a descent.  The draws are the same every time.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from capture.fit.pixels import cover
from capture.fit.pixels.descend import appearance, likeness
from capture.fit.pixels.layer import Layer
from capture.fit.pixels.model import PartModel, mesh_shape, outline_at
from capture.fit.pixels.sighting import Pose, across, outline
from capture.motion import affine
from capture.pictures.matte import ColorModel

TURNS, SCALES = 8, (0.6, 1.0, 1.6)  # a descent finds its way from half of what lies between
PLACES = 300  # of the picture at most, those with most of the part's colours
DRAWS = 300  # poses round what was expected
TELLING = 120  # pixels that score a pose


def starts(
    image: NDArray,
    hidden: NDArray,
    model: PartModel,
    colors: ColorModel,
    likely: list[Pose],
    joint: NDArray | None = None,
    most: int = 3,
) -> list[Pose]:
    """At most so many poses that are worth a descent, the best first, no two of them near each other.

    `likely` are poses that are worth trying whatever the picture says, the expected one first; `hidden` (H, W) is 1
    under parts in front.  A part that hangs on another is only turned about its `joint` (2,).
    """
    whole = whole_picture(image, hidden, model, colors)
    top = len(whole.levels) - 1
    placed, alphas = _guesses(model, whole, likely, joint)
    worth = np.concatenate([scores(model, whole, maps, alpha, top) for maps, alpha in zip(placed, alphas)])
    every = [Pose(one, alpha) for maps, alpha in zip(placed, alphas) for one in maps]
    size = across(model)
    chosen: list[tuple[NDArray, Pose]] = []
    for number in np.argsort(-worth, kind="stable"):
        rim = outline(model, every[number])
        if all(np.abs(rim - other).max() > 0.3 * size for other, _ in chosen):
            chosen.append((rim, every[number]))
        if len(chosen) == most:
            break
    return [pose for _, pose in chosen]


def whole_picture(image: NDArray, hidden: NDArray, model: PartModel, colors: ColorModel) -> Layer:
    """Everything in a picture that has the part's colours, as a layer."""
    soft = cv2.GaussianBlur(cover.chance(colors, image), (0, 0), 0.7) * (1 - hidden)
    return model.view.layer(image, soft, np.zeros(2), (1 - hidden).astype(np.float32))


def scores(model: PartModel, frame: Layer, placed: NDArray, alpha: NDArray, level: int) -> NDArray:
    """How well (M,) the picture bears out each of the maps (M, 2, 3) of one shape, at a level; 1 is perfect.

    Pixels that cannot be seen count nothing, so a pose out of sight is worth nothing, and so is an empty place.
    """
    points, values = appearance(model, level, alpha)
    telling = 1 - likeness(frame.ground - values)
    few = np.argsort(-telling, kind="stable")[: 2 * TELLING : 2]
    few = few[telling[few] > 0.05] if (telling[few] > 0.05).any() else few
    around = np.argsort(telling, kind="stable")[: TELLING // 2]  # where nothing of the part is: others' pixels show
    few = np.concatenate([few, around])
    points, values, telling = points[few], values[few], telling[few]
    at = affine.apply(placed, points).reshape(-1, 2)
    agrees = likeness(frame.sample(level, at).reshape(len(placed), len(few), -1) - values)
    known = frame.sample_known(level, at).reshape(len(placed), -1)
    return (known * (agrees - 1 + telling)).sum(axis=1) / max(telling.sum(), 1e-9)


def _guesses(
    model: PartModel, whole: Layer, likely: list[Pose], joint: NDArray | None
) -> tuple[list[NDArray], list[NDArray]]:
    """Maps (M, 2, 3) for each of several shapes, and the shapes' mode weights (L,)."""
    placed = [pose.placed[None] for pose in likely]
    alphas = [pose.alpha for pose in likely]
    expected = likely[0]
    places = _places(model, whole) if joint is None else joint[None]
    for drawn, alpha in as_drawn(model):
        if joint is None:
            linear = np.concatenate([_turned(drawn[:, :2], TURNS), expected.placed[None, :, :2]])
            laid = _laid(linear, mesh_shape(model, alpha)[model.keyset.outline].mean(axis=0), places)
            placed.append(np.concatenate([drawn[None], laid]))
        else:
            linear = _turned(expected.placed[:, :2], 3 * TURNS)
            placed.append(_laid(linear, np.array(model.part.pivot, float), places))
        alphas.append(alpha)
    rng = np.random.default_rng(0)
    for alpha in _sampled_shapes(model, expected, rng):
        placed.append(_round(expected, model, alpha, DRAWS // 6, rng))
        alphas.append(alpha)
    return placed, alphas


def as_drawn(model: PartModel) -> list[tuple[NDArray, NDArray]]:
    """Every key's map (2, 3) and mode weights (L,) in its key frame."""
    coefficients = np.zeros((1, 0)) if model.shape is None else model.shape.space.coefficients
    return [(drawn, coefficients[key]) for key, drawn in enumerate(model.keyset.removed)]


def _places(model: PartModel, whole: Layer) -> NDArray:
    """Full-size pixels (M, 2) about which there is most of the part's colours."""
    level = len(whole.levels) - 1
    coverage = whole.levels[level][..., 3]
    width = max(across(model) / 2**level, 1)
    about = cv2.blur(coverage, (int(width) | 1,) * 2, borderType=cv2.BORDER_CONSTANT)
    step = max(int(width / 6), 1)
    rows, columns = np.mgrid[: about.shape[0] : step, : about.shape[1] : step]
    worth = about[rows, columns].ravel()
    best = np.argsort(-worth, kind="stable")[:PLACES]
    best = best[worth[best] > 0.1 * about.max()]
    return np.column_stack([columns.ravel()[best], rows.ravel()[best]]) * 2.0**level


def _laid(linear: NDArray, point: NDArray, places: NDArray) -> NDArray:
    """Maps (M L, 2, 3) that do every linear part (L, 2, 2) and bring a point (2,) to every place (M, 2)."""
    shift = places[:, None] - (linear @ point)[None]
    every = np.broadcast_to(linear, (len(places), *linear.shape))
    return np.concatenate([every, shift[..., None]], axis=-1).reshape(-1, 2, 3)


def _turned(linear: NDArray, turns: int) -> NDArray:
    """A linear part (2, 2) turned and scaled in all ways (L, 2, 2)."""
    angles = 2 * np.pi * np.arange(turns) / turns
    rotations = np.stack([np.cos(angles), -np.sin(angles), np.sin(angles), np.cos(angles)], -1).reshape(-1, 2, 2)
    return np.concatenate([scale * rotations for scale in SCALES]) @ linear


def _sampled_shapes(model: PartModel, expected: Pose, rng: np.random.Generator) -> list[NDArray]:
    """Six mode weights: those expected, and mixtures of two rows."""
    if model.shape is None:
        return [expected.alpha] * 6
    rows = model.shape.space.coefficients
    mixes = []
    for _ in range(5):
        one, other = rng.integers(len(rows), size=2)
        share = rng.uniform()
        mixes.append((1 - share) * rows[one] + share * rows[other])
    return [expected.alpha, *mixes]


def _round(expected: Pose, model: PartModel, alpha: NDArray, count: int, rng: np.random.Generator) -> NDArray:
    """Maps (count, 2, 3) about an expected one: shifted by a third of the part's size, turned by half a radian."""
    middle = outline_at(model, expected.placed, alpha).mean(axis=0)
    turn, grow = rng.normal(0, 0.5, count), np.exp(rng.normal(0, 0.25, count))
    shift = rng.normal(0, 0.33 * across(model), (count, 2))
    linear = grow[:, None, None] * np.stack([np.cos(turn), -np.sin(turn), np.sin(turn), np.cos(turn)], axis=-1).reshape(
        -1, 2, 2
    )
    moved = np.concatenate([linear, (middle + shift - linear @ middle)[..., None]], axis=-1)
    return affine.compose(moved, expected.placed)
