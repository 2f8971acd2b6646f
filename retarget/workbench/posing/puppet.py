"""A drawing at the posing desk, for a page that draws it: its pieces once, and for every pose how its parts move.

v(t) = sum_p b_p(v) A_p(t) v        as on the stage (`play`); v in the drawing's pixels, A to metres, y up
"""

from functools import lru_cache
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from capture.motion import affine
from mocap.onto.bones import Casting
from mocap.skeletons.skeleton import SkeletonMotion
from retarget.characters.bodies.marked import MarkedDrawing, MarkedPicture, Piece, Segments, segments
from retarget.characters.drawings.paths import DrawnPath, Gradient, Paint
from retarget.characters.photos.picture import Picture
from retarget.stage import held as holding
from retarget.stage.held import Held

COLUMNS = 7  # six of a map, and the order that its limb is drawn in


def parts_at(held: Held, positions: NDArray) -> NDArray:
    """The parts (T, P, COLUMNS) of a drawing with its joints at positions (T, J, 3)."""
    maps = affine.compose(holding.metres(held), holding.maps_at(held, positions))
    return _columns(maps, holding.limb_orders(held, positions))


def parts_dancing(held: Held, motion: SkeletonMotion, whole: bool = True) -> tuple[NDArray, list[str]]:
    """The parts (T, P, COLUMNS) of a drawing that plays a motion, as an export of it has them; and their names.

    From where limbs are seen is chosen by the `whole` motion; a stretch of it is seen as that was.
    """
    from mocap.onto.bones import cast_marks
    from mocap.onto.to_tracks import to_tracks
    from retarget.stage.play import maps_of

    marks = held.character.marks
    casting = None if whole else _castings.get(held.character)
    casting = cast_marks(motion, marks) if casting is None else casting
    _castings[held.character] = casting
    played = to_tracks(motion, marks, casting)
    names = tuple(track.part for track in played.tracks)
    maps, _ = maps_of(played, _segments(held, names))
    orders = np.stack([track.order for track in played.tracks])
    maps[..., 2] -= played.tracks[0].pivot - marks.places[0]  # from the page, which is as large as the motion needs
    return _columns(affine.compose(holding.metres(held), maps), orders), list(names)


_castings: WeakKeyDictionary[MarkedPicture | MarkedDrawing, Casting] = WeakKeyDictionary()


def mesh(held: Held, names: tuple[str, ...]) -> tuple[NDArray, dict[str, Any]]:
    """The pieces as numbers, one after the other, and what they mean.

    Of each: its points (n, 2), how much each part has of them (n, P), and of a picture its faces (f, 3).
    """
    numbers, told = [], []
    parts = _segments(held, names)
    for piece in _pieces(held, names):
        count = piece.target.keys.points.shape[1]
        rest = piece.target.shapes(np.zeros((1, 3)))[0]
        one = {"first": parts.limbs.index(piece.limb), "behind": piece.behind}
        if isinstance(piece.target, Picture):
            rest, shares, faces = rest[:count], piece.shares[:count], piece.target.keys.faces
            one |= {"points": count, "faces": len(faces)}
            numbers += [rest.ravel(), shares.ravel(), faces.ravel()]
        else:
            rest, shares = rest[count:], piece.shares[count:]  # the mesh carries the curves: those are what is drawn
            drawn = piece.target.posed(np.concatenate([np.zeros((count, 2)), rest]), np.ones(1), 1.0)
            one |= {"points": len(rest), "faces": 0, "paths": [_path(path) for path in drawn]}
            numbers += [rest.ravel(), shares.ravel()]
        told.append(one)
    picture = held.character.pixels.shape[1::-1] if isinstance(held.character, MarkedPicture) else None
    return np.concatenate(numbers), {"pieces": told, "parts": len(names), "picture": picture}


def texture(held: Held) -> bytes:
    """The picture that the pieces are cut from, as a PNG."""
    import cv2

    return cv2.imencode(".png", held.character.pixels[..., [2, 1, 0, 3]])[1].tobytes()


def _columns(maps: NDArray, orders: NDArray) -> NDArray:
    """(P, T, 2, 3) and (P, T) as (T, P, COLUMNS)."""
    flat = np.concatenate([maps.reshape(*maps.shape[:2], 6), orders[..., None]], axis=-1)
    return np.ascontiguousarray(np.swapaxes(flat, 0, 1))


@lru_cache(maxsize=4)
def _pieces_of(character: MarkedPicture | MarkedDrawing, names: tuple[str, ...]) -> tuple[Piece, ...]:
    return character.pieces(segments(character.marks, names))


def _pieces(held: Held, names: tuple[str, ...]) -> tuple[Piece, ...]:
    return _pieces_of(held.character, names)


@lru_cache(maxsize=8)
def _segments_of(character: MarkedPicture | MarkedDrawing, names: tuple[str, ...]) -> Segments:
    return segments(character.marks, names)


def _segments(held: Held, names: tuple[str, ...]) -> Segments:
    return held.parts if names == held.parts.names else _segments_of(held.character, names)


def _path(path: DrawnPath) -> dict[str, Any]:
    return {
        "starts": path.starts.tolist(),
        "closed": path.closed.tolist(),
        "fill": _paint(path.fill),
        "stroke": _paint(path.stroke),
        "width": path.width,
        "cap": path.cap,
        "join": path.join,
        "dashes": list(path.dashes),
        "evenodd": path.evenodd,
        "opacity": path.opacity,
    }


def _paint(paint: Paint) -> Any:
    if not isinstance(paint, Gradient):
        return None if paint is None else np.asarray(paint).tolist()
    return {
        "offsets": paint.offsets.tolist(),
        "colors": paint.colors.tolist(),
        "place": paint.place.tolist(),
        "focus": None if paint.focus is None else paint.focus.tolist(),
    }
