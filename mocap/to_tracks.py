"""Motion capture as a motion of parts: the bridge from joints in space to marks on a drawing.

    v(t) = A_p(t) v,  A_p = R(turn) . (stretch along, thickness across) . R(drawn direction)^-1, about the mark

A part for every sub-link of the marked skeleton, and for its root.  A limb points where the performer's limb points
in the plane it is seen in; trunk, shoulders, hips, hands and feet turn by as much as the performer's have turned from
rest, for a drawing's own slant is part of its character.  So a drawing with its arms down and a skeleton with its arms
out agree.  Bones keep the drawing's own lengths, times the rubber's stretch, times what foreshortening leaves of them.

AnimatedDrawings carries directions alone.  Rubber without its stretch is nothing, so length and thickness are carried
too, and which limb is before the body and which behind it.
"""

import numpy as np
from numpy.typing import NDArray

from capture.motion import affine
from capture.motion.keys import KeySet
from capture.motion.tracks import CartoonMotion, Track, relative_to_parents
from mocap import views as viewing
from mocap.bones import Bone, Casting, Performer, cast_marks, performer, sub_links
from mocap.marks import Marks
from mocap.rubber.rubber import RubberMotion
from mocap.skeleton import SkeletonMotion
from mocap.travel import travelled

LEAST = 0.25
"""What foreshortening leaves of a bone that points at the viewer: a drawing has no end of it to show."""

SIDEWAYS = 0.5
"""Shoulders, hips and feet of which less shows at rest, as a share of their length, go with what they hang on."""

CLEAR = (0.1, 0.35)
"""A limb that shows less than this share of its length has no direction; from the second share on it has its own."""

UNSURE = 0.12
"""Seconds around, from where a direction is taken while a limb points at the viewer."""

BEFORE = 0.05
"""A limb changes from behind the body to before it when it is nearer by this share of the performer's height."""

THIN = 0.15
"""A sub-link's quad is this wide, as a share of its bone's length."""


def to_tracks(
    motion: SkeletonMotion | RubberMotion,
    marks: Marks,
    casting: Casting | None = None,
    foreshorten: float = 0.5,
    margin: float = 0.35,
) -> CartoonMotion:
    """A motion, upright and in metres, lent to a drawing's marks: a part for each (sub-)link, in pixels, y down.

    `foreshorten` is how much of a limb's foreshortening is kept: with 0 a drawing stays as flat as it is drawn, with 1
    it is seen as the performer is.  The page holds the whole way, and `margin` of the figure's height round it.
    """
    casting = cast_marks(motion, marks) if casting is None else casting
    acting = performer(motion, casting.views.turning)
    turns, lengths, widths, depths = {}, {}, {}, {}
    for bone in casting.bones:
        if bone.joints is not None:
            turns[bone.mark], lengths[bone.mark], widths[bone.mark], depths[bone.mark] = _lie(
                acting, bone, casting, foreshorten
            )
    pelvis = _pelvis(casting, turns, len(acting.positions))
    hung = _Chain(casting, pelvis, turns, lengths, widths)
    way = travelled(acting, casting, hung.places)  # (T, 2)
    places, maps = hung.places + way[:, None], dict(hung.maps)
    tall = float(np.ptp(marks.places[:, 1])) or float(np.ptp(marks.places))
    low, high = places.min(axis=(0, 1)) - margin * tall, places.max(axis=(0, 1)) + margin * tall
    corner = np.floor(low)
    orders = _orders(acting, casting, depths)
    tracks, keysets = [], []
    for name, (start, stop, parent, limb) in hung.parts.items():
        keyset = _quad(start - corner, stop - corner, THIN * tall)
        moved = maps[name].copy()  # acts on the drawing's own pixels; here it goes from page to page
        moved[..., 2] += way + moved[..., :2] @ corner - corner
        tracks.append(_track(name, parent, start - corner, moved, orders[limb]))
        keysets.append(keyset)
    size = tuple(int(edge) for edge in np.ceil(high - corner))
    times = np.arange(len(acting.positions)) / acting.fps
    return relative_to_parents(CartoonMotion(tuple(tracks), tuple(keysets), times, float(acting.fps), size))


def _lie(
    acting: Performer, bone: Bone, casting: Casting, foreshorten: float
) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """A bone's pieces on the page (T, n): their turn against the drawing, stretch, thickness; and depth (T,)."""
    marks, view = casting.marks, casting.views.seen(bone.part)
    vectors, stretch, thick, rest = sub_links(acting, bone)
    seen = vectors @ view.T
    length = np.maximum(np.linalg.norm(vectors, axis=-1), 1e-12)
    flat = (seen[..., 0] - 1j * seen[..., 1]) / length  # y down; its size is the share that shows
    direction = _steady(flat, acting.fps)
    drawn = marks.places[bone.mark] - marks.places[marks.parents[bone.mark]]
    start, whole = complex(*drawn), 1.0
    if not bone.pointing:
        seen_rest = rest @ view.T
        start = seen_rest[:, 0] - 1j * seen_rest[:, 1]
        whole = np.abs(start)  # the share of each piece that shows at rest
        if (
            whole.min() < SIDEWAYS
        ):  # it has no direction at rest where it is looked at from: it goes with what it hangs on
            nothing = np.zeros(flat.shape)
            return np.full(flat.shape, np.nan), nothing + 1, thick, nothing[:, 0]
    shown = stretch * np.maximum((1 - foreshorten) + foreshorten * np.abs(flat) / whole, LEAST)
    return np.angle(direction / start), shown, thick, _depth(acting, bone, casting)


def _steady(flat: NDArray, fps: float) -> NDArray:
    """Directions (T, n) as complex numbers; where little of them shows, taken from the frames around."""
    from scipy.ndimage import gaussian_filter1d

    size = np.abs(flat)
    low, high = CLEAR
    if size.min(initial=1.0) >= high or len(flat) < 2:
        return flat
    sure = np.clip((size - low) / (high - low), 0, 1)
    sure = sure * sure * (3 - 2 * sure)
    weighted = flat * size
    around = gaussian_filter1d(weighted.real, UNSURE * fps, axis=0, mode="nearest") + 1j * gaussian_filter1d(
        weighted.imag, UNSURE * fps, axis=0, mode="nearest"
    )
    mixed = sure * flat / np.maximum(size, 1e-12) + (1 - sure) * around / np.maximum(np.abs(around), 1e-12)
    return np.where(np.abs(mixed) > 1e-9, mixed, around + 1e-12)


def _depth(acting: Performer, bone: Bone, casting: Casting) -> NDArray:
    """How much nearer to the viewer a bone is (T,), in metres, than what its limb hangs on.

    On a drawing that is seen as its limbs are, that is the middle of the hips; on one that shows its front while its
    legs are seen from the side, both legs hang beside each other all the same, and each is measured from its own root.
    """
    views = casting.views
    limb = bone.limb.rpartition(" ")[0], {"arms": "shoulder", "legs": "hip"}.get(bone.part, "")
    alike = getattr(views, bone.part) == views.trunk and views.trunk != viewing.FRONT
    root = casting.roles.get("hips" if alike else " ".join(limb).strip(), casting.roles.get("hips", (0, 0)))[1]
    first, last = bone.joints
    middle = acting.positions[:, acting.ends[[first, last]]].mean(axis=1)
    away = viewing.turned((middle - acting.positions[:, acting.ends[root]])[:, None], acting.heading)[:, 0]
    return (away @ views.seen(bone.part).T)[:, 2]


def _pelvis(casting: Casting, turns: dict[int, NDArray], frames: int) -> NDArray:
    """How far the root's own part is turned (T,): as the hips are, or half as far as the trunk on them."""
    for bone in casting.bones:
        hips = bone.across and casting.marks.parents[bone.mark] in _roots(casting.marks)
        if hips and bone.mark in turns and not np.isnan(turns[bone.mark]).any():
            return turns[bone.mark][:, 0]
    chest = casting.roles.get("chest", (-1, -1))[0]
    return 0.5 * turns[chest][:, 0] if chest in turns else np.zeros(frames)


def _roots(marks: Marks) -> set[int]:
    """The root and the joints that are marked in the same place."""
    found = {joint for joint, parent in enumerate(marks.parents) if parent < 0}
    for joint, parent in enumerate(marks.parents):
        if parent in found and marks.lengths()[joint] == 0:
            found.add(joint)
    return found


class _Chain:
    """Bones put end to end: where the marks come to lie (T, J, 2) while the root stays, and the maps of all parts."""

    def __init__(
        self,
        casting: Casting,
        pelvis: NDArray,
        turns: dict[int, NDArray],
        lengths: dict[int, NDArray],
        widths: dict[int, NDArray],
    ) -> None:
        marks = casting.marks
        bones = {bone.mark: bone for bone in casting.bones}
        self.places = np.repeat(marks.places[None], len(pelvis), axis=0).astype(float)
        self.maps: dict[str, NDArray] = {}
        self.parts: dict[str, tuple[NDArray, NDArray, str, str]] = {}  # name: start, stop, parent, limb
        held: dict[int, str] = {}  # the part that carries each joint
        for joint, parent in enumerate(marks.parents):
            here = marks.places[joint]
            if parent < 0:
                name = marks.names[joint]
                self._put(name, here, here, "", "trunk", _linear(pelvis, 0.0), self.places[:, joint])
                held[joint] = name
                continue
            if joint not in bones:  # marked in its parent's place
                held[joint], self.places[:, joint] = held[parent], self.places[:, parent]
                continue
            bone, start = bones[joint], self.places[:, parent]
            follows = joint in turns and not np.isnan(turns[joint]).any()
            count = bone.pieces if follows else 1
            step = (here - marks.places[parent]) / count
            angle = np.arctan2(step[1], step[0])
            above = held[parent]
            for k in range(count):
                name = marks.names[joint] if count == 1 else f"{marks.names[joint]} {k + 1}"
                if follows:
                    linear = _linear(turns[joint][:, k], angle, lengths[joint][:, k], widths[joint][:, k])
                else:
                    carried = affine.turn(self.maps[above])
                    linear = _linear(carried, 0.0)
                drawn = marks.places[parent] + k * step
                self._put(name, drawn, drawn + step, above, bone.limb, linear, start)
                start = start + linear @ step
                above = name
            self.places[:, joint], held[joint] = start, above

    def _put(
        self, name: str, start: NDArray, stop: NDArray, parent: str, limb: str, linear: NDArray, place: NDArray
    ) -> None:
        shift = place - linear @ start
        self.maps[name] = np.concatenate([linear, shift[..., None]], axis=-1)
        self.parts[name] = (np.asarray(start, float), np.asarray(stop, float), parent, limb)


def _linear(turn: NDArray, drawn: float, along: NDArray | float = 1.0, across: NDArray | float = 1.0) -> NDArray:
    """Maps (T, 2, 2) that stretch along the drawn direction and across it, then turn."""
    turn = np.asarray(turn, float)
    along, across = np.broadcast_to(along, turn.shape), np.broadcast_to(across, turn.shape)
    out, back = _rotations(turn + drawn), _rotations(np.full(turn.shape, -drawn))
    return out * np.stack([along, across], axis=-1)[:, None, :] @ back


def _rotations(angle: NDArray) -> NDArray:
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([np.stack([c, -s], -1), np.stack([s, c], -1)], -2)


def _orders(acting: Performer, casting: Casting, depths: dict[int, NDArray]) -> dict[str, NDArray]:
    """The drawn order (T,) of each limb: the trunk's is 0, a limb before it has more; no limb flickers to and fro."""
    tall = acting.tall
    orders = {"trunk": np.zeros(len(acting.positions), int)}
    for limb in dict.fromkeys(bone.limb for bone in casting.bones if bone.limb != "trunk"):
        own = [depths[bone.mark] for bone in casting.bones if bone.limb == limb and bone.mark in depths]
        near = np.mean(own, axis=0) if own else np.zeros(len(acting.positions))
        arm, middle = limb.endswith("arm"), float(np.median(near)) / tall
        state, states = middle > 0 if abs(middle) > BEFORE else arm, []
        for depth in near / tall:
            state = depth > -BEFORE if state else depth > BEFORE
            states.append(state)
        orders[limb] = np.where(states, 1, -1) * (2 if arm else 1)
    return orders


def _track(name: str, parent: str, pivot: NDArray, moved: NDArray, order: NDArray) -> Track:
    frames = len(moved)
    return Track(
        part=name,
        parent=parent,
        pivot=pivot,
        keys=("rest",),
        rows=np.zeros((1, 3)),
        affine=affine.from_about(moved, pivot),
        weights=np.ones((frames, 1)),
        residual=np.zeros(frames),
        visible=np.ones(frames, bool),
        held=np.zeros(frames, bool),
        order=order.astype(int),
    )


def _quad(start: NDArray, stop: NDArray, width: float) -> KeySet:
    """A thin quad (4, 2) round a sub-link as the one key of its part; a root's is a small square."""
    way = stop - start
    length = np.linalg.norm(way)
    if length < 1e-9:
        start, stop, way = start - [0, 0.5 * width], start + [0, 0.5 * width], np.array([0, width])
        length = width
    side = 0.5 * width * np.array([-way[1], way[0]]) / length
    corners = np.stack([start + side, stop + side, stop - side, start - side])
    faces, outline = np.array([[0, 1, 2], [0, 2, 3]]), np.arange(4)
    return KeySet(("rest",), corners[None], faces, outline, np.zeros((1, 3)), affine.identity()[None])
