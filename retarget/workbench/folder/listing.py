"""What lies in a folder and below it, by kind; so much of it at most that thousands of files are no trouble."""

import os
import re
import time
from collections import deque
from pathlib import Path
from typing import NamedTuple

from retarget.characters.casts.cast import DRAWINGS
from retarget.workbench.state import CAST, CLIPS, MOTION, SHOT

DEEP = 3  # folders below the opened one
LOOKED_AT = 8000  # names
LISTED = 500
MANY = 8  # pictures numbered without a gap: fewer may as well be drawings
SETTLED = 0.1  # seconds: a folder that changed this lately may change again within its clock's step
KINDS = ("shot", "clip", "motion", "cast", "bvh", "drawing", "made")
MADE = re.compile(r"\.retarget$|\.edit\d+$|-frames$|-drawings$")  # ends of names that the workbench itself gives
PICTURES = (".png", ".jpg", ".jpeg", ".webp", ".bmp")


class Listing(NamedTuple):
    """What was found: the kinds in order, in each the nearest first."""

    files: tuple[dict[str, str], ...]  # {"file", "kind"}; a file in another folder is FOLDER/FILE
    more: bool  # than are listed here


def listing(folder: Path) -> Listing:
    """What can be opened or played here, shots first; looked up anew only where a folder changed."""
    kept = _kept.get(folder)
    if kept is not None and all(_changed(name) == when for name, when in kept[1].items()):
        return kept[0]
    now, seen = time.time_ns(), {}
    found, more = _walked(folder, seen)
    order = {kind: n for n, kind in enumerate(KINDS)}
    found.sort(key=lambda one: order[one["kind"]])
    made = Listing(tuple(found[:LISTED]), more or len(found) > LISTED)
    _kept.clear()  # of one folder: nobody works in two at once
    if all(now - when > SETTLED * 1e9 for when in seen.values()):
        _kept[folder] = made, seen
    return made


_kept: dict[Path, tuple[Listing, dict[str, int]]] = {}


def _walked(top: Path, seen: dict[str, int]) -> tuple[list[dict[str, str]], bool]:
    """What lies in the folder and below, those nearer first; `seen` takes when each folder was changed."""
    found, left = [], LOOKED_AT
    coming = deque([(str(top), "", 0)])
    while coming:
        path, name, depth = coming.popleft()
        seen[path] = _changed(path)
        try:
            with os.scandir(path) as entries:
                inner = [entry for entry, _ in zip(entries, range(left), strict=False) if _is_seen(entry)]
        except OSError:
            continue  # not ours to read
        left -= len(inner)
        inner.sort(key=lambda entry: entry.name)
        folders = [entry.name for entry in inner if entry.is_dir()]
        files = [entry.name for entry in inner if not entry.is_dir()]
        frames, drawn = _frames(files, PICTURES), _frames(files, (".svg",))
        if frames:
            found.append({"file": name or ".", "kind": "made" if MADE.search(name) else "clip"})
        hidden = {file for some in (frames, drawn) if _no_drawings(some) for file in some}
        for file in files:
            kind = "" if file in hidden else _kind(file)
            if kind:
                found.append({"file": f"{name}/{file}" if name else file, "kind": kind})
        if depth < DEEP:
            coming.extend((os.path.join(path, one), f"{name}/{one}" if name else one, depth + 1) for one in folders)
        if left <= 0:
            return found, True
    return found, False


def _is_seen(entry: os.DirEntry) -> bool:
    """Whether a name is for people; links to folders are not followed, they may lead out or round in a circle."""
    return not entry.name.startswith(".") and not (entry.is_symlink() and entry.is_dir())


def _frames(files: list[str], suffixes: tuple[str, ...]) -> list[str]:
    """The frames of a clip: all pictures, if their names end in numbers and are else the same."""
    drawn = [file for file in files if file.lower().endswith(suffixes)]
    numbered = [re.fullmatch(r"(.*?)\d+", Path(file).stem) for file in drawn]
    return drawn if len(drawn) > 1 and all(numbered) and len({one[1] for one in numbered}) == 1 else []


def _no_drawings(frames: list[str]) -> bool:
    """Whether these are surely frames: by zeros before their numbers, or many numbers without a gap.

    Else they may be a character's key drawings just as well.
    """
    numbers = [re.search(r"\d+$", Path(file).stem)[0] for file in frames]
    if numbers and {len(one) for one in numbers} == {len(numbers[0])} and len(numbers[0]) >= 3:
        return True
    counted = sorted(map(int, numbers))
    return len(counted) >= MANY and counted == list(range(counted[0], counted[0] + len(counted)))


def _kind(name: str) -> str:
    """shot, motion, cast, clip, bvh, drawing, made, or nothing that we open."""
    for ending, kind in ((SHOT, "shot"), (MOTION, "motion"), (CAST, "cast")):
        if name.endswith(ending):
            return kind
    stem, suffix = os.path.splitext(name)
    suffix = suffix.lower()
    if MADE.search(stem) and suffix in (*DRAWINGS, *CLIPS):
        return "made"
    if suffix in DRAWINGS:
        return "drawing"
    return "bvh" if suffix == ".bvh" else "clip" if suffix in CLIPS else ""


def _changed(folder: str) -> int:
    try:
        return os.stat(folder).st_mtime_ns
    except OSError:
        return 0
