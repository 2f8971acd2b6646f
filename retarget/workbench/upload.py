"""A file from the page into the opened folder, piece by piece, for a message has its largest size."""

import os
from pathlib import Path

from capture.errors import InputError
from mocap.posing.sounds import SOUNDS
from retarget.characters.casts.backdrop import STILLS
from retarget.characters.casts.cast import DRAWINGS
from retarget.workbench.state import CLIPS

LARGEST = 200 * 2**20  # bytes of a file
KINDS = {*DRAWINGS, *STILLS, *CLIPS, ".bin", ".mtl", ".bvh", *SOUNDS, ".mid", ".midi"}


def put(folder: Path, name: str, at: int, data: bytes, last: bool) -> Path | None:
    """Put a piece of a file at its place in it; returns the file once the last has come.

    It is seen under its name only then, and takes no other's place: of a name that is there the new one is NAME-2.
    """
    plain = Path(name.replace("\\", "/")).name.lstrip(".")
    if "\0" in name or plain != name or Path(name).suffix.lower() not in KINDS:
        raise InputError(f"a file to load must be a drawing, picture, model, clip or BVH, got {name[:80]!r}")
    part = folder / f".{name}.upload"
    there = part.stat().st_size if part.exists() and at else 0
    if at != there or at + len(data) > LARGEST:
        part.unlink(missing_ok=True)
        raise InputError(f"{name[:80]} must come whole and be at most {LARGEST >> 20} MB: load it again")
    with open(part, "ab" if at else "wb") as file:
        file.write(data)
    if not last:
        return None
    goal = folder / name
    if not (goal.exists() and goal.read_bytes() == part.read_bytes()):
        stem, suffix = os.path.splitext(name)
        goal = next(
            one for n in range(1, 10_000) if not (one := folder / (f"{stem}-{n}{suffix}" if n > 1 else name)).exists()
        )
    os.replace(part, goal)
    return goal
