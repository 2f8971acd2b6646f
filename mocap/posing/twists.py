"""How joints are turned once it is known where they are: as little as their links ask for, and hinges as they may."""

import numpy as np
from numpy.typing import NDArray

ROLLS = 0.3
"""Radians of bend from which on a bone rolls after what it bears; a straight limb does not tell a roll."""


def untwisted(
    place: NDArray,
    turn: NDArray,
    ways: NDArray,
    parents: NDArray,
    first: NDArray,
    count: NDArray,
    hinge: NDArray,
    axes: NDArray,
    least: NDArray,
    most: NDArray,
    roll: NDArray,
) -> NDArray:
    """Turn stars (J, 3, 3) no more than their links (at `place`) ask for, and hinges within their limits.

    A star of one link is turned as the star above it and then by the smallest turn that brings its link to where it is
    (eqs. 9 and 10: bend and twist; the twist is kept).  `hinge` (J,) is a limit's number or -1.  Returned is who was
    brought back by a limit, hinges that bend and bones that roll (J,) bool; `turn` is written to.
    """
    blocked = np.zeros(len(parents), np.bool_)
    for star in range(len(parents)):
        above = turn[parents[star]] if parents[star] >= 0 else np.eye(3)
        if count[star] == 0:
            _put(above, turn[star])
            continue
        child, limit = _longest(ways, first[star], count[star]), hinge[star]
        long = np.sqrt(_dot(ways[child], ways[child]))
        if _on_one_line(ways, first[star], count[star]):
            if long < 1e-9:
                _put(above, turn[star])
                continue
            was, now = _seen(above, ways[child]), place[child] - place[star]
            _put(_times(_least_turn(was / long, now / max(np.sqrt(_dot(now, now)), 1e-300)), above), turn[star])
        if limit < 0 or parents[star] < 0:
            continue
        axis, p = axes[limit], parents[star]
        bone = np.sqrt(_dot(ways[star], ways[star]))
        if long < 1e-9 or bone < 1e-9:
            continue
        rest, b, now = ways[child] / long, ways[star] / bone, place[child] - place[star]
        way = _seen(above.T, now / max(np.sqrt(_dot(now, now)), 1e-300))
        if count[p] == 1 and roll[limit] > 0:
            bend = np.arccos(min(max(_dot(way, b), -1.0), 1.0))
            wanted = min(max(bend - _angle(b, rest, axis), least[limit]), most[limit])
            angle = _angle(_seen(_about(axis, wanted), rest), way, b) * min(1.0, bend / ROLLS)
            blocked[p] = abs(angle) > roll[limit]
            angle = min(max(angle, -roll[limit]), roll[limit])
            _put(_times(above, _about(b, angle)), turn[p])
            way = _seen(_about(b, -angle), way)
        angle = _angle(rest, way, axis)
        inside = min(max(angle, least[limit]), most[limit])
        _put(_times(turn[p], _about(axis, inside)), turn[star])
        blocked[star] = angle != inside
    return blocked


def _on_one_line(ways: NDArray, start: int, count: int) -> bool:
    """Whether all links of a star go along one line."""
    along = ways[_longest(ways, start, count)]
    size, off = _dot(along, along), 0.0
    for q in range(start, start + count):
        across = _cross(along, ways[q])
        off = max(off, _dot(across, across))
    return off <= 1e-12 * size * size


def _longest(ways: NDArray, start: int, count: int) -> int:
    """The joint at the end of a star's longest link."""
    best = start
    for q in range(start, start + count):
        if _dot(ways[q], ways[q]) > _dot(ways[best], ways[best]):
            best = q
    return best


def _least_turn(was: NDArray, now: NDArray) -> NDArray:
    """The smallest turn (3, 3) from one direction to another; of all half turns some one."""
    axis = _cross(was, now)
    sine, cosine = np.sqrt(_dot(axis, axis)), _dot(was, now)
    if sine < 1e-12:
        if cosine > 0:
            return np.eye(3)
        axis[0], axis[1], axis[2] = was[1] - was[2], was[2] - was[0], was[0] - was[1]
        if _dot(axis, axis) < 1e-6:
            axis[0], axis[1], axis[2] = was[1], -was[0], 0.0
        sine = 0.0
    return _about(axis / np.sqrt(_dot(axis, axis)), np.arctan2(sine, cosine))


def _about(axis: NDArray, angle: float) -> NDArray:
    """The turn (3, 3) by an angle about an axis of length 1."""
    x, y, z = axis[0], axis[1], axis[2]
    s, f = np.sin(angle), 1 - np.cos(angle)
    turn = np.empty((3, 3))
    turn[0, 0], turn[0, 1], turn[0, 2] = 1 - f * (y * y + z * z), f * x * y - s * z, f * x * z + s * y
    turn[1, 0], turn[1, 1], turn[1, 2] = f * x * y + s * z, 1 - f * (x * x + z * z), f * y * z - s * x
    turn[2, 0], turn[2, 1], turn[2, 2] = f * x * z - s * y, f * y * z + s * x, 1 - f * (x * x + y * y)
    return turn


def _angle(first: NDArray, second: NDArray, axis: NDArray) -> float:
    """By how much a direction is turned about an axis to go the way of another, as seen along the axis."""
    a, b = first - _dot(first, axis) * axis, second - _dot(second, axis) * axis
    return np.arctan2(_dot(axis, _cross(a, b)), _dot(a, b))


def _dot(a: NDArray, b: NDArray) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: NDArray, b: NDArray) -> NDArray:
    c = np.empty(3)
    c[0], c[1], c[2] = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
    return c


def _seen(turn: NDArray, way: NDArray) -> NDArray:
    c = np.empty(3)
    for d in range(3):
        c[d] = turn[d, 0] * way[0] + turn[d, 1] * way[1] + turn[d, 2] * way[2]
    return c


def _times(a: NDArray, b: NDArray) -> NDArray:
    c = np.empty((3, 3))
    for d in range(3):
        for e in range(3):
            c[d, e] = a[d, 0] * b[0, e] + a[d, 1] * b[1, e] + a[d, 2] * b[2, e]
    return c


def _put(a: NDArray, b: NDArray) -> None:
    for d in range(3):
        for e in range(3):
            b[d, e] = a[d, e]


HELPERS = (_dot, _cross, _seen, _times, _put, _about, _angle, _longest, _least_turn, _on_one_line)
"""What machine code needs to know before `untwisted`; in loops, which compile in a tenth of the time of products."""
