"""A marked drawing held by its joints: the same pieces, moved by the same shares, as when it plays a motion.

A pose is in metres, y up, the root of the drawing as drawn at the origin, as `dancer.read_dancer` makes its skeleton.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from capture.motion import affine
from mocap.onto.bones import Bone
from mocap.onto.dragged import lies_at, orders_at, own_bones
from retarget.characters.bodies.marked import MarkedDrawing, MarkedPicture, Piece, Segments, segments
from retarget.stage.perform import Performance
from retarget.stage.play import EDGE, hung_on


@dataclass(frozen=True, eq=False)
class Held:
    """A drawing and what moves it."""

    character: MarkedPicture | MarkedDrawing
    bones: tuple[Bone, ...]
    parts: Segments
    unit: float  # pixels of the drawing that a metre of its skeleton is

    def pieces(self) -> tuple[Piece, ...]:
        """What is drawn as one, each with its shares in the parts."""
        return self.character.pieces(self.parts)


def hold(path: str | Path) -> Held:
    """A drawing with marked joints, ready to be posed."""
    from retarget.characters.bodies.markfiles import read_marked
    from retarget.characters.figures.dancer import TALL

    character = read_marked(path)
    marks, bones = character.marks, own_bones(character.marks)
    still = lies_at(marks, bones, np.column_stack([marks.places, np.zeros(len(marks))])[None])
    parts = segments(marks, tuple(part.name for part in still.parts))
    return Held(character, bones, parts, float(np.ptp(marks.places, axis=0).max()) / TALL)


def maps_at(held: Held, positions: NDArray) -> NDArray:
    """The maps (P, T, 2, 3) of a drawing's parts on its own page, its joints at positions (T, J, 3), in metres."""
    places = _places(held, positions)
    body = lies_at(held.character.marks, held.bones, places)
    way = places[:, 0, :2] - held.character.marks.places[0]  # `hung` leaves the root where it is drawn
    maps = np.stack([body.part(name).maps for name in held.parts.names])
    maps[..., 2] += way
    return maps


def limb_orders(held: Held, positions: NDArray) -> NDArray:
    """The drawn order (P, T) of each part."""
    orders = orders_at(held.character.marks, held.bones, _places(held, positions))
    return np.stack([orders[limb] for limb in held.parts.limbs])


def metres(held: Held) -> NDArray:
    """The map (2, 3) from the drawing's page to the plane z = 0 that it is posed in, y up."""
    x, y = held.character.marks.places[0]
    return np.array([[1, 0, -x], [0, -1, y]]) / held.unit


def performed(held: Held, positions: NDArray, fps: float = 24.0) -> Performance:
    """The drawing in poses (T, J, 3), in metres, on a page as large as all of them."""
    maps = maps_at(held, positions)
    ends = np.concatenate([affine.apply(maps, part[:, None, None]) for part in (held.parts.starts, held.parts.stops)])
    low, high = ends.min(axis=(0, 1, 2)) - EDGE, ends.max(axis=(0, 1, 2)) + EDGE
    maps[..., 2] -= np.floor(low)
    size = tuple(int(edge) for edge in np.ceil(high) - np.floor(low))
    times = np.arange(len(positions)) / fps
    return hung_on(held.pieces(), held.parts, maps, limb_orders(held, positions), times, fps, size)


def _places(held: Held, positions: NDArray) -> NDArray:
    """Joints in the drawing's pixels (T, J, 3), y down."""
    root = np.array([*held.character.marks.places[0], 0.0])
    return root + held.unit * np.asarray(positions, float) * (1, -1, 1)
