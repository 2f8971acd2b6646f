"""An SVG file as plain drawn paths: every shape as cubic curves, in pixels, with its paint and stroke."""

import io
import re
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.motion import affine
from retarget.characters.paths import DrawnPath, Gradient, Paint
from retarget.characters.svgfile import XLINK, open_svg, style, tag

ARC_CURVES = 4
"""Every arc becomes this many curves, whatever its sweep, so that the arcs of all keys correspond."""

FARTHEST = 1e9
"""Pixels from the page's corner, beyond which a shape is a slip, and arithmetic goes wrong."""


def read_svg(path: str | Path, group: str = "") -> tuple[list[DrawnPath], list[str]]:
    """The painted elements of an SVG file, or of its element with an id, back to front, and what could not be drawn.

    Groups, transforms, `use`, the viewBox and style sheets are resolved; one unit is one pixel of the
    file's own size.  A group's opacity is given to its members.
    """
    path = Path(path)
    root, notes = open_svg(path)
    gradients = {
        element.get("id"): element for element in root.iter() if tag(element) in ("linearGradient", "radialGradient")
    }
    document = _understood(root, path)
    drawn = []
    painted = [one for one in document.elements() if one.id == group] if group else document
    try:
        _walk(painted, 1.0, gradients, drawn, notes)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    if not drawn and group:
        raise InputError(f"{path} must paint something in an element with the id {group!r}, it does not: name it so")
    if not drawn:
        raise InputError(f"{path} must hold at least one shape with a fill or a stroke, there is none: draw one")
    return drawn, sorted(set(notes))


def svg_circles(path: str | Path, group: str) -> list[tuple[str, tuple[float, float], str]]:
    """The circles of the group with the id `group`: their ids, middles in pixels, and what `data-parent` says."""
    from svgelements import Circle

    def walk(elements: Any, inside: bool) -> None:
        for element in elements:
            own = getattr(element, "values", {}).get("attributes", {})
            if isinstance(element, Circle):
                if inside and own.get("id"):
                    m, x, y = element.transform, float(element.cx), float(element.cy)
                    place = (m.a * x + m.c * y + m.e, m.b * x + m.d * y + m.f)
                    found.append((str(own["id"]), place, str(own.get("data-parent", ""))))
            elif isinstance(element, list):
                walk(element, inside or own.get("id") == group)

    found: list[tuple[str, tuple[float, float], str]] = []
    root, _ = open_svg(Path(path))
    walk(_understood(root, Path(path)), False)
    return found


def read_page(path: str | Path) -> tuple[tuple[float, float], list[str]]:
    """An SVG file's own width and height in pixels, and the ids of its outermost groups."""
    root, _ = open_svg(Path(path))
    document = _understood(root, Path(path))
    names = [child.get("id", "") for child in root if tag(child) == "g"]
    return (float(document.width or 0), float(document.height or 0)), [name for name in names if name]


def _understood(root: ElementTree.Element, path: Path) -> Any:
    from svgelements import SVG

    try:
        document = SVG.parse(io.BytesIO(ElementTree.tostring(root)), reify=False, ppi=96, color="black")
    except Exception as error:  # the parser raises whatever its guess ran into
        raise InputError(f"{path} must be an SVG drawing, it cannot be understood: {error!r}") from None
    if not isinstance(document, SVG):
        raise InputError(f'{path} must be an SVG drawing, with xmlns="http://www.w3.org/2000/svg": export it again')
    return document


def _walk(
    group: Any, opacity: float, gradients: dict, drawn: list[DrawnPath], notes: list[str], within: tuple[str, ...] = ()
) -> None:
    from svgelements import Shape

    for element in group:
        own = getattr(element, "values", {}).get("attributes", {})
        seen = opacity * _number(own.get("opacity"), 1.0)
        inside = (*within, str(own["id"])) if own.get("id") else within
        if isinstance(element, Shape):
            path = _drawn(element, seen, f"<{own.get('tag', 'path')}> {len(drawn) + 1}", gradients, notes)
            if path is not None:
                drawn.append(replace(path, within=inside))
        elif isinstance(element, list):
            _walk(element, seen, gradients, drawn, notes, inside)


def _drawn(shape: Any, opacity: float, name: str, gradients: dict, notes: list[str]) -> DrawnPath | None:
    values = shape.values
    if values.get("visibility") in ("hidden", "collapse") or opacity <= 0:
        return None
    outline = _outline(shape)
    if outline is None:
        return None
    commands, points, starts, closed = outline
    matrix = shape.transform
    place = np.array([[matrix.a, matrix.c, matrix.e], [matrix.b, matrix.d, matrix.f]], float)
    if not (np.abs(points).max() < FARTHEST and np.abs(place).max() < FARTHEST):
        raise InputError(f"its element {name} must lie within {FARTHEST:g} pixels, it lies beyond: draw it on the page")
    scale = float(np.sqrt(abs(np.linalg.det(place[:, :2]))))
    if values.get("vector-effect") == "non-scaling-stroke":
        scale = 1.0
    fill, stroke = (_paint(shape, which, points, place, gradients, notes) for which in ("fill", "stroke"))
    width = float(shape.stroke_width or 0.0) * scale
    if width <= 0:
        stroke = None
    if fill is None and stroke is None:
        return None
    if own := shape.values.get("attributes", {}).get("id"):
        name = f"{name} ({own})"
    return DrawnPath(
        name=name,
        commands=commands,
        points=affine.apply(place, points),
        starts=starts,
        closed=closed,
        fill=fill,
        stroke=stroke,
        width=width,
        cap=_one_of(values.get("stroke-linecap"), ("butt", "round", "square")),
        join=_one_of(values.get("stroke-linejoin"), ("miter", "round", "bevel")),
        dashes=_dashes(values.get("stroke-dasharray"), scale),
        evenodd=values.get("fill-rule") == "evenodd",
        opacity=min(opacity, 1.0),
    )


def _outline(shape: Any) -> tuple[str, NDArray, NDArray, NDArray] | None:
    """Commands, control points (N, 2), starts (S + 1,) and closed (S,) of a shape in its own units."""
    from svgelements import Arc, Close, CubicBezier, Move, QuadraticBezier

    commands, points, starts, closed = "", [], [], []

    def begin(at: Any) -> None:
        if starts and len(points) == starts[-1] + 1:  # a lone move draws nothing
            points.pop(), starts.pop(), closed.pop()
        starts.append(len(points))
        closed.append(False)
        points.append((at.x, at.y))

    for segment in shape.segments(transformed=False):
        if isinstance(segment, Move):
            commands += "M"
            begin(segment.end)
            continue
        if not starts or closed[-1]:
            begin(segment.start)
        start, end = _xy(segment.start), _xy(segment.end)
        if isinstance(segment, CubicBezier):
            commands += "C"
            points += [_xy(segment.control1), _xy(segment.control2), end]
        elif isinstance(segment, QuadraticBezier):
            commands += "Q"
            control = _xy(segment.control)
            points += [_mix(start, control, 2 / 3), _mix(end, control, 2 / 3), end]
        elif isinstance(segment, Arc):
            commands += "A"
            points += _arc(segment, start, end)
        else:
            commands += "Z" if isinstance(segment, Close) else "L"
            points += [_mix(start, end, 1 / 3), _mix(start, end, 2 / 3), end]
            closed[-1] = isinstance(segment, Close)
    if starts and len(points) == starts[-1] + 1:
        points.pop(), starts.pop(), closed.pop()
    if not starts:
        return None
    return commands, np.array(points, float), np.array([*starts, len(points)]), np.array(closed, bool)


def _xy(point: Any) -> tuple[float, float]:
    return (float(point.x), float(point.y))


def _mix(a: tuple[float, float], b: tuple[float, float], s: float) -> tuple[float, float]:
    return (a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]))


def _arc(arc: Any, start: tuple[float, float], end: tuple[float, float]) -> list[tuple[float, float]]:
    if arc.rx == 0 or arc.ry == 0 or start == end:  # the standard draws a straight line
        thirds = np.arange(1, 3 * ARC_CURVES + 1) / (3 * ARC_CURVES)
        return [_mix(start, end, s) for s in thirds]
    curves = arc.as_cubic_curves(ARC_CURVES)
    return [_xy(point) for curve in curves for point in (curve.control1, curve.control2, curve.end)]


def _paint(
    shape: Any, which: str, points: NDArray, place: NDArray, gradients: dict[str, Any], notes: list[str]
) -> Paint:
    """The colour or gradient of a shape's fill or stroke, opacity of the paint included."""
    text = str(shape.values.get(which) or "none").strip()
    opacity = _number(shape.values.get(f"{which}-opacity"), 1.0)
    link = re.match(r"url\(\s*['\"]?#([^'\")]+)['\"]?\s*\)\s*(.*)", text)
    if link and link[1] in gradients:
        return _gradient(gradients[link[1]], points, place, gradients, opacity, notes)
    if link:
        text = link[2] or "none"
        notes.append(f"{which} #{link[1]} is left out")
    elif text.startswith("url("):
        address, _, text = text.partition(")")
        notes.append(f"{address[4:].strip():.60} is left out: nothing outside the drawing is fetched")
        text = text.strip() or "none"
    return _color(text, opacity)


def _color(text: str, opacity: float) -> NDArray | None:
    from svgelements import Color

    if text in ("none", "transparent"):
        return None
    try:
        color = Color(text)
    except ValueError:
        color = Color("black")
    if color.value is None:
        return None
    alpha = color.alpha / 255 * opacity
    return np.array([color.red / 255, color.green / 255, color.blue / 255, alpha]) if alpha > 0 else None


def _gradient(
    element: Any, points: NDArray, place: NDArray, gradients: dict[str, Any], opacity: float, notes: list[str]
) -> Paint:
    """A gradient on a shape of control points (N, 2) in units that `place` brings to the drawing."""
    from svgelements import Matrix

    chain = [element]
    while (link := chain[-1].get(XLINK) or chain[-1].get("href")) and link[1:] in gradients:
        if gradients[link[1:]] in chain:
            break
        chain.append(gradients[link[1:]])

    def get(name: str, default: str) -> str:
        return next((one.get(name) for one in chain if one.get(name) is not None), default)

    stops = next((found for one in chain if (found := [s for s in one if tag(s) == "stop"])), [])
    if not stops:
        return None
    offsets = np.maximum.accumulate(np.clip([_number(stop.get("offset"), 0.0) for stop in stops], 0, 1))
    colors = np.array([_stop_color(stop, opacity) for stop in stops])
    if len(stops) == 1 or not colors[:, 3].any():
        return colors[0] if colors[:, 3].any() else None
    boxed = get("gradientUnits", "objectBoundingBox") == "objectBoundingBox"
    if boxed:
        low, size = points.min(axis=0), np.ptp(points, axis=0)
        if not size.all():
            return None
        place = affine.compose(place, np.column_stack([np.diag(size), low]))
    own = Matrix(get("gradientTransform", ""))
    place = affine.compose(place, np.array([[own.a, own.c, own.e], [own.b, own.d, own.f]], float))
    focus = None
    if tag(element) == "linearGradient":
        x1, y1, x2, y2 = (
            _number(get(name, "100%" if name == "x2" else "0%"), 0.0) for name in ("x1", "y1", "x2", "y2")
        )
        unit = np.array([[x2 - x1, y1 - y2, x1], [y2 - y1, x2 - x1, y1]])
    else:
        cx, cy, r = (_number(get(name, "50%"), 0.5) for name in ("cx", "cy", "r"))
        fx, fy = _number(get("fx", str(cx)), cx), _number(get("fy", str(cy)), cy)
        if r <= 0:
            return colors[-1]
        unit = np.array([[r, 0, cx], [0, r, cy]])
        focus = np.array([fx - cx, fy - cy]) / r
        if (far := np.linalg.norm(focus)) > 0.99:
            focus = focus * (0.99 / far)
    if not boxed and "%" in "".join(get(name, "") for name in ("x1", "y1", "x2", "y2", "cx", "cy", "r")):
        notes.append("a gradient in percent of the page is placed by numbers only")
    return Gradient(offsets, colors, affine.compose(place, unit), focus, get("spreadMethod", "pad"))


def _stop_color(stop: Any, opacity: float) -> NDArray:
    own = style(stop)
    color = own.get("stop-color", stop.get("stop-color", "black"))
    alpha = _number(own.get("stop-opacity", stop.get("stop-opacity")), 1.0) * opacity
    found = _color(color, 1.0)
    return np.zeros(4) if found is None else found * [1, 1, 1, alpha]


def _number(text: Any, default: float) -> float:
    """A number or percentage (as a share of 1); anything else is the default."""
    match = re.match(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(%?)", str(text))
    if not match:
        return default
    return float(match[1]) / (100 if match[2] else 1)


def _one_of(text: str | None, known: tuple[str, ...]) -> str:
    return text if text in known else known[0]


def _dashes(text: str | None, scale: float) -> tuple[float, ...]:
    numbers = [float(number) * scale for number in re.findall(r"[\d.]+", text or "")]
    if not numbers or sum(numbers) <= 0:
        return ()
    return tuple(numbers if len(numbers) % 2 == 0 else numbers * 2)
