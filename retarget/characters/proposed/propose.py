"""All key drawings of a character proposed from one, for an animator to correct (Bregler et al. 2002, section 4).

The paper's complaint is that every key must be drawn anew for every character.  Here the drawing's outline is laid
along the source's first key, each place of it learns how the source turns and stretches there on the way to a key, and
the drawing goes that way, as rigid as possible between its places:

    corresponding   ->   ways.lent   ->   ways.followed   ->   a list of paths for each key, of the same elements

Shapes that an animator names are limbs of their own (see `hinged`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capture.errors import InputError
from capture.fit.curves import correspond
from capture.fit.curves.correspond import Pin
from capture.motion import affine
from capture.motion.keys import KeySet
from retarget.characters.drawings import limbs, paths
from retarget.characters.drawings.embed import silhouette_of
from retarget.characters.drawings.paths import DrawnPath, Gradient
from retarget.characters.proposed import hinged, ways

FACES_ACROSS = 40
"""A drawing of a square's shape gets about so many mesh steps across: thin limbs bend finely."""

UPRIGHT = 30.0
"""How surely the drawing stands as the source does: its head is up, and it looks the same way."""

NECKS = 0.02
"""Of the drawing's size (the root of its area): narrower gaps and whiskers do not count in its outline."""


@dataclass(frozen=True, eq=False)
class Proposal:
    """One drawing in K keys, the first as it came, and how it was found."""

    names: tuple[str, ...]
    versions: tuple[tuple[DrawnPath, ...], ...]  # per key its paths, back to front
    outline: NDArray  # (B, 2) the source's in its first key ...
    places: NDArray  # (B, 2) ... and the same places on the drawing's
    misfit: float  # how far the outlines differ, laid on each other by an affine map: a share of the height
    strain: NDArray  # (K,) the factor within which 99 of 100 faces of the mesh stretch as the source does
    folded: NDArray  # (K,) faces of the drawing's mesh that lie upside down


def propose(drawn: Sequence[DrawnPath], source: KeySet, pins: Sequence[Pin] = ()) -> Proposal:
    """All keys of a drawing that stands as the source's first key does.

    Pins are pairs of a place of the source's first key, an index into its outline or a point (x, y), and what belongs
    to it: a point of the drawing's outline, which is obeyed exactly, or the number of an element, which then is a limb
    and turns as the source does at that place.
    """
    drawn = list(drawn)
    outline = affine.apply(source.removed, source.points)[0, source.outline]
    limb_pins = _limb_pins(drawn, outline, pins)
    solid = silhouette_of(drawn)
    rim = rim_of(solid)
    at = corresponding(outline, rim, [(a, b) for a, b in pins if np.ndim(b) == 1])
    places = correspond.places(rim, at)
    lent = ways.ways_of(source, affine.turn(affine.fit_similarity(outline, places)[:, :2]))

    found = hinged.limbs_of(drawn, list(limb_pins), np.sqrt(solid.area) / FACES_ACROSS)
    trunk, strain, folded = _trunk(found[0], rim, at, lent)
    moved = [trunk]
    for limb, place in zip(found[1:], limb_pins.values(), strict=True):
        moved.append(_turned(limb.points[0], lent.at(place[None])[:, 0, 0]))
    joints = hinged.hinges(found, hinged.parents_of(lent, np.array(list(limb_pins.values())).reshape(-1, 2)))
    moved = limbs.hang(np.concatenate(moved, axis=1), joints, np.zeros((len(trunk), len(joints), 2)))
    carry = limbs.embedded(found, [[path] for path in drawn])
    versions = tuple(_carried(drawn, carry @ (points - moved[0])) for points in moved)
    return Proposal(source.names, versions, outline, places, misfit_of(outline, places), strain, folded)


def _trunk(limb: limbs.Limb, rim: NDArray, at: NDArray, lent: ways.Ways) -> tuple[NDArray, NDArray, NDArray]:
    """The trunk's mesh in K keys (K, N, 2), and its `strain`; what is not on the drawing's rim follows what is.

    A loose piece that is nowhere on the rim goes as the nearest places of it do.
    """
    mesh, faces = limb.points[0], limb.faces
    along, off = nearest(mesh[limb.outline], rim)
    piece = ways.pieces_of(len(mesh), faces)[limb.outline]
    edge = off < 2 * NECKS * np.sqrt(limb.silhouette.area) + 1e-9
    edge |= ~np.isin(piece, piece[edge])
    fields = ways.lent(lent, mesh, faces, limb.outline[edge], source_places(along[edge], len(rim), at))
    moved, fields = ways.followed(mesh, faces, fields)
    moved[0] = mesh
    return moved, *ways.strain(mesh, moved, faces, fields)


def _turned(points: NDArray, angles: NDArray) -> NDArray:
    """Points (N, 2) turned by angles (K,): (K, N, 2)."""
    c, s = np.cos(angles), np.sin(angles)
    return points @ np.stack([np.stack([c, s], -1), np.stack([-s, c], -1)], -2)


def _limb_pins(drawn: Sequence[DrawnPath], outline: NDArray, pins: Sequence[Pin]) -> dict[int, NDArray]:
    """For each limb its element's number and its place (2,) in the source."""
    found: dict[int, NDArray] = {}
    for place, limb in ((a, int(b)) for a, b in pins if np.ndim(b) == 0):
        name = drawn[limb].name
        if limb in found:
            raise InputError(f"a limb goes as one place of the source, {name} is pinned to two: leave one out")
        if np.ndim(place) == 0 and not 0 <= place < len(outline):
            raise InputError(
                f"the source's places are numbered from 0 to {len(outline) - 1}, {name} is pinned to {place}"
            )
        found[limb] = outline[int(place)] if np.ndim(place) == 0 else np.asarray(place, float)
    if len(found) == len(drawn):
        raise InputError("limbs need a trunk to hang on, all shapes of the drawing are limbs: leave a pin out")
    return found


def rim_of(solid: object) -> NDArray:
    """The outline (n, 2) of a silhouette's largest piece, without whiskers and narrow gaps."""
    import shapely

    pieces = getattr(solid, "geoms", [solid])
    size = np.sqrt(max(piece.area for piece in pieces))
    whole = solid.buffer(NECKS * size).buffer(-2 * NECKS * size).buffer(NECKS * size)
    largest = max(getattr(whole, "geoms", [whole]), key=lambda piece: piece.area)
    if largest.is_empty:
        largest = max(pieces, key=lambda piece: piece.area)
    return np.array(shapely.Polygon(largest.exterior).simplify(0.002 * size).exterior.coords)[:-1]


def corresponding(outline: NDArray, rim: NDArray, pins: Sequence[Pin] = ()) -> NDArray:
    """For each point of the source's outline (B, 2) its position (B,) on the drawing's rim (n, 2), box laid on box."""
    low, span = rim.min(axis=0), np.ptp(rim, axis=0)
    least, size = outline.min(axis=0), np.ptp(outline, axis=0)

    def laid(points: ArrayLike) -> NDArray:
        return (np.asarray(points, float) - low) / span * size + least

    held = [(a, laid(b) if np.ndim(b) else b) for a, b in pins]
    return correspond.match(outline, laid(rim), pins=held, laid=UPRIGHT)


def misfit_of(outline: NDArray, places: NDArray) -> float:
    """The mean distance of places (B, 2) from the outline (B, 2) laid on them by an affine map, in their heights."""
    off = np.linalg.norm(affine.apply(affine.fit(outline, places), outline) - places, axis=1)
    return float(off.mean() / np.ptp(places[:, 1]))


def source_places(along: NDArray, size: int, at: NDArray) -> NDArray:
    """For positions (P,) on the drawing's rim of `size` points the positions on the source's outline (B,) at `at`."""
    backward = (np.diff(at, append=at[0]) % size).sum() > 1.5 * size
    sign = -1 if backward else 1
    steps = (sign * np.diff(at)) % size
    here = (sign * (along - at[0])) % size
    return np.interp(here, np.concatenate([[0.0], np.cumsum(steps), [size]]), np.arange(len(at) + 1)) % len(at)


def nearest(points: NDArray, rim: NDArray) -> tuple[NDArray, NDArray]:
    """Positions (P,) on a closed curve (n, 2) nearest to points (P, 2), and how far away (P,)."""
    step = np.roll(rim, -1, axis=0) - rim
    away = points[:, None] - rim
    share = np.clip((away * step).sum(-1) / np.maximum((step**2).sum(-1), 1e-30), 0, 1)
    off = np.linalg.norm(away - share[..., None] * step, axis=-1)
    best = off.argmin(axis=1)
    each = np.arange(len(points))
    return best + share[each, best], off[each, best]


def _carried(drawn: list[DrawnPath], moves: NDArray) -> tuple[DrawnPath, ...]:
    """The paths with their control points moved (P, 2); gradients go along."""
    made, start = [], 0
    for path in drawn:
        points = path.points + moves[start : start + len(path.points)]
        start += len(path.points)
        fill, stroke = path.fill, path.stroke
        if moves.any() and (isinstance(fill, Gradient) or isinstance(stroke, Gradient)):
            place = affine.fit(path.points, points)
            fill, stroke = paths.carried(fill, place), paths.carried(stroke, place)
        made.append(replace(path, points=points, fill=fill, stroke=stroke))
    return tuple(made)
