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
from mocap.hung import Lie, hung, swung
from mocap.marks import Marks
from mocap.rubber.rubber import RubberMotion
from mocap.skeleton import SkeletonMotion
from mocap.travel import travelled

LEAST = 0.25
"""What foreshortening leaves of a bone that points at the viewer: a drawing has no end of it to show."""

SIDEWAYS = 0.5
"""Shoulders, hips and feet of which less shows at rest, as a share of their length, go with what they hang on."""

CLEAR = (0.2, 0.6)
"""A limb that shows less than this share of its length has no direction; from the second share on it has its own.

With more than half of its foreshortening kept the shares go down to 0: then it is short, and may point anywhere."""

UNSURE = 0.12
"""Seconds around, from where a direction is taken while a limb points at the viewer."""

BEFORE = 0.05
"""A limb goes to the other side of the body when it is there by this share of the performer's height, and comes back
when it is there by less than half of it."""

THIN = 0.15
"""A sub-link's quad is this wide, as a share of its bone's length."""


def to_tracks(
    motion: SkeletonMotion | RubberMotion,
    marks: Marks,
    casting: Casting | None = None,
    foreshorten: float = 0.5,
    margin: float = 0.35,
    swing: bool = True,
) -> CartoonMotion:
    """A motion, upright and in metres, lent to a drawing's marks: a part for each (sub-)link, in pixels, y down.

    `foreshorten` is how much of a limb's foreshortening is kept: with 0 a drawing stays as flat as it is drawn, with 1
    it is seen as the performer is.  What nobody plays, such as a tail, may `swing` after the body.  The page holds the
    whole way, and `margin` of the figure's height round it.
    """
    casting = cast_marks(motion, marks) if casting is None else casting
    acting = performer(motion, casting.views.turning, sided=not any(bone.believed for bone in casting.bones))
    lies = {bone.mark: _lie(acting, bone, casting, foreshorten) for bone in casting.bones if bone.joints is not None}
    lies = {mark: lie for mark, lie in lies.items() if lie is not None}
    body = hung(marks, casting.bones, lies, _pelvis(casting, lies, len(acting.positions)))
    way = travelled(acting, casting, body.places)
    if swing:
        body = swung(body, marks, {*lies, *(mark for mark, _ in casting.roles.values())}, way, acting.fps)
    places = body.places + way[:, None]
    tall = float(np.ptp(marks.places[:, 1])) or float(np.ptp(marks.places))
    corner = np.floor(places.min(axis=(0, 1)) - margin * tall)
    high = places.max(axis=(0, 1)) + margin * tall
    orders = _orders(acting, casting, lies)
    tracks, keysets = [], []
    for part in body.parts:
        keysets.append(_quad(part.start - corner, part.stop - corner, THIN * tall))
        moved = part.maps.copy()  # acts on the drawing's own pixels; here it goes from page to page
        moved[..., 2] += way + moved[..., :2] @ corner - corner
        tracks.append(_track(part.name, part.parent, part.start - corner, moved, orders[part.limb]))
    size = tuple(int(edge) for edge in np.ceil(high - corner))
    times = np.arange(len(acting.positions)) / acting.fps
    return relative_to_parents(CartoonMotion(tuple(tracks), tuple(keysets), times, float(acting.fps), size))


def _lie(acting: Performer, bone: Bone, casting: Casting, foreshorten: float) -> Lie | None:
    """How a bone's pieces lie on the page; None if it has no direction there and goes with what it hangs on."""
    marks, view = casting.marks, casting.views.seen(bone.part)
    vectors, stretch, thickness, rest = sub_links(acting, bone)
    seen = vectors @ view.T
    length = np.maximum(np.linalg.norm(vectors, axis=-1), 1e-12)
    flat = (seen[..., 0] - 1j * seen[..., 1]) / length  # y down; its size is the share that shows
    drawn = complex(*(marks.places[bone.mark] - marks.places[marks.parents[bone.mark]]))
    start, whole, sense = drawn, 1.0, 1.0
    if not bone.pointing:
        seen_rest = rest @ view.T
        start = seen_rest[:, 0] - 1j * seen_rest[:, 1]
        whole = np.abs(start)  # the share of each piece that shows at rest
        if whole.min() < SIDEWAYS:
            return None
        if bone.part == "legs" and drawn.real * start[0].real < 0:
            sense = -1.0  # a foot that is drawn the other way round lifts its own heel
    shown = stretch * _shown(np.abs(flat) / whole, foreshorten)
    clear = np.array(CLEAR) * min(1.0, 2 * (1 - foreshorten))
    turn = sense * np.angle(_steady(flat, acting.fps, *clear) / start)
    return Lie(turn, shown, thickness, _depth(acting, bone, casting))


def _shown(flat: NDArray, foreshorten: float) -> NDArray:
    """How much of its length a bone keeps of which a share `flat` shows.

    One that swings past the viewer is short in between, however little is foreshortened else: it would whip round.
    """
    kept = (1 - foreshorten) + foreshorten * flat
    if 0 < foreshorten < 1:
        short = LEAST + ((1 - foreshorten) + foreshorten * CLEAR[1] - LEAST) * flat / CLEAR[1]
        kept = np.where(flat < CLEAR[1], np.minimum(kept, short), kept)
    return np.maximum(kept, LEAST)


def _steady(flat: NDArray, fps: float, low: float, high: float) -> NDArray:
    """Directions (T, n) as complex numbers; where less than `high` of them shows, mixed with those around."""
    from scipy.ndimage import gaussian_filter1d

    size = np.abs(flat)
    if size.min(initial=1.0) >= high or len(flat) < 2:
        return flat
    sure = np.clip((size - low) / max(high - low, 1e-12), 0, 1)
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


def _pelvis(casting: Casting, lies: dict[int, Lie], frames: int) -> NDArray:
    """How far the root's own part is turned (T,): as the hips are, or half as far as the trunk on them."""
    roots = _roots(casting.marks)
    for bone in casting.bones:
        if bone.across and casting.marks.parents[bone.mark] in roots and bone.mark in lies:
            return lies[bone.mark].turn[:, 0]
    chest = casting.roles.get("chest", (-1, -1))[0]
    return 0.5 * lies[chest].turn[:, 0] if chest in lies else np.zeros(frames)


def _roots(marks: Marks) -> set[int]:
    """The root and the joints that are marked in the same place."""
    found = {joint for joint, parent in enumerate(marks.parents) if parent < 0}
    for joint, parent in enumerate(marks.parents):
        if parent in found and marks.lengths()[joint] == 0:
            found.add(joint)
    return found


def _orders(acting: Performer, casting: Casting, lies: dict[int, Lie]) -> dict[str, NDArray]:
    """The drawn order (T,) of each limb: the trunk's is 0, a limb before it has more; no limb flickers to and fro."""
    tall = acting.tall
    orders = {"trunk": np.zeros(len(acting.positions), int)}
    for limb in dict.fromkeys(bone.limb for bone in casting.bones if bone.limb != "trunk"):
        own = [lies[bone.mark].depth for bone in casting.bones if bone.limb == limb and bone.mark in lies]
        near = np.mean(own, axis=0) if own else np.zeros(len(acting.positions))
        arm, middle = limb.endswith("arm"), float(np.median(near)) / tall
        usual = middle > 0 if abs(middle) > BEFORE else arm  # before the body, or behind it
        state, states = usual, []
        for depth in near / tall:
            away = -depth if usual else depth  # how clearly it is on the other side
            state = usual if away < BEFORE / 2 else not usual if away > BEFORE else state
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
