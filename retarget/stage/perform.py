"""Motion meets target (Bregler et al. 2002, section 3.4).

The affine maps of the target's keys are taken out against its own key 0 (eq. 5), its in-betweens are mixed
with the captured weights, and the captured affine maps are put back about the target's own pivots.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.motion import affine
from capture.motion.tracks import CartoonMotion, Track, total_affine
from retarget.characters.bodies.body import Body
from retarget.characters.figures.puppet import Puppet
from retarget.characters.models import lift
from retarget.characters.places import box_of, foot_of, onto
from retarget.characters.target import REST, Target, parts_of
from retarget.stage import together
from retarget.stage.together import Limbs


@dataclass(frozen=True, eq=False)
class Role:
    """One target playing its part through T frames."""

    target: Target
    points: NDArray  # (T, M, 2 or 3) on the stage, the mesh's points first; a third column goes to the viewer
    weights: NDArray  # (T, K) folded onto keys
    scale: float  # stage pixels for one of the target's units
    visible: NDArray  # (T,) bool
    order: NDArray  # (T,) int, higher is drawn later
    rows: NDArray  # (D, 3) the in-betweens that were mixed ...
    mixed: NDArray  # (T, D) ... and by which weights: exporters of shapes lend these on
    joint: NDArray  # (T, 2) where on the stage its pivot is: there it hangs on its parent
    limbs: Limbs | None = None  # of a body that plays several parts

    def mesh(self) -> NDArray:
        """Where the target's mesh is in every frame (T, N, 2 or 3)."""
        return self.points[:, : self.target.keys.points.shape[1]]

    def of(self, part: str) -> NDArray:
        """The mesh's points (n,) that are the part's more than any other's; all where the target plays one part."""
        count = self.target.keys.points.shape[1]
        if not isinstance(self.target, Body):
            return np.arange(count)
        return np.flatnonzero(self.target.shares[:count].argmax(axis=1) == self.target.parts.index(part))

    def joint_of(self, part: str) -> NDArray:
        """Where on the stage (T, 2) the part hangs on its parent."""
        return self.joint if self.limbs is None else self.limbs.joints[self.target.parts.index(part)]

    def after(self, maps: Mapping[str, NDArray]) -> "Role":
        """The role with its parts moved further by maps of the plane (T, 2, 3), by their names."""
        still = np.tile(affine.identity(), (len(self.points), 1, 1))
        if self.limbs is not None:
            limbs = together.moved(self.limbs, np.stack([maps.get(part, still) for part in self.target.parts]))
            points = together.points_of(limbs, self.target.shares)
            return replace(self, points=points, joint=limbs.joints[0], limbs=limbs)
        own = maps.get(self.target.part, still)
        points = self.points.copy()
        points[..., :2] = affine.apply(own, points[..., :2])
        return replace(self, points=points, joint=affine.apply(own, self.joint[:, None])[:, 0])


@dataclass(frozen=True, eq=False)
class Performance:
    """All roles over the motion's frames: everything a renderer or an exporter needs."""

    roles: tuple[Role, ...]
    times: NDArray  # (T,) seconds
    fps: float
    size: tuple[int, int]  # width and height of the stage

    def posed(self, t: int, zoom: float = 1.0) -> list[Any]:
        """Everything seen in frame t, back to front; `zoom` enlarges the stage about its top-left corner."""
        seen = [role for role in self.roles if role.visible[t]]
        things = []
        for role in sorted(seen, key=lambda role: role.order[t]):  # stable: equal orders keep the tracks' order
            points = role.points[t] if zoom == 1 else (role.points[t] + 0.5) * zoom - 0.5
            things += role.target.posed(points, role.weights[t], role.scale * zoom)
        return things


def perform(motion: CartoonMotion, targets: Iterable[Target]) -> Performance:
    """Let targets play a motion; parts that no target plays are not seen."""
    if motion.space != "pixels, y down":
        raise InputError(f"a drawing needs a motion in pixels, y down, this one is in {motion.space}: project it first")
    targets = list(targets)
    played = {part: target for target in targets for part in parts_of(target)}
    if len(played) < sum(len(parts_of(target)) for target in targets):
        raise InputError("a part must be played by one target only: name each part once in the cast")
    for target in targets:
        if isinstance(target, Body):
            together.check(motion, target)
        else:
            _check_keys(motion.track(target.part), target)
    stands = standing(motion, played)
    scaled = tuple(_travelling(track, played.get(track.part)) for track in motion.tracks)
    lent = replace(motion, tracks=scaled)
    pivots = {track.part: _pivot(track, played.get(track.part), motion, stands) for track in motion.tracks}
    in_order = sorted(targets, key=lambda target: [track.part for track in motion.tracks].index(target.part))
    roles = tuple(
        _body(motion, target) if isinstance(target, Body) else _role(lent, target, pivots, stands)
        for target in in_order
    )
    return Performance(roles, motion.times, motion.fps, motion.size)


def _role(motion: CartoonMotion, target: Target, pivots: dict[str, NDArray], stands: dict[str, NDArray]) -> Role:
    track = motion.track(target.part)
    rest = target.keys.names == (REST,)
    rows = np.zeros((1, 3)) if rest else track.rows
    weights = np.ones((len(track), 1)) if rest else track.weights
    folded = weights if rest else track.key_weights()
    if isinstance(target, Puppet):  # joints do not mix as points do
        shape, rows, weights = target.acted(folded), _key_rows(len(target.keys.names)), folded
    else:
        shape = np.tensordot(weights, target.shapes(rows), axes=1)  # (T, M, 2)
    place = affine.compose(stands[target.part], placement(motion, target))
    moved = total_affine(motion, target.part, pivots)
    joint = affine.apply(moved, pivots[target.part][None])[:, 0]
    scale = float(np.hypot(*place[:, 0]))
    if shape.shape[-1] == 3:  # what moves the drawing moves the model in the plane it is seen in
        place = affine.compose(lift.lifted(place, scale), target.view)
        moved = lift.lifted(moved, target.depth(moved))
    points = affine.apply(affine.compose(moved, place), shape)
    return Role(target, points, folded, scale, track.visible, track.order, rows, weights, joint)


def _body(motion: CartoonMotion, target: Body) -> Role:
    """The role of a body: its first part's weights are those its paint is mixed by, and its place in the pile."""
    limbs, scale = together.together(motion, target)
    points = together.points_of(limbs, target.shares)
    first, played = motion.track(target.part), [motion.track(part) for part in target.parts]
    rest = target.keys.names == (REST,)
    rows = np.zeros((1, 3)) if rest else first.rows
    weights = np.ones((len(first), 1)) if rest else first.weights
    folded = weights if rest else first.key_weights()
    visible = np.any([track.visible for track in played], axis=0)
    return Role(target, points, folded, scale, visible, first.order, rows, weights, limbs.joints[0], limbs)


def _key_rows(count: int) -> NDArray:
    """Rows (K, 3) of the keys themselves."""
    return np.stack([np.arange(count), np.arange(count), np.zeros(count)], axis=-1)


def placement(motion: CartoonMotion, target: Target) -> NDArray:
    """The similarity (2, 3) that stands the target's key 0 on the source's: as tall, on the same ground."""
    return onto(target.box, _box(motion, target.part))


def standing(motion: CartoonMotion, played: dict[str, Target]) -> dict[str, NDArray]:
    """Per part the similarity (2, 3) from the source's size to the target's.

    A part that hangs on nothing grows from the ground up, about the bottom centre of its key 0.  Any other
    grows about its pivot, and its pivot goes where its parent takes it: joints stay joints.
    """
    maps = {}

    def of(track: Track) -> NDArray:
        if track.part not in maps:
            height = _height(played.get(track.part))
            fixed = track.pivot if track.parent else foot_of(_box(motion, track.part))
            goal = affine.apply(of(motion.track(track.parent)), fixed[None])[0] if track.parent else fixed
            maps[track.part] = np.column_stack([height * np.eye(2), goal - height * fixed])
        return maps[track.part]

    for track in motion.tracks:
        total_affine(motion, track.part)  # refuses a part that is its own parent
        of(track)
    return maps


def _height(target: Target | None) -> float:
    return 1.0 if target is None else target.height


def _travelling(track: Track, target: Target | None) -> Track:
    """The track with its travel scaled by the target's height."""
    scaled = track.affine.copy()
    scaled[..., -1] *= _height(target)
    return replace(track, affine=scaled)


def _pivot(track: Track, target: Target | None, motion: CartoonMotion, stands: dict[str, NDArray]) -> NDArray:
    """Where on the stage a part turns: the target's own pivot, or the source's carried along."""
    point = track.pivot
    if target is not None and target.pivot is not None:
        own = np.asarray(target.pivot, float)[None]
        seen = own if own.shape[1] == 2 else affine.apply(target.view, own)[:, :2]
        point = affine.apply(placement(motion, target), seen)[0]
    return affine.apply(stands[track.part], point[None])[0]


def _box(motion: CartoonMotion, part: str) -> NDArray:
    """Least and greatest corner (2, 2) of the source's key 0."""
    keyset = motion.keyset(part)
    return box_of(keyset.points[0, keyset.outline])


def _check_keys(track: Track, target: Target) -> None:
    names = target.keys.names
    if names not in (track.keys, (REST,)):
        raise InputError(
            f"part {track.part!r}: the motion uses keys {', '.join(track.keys)}, the target has "
            f"{', '.join(names)}: give it a drawing for each of the motion's keys, in that order"
        )
