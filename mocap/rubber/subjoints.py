"""Links cut into sub-links: the hierarchy that can bend (Kwon & Lee 2008, sections 5.1 and 5.2)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mocap.skeletons.skeleton import Skeleton

FINE = 3
"""A limb's middling link is cut into so many sub-links, longer links into more and shorter into fewer."""

TIPS = ("hand", "wrist", "foot", "ankle", "paw", "hoof")
"""A joint so called is its limb's tip."""

SHORT = 0.5
"""Where none is, a last link shorter than so many times its limb's longest is no part of its curve; nor is a first."""

STRAIGHT = np.radians(40)
"""Two links at whose joint the body is turned more than so at rest are not one rod."""

FINGER = 0.35
"""A branch that is shorter than so many times the one it grows from is a finger or a toe: it does not count."""

BEZIER = 5
"""Up to so many joints lie on one Bezier curve; it swings out between more, and they lie on a spline."""


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

    def __len__(self) -> int:
        return len(self.parents)

    def lengths(self) -> NDArray:
        """How long the sub-link above each sub-joint is at rest (S,); a root has none: 0."""
        pieces = np.bincount(self.joint, minlength=len(self.skeleton))
        return (self.skeleton.lengths() / pieces)[self.joint]

    def names(self) -> tuple[str, ...]:
        """A joint's own name, and for those along the link to it the name with the part of the way: "Hand 1/3"."""
        pieces = np.bincount(self.joint, minlength=len(self.skeleton))
        return tuple(
            self.skeleton.names[j] + ("" if at == 1 else f" {round(at * pieces[j])}/{pieces[j]}")
            for j, at in zip(self.joint.tolist(), self.along.tolist())
        )


def subdivide(skeleton: Skeleton, fine: float = FINE) -> SubJoints:
    """Cut a skeleton's links (sec. 5.1) and group those that bend together (sec. 5.2).

    Only the links of a group are cut: what lies on none stays straight, and needs no joints to.
    """
    groups = rubber_groups(skeleton)
    pieces = _pieces(skeleton, groups, fine)
    parents, joint, along = [], [], []
    ends = np.empty(len(skeleton), int)
    for j, parent in enumerate(skeleton.parents):
        above = -1 if parent < 0 else int(ends[parent])
        for piece in range(pieces[j]):
            parents.append(above)
            joint.append(j)
            along.append((piece + 1) / pieces[j])
            above = len(parents) - 1
        ends[j] = above
    return SubJoints(skeleton, tuple(parents), np.array(joint), np.array(along), ends, groups)


def rubber_groups(skeleton: Skeleton) -> tuple[NDArray, ...]:
    """Chains of joints that bend like one rubber rod, 3 joints or more, each from the body to its tip.

    An end-effector is in a group, and so is each joint whose only child is (sec. 5.2).  So that wrists and ankles are
    end-effectors, fingers and toes are pruned first: branches short beside the one they grow from, then what comes
    after a joint called a hand or a foot, or is short beside its limb.  A rod is straight at rest: a short link at its
    beginning or one that turns off, as a pelvis does, is none of it; nor is a joint in one place with its parent.
    """
    lengths = skeleton.lengths()
    kept = _without_fingers(skeleton, lengths)
    chains = (_chain(skeleton, kept, tip) for tip in _leaves(skeleton, kept))
    rods = (_rod(skeleton, [chain[0], *(joint for joint in chain[1:] if lengths[joint] > 0)]) for chain in chains)
    return tuple(np.array(rod) for rod in rods if len(rod) > 2)


def placing(subjoints: SubJoints, hose: float = 1.0) -> NDArray:
    """The constant matrix (S, J) that places sub-joints on curves through the joints; its rows sum to 1.

    A group's curve is a Bezier curve of as many control points as it has joints, each passed at a parameter in
    proportion to the way along the links at rest (chord length), or a C2 cubic spline through more than BEZIER.
    `hose` goes from straight links, 0, to the curve, 1.
    """
    straight = np.zeros((len(subjoints), len(subjoints.skeleton)))
    rows = np.arange(len(subjoints))
    parent = np.array(subjoints.skeleton.parents)[subjoints.joint]
    straight[rows, np.where(parent < 0, subjoints.joint, parent)] += 1 - subjoints.along
    straight[rows, subjoints.joint] += subjoints.along
    curved = straight.copy()
    for group in subjoints.groups:
        knots, ways, on_curve = _on_group(subjoints, group)
        curved[on_curve] = 0
        curved[np.ix_(on_curve, group)] = interpolation(knots, ways)
    return (1 - hose) * straight + hose * curved


def interpolation(knots: NDArray, at: NDArray) -> NDArray:
    """The matrix (A, n) from n points passed at increasing parameters `knots` to those of the curve at `at` (A,)."""
    knots, at = ((values - knots[0]) / (knots[-1] - knots[0]) for values in (np.asarray(knots, float), at))
    if len(knots) > BEZIER:
        from scipy.interpolate import CubicSpline

        return CubicSpline(knots, np.eye(len(knots)), bc_type="natural")(at)
    return _bernstein(len(knots) - 1, at) @ np.linalg.inv(_bernstein(len(knots) - 1, knots))


def place(matrix: NDArray, positions: NDArray) -> NDArray:
    """Sub-joints (T, S, 3) from joints (T, J, 3) by `placing`'s matrix (S, J)."""
    return np.matmul(matrix, positions)


def _bernstein(degree: int, u: NDArray) -> NDArray:
    from scipy.special import comb

    k = np.arange(degree + 1)
    return comb(degree, k) * u[:, None] ** k * (1 - u[:, None]) ** (degree - k)


def _on_group(subjoints: SubJoints, group: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """How far along a group's way at rest its joints (n,) and sub-joints (A,) are, and which these are (A,)."""
    lengths = subjoints.skeleton.lengths()
    knots = np.concatenate([[0.0], np.cumsum(lengths[group[1:]])])
    start = dict(zip(group[1:].tolist(), knots[:-1].tolist()))
    on_curve = np.flatnonzero(np.isin(subjoints.joint, group[1:]))
    own = subjoints.joint[on_curve]
    ways = np.array([start[joint] for joint in own.tolist()]) + subjoints.along[on_curve] * lengths[own]
    return knots, ways, on_curve


def _pieces(skeleton: Skeleton, groups: tuple[NDArray, ...], fine: float) -> NDArray:
    """Into how many sub-links each joint's link is cut (J,)."""
    pieces = np.ones(len(skeleton), int)
    links = np.concatenate([group[1:] for group in groups]) if groups else np.arange(0)
    if len(links):
        lengths = skeleton.lengths()[links]
        pieces[links] = np.maximum(1, np.rint(fine * lengths / np.median(lengths))).astype(int)
    return pieces


def _without_fingers(skeleton: Skeleton, lengths: NDArray) -> NDArray:
    """Which joints (J,) are left where branches that are short beside what they grow from are cut off."""
    kept = np.ones(len(skeleton), bool)
    while True:
        cut = []
        for tip in _leaves(skeleton, kept):
            branch = _chain(skeleton, kept, tip)
            stem = _chain(skeleton, kept, skeleton.parents[branch[0]]) if skeleton.parents[branch[0]] >= 0 else [0]
            grown = 0 if skeleton.parents[stem[0]] < 0 else lengths[stem].sum()  # what grows from a root is a limb
            cut += branch if lengths[branch].sum() < FINGER * grown else []
        if not cut:
            return kept
        kept[cut] = False


def _rod(skeleton: Skeleton, chain: list[int]) -> list[int]:
    """What is left of a chain without its hand or foot, and without what turns off at its beginning."""
    lengths = skeleton.lengths()
    tips = [i for i, joint in enumerate(chain) if any(tip in skeleton.names[joint].lower() for tip in TIPS)]
    chain = chain[: tips[0] + 1] if tips else chain
    while not tips and len(chain) > 2 and lengths[chain[-1]] < SHORT * lengths[chain[1:]].max():
        chain = chain[:-1]
    while len(chain) > 2:
        first, second = skeleton.offsets[chain[1:3]] / lengths[chain[1:3], None]
        long = lengths[chain[1]] >= SHORT * lengths[chain[1:]].max()
        if long and np.arccos(np.clip(first @ second, -1, 1)) <= STRAIGHT:
            break
        chain = chain[1:]
    return chain


def _leaves(skeleton: Skeleton, kept: NDArray) -> list[int]:
    parents = {parent for child, parent in enumerate(skeleton.parents) if kept[child]}
    return [joint for joint in np.flatnonzero(kept).tolist() if joint not in parents]


def _chain(skeleton: Skeleton, kept: NDArray, joint: int) -> list[int]:
    """The joint and those above it that have no other child, from the body outwards."""
    above = [parent for child, parent in enumerate(skeleton.parents) if kept[child]]
    chain = [joint]
    while (parent := skeleton.parents[chain[0]]) >= 0 and above.count(parent) == 1:
        chain.insert(0, parent)
    return chain
