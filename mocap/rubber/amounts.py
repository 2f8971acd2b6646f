"""How much is right: omega chosen by what it does to a figure (Kwon & Lee 2008 leave it to future work).

A link that goes v and deviates d is |v + (omega - 1) d| long, and the square of that is a parabola in omega.  As the
link is not too long as it is, there is one omega in each frame up to which it is not: no search is needed, and a
larger bound never gives a smaller omega.
"""

import numpy as np
from numpy.typing import NDArray

from mocap.rubber.subjoints import SubJoints

MOST = 5.0
"""What the paper used throughout; a body that hardly moves is not exaggerated any further."""

SHARE = 0.99
"""The bound holds for this share of a body part's links and frames."""


def omega_of(
    positions: NDArray, deviations: NDArray, subjoints: SubJoints, most_stretch: float = 1.6, most: float = MOST
) -> NDArray:
    """Each joint's omega (J,) with which its body part's links are at most `most_stretch` times as long as at rest.

    Positions and deviations are (T, J, 3) metres; omega is to be used link by link (`exaggerated` with parents).  A
    root has no link: its part of the body moves it so far at most that the legs which stay where they are would be
    stretched as much.
    """
    skeleton = subjoints.skeleton
    parents, lengths = np.array(skeleton.parents), skeleton.lengths()
    linked = (parents >= 0) & (lengths > 0)
    up_to = np.full((len(positions), len(skeleton)), np.inf)
    ways = (array[:, linked] - array[:, parents[linked]] for array in (positions, deviations))
    up_to[:, linked] = _longest(*ways, most_stretch * lengths[linked])
    parts = body_parts(subjoints)
    omega = np.empty(len(skeleton))
    for part in np.unique(parts):
        own = parts == part
        omega[own] = 1 + _least(up_to[:, own & linked])
    legs = _reach(subjoints)
    for root in np.flatnonzero(parents < 0):
        far = np.quantile(np.linalg.norm(deviations[:, root], axis=1), SHARE)
        omega[root] = min(omega[root], 1 + (most_stretch - 1) * legs / max(far, 1e-9))
    return np.minimum(omega, most)


def omega_for(deviations: NDArray, height: float, share: float, most: float = 50.0) -> float:
    """The one omega that moves the joint that is moved most by `share` of the height, and by less in 9 poses of 10."""
    far = np.quantile(np.linalg.norm(deviations, axis=-1).max(axis=1), 0.9)
    return float(min(1 + share * height / max(far, 1e-9), most))


def body_parts(subjoints: SubJoints) -> NDArray:
    """Which part of the body each joint (J,) is of: a group's number with all that hangs on it, -1 the trunk."""
    parts = np.full(len(subjoints.skeleton), -1)
    for number, group in enumerate(subjoints.groups):
        parts[group] = number
    for joint, parent in enumerate(subjoints.skeleton.parents):
        if parent >= 0 and parts[joint] < 0:
            parts[joint] = parts[parent]
    return parts


def _longest(v: NDArray, d: NDArray, bound: NDArray) -> NDArray:
    """The largest s (T, L) for which ways v + s d (T, L, 3) are no longer than `bound` (L,); 0 where v is longer."""
    a, b, vv = (np.einsum("tli,tli->tl", *both) for both in ((d, d), (v, d), (v, v)))
    c = np.maximum(bound**2 - vv, 0)
    root = np.sqrt(b * b + a * c)
    # the larger root of a s^2 + 2 b s = c, written so that nothing cancels
    larger = np.where(b > 0, c / np.maximum(b + root, 1e-300), (root - b) / np.maximum(a, 1e-300))
    return np.where(a > 1e-24, larger, np.inf)


def _least(up_to: NDArray) -> float:
    """What all but a hundredth of frames and links allow."""
    return float(np.quantile(up_to, 1 - SHARE, method="lower")) if up_to.size else np.inf


def _reach(subjoints: SubJoints) -> float:
    """How far the nearest tip of a limb is from its root along the skeleton, metres."""
    skeleton = subjoints.skeleton
    lengths, far = skeleton.lengths(), np.zeros(len(skeleton))
    for joint, parent in enumerate(skeleton.parents):
        far[joint] = 0 if parent < 0 else far[parent] + lengths[joint]
    tips = [far[group[-1]] for group in subjoints.groups]
    return float(min(tips)) if tips else float(far.max())
