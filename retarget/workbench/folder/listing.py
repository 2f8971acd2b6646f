"""What lies in a folder and below it, by kind; so much of it at most that thousands of files are no trouble."""

import os
import re
import time
from collections import deque
from functools import lru_cache
from pathlib import Path
from threading import Lock
from typing import NamedTuple

from mocap.posing.sounds import SOUNDS
from retarget.characters.casts.cast import DRAWINGS
from retarget.workbench.figure import FIGURE, has_joints
from retarget.workbench.state import CAST, CLIPS, MOTION, SHOT

DEEP = 3  # folders below the opened one
LOOKED_AT = 8000  # names
LISTED = 500
MANY = 8  # pictures numbered without a gap: fewer may as well be drawings
SETTLED = 0.1  # seconds: a folder that changed this lately may change again within its clock's step
KINDS = ("shot", "clip", "motion", "cast", "bvh", "figure", "drawing", "music", "made")
MUSIC = (*SOUNDS, ".mid", ".midi")
MADE = re.compile(r"\.retarget$|\.edit\d+$|-frames$|-drawings$")  # ends of names that the workbench itself gives
JOINTED = (".svg", ".glb", ".gltf", ".marks.toml")  # what may have joints: its content tells
PICTURES = (".png", ".jpg", ".jpeg", ".webp", ".bmp")


class Listing(NamedTuple):
    """What was found: the kinds in order, in each the nearest first."""

    files: tuple[dict[str, str], ...]  # {"file", "kind"}; a file in another folder is FOLDER/FILE
    more: bool  # than are listed here

    def of(self, *kinds: str) -> list[str]:
        """The files of these kinds; what has joints is a figure besides."""
        return [one["file"] for one in self.files if one["kind"] in kinds]


class Seen(NamedTuple):
    """What one folder holds."""

    whole: str  # "clip" or "figure" where the folder is one
    files: tuple[tuple[str, str], ...]  # name and kind
    folders: tuple[str, ...]
    names: int  # that were looked at
    changed: int  # when the folder was, at the latest
    at: int  # when it was looked at


def listing(folder: Path) -> Listing:
    """What can be opened or played here, shots first; only a folder that changed is looked at again.

    The same listing comes again, itself, as long as it says the same.
    """
    with _looking:
        known, old = _kept.get(folder, ({}, None))
        seen: dict[str, Seen] = {}
        walked, more = _walked(folder, known, seen)
        if old is None or seen.keys() != known.keys() or any(seen[one][:2] != known[one][:2] for one in seen):
            order = {kind: n for n, kind in enumerate(KINDS)}
            found = [{"file": file, "kind": kind} for file, kind in sorted(walked, key=lambda one: order[one[1]])]
            old = Listing(tuple(found[:LISTED]), more or len(found) > LISTED)
        _kept.pop(folder, None)
        _kept[folder] = seen, old
        for least in list(_kept)[:-KEPT]:
            del _kept[least]
        return old


KEPT = 4  # folders that are known again: sessions in one process may be several
_kept: dict[Path, tuple[dict[str, Seen], Listing]] = {}
_looking = Lock()


def _walked(top: Path, known: dict[str, Seen], seen: dict[str, Seen]) -> tuple[list[tuple[str, str]], bool]:
    """What lies in the folder and below, those nearer first; `seen` takes what each folder holds."""
    found, left = [], LOOKED_AT
    coming = deque([(str(top), "", 0)])
    while coming:
        path, name, depth = coming.popleft()
        here = seen[path] = _seen(path, left, known.get(path))
        left -= here.names
        below = f"{name}/" if name else ""
        found += [(below + file, kind) for file, kind in here.files]
        if here.whole and (name or here.whole == "clip"):  # an opened folder is no figure of itself
            found.append((name or ".", "made" if here.whole == "clip" and MADE.search(name) else here.whole))
        if depth < DEEP:
            coming.extend((os.path.join(path, one), below + one, depth + 1) for one in here.folders)
        if left <= 0:
            return found, True
    return found, False


def _seen(path: str, most: int, known: Seen | None) -> Seen:
    """What a folder holds; as it was known if it has not changed since."""
    now, changed = time.time_ns(), _changed(path)
    if known is not None and known.changed == changed and known.at - changed > SETTLED * 1e9 and known.names < most:
        return known
    try:
        with os.scandir(path) as entries:
            inner = [entry for entry, _ in zip(entries, range(most), strict=False) if _is_seen(entry)]
    except OSError:
        return Seen("", (), (), 0, changed, now)  # not ours to read
    inner.sort(key=lambda entry: entry.name)
    folders = tuple(entry.name for entry in inner if entry.is_dir())
    files = tuple(entry.name for entry in inner if not entry.is_dir())
    return Seen(*_kinds(path, list(files)), folders, len(inner), changed, now)


def _kinds(path: str, files: list[str]) -> tuple[str, tuple[tuple[str, str], ...]]:
    """What a folder is, "clip", "figure" or "", and what its files are, by name."""
    if FIGURE in files:  # its pictures are the figure's
        return "figure", tuple((file, _kind(file)) for file in files if _kind(file) not in ("", "drawing"))
    frames, drawn = _frames(files, PICTURES), _frames(files, (".svg",))
    hidden = {file for some in (frames, drawn) if _no_drawings(some) for file in some}
    found = []
    for file in files:
        kind = "" if file in hidden else _kind(file)
        if kind:
            found.append((file, kind))
        if kind in ("drawing", "") and _has_joints(os.path.join(path, file)):
            found.append((file, "figure"))
    return "clip" if frames else "", tuple(found)


def _has_joints(path: str) -> bool:
    if not path.lower().endswith(JOINTED):
        return False
    try:
        found = os.stat(path)
    except OSError:
        return False
    return _joints_in(path, found.st_mtime_ns, found.st_size)


@lru_cache(maxsize=4096)
def _joints_in(path: str, changed: int, size: int) -> bool:
    try:
        return has_joints(Path(path))
    except OSError:
        return False


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
    """shot, motion, cast, clip, bvh, drawing, music, made, or nothing that we open."""
    for ending, kind in ((SHOT, "shot"), (MOTION, "motion"), (CAST, "cast")):
        if name.endswith(ending):
            return kind
    stem, suffix = os.path.splitext(name)
    suffix = suffix.lower()
    if MADE.search(stem) and suffix in (*DRAWINGS, *CLIPS):
        return "made"
    if suffix in DRAWINGS:
        return "drawing"
    if suffix in MUSIC:
        return "music"
    return "bvh" if suffix == ".bvh" else "clip" if suffix in CLIPS else ""


def _changed(folder: str) -> int:
    try:
        return os.stat(folder).st_mtime_ns
    except OSError:
        return 0
