"""One body moved by several parts' tracks, softly where they meet (Bregler et al. 2002, section 3.1.4)."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.motion import affine
from capture.motion.tracks import CartoonMotion, Track, total_affine
from retarget.characters.bodies.body import Body
from retarget.characters.models import lift
from retarget.characters.places import box_of, foot_of, from_frame, onto
from retarget.characters.target import REST


@dataclass(frozen=True, eq=False)
class Limbs:
    """How a body of P parts comes to be where it is: v(t) = sum_p b_p A_p(t) x(t)."""

    shape: NDArray  # (1 or T, M, 2 or 3), x on the stage before anything moves
    maps: NDArray  # (P, T, d, d + 1)
    joints: NDArray  # (P, T, 2) where on the stage each part hangs


def together(motion: CartoonMotion, body: Body) -> tuple[Limbs, float]:
    """How a body moves, and stage pixels for its unit."""
    place, scale, maps, joints = _moves(motion, body)
    own = body.shapes(np.zeros((1, 3)))
    if body.keys.names == (REST,):
        shape = own
    else:
        shape = np.zeros((len(motion.times), *own.shape[1:]))
        for part, share in zip(body.parts, body.shares.T, strict=True):
            track = motion.track(part)
            shape += share[:, None] * np.tensordot(track.weights, body.shapes(track.rows), axes=1)
    if shape.shape[-1] == 3:
        place = affine.compose(lift.lifted(place, scale), body.inner.view)
        maps = lift.lifted(maps, body.inner.depth(maps))
    return Limbs(affine.apply(place, shape), maps, joints), scale


def points_of(limbs: Limbs, shares: NDArray) -> NDArray:
    """Where all points (T, M, 2 or 3) are, with shares (M, P)."""
    return sum(share[:, None] * affine.apply(one, limbs.shape) for share, one in zip(shares.T, limbs.maps, strict=True))


def moved(limbs: Limbs, after: NDArray) -> Limbs:
    """The limbs with maps of the plane (P, T, 2, 3) done to each part afterwards."""
    space = after if limbs.maps.shape[-1] == 3 else lift.lifted(after, np.ones(after.shape[:-2]))
    joints = affine.apply(after, limbs.joints[..., None, :])[..., 0, :]
    return replace(limbs, maps=affine.compose(space, limbs.maps), joints=joints)


def _moves(motion: CartoonMotion, body: Body) -> tuple[NDArray, float, NDArray, NDArray]:
    """From the drawing to the stage (2, 3), its scale, what then moves each part (P, T, 2, 3), and joints (P, T, 2)."""
    outlines = [motion.outline(part)[body.frame] for part in body.parts]
    there = box_of(np.concatenate(outlines))
    foot, height = foot_of(there), body.height
    stand = np.column_stack([height * np.eye(2), (1 - height) * foot])
    place = affine.compose(stand, onto(body.box, there))
    lent = from_frame(motion, body.frame)
    lent = replace(lent, tracks=tuple(_travelling(track, height) for track in lent.tracks))
    pivots = {track.part: affine.apply(stand, track.pivot[None])[0] for track in lent.tracks}
    drawn = affine.apply(place, body.joints)
    pivots |= {part: joint for part, joint in zip(body.parts, drawn, strict=True) if np.isfinite(joint).all()}
    turned: dict[str, NDArray] = {}
    for part, turn in zip(body.parts, body.turns, strict=True):
        above = next((name for name in _above(lent, part) if name in turned), None)
        goal = pivots[part] if above is None else affine.apply(turned[above], pivots[part][None])[0]
        linear = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        turned[part] = np.column_stack([linear, goal - linear @ pivots[part]])
        pivots[part] = goal
    totals = np.stack([total_affine(lent, part, pivots) for part in body.parts])
    joints = np.stack(
        [affine.apply(one, pivots[part][None])[:, 0] for part, one in zip(body.parts, totals, strict=True)]
    )
    maps = affine.compose(totals, np.stack([turned[part] for part in body.parts])[:, None])
    return place, float(np.hypot(*place[:, 0])), maps, joints


def check(motion: CartoonMotion, body: Body) -> None:
    """Refuse a body with keys that are not those of every part it plays."""
    for part in body.parts:
        names = motion.track(part).keys
        if body.keys.names not in (names, (REST,)):
            raise InputError(
                f"part {part!r}: the motion uses keys {', '.join(names)}, the body that plays it has "
                f"{', '.join(body.keys.names)}: give it one drawing, or the same keys as all its parts"
            )


def _above(motion: CartoonMotion, part: str) -> list[str]:
    line, name = [], motion.track(part).parent
    while name:
        line.append(name)
        name = motion.track(name).parent
    return line


def _travelling(track: Track, height: float) -> Track:
    scaled = track.affine.copy()
    scaled[..., -1] *= height
    return replace(track, affine=scaled)
