"""Pictures that play a part: a PNG or JPG on a mesh, bent with it.

A picture's outline comes from its alpha, from a box that it is cut out by, or from points in the cast.  One picture can
serve all keys, then outlines say how it bends, or the captured keys do; or every key has its own, then the pictures
melt into each other.
"""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.motion import affine, keys, triangulate
from capture.motion.keys import Inbetweener, KeySet
from retarget.characters.photo import cut_out, read_photo


@dataclass(frozen=True, eq=False)
class Layer:
    """One picture in ever smaller sizes, and where the mesh lies in it."""

    pixels: tuple[NDArray, ...]  # (h, w, 4) float32, 0-1, premultiplied; each half the size of the one before
    points: NDArray  # (N, 2) mesh points in the picture as it was
    size: tuple[int, int]  # its width and height as it was: the first of `pixels` may be smaller

    @cached_property
    def opaque(self) -> bool:
        """Whether nothing of it is transparent: then it goes on beyond its border as it is there."""
        return bool(self.pixels[0][..., 3].min() >= 1)

    def level(self, scale: float) -> NDArray:
        """The size that suits a drawing at `scale` page pixels for a picture's pixel."""
        number = round(np.log2(self.pixels[0].shape[1] / self.size[0] / max(scale, 1e-6)))
        return self.pixels[int(np.clip(number, 0, len(self.pixels) - 1))]


@dataclass(frozen=True, eq=False)
class DrawnPicture:
    """A picture posed on the page: the mesh's places and the layers mixed on it."""

    points: NDArray  # (N, 2) on the page
    faces: NDArray  # (F, 3)
    rings: tuple[NDArray, ...]  # closed boundary loops of point numbers
    layers: tuple[tuple[Layer, float], ...]  # with shares that sum to 1
    scale: float  # page pixels for a picture's pixel


@dataclass(frozen=True, eq=False)
class Picture:
    """A textured mesh as a target."""

    part: str
    keys: KeySet
    box: NDArray  # (2, 2)
    layers: tuple[Layer, ...]  # one, or one for every key
    between: Inbetweener = keys.rigid
    height: float = 1.0
    pivot: NDArray | None = None
    notes: tuple[str, ...] = ()  # what a user should be told

    def shapes(self, rows: NDArray) -> NDArray:
        """The mesh (D, N, 2) redrawn for rows (D, 3)."""
        return keys.shapes(keys.with_rows(self.keys, rows), self.between)

    def posed(self, points: NDArray, weights: NDArray, scale: float) -> list[DrawnPicture]:
        """The picture on points (N, 2) of the stage; several pictures are mixed by the key weights (K,)."""
        if len(self.layers) == 1:
            mixed = ((self.layers[0], 1.0),)
        else:
            shares = np.clip(weights, 0, None) / np.clip(weights, 0, None).sum()
            mixed = tuple(
                (layer, float(share)) for layer, share in zip(self.layers, shares, strict=True) if share > 1e-3
            )
        return [DrawnPicture(points, self.keys.faces, (self.keys.outline,), mixed, scale)]


def read_picture(
    part: str,
    names: tuple[str, ...],
    paths: list[Path],
    outlines: list[NDArray | None],
    between: Inbetweener = keys.rigid,
    box: tuple[float, float, float, float] | None = None,
    source: KeySet | None = None,
) -> Picture:
    """A picture character from one image (or the same for all keys), or one for every key.

    With a `box` (x, y, width, height) what it is drawn round is cut out.  Several keys need an outline (B, 2) each, in
    pixels, of the same number of points; but where one picture serves all keys, those of the `source` can be carried
    over to the first.  A first outline may be left to the picture's alpha.
    """
    from retarget.characters.carried import carried_outline

    photos = {path: read_photo(path) for path in dict.fromkeys(paths)}
    if box is not None:
        photos = {path: cut_out(photo, box, str(path)) for path, photo in photos.items()}
    for path, outline in zip(paths, outlines, strict=True):
        _check_on_it(path, outline, photos[path].size)
    first = photos[paths[0]]
    carries = len(photos) == 1 and source is not None and all(outline is None for outline in outlines[1:])
    if outlines[0] is None and (len(names) == 1 or carries):
        base = first.to_own(outline_of(first.pixels, str(paths[0])))
        seen = first.to_own(_visible_box(first.pixels))
    elif len(names) == 1 or carries:
        base, seen = _dense(np.asarray(outlines[0], float)[None])[0], None
    else:
        base, seen = None, None
    if base is not None:
        outline = base[None] if len(names) == 1 else carried_outline(base, source, str(paths[0]))
    else:
        outline = _dense(_corresponding(part, names, outlines))
    box_seen = np.stack([outline[0].min(axis=0), outline[0].max(axis=0)]) if seen is None else seen
    spacing = max(np.sqrt(abs(_area(outline[0])) / 400), 1.0)
    keyset = keys.keyset(names, outline, spacing=spacing)
    drawn = affine.apply(keyset.removed, keyset.points)
    sizes = {path: halved(photo.pixels) for path, photo in photos.items()}
    layers = [Layer(sizes[path], drawn[k], photos[path].size) for k, path in enumerate(paths)]
    notes = tuple(note for photo in photos.values() for note in photo.notes)
    return Picture(part, keyset, box_seen, tuple(layers if len(photos) > 1 else layers[:1]), between, notes=notes)


def _check_on_it(path: Path, outline: NDArray | None, size: tuple[int, int]) -> None:
    """Refuse an outline that no part of the picture lies in: nothing would be seen."""
    if outline is None or not len(outline):
        return
    low, high = np.min(outline, axis=0), np.max(outline, axis=0)
    if (high < -0.5).any() or (low > np.array(size) - 0.5).any():
        raise InputError(
            f"{path}: an outline must lie on its picture of {size[0]} x {size[1]} pixels, it reaches from "
            f"({low[0]:g}, {low[1]:g}) to ({high[0]:g}, {high[1]:g}): give it in the picture's own pixels"
        )


def _corresponding(part: str, names: tuple[str, ...], outlines: list[NDArray | None]) -> NDArray:
    """The keys' outlines (K, B, 2), if each has one of the same number of points."""
    counts = [0 if outline is None else len(outline) for outline in outlines]
    if min(counts) < 3 or len(set(counts)) > 1:
        shown = ", ".join(f"{name} {count}" for name, count in zip(names, counts, strict=True))
        raise InputError(
            f"part {part!r}: pictures for several keys need an outline each, of the same 3 or more "
            f"points, these have {shown}: give them in the cast"
        )
    return np.stack(outlines)


def read_image(path: str | Path) -> NDArray:
    """An image file as uint8 RGBA (H, W, 4), turned upright if it says so, of at most 8 megapixels."""
    return read_photo(path).pixels


def outline_of(image: NDArray, name: str = "the picture", count: int | None = None) -> NDArray:
    """The outline (B, 2) of a picture's opaque part, by its alpha, two pixels wider for the soft border."""
    import shapely
    from skimage import measure

    alpha = np.pad(image[..., 3].astype(float), 2)
    if image[..., 3].min() > 127:
        raise InputError(
            f"{name} must have a transparent surrounding to be cut out, it has none: "
            "draw a box round it (--box X Y WIDTH HEIGHT, or box = [...] in the cast), give an outline in the cast, or "
            "make its background transparent"
        )
    contours = [contour[:, ::-1] - 2 for contour in measure.find_contours(alpha, 127.5) if len(contour) > 3]
    if not contours:
        raise InputError(f"{name} must have something opaque on it, all of it is transparent")
    solids = [shapely.make_valid(shapely.Polygon(contour)).buffer(2.0) for contour in contours]
    union = shapely.union_all(solids)
    largest = max(getattr(union, "geoms", [union]), key=lambda solid: solid.area)
    ring = np.array(shapely.Polygon(largest.exterior).simplify(0.3).exterior.coords)[:-1]
    if count is None:
        count = int(np.clip(largest.length / np.sqrt(largest.area / 400), 40, 400))
    return valid_ring(ring, count)


def valid_ring(ring: NDArray, count: int) -> NDArray:
    """`count` even points (B, 2) along a ring (B, 2), or more where so few would make it cross itself."""
    import shapely

    for factor in (1, 2, 4):
        even = triangulate.resample(ring, factor * count)
        if shapely.Polygon(even).is_valid:
            return even
    return ring


def _dense(outlines: NDArray, least: int = 60, count: int = 120) -> NDArray:
    """Corresponding outlines (K, B, 2); rough ones with every step cut alike, to about `count` points."""
    if outlines.shape[1] >= least:
        return outlines
    parts = max(1, round(count / outlines.shape[1]))
    s = np.arange(parts)[:, None] / parts
    after = np.roll(outlines, -1, axis=1)
    dense = (1 - s) * outlines[:, :, None] + s * after[:, :, None]
    return dense.reshape(len(outlines), -1, 2)


def _visible_box(image: NDArray) -> NDArray:
    """Least and greatest corner (2, 2) of what is more than half opaque; pixels reach half a pixel out."""
    rows, columns = np.nonzero(image[..., 3] > 127)
    return np.array([[columns.min() - 0.5, rows.min() - 0.5], [columns.max() + 0.5, rows.max() + 0.5]])


def _area(outline: NDArray) -> float:
    x, y = outline.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def halved(image: NDArray) -> tuple[NDArray, ...]:
    """The picture premultiplied, then halved until it is small, so that a small one does not flicker."""
    import cv2

    pixels = image.astype(np.float32) / 255
    pixels[..., :3] *= pixels[..., 3:]
    sizes = [pixels]
    while min(sizes[-1].shape[:2]) > 16:
        height, width = sizes[-1].shape[:2]
        sizes.append(cv2.resize(sizes[-1], ((width + 1) // 2, (height + 1) // 2), interpolation=cv2.INTER_AREA))
    return tuple(sizes)
