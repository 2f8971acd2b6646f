"""A file from the page into the opened folder, piece by piece, for a message has its largest size."""

import filecmp
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from capture.errors import InputError
from mocap.posing.sounds import SOUNDS
from retarget.characters.casts.backdrop import STILLS
from retarget.characters.casts.cast import DRAWINGS
from retarget.workbench.folder import filenames
from retarget.workbench.state import CLIPS, DOCUMENTS

LARGEST = 2 * 2**30  # bytes of a file
KINDS = {*DRAWINGS, *STILLS, *CLIPS, ".bin", ".mtl", ".bvh", *SOUNDS, ".mid", ".midi"}
BEGUN = ".upload-"  # before the name of a file that is still coming
FORGOTTEN = 3600  # seconds after which nobody sends the rest of it


def put(
    folder: Path, name: str, at: int, data: bytes, last: bool, check: Callable[[Path], None] | None = None
) -> Path | None:
    """Put a piece of a file at its place in it; returns the file once the last has come.

    It is seen under its name only then, if `check` does not refuse it, and takes no other's place: of a name that is
    there, or that other work goes by, the new one is NAME-2.
    """
    part = _part(folder, name)
    with _writable(folder):
        there = part.stat().st_size if part.exists() and at else 0
        if at != there or at + len(data) > LARGEST:
            part.unlink(missing_ok=True)
            raise InputError(f"{name[:80]} must come whole and be at most {LARGEST >> 30} GB: load it again")
        if not at:
            _sweep(folder)
        with open(part, "ab" if at else "wb") as file:
            file.write(data)
        if not last:
            return None
        try:
            if check is not None:
                check(part)
            goal = _free(part, folder / name, bool(check))
            os.replace(part, goal)
            _arrived[folder / name] = goal
        except InputError as error:
            raise InputError(str(error).replace(str(part), name)) from None
        finally:
            part.unlink(missing_ok=True)
    return goal


def drop(folder: Path, name: str) -> None:
    """Throw away what has come of a file."""
    _part(folder, name).unlink(missing_ok=True)


def arrived(folder: Path, name: str) -> str:
    """Under which name the file of this name that came last was put."""
    return _arrived.get(folder / name, folder / name).name


_arrived: dict[Path, Path] = {}


def _part(folder: Path, name: str) -> Path:
    """Where a file is while it is coming; a name that leads elsewhere, or is of no kind we know, is refused."""
    if Path(filenames.plain(name)).suffix.lower() not in KINDS:
        raise InputError(f"a file to load must be a drawing, picture, model, clip or BVH, got {name[:80]!r}")
    return folder / f"{BEGUN}{name}"


def _free(part: Path, goal: Path, begins: bool) -> Path:
    """The first of NAME, NAME-2, ... that nothing else has; the file itself where it is there already.

    What begins work of its own must not meet the documents of another.
    """
    for n in range(1, 10_000):
        one = goal.with_stem(f"{goal.stem}-{n}") if n > 1 else goal
        if one.exists():
            if one.is_file() and filecmp.cmp(part, one, shallow=False):
                return one
        elif not (begins and any(one.with_name(one.stem + kind).exists() for kind in DOCUMENTS)):
            return one
    raise InputError(f"{goal.name} is there ten thousand times: rename it")


def _sweep(folder: Path) -> None:
    """Take away what was left when a page closed on the way."""
    for old in folder.glob(f"{BEGUN}*"):
        if time.time() - old.stat().st_mtime > FORGOTTEN:
            old.unlink(missing_ok=True)


@contextmanager
def _writable(folder: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise InputError(
            f"a file must find room in {folder.name}, it did not ({error.strerror or error}): make room, or open a "
            "folder that can be written"
        ) from error
