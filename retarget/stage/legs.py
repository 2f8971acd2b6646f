"""Two bones that bend for their foot: a knee gives way, so that the foot stays and the body goes on.

Hip H, knee K and foot F are where the performance has them, G is where the foot is to be.  The knee goes where both
bones keep their lengths a = |K - H| and b = |F - K| (law of cosines):

    |knee's bend| = arccos((d^2 - a^2 - b^2) / (2 a b)),    d = |G - H|, brought within |a - b| and a + b

A knee bends to one side only, the one it bends to most, so it never flips; a leg that was captured as straight as a
stick bends forward, as one goes.  What is out of reach is come as near to as can be.  In space all this happens in the
plane that is seen.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.motion import affine
from capture.motion.tracks import CartoonMotion
from retarget.characters.target import parts_of
from retarget.stage.perform import Performance
from retarget.stage.staging import Stay, demanded, foot_of, role_of

GIVES = 0.1
"""Seconds after which half of a foot's way to its place is forgotten: a step is short."""


@dataclass(frozen=True)
class Leg:
    """Two parts that hang on each other, and what goes along with each."""

    upper: tuple[str, ...]  # the thigh first
    lower: tuple[str, ...]  # the shin first
    foot: tuple[str, ...]  # a foot that hangs on the shin keeps its turn; () where it is of the shin itself


def leg_of(motion: CartoonMotion, part: str, bones: Sequence[str] | None = None) -> Leg | None:
    """The leg that `part` is the foot of: the bones told, or the part and what it hangs on.

    None without bones told where the part hangs on nothing, or on what hangs on nothing: a body is no thigh.
    """
    parents = {track.part: track.parent for track in motion.tracks}
    if part not in parents:
        raise InputError(
            f"a foot must be one of the motion's parts, {part!r} is none: name one of {', '.join(parents)}"
        )
    above = _line(parents, part)
    if bones is None:
        if len(above) < 3:
            return None
        upper, lower = above[1], above[0]
    else:
        upper, lower = bones
        if upper not in above or lower not in above or parents[lower] != upper:
            raise InputError(
                f"two parts that bend must hang on each other, and {part!r} on the second, {upper!r} and {lower!r} do "
                "not: name the thigh and then the shin"
            )
    foot = () if lower == part else (above[above.index(lower) - 1],)
    below = {name: _line(parents, name) for name in parents}
    hung = {one: [name for name in parents if one in below[name] and name != one] for one in (upper, lower, *foot)}
    with_foot = (*foot, *hung[foot[0]]) if foot else ()
    with_lower = (lower, *(name for name in hung[lower] if name not in with_foot))
    with_upper = (upper, *(name for name in hung[upper] if name not in (*with_lower, *with_foot)))
    return Leg(with_upper, with_lower, with_foot)


def bend(
    performance: Performance,
    leg: Leg,
    stays: Sequence[Stay],
    stretch: float = 0.0,
    half_life: float = GIVES,
    drawing: NDArray | None = None,
) -> Performance:
    """The performance with one leg bent so that its foot stays where it is told to, and nothing else moved.

    Before and after a stay the foot goes over calmly.  A leg gets longer by at most `stretch` times its length.
    """
    if not stays:
        return performance
    feet = [foot_of(performance, stay) for stay in stays]
    offset = demanded(performance.times, stays, feet, half_life, drawing)
    if not np.abs(offset).any():
        return performance
    hip, knee = (role_of(performance, parts[0]).joint_of(parts[0]) for parts in (leg.upper, leg.lower))
    foot = role_of(performance, leg.foot[0]).joint_of(leg.foot[0]) if leg.foot else _in_turn(stays, feet)
    upper, lower, ankle = two_bones(hip, knee, foot, foot + offset, stretch)
    along = np.tile(affine.identity(), (len(foot), 1, 1))
    along[..., 2] = ankle - foot
    maps = {**dict.fromkeys(leg.upper, upper), **dict.fromkeys(leg.lower, lower), **dict.fromkeys(leg.foot, along)}
    roles = [role.after(maps) if set(parts_of(role.target)) & set(maps) else role for role in performance.roles]
    return replace(performance, roles=tuple(roles))


def two_bones(
    hip: NDArray, knee: NDArray, foot: NDArray, goal: NDArray, stretch: float = 0.0
) -> tuple[NDArray, NDArray, NDArray]:
    """Maps (T, 2, 3) of the upper and of the lower bone that bring the foot to its goal, and where it then is (T, 2).

    Hip, knee, foot and goal are (T, 2).  The maps turn only, where the leg need not get longer.
    """
    thigh, shin, way = knee - hip, foot - knee, goal - hip
    a, b, d = (np.linalg.norm(bone, axis=-1) for bone in (thigh, shin, way))
    if min(a.min(), b.min()) <= 0:
        raise InputError("a leg's two bones must have a length, one has none: hip, knee and foot must lie apart")
    grown = np.clip(d / (a + b), 1, 1 + stretch)
    reach = np.clip(d, np.abs(a - b) * grown, (a + b) * grown) / grown
    bent = np.arccos(np.clip((reach**2 - a**2 - b**2) / (2 * a * b), -1, 1)) * side(hip, thigh, shin)
    # seen from the hip, the way to the foot is turned against the thigh by this
    ahead = np.arctan2(b * np.sin(bent), a + b * np.cos(bent))
    towards = np.where(d > 0, np.arctan2(way[:, 1], way[:, 0]), np.arctan2(*(foot - hip)[:, ::-1].T))
    of_thigh = towards - ahead
    of_shin = of_thigh + bent
    upper = _turned(thigh, of_thigh, grown)
    lower = _turned(shin, of_shin, grown)
    knee_there = hip + (upper @ thigh[..., None])[..., 0]
    ankle = knee_there + (lower @ shin[..., None])[..., 0]
    return _about(upper, hip, hip), _about(lower, knee, knee_there), ankle


def side(hip: NDArray, thigh: NDArray, shin: NDArray) -> float:
    """To which side a knee bends over all frames, 1 or -1, by its hip and bones (T, 2); 1 walks right."""
    turned = (thigh[:, 0] * shin[:, 1] - thigh[:, 1] * shin[:, 0]).sum()
    straight = abs(turned) < 1e-6 * (np.linalg.norm(thigh, axis=-1) * np.linalg.norm(shin, axis=-1)).sum()
    if straight:
        turned = (hip[-1] - hip[0])[0]
    return 1.0 if turned >= 0 else -1.0


def _line(parents: dict[str, str], part: str) -> list[str]:
    """The part, what it hangs on, and so on up to what hangs on nothing."""
    line = [part]
    while parents[line[-1]]:
        line.append(parents[line[-1]])
    return line


def _in_turn(stays: Sequence[Stay], feet: Sequence[NDArray]) -> NDArray:
    """The point (T, 2) that is the foot: of each stay its own, in between passing from one to the next."""
    order = np.argsort([stay.start for stay in stays], kind="stable")
    frames = np.arange(len(feet[0]))
    at = np.concatenate([[stays[n].start, stays[n].stop - 1] for n in order])
    at = np.maximum.accumulate(at)
    foot = np.zeros_like(feet[0])
    for place, number in enumerate(order):
        ends = np.zeros(len(at))
        ends[2 * place : 2 * place + 2] = 1
        foot += np.interp(frames, at, ends)[:, None] * feet[number]
    return foot


def _turned(bone: NDArray, to: NDArray, grown: NDArray) -> NDArray:
    """The maps (T, 2, 2) that turn a bone (T, 2) into a direction (T,), and make it longer but no thicker."""
    angle = np.arctan2(bone[:, 1], bone[:, 0])
    return _turn(to) @ (np.stack([grown, np.ones_like(grown)], axis=-1)[:, :, None] * _turn(-angle))


def _turn(angle: NDArray) -> NDArray:
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([np.stack([c, -s], axis=-1), np.stack([s, c], axis=-1)], axis=-2)


def _about(linear: NDArray, here: NDArray, there: NDArray) -> NDArray:
    """The maps (T, 2, 3) that do `linear` about `here` (T, 2) and bring that point `there`."""
    return np.concatenate([linear, (there - (linear @ here[..., None])[..., 0])[..., None]], axis=-1)
