"""Feet that stay where they stand: a performance moved as a whole, frame by frame (Bregler et al. 2002, section 3.4).

A character of other build sinks into the ground and slides when the captured affine motion is put on it.  What the
source did is known: the ground is the lowest level that it keeps coming back to, and a contact is a point of it that
is near the ground and hardly moves.  The new character is moved so that

- its lowest point is as high as the source's wherever that touches the ground, and never below the ground else;
- its foot, what stays lowest of it during a contact, goes where the source's foot goes.

Everything follows from what the source does, so a motion that is played on its own keys is left as it is, and a
source that skids, or that never touches a ground, is not corrected.  Offsets are added between drawings that are shown,
not between frames: a held drawing stays held.  In between they go over as calmly as can be (`offsets`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.motion.tracks import CartoonMotion
from retarget.characters.target import parts_of
from retarget.stage import offsets, together
from retarget.stage.perform import Performance, Role

TOUCHING = 0.025
"""A point within this share of the source's height of the ground touches it: soles are round, and they roll."""

RESTING = 0.4
"""A foot that moves at less than this many of the source's heights a second stands; a walker's feet swing at 2."""

SOLE = 0.01
"""A foot is what is lowest, give or take this share of a part's height."""

RISES, STRAYS = 0.15, 0.3
"""Seconds after which half of an offset is forgotten, up and down, and along the ground, where it shows less."""


@dataclass(frozen=True, eq=False)
class Contact:
    """A foot on the ground over frames start .. stop - 1."""

    part: str
    start: int
    stop: int
    foot: NDArray  # (N,) shares of the points of the source's mesh, sum 1
    way: NDArray  # (n,) where that foot is along the ground, x in pixels


@dataclass(frozen=True, eq=False)
class Stay:
    """A foot that is to be in a place over frames start .. stop - 1: a mean of some points of a role's mesh."""

    part: str
    start: int
    stop: int
    points: NDArray  # (n,) int
    place: NDArray | None = None  # (2,) on the stage; None is wherever it has come to, without sliding
    shares: NDArray | None = None  # (n,) of the points, sum 1; None is even


def stand(performance: Performance, motion: CartoonMotion) -> Performance:
    """The performance on the source's ground: feet at its height, going where the source's feet go.

    Where the source has no ground the performance comes back unchanged.
    """
    level = ground(motion)
    if level is None or not performance.roles:
        return performance
    drawing = drawings(motion)
    first = np.flatnonzero(np.diff(drawing, prepend=-1))
    times = motion.times[first]
    low = _lowest(performance, motion, first)
    touched = np.abs(low - level) <= TOUCHING * _height(motion)
    under = _deepest(performance)[first]
    wanted = np.where(touched, low - under, np.nan)
    up = offsets.calmest(times, RISES, wanted, most=level - under) if np.isfinite(under).all() else 0 * times
    feet = one_at_a_time([_followed(performance, contact, drawing) for contact in contacts(motion, level)])
    begun = np.full(len(times), np.nan)
    if feet and feet[0][0][0] == 0:  # whoever begins on the ground begins where the cast has put it
        on, path = feet.pop(0)
        begun[on] = path - path[0]
    across = offsets.calmest(times, STRAYS, begun, feet)
    return shifted(performance, np.stack([across, up], axis=-1)[drawing])


def keep(
    performance: Performance, stays: Sequence[Stay], half_life: float = STRAYS, drawing: NDArray | None = None
) -> Performance:
    """The performance moved so that feet stay where they are told to; of two places at once the first is obeyed.

    With `drawing` (T,), the number of the drawing that each frame shows, a held drawing stays held.
    """
    feet = [foot_of(performance, stay) for stay in stays]
    return shifted(performance, demanded(performance.times, stays, feet, half_life, drawing))


def demanded(
    times: NDArray, stays: Sequence[Stay], feet: Sequence[NDArray], half_life: float, drawing: NDArray | None = None
) -> NDArray:
    """The calmest offset (T, 2) that keeps feet, each given where it goes (T, 2), where their stays say."""
    drawing = np.arange(len(times)) if drawing is None else drawing
    first = np.flatnonzero(np.diff(drawing, prepend=-1))
    moved = []
    for axis in (0, 1):
        fixed, paths = np.full(len(first), np.nan), []
        for stay, foot in zip(stays, feet, strict=True):
            on = np.unique(drawing[stay.start : stay.stop])
            way = foot[first[on], axis]
            if stay.place is None:
                paths.append((on, way[0] - way))
            else:
                fixed[on] = np.where(np.isnan(fixed[on]), stay.place[axis] - way, fixed[on])
        paths = [(on[np.isnan(fixed[on])], path[np.isnan(fixed[on])]) for on, path in paths]
        moved.append(offsets.calmest(times[first], half_life, fixed, one_at_a_time(paths)))
    return np.stack(moved, axis=-1)[drawing]


def follow(performance: Performance, path: NDArray, part: str = "") -> Performance:
    """The performance along a path (n, 2) on the stage: the part's middle goes along it at the pace it has anyway.

    Rises and falls are kept, above the path instead of above the way it went.
    """
    path = np.asarray(path, float)
    if path.ndim != 2 or path.shape[1] != 2 or len(path) < 2 or not np.isfinite(path).all():
        raise InputError(f"a path must be 2 or more points (x, y) of the stage, it came with shape {path.shape}")
    role = role_of(performance, part) if part else performance.roles[0]
    along = role.mesh()[..., 0].mean(axis=1)
    gone = np.concatenate([[0], np.cumsum(np.abs(np.diff(along)))])
    share = gone / gone[-1] if gone[-1] > 0 else np.linspace(0, 1, len(gone))
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    x, y = (np.interp(share * length[-1], length, axis) for axis in path.T)
    return shifted(performance, np.stack([x - along, y - y[0]], axis=-1))


def shifted(performance: Performance, offset: NDArray) -> Performance:
    """The performance with everybody moved by `offset` (T, 2)."""
    if not np.abs(offset).any():
        return performance
    roles = []
    for role in performance.roles:
        points = role.points.copy()
        points[..., :2] += offset[:, None]
        limbs = role.limbs
        if limbs is not None:
            way = np.concatenate([np.tile(np.eye(2), (len(offset), 1, 1)), offset[..., None]], axis=-1)
            limbs = together.moved(limbs, np.tile(way, (len(limbs.maps), 1, 1, 1)))
        roles.append(replace(role, points=points, joint=role.joint + offset, limbs=limbs))
    return replace(performance, roles=tuple(roles))


def ground(motion: CartoonMotion) -> float | None:
    """The height (y, in pixels down) of the ground the source stands on, or None if it stands on none.

    That is the lowest level it keeps to: touched three times, or for a fifth of the drawings, and hardly ever passed.
    """
    first = np.flatnonzero(np.diff(drawings(motion), prepend=-1))
    low = _source_low(motion, [track.part for track in motion.tracks])[first]
    low = low[np.isfinite(low)]
    if len(low) < 3:
        return None
    near = TOUCHING * _height(motion)
    levels = low[low >= np.quantile(low, 0.95) - near]
    level = levels[np.argmax((np.abs(low - levels[:, None]) <= near).sum(axis=1))]
    touched = np.abs(low - level) <= near
    visits = int((np.diff(touched.astype(int), prepend=0) == 1).sum())
    return float(np.median(low[touched])) if visits >= 3 or touched.mean() >= 0.2 else None


def contacts(motion: CartoonMotion, level: float | None = None) -> tuple[Contact, ...]:
    """The source's feet on the ground, by height and speed: points near `level` that move slowly, part by part.

    A contact lasts for as long as some one point stays; the foot is what is lowest meanwhile.
    """
    level = ground(motion) if level is None else level
    if level is None:
        return ()
    drawing = drawings(motion)
    first = np.append(np.flatnonzero(np.diff(drawing, prepend=-1)), len(drawing))
    height = _height(motion)
    found = []
    for track in motion.tracks:
        everywhere = motion.points(track.part)
        points = everywhere[first[:-1]]
        speed = np.linalg.norm(np.diff(points, axis=0), axis=-1) / np.diff(motion.times[first[:-1]])[:, None]
        slow = np.ones(points.shape[:2], bool)
        slow[1:] &= speed <= RESTING * height
        near = (np.abs(points[..., 1] - level) <= TOUCHING * height) & track.visible[first[:-1], None]
        for start, stop in _runs(near, slow):
            begin, end = int(first[start]), int(first[stop])
            foot = sole(everywhere[begin:end])
            found.append(Contact(track.part, begin, end, foot, everywhere[begin:end, :, 0] @ foot))
    return tuple(sorted(found, key=lambda contact: contact.start))


def slide(performance: Performance, contact: Contact) -> float:
    """How far, in pixels, the new character's foot goes astray of the source's during a contact."""
    part = [role for role in performance.roles if contact.part in parts_of(role.target)]
    if not part:
        return 0.0
    return float(np.ptp(_path(part[0], contact)))


def _path(role: Role, contact: Contact) -> NDArray:
    """The way (n,) that the role's foot must be moved along the ground to go with the source's."""
    mesh = role.mesh()[contact.start : contact.stop, role.of(contact.part)]
    own = mesh[..., 0] @ sole(mesh)
    return role.target.height * (contact.way - contact.way[0]) - (own - own[0])


def sole(points: NDArray) -> NDArray:
    """Shares (N,) of what stays lowest in (n, N, 2 or 3), however the whole is moved, and never one point alone.

    A point has a third of the share of one that lies lower by SOLE of the height, so that no last digit decides.
    """
    above = (points[..., 1].max(axis=1, keepdims=True) - points[..., 1]).mean(axis=0)
    shares = np.exp(-(above - above.min()) / (SOLE * np.ptp(points[0, :, 1])))
    return shares / shares.sum()


def _followed(performance: Performance, contact: Contact, drawing: NDArray) -> offsets.Path:
    roles = [role for role in performance.roles if contact.part in parts_of(role.target)]
    if not roles:
        return np.zeros(0, int), np.zeros(0)
    path = _path(roles[0], contact)
    of_contact = drawing[contact.start : contact.stop]
    on, at = np.unique(of_contact, return_index=True)
    return on, path[at]


def one_at_a_time(feet: Sequence[offsets.Path]) -> list[offsets.Path]:
    """Feet that stand at the same time share it: the old one leads for the first half, the new one from there on."""
    leads: list[offsets.Path] = []
    for on, path in feet:
        if leads and len(on):
            common = np.intersect1d(leads[-1][0], on)
            if len(common):
                middle = common[len(common) // 2]
                before = leads[-1][0] < middle
                leads[-1] = leads[-1][0][before], leads[-1][1][before]
                on, path = on[on >= middle], path[on >= middle]
        if len(on):
            leads = [(old[old < on[0]], way[old < on[0]]) for old, way in leads]
            leads.append((on, path))
    return [(on, path) for on, path in leads if len(on)]


def _runs(near: NDArray, slow: NDArray) -> list[tuple[int, int]]:
    """Start and stop of runs of drawings in which some one point of (D, N) stays near the ground and moves slowly."""
    runs, start = [], 0
    while start < len(near):
        stays = near[start:].copy()
        stays[1:] &= slow[start + 1 :]
        lasting = np.where(stays.all(axis=0), len(stays), np.argmin(stays, axis=0))
        if lasting.max() < 2:
            start += 1
            continue
        runs.append((start, start + int(lasting.max())))
        start = runs[-1][1]
    return runs


def drawings(motion: CartoonMotion) -> NDArray:
    """The number (T,) of the drawing that each frame shows; a frame holds one if all parts do."""
    held = np.all([track.held for track in motion.tracks], axis=0)
    return np.cumsum(~held | (np.arange(len(held)) == 0)) - 1


def _height(motion: CartoonMotion) -> float:
    """How tall the source stands in its keys 0, all parts together."""
    keys = [keyset.points[0, keyset.outline] for keyset in motion.keysets]
    return float(np.ptp(np.concatenate(keys)[:, 1]))


def _source_low(motion: CartoonMotion, parts: Sequence[str]) -> NDArray:
    """The lowest point (T,) of the parts that are seen, -inf where none is."""
    lows = []
    for part in parts:
        low = motion.outline(part)[..., 1].max(axis=1)
        lows.append(np.where(motion.track(part).visible, low, -np.inf))
    return np.max(lows, axis=0)


def _lowest(performance: Performance, motion: CartoonMotion, frames: NDArray) -> NDArray:
    return _source_low(motion, [part for role in performance.roles for part in parts_of(role.target)])[frames]


def _deepest(performance: Performance) -> NDArray:
    """The lowest point (T,) of everybody who is seen; of all where nobody is."""
    lows = np.stack([role.mesh()[..., 1].max(axis=1) for role in performance.roles])
    seen = np.stack([role.visible for role in performance.roles])
    return np.where(seen.any(axis=0), np.where(seen, lows, -np.inf).max(axis=0), lows.max(axis=0))


def role_of(performance: Performance, part: str) -> Role:
    for role in performance.roles:
        if part in parts_of(role.target):
            return role
    played = ", ".join(part for role in performance.roles for part in parts_of(role.target))
    raise InputError(f"a foot must belong to a part that is played, {part!r} is not: name one of {played}")


def foot_of(performance: Performance, stay: Stay) -> NDArray:
    """Where a foot (T, 2) is in all frames; frames and points that are not there are refused."""
    mesh = role_of(performance, stay.part).mesh()
    points = np.asarray(stay.points, int)
    if not 0 <= stay.start < stay.stop <= len(mesh):
        raise InputError(
            f"a foot must stay over frames of the clip, 0 to {len(mesh) - 1}, got {stay.start} to {stay.stop - 1}"
        )
    if not len(points) or points.min() < 0 or points.max() >= mesh.shape[1]:
        raise InputError(f"a foot must be made of points of part {stay.part!r}, 0 to {mesh.shape[1] - 1}")
    shares = np.full(len(points), 1 / len(points)) if stay.shares is None else stay.shares
    return np.einsum("n,tnd->td", shares, mesh[:, points, :2])
