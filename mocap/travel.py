"""How a drawn figure gets about: as far as its own legs carry it, on the same ground as the performer.

Legs of other lengths would slide if the way were only scaled.  While a foot stands, the figure moves as it must for
that foot to stay as still as the performer's did; in the air it goes on as the performer does.
"""

import numpy as np
from numpy.typing import NDArray

from mocap import views
from mocap.bones import Casting, Performer
from mocap.marks import SIDES

FLOOR = 2.0
"""Percent of the frames whose lowest joint may lie below the floor: a capture is noisy."""

STANDS = 0.04
"""A foot stands if it is not much higher than this share of the performer's height."""


def travelled(acting: Performer, casting: Casting, places: NDArray) -> NDArray:
    """How far the figure has moved (T, 2), in pixels, y down, given its marks (T, J, 2) while its root stays."""
    marks, scale = casting.marks, scale_of(acting, casting)
    positions = acting.positions
    lowest = positions[..., 1].min(axis=1)
    height = lowest - np.percentile(lowest, FLOOR)
    stands = [mark for mark, _ in casting.roles.values()]  # not a tail
    ground = marks.places[stands, 1].max()
    down = ground - scale * np.maximum(height, 0) - places[:, stands, 1].max(axis=1)
    return np.column_stack([_along(acting, casting, places, scale), down])


def scale_of(acting: Performer, casting: Casting) -> float:
    """Pixels for a metre: by the legs, or by trunk and arms where there are none."""
    for whats in (("knee", "ankle"), ("chest", "elbow", "wrist")):
        drawn = real = 0.0
        for bone in casting.bones:
            role = next((role for role, (mark, _) in casting.roles.items() if mark == bone.mark), "")
            if role.rpartition(" ")[2] in whats and bone.joints is not None:
                drawn += casting.marks.lengths()[bone.mark]
                path = acting.path(*bone.joints)
                real += float(acting.lengths[path[1:]].sum())
        if drawn > 0 and real > 0:
            return drawn / real
    return float(np.ptp(casting.marks.places, axis=0).max() / acting.tall)


def _along(acting: Performer, casting: Casting, places: NDArray, scale: float) -> NDArray:
    """How far it has gone to the right (T,): steps from frame to frame, put together."""
    right = casting.views.seen("legs")[0]
    positions, tall = acting.positions, acting.tall
    hips = positions[:, acting.ends[casting.roles["hips"][1]]] if "hips" in casting.roles else positions[:, 0]
    between = 0.5 * (acting.heading[1:] + acting.heading[:-1])
    steps = scale * views.turned(np.diff(hips, axis=0)[:, None], between)[:, 0] @ right
    feet, slips = [], []
    for side in SIDES:
        if f"{side} ankle" not in casting.roles:
            continue
        mark, joint = casting.roles[f"{side} ankle"]
        foot = positions[:, acting.ends[joint]]
        moved = scale * views.turned(np.diff(foot, axis=0)[:, None], between)[:, 0] @ right
        drawn = steps + np.diff(places[:, mark, 0])
        feet.append(foot[:, 1])
        slips.append(moved - drawn)
    if feet:
        feet = np.stack(feet)
        above = (feet - np.percentile(feet, FLOOR, axis=1, keepdims=True)) / (STANDS * tall)
        stands = np.exp(-above)
        shares = stands / stands.sum(axis=0) * np.exp(-(above.min(axis=0) ** 2))
        steps = steps + (0.5 * (shares[:, 1:] + shares[:, :-1]) * np.stack(slips)).sum(axis=0)
    return np.concatenate([[0.0], np.cumsum(steps)])
