"""A part as the tracker knows it: its colours, its keys, and the templates made from the key frames."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.fit.pixels import keyimages, layer, outside, track_affine, track_keys, track_shape
from capture.fit.pixels.layer import View
from capture.fit.shapes.keyspace import KeySpace, extended_space, mix
from capture.motion import affine, keys
from capture.motion.keys import KeySet
from capture.pictures import matte
from capture.pictures.clip import Clip
from capture.pictures.matte import ColorModel, Seed
from capture.pictures.shot import Part

INK = 2  # pixels beyond an outline that a part in front still colours
GRID = 3  # pixels between places within a part
RIM = 4  # pixels within an outline where the silhouette tells, whatever is painted there


class Cover(NamedTuple):
    """What other parts take up of a key frame."""

    hidden: NDArray  # (H, W) uint8, 1 under parts in front
    behind: NDArray  # (H, W) uint8, 1 where parts behind are drawn


@dataclass(frozen=True, eq=False)
class ShapeModel:
    """What a part with several keys needs beside its first key's template."""

    space: KeySpace
    eigen: track_keys.EigenTemplate
    bent: track_shape.ShapeTemplate
    loose: outside.LooseTemplate
    to_keys: NDArray  # (L, K) from mode weights to rough key weights, added to their mean
    mean_amounts: NDArray  # (K,)


@dataclass(frozen=True, eq=False)
class PartModel:
    """Everything that is learnt of a part before its frames are gone through."""

    part: Part
    keyset: KeySet
    colors: ColorModel
    view: View
    rigid: track_affine.Template
    shape: ShapeModel | None  # None for a part with one key
    inner: NDArray  # (Q, 2) places well within the first key's outline, in its frame ...
    guessed: NDArray  # (Q,) bool: others hide the part there, so nobody knows what it looks like, but it is there


def learn(part: Part, clip: Clip, first: int = 0, others: tuple[Part, ...] = ()) -> PartModel:
    """Learn a part from its key frames; the clip's frame 0 is number `first` of the shot's numbering.

    Of the `others`, those drawn in front hide what their outlines in the same key frame cover.
    """
    pictures = [np.asarray(clip[frame])[..., :3] for frame in key_frames(part, clip, first)]
    inside = seed(part, pictures)
    covers = [covered(part, key.frame, others, clip.size) for key in part.keys]
    seeds = [_in_sight(one, cover.hidden) for one, cover in zip(inside, covers)]
    colors = matte.learn(seeds)
    mattes = [matte.cut_key(colors, s) for s in seeds]
    if part.keys[0].outline:
        filled = [_filled(*four) for four in zip(pictures, mattes, part.outlines(), covers)]
        pictures, mattes = [picture for picture, _ in filled], [alpha for _, alpha in filled]
    outlines = part.outlines() if part.keys[0].outline else matte.trace(mattes[0], step=3.0)[None]
    keyset = keys.keyset(tuple(key.name for key in part.keys), outlines)
    ground = layer.mean_color(pictures[0], mattes[0])
    view = View(ground, layer.flatness(pictures[0], mattes[0], ground), layer.levels_for(outlines[0]))
    window = layer.window(outlines[0], clip.size, 24)
    origin = np.array([window[1].start, window[0].start])
    known = _known(part, covers[0])
    key_layer = view.layer(pictures[0][window], mattes[0][window], origin)
    if known is not None:
        key_layer = replace(key_layer, known=layer.halved(known[window], view.levels))
    rigid = track_affine.template(key_layer, outlines[0])
    shape = _shape_model(keyset, pictures, mattes, view) if len(part.keys) > 1 else None
    return PartModel(part, keyset, colors, view, rigid, shape, *_within(outlines[0], covers[0]))


def seed(part: Part, pictures: list[NDArray]) -> list[Seed]:
    """What the shot says of the part's pixels in its key frames: outlines, a colour, scribbles or a box."""
    if part.keys[0].outline:
        _inside_picture(part, pictures[0])
        return [matte.seed_outline(picture, np.array(key.outline)) for picture, key in zip(pictures, part.keys)]
    if part.color is not None:
        return [matte.seed_color(pictures[0], part.color)]
    if part.inside:
        strokes = [[np.array(stroke) for stroke in strokes] for strokes in (part.inside, part.outside)]
        return [matte.seed_scribbles(pictures[0], *strokes)]
    if part.box is not None:
        return [matte.seed_box(pictures[0], part.box)]
    raise InputError(
        f"part {part.name!r} must say which pixels are its own: give its key an outline, or a box, a colour or "
        "scribbles"
    )


def covered(part: Part, frame: int, others: tuple[Part, ...], size: tuple[int, int]) -> Cover:
    """What parts in front and parts behind take up of a frame, as far as they have a key there."""
    masks = {True: np.zeros((size[1], size[0]), np.uint8), False: np.zeros((size[1], size[0]), np.uint8)}
    for other in others:
        for key in other.keys:
            if other.name != part.name and key.frame == frame and key.outline:
                masks[other.order > part.order] |= matte.fill(size, np.array(key.outline))
    brush = np.ones((2 * INK + 1, 2 * INK + 1), np.uint8)
    return Cover(cv2.dilate(masks[True], brush), cv2.dilate(masks[False], brush))


def _in_sight(one: Seed, hidden: NDArray) -> Seed:
    """A seed without the pixels that others hide; whole where nothing would be left."""
    inside = one.inside * (1 - hidden)
    return one if np.count_nonzero(inside) < 16 else replace(one, inside=inside)


def _filled(picture: NDArray, alpha: NDArray, outline: NDArray, cover: Cover) -> tuple[NDArray, NDArray]:
    """Picture and matte with what is hidden of a part filled in, and rid of what is behind it.

    The hidden part's outline is known; its colours are those of the nearest pixels in sight.
    """
    from scipy.ndimage import distance_transform_edt

    own = matte.fill((picture.shape[1], picture.shape[0]), outline)
    rim = cv2.dilate(own, np.ones((2 * INK + 1, 2 * INK + 1), np.uint8))
    alpha = np.where((cover.behind > 0) & (rim == 0), np.float32(0), alpha)
    under = cover.hidden > 0
    shown = (own > 0) & ~under & (alpha > 0.5)
    if not (under & (rim > 0)).any() or not shown.any():
        return picture, alpha
    rows, columns = distance_transform_edt(~shown, return_distances=False, return_indices=True)
    soft = cv2.GaussianBlur(own.astype(np.float32), (0, 0), 0.7)
    return np.where(under[..., None], picture[rows, columns], picture), np.where(under, soft, alpha)


def _within(outline: NDArray, cover: Cover) -> tuple[NDArray, NDArray]:
    """Places (Q, 2) on a grid well within an outline (B, 2), and which of them (Q,) others hide."""
    own = matte.fill((cover.hidden.shape[1], cover.hidden.shape[0]), outline)
    inner = cv2.erode(own, np.ones((2 * RIM + 1, 2 * RIM + 1), np.uint8))
    rows, columns = np.nonzero(inner[::GRID, ::GRID])
    return GRID * np.column_stack([columns, rows]).astype(float), cover.hidden[::GRID, ::GRID][rows, columns] > 0


def _known(part: Part, cover: Cover) -> NDArray | None:
    """How far (H, W) the first key's pixels can be trusted, None for all of them.

    What is hidden is guessed.  Its silhouette is not: half known, it counts on small pictures, where alpha is compared.
    """
    if not part.keys[0].outline or not (cover.hidden | cover.behind).any():
        return None
    own = matte.fill((cover.hidden.shape[1], cover.hidden.shape[0]), np.array(part.keys[0].outline))
    brush = np.ones((2 * RIM + 1, 2 * RIM + 1), np.uint8)
    inner, outer = cv2.erode(own, brush), cv2.dilate(own, np.ones((2 * INK + 1, 2 * INK + 1), np.uint8))
    known = 1 - 0.5 * cover.hidden.astype(np.float32)
    known[(cover.hidden & inner) > 0] = 0
    known[(cover.behind & (1 - outer)) > 0] = 0
    return known


def _shape_model(keyset: KeySet, pictures: list[NDArray], mattes: list[NDArray], view: View) -> ShapeModel:
    shapes = keys.shapes(keyset)
    space = extended_space(shapes)
    drawn = [view.layer(picture, alpha, np.zeros(2)) for picture, alpha in zip(pictures, mattes)]
    grid = keyimages.grid_round(shapes)
    outline = space.mean[keyset.outline]
    rough = min(track_keys.FINEST, view.levels - 1)
    rows = keyimages.row_layers(drawn, keyset, shapes, grid, rough)
    eigen = track_keys.eigen_template(rows, outline, space)
    place = keyimages.mesh_map(space.mean, keyset.faces, grid)
    textures = [
        keyimages.pulled_layer(key, points, removed, place, grid.origin)
        for key, points, removed in zip(drawn, keyset.points, keyset.removed)
    ]
    bent = track_shape.shape_template(textures, place, space)
    loose = outside.loose_template(textures, place, space, keyset.outline)
    amounts = keys.fold(keyset.rows, np.eye(len(keyset.rows)), len(keyset.names))
    mean = amounts.mean(axis=0)
    to_keys = np.linalg.lstsq(space.coefficients, amounts - mean, rcond=1e-3)[0]
    return ShapeModel(space, eigen, bent, loose, to_keys, mean)


def amounts(model: ShapeModel, alpha: NDArray) -> NDArray:
    """Rough key weights (K,), 0 or more with sum 1, of mode weights (L,): how the keys' textures are mixed."""
    rough = np.clip(model.mean_amounts + alpha @ model.to_keys, 0, None)
    return rough / max(rough.sum(), 1e-9)


def outline_at(model: PartModel, placed: NDArray, alpha: NDArray) -> NDArray:
    """The part's boundary (B, 2) in a frame."""
    return affine.apply(placed, mesh_shape(model, alpha)[model.keyset.outline])


def mesh_shape(model: PartModel, alpha: NDArray) -> NDArray:
    """The part's mesh (N, 2), aligned, for mode weights (L,)."""
    if model.shape is None:
        return model.keyset.points[0]
    return mix(model.shape.space, alpha)


def key_frames(part: Part, clip: Clip, first: int) -> list[int]:
    """The part's key frames as the clip counts them, from 0."""
    for key in part.keys:
        if not first <= key.frame < first + len(clip):
            raise InputError(
                f"part {part.name!r}: a key frame must lie in the shot's frames {first} to {first + len(clip) - 1}, "
                f"got {key.frame}"
            )
    return [key.frame - first for key in part.keys]


def _inside_picture(part: Part, picture: NDArray) -> None:
    height, width = picture.shape[:2]
    for key, outline in zip(part.keys, part.outlines()):
        low, high = outline.min(axis=0), outline.max(axis=0)
        if (high < 0).any() or low[0] > width - 1 or low[1] > height - 1:
            raise InputError(
                f"part {part.name!r}, key {key.name!r}: the outline must lie in the {width} x {height} picture, it "
                f"reaches from ({low[0]:.0f}, {low[1]:.0f}) to ({high[0]:.0f}, {high[1]:.0f})"
            )
