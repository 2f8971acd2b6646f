"""A joint is dragged, and the whole figure follows: springs without mass (Chen et al. 2004, section 4.1).

Springs between joints two and three links apart (the paper's 4th and 6th neighbours; the 2nd are the links) want the
distances that they had when the drag began, and every joint would rather stay where it was. Links do not stretch, and
what hangs on one joint turns as one piece, as it does in every motion file; so nothing has to be mended afterwards.
Any tree of joints will do. The outcome depends on where a drag began and where it ends; and on the way between only
for who tells it (`come`).

Errata: with h = 0.5 (section 4.1) 4th and 6th neighbours make the paper's sum of forces swing ever more; ten rounds
leave 8 to 38 % of elongation.  `sweeps` goes inwards and outwards by graph distance instead.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from mocap.posing import limits as bends
from mocap.posing import sweeps
from mocap.posing.limits import JointLimits
from mocap.posing.poses import Pose
from mocap.posing.ties import Tree, tree_of

NEXT, FURTHER = 1.0, 0.5
"""How stiff springs two and three links long are."""

LAZY = 0.05
"""How much a joint would rather stay, against the stiffness of springs: the more, the less of it comes along."""

CARRIED = 0.5
"""A figure without pins that is dragged further than this, times its size, is carried the rest."""

PIN, HAND, SOFT = 1e7, 1e5, 1e4
"""How firmly pins hold, and the hand that drags, in units of springs; softer on the way, and where it cannot get."""

STEPS, ROUNDS, LAST = 4, 2, 60
"""The way to the target is done in steps of so many rounds; so many more at most when it is there."""

STRIDE, ONWARD = 0.05, 20
"""A drag that goes on makes steps of this length, times the figure's size, and no more than STEPS; and fewer rounds
there: what would snap over glides, over a few moves of the pointer."""

VIEWER = np.array([0.1, 0.2, 1.0])
"""The side that a straight limb without hinges gives way to, roughly to the viewer: exactly would be a special case."""

FARTHEST = 1e9
"""Metres: numbers end somewhere."""

DONE = 2e-3
"""Radians: when no star turns by more in a round, it is the last."""

TEAR, CLOSE = 6, 1e-6
"""Pins that limbs still tear at are seen to for so many rounds at a time, until they are as close as this."""

STRETCH = 0.05
"""What a link may be longer or shorter by at the end of a drag (section 4.1.3)."""

SHARES = (1.0, 0.5, 0.25, 0.1, 0.02)
"""Of the way to the target, that are tried until no link is stretched; pins and limits may leave no other choice."""

NEAR, GAP = 0.2, 1e-3
"""Where a soft hand is further off than NEAR, or pins than GAP, times the figure's size, the target is out of reach."""


def drag(
    parents: Sequence[int],
    pose: Pose,
    joint: int,
    target: Sequence[float],
    pinned: Sequence[int] = (),
    limits: Sequence[JointLimits] = (),
    compiled: bool = True,
    come: Pose | None = None,
) -> Pose:
    """The pose when `joint` has been dragged to `target` (3,), or as near to it as pinned joints and limits let it.

    Links keep their lengths (beside a pin within 5 %, all others to 1e-9), pinned joints their places, and joints
    their twist. `come` is what has come of the drag so far, for a pointer that moves on: then the figure goes on from
    there, and does not jump from one way of giving in to another; springs remember `pose`. InputError for what is no
    tree, for numbers that are not finite, for all joints pinned.
    """
    positions, target = _checked(len(parents), pose, joint, target, pinned)
    tree = tree_of(parents, positions)
    way, ordered = target - positions[joint], positions[tree.order]
    size = max(2 * np.linalg.norm(ordered - ordered.mean(axis=0), axis=1).max(), 1e-12)
    if np.linalg.norm(way) <= 1e-12 * size:
        return pose
    begun = None
    if come is not None and come is not pose:
        there, _ = _checked(len(parents), come, joint, target, pinned)
        begun = (there[tree.order] - positions[joint]) / size, _turned(pose.turns, come.turns)[tree.order]
    back = np.argsort(tree.order)
    fixed = sorted({int(back[j]) for j in pinned})
    start = (ordered - positions[joint]) / size
    held = bends.gathered(limits, tree.order, pose.turns, parents)
    lengths = np.linalg.norm(tree.ways(start), axis=1)
    for share in SHARES if begun is None else (1.0,):
        place, turn = _dragged(tree, start, int(back[joint]), share * way / size, fixed, held, compiled, begun)
        now = np.linalg.norm(tree.ways(place), axis=1)
        if (np.abs(now - lengths) <= STRETCH * lengths + 1e-4).all():
            break
    else:
        return pose if begun is None else come
    moved = positions[joint] + size * place[back]
    moved[list(pinned)] = positions[list(pinned)]
    return Pose(moved, _quaternions(turn[back], pose.turns))


def _dragged(
    tree: Tree,
    start: NDArray,
    hand: int,
    way: NDArray,
    fixed: list[int],
    held: bends.Held,
    compiled: bool,
    begun: tuple[NDArray, NDArray] | None = None,
) -> tuple[NDArray, NDArray]:
    """Places (J, 3) and turns (J, 3, 3) since the start, all in the tree's order, of a figure of size 1."""
    outward, settle, carried, untwisted = sweeps.compiled() if compiled else sweeps.plain()
    ways, links = tree.ways(start), (tree.first, tree.count)
    stars, by, before, ring, reach = outward(hand, ways, tree.parents, *links)
    holder = min(fixed, key=lambda j: (ring[j], j)) if fixed else hand
    goal, hold = np.stack([start, start], axis=1), np.full((len(start), 2), (LAZY, 0.0))
    carry = np.zeros(3)
    if fixed:
        way = _in_reach(way, start, fixed, reach)
        hold[fixed, 1], hold[hand, 1] = PIN, SOFT
        stars, by, before, *_ = outward(holder, ways, tree.parents, *links)
    else:
        carry = way * max(0.0, 1 - CARRIED / np.linalg.norm(way))
        goal[:, 0] += carry
    springs, stiff = tree.springs(NEXT, FURTHER, fixed)
    rest = np.linalg.norm(start[springs[:, 0]] - start[springs[:, 1]], axis=1)
    place, turn = goal[:, 0].copy(), np.tile(np.eye(3), (len(start), 1, 1))
    firm = np.full(len(stars), sweeps.LOOSE)
    bend = np.where(before >= 0, tree.bends(start, stiff)[by], 0.0)
    shape = (ways, stars, by, before, bend, tree.parents, *links, *held.for_stars(len(start)))
    if begun is not None:
        place, turn = begun[0].copy(), begun[1].copy()
    elif fixed:
        kick = _kick(tree, start, way, held, stars, by, (holder, hand), reach[holder])
        carried(place, turn, kick, ways, stars, by, *links)
    at = start[hand] + carry if begun is None else place[hand].copy()
    end = start[hand] + way
    last = LAST if begun is None else ONWARD
    steps = STEPS if begun is None else min(int(np.sqrt(((end - at) ** 2).sum()) / STRIDE) + 1, STEPS)
    for step in range(1, steps + 1):
        goal[hand, 1] = at + (end - at) * (step / steps)
        if not fixed:
            place += goal[hand, 1] - place[hand]
        settle(place, turn, springs, rest, stiff, goal, hold, firm, *shape, ROUNDS, DONE)
    settle(place, turn, springs, rest, stiff, goal, hold, firm, *shape, last, DONE)
    near = begun is not None or np.abs(place[hand] - goal[hand, 1]).max() < NEAR
    if fixed and near:
        hold[hand, 1] = HAND
        settle(place, turn, springs, rest, stiff, goal, hold, firm, *shape, last, DONE)
    if len(fixed) > 1:  # what pins are still off by, without springs
        torn = np.abs(place[fixed] - start[fixed]).max() > GAP
        goal[:, 0], hold[:, 0] = place, 1e-3
        hold[hand, 1] = 0 if torn or not near else HAND
        for _ in range(LAST // TEAR):
            if np.abs(place[fixed] - start[fixed]).max() < CLOSE:
                break
            settle(place, turn, springs, rest, 0 * stiff, goal, hold, firm, *shape, TEAR, DONE * 1e-3)
    place[fixed] = start[fixed]  # what pins are still off by goes into their links
    untwisted(place, turn, *shape[:1], *shape[5:])
    return place, turn


def _in_reach(way: NDArray, start: NDArray, fixed: list[int], reach: NDArray) -> NDArray:
    """The way (3,) of the joint at the origin, cut so that its end is as near to all pins as links allow."""
    end = way
    for _ in range(20):
        moved = end
        for pin in fixed:
            away = moved - start[pin]
            far = np.sqrt((away * away).sum())
            if far > reach[pin]:
                moved = start[pin] + away * (reach[pin] / far)
        if np.abs(moved - end).max() < 1e-12:
            break
        end = moved
    return end


def _kick(
    tree: Tree, start: NDArray, way: NDArray, held: bends.Held, stars: NDArray, by: NDArray, path: tuple, reach: float
) -> NDArray:
    """A slight bow (n, 3) of the limb between a pin and the hand, where it is straight and is to be shortened.

    Pushed along itself a straight limb has no side to give way to.  It takes that of its hinges, else the viewer's.
    """
    kick = np.zeros((len(stars), 3))
    holder, hand = path
    along = start[hand] - start[holder]
    long = np.sqrt((along * along).sum())
    if long < 0.98 * reach or long < 1e-9 or (along * way).sum() >= 0:
        return kick
    row, at = [], hand
    star_to = {}
    for n, (star, joint) in enumerate(zip(stars.tolist(), by.tolist())):
        for q in (star, *range(tree.first[star], tree.first[star] + tree.count[star])):
            if q != joint:
                star_to[q] = n
    while at != holder:
        row.append(star_to[at])
        at = int(by[row[-1]])
    row.reverse()
    side = VIEWER * (np.ptp(start, axis=0) > 1e-6)
    on_way = {int(by[n]) for n in row} | {int(stars[n]) for n in row}
    hinges = [n for n, joint in enumerate(held.joints.tolist()) if joint in on_way]
    if hinges:
        ways = tree.ways(start)
        side = sum(np.cross(ways[tree.first[held.joints[n]]], held.axes[n]) for n in hinges)
    axis = np.cross(along / long, side)
    if (axis * axis).sum() < 1e-6:  # all joints are on one line
        axis = np.cross(along / long, VIEWER if abs(along[2]) < 0.9 * long else VIEWER[::-1])
    size = np.sqrt((axis * axis).sum())
    bow = 0.05 * min(1.0, 4 * np.sqrt((way * way).sum()) / long)
    kick[row] = bow * np.cos(np.pi * (np.arange(len(row)) + 0.5) / len(row))[:, None] * (axis / size)
    return kick


def _turned(before: NDArray, after: NDArray) -> NDArray:
    """The turns (J, 3, 3) that bring turns (J, 4) to others."""
    from scipy.spatial.transform import Rotation

    return (Rotation.from_quat(after) * Rotation.from_quat(before).inv()).as_matrix()


def _quaternions(turn: NDArray, before: NDArray) -> NDArray:
    """Turns (J, 4) of joints that were turned `before` (J, 4), and then by (J, 3, 3)."""
    from scipy.spatial.transform import Rotation

    return (Rotation.from_matrix(turn) * Rotation.from_quat(before)).as_quat()


def _checked(
    count: int, pose: Pose, joint: int, target: Sequence[float], pinned: Sequence[int]
) -> tuple[NDArray, NDArray]:
    positions, target = np.asarray(pose.positions, float), np.asarray(target, float)
    if positions.shape != (count, 3) or np.shape(pose.turns) != (count, 4) or not np.isfinite(positions).all():
        raise InputError(
            f"a pose must have finite positions (x, y, z) and turns (x, y, z, w) of {count} joints, it has "
            f"{positions.shape} and {np.shape(pose.turns)}"
        )
    if target.shape != (3,) or not (np.abs(target) <= FARTHEST).all():
        raise InputError(f"a joint must be dragged to a place x, y, z within {FARTHEST:g} of the origin, not {target}")
    for which in (joint, *pinned):
        if not 0 <= which < count:
            raise InputError(f"a joint to drag or pin must be one of 0 to {count - 1}, it is {which}")
    if len(set(pinned)) == count:
        raise InputError("a figure with all joints pinned cannot be posed: unpin some")
    if joint in pinned:
        raise InputError(f"joint {joint} is pinned and cannot be dragged: unpin it first, or drag another")
    return positions, target
