"""SVG: a performance as one animated drawing for web pages, or as a folder of drawings, one a frame.

The animated file is SMIL, which browsers play in a page and in an <img> alike: every painted element is one path whose
`d`, colours, widths and gradients have a value for each new drawing.  Programs that know no SMIL, such as Inkscape and
Illustrator, show the first frame.  Held drawings, as on twos, jump from one to the next; anything else moves on
smoothly between frames, and meets every one of them exactly.

A picture that keeps its shape lies in the file once and is moved; one that bends is refused, or drawn in each frame of
a folder.

Coordinates are kept to a hundredth of a pixel and written against the point before: a drawing of 40 curves takes
about a kilobyte a frame.
"""

import base64
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from capture.files import folder_written_beside, written_beside
from retarget.characters.drawings.paths import DrawnPath, Gradient, Paint
from retarget.export.elements import GRAIN, Element, Layer, Page, grains, kept, one_frame, page_of, refused
from retarget.export.gradients import line_of, round_of
from retarget.export.stills import Still, still_of
from retarget.stage.draw2d import draw_things
from retarget.stage.perform import Performance

Curves = dict[str, list[str]]  # an attribute's value in every frame

# What an element is when an attribute is not there; such curves are not written.
PLAIN = {
    "fill-opacity": "1",
    "stroke-opacity": "1",
    "stop-opacity": "1",
    "opacity": "1",
    "visibility": "visible",
    "stroke-linecap": "butt",
    "stroke-linejoin": "miter",
    "spreadMethod": "pad",
}


EARLY = 1e-5
"""Seconds that a held drawing comes before its time."""


def write_svg(performance: Performance, path: str | Path, width: int | None = None, background: Any = None) -> None:
    """A performance as one animated *.svg file, its stage's size or `width` pixels wide, over a colour or nothing."""
    text = _document(page_of(performance, width, background))
    with written_beside(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def write_svg_frames(
    performance: Performance, folder: str | Path, width: int | None = None, background: Any = None
) -> int:
    """A performance as drawings 0000.svg, 0001.svg, ... in a folder; returns how many.

    Pictures that bend are drawn pixel by pixel and lie in the drawing as PNG.
    """
    with folder_written_beside(folder) as temporary:
        for t in range(len(performance.times)):
            page = page_of(one_frame(performance, t), width, background)
            (temporary / f"{t:04d}.svg").write_text(_document(page), encoding="utf-8")
    return len(performance.times)


def _document(page: Page) -> str:
    width, height = page.size
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}">',
    ]
    if page.background:
        lines.append(f'<rect width="100%" height="100%" fill="{page.background}"/>')
    for number, layer in enumerate(page.layers):
        lines.append(_group(layer, page, f"g{number}"))
    return "\n".join([*lines, "</svg>\n"])


def _group(layer: Layer, page: Page, key: str) -> str:
    inside = []
    for number, element in enumerate(layer.elements):
        drawn = element.drawn[0]
        if isinstance(drawn, DrawnPath):
            inside.append(_path(element, page, layer.stepped, f"{key}-{number}"))
        elif len(element.drawn) == 1:
            inside.append(_image(drawn, page.size))
        elif still := still_of(element):
            inside.append(_still(still, page, layer.stepped))
        else:
            raise refused(layer, "an animated SVG")
    seen = {"data-name": [layer.name], "visibility": ["visible" if seen else "hidden" for seen in layer.visible]}
    return _tag("g", seen, page, True, "\n".join(["", *inside, ""]))


def _path(element: Element, page: Page, stepped: bool, key: str) -> str:
    """An element as a path, after the gradients it is painted with."""
    first = element.drawn[0]
    curves: Curves = {"data-name": [element.name], "d": outlines(element.drawn)}
    gradients = ""
    for which in ("fill", "stroke"):
        paint = getattr(first, which)
        if isinstance(paint, Gradient):
            name = f"{key}-{which}"
            gradients += _gradient(element.curve(which), name, page, stepped)
            curves[which] = [f"url(#{name})"]
        elif paint is None:
            curves[which] = ["none"] if which == "fill" else []
        else:
            curves |= _color(element.curve(which), which, f"{which}-opacity")
    if first.evenodd:
        curves["fill-rule"] = ["evenodd"]
    if first.stroke is not None:
        curves["stroke-width"] = lengths(element.curve("width"))
        curves["stroke-linecap"], curves["stroke-linejoin"] = [first.cap], [first.join]
        if first.dashes:
            curves["stroke-dasharray"] = [" ".join(lengths(dashes)) for dashes in element.curve("dashes")]
    curves["opacity"] = [_number(opacity) for opacity in element.curve("opacity")]
    return gradients + _tag("path", curves, page, stepped)


def outlines(drawn: Sequence[DrawnPath]) -> list[str]:
    """The `d` of a path in T frames, with the same commands in all of them."""
    first = drawn[0]
    points = grains([path.points for path in drawn])  # whole numbers: what is written against the last does not drift
    texts = [""] * len(drawn)
    for a, b, closed in zip(first.starts[:-1], first.starts[1:], first.closed, strict=True):
        controls = points[:, a + 1 : b].reshape(len(drawn), -1, 3, 2)
        ends = np.concatenate([points[:, a : a + 1], controls[:, :-1, 2]], axis=1)
        steps = (controls - ends[:, :, None]).reshape(len(drawn), -1)
        for t, (start, step) in enumerate(zip(points[:, a].tolist(), steps.tolist(), strict=True)):
            texts[t] += f"M{_joined(start)}c{_joined(step)}{'z' if closed else ''}"
    return texts


def lengths(values: Any) -> list[str]:
    """Lengths in pixels as text, to a hundredth."""
    return [_hundredths(value) for value in grains(values).tolist()]


def _joined(hundredths: list[int]) -> str:
    """Numbers as short as SVG allows: a minus sign parts them too."""
    text = "".join(f" {_hundredths(value)}" for value in hundredths)
    return text[1:].replace(" -", "-")


def _hundredths(value: int) -> str:
    """A number of hundredths as text: 1250 is 12.5 and -5 is -.05."""
    whole, rest = divmod(abs(value), GRAIN)
    text = f"{whole or ''}.{rest:02d}".rstrip("0").rstrip(".") if rest else str(whole)
    return f"-{text}" if value < 0 else text


def _number(value: float, digits: int = 4) -> str:
    return f"{float(value):.{digits}f}".rstrip("0").rstrip(".")


def _color(colors: Sequence[Paint], name: str, opacity: str) -> Curves:
    channels = np.round(255 * np.clip(np.stack(colors), 0, 1)[:, :3]).astype(int)
    return {
        name: [f"#{red:02x}{green:02x}{blue:02x}" for red, green, blue in channels.tolist()],
        opacity: [_number(color[3]) for color in colors],
    }


def _gradient(gradients: Sequence[Gradient], key: str, page: Page, stepped: bool) -> str:
    first = gradients[0]
    curves: Curves = {"id": [key], "gradientUnits": ["userSpaceOnUse"], "spreadMethod": [first.spread]}
    stops = ""
    for number in range(len(first.offsets)):
        stop = {"offset": [_number(gradient.offsets[number]) for gradient in gradients]}
        stop |= _color([gradient.colors[number] for gradient in gradients], "stop-color", "stop-opacity")
        stops += _tag("stop", stop, page, stepped)
    if first.focus is None:
        ends = np.stack([line_of(gradient) for gradient in gradients]).reshape(-1, 4)
        curves |= {name: lengths(ends[:, i]) for i, name in enumerate(("x1", "y1", "x2", "y2"))}
        return _tag("linearGradient", curves, page, stepped, stops) + "\n"
    way = round_of(gradients)
    curves |= {name: [value] for name, value in (("cx", "0"), ("cy", "0"), ("r", "1"))}
    curves |= {name: [_number(focus[i]) for focus in way.focus] for i, name in enumerate(("fx", "fy"))}
    moves = {
        "translate": [" ".join(lengths(center)) for center in way.center],
        "rotate": [_number(angle) for angle in np.degrees(way.angle)],
        "scale": [" ".join(lengths(scale)) for scale in way.scale],
    }
    curves["gradientTransform"], moving = _transform("gradientTransform", moves, page, stepped)
    stops += moving
    return _tag("radialGradient", curves, page, stepped, stops) + "\n"


def _transform(attribute: str, moves: Curves, page: Page, stepped: bool) -> tuple[list[str], str]:
    """Moves, the outermost first, as the attribute in the first frame and what animates it."""
    first = [" ".join(f"{kind}({values[0]})" for kind, values in moves.items())]
    if all(len(set(values)) == 1 for values in moves.values()):
        return first, ""
    moving = ""
    for kind, values in moves.items():  # the first takes the place of the attribute, the others go on from there
        more = f'type="{kind}" ' + ('additive="sum" ' if moving else "")
        moving += _animated("animateTransform", attribute, values, page, stepped, more)
    return first, moving


def _still(still: Still, page: Page, stepped: bool) -> str:
    """A picture that keeps its shape: one image, moved."""
    moves = {
        "translate": [" ".join(lengths(corner)) for corner in still.travel],
        "rotate": [_number(angle) for angle in still.turn],
        "skewX": [_number(angle) for angle in still.slant],
        "scale": [f"{_number(x, 6)} {_number(y, 6)}" for x, y in still.stretch],
    }
    place, moving = _transform("transform", moves, page, stepped)
    height, width = still.pixels.shape[:2]
    curves = {"width": [str(width)], "height": [str(height)], "transform": place, "href": [png_of(still.pixels)]}
    return _tag("image", curves, page, stepped, moving)


def png_of(pixels: NDArray) -> str:
    """A picture (h, w, 4) as an address that holds it."""
    import cv2

    png = cv2.imencode(".png", cv2.cvtColor(pixels, cv2.COLOR_RGBA2BGRA))[1].tobytes()
    return f"data:image/png;base64,{base64.b64encode(png).decode()}"


def _tag(name: str, curves: Curves, page: Page, stepped: bool, inside: str = "") -> str:
    """An XML element; an attribute that changes also gets an <animate>."""
    text, moving = f"<{name}", ""
    for attribute, values in curves.items():
        if not values or set(values) == {PLAIN.get(attribute)}:
            continue
        text += f" {attribute}={quoteattr(values[0])}"
        if len(set(values)) > 1:
            moving += _animated("animate", attribute, values, page, stepped)
    inside = moving + inside
    return f"{text}>{inside}</{name}>" if inside else f"{text}/>"


def _animated(tag: str, attribute: str, values: list[str], page: Page, stepped: bool, more: str = "") -> str:
    """One attribute over the whole clip, again and again."""
    keys = kept(values, stepped)
    starts = page.starts[keys]
    if stepped:  # browsers count in whole microseconds: asked for the very time of a frame, they must find it begun
        starts = np.maximum(starts - EARLY, 0)
    times = [_number(time, 7) for time in starts / page.duration]
    shown = [values[t] for t in keys]
    if not stepped:  # the last drawing stays for its own duration
        times, shown = [*times, "1"], [*shown, shown[-1]]
    return (
        f'<{tag} attributeName="{attribute}" {more}dur="{page.duration:.6f}s" repeatCount="indefinite" '
        f'calcMode="{"discrete" if stepped else "linear"}" keyTimes="{";".join(times)}" values="{";".join(shown)}"/>'
    )


def _image(thing: Any, size: tuple[int, int]) -> str:
    """What is no path, drawn at the page's own size, as an image as large as need be."""
    moved = replace(thing, points=thing.points - 0.5)  # it counts from the middle of a pixel
    pixels = draw_things([moved], size)
    rows, columns = np.nonzero(pixels[..., 3])
    if not len(rows):
        return ""
    top, left, bottom, right = rows.min(), columns.min(), rows.max() + 1, columns.max() + 1
    place = f'x="{left}" y="{top}" width="{right - left}" height="{bottom - top}"'
    return f'<image {place} href="{png_of(pixels[top:bottom, left:right])}"/>'
