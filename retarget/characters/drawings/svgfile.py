"""An SVG file as a tree that is safe to look at: nothing in it runs, nothing is fetched, and nothing goes on for ever.

What cannot be drawn is taken out and told.  A drawing that would take minutes to learn is refused before it is looked
at closely; what counts is what it comes to once every `use` is followed, for ten that use ten others make a hundred.
"""

import re
from pathlib import Path
from xml.etree import ElementTree

from capture.errors import InputError

MOST = 20_000
"""Curves of a drawing, each `use` counted; to learn so many takes about a quarter of a minute."""

DEEPEST = 200
"""Groups within groups, each `use` counted as one."""

XLINK = "{http://www.w3.org/1999/xlink}href"

_LEFT_OUT = ("text", "image", "mask", "marker", "foreignObject", "pattern", "filter", "flowRoot", "script")
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_NUMBERS_OF = {"M": 2, "L": 2, "T": 2, "H": 1, "V": 1, "C": 6, "S": 4, "Q": 4, "A": 7 / 4}  # an arc becomes four
_CURVES_OF = {"rect": 20, "circle": 16, "ellipse": 16, "line": 1}


def open_svg(path: Path) -> tuple[ElementTree.Element, list[str]]:
    """The tree of an SVG file without what cannot be drawn, and notes on what that was."""
    try:
        root = ElementTree.fromstring(path.read_bytes())
    except OSError as error:
        raise InputError(f"a drawing must be a file that can be read: {path} ({error.strerror})") from None
    except (ElementTree.ParseError, ValueError, LookupError) as error:  # the last is of an unknown encoding
        raise InputError(f"{path} must be an SVG drawing, it is not well-formed: {error}") from None
    if tag(root) != "svg":
        raise InputError(f"{path} must be an SVG drawing, its first element is <{tag(root)}>")
    notes = [*_leave_out(root), *_stay_inside(root)]
    _check_size(root, path)
    return root, notes


def tag(element: ElementTree.Element) -> str:
    """The name of an element without its namespace."""
    return str(element.tag).rsplit("}", 1)[-1]


def style(element: ElementTree.Element) -> dict[str, str]:
    """What an element's `style` says."""
    pairs = [item.split(":", 1) for item in (element.get("style") or "").split(";") if ":" in item]
    return {name.strip(): value.strip() for name, value in pairs}


def _leave_out(root: ElementTree.Element) -> list[str]:
    """Take what cannot be drawn out of the tree and say what it was."""
    notes = []
    for parent in root.iter():
        for child in list(parent):
            if tag(child) in _LEFT_OUT:
                parent.remove(child)
                silent = tag(child) in ("pattern", "filter", "marker", "mask")  # noted where they are used
                if not silent and not child.get("requiredExtensions"):  # a program's own store, in every file of some
                    notes.append("scripts are left out" if tag(child) == "script" else f"<{tag(child)}> is not drawn")
    for element in root.iter():
        own = style(element)
        for name in ("clip-path", "mask", "filter", "marker-end", "marker-start", "marker-mid"):
            value = element.get(name) or own.get(name)
            if value and value != "none":
                notes.append(f"{name} is left out")
        scripts = [name for name in element.attrib if name.lower().startswith("on")]
        for name in scripts:
            del element.attrib[name]
        notes += ["scripts are left out"] * bool(scripts)
    return notes


def _stay_inside(root: ElementTree.Element) -> list[str]:
    """Take out whatever names another file or an address: nothing is ever fetched."""
    outside = []
    for parent in root.iter():
        if tag(parent) == "style" and parent.text:
            outside += re.findall(r"@import[^;]*;?", parent.text)
            parent.text = re.sub(r"@import[^;]*;?", "", parent.text)
        for child in list(parent):
            link = child.get("href") or child.get(XLINK) or ""
            if tag(child) in ("use", "linearGradient", "radialGradient") and link and not link.startswith("#"):
                outside.append(link)
                if tag(child) == "use":
                    parent.remove(child)
    return [f"{what.strip():.60} is left out: nothing outside the drawing is fetched" for what in outside]


def _check_size(root: ElementTree.Element, path: Path) -> None:
    """Refuse a drawing of too many curves or too deep groups, and one that uses itself."""
    named = {element.get("id"): element for element in root.iter() if element.get("id")}
    known: dict[ElementTree.Element, tuple[float, int]] = {}
    opened: set[ElementTree.Element] = set()

    def size(element: ElementTree.Element, above: int) -> tuple[float, int]:
        """Curves in an element, and groups in groups."""
        if element in known:
            return known[element]
        if above > DEEPEST:
            raise _too_deep(path)
        if element in opened:
            raise InputError(f"{path} must hold no <use> of what that <use> is in, it does: take it out")
        opened.add(element)
        inside = list(element)
        link = (element.get("href") or element.get(XLINK) or "")[1:]
        if tag(element) == "use" and link in named:
            inside.append(named[link])
        sizes = [size(child, above + 1) for child in inside]
        opened.remove(element)
        known[element] = _curves(element) + sum(s[0] for s in sizes), 1 + max((s[1] for s in sizes), default=0)
        return known[element]

    curves, depth = size(root, 0)
    if depth > DEEPEST:
        raise _too_deep(path)
    if curves > MOST:
        raise InputError(
            f"{path} must have at most {MOST} curves, each <use> counted, it has about {curves:.0f}: simplify its "
            "paths (in Inkscape: Path > Simplify), or play it as a picture (PNG)"
        )


def _too_deep(path: Path) -> InputError:
    return InputError(f"{path} must have groups at most {DEEPEST} deep, each <use> counted, it has more: ungroup them")


def _curves(element: ElementTree.Element) -> float:
    """About how many curves a shape is made of."""
    if tag(element) == "path":
        pieces = re.findall(r"([A-DF-Za-df-z])([^A-DF-Za-df-z]*)", element.get("d") or "")
        return sum(max(1.0, len(_NUMBER.findall(text)) / _NUMBERS_OF.get(kind.upper(), 2)) for kind, text in pieces)
    if tag(element) in ("polygon", "polyline"):
        return len(_NUMBER.findall(element.get("points") or "")) / 2
    return _CURVES_OF.get(tag(element), 0)
