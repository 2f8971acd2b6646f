"""Drawings with marked joints: one body that many parts move, each point by its shares of them.

    v(t) = sum_p b_p(v) A_p(t) v

A picture is one mesh, cut into limbs that overlap where they meet: they agree there, so no crack shows, and an arm can
swing before its body or behind it.  A vector drawing is already made of elements; each goes with the limb it lies on,
or with all of them if it is the whole figure.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.motion import affine, triangulate
from capture.motion.keys import KeySet
from mocap import marks as marking
from mocap.hung import END, STUB
from mocap.marks import Marks
from retarget.characters import paths
from retarget.characters.drawing import Drawing, drawing
from retarget.characters.heat import heat_shares
from retarget.characters.paths import DrawnPath
from retarget.characters.picture import Layer, Picture, halved, valid_ring
from retarget.characters.target import REST

FACES = 1500
"""About so many faces carry a picture: its limbs are thin, and bend."""

OVERLAP = 3
"""A picture's limb goes on into the body by so many faces."""

SOFT = 0.5
"""Pixels that the mesh goes beyond the middle of the picture's soft border."""

MOST_OF_IT = 0.5
"""An element through which so much of two limbs' bones runs is the figure itself, not a limb of it."""


@dataclass(frozen=True, eq=False)
class Piece:
    """What is drawn as one: a limb, or all of it."""

    target: Picture | Drawing
    shares: NDArray  # (M, P) of the target's points in the parts, rows sum to 1
    limb: str  # the limb whose drawn order it has
    behind: bool = False  # behind all limbs, whatever they do


@dataclass(frozen=True, eq=False)
class Segments:
    """The parts that move a drawing: stretches of its bones, in its own pixels."""

    names: tuple[str, ...]  # P, as the tracks are called
    starts: NDArray  # (P, 2)
    stops: NDArray  # (P, 2)
    limbs: tuple[str, ...]  # P


@dataclass(frozen=True, eq=False)
class MarkedPicture:
    """A picture with marked joints."""

    marks: Marks
    pixels: NDArray  # (h, w, 4) uint8

    def pieces(self, parts: Segments) -> tuple[Piece, ...]:
        """The picture cut into limbs, each with its shares in the parts."""
        return _picture_pieces(self.pixels, parts)


@dataclass(frozen=True, eq=False)
class MarkedDrawing:
    """A vector drawing with marked joints."""

    marks: Marks
    paths: tuple[DrawnPath, ...]

    def pieces(self, parts: Segments) -> tuple[Piece, ...]:
        """The drawing's elements gathered by limbs, each with its shares in the parts."""
        return _drawing_pieces(list(self.paths), parts)


def segments(marks: Marks, names: tuple[str, ...]) -> Segments:
    """Where the parts of a motion, called after the marked joints they lead to ("left_elbow 2"), lie on a drawing."""
    cut: dict[str, int] = {}
    for name in names:
        joint, piece = _joint_of(name, marks)
        cut[joint] = max(cut.get(joint, 1), 1 if piece == END else int(piece))
    roles = {mark: role for role, mark in marking.roles(marks.skeleton()).items()}
    starts, stops, limbs = [], [], []
    for name in names:
        joint, piece = _joint_of(name, marks)
        at = marks.names.index(joint)
        up = marks.parents[at] if marks.parents[at] >= 0 else at
        way = (marks.places[at] - marks.places[up]) / cut[joint]
        starts.append(marks.places[at] if piece == END else marks.places[up] + (int(piece) - 1) * way)
        stops.append(starts[-1] + (STUB * way if piece == END else way))
        limbs.append(marking.limb_of(at, marks.parents, roles))
    return Segments(tuple(names), np.array(starts), np.array(stops), tuple(limbs))


def _joint_of(name: str, marks: Marks) -> tuple[str, str]:
    """The joint a part is called after, and which piece of its bone it is: a number from 1, or END."""
    stem, _, piece = name.rpartition(" ")
    joint, piece = (stem, piece) if (piece.isdigit() or piece == END) and stem in marks.names else (name, "1")
    if joint not in marks.names:
        raise InputError(
            f"a motion's parts must be called after the marked joints {', '.join(marks.names)}; {name!r} is none"
        )
    return joint, piece


def _picture_pieces(pixels: NDArray, parts: Segments) -> tuple[Piece, ...]:
    import shapely

    ring = _outline(pixels)
    silhouette = shapely.Polygon(ring)
    step = np.sqrt(2.3 * silhouette.area / FACES)
    outlines, _, inside, faces = triangulate.triangulate(valid_ring(ring, _count(ring, step))[None], step)
    points = np.vstack([outlines[0], inside])
    shares = heat_shares(points, faces, parts.starts, parts.stops, silhouette)
    layer = Layer(halved(pixels), points, pixels.shape[1::-1])
    of_limb = np.stack([shares[:, [one == limb for one in parts.limbs]].sum(axis=1) for limb in _limbs(parts)], axis=1)
    owner = of_limb[faces].sum(axis=1).argmax(axis=1)  # (F,)
    outward = shares[faces].sum(axis=1).argmax(axis=1)  # of parts, which come from the body outwards
    found = []
    for number, limb in enumerate(_limbs(parts)):
        for chosen in _components(_grown(owner == number, faces), faces):
            # where a limb folds over itself its end is on top, and what it only borrows from the body is below
            chosen = chosen[np.lexsort([outward[chosen], owner[chosen] == number])]
            used = np.unique(faces[chosen])
            own = np.searchsorted(used, faces[chosen])
            outline = _outer_ring(points[used], own)
            shown = points[used]
            keyset = KeySet((REST,), shown[None], own, outline, np.zeros((1, 3)), affine.identity()[None])
            box = np.stack([shown.min(axis=0), shown.max(axis=0)])
            target = Picture(limb, keyset, box, (replace(layer, points=shown),))
            found.append(Piece(target, shares[used], limb))
    return tuple(found)


def _outline(pixels: NDArray) -> NDArray:
    """The closed outline (B, 2) of a picture's largest opaque piece, no wider: legs side by side stay apart."""
    import shapely
    from skimage import measure

    if pixels[..., 3].min() > 127:
        raise InputError(
            "a picture with marked joints must have a transparent surrounding, it has none: cut it out first"
        )
    contours = measure.find_contours(np.pad(pixels[..., 3].astype(float), 2), 127.5)
    solids = [shapely.make_valid(shapely.Polygon(contour[:, ::-1] - 2)) for contour in contours if len(contour) > 3]
    if not solids:
        raise InputError("a picture with marked joints must have something opaque on it, all of it is transparent")
    whole = shapely.union_all(solids).buffer(SOFT, join_style="mitre")
    largest = max(getattr(whole, "geoms", [whole]), key=lambda solid: solid.area)
    return np.array(shapely.Polygon(largest.exterior).simplify(0.25).exterior.coords)[:-1]


def _count(ring: NDArray, step: float) -> int:
    return max(60, round(np.linalg.norm(ring - np.roll(ring, 1, axis=0), axis=1).sum() / step))


def _limbs(parts: Segments) -> list[str]:
    return list(dict.fromkeys(parts.limbs))


def _grown(chosen: NDArray, faces: NDArray) -> NDArray:
    """Chosen faces (F,) and those up to OVERLAP faces away."""
    for _ in range(OVERLAP):
        touched = np.zeros(faces.max() + 1, bool)
        touched[faces[chosen]] = True
        chosen = touched[faces].any(axis=1)
    return chosen


def _components(chosen: NDArray, faces: NDArray) -> list[NDArray]:
    """The connected pieces of chosen faces, as face numbers; specks left out."""
    from scipy import sparse
    from scipy.sparse import csgraph

    numbers = np.flatnonzero(chosen)
    if not len(numbers):
        return []
    count = faces.max() + 1
    own = faces[numbers]
    graph = sparse.coo_matrix((np.ones(2 * len(own)), (own[:, :2].T.ravel(), own[:, 1:].T.ravel())), (count, count))
    _, piece = csgraph.connected_components(graph, directed=False)
    of_face = piece[own[:, 0]]
    return [numbers[of_face == one] for one in np.unique(of_face)]


def _outer_ring(points: NDArray, faces: NDArray) -> NDArray:
    """The longest loop of edges that only one face has (B,)."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    known = {tuple(edge) for edge in edges.tolist()}
    onward: dict[int, list[int]] = {}
    for a, b in edges.tolist():
        if (b, a) not in known:
            onward.setdefault(a, []).append(b)
    loops = []
    while onward:
        start = at = next(iter(onward))
        loop = []
        while at in onward:
            loop.append(at)
            following = onward[at].pop()
            if not onward[at]:
                del onward[at]
            at = following
            if at == start and start not in onward:
                break
        loops.append(np.array(loop))
    return max(loops, key=lambda loop: np.linalg.norm(np.diff(points[loop], axis=0), axis=1).sum())


def _drawing_pieces(drawn: list[DrawnPath], parts: Segments) -> tuple[Piece, ...]:
    """Elements that lie on one limb go with it alone; the others, such as a figure in one piece, with all parts.

    What of the trunk is drawn before any leg, such as a tail, stays behind the legs.
    """
    names = _limbs(parts)
    limb_of_part = np.array([names.index(limb) for limb in parts.limbs])
    own = _limb_of_elements([paths.painted(path) for path in drawn], parts, limb_of_part)
    first_leg = next((k for k, limb in enumerate(own) if limb >= 0 and names[limb].endswith("leg")), len(own))
    kinds = [(limb, limb >= 0 and names[limb] == "trunk" and k < first_leg < len(own)) for k, limb in enumerate(own)]
    found = []
    for number, behind in dict.fromkeys(kinds):
        members = [path for path, kind in zip(drawn, kinds, strict=True) if kind == (number, behind)]
        target = drawing(names[number] if number >= 0 else "body", (REST,), [members])
        allowed = limb_of_part == number if number >= 0 else np.ones(len(limb_of_part), bool)
        mesh = affine.apply(target.keys.removed, target.keys.points)[0]
        some = heat_shares(mesh, target.keys.faces, parts.starts[allowed], parts.stops[allowed])
        shares = np.zeros((len(mesh) + target.carry.shape[0], len(parts.names)))
        carried = np.clip(target.carry @ some, 0, None)
        shares[:, allowed] = np.vstack([some, carried / carried.sum(axis=1, keepdims=True)])
        found.append(Piece(target, shares, names[number] if number >= 0 else "trunk", behind))
    return tuple(found)


def _limb_of_elements(shapes: list[object], parts: Segments, limb_of_part: NDArray) -> list[int]:
    """The number of the limb each element goes with, or -1 for all: by whose bones run through it.

    One that no bone runs through, such as an eye or a thumb, goes with the element it covers or is covered by most.
    """
    import shapely

    lines = shapely.linestrings(np.stack([parts.starts, parts.stops], axis=1))
    count = limb_of_part.max() + 1
    whole = np.bincount(limb_of_part, shapely.length(lines), count)
    own: list[int | None] = []
    for shape in shapes:
        inside = np.bincount(limb_of_part, shapely.length(shapely.intersection(lines, shape)), count)
        full = inside > MOST_OF_IT * np.maximum(whole, 1e-9)
        own.append(-1 if full.sum() > 1 else int(inside.argmax()) if inside.any() else None)
    if all(limb is None for limb in own):
        return [-1] * len(shapes)
    for _ in shapes:  # what lies on something that lies on something ...
        for number in (number for number, limb in enumerate(own) if limb is None):
            others = [other for other, limb in enumerate(own) if limb is not None]
            shared = shapely.area(shapely.intersection(shapes[number], [shapes[other] for other in others]))
            if shared.max() > 0:
                own[number] = own[others[int(shared.argmax())]]
    far = [other for other, limb in enumerate(own) if limb is not None]
    for number in (number for number, limb in enumerate(own) if limb is None):
        own[number] = own[far[int(shapely.distance(shapes[number], [shapes[other] for other in far]).argmin())]]
    return own
