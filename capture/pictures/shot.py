"""What to capture: the `*.shot.toml` file.  The program writes it; every field has a default.

Frame numbers are the clip's own, counted from 0; points are pixels of that frame.
"""

import json
import tomllib
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError


@dataclass(frozen=True)
class KeyDrawing:
    """One key shape: the frame in which it is drawn, and its outline there.

    Outlines of the same part have the same number of points, and point n is the same place of the character
    in all of them.  Without an outline the matte's own is traced; that is enough for a single key.
    """

    name: str = "rest"
    frame: int = 0
    outline: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True)
class Part:
    """A layer of the cartoon, and how to tell its pixels: by box, colour or scribbles where no outline is given."""

    name: str = "character"
    keys: tuple[KeyDrawing, ...] = (KeyDrawing(),)
    parent: str = ""
    pivot: tuple[float, float] | None = None  # in the first key's frame; its outline's centre if not given
    box: tuple[float, float, float, float] | None = None  # x, y, width, height in the first key's frame
    color: tuple[int, int, int] | None = None  # RGB, in the first key's frame
    inside: tuple[tuple[tuple[float, float], ...], ...] = ()  # scribbles on the layer
    outside: tuple[tuple[tuple[float, float], ...], ...] = ()  # scribbles on the rest
    order: int = 0  # higher is drawn later

    def outlines(self) -> NDArray:
        """Outlines (K, B, 2) of all keys."""
        counts = {len(key.outline) for key in self.keys}
        if len(counts) != 1:
            found = ", ".join(f"{key.name} {len(key.outline)}" for key in self.keys)
            raise InputError(
                f"part {self.name!r}: all keys must have outlines of the same number of points, got {found}"
            )
        return np.array([key.outline for key in self.keys], float)


@dataclass(frozen=True)
class Shot:
    """A clip, or a stretch of it, and the parts to capture in it."""

    clip: str
    parts: tuple[Part, ...] = (Part(),)
    start: int = 0
    stop: int | None = None  # exclusive; the clip's end if not given
    fps: float | None = None  # for clips that carry none, such as a folder of pictures
    tile: tuple[int, int] | None = None  # width and height of a sprite sheet's tiles


def read_shot(path: str | Path) -> Shot:
    """Read `*.shot.toml`; the clip's path is taken relative to the file."""
    import msgspec

    path = Path(path)
    try:
        values = tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(f"a shot file must exist: there is no {path}") from None
    except (OSError, UnicodeDecodeError, RecursionError, tomllib.TOMLDecodeError) as error:
        raise InputError(f"{path} must be a shot file in TOML, it cannot be read: {error}") from None
    if "clip" in values:
        values["clip"] = str(path.parent / str(values["clip"]))
    try:
        return check(msgspec.convert(_without_unknown(values), Shot))
    except msgspec.ValidationError as error:
        raise InputError(f"{path}: {str(error)[:1].lower()}{str(error)[1:]}") from None
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def write_shot(shot: Shot, path: str | Path) -> None:
    """Write `*.shot.toml`, with the clip's path relative to it where that is possible."""
    import os

    from capture.files import written_beside

    path = Path(path)
    values = {name: value for name, value in asdict(shot).items() if name != "parts" and value is not None}
    folder = path.resolve().parent
    clip = Path(shot.clip).resolve()
    values["clip"] = Path(os.path.relpath(clip, folder)).as_posix() if clip.anchor == folder.anchor else str(clip)
    lines = [f"{name} = {_toml(value)}" for name, value in values.items()]
    for part in shot.parts:
        lines += ["", "[[parts]]"]
        for name, value in asdict(part).items():
            if name != "keys" and value is not None and value not in ("", ()):
                lines.append(f"{name} = {_toml(value)}")
        for key in part.keys:
            lines += ["", "[[parts.keys]]", f"name = {_toml(key.name)}", f"frame = {key.frame}"]
            if key.outline:
                lines.append(f"outline = {_toml(key.outline)}")
    with written_beside(path) as temporary:
        Path(temporary).write_text("\n".join(lines) + "\n", encoding="utf-8")


def check(shot: Shot) -> Shot:
    """Refuse a shot whose parts contradict each other; returns it unchanged."""
    names = [part.name for part in shot.parts]
    if not names:
        raise InputError("a shot must have at least one part to capture")
    if len(set(names)) < len(names):
        raise InputError(f"part names must differ, got {', '.join(names)}")
    for part in shot.parts:
        if part.parent and part.parent not in names:
            raise InputError(f"part {part.name!r} hangs on {part.parent!r}, which is none of {', '.join(names)}")
        if part.name in _above(part, shot):
            raise InputError(f"part {part.name!r} must not hang on itself, by way of its parents it does")
        if not np.isfinite([*(part.pivot or ()), *(part.box or ()), *_coordinates(part)]).all():
            raise InputError(f"part {part.name!r}: places must be finite numbers, one of them is not")
        if not part.keys:
            raise InputError(f"part {part.name!r} must have at least one key")
        keys = [key.name for key in part.keys]
        if len(set(keys)) < len(keys):
            raise InputError(f"part {part.name!r}: key names must differ, got {', '.join(keys)}")
        if len(part.keys) > 1:
            part.outlines()
            if not part.keys[0].outline:
                raise InputError(f"part {part.name!r}: a part with several keys needs an outline for each of them")
    return shot


def _above(part: Part, shot: Shot) -> list[str]:
    """The names of a part's parent, the parent's parent and so on; a circle is gone through once."""
    parent_of = {part.name: part.parent for part in shot.parts}
    above = []
    name = part.parent
    while name and name not in above:
        above.append(name)
        name = parent_of.get(name, "")
    return above


def _coordinates(part: Part) -> list[float]:
    """All x and y of a part's outlines and scribbles."""
    lines = [key.outline for key in part.keys] + [*part.inside, *part.outside]
    return [coordinate for line in lines for point in line for coordinate in point]


def _toml(value: object) -> str:
    """A TOML value: text, numbers and nested lists of them."""
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace(
            "\x7f", "\\u007f"
        )  # TOML's escapes are JSON's, but for DEL
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_toml(item) for item in value) + "]"
    if isinstance(value, bool):
        return str(value).lower()
    return str(int(value)) if isinstance(value, int | np.integer) else repr(float(value))


_FIELDS = {"": Shot, "parts": Part, "keys": KeyDrawing}


def _without_unknown(values: dict, level: str = "") -> dict:
    """The values, if every field is one we know; a misspelt field must not be passed over in silence."""
    known = set(_FIELDS[level].__dataclass_fields__)
    unknown = sorted(set(values) - known)
    if unknown:
        raise InputError(f"{unknown[0]!r} is no field here, known are {', '.join(sorted(known))}")
    inner = {"": "parts", "parts": "keys"}.get(level)
    if inner and isinstance(values.get(inner), list):
        for item in values[inner]:
            if isinstance(item, dict):
                _without_unknown(item, inner)
    return values
