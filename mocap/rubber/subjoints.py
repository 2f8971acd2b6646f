"""Links cut into sub-links: the hierarchy that can bend (Kwon & Lee 2008, sections 5.1 and 5.2)."""

from dataclasses import dataclass

from numpy.typing import NDArray

from mocap.skeleton import Skeleton


@dataclass(frozen=True, eq=False)
class SubJoints:
    """S sub-joints of a skeleton of J joints; parents come before their children.

    The link from a joint's parent to the joint is cut into sub-links of equal length; each sub-link's far end is a
    sub-joint, and the last of them is the joint itself.  A root is its own only sub-joint.
    """

    skeleton: Skeleton
    parents: tuple[int, ...]  # of each sub-joint, -1 at roots
    joint: NDArray  # (S,) int: whose link it cuts, the joint at the link's far end
    along: NDArray  # (S,) how far along that link from the parent's joint, in (0, 1]; 1 is the joint; roots have 1
    ends: NDArray  # (J,) int: which sub-joint is each joint
    groups: tuple[NDArray, ...]  # rubber-joint groups: the joints (n,) of each, from the nearest to the body to the tip
