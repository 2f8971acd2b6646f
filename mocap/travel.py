"""How a drawn figure gets about: as far as its own legs carry it, on the same ground as the performer.

Legs of other lengths would slide if the way were only scaled.  While a foot stands, the figure moves as it must for
that foot to stay; in the air it goes on as the performer does.
"""

import numpy as np
from numpy.typing import NDArray

from mocap import views
from mocap.bones import Casting, Performer
from mocap.marks import SIDES

FLOOR = 2.0
"""Percent of the frames whose lowest joint may lie below the floor: a capture is noisy."""

SETTLES = 0.04
"""Seconds over which a foot that is set down comes to stand."""


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
    right, positions = casting.views.seen("legs")[0], acting.positions
    hips = positions[:, acting.ends[casting.roles["hips"][1]]] if "hips" in casting.roles else positions[:, 0]
    between = 0.5 * (acting.heading[1:] + acting.heading[:-1])
    steps = scale * views.turned(np.diff(hips, axis=0)[:, None], between)[:, 0] @ right
    feet = [casting.roles[f"{side} ankle"] for side in SIDES if f"{side} ankle" in casting.roles]
    if feet and len(steps):
        stands = _stands(acting, [joint for _, joint in feet])
        drawn = steps[:, None] + np.diff(places[:, [mark for mark, _ in feet], 0], axis=0)  # how far each foot slips
        steps = steps - (0.5 * (stands[1:] + stands[:-1]) * drawn).sum(axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


def _stands(acting: Performer, ankles: list[int]) -> NDArray:
    """How much of the figure's weight is on each foot (T, F): 1 at most in all, 0 in the air."""
    from scipy.ndimage import gaussian_filter1d

    from mocap.contacts import find_contacts

    below = [_foot(acting, ankle) for ankle in ankles]
    contacts = find_contacts(acting.captured, below)
    soft = gaussian_filter1d(contacts.astype(float), SETTLES * acting.fps, axis=0, mode="nearest")
    return soft / np.maximum(soft.sum(axis=1, keepdims=True), 1.0)


def _foot(acting: Performer, ankle: int) -> int:
    """What of a foot stands: the joint after the ankle, the toe, or the ankle itself."""
    lengths = acting.skeleton.lengths()
    return next((child for child in acting.skeleton.children(ankle) if lengths[child] > 0), ankle)
