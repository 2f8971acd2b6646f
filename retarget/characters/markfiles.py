"""Marked joints in files: AnimatedDrawings' own annotations, circles in an SVG, and our own beside any picture.

    char_cfg.yaml                        beside texture.png and mask.png, as AnimatedDrawings writes them

    <g id="joints" visibility="hidden">
      <circle id="left_elbow" cx="120" cy="80" r="4" data-parent="left_shoulder"/>

    drawing = "bear.jpg"                 # NAME.marks.toml: a picture or an SVG, named from here
    box = [40, 20, 300, 480]             # x, y, width, height: cuts a photograph out of its background

    [joints]
    left_elbow = [120, 80]
    tail = { at = [60, 200], parent = "root" }

Joints that are called as AnimatedDrawings calls them need no parents to be given.
"""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from capture.errors import InputError
from capture.files import written_beside
from mocap.marks import Marks, check
from retarget.characters.marked import MarkedDrawing, MarkedPicture
from retarget.characters.photo import cut_out, read_photo

HANGS_ON = {
    "hip": "root", "torso": "hip", "neck": "torso", "head": "neck",
    "right_shoulder": "torso", "right_elbow": "right_shoulder", "right_hand": "right_elbow",
    "left_shoulder": "torso", "left_elbow": "left_shoulder", "left_hand": "left_elbow",
    "right_hip": "root", "right_knee": "right_hip", "right_foot": "right_knee", "right_toe": "right_foot",
    "left_hip": "root", "left_knee": "left_hip", "left_foot": "left_knee", "left_toe": "left_foot",
}  # fmt: skip
"""What joints hang on where nothing else is said: AnimatedDrawings' figure, with toes."""


def read_marked(path: str | Path) -> MarkedPicture | MarkedDrawing:
    """A drawing with its marked joints: a folder of AnimatedDrawings or its char_cfg.yaml, or an SVG with circles."""
    path = Path(path)
    if path.is_dir():
        path = path / "char_cfg.yaml"
    if path.suffix.lower() == ".svg":
        return _read_svg(path)
    if path.suffix.lower() in (".yaml", ".yml"):
        return _read_annotated(path)
    if path.name.lower().endswith(".marks.toml"):
        return _read_marks(path)
    raise InputError(
        "a drawing with marked joints must be an SVG with circles, a folder with char_cfg.yaml, or a *.marks.toml that "
        f"names a picture, {path} is neither"
    )


def write_marks(marks: Marks, drawing: str | Path, path: str | Path) -> None:
    """Marks of a picture or an SVG as a *.marks.toml; `drawing` is named from the new file's folder."""
    lines = [f"drawing = {json.dumps(str(drawing))}", "", "[joints]"]
    for name, parent, (x, y) in zip(marks.names, marks.parents, marks.places.tolist(), strict=True):
        up = f", parent = {json.dumps(marks.names[parent])}" if parent >= 0 else ""
        lines.append(f"{json.dumps(name)} = {{ at = [{x!r}, {y!r}]{up} }}")
    with written_beside(path) as temporary:
        Path(temporary).write_text("\n".join(lines) + "\n", encoding="utf-8")


def marks_of(joints: dict[str, tuple[float, float]], parents: dict[str, str | None], name: str) -> Marks:
    """Marks from places and parents by name; a joint without a parent said hangs where its name says."""
    above: dict[str, str | None] = {}
    for joint in joints:
        up = parents.get(joint) or HANGS_ON.get(joint)
        while up is not None and up not in joints:  # what is not marked is passed over
            up = HANGS_ON.get(up)
        above[joint] = up
    order: list[str] = []
    while len(order) < len(joints):
        ready = [joint for joint in joints if joint not in order and above[joint] in (None, *order)]
        if not ready:
            raise InputError(f"{name}: its joints must not hang on each other in a circle: mend their parents")
        order += ready
    loose = [joint for joint in order if above[joint] is None]
    if len(loose) > 1:
        raise InputError(f"{name}: all joints but one must hang on another, {' and '.join(loose[:3])} hang on none")
    numbers = tuple(-1 if above[joint] is None else order.index(above[joint]) for joint in order)
    places = np.array([joints[joint] for joint in order], float).reshape(-1, 2)
    return check(Marks(tuple(order), numbers, places), name)


def _read_svg(path: Path) -> MarkedDrawing:
    from retarget.characters.svg import read_svg, svg_circles

    drawn, _ = read_svg(path)
    circles = svg_circles(path, "joints")
    if not circles:
        raise InputError(
            f'{path} must have its joints marked by circles with ids in a group <g id="joints">, it has none'
        )
    joints = {name: place for name, place, _ in circles}
    parents = {name: parent for name, _, parent in circles if parent}
    shown = [
        one for one in drawn if not (one.name.startswith("<circle>") and one.name.rpartition("(")[2][:-1] in joints)
    ]
    return MarkedDrawing(marks_of(joints, parents, str(path)), tuple(shown))


def _read_marks(path: Path) -> MarkedPicture | MarkedDrawing:
    import msgspec

    from retarget.characters.svg import read_svg

    try:
        told = msgspec.toml.decode(path.read_bytes())
        joints = {name: one if isinstance(one, dict) else {"at": one} for name, one in told["joints"].items()}
        places = {name: tuple(float(number) for number in one["at"]) for name, one in joints.items()}
        if any(len(place) != 2 for place in places.values()):
            raise ValueError("a joint must be at two numbers")
        drawing, box = path.parent / told["drawing"], tuple(float(edge) for edge in told.get("box", ()))
        if len(box) not in (0, 4):
            raise ValueError("box must be x, y, width and height")
    except FileNotFoundError:
        raise InputError(f"a drawing's marks must be a file that exists: there is no {path}") from None
    except (OSError, LookupError, TypeError, ValueError, AttributeError, msgspec.MsgspecError) as error:
        raise InputError(f"{path} must name a drawing and its joints, it cannot be read: {error}") from None
    marks = marks_of(places, {name: one.get("parent") for name, one in joints.items()}, str(path))
    if drawing.suffix.lower() == ".svg":
        return MarkedDrawing(marks, tuple(read_svg(drawing)[0]))
    photo = read_photo(drawing)
    photo = cut_out(photo, box, str(drawing)) if box else photo
    return MarkedPicture(replace(marks, places=photo.from_own(marks.places)), photo.pixels)


def _read_annotated(path: Path) -> MarkedPicture:
    try:
        told = _yaml(path.read_text(encoding="utf-8"))
        places = {str(joint["name"]): tuple(float(number) for number in joint["loc"]) for joint in told["skeleton"]}
        parents = {str(joint["name"]): joint.get("parent") for joint in told["skeleton"]}
        if any(len(place) != 2 for place in places.values()):
            raise ValueError("a joint's loc must be two numbers")
    except FileNotFoundError:
        raise InputError(f"a drawing's annotations must be a file that exists: there is no {path}") from None
    except (OSError, LookupError, TypeError, ValueError, AttributeError) as error:
        raise InputError(f"{path} must be AnimatedDrawings' char_cfg.yaml, it cannot be read: {error}") from None
    marks = marks_of(places, parents, str(path))
    pixels = read_photo(path.parent / "texture.png").pixels
    mask = path.parent / "mask.png"
    if mask.is_file():
        inside = read_photo(mask).pixels
        if inside.shape != pixels.shape:
            raise InputError(f"{mask} must be as large as texture.png beside it: export it again")
        pixels = np.dstack([pixels[..., :3], np.minimum(inside[..., 0], inside[..., 3])])
    return MarkedPicture(marks, pixels)


def _yaml(text: str) -> dict[str, Any]:
    """The little of YAML that char_cfg.yaml is written in: maps and lists by indentation, numbers and plain words."""
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    value, rest = _block([(len(line) - len(line.lstrip()), line.strip()) for line in lines])
    if rest or not isinstance(value, dict):
        raise ValueError("it is no map of names")
    return value


def _block(lines: list[tuple[int, str]]) -> tuple[Any, list[tuple[int, str]]]:
    """The value that the first lines make up, and the lines after it."""
    indent, first = lines[0]
    if first.startswith("- ") or first == "-":
        items = []
        while lines and lines[0][0] == indent and (lines[0][1].startswith("- ") or lines[0][1] == "-"):
            inner = lines[0][1][1:].strip()
            lines = ([(indent + 2, inner)] if inner else []) + lines[1:]
            if ":" in inner or not inner:
                item, lines = _block(lines)
            else:
                item, lines = _scalar(inner), lines[1:]
            items.append(item)
        return items, lines
    found: dict[str, Any] = {}
    while lines and lines[0][0] == indent and not lines[0][1].startswith("- "):
        name, colon, tail = lines[0][1].partition(":")
        if not colon:
            raise ValueError(f"{lines[0][1]!r} is no name with a value")
        lines, tail = lines[1:], tail.strip()
        if tail:
            found[name.strip()] = _scalar(tail)
        elif lines and (lines[0][0] > indent or (lines[0][0] == indent and lines[0][1].startswith("- "))):
            found[name.strip()], lines = _block(lines)
        else:
            found[name.strip()] = None
    return found, lines


def _scalar(text: str) -> Any:
    if text.startswith("[") and text.endswith("]"):
        return [_scalar(item.strip()) for item in text[1:-1].split(",") if item.strip()]
    if text in ("null", "~", "Null", "NULL"):
        return None
    try:
        return float(text)
    except ValueError:
        return text.strip("'\"")
