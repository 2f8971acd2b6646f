"""Proposed key drawings as files: which drawing is which part, where keys lie on the page, what is kept."""

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from capture.errors import InputError
from capture.fit.curves import correspond
from capture.motion import affine
from capture.motion.tracks import CartoonMotion
from retarget.characters.casts import castfile
from retarget.characters.casts.cast import PICTURES
from retarget.characters.casts.castlist import Cast, CastKey, CastPart
from retarget.characters.drawings import paths
from retarget.characters.drawings.embed import silhouette_of
from retarget.characters.drawings.paths import DrawnPath
from retarget.characters.drawings.svg import read_page, read_svg
from retarget.characters.drawings.svgout import write_keys
from retarget.characters.photos.photo import cut_out, read_photo
from retarget.characters.photos.picture import outline_of
from retarget.characters.proposed import propose
from retarget.characters.proposed.propose import Proposal

AWAY = 0.75
"""So much less far apart do outlines lie once a drawing is mirrored that looks the other way than the source."""

GREY = np.array([0.62, 0.67, 0.73, 1.0])

Asked = tuple[float | tuple[float, float], tuple[float, float] | str]
"""A pin as it is asked for: a place of the source, and a point of the drawing or an element's id."""


@dataclass(frozen=True, eq=False)
class Casting:
    """One part's one drawing."""

    part: str
    stem: str  # its keys are called STEM_key.svg
    drawn: list[DrawnPath]
    page: tuple[float, float]  # width and height in pixels
    picture: Path | None = None  # it is a photograph; what is drawn is its outline
    box: tuple[float, float, float, float] | None = None  # that it is cut out of
    notes: tuple[str, ...] = ()


def castings(
    files: Sequence[Path],
    motion: CartoonMotion,
    mirror: bool = False,
    box: tuple[float, float, float, float] | None = None,
) -> list[Casting]:
    """The drawings of a motion's parts: one file for one part, or one with a group for each, or one file each.

    A group's id, or the end of a file's name, is the part's name.  A picture is cut out by its alpha or by a `box`.
    """
    names = [track.part for track in motion.tracks]
    for file in files:
        if file.suffix.lower() not in (".svg", *PICTURES):
            raise InputError(
                f"keys are proposed from an SVG or a picture, {file.name} is none: a model needs no keys, "
                "give it to tooncap retarget --drawing as it is"
            )
    if any(file.suffix.lower() != ".svg" for file in files) and mirror:
        raise InputError("a picture cannot be mirrored here: turn it round in a picture editor and give that")
    found = []
    if len(names) == len(files) == 1:
        found.append((names[0], _stem(files[0], motion), files[0], ""))
    elif len(files) == 1 and files[0].suffix.lower() == ".svg":
        groups = read_page(files[0])[1]
        played = [name for name in names if name in groups]
        if not played:
            raise InputError(
                f"{files[0].name} must have an outermost group for each part, with the part's name as its id: the "
                f"parts are {', '.join(names)}, its groups {', '.join(groups) or 'none'}"
            )
        found += [(name, f"{_stem(files[0], motion)}_{name}", files[0], name) for name in played]
    else:
        for file in files:
            own = [name for name in names if f"_{file.stem}".lower().endswith(f"_{name}".lower())]
            if not own or own[-1] in [part for part, *_ in found]:
                raise InputError(
                    f"each part needs one drawing whose name ends in the part's, {file.name} is none of "
                    f"{', '.join(names)} or comes twice: rename it"
                )
            found.append((max(own, key=len), file.stem, file, ""))
    return [_casting(*one, mirror) if one[2].suffix.lower() == ".svg" else _of_picture(*one[:3], box) for one in found]


def proposal(casting: Casting, motion: CartoonMotion, pins: Sequence[Asked] = ()) -> Proposal:
    """A part's keys, where they fit on the page."""
    known = [(a, _element(casting, b) if isinstance(b, str) else b) for a, b in pins]
    found = propose.propose(casting.drawn, motion.keyset(casting.part), known)
    return replace(found, versions=(found.versions[0], *map(_on_page, found.versions[1:])))


def looking_away(casting: Casting, motion: CartoonMotion, found: Proposal) -> float | None:
    """How far the outlines lie apart once the drawing is mirrored, where that is a good deal less; else None."""
    turn = np.diag([-1.0, 1.0])
    rim = propose.rim_of(silhouette_of(casting.drawn)) @ turn
    source = motion.keyset(casting.part)
    outline = affine.apply(source.removed, source.points)[0, source.outline]
    misfit = propose.misfit_of(outline, correspond.places(rim, propose.corresponding(outline, rim)))
    return misfit if misfit < AWAY * found.misfit else None


def write(
    folder: Path, castings: Sequence[Casting], proposals: Sequence[Proposal], motion: CartoonMotion, again: bool = False
) -> tuple[list[Path], list[Path]]:
    """All keys as files in a folder, with a cast file; returns what was written and what was there and is kept."""
    written, kept, parts = [], [], []
    for casting, found in zip(castings, proposals, strict=True):
        if casting.picture is not None:
            parts.append(_picture_part(folder, casting, found))
            continue
        files = [folder / f"{casting.stem}_{name}.svg" for name in found.names]
        keep = [file.exists() and not again for file in files]
        size = _page(casting, found)
        write_keys([None if old else file for file, old in zip(files, keep)], found.versions, size)
        written += [file for file, old in zip(files, keep) if not old]
        kept += [file for file, old in zip(files, keep) if old]
        keys = tuple(CastKey(name, file.name) for name, file in zip(found.names, files))
        parts.append(CastPart(casting.part, keys))
    if len(parts) > 1:
        parts = _together(parts, proposals, motion)
    cast = folder / f"{castings[0].stem if len(castings) == 1 else folder.name}.cast.toml"
    if cast.exists() and not again:
        kept.append(cast)
    else:
        castfile.write_cast(Cast(tuple(parts), folder=folder), cast)
        written.append(cast)
    return written, kept


def _stem(file: Path, motion: CartoonMotion) -> str:
    """A drawing's name for its keys' names: bunny_sit.svg, which plays the first key, sit, is bunny."""
    first = f"_{motion.tracks[0].keys[0]}"
    return file.stem[: -len(first)] if file.stem.lower().endswith(first.lower()) and file.stem != first else file.stem


def _casting(part: str, stem: str, file: Path, group: str, mirror: bool) -> Casting:
    drawn, notes = read_svg(file, group)
    page = read_page(file)[0]
    if mirror:
        turn = np.array([[-1.0, 0, page[0]], [0, 1, 0]])
        drawn = [paths.moved(path, turn) for path in drawn]
    return Casting(part, stem, drawn, page, notes=tuple(f"{file.name}: {note}" for note in notes))


def _of_picture(part: str, stem: str, file: Path, box: tuple[float, float, float, float] | None) -> Casting:
    """A photograph's outline as a shape of straight lines."""
    photo = read_photo(file)
    photo = photo if box is None else cut_out(photo, box, str(file))
    ring = photo.to_own(outline_of(photo.pixels, str(file)))
    ring = np.vstack([ring, ring[:1]])
    thirds = ring[:-1, None] + np.arange(1, 4)[:, None] / 3 * (ring[1:] - ring[:-1])[:, None]
    points = np.vstack([ring[:1], thirds.reshape(-1, 2)])
    commands = "M" + "L" * (len(ring) - 2) + "Z"
    drawn = DrawnPath(file.name, commands, points, np.array([0, len(points)]), np.array([True]), GREY)
    return Casting(part, stem, [drawn], photo.size, file, box, photo.notes)


def _picture_part(folder: Path, casting: Casting, found: Proposal) -> CastPart:
    """A photograph that serves all keys, each with its outline in the photograph's own pixels."""
    outlines = [np.round(version[0].points[:-1:3], 2) for version in found.versions]
    keys = tuple(
        CastKey(name, outline=tuple(map(tuple, outline.tolist()))) for name, outline in zip(found.names, outlines)
    )
    named = Path(os.path.relpath(casting.picture, folder)).as_posix()
    return CastPart(casting.part, keys, named, box=casting.box)


def _element(casting: Casting, name: str) -> int:
    """The number of the element that a pin calls by its id, or by its place in the drawing, counted from 1."""
    ids = [match[1] if (match := re.search(r"\((.*)\)$", path.name)) else "" for path in casting.drawn]
    if name in ids:
        return ids.index(name)
    if not name.isdigit() or not 0 < int(name) <= len(ids):
        known = ", ".join(one for one in ids if one) or "none"
        raise InputError(
            f"a pin's #{name} must be the id of a shape of {casting.stem}, or its number from 1 to {len(ids)}: "
            f"its ids are {known}"
        )
    return int(name) - 1


def _on_page(version: Sequence[DrawnPath]) -> tuple[DrawnPath, ...]:
    """A key moved so far that nothing lies left of its page or above it; below and on the right the page grows."""
    low = np.concatenate([path.points for path in version]).min(axis=0)
    if (low >= 0).all():
        return tuple(version)
    shift = np.column_stack([np.eye(2), np.maximum(-low, 0)])
    return tuple(paths.moved(path, shift) for path in version)


def _page(casting: Casting, found: Proposal) -> tuple[float, float]:
    most = np.max([np.concatenate([path.points for path in version]).max(axis=0) for version in found.versions], axis=0)
    width, height = np.maximum(casting.page, np.ceil(most)).tolist()
    return width, height


def _together(parts: list[CastPart], proposals: Sequence[Proposal], motion: CartoonMotion) -> list[CastPart]:
    """Parts that keep their sizes against each other, and turn about the same places as the source's."""
    tall = [np.ptp(found.places[:, 1]) / np.ptp(found.outline[:, 1]) for found in proposals]
    made = []
    for part, found, height in zip(parts, proposals, tall, strict=True):
        place = affine.fit(found.outline, found.places)
        pivot = affine.apply(place, motion.track(part.name).pivot[None])[0]
        made.append(replace(part, height=float(height / tall[0]), pivot=tuple(pivot.tolist())))
    return made
