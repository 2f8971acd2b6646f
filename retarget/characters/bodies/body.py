"""One character that plays several parts at once: one drawing, photograph or model, bent where parts meet.

    v(t) = sum_p b_p(v) A_p(t) x(v, t),    x(v, t) = sum_p b_p(v) sum_d w_pd(t) S_d(v)

A point v belongs to part p with a share b_p(v), and shares sum to 1; where parts meet they pass softly from one to the
other, over a seam (`soft_shares`, `shares_by_lines`).  Without a word of the animator the regions are those of
the source's own parts, once the character stands in the source's place.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.motion import affine
from capture.motion.keys import KeySet
from capture.motion.parts import soft_shares
from capture.motion.tracks import CartoonMotion, total_affine
from retarget.characters.bodies.shares import shares_by_lines
from retarget.characters.drawings.drawing import Drawing, numbered
from retarget.characters.photos.picture import Picture
from retarget.characters.places import box_of, onto, rest_frame
from retarget.characters.target import Target


@dataclass(frozen=True, eq=False)
class Limb:
    """What an animator says of one part of a body, all in the drawing's own units; nothing has to be said."""

    line: NDArray | None = None  # (2, 2) from its joint to its end
    region: NDArray | None = None  # (B, 2) a closed outline round it
    pivot: NDArray | None = None  # (2,) where it turns; the line's start, or the source's, without it
    elements: tuple[str, ...] = ()  # ids of what is all its own in an SVG, and crosses the others


@dataclass(frozen=True, eq=False)
class Body:
    """A character as a target that plays P parts, the one that the others hang on first."""

    inner: Target  # its drawing, picture or model
    parts: tuple[str, ...]  # P
    shares: NDArray  # (M, P) of all its points, rows sum to 1
    joints: NDArray  # (P, 2) where parts turn, in its drawing; NaN takes the source's
    turns: NDArray  # (P,) radians that each part is turned by before it moves
    frame: int  # it is drawn in the pose that the source has in this frame
    layers: tuple[NDArray, ...] = ()  # of a picture: faces (F, 3) of the parts, back to front
    height: float = 1.0

    @property
    def part(self) -> str:
        """The first of its parts."""
        return self.parts[0]

    @property
    def keys(self) -> KeySet:
        """The key set of its drawing."""
        return self.inner.keys

    @property
    def box(self) -> NDArray:
        """Least and greatest corner (2, 2) of its drawing's key 0."""
        return self.inner.box

    @property
    def pivot(self) -> NDArray | None:
        """Where the first part turns, if it was told."""
        return None if np.isnan(self.joints[0]).any() else self.joints[0]

    @property
    def notes(self) -> tuple[str, ...]:
        """What a user should be told of its drawing."""
        return getattr(self.inner, "notes", ())

    def shapes(self, rows: NDArray) -> NDArray:
        """Its drawing's points (D, M, 2 or 3) for rows (D, 3)."""
        return self.inner.shapes(rows)

    def posed(self, points: NDArray, weights: NDArray, scale: float) -> list[Any]:
        """Its drawing with points (M, 2 or 3) on the stage; a picture part by part, for its edges are soft."""
        drawn = self.inner.posed(points, weights, scale)
        if not self.layers:
            return drawn
        return [replace(one, faces=faces) for one in drawn for faces in self.layers]


def body(
    inner: Target,
    motion: CartoonMotion,
    told: Mapping[str, Limb] | None = None,
    seam: float | None = None,
    frame: int | None = None,
    turned: bool = False,
) -> Body:
    """A character that plays the parts told, or all of the motion's.

    But for those with elements of their own, all limbs have a line, or all a region, or none has either: then they are
    where the source's are.  Shares pass over
    `seam` pixels of the stage, as many as the slimmest part is wide if that is None.  The character is drawn in the
    pose that the source has in a `frame`; where its limbs lie otherwise, they can be `turned` first to lie as the
    source's do.
    """
    told = dict(told) if told else {track.part: Limb() for track in motion.tracks}
    parts = _roots_first(motion, tuple(told))
    limbs = [told[part] for part in parts]
    frame = rest_frame(motion, parts) if frame is None else frame
    if not 0 <= frame < len(motion.times):
        raise InputError(
            f"a body must be drawn in a pose of the clip, frames 0 to {len(motion.times) - 1}, got {frame}"
        )
    outlines = [motion.outline(part)[frame] for part in parts]
    place = onto(inner.box, box_of(np.concatenate(outlines)))
    seen = affine.apply(place, _seen(inner))
    seam = min(_width(outline) for outline in outlines) if seam is None else seam
    soft = [number for number, limb in enumerate(limbs) if not limb.elements] or [0]
    own = _own(inner, limbs)
    shares = np.zeros((len(seen), len(parts)))
    shares[:, soft] = _soft(seen, inner.keys.faces, [limbs[n] for n in soft], [outlines[n] for n in soft], place, seam)
    shares[own >= 0] = np.eye(len(parts))[own[own >= 0]]
    joints = np.stack([_joint(limb) for limb in limbs])
    turns = np.zeros(len(parts))
    if turned:
        turns = _turns(motion, parts, frame, [limb.line for limb in limbs])
    inner, layers = _piled(inner, shares, motion, parts)
    return Body(inner, parts, shares, joints, turns, frame, layers)


def _soft(
    seen: NDArray, faces: NDArray, limbs: list[Limb], outlines: list[NDArray], place: NDArray, seam: float
) -> NDArray:
    """Shares (M, P) by the limbs' regions, or lines, or else the source's outlines."""
    lines, regions = sum(limb.line is not None for limb in limbs), sum(limb.region is not None for limb in limbs)
    if regions == len(limbs):
        return soft_shares(seen, [affine.apply(place, limb.region) for limb in limbs], seam)
    if regions or lines not in (0, len(limbs)):
        raise InputError(
            "the parts of a body must all have a line, all a region, or none of them either, but for those with "
            f"elements: {len(limbs)} parts have {lines} lines and {regions} regions"
        )
    if lines:
        return shares_by_lines(seen, faces, [affine.apply(place, limb.line) for limb in limbs], seam)
    return soft_shares(seen, outlines, seam)


def _own(inner: Target, limbs: list[Limb]) -> NDArray:
    """The number of the part that each point (M,) is all of, with the meshes that carry its elements; -1 for none."""
    from scipy import sparse
    from scipy.sparse import csgraph

    count = inner.keys.points.shape[1]
    if not any(limb.elements for limb in limbs):
        return np.full(inner.shapes(np.zeros((1, 3))).shape[1], -1)
    if not isinstance(inner, Drawing):
        raise InputError("elements are of SVG drawings, a picture or a model has none: give its parts lines or regions")
    drawn = [versions[0] for versions in inner.paths]
    starts = np.cumsum([0, *(len(path.points) for path in drawn)])
    faces = inner.keys.faces
    ways = sparse.csr_matrix(
        (np.ones(len(faces) * 2), (faces[:, [0, 1]].ravel(), faces[:, [1, 2]].ravel())), shape=(count, count)
    )
    piece = csgraph.connected_components(ways, directed=False)[1]
    mesh, controls = np.full(count, -1), np.full(starts[-1], -1)
    for number, limb in enumerate(limbs):
        for element in numbered(drawn, limb.elements, "the drawing"):
            mine = slice(starts[element], starts[element + 1])
            controls[mine] = number
            mesh[np.isin(piece, piece[inner.carry[mine].indices])] = number
    return np.concatenate([mesh, controls])


def _roots_first(motion: CartoonMotion, parts: tuple[str, ...]) -> tuple[str, ...]:
    """The parts in an order in which none comes before what it hangs on, else as the motion has them."""
    above = {}
    for part in parts:
        line, name = [], motion.track(part).parent
        total_affine(motion, part)  # refuses a part that is its own parent
        while name:
            line.append(name)
            name = motion.track(name).parent
        above[part] = len(line)
    names = [track.part for track in motion.tracks]
    return tuple(sorted(parts, key=lambda part: (above[part], names.index(part))))


def _seen(inner: Target) -> NDArray:
    """All points (M, 2) of the drawing's key 0, as they are seen."""
    points = inner.shapes(np.zeros((1, 3)))[0]
    return points if points.shape[1] == 2 else affine.apply(inner.view, points)[:, :2]


def _joint(limb: Limb) -> NDArray:
    if limb.pivot is not None:
        return np.asarray(limb.pivot, float)
    return np.full(2, np.nan) if limb.line is None else np.asarray(limb.line, float)[0]


def _width(outline: NDArray) -> float:
    """How wide a shape is on the average: four times its area for its length all round, as it is for a disc."""
    after = np.roll(outline, -1, axis=0)
    doubled = abs(np.sum(outline[:, 0] * after[:, 1] - after[:, 0] * outline[:, 1]))
    return max(float(2 * doubled / np.linalg.norm(after - outline, axis=1).sum()), 1e-6)


def _turns(motion: CartoonMotion, parts: tuple[str, ...], frame: int, lines: Sequence[NDArray | None]) -> NDArray:
    """How much each line must turn (P,) to point where the source's part goes from its joint in the frame."""
    if any(line is None for line in lines):
        raise InputError("a body whose limbs are turned to lie as the source's must have a line for every part")
    turns = []
    for part, line in zip(parts, lines, strict=True):
        joint = affine.apply(total_affine(motion, part)[frame], motion.track(part).pivot[None])[0]
        way = motion.outline(part)[frame].mean(axis=0) - joint
        own = line[1] - line[0]
        turn = np.arctan2(way[1], way[0]) - np.arctan2(own[1], own[0])
        turns.append((turn + np.pi) % (2 * np.pi) - np.pi)
    return np.array(turns)


def _piled(
    inner: Target, shares: NDArray, motion: CartoonMotion, parts: tuple[str, ...]
) -> tuple[Target, tuple[NDArray, ...]]:
    """The drawing with its faces as the parts are piled, so that an arm covers the body; of a picture, those layers."""
    keyset = inner.keys
    if keyset.points.shape[2] == 3:  # there depth says who is in front, and materials count faces
        return inner, ()
    order = np.array([np.median(motion.track(part).order) for part in parts])
    of_face = order[shares[: keyset.points.shape[1]].argmax(axis=1)][keyset.faces].max(axis=1)
    layers = tuple(keyset.faces[of_face == level] for level in np.unique(of_face))
    inner = replace(inner, keys=replace(keyset, faces=np.concatenate(layers)))
    return inner, layers if isinstance(inner, Picture) and len(layers) > 1 else ()
