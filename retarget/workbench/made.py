"""What this workbench has made for a person to take: exports, to be looked at and saved from the page.

Only what was written here since the workbench began can be had, under the names that it was given; nothing else of the
folder, and nothing outside it.
"""

from pathlib import Path
from threading import Lock
from typing import Any, NamedTuple

from capture.errors import InputError
from retarget.workbench.desks import Seen
from retarget.workbench.state import State

PIECE = 4 * 2**20  # bytes that are handed out at once
TYPES = {
    ".mp4": "video/mp4",
    ".gif": "image/gif",
    ".webm": "video/webm",
    ".mov": "video/quicktime",
    ".svg": "image/svg+xml",
    ".png": "image/png",
    ".bvh": "text/plain",
    ".json": "application/json",
    ".csv": "text/csv",
}


class Made(NamedTuple):
    """One file, or folder of frames, and what there is to say of it."""

    path: Path
    said: str
    desk: str  # that it was made at
    of: int  # the performance's number, or 0


_made: dict[Path, Made] = {}  # the latest is last
_noting = Lock()  # for sessions in one process may be several


def note(path: Path, said: str, desk: str, of: int = 0) -> None:
    """Say that this was made."""
    path = path.resolve()
    with _noting:
        _made.pop(path, None)
        _made[path] = Made(path, said, desk, of)


def exported(state: State, out: str, sentence: str, desk: str, number: int = 0) -> State:
    """The state as it is, and that this was made of it: what an export comes to."""
    note(Path(out), sentence, desk, number)
    return state


def shown(state: State, desk: str) -> list[dict[str, Any]]:
    """What was made of the open work at a desk, the latest first."""
    with _noting:
        latest = tuple(reversed(_made.values()))
    names = [one for one in latest if one.desk == desk and _is_of(one.path, state) and one.path.exists()]
    return [
        {
            "file": one.path.relative_to(state.folder).as_posix(),
            "path": str(one.path),
            "type": TYPES.get(one.path.suffix.lower(), "") if one.path.is_file() else "folder",
            "bytes": one.path.stat().st_size,
            "said": one.said,
            "of": one.of,
        }
        for one in names
    ]


def piece(state: State, file: str, at: int = 0) -> Seen:
    """A piece of what was made, from a place in it on."""
    path = (state.folder / file).resolve() if "\0" not in file else Path()
    if path not in _made or not _is_of(path, state) or not path.is_file():
        raise InputError(f"only what was exported here can be had, {file[:80]!r} was not: export it first")
    with open(path, "rb") as opened:
        opened.seek(at)
        data = opened.read(PIECE)
    kind = TYPES.get(path.suffix.lower(), "application/octet-stream")
    return Seen(kind, data, {"size": path.stat().st_size})


def size_of(path: Path) -> str:
    """How much a file or folder holds, in words."""
    files = path.iterdir() if path.is_dir() else [path]
    count = sum(file.stat().st_size for file in files)
    return f"{count / 2**20:.1f} MB" if count >= 2**20 else f"{max(1, round(count / 1024))} KB"


def _is_of(path: Path, state: State) -> bool:
    return bool(state.name) and path.is_relative_to(state.folder) and path.name.startswith(Path(state.name).name)
