"""One body moved by several parts' tracks, softly where they meet (Bregler et al. 2002, section 3.1.4)."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.motion import affine
from capture.motion.tracks import CartoonMotion, Track, total_affine
from retarget.characters import lift
from retarget.characters.body import Body
from retarget.characters.places import box_of, foot_of, from_frame, onto
from retarget.characters.target import REST


def together(motion: CartoonMotion, body: Body) -> tuple[NDArray, float, NDArray]:
    """Where all points (T, M, 2 or 3) of a body are, stage pixels for its unit, and the first part's joint (T, 2)."""
    place, scale, maps, joint = _moves(motion, body)
    rest = body.keys.names == (REST,)
    own = body.shapes(np.zeros((1, 3)))
    if rest:
        shape = own
    else:
        shape = np.zeros((len(motion.times), *own.shape[1:]))
        for part, share in zip(body.parts, body.shares.T, strict=True):
            track = motion.track(part)
            shape += share[:, None] * np.tensordot(track.weights, body.shapes(track.rows), axes=1)
    if shape.shape[-1] == 3:
        place = affine.compose(lift.lifted(place, scale), body.inner.view)
        maps = [lift.lifted(one, body.inner.depth(one)) for one in maps]
    shape = affine.apply(place, shape)
    points = sum(share[:, None] * affine.apply(one, shape) for share, one in zip(body.shares.T, maps, strict=True))
    return points, scale, joint


def _moves(motion: CartoonMotion, body: Body) -> tuple[NDArray, float, list[NDArray], NDArray]:
    """From the drawing to the stage (2, 3), its scale, what then moves each part (T, 2, 3), and the first's joint."""
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
    moves = [affine.compose(total_affine(lent, part, pivots), turned[part]) for part in body.parts]
    first = body.parts[0]
    joint = affine.apply(total_affine(lent, first, pivots), pivots[first][None])[:, 0]
    return place, float(np.hypot(*place[:, 0])), moves, joint


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
