"""Who could play a motion: drawings of the folder, and some that are built in; what works as it is comes first."""

import re
import shutil
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

from capture.errors import InputError
from capture.files import written_beside
from capture.motion.tracks import CartoonMotion
from retarget.characters.casts.cast import PICTURES
from retarget.characters.models.meshfiles import MODELS
from retarget.workbench.folder import listing
from retarget.workbench.folder.listing import Listing
from retarget.workbench.staging.redraw import is_edit

BUILT_IN = "built-in:"  # before the name of a drawing that is not in the folder yet
BORROWED = "characters"  # the folder that it is copied into
FIRST = {  # who is built in: the drawing that keys are proposed from
    "bunny": "bunny_sit.svg",
    "witch_hat": "witch_hat_rest.svg",
    "flower": "flower_stand.svg",
    "pumpkin": "pumpkin.svg",
    "bottle": "bottle.svg",
    "tomcat": "tomcat.svg",
}
PLAY, PROPOSE = "play", "propose"


class Offer(NamedTuple):
    """A drawing, or a character's drawings for all keys."""

    name: str
    where: str  # the folder, or BUILT_IN
    files: tuple[str, ...]
    how: str  # PLAY as it is, PROPOSE keys from it first
    fits: bool  # by the names of its files or by their number: a drawing for each key


def offers(folder: Path, motion: CartoonMotion, clip: str = "") -> list[dict[str, Any]]:
    """Who could play this, best first; `clip`, the source's own file, is nobody."""
    parts = tuple((track.part, tuple(track.keys)) for track in motion.tracks)
    source = Path(clip).resolve() if clip else None
    return _offered(_drawn(folder, listing.listing(folder), source), parts)


def borrowed(folder: Path, files: Sequence[str]) -> list[str]:
    """The files, with those that are built in copied into the folder; one that is there already stays as it is."""
    return [_copied(folder, file.removeprefix(BUILT_IN)) if file.startswith(BUILT_IN) else file for file in files]


def drawing(file: str) -> Path | None:
    """The drawing that is built in under this name; None for a file of the folder."""
    if not file.startswith(BUILT_IN):
        return None
    found = next((one for one in _characters() if BUILT_IN + one.name == file), None)
    if found is None:
        raise InputError(f"there is no built-in drawing {file[len(BUILT_IN) : 60]!r}: reload the page")
    return found


def _drawn(folder: Path, found: Listing, source: Path | None) -> tuple[str, ...]:
    """The drawings of a folder but the source; of a listing that comes again they are not looked for again."""
    global _latest
    latest = _latest
    if latest is None or latest[0] is not found or latest[1:3] != (folder, source):
        drawn = [file for file in found.of("drawing") if not is_edit(Path(file))]
        here = tuple(file for file in drawn if source is None or folder / file != source)
        latest = _latest = (found, folder, source, here)
    return latest[3]


_latest: tuple[Listing, Path, Path | None, tuple[str, ...]] | None = None


@lru_cache(maxsize=4)
def _offered(here: tuple[str, ...], parts: tuple[tuple[str, tuple[str, ...]], ...]) -> list[dict[str, Any]]:
    own = [_offer(name, where, files, parts) for (where, name, _), files in _grouped(here, parts).items()]
    there = {Path(file).name for file in here}
    lent = [_built_in(name, first, parts) for name, first in FIRST.items() if first not in there]
    best = sorted([*own, *lent], key=lambda one: (not one.fits, one.where == BUILT_IN, one.how == PROPOSE))
    return [one._asdict() for one in best]


def _offer(name: str, where: str, files: list[str], parts: tuple[tuple[str, tuple[str, ...]], ...]) -> Offer:
    """How these drawings of one name could play."""
    roles = {role for file in files if (role := _role(file, parts)) is not None}
    wanted = {(part, key) for part, keys in parts for key in keys}
    suffix = Path(files[0]).suffix.lower()
    if roles and roles == wanted:
        return Offer(name, where, tuple(files), PLAY, True)
    alone = Path(files[0]).name if len(files) == 1 else name
    if len(parts) > 1:  # one drawing plays them all as one body
        return Offer(alone, where, tuple(files), PLAY, not roles)
    one_key = len(wanted) == 1
    as_it_is = one_key or suffix in (*PICTURES, *MODELS)
    return Offer(alone, where, (files[0],), PLAY if as_it_is else PROPOSE, one_key)


def _built_in(name: str, first: str, parts: tuple[tuple[str, tuple[str, ...]], ...]) -> Offer:
    keyed = [file.name for file in _characters() if file.name.startswith(f"{name}_")]
    offer = _offer(name, BUILT_IN, [file for file in keyed if _role(file, parts) is not None] or [first], parts)
    files = offer.files if offer.fits and len(offer.files) > 1 else (first,)
    return offer._replace(name=name.replace("_", " "), files=tuple(BUILT_IN + file for file in files))


def _grouped(
    here: tuple[str, ...], parts: tuple[tuple[str, tuple[str, ...]], ...]
) -> dict[tuple[str, str, str], list[str]]:
    """Files of one folder whose names differ only in what they play are one character's drawings."""
    found: dict[tuple[str, str, str], list[str]] = {}
    for file in here:
        path = Path(file)
        role = _role(file, parts)
        stem = path.stem if role is None else _before(path.stem, role, parts)
        kind = "" if path.suffix.lower() in PICTURES else path.suffix.lower()
        name = path.name if role is None else stem
        found.setdefault((path.parent.as_posix() if path.parent.name else "", name, kind), []).append(file)
    return found


def _role(file: str, parts: tuple[tuple[str, tuple[str, ...]], ...]) -> tuple[str, str] | None:
    """The part and key that a file's name ends in, as `cast_of` understands it; the longest ending wins."""
    stem = _plain(Path(file).stem)
    fitting = {end: role for end, role in _endings(parts).items() if stem.endswith(f"_{end}") or stem == end}
    return fitting[max(fitting, key=len)] if fitting else None


def _before(stem: str, role: tuple[str, str], parts: tuple[tuple[str, tuple[str, ...]], ...]) -> str:
    """What comes before the ending of a file's name that says what it plays."""
    endings = [end for end, its in _endings(parts).items() if its == role and _plain(stem).endswith(end)]
    return stem[: len(stem) - len(max(endings, key=len))].rstrip("_- ") or stem


def _endings(parts: tuple[tuple[str, tuple[str, ...]], ...]) -> dict[str, tuple[str, str]]:
    found = {}
    for part, keys in parts:
        for key in keys:
            found[_plain(f"{part}_{key}")] = (part, key)
            if len(parts) == 1:
                found[_plain(key)] = (part, key)
        if len(keys) == 1:
            found[_plain(part)] = (part, keys[0])
    return found


def _plain(name: str) -> str:
    return re.sub("[- ]", "_", name.lower())


def _characters() -> list[Path]:
    from fixtures.write import CHARACTERS

    return sorted(CHARACTERS.glob("*.svg"))


def _copied(folder: Path, name: str) -> str:
    """The name in the folder of a built-in drawing that is now there."""
    goal = folder / BORROWED / name
    known = drawing(BUILT_IN + name)
    if not goal.exists():
        with written_beside(goal) as beside:
            shutil.copy(known, beside)
    return f"{BORROWED}/{name}"
