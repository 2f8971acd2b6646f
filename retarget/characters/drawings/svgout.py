"""Drawn paths as an SVG file that `svg.read_svg` gives back: for animators to correct in their own program.

Every curve is written as a cubic with all its digits, whatever command drew it, so that key drawings keep the same
elements and commands however they are bent.
"""

from collections.abc import Sequence
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from capture.files import written_beside
from retarget.characters.drawings.paths import DrawnPath, Gradient, Paint

EXACT = 1e-9
"""Of its path's size: a closing line this near to straight is left to the Z, which draws it."""


def write_keys(
    files: Sequence[str | Path | None], versions: Sequence[Sequence[DrawnPath]], size: tuple[float, float]
) -> None:
    """One drawing in K keys as a file each, of the same elements and commands, on pages of the same size (pixels).

    A key whose file is None is not written; the others are as if it were.
    """
    for file, text in zip(files, texts(versions, size), strict=True):
        if file is not None:
            with written_beside(file) as temporary:
                Path(temporary).write_text(text, encoding="utf-8")


def texts(versions: Sequence[Sequence[DrawnPath]], size: tuple[float, float]) -> list[str]:
    """The same drawing in K keys as SVG text."""
    width, height = (_number(length) for length in size)
    head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}">'
    bent = [_bent_closings(of_keys) for of_keys in zip(*versions, strict=True)]
    names = _ids(versions[0])
    made = []
    for drawn in versions:
        lines = [_element(path, number, names[number], bent[number]) for number, path in enumerate(drawn)]
        made.append("\n".join([head, *lines, "</svg>", ""]))
    return made


def _bent_closings(of_keys: Sequence[DrawnPath]) -> list[bool]:
    """For each subpath whether its closing line is bent in some key, and must be drawn as a curve in all of them."""
    first, bent = of_keys[0], []
    for b, closed in zip(first.starts[1:], first.closed, strict=True):
        lines = np.stack([path.points[b - 4 : b] for path in of_keys])
        even = lines[:, :1] + np.arange(4)[:, None] / 3 * (lines[:, 3:] - lines[:, :1])
        size = max(np.ptp(path.points, axis=0).max() for path in of_keys)
        bent.append(bool(closed) and bool(np.abs(lines - even).max() > EXACT * size))
    return bent


def _element(path: DrawnPath, number: int, name: str, bent: list[bool]) -> str:
    gradients, marks = "", {"id": name, "d": _outline(path, bent)}
    for which in ("fill", "stroke"):
        paint = getattr(path, which)
        if isinstance(paint, Gradient):
            key = f"{which}-of-{number}"
            gradients += _gradient(paint, key)
            marks[which] = f"url(#{key})"
        else:
            marks |= _color(paint, which, f"{which}-opacity")
    if path.stroke is not None:
        marks |= {"stroke-width": _number(path.width), "stroke-linecap": path.cap, "stroke-linejoin": path.join}
        marks["stroke-dasharray"] = " ".join(_number(length) for length in path.dashes)
    marks["fill-rule"] = "evenodd" if path.evenodd else ""
    marks["opacity"] = _number(path.opacity) if path.opacity < 1 else ""
    return gradients + _tag("path", marks)


def _ids(drawn: Sequence[DrawnPath]) -> list[str]:
    """The ids that paths had where they came from, which `read_svg` puts behind their names; none twice."""
    ids = [path.name.partition(" (")[2].removesuffix(")") for path in drawn]
    return [name if ids.count(name) == 1 else "" for name in ids]


def _outline(path: DrawnPath, bent: list[bool]) -> str:
    words = []
    for a, b, closed, curved in zip(path.starts[:-1], path.starts[1:], path.closed, bent, strict=True):
        last = b if curved or not closed else b - 3
        words.append(f"M{_pair(path.points[a])}")
        words += [" ".join(["C", *map(_pair, path.points[n : n + 3])]) for n in range(a + 1, last, 3)]
        words += ["Z"] if closed else []
    return " ".join(words)


def _color(paint: Paint, name: str, opacity: str) -> dict[str, str]:
    if paint is None:
        return {name: "none"}
    red, green, blue = np.round(255 * np.clip(paint[:3], 0, 1)).astype(int)
    return {name: f"#{red:02x}{green:02x}{blue:02x}", opacity: _number(paint[3]) if paint[3] < 1 else ""}


def _gradient(gradient: Gradient, key: str) -> str:
    stops = ""
    for offset, color in zip(gradient.offsets, gradient.colors, strict=True):
        stops += _tag("stop", {"offset": _number(offset), **_color(color, "stop-color", "stop-opacity")})
    place = f"matrix({' '.join(_number(value) for value in gradient.place.T.ravel())})"
    shared = {"id": key, "gradientUnits": "userSpaceOnUse", "gradientTransform": place, "spreadMethod": gradient.spread}
    if gradient.focus is None:
        return _tag("linearGradient", shared | {"x1": "0", "y1": "0", "x2": "1", "y2": "0"}, stops)
    fx, fy = (_number(value) for value in gradient.focus)
    return _tag("radialGradient", shared | {"cx": "0", "cy": "0", "r": "1", "fx": fx, "fy": fy}, stops)


def _tag(name: str, marks: dict[str, str], inside: str = "") -> str:
    text = "".join(f" {mark}={quoteattr(value)}" for mark, value in marks.items() if value)
    return f"<{name}{text}>{inside}</{name}>" if inside else f"<{name}{text}/>"


def _pair(point: NDArray) -> str:
    return f"{_number(point[0])},{_number(point[1])}"


def _number(value: float) -> str:
    """A number with all the digits that tell it from its neighbours, or nearly."""
    return f"{float(value):.10g}"
