"""Lottie: a performance as shape layers for web pages, apps and After Effects (animation.lottiefiles.com's JSON).

A part is a shape layer, an element a group in it: its outlines, its stroke, its fill.  An outline has a key frame for
each new drawing, always of the same number of vertices.  Held drawings are holds ("h": 1); anything else moves on
smoothly between frames and meets every one of them exactly.  The last key frame has no way out, for players of the
rlottie family draw nothing if it has.

A picture that keeps its shape is an image layer; nothing in Lottie bends one, so one that bends is refused.

Lottie knows round gradients, no oval ones: a fill with one lies in a group of its own that is stretched, its outlines
the other way.  A stroke cannot be stretched; an oval gradient on one is made round.
"""

import json
from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capture.files import written_beside
from retarget.characters.drawings.paths import DrawnPath, Gradient
from retarget.export.elements import GRAIN, Element, Layer, Page, grains, kept, page_of, refused
from retarget.export.gradients import finer, line_of, padded, round_of
from retarget.export.stills import still_of
from retarget.export.svg import png_of
from retarget.stage.perform import Performance

CAPS = {"butt": 1, "round": 2, "square": 3}
JOINS = {"miter": 1, "round": 2, "bevel": 3}
MITER = 4  # how far a mitered corner may reach, in widths, as in SVG

Thing = dict[str, Any]
Property = Callable[[Sequence[list[Any]]], Thing]  # T values, each a list, to a property that is animated or not


def write_lottie(performance: Performance, path: str | Path, width: int | None = None, background: Any = None) -> None:
    """A performance as a Lottie *.json file, its stage's size or `width` pixels wide, over a colour or nothing."""
    page = page_of(performance, width, background)
    text = json.dumps(_animation(page), separators=(",", ":"), allow_nan=False)
    with written_beside(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def _animation(page: Page) -> Thing:
    last = _short(page.duration * page.fps)
    assets: list[Thing] = []
    layers = [_layer(layer, page, assets) for layer in reversed(page.layers)]  # Lottie's first is in front
    if page.background:
        width, height = page.size
        behind = {"ty": 1, "nm": "background", "sw": width, "sh": height, "sc": page.background, "ks": _still()}
        layers.append(behind)
    for number, layer in enumerate(layers, 1):
        layer |= {"ddd": 0, "ind": number, "sr": 1, "ao": 0, "ip": 0, "op": last, "st": 0, "bm": 0}
    return {
        "v": "5.9.0",
        "fr": _short(page.fps),
        "ip": 0,
        "op": last,
        "w": page.size[0],
        "h": page.size[1],
        "nm": "performance",
        "ddd": 0,
        "assets": assets,
        "layers": layers,
    }


def _layer(layer: Layer, page: Page, assets: list[Thing]) -> Thing:
    frames = [_short(start * page.fps) for start in page.starts]

    def property_of(values: Sequence[list[Any]]) -> Thing:
        return _property(values, frames, layer.stepped)

    seen = _property([[100 if seen else 0] for seen in layer.visible], frames, True)
    if not isinstance(layer.elements[0].drawn[0], DrawnPath):
        return _image(layer, seen, property_of, assets)
    shapes = [_group(element, property_of) for element in reversed(layer.elements)]
    return {"ty": 4, "nm": layer.name, "ks": _still() | {"o": seen}, "shapes": shapes}


def _image(layer: Layer, seen: Thing, of: Property, assets: list[Thing]) -> Thing:
    """A part that is one picture, which keeps its shape: the picture in the file's assets, and its place."""
    still = still_of(layer.elements[0]) if len(layer.elements) == 1 else None
    if still is None:
        raise refused(layer, "a Lottie file")
    height, width = still.pixels.shape[:2]
    name = f"picture {len(assets)}"
    assets.append({"id": name, "w": width, "h": height, "u": "", "p": png_of(still.pixels), "e": 1})
    place = {
        "o": seen,
        "p": of(_pixels(grains(still.travel))),
        "r": of([[_short(angle)] for angle in still.turn]),
        "sk": of([[_short(-angle)] for angle in still.slant]),
        "sa": {"a": 0, "k": 0},
        "s": of((100 * np.round(still.stretch, 6)).round(4).tolist()),
    }
    return {"ty": 2, "nm": layer.name, "refId": name, "ks": _still() | place}


def _group(element: Element, of: Property) -> Thing:
    """An element: its stroke in front of its fill, and both fading as one."""
    drawn: Sequence[DrawnPath] = element.drawn
    first, inside = drawn[0], []
    points = np.stack([path.points for path in drawn])
    oval = isinstance(first.fill, Gradient) and first.fill.focus is not None
    if first.stroke is not None or not oval:
        inside += _outlines(first, points, of)
    if first.stroke is not None:
        inside.append(_stroke(drawn, of))
    if oval:
        inside.append(_oval(drawn, of))
    elif first.fill is not None:
        inside.append(_fill(drawn, of))
    faded = _still() | {"ty": "tr", "o": of([[_short(100 * path.opacity)] for path in drawn])}
    return {"ty": "gr", "nm": element.name, "it": [*inside, faded]}


def _outlines(first: DrawnPath, points: NDArray, of: Property) -> list[Thing]:
    return [{"ty": "sh", "ks": of(values)} for values in outline_values(first, points)]


def outline_values(first: DrawnPath, points: NDArray) -> list[list[list[Thing]]]:
    """Each subpath, with points (T, N, 2), in T frames: vertices, and the ways into and out of them."""
    subpaths = []
    cents = grains(points)
    for a, b, closed in zip(first.starts[:-1], first.starts[1:], first.closed, strict=True):
        vertices = cents[:, a:b:3]
        before = np.concatenate([vertices[:, :1], cents[:, a + 2 : b : 3]], axis=1) - vertices
        after = np.concatenate([cents[:, a + 1 : b : 3], vertices[:, -1:]], axis=1) - vertices
        if closed and (vertices[:, 0] == vertices[:, -1]).all():  # the last curve ends on the first vertex
            before[:, 0] = before[:, -1]
            vertices, before, after = vertices[:, :-1], before[:, :-1], after[:, :-1]
        ways = zip(vertices, before, after, strict=True)
        subpaths.append([[{"c": bool(closed), "v": _pixels(v), "i": _pixels(i), "o": _pixels(o)}] for v, i, o in ways])
    return subpaths


def _fill(drawn: Sequence[DrawnPath], of: Property) -> Thing:
    rule = {"r": 2 if drawn[0].evenodd else 1}
    if isinstance(drawn[0].fill, Gradient):
        return {"ty": "gf", **_gradient([path.fill for path in drawn], [path.points for path in drawn], of), **rule}
    return {"ty": "fl", **_color([path.fill for path in drawn], of), **rule}


def _stroke(drawn: Sequence[DrawnPath], of: Property) -> Thing:
    first = drawn[0]
    pen = {"w": of([[_short(path.width)] for path in drawn])}
    pen |= {"lc": CAPS[first.cap], "lj": JOINS[first.join], "ml": MITER}
    if first.dashes:
        lengths = [of([[_short(path.dashes[i])] for path in drawn]) for i in range(len(first.dashes))]
        # Each needs a name of its own, or lottie-web, which makes them properties of an object, draws nothing at all.
        dashes = [{"n": "dg"[i % 2], "nm": f"length {i + 1}", "v": length} for i, length in enumerate(lengths)]
        pen["d"] = [*dashes, {"n": "o", "nm": "offset", "v": {"a": 0, "k": 0}}]
    if isinstance(first.stroke, Gradient):
        return {"ty": "gs", **_gradient([path.stroke for path in drawn], [path.points for path in drawn], of), **pen}
    return {"ty": "st", **_color([path.stroke for path in drawn], of), **pen}


def _color(colors: Sequence[NDArray], of: Property) -> Thing:
    channels = np.round(np.clip(np.stack(colors), 0, 1), 4)
    return {"c": of([[*rgb, 1] for rgb in channels[:, :3].tolist()]), "o": of([[_short(100 * c[3])] for c in channels])}


def _gradient(gradients: Sequence[Gradient], points: Sequence[NDArray], of: Property) -> Thing:
    """A gradient along a line, or round a point in a circle."""
    gradients = padded(gradients, points)
    if gradients[0].focus is None:
        ends = np.stack([line_of(gradient) for gradient in gradients])
        shape: Thing = {"t": 1, "s": of(_pixels(grains(ends[:, 0]))), "e": of(_pixels(grains(ends[:, 1])))}
    else:
        way = round_of(gradients)
        radius = np.sqrt(way.scale.prod(axis=1))
        shape = _circle(way.center, radius, way.focus, way.angle, of)
    return shape | _stops(gradients, of)


def _circle(center: NDArray, radius: NDArray, focus: NDArray, angle: NDArray, of: Property) -> Thing:
    """Lottie's radial gradient: from a point to one on the rim, its highlight in percent of the way and in degrees."""
    rim = center + np.stack([radius, 0 * radius], axis=-1)
    far = np.linalg.norm(focus, axis=1)
    turn = np.degrees(np.unwrap(np.arctan2(focus[:, 1], focus[:, 0]) + angle))
    return {
        "t": 2,
        "s": of(_pixels(grains(center))),
        "e": of(_pixels(grains(rim))),
        "h": of([[_short(100 * share)] for share in far]),
        "a": of([[_short(degrees)] for degrees in np.where(far > 1e-6, turn, 0)]),
    }


def _stops(gradients: Sequence[Gradient], of: Property) -> Thing:
    """Colours as offset, red, green, blue; where any is clear, then offset, alpha of all."""
    gradients = finer(gradients)
    clear = any((gradient.colors[:, 3] < 1).any() for gradient in gradients)
    values = []
    for gradient in gradients:
        colors = np.column_stack([gradient.offsets, gradient.colors[:, :3]]).ravel()
        alphas = np.column_stack([gradient.offsets, gradient.colors[:, 3]]).ravel()
        values.append(np.round(np.concatenate([colors, alphas] if clear else [colors]), 4).tolist())
    return {"g": {"p": len(gradients[0].offsets), "k": of(values)}, "o": {"a": 0, "k": 100}}


def _oval(drawn: Sequence[DrawnPath], of: Property) -> Thing:
    """A fill with a radial gradient: in a group that stretches a circle of fixed size to the oval of each frame."""
    points = np.stack([path.points for path in drawn])
    gradients = padded([path.fill for path in drawn], points)
    way = round_of(gradients)
    unit = float(np.ceil(way.scale.max()))  # never stretched, so that hundredths stay fine enough
    count = len(drawn)
    circle = _circle(np.zeros((count, 2)), np.full(count, unit), way.focus, np.zeros(count), of)
    rule = {"r": 2 if drawn[0].evenodd else 1}
    fill = {"ty": "gf", **circle, **_stops(gradients, of), **rule}
    place = _still() | {
        "ty": "tr",
        "p": of(_pixels(grains(way.center))),
        "r": of([[_short(degrees)] for degrees in np.degrees(way.angle)]),
        "s": of([[_short(100 * x / unit), _short(100 * y / unit)] for x, y in way.scale]),
    }
    return {"ty": "gr", "nm": "fill", "it": [*_outlines(drawn[0], unit * way.inside(points), of), fill, place]}


def _property(values: Sequence[list[Any]], frames: list[float], stepped: bool) -> Thing:
    """T values as key frames: holds where nothing changes, or straight ways; no way out of the last."""
    keys = kept(values, stepped)
    if len(keys) == 1:
        value = values[0]
        return {"a": 0, "k": value[0] if len(value) == 1 else value}
    made = []
    for here, after in pairwise(keys):
        key = {"t": frames[here], "s": values[here]}
        if stepped or values[here] == values[after]:
            key["h"] = 1
        else:
            key |= {"o": {"x": 0, "y": 0}, "i": {"x": 1, "y": 1}}
        made.append(key)
    return {"a": 1, "k": [*made, {"t": frames[keys[-1]], "s": values[keys[-1]]}]}


def _still() -> Thing:
    """A transform that does nothing."""
    return {
        name: {"a": 0, "k": k} for name, k in (("o", 100), ("r", 0), ("p", [0, 0]), ("a", [0, 0]), ("s", [100, 100]))
    }


def _pixels(hundredths: NDArray) -> list[Any]:
    """Whole hundredths as pixels, in the same lists of lists; whole numbers without a fraction."""

    def told(value: Any) -> Any:
        if isinstance(value, list):
            return [told(one) for one in value]
        return value // GRAIN if value % GRAIN == 0 else value / GRAIN

    return told(hundredths.tolist())


def _short(value: float) -> float:
    """A number to four digits after the point."""
    rounded = round(float(value), 4)
    return int(rounded) if rounded.is_integer() else rounded
