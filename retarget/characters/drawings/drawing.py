"""Vector drawings that play a part: an SVG for every key, posed as paths again (Bregler 2002, section 3.4.1).

The drawing lies in a mesh of its silhouette (see `limbs`).  The mesh is what keys and in-betweens are made
of; it carries the drawing's control points, and what it leaves over in a key is added back, so that a frame
with weight 1 on a key redraws that key exactly.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.motion import affine, arap, keys
from capture.motion.keys import Inbetweener, KeySet
from retarget.characters.drawings import limbs, paths
from retarget.characters.drawings.embed import silhouette_of
from retarget.characters.drawings.paths import DrawnPath, Gradient, Paint
from retarget.characters.drawings.svg import read_svg

FACES_ACROSS = 22
"""A silhouette of a square's shape gets about this many mesh steps across."""


@dataclass(frozen=True, eq=False)
class Drawing:
    """A vector drawing as a target."""

    part: str
    keys: KeySet
    box: NDArray  # (2, 2) of key 0 with its strokes
    carry: object  # sparse (P, N): control points from mesh points
    leftover: NDArray  # (K, P, 2) what the mesh leaves over of each aligned key
    paths: tuple[tuple[DrawnPath, ...], ...]  # each path in its K keys; gradients as they lie in key 0
    between: Inbetweener = keys.rigid
    height: float = 1.0
    pivot: NDArray | None = None
    joints: tuple[limbs.Joint, ...] = ()  # where limbs with a mesh of their own hang on the others
    notes: tuple[str, ...] = ()  # what a user should be told

    def shapes(self, rows: NDArray) -> NDArray:
        """Mesh and control points (D, N + P, 2) for rows (D, 3); leftovers go straight from key to key."""
        mesh = keys.shapes(keys.with_rows(self.keys, rows), self.between)
        gaps = limbs.gaps_at(self.keys.points, self.joints)
        mesh = limbs.hang(mesh, self.joints, arap.straight_inbetweens(gaps, self.keys.faces, rows))
        controls = np.stack([self.carry @ shape for shape in mesh])
        controls += arap.straight_inbetweens(self.leftover, self.keys.faces, rows)
        return np.concatenate([mesh, controls], axis=1)

    def posed(self, points: NDArray, weights: NDArray, scale: float) -> list[DrawnPath]:
        """The drawing with its points (N + P, 2) on the stage; strokes keep their width but for the scale."""
        start, drawn = self.keys.points.shape[1], []
        for versions in self.paths:
            first = versions[0]
            here = points[start : start + len(first.points)]
            start += len(first.points)
            fill, stroke = (
                _mixed([getattr(version, which) for version in versions], weights) for which in ("fill", "stroke")
            )
            if isinstance(fill, Gradient) or isinstance(stroke, Gradient):
                place = affine.fit(first.points, here)
                fill, stroke = paths.carried(fill, place), paths.carried(stroke, place)
            width = scale * max(float(weights @ [version.width for version in versions]), 0.0)
            opacity = float(np.clip(weights @ [version.opacity for version in versions], 0, 1))
            dashes = tuple(scale * length for length in first.dashes)
            drawn.append(
                replace(first, points=here, fill=fill, stroke=stroke, width=width, dashes=dashes, opacity=opacity)
            )
        return drawn


def read_drawing(
    part: str,
    names: tuple[str, ...],
    files: list[str | Path],
    between: Inbetweener = keys.rigid,
    apart: Sequence[Sequence[str]] = (),
) -> Drawing:
    """A character from one SVG file for every key; the files must hold the same elements and commands.

    Elements or groups named by their ids to be `apart` have a mesh for each naming, as limbs do that cross others.
    """
    read = {file: read_svg(file) for file in dict.fromkeys(files)}
    versions = [read[file][0] for file in files]
    groups = [tuple(numbered(versions[0], ids, str(files[0]))) for ids in apart]
    character = drawing(part, names, versions, between, [str(file) for file in files], groups)
    return replace(character, notes=tuple(f"{file}: {note}" for file, (_, notes) in read.items() for note in notes))


def numbered(drawn: list[DrawnPath], ids: Sequence[str], file: str) -> list[int]:
    """The numbers of the elements that have one of these ids, or lie in a group that has; an unknown id is refused."""
    for one in ids:
        if not any(one in path.within for path in drawn):
            known = sorted({name for path in drawn for name in path.within})
            raise InputError(
                f"{file} must have an element or group {one!r}, it has ids {', '.join(known) or 'nowhere'}"
            )
    return [number for number, path in enumerate(drawn) if set(ids) & set(path.within)]


def drawing(
    part: str,
    names: tuple[str, ...],
    versions: list[list[DrawnPath]],
    between: Inbetweener = keys.rigid,
    files: list[str] | None = None,
    groups: list[tuple[int, ...]] | None = None,
) -> Drawing:
    """A character from its drawn paths in each of K keys; control points correspond by their order.

    Each of the `groups` of elements, told by their numbers, has a mesh of its own.
    """
    _check_alike(versions, files or list(names))
    whole = silhouette_of(versions[0])
    step = np.sqrt(whole.area) / FACES_ACROSS
    elements = [_evenly(of_keys, step) for of_keys in zip(*versions, strict=True)]  # per path its K versions
    found = limbs.grouped(elements, groups, step) if groups else limbs.limbs(elements, step)
    drawn, faces, outline, joints = limbs.joined(found)
    aligned, removed = keys.align(drawn, outline)
    keyset = KeySet(tuple(names), aligned, faces, outline, keys.inbetween_rows(len(names)), removed)
    controls = np.stack([np.concatenate([of_keys[k].points for of_keys in elements]) for k in range(len(names))])
    carry = limbs.embedded(found, elements)
    leftover = affine.apply(affine.invert(removed), controls) - np.stack([carry @ shape for shape in aligned])
    home = tuple(_gradients_at_home(of_keys) for of_keys in elements)
    box = np.reshape(whole.bounds, (2, 2))
    return Drawing(part, keyset, box, carry, leftover, home, between, joints=joints)


def outline_drawing(part: str, keyset: KeySet, fill: Paint, stroke: Paint = None, width: float = 0.0) -> Drawing:
    """A key set as a character: its outline, painted; the mesh is the key set's, point for point."""
    from scipy import sparse

    ring = np.append(keyset.outline, keyset.outline[0])
    third = np.array([[2 / 3, 1 / 3], [1 / 3, 2 / 3], [0, 1]])
    rows = np.concatenate([[0], 1 + np.repeat(np.arange(3 * len(keyset.outline)), 2)])
    columns = np.concatenate([ring[:1], np.stack([ring[:-1], ring[1:]], 1).repeat(3, axis=0).ravel()])
    values = np.concatenate([[1.0], np.tile(third.ravel(), len(keyset.outline))])
    carry = sparse.csr_matrix((values, (rows, columns)), shape=(rows[-1] + 1, keyset.points.shape[1]))
    drawn = affine.apply(keyset.removed, keyset.points)
    versions = tuple(
        DrawnPath(
            name="outline",
            commands="M" + "L" * len(keyset.outline) + "Z",
            points=carry @ points,
            starts=np.array([0, carry.shape[0]]),
            closed=np.array([True]),
            fill=fill,
            stroke=stroke,
            width=width,
            join="round",
        )
        for points in drawn
    )
    edge = drawn[0][keyset.outline]
    box = np.stack([edge.min(axis=0), edge.max(axis=0)])
    return Drawing(part, keyset, box, carry, np.zeros((len(drawn), carry.shape[0], 2)), (versions,))


def _check_alike(versions: list[list[DrawnPath]], files: list[str]) -> None:
    """Refuse keys whose elements or commands differ from key 0's, with the first difference."""
    first = versions[0]
    for version, file in zip(versions[1:], files[1:], strict=True):
        rule = f"{file} must hold the same elements as {files[0]}, in the same order"
        if len(version) != len(first):
            raise InputError(f"{rule}: it has {len(version)} painted elements, not {len(first)}; draw the same ones")
        for here, there in zip(first, version, strict=True):
            difference = _difference(here, there)
            if difference:
                raise InputError(f"{rule}: its element {there.name} {difference}; edit a copy of the first key instead")


def _difference(first: DrawnPath, other: DrawnPath) -> str:
    if first.commands != other.commands:
        return f"has the path commands {_short(other.commands)}, not {_short(first.commands)}"
    if not np.array_equal(first.starts, other.starts):
        return "has other subpaths"
    for which in ("fill", "stroke"):
        here, there = _kind(getattr(first, which)), _kind(getattr(other, which))
        if here != there:
            return f"has {there} as its {which}, not {here}"
    return ""


def _short(commands: str) -> str:
    return commands if len(commands) <= 24 else f"{commands[:20]}... ({len(commands)})"


def _kind(paint: Paint) -> str:
    if paint is None:
        return "nothing"
    if not isinstance(paint, Gradient):
        return "a colour"
    return f"a {'linear' if paint.focus is None else 'radial'} gradient of {len(paint.offsets)} stops"


def _evenly(of_keys: tuple[DrawnPath, ...], step: float) -> list[DrawnPath]:
    """One path in its K keys, long curves cut alike, all wound for the non-zero rule as key 0 needs it."""
    hulls = np.stack([np.linalg.norm(np.diff(paths.pieces(path), axis=1), axis=-1).sum(-1) for path in of_keys])
    counts = np.clip(np.ceil(hulls.max(axis=0) / (1.5 * step)), 1, 40).astype(int)
    turn = paths.windings(of_keys[0])
    return [paths.wound(paths.split(path, counts), turn) for path in of_keys]


def _gradients_at_home(of_keys: list[DrawnPath]) -> tuple[DrawnPath, ...]:
    """The keys of a path with their gradients where they would lie in key 0, to be mixed there."""
    home = []
    for path in of_keys:
        back = affine.identity()
        if path is not of_keys[0] and (isinstance(path.fill, Gradient) or isinstance(path.stroke, Gradient)):
            back = affine.invert(affine.fit(of_keys[0].points, path.points))
        home.append(replace(path, fill=paths.carried(path.fill, back), stroke=paths.carried(path.stroke, back)))
    return tuple(home)


def _mixed(versions: list[Paint], weights: NDArray) -> Paint:
    """Paints of the same kind mixed by weights (K,)."""
    first = versions[0]
    if first is None or len(versions) == 1:
        return first
    if not isinstance(first, Gradient):
        return np.clip(np.tensordot(weights, versions, axes=1), 0, 1)

    def mix(name: str) -> NDArray:
        return np.tensordot(weights, [getattr(version, name) for version in versions], axes=1)

    return replace(
        first,
        offsets=np.maximum.accumulate(np.clip(mix("offsets"), 0, 1)),
        colors=np.clip(mix("colors"), 0, 1),
        place=mix("place"),
        focus=None if first.focus is None else mix("focus"),
    )
