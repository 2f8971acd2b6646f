"""Pictures of a performance: anti-aliased vector drawing with Agg, straight alpha, one frame at a time.

Pixel (0, 0) is the centre of the top-left pixel, as everywhere; Agg's own corner-based, y-up page is met
in one place, `_Page.place`.
"""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.motion import affine
from retarget.characters.casts import backdrop
from retarget.characters.drawings.paths import DrawnPath, Gradient, Paint, windings, wound
from retarget.characters.models.mesh import DrawnMesh
from retarget.characters.photos.picture import DrawnPicture
from retarget.stage import zbuffer
from retarget.stage.lay import lay
from retarget.stage.perform import Performance
from retarget.stage.warp import warp

LARGEST = 2**26  # pixels of a picture: 8192 x 8192


def draw(performance: Performance, t: int, background: Any = None, size: tuple[int, int] | None = None) -> NDArray:
    """Frame t as uint8 (H, W, 4), straight alpha; over a `background` it is opaque (H, W, 3).

    The background is a colour ("white", "#fed", (255, 0, 0)), an image (H, W, 3 | 4), a clip or a sequence of frames;
    `size` is width and height in pixels, the performance's own without it.
    """
    size = _drawable(performance.size if size is None else size)
    zoom = size[0] / performance.size[0]
    seen = None if background is None else backdrop.behind(background, t, float(performance.times[t]), size)
    return draw_things(performance.posed(t, zoom), size, seen)


def draw_frames(performance: Performance, background: Any = None, size: int | None = None) -> Iterator[NDArray]:
    """All frames in turn, `size` pixels wide, before the background."""
    page = page_size(performance, size)
    for t in range(len(performance.times)):
        yield draw(performance, t, background, page)


def page_size(performance: Performance, width: int | None) -> tuple[int, int]:
    """Width and height in pixels of a page so wide; the performance's own if None."""
    if width is None:
        return performance.size
    if width < 1:
        raise InputError(f"the picture's width must be at least 1 pixel, it came as {width}: give a larger --size")
    return width, max(1, round(performance.size[1] * width / performance.size[0]))


def draw_things(
    things: Sequence[DrawnPath | DrawnPicture | DrawnMesh], size: tuple[int, int], background: Any = None
) -> NDArray:
    """Drawn paths, pictures and models, back to front, on a page of `size` (width, height)."""
    page = _Page(*_drawable(size))
    if background is not None:
        page.pixels[..., :3] = backdrop.behind(background, 0, 0.0, size)
        page.pixels[..., 3] = 255
    for thing in things:
        if isinstance(thing, DrawnPicture):
            _draw_picture(page, thing)
        elif isinstance(thing, DrawnMesh):
            _draw_mesh(page, thing)
        else:
            _draw_path(page, thing)
    return page.pixels.copy() if background is None else page.pixels[..., :3].copy()


def _drawable(size: tuple[int, int]) -> tuple[int, int]:
    """A size for which there is memory; a file may ask for any."""
    if size[0] * size[1] > LARGEST:
        raise InputError(
            f"a picture must have no more than {LARGEST >> 20} million pixels, {size[0]} x {size[1]} are more: "
            "make it smaller"
        )
    return size


class _Page:
    """An Agg page, its pixels (H, W, 4), and a spare one of the same size for coverage."""

    def __init__(self, width: int, height: int) -> None:
        from matplotlib.backends.backend_agg import RendererAgg
        from matplotlib.transforms import Affine2D

        self.size = (width, height)
        self.agg = RendererAgg(width, height, 72)  # 72 points to the inch: a point is a pixel
        self.pixels = np.asarray(self.agg.buffer_rgba())
        self.place = Affine2D(np.array([[1, 0, 0.5], [0, -1, height - 0.5], [0, 0, 1]]))
        self._spare = None

    def spare(self) -> "_Page":
        if self._spare is None:
            self._spare = _Page(*self.size)
        return self._spare

    def window(self, points: NDArray, margin: float) -> tuple[slice, slice]:
        """Rows and columns that hold the points (N, 2) and a margin, within the page."""
        low = np.floor(points.min(axis=0) - margin - 1)
        high = np.ceil(points.max(axis=0) + margin + 2)
        (x0, y0), (x1, y1) = np.clip([low, high], 0, self.size).astype(int)
        return slice(y0, max(y0, y1)), slice(x0, max(x0, x1))


def _draw_path(page: _Page, path: DrawnPath) -> None:
    if path.evenodd:
        path = wound(path, windings(path))
    outline = _agg_path(path)
    gradients = isinstance(path.fill, Gradient) or isinstance(path.stroke, Gradient)
    whole = path.opacity >= 1 or path.fill is None or path.stroke is None
    if whole and not gradients:
        fill, stroke = (_faded(paint, path.opacity) for paint in (path.fill, path.stroke))
        page.agg.draw_path(_pen(path, stroke), outline, page.place, fill)
        return
    window = page.window(path.points, path.width * (2 if path.join == "miter" else 1) if path.stroke is not None else 0)
    if whole or path.opacity >= 1:
        target, opacity = page, path.opacity
    else:  # fill and stroke fade as one
        target, opacity = _Page(*page.size), 1.0
    for paint, stroked in ((path.fill, False), (path.stroke, True)):
        if paint is None:
            continue
        cover = _coverage(page.spare(), path, outline, stroked, window)
        color = _colors(paint, window)
        lay(target.pixels[window], color[..., :3], color[..., 3] * cover * opacity)
    if target is not page:
        layer = target.pixels[window] / 255.0
        lay(page.pixels[window], layer[..., :3], layer[..., 3] * path.opacity)


def _draw_picture(page: _Page, picture: DrawnPicture) -> None:
    window = page.window(picture.points, 1)
    if window[0].stop <= window[0].start or window[1].stop <= window[1].start:
        return
    color = warp(picture, window)  # premultiplied
    alpha = color[..., 3] * _coverage(page.spare(), picture, _agg_rings(picture), False, window)
    lay(page.pixels[window], color[..., :3] / np.maximum(color[..., 3:], 1e-6), alpha)


def _draw_mesh(page: _Page, mesh: DrawnMesh) -> None:
    window = page.window(zbuffer.projected(mesh)[:, :2], 1)
    if window[0].stop <= window[0].start or window[1].stop <= window[1].start:
        return
    color = zbuffer.render(mesh, window)  # premultiplied
    lay(page.pixels[window], color[..., :3] / np.maximum(color[..., 3:], 1e-6), color[..., 3])


def _faded(paint: Paint, opacity: float) -> tuple[float, ...] | None:
    return None if paint is None else (*paint[:3].tolist(), float(paint[3]) * opacity)


def _pen(path: Any, stroke: tuple[float, ...] | None) -> Any:
    """Agg's graphics context: no snapping to whole pixels, so that a slow move stays slow."""
    from matplotlib.backend_bases import GraphicsContextBase

    pen = GraphicsContextBase()
    pen.set_snap(False)
    if stroke is None:
        pen.set_linewidth(0)
        return pen
    pen.set_foreground(stroke, isRGBA=True)
    pen.set_linewidth(path.width)
    pen.set_capstyle("projecting" if path.cap == "square" else path.cap)
    pen.set_joinstyle(path.join)
    if path.dashes:
        pen.set_dashes(0, list(path.dashes))
    return pen


def _agg_path(path: DrawnPath) -> Any:
    """The cubic curves as Agg takes them, each closed subpath with its closing vertex."""
    from matplotlib.path import Path

    codes = np.full(len(path.points), Path.CURVE4, np.uint8)
    codes[path.starts[:-1]] = Path.MOVETO
    ends = path.starts[1:][path.closed]
    points = np.insert(path.points, ends, path.points[path.starts[:-1][path.closed]], axis=0)
    return Path(points, np.insert(codes, ends, Path.CLOSEPOLY))


def _agg_rings(picture: DrawnPicture) -> Any:
    from matplotlib.path import Path

    rings = [Path(picture.points[np.append(ring, ring[0])], closed=True) for ring in picture.rings]
    return Path.make_compound_path(*rings)


def _coverage(spare: _Page, path: Any, outline: Any, stroked: bool, window: tuple[slice, slice]) -> NDArray:
    """How much of each pixel of the window (h, w) the fill or the stroke covers, 0-1."""
    white = (1.0, 1.0, 1.0, 1.0)
    spare.pixels[window] = 0
    spare.agg.draw_path(_pen(path, white if stroked else None), outline, spare.place, None if stroked else white)
    cover = spare.pixels[window][..., 3] / 255.0
    spare.pixels[window] = 0
    return cover


def _colors(paint: Paint, window: tuple[slice, slice]) -> NDArray:
    """The colour (h, w, 4) or (4,) of a paint at every pixel of the window."""
    if not isinstance(paint, Gradient):
        return paint
    if abs(np.linalg.det(paint.place[:, :2])) < 1e-9:
        return paint.colors[-1]
    inverse = affine.invert(paint.place)
    y, x = np.ogrid[window]
    u, v = (inverse[axis, 0] * x + inverse[axis, 1] * y + inverse[axis, 2] for axis in (0, 1))
    at = u if paint.focus is None else _radial(u, v, paint.focus)
    if paint.spread == "reflect":
        at = np.abs((at + 1) % 2 - 1)
    elif paint.spread == "repeat":
        at = at % 1
    steps = np.linspace(0, 1, 1024)
    table = np.stack([np.interp(steps, paint.offsets, channel) for channel in paint.colors.T], axis=-1)
    return table[(np.clip(at, 0, 1) * 1023 + 0.5).astype(int)]


def _radial(u: NDArray, v: NDArray, focus: NDArray) -> NDArray:
    """t of a radial gradient: where the ray from the focus through (u, v) meets the unit circle, t is 1."""
    du, dv = u - focus[0], v - focus[1]
    inside = 1 - focus @ focus
    along = du * focus[0] + dv * focus[1]
    far = du**2 + dv**2
    return (along + np.sqrt(along**2 + far * inside)) / inside
