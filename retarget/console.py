"""What the commands share: reading flags, saying what a user should know, and refusing to run in a wrong place."""

import sys
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

if TYPE_CHECKING:
    from capture.pictures.clip import Clip
    from capture.pictures.shot import Shot
    from mocap.skeletons.skeleton import SkeletonMotion

Out = Annotated[Path | None, Parameter(name=["--out", "-o"])]
Device = Literal["auto", "cpu", "cuda"]


class Failed(Exception):
    """What a command could not do all of: its closing line, and exit code 1."""


def not_shadowed() -> None:
    """Refuse to run with another project's package in the place of ours: PyPI has a `capture` and a `mocap`."""
    from importlib.util import find_spec

    from capture.errors import InputError

    home = Path(__file__).resolve().parents[1]
    for name in ("capture", "mocap", "fixtures"):
        spec = find_spec(name)
        if spec is None or spec.origin is None or Path(spec.origin).resolve().parents[1] != home:
            where = "nowhere" if spec is None else spec.origin
            raise InputError(
                f"tooncap's own package {name!r} must be the one that is imported, Python finds {where}: uninstall "
                f"the other project named {name!r}, or install tooncap in an environment of its own"
            )


def shot_of(
    source: Path,
    name: str,
    box: tuple[float, float, float, float] | None,
    color: str | None,
    frame: int | None,
    start: int,
    stop: int | None,
    fps: float | None,
    tile: tuple[int, int] | None,
) -> "Shot":
    """The shot that a shot file holds, or that the flags tell of a clip."""
    from capture.errors import InputError
    from capture.pictures.shot import KeyDrawing, Part, Shot, read_shot

    if source.name.endswith(".toml"):
        if any(value is not None for value in (box, color, frame, stop, fps, tile)) or start:
            raise InputError(f"a shot file says itself what to capture: put box, colour and frames into {source}")
        return read_shot(source)
    if box is None and color is None:
        raise InputError(f"a clip needs --box or --color, to say what in {source} to capture; or give a shot file")
    key = KeyDrawing("rest", start if frame is None else frame)
    part = Part(name, (key,), box=box, color=None if color is None else rgb(color))
    return Shot(str(source), (part,), start, stop, fps, tile)


def stem(path: Path) -> str:
    """A file's name without what says its kind: hop.shot.toml, hop.motion.json and hop.mp4 are hop."""
    kinds = (".shot.toml", ".motion.json", ".toml", ".json")
    return next((path.name.removesuffix(kind) for kind in kinds if path.name.endswith(kind)), path.stem)


def device_needs_refine(refine: bool, device: Device) -> None:
    """Refuse a device that nothing would be done on: capture itself takes none."""
    from capture.errors import InputError

    if device != "auto" and not refine:
        raise InputError(
            f"--device says where to refine, and nothing is to be refined: add --refine, or leave {device} out"
        )


def given_files(paths: tuple[Path, ...]) -> list[Path]:
    """The files named, with patterns such as shots/*.toml filled in where no shell did it."""
    from glob import glob

    from capture.errors import InputError

    files = []
    for path in paths:
        found = [path] if path.exists() else [Path(name) for name in sorted(glob(str(path)))]
        if not found:
            raise InputError(f"every file named must exist: there is no {path}")
        files += found
    if not files:
        raise InputError("at least one file must be named, none is: such as shots/*.toml")
    return files


def told(clip: "Clip") -> "Clip":
    """The clip, after saying what a user should know of it."""
    tell(clip.notes)
    return clip


def captured(clip: Path, strict: bool = False, fps: float | None = None) -> "SkeletonMotion":
    """The motion capture in a file, upright and in metres, after saying what a user should know of it."""
    from mocap.skeletons.bvh import read_bvh
    from mocap.skeletons.units import upright

    motion = upright(read_bvh(clip, strict, fps))
    tell(f"{clip}: {note}" for note in motion.notes)
    return motion


def tell(notes: Iterable[str]) -> None:
    """Say what a user should know, a line each, beside what the command prints."""
    for note in notes:
        print(f"tooncap: {note}", file=sys.stderr)


def folder_at(folder: Path) -> Path:
    """The folder, made if its parent is there."""
    from capture.errors import InputError

    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: the output folder cannot be made ({error.strerror}); choose another") from None
    return folder


def rgb(text: str) -> tuple[int, int, int]:

    from matplotlib.colors import to_rgb

    from capture.errors import InputError

    try:
        red, green, blue = (round(255 * channel) for channel in to_rgb(text))
    except ValueError:
        raise InputError(f'a colour must be a name or such as "#3a7f2c", got {text!r}') from None
    return red, green, blue


def one_line(error: BaseException) -> str:
    return " ".join(str(error).split())
