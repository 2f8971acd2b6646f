"""What a cast says of the staging, done to a performance: who stands in front, the ground, a path, feet that stay."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.motion import triangulate
from capture.motion.tracks import CartoonMotion
from retarget.characters.bodies.body import Body
from retarget.characters.casts.castlist import Cast, CastKeep
from retarget.characters.target import parts_of
from retarget.stage import legs, staging
from retarget.stage.legs import Leg
from retarget.stage.perform import Performance, Role
from retarget.stage.staging import Stay

BESIDE = 0.25
"""A point that is kept lies within this share of its drawing's size of the drawing."""


@dataclass(frozen=True)
class Slid:
    """How far, in pixels, the foot that slides most did so as it came, and does now."""

    before: float
    after: float

    def __str__(self) -> str:
        return f"feet slid by {self.before:.1f} px, now by {self.after:.1f}"


def direct(performance: Performance, cast: Cast, motion: CartoonMotion) -> tuple[Performance, Slid | None]:
    """The performance as the cast wants it, and how far feet slide; None where none is on the ground, nor kept.

    In this order: all on the source's ground, all along the path, then the feet that are kept, by moving the whole
    figure, or by bending their legs where they have some.
    """
    staged = ordered(performance, cast)
    staged = staging.stand(staged, motion) if cast.ground else staged
    staged = staging.follow(staged, np.array(cast.follow)) if cast.follow else staged
    drawing = staging.drawings(motion)
    told: dict[Leg | None, list[Stay]] = {None: []}
    stretch: dict[Leg | None, float] = {}
    for keep in cast.keep:
        leg = _leg(staged, keep, motion)
        told.setdefault(leg, []).extend(stays_of(staged, keep, motion))
        stretch[leg] = max(keep.stretch, stretch.get(leg, 0.0))
    staged = staging.keep(staged, told[None], drawing=drawing) if told[None] else staged
    for leg, stays in told.items():
        if leg is not None:
            staged = legs.bend(staged, leg, stays, stretch[leg], drawing=drawing)
    return staged, slid(performance, staged, [stay for stays in told.values() for stay in stays], motion)


def ordered(performance: Performance, cast: Cast) -> Performance:
    """The performance with whoever has an order in the cast at that place in the pile, in every frame."""
    told = {part.name: part.order for part in cast.parts if part.order is not None}
    bodies = {body.drawing: body.order for body in cast.bodies if body.order is not None}
    roles = []
    for role in performance.roles:
        target = role.target
        order = bodies.get(target.inner.part) if isinstance(target, Body) else told.get(target.part)
        roles.append(role if order is None else replace(role, order=np.full_like(role.order, order)))
    return replace(performance, roles=tuple(roles))


def stays_of(performance: Performance, keep: CastKeep, motion: CartoonMotion) -> list[Stay]:
    """What a cast keeps as stays: over its frames, or one for every contact of the source's part with the ground."""
    role = staging.role_of(performance, keep.part)
    if keep.frames is not None:
        spans = [(keep.frames[0], keep.frames[1] + 1)]
        if spans[0][1] > len(performance.times):
            raise InputError(
                f"part {keep.part!r} must be kept in frames of the clip, 0 to {len(performance.times) - 1}, "
                f"got {keep.frames[0]} to {keep.frames[1]}: correct frames"
            )
    else:
        spans = [(one.start, one.stop) for one in staging.contacts(motion) if one.part == keep.part]
    if not spans:
        raise InputError(
            f"part {keep.part!r}: a part that is kept without frames must touch the ground in the source, it never "
            "does: add frames = [first, last]"
        )
    place = None if keep.at is None else np.array(keep.at, float)
    stays = []
    for start, stop in spans:
        points, shares = _point(role, keep) if keep.point else _lowest(role, keep.part, start, stop)
        stays.append(Stay(keep.part, start, stop, points, place, shares))
    return stays


def slid(before: Performance, after: Performance, stays: list[Stay], motion: CartoonMotion) -> Slid | None:
    """How far the worst foot slides in both: of those in contact with the source's ground, and of those kept."""
    played = {part for role in before.roles for part in parts_of(role.target)}
    contacts = [one for one in staging.contacts(motion) if one.part in played]
    if not contacts and not stays:
        return None
    worst = []
    for performance in (before, after):
        ways = [staging.foot_of(performance, stay)[stay.start : stay.stop] for stay in stays]
        told = [float(np.linalg.norm(np.ptp(way, axis=0))) for way in ways]
        kept = {(stay.part, t) for stay in stays for t in range(stay.start, stay.stop)}
        free = [one for one in contacts if not any((one.part, t) in kept for t in range(one.start, one.stop))]
        worst.append(max([*told, *(staging.slide(performance, one) for one in free)]))
    return Slid(*worst)


def _leg(performance: Performance, keep: CastKeep, motion: CartoonMotion) -> Leg | None:
    """The leg that bends for what is kept; None where the whole figure moves."""
    leg = None if keep.bend == () else legs.leg_of(motion, keep.part, keep.bend)
    played = {part for role in performance.roles for part in parts_of(role.target)}
    if leg is None or {leg.upper[0], leg.lower[0]} <= played:
        return leg
    if keep.bend is None:
        return None
    raise InputError(f"keep of part {keep.part!r}: parts that bend must be played, {' and '.join(keep.bend)} are not")


def _lowest(role: Role, part: str, start: int, stop: int) -> tuple[NDArray, NDArray]:
    points = role.of(part)
    return points, staging.sole(role.mesh()[start:stop, points])


def _point(role: Role, keep: CastKeep) -> tuple[NDArray, NDArray]:
    """The points of the role's mesh that a point of its first key lies between, and their shares."""
    mesh, point = role.target.keys.points[0], np.array(keep.point)
    low, high = mesh.min(axis=0), mesh.max(axis=0)
    if len(point) != len(low) or (np.abs(point - (low + high) / 2) > (0.5 + BESIDE) * (high - low)).any():
        box = ", ".join(f"{a:.4g} to {b:.4g}" for a, b in zip(low, high, strict=True))
        raise InputError(
            f"keep of part {keep.part!r}: point must lie on the first key's drawing, which covers {box}, "
            f"got {list(keep.point)}"
        )
    if len(point) == 3:
        return np.array([np.linalg.norm(mesh - point, axis=1).argmin()]), np.ones(1)
    face, shares = triangulate.locate(point[None], mesh, role.target.keys.faces)
    return role.target.keys.faces[face[0]], shares[0]
