"""One round of springs: a sweep in towards the joint that holds all others, and a sweep back out, linear in joints.

Chen et al. (2004), section 4.1, move every joint by the sum of its springs' pulls and then mend the elongation.  Here
the links of a joint to its children are a *star* that keeps its shape and turns as a whole, so that there is nothing
to mend.  On the way in each star learns how what hangs on its far joints would like to move (eqs. 5 and 8: pulls), and
how strongly; it turns so as to give them as much as possible of it, and passes what is left to the joint that it is
held by.  On the way out the turns are known, and are done.  All in the order of graph distance.

Sizes: J joints, parents before children, the children of a joint side by side; 1 is the size of the figure.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mocap.posing import machine, twists
from mocap.posing.stars import turns
from mocap.posing.twists import untwisted

MOST = 0.6
"""Radians that a star turns at most in a round: what is linear is true for small turns only."""

SLOWER = 6.0
"""A round that made things worse is taken back, and the joints of the next are so many times as slow."""

LITTLE = 1e-3
"""When a round takes less than this share of the strain away, it is the last: the target is out of reach."""

LOOSE = 1e-5
"""How firmly a star keeps its turn beside all that pulls at it."""

HINGE, UNLOCK = 1e5, 0.1
"""How firmly a hinge keeps to its axis, and to a limit that it has come to; from round to round it is let go again."""


class Loops(NamedTuple):
    """What a drag calls."""

    outward: Callable
    settle: Callable
    carried: Callable
    untwisted: Callable


def compiled() -> Loops:
    """All as machine code."""
    bent = machine.compiled(twists.untwisted, *twists.HELPERS)
    round_ = machine.compiled(settle, copied, stiffer, pulls, turns, carried, *twists.HELPERS, twists.untwisted)
    return Loops(machine.compiled(outward), round_, machine.compiled(carried), bent)


def plain() -> Loops:
    """All as they are written."""
    return Loops(outward, settle, carried, twists.untwisted)


def settle(
    place: NDArray,
    turn: NDArray,
    springs: NDArray,
    rest: NDArray,
    stiff: NDArray,
    goal: NDArray,
    hold: NDArray,
    firm: NDArray,
    ways: NDArray,
    stars: NDArray,
    held: NDArray,
    before: NDArray,
    bend: NDArray,
    parents: NDArray,
    first: NDArray,
    count: NDArray,
    hinge: NDArray,
    axes: NDArray,
    least: NDArray,
    most: NDArray,
    roll: NDArray,
    rounds: int,
    done: float,
) -> None:
    """Rounds until no star turns by more than `done` radians, `rounds` at most.

    A round that stretches springs and leaves goals further away on the whole is taken back, and the next ones go
    slower: what is linear in a round is true for small turns only.  `place`, `turn` and `firm` are written to.
    """
    limited = (hinge >= 0).any()
    slow, lock = 0.0, np.zeros(len(place))
    stiffness = np.zeros((len(stars), 3, 3))
    old, was, still = place.copy(), turn.copy(), np.zeros((len(stars), 3))
    pull, strength, strain = pulls(place, springs, rest, stiff, goal, hold)
    for _ in range(rounds):
        copied(place, turn, old, was)
        stiffer(stiffness, bend, lock, place, turn, axes, hinge, held, before, parents, first)
        more = turns(place, pull, strength + slow, firm, stars, held, before, stiffness, first, count)
        biggest = carried(place, turn, more, ways, stars, held, first, count)
        if limited:
            blocked = untwisted(place, turn, ways, parents, first, count, hinge, axes, least, most, roll)
            carried(place, turn, still, ways, stars, held, first, count)
            for j in range(len(place)):
                lock[j] = HINGE if blocked[j] else UNLOCK * lock[j]
        pull, strength, now = pulls(place, springs, rest, stiff, goal, hold)
        if now > strain + 1e-13 and slow < 1e6:
            slow = max(SLOWER * slow, 1.0)
            copied(old, was, place, turn)
            pull, strength, now = pulls(place, springs, rest, stiff, goal, hold)
        else:
            slow = slow / SLOWER if slow > 1e-2 else 0.0
            if slow == 0 and (biggest < done or strain - now < LITTLE * now):
                return
        strain = now


def outward(
    holder: int, ways: NDArray, parents: NDArray, first: NDArray, count: NDArray
) -> tuple[NDArray, NDArray, NDArray, NDArray, NDArray]:
    """The stars in the order of distance from a joint, the joints that hold them, the stars before them (all (n,)), and
    for joints how many stars they are away, and how far at most (J,).

    A star is named by the joint whose children it is; `first` and `count` (J,) say which those are.  The star before is
    the other one that the holding joint belongs to, -1 for the first; a second one at `holder` comes after the first.
    """
    stars, held = np.empty(len(parents), np.int64), np.empty(len(parents), np.int64)
    queue, ring = np.empty(len(parents), np.int64), np.full(len(parents), -1)
    queue[0], ring[holder] = holder, 0
    reach, via, before = np.zeros(len(parents)), np.full(len(parents), -1), np.empty(len(parents), np.int64)
    done, waiting, n = 0, 1, 0
    while done < waiting:
        joint = queue[done]
        done += 1
        for star in (parents[joint], joint):
            if star < 0 or count[star] == 0 or (star != joint and ring[star] >= 0):
                continue
            if star == joint and count[star] > 0 and ring[first[star]] >= 0:
                continue
            stars[n], held[n] = star, joint
            before[n] = via[joint] if via[joint] >= 0 else min(n, 1) - 1
            n += 1
            for other in range(first[star] - 1, first[star] + count[star]):
                q = star if other < first[star] else other
                if ring[q] < 0:
                    ring[q] = ring[joint] + 1
                    queue[waiting], via[q] = q, n - 1
                    square = 0.0
                    for d in range(3):
                        link = (ways[q, d] if q != star else 0.0) - (ways[joint, d] if joint != star else 0.0)
                        square += link * link
                    reach[q] = reach[joint] + np.sqrt(square)
                    waiting += 1
    return stars[:n], held[:n], before[:n], ring, reach


def pulls(
    place: NDArray, springs: NDArray, rest: NDArray, stiff: NDArray, goal: NDArray, hold: NDArray
) -> tuple[NDArray, NDArray, float]:
    """How joints are pulled (J, 3), how strongly (J,), and the strain, by springs (P, 2) and by goals (J, G, 3).

    A spring of length `rest` (P,) is as stiff as `stiff` (P,) says and pulls both of its joints (the erratum of eqs. 6
    and 8); how strong it is, is left to the stars' bends.  A joint is held to its goals by `hold` (J, G).
    """
    pull, strength = np.zeros((len(place), 3)), np.zeros(len(place))
    strain = 0.0  # eq. 1
    for n in range(len(springs)):
        a, b = springs[n, 0], springs[n, 1]
        x, y, z = place[b, 0] - place[a, 0], place[b, 1] - place[a, 1], place[b, 2] - place[a, 2]
        long = np.sqrt(x * x + y * y + z * z)
        strain += 0.5 * stiff[n] * (long - rest[n]) ** 2
        if long > 1e-9:
            more = stiff[n] * (long - rest[n]) / long  # eqs. 4, 5 and 8
            pull[a, 0] += more * x
            pull[a, 1] += more * y
            pull[a, 2] += more * z
            pull[b, 0] -= more * x
            pull[b, 1] -= more * y
            pull[b, 2] -= more * z
    for j in range(len(place)):
        for g in range(goal.shape[1]):
            strength[j] += hold[j, g]
            for d in range(3):
                off = goal[j, g, d] - place[j, d]
                pull[j, d] += hold[j, g] * off
                strain += 0.5 * hold[j, g] * off * off
    return pull, strength, strain


def copied(place: NDArray, turn: NDArray, other_place: NDArray, other_turn: NDArray) -> None:
    """Write places (J, 3) and turns (J, 3, 3) over others, in loops that compile in no time."""
    for j in range(len(place)):
        for d in range(3):
            other_place[j, d] = place[j, d]
            for e in range(3):
                other_turn[j, d, e] = turn[j, d, e]


def stiffer(
    stiffness: NDArray,
    bend: NDArray,
    lock: NDArray,
    place: NDArray,
    turn: NDArray,
    axes: NDArray,
    hinge: NDArray,
    held: NDArray,
    before: NDArray,
    parents: NDArray,
    first: NDArray,
) -> None:
    """Write how stiff stars are against a turn against the star before (n, 3, 3): all ways alike, but for limits.

    A hinge turns about its axis, until that is locked; a bone that must not roll any more is locked along itself.
    """
    for n in range(len(held)):
        joint = held[n]
        limited, locked = before[n] >= 0 and hinge[joint] >= 0, before[n] >= 0 and lock[joint] > 0
        for d in range(3):
            for e in range(3):
                stiffness[n, d, e] = 0.0
            stiffness[n, d, d] = bend[n] + (HINGE if limited else 0.0)
        if not limited and not locked:
            continue
        x, y, z = place[first[joint]] - place[joint]
        more = lock[joint]
        if limited:
            a, b, c = axes[hinge[joint]]
            t = turn[parents[joint]]
            x = t[0, 0] * a + t[0, 1] * b + t[0, 2] * c
            y = t[1, 0] * a + t[1, 1] * b + t[1, 2] * c
            z = t[2, 0] * a + t[2, 1] * b + t[2, 2] * c
            more -= HINGE
        square = max(x * x + y * y + z * z, 1e-300)
        along = (x, y, z)
        for d in range(3):
            for e in range(3):
                stiffness[n, d, e] += more * along[d] * along[e] / square


def carried(
    place: NDArray,
    turn: NDArray,
    more: NDArray,
    ways: NDArray,
    stars: NDArray,
    held: NDArray,
    first: NDArray,
    count: NDArray,
) -> float:
    """Turn the stars (J, 3, 3) by `more` (n, 3), each by MOST, and put the joints `place` (J, 3) where they carry them.

    `ways` (J, 3) lead from joints' parents to them when nothing is turned; the joint that holds all stays.  Both arrays
    are written to.  Returned is the largest turn.
    """
    biggest, old = 0.0, np.empty((3, 3))
    for n in range(len(stars)):
        star, joint = stars[n], held[n]
        a, b, c = more[n, 0], more[n, 1], more[n, 2]
        angle = np.sqrt(a * a + b * b + c * c)
        biggest = max(biggest, angle)
        if angle > 0:
            short = min(angle, MOST)
            a, b, c = a / angle, b / angle, c / angle
            s, f = np.sin(short), 1 - np.cos(short)
            for d in range(3):
                for e in range(3):
                    old[d, e] = turn[star, d, e]
            for d in range(3):
                x, y, z = old[0, d], old[1, d], old[2, d]
                along = f * (a * x + b * y + c * z)
                turn[star, 0, d] = x + s * (b * z - c * y) + a * along - f * x
                turn[star, 1, d] = y + s * (c * x - a * z) + b * along - f * y
                turn[star, 2, d] = z + s * (a * y - b * x) + c * along - f * z
        for k in range(first[star] - 1, first[star] + count[star]):
            q = star if k < first[star] else k
            if q == joint:
                continue
            for d in range(3):
                far = 0.0
                for e in range(3):
                    way = (ways[q, e] if q != star else 0.0) - (ways[joint, e] if joint != star else 0.0)
                    far += turn[star, d, e] * way
                place[q, d] = place[joint, d] + far
    return biggest
