"""What a fit must show to be believed: a part is seen, doubtful or lost by what the picture shows of it.

What is covered by other parts is not held against it.  Near the place where it was expected little is enough, for a
stranger may be in front; one that was lost, or turns up elsewhere, must be as well drawn as ever.
"""

import numpy as np
from numpy.typing import NDArray

from capture.fit.pixels.descend import Evidence, worth
from capture.fit.pixels.sighting import Pose, Sighting, across, outline
from capture.motion import affine

# what a fit is worth: the share of the part that is there, of what can be seen of it, times that of its telling pixels
CLEAR = 0.7  # from here on nothing else is tried
SEEN = 0.27  # below it the part is lost; 60 % of it may be covered
BACK = 0.4  # this much is asked for a part that was lost, or that is not where it was expected
# shares of the part that must be in sight for a picture to say anything about it
HIDDEN, HIDDEN_BACK = 0.1, 0.3
IN_SIGHT = 0.75  # of what was expected to be in sight, at least: a fit that hides behind others is suspicious
OBVIOUS = 0.6  # share in sight from which on a part is believed to be off its joint
SOCKET = 0.2  # of a part's size: how far from its parent's it may put its joint


def is_clear(part: Sighting, pose: Pose, seen: Evidence) -> bool:
    """Whether a fit leaves no doubt: much of the part is there, and no worse drawn than before."""
    well_drawn = pose.misfit <= ordinary(part) or seen.shown > 0.9
    return seen.known >= HIDDEN and worth(pose, seen) >= CLEAR and well_drawn


def is_seen(part: Sighting, expected: Pose, joint: NDArray | None, pose: Pose, seen: Evidence) -> bool:
    """Whether a fit proves the part to be there; `joint` (2,) is where its parent holds it, if one does."""
    if joint is not None and not is_hung(part, pose, joint):
        return seen.known >= OBVIOUS and worth(pose, seen) >= CLEAR and pose.misfit <= ordinary(part)
    if part.pose.visible and not is_far(part, expected, pose):
        return seen.known >= HIDDEN and worth(pose, seen) >= SEEN
    enough = HIDDEN_BACK if joint is None else HIDDEN
    return seen.known >= enough and worth(pose, seen) >= BACK and pose.misfit <= ordinary(part)


def preference(part: Sighting, expected: Pose, joint: NDArray | None, pose: Pose, seen: Evidence) -> tuple[bool, float]:
    """For choosing among fits: one that can be believed comes first, then what it is worth and how much it explains."""
    return is_seen(part, expected, joint, pose, seen), worth(pose, seen) * seen.known


def is_hung(part: Sighting, pose: Pose, joint: NDArray) -> bool:
    """Whether a pose leaves the part's pivot where its parent holds it."""
    off = np.linalg.norm(affine.apply(pose.placed, np.array([part.model.part.pivot], float))[0] - joint)
    return bool(off <= SOCKET * across(part.model))


def is_far(part: Sighting, expected: Pose, pose: Pose) -> bool:
    """Whether a pose lies further from both the expected and the last one than half the part's size."""
    return min(gap(part, pose, expected), gap(part, pose, part.pose)) > 0.5 * across(part.model)


def gap(part: Sighting, one: Pose, other: Pose) -> float:
    """The largest distance in pixels, along x or y, between the outlines of two poses."""
    return float(np.abs(outline(part.model, one) - outline(part.model, other)).max())


def ordinary(part: Sighting) -> float:
    """A misfit in pixels that is not out of the ordinary, after what has been seen so far."""
    return 2.5 * float(np.median(part.misfits)) + 0.2 if len(part.misfits) >= 3 else 0.8
