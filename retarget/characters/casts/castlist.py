"""The records of a cast: which character plays which part.  `castfile` says what each field means."""

from dataclasses import dataclass, field
from pathlib import Path


@dataclass(frozen=True)
class CastKey:
    """The drawing of one key; an outline, in its pixels, is for pictures, morph targets and poses are for models."""

    name: str
    drawing: str = ""
    outline: tuple[tuple[float, float], ...] = ()
    morphs: dict[str, float] = field(default_factory=dict)
    animation: str = ""
    time: float = 0.0
    joints: dict[str, tuple[float, float, float]] = field(default_factory=dict)


@dataclass(frozen=True)
class CastPart:
    """Who plays one part, and how."""

    name: str
    keys: tuple[CastKey, ...] = ()
    drawing: str = ""
    between: str = "rigid"
    height: float = 1.0
    pivot: tuple[float, ...] | None = None
    box: tuple[float, float, float, float] | None = None
    plane: str | tuple[float, float, float] = "xy"
    depth: str = "kept"
    distance: float | None = None
    carried: bool = False
    order: int | None = None


@dataclass(frozen=True)
class CastLimb:
    """Where a part is on a body's one drawing."""

    name: str
    line: tuple[tuple[float, float], ...] = ()
    region: tuple[tuple[float, float], ...] = ()
    pivot: tuple[float, float] | None = None
    elements: tuple[str, ...] = ()


@dataclass(frozen=True)
class CastBody:
    """One drawing that plays several parts; all of the motion's without any."""

    drawing: str
    parts: tuple[CastLimb, ...] = ()
    between: str = "rigid"
    height: float = 1.0
    seam: float | None = None
    frame: int | None = None
    turned: bool = False
    box: tuple[float, float, float, float] | None = None
    plane: str | tuple[float, float, float] = "xy"
    depth: str = "kept"
    order: int | None = None


@dataclass(frozen=True)
class CastKeep:
    """A point of a part that stays in a place."""

    part: str
    frames: tuple[int, int] | None = None
    point: tuple[float, ...] = ()
    at: tuple[float, float] | None = None
    bend: tuple[str, ...] | None = None
    stretch: float = 0.0


@dataclass(frozen=True)
class Cast:
    """The characters of a performance; drawings are found from `folder`."""

    parts: tuple[CastPart, ...] = ()
    background: str = ""
    folder: Path = field(default=Path(), compare=False)
    ground: bool = True
    follow: tuple[tuple[float, float], ...] = ()
    keep: tuple[CastKeep, ...] = ()
    bodies: tuple[CastBody, ...] = ()


def files_of(cast: Cast) -> list[Path]:
    """All files that a cast names."""
    names = [cast.background, *(body.drawing for body in cast.bodies)]
    names += [name for part in cast.parts for name in (part.drawing, *(key.drawing for key in part.keys))]
    return [cast.folder / name for name in names if name]
