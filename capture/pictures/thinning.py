"""A skeleton of pixels as a graph: its branches from node to node, and the strokes that they make.

Nodes are loose ends and crossings.  Diagonal neighbours count only where no straight ones join them already, so
that a staircase is one line.
"""

from collections import defaultdict
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

STRAIGHT, DIAGONAL = ((0, 1), (1, 0), (0, -1), (-1, 0)), ((1, 1), (1, -1), (-1, 1), (-1, -1))
BEND = np.radians(60)  # more than this, and a line does not run on through a crossing
LOOK = 8  # pixels along a branch by which its direction at a crossing is judged


@dataclass(frozen=True, eq=False)
class Branch:
    """A line of the skeleton between two nodes; with nodes -1 it is a ring of its own."""

    points: NDArray  # (n, 2) x, y
    nodes: tuple[int, int]


def branches(skeleton: NDArray) -> list[Branch]:
    """All branches of a skeleton (H, W) bool."""
    links = _links(skeleton)
    node_of, centre = _nodes(links)
    found, used = [], set()
    for pixel, node in node_of.items():
        for first in links[pixel]:
            if first in node_of:
                if node_of[first] != node and (first, pixel) not in used:
                    used.add((pixel, first))
                    found.append(_branch([pixel, first], (node, node_of[first]), centre))
            elif (pixel, first) not in used:
                path = _follow(pixel, first, links, node_of)
                used |= {(pixel, first), (path[-1], path[-2])}
                found.append(_branch(path, (node, node_of[path[-1]]), centre))
    seen = {pixel for branch in found for pixel in map(tuple, branch.points[:, ::-1].astype(int).tolist())} | set(
        node_of
    )
    for pixel in links:
        if pixel not in seen and len(links[pixel]) == 2:
            ring = _follow(pixel, links[pixel][0], links, {pixel: 0})
            seen |= set(ring)
            found.append(Branch(np.array(ring[:-1], float)[:, ::-1], (-1, -1)))
    return found


def joined(found: list[Branch], spur: float) -> list[tuple[NDArray, bool]]:
    """Strokes, each points (n, 2) and whether it is closed: spurs shorter than `spur` cut, crossings run through."""
    found = _without_spurs(found, spur)
    strokes = [(branch.points, True) for branch in found if branch.nodes == (-1, -1)]
    found = [branch for branch in found if branch.nodes != (-1, -1)]
    partner = _partners(found)
    todo = set(range(len(found)))
    loose = [(k, end) for k in range(len(found)) for end in (0, 1) if (k, end) not in partner]
    for k, end in loose + [(k, 0) for k in range(len(found))]:
        if k not in todo:
            continue
        pieces, at, closed = [], (k, end), False
        while at[0] in todo:
            todo.discard(at[0])
            points = found[at[0]].points
            pieces.append(points if at[1] == 0 else points[::-1])
            out = (at[0], 1 - at[1])
            if out not in partner:
                break
            at = partner[out]
            closed = at == (k, end)
        path = np.vstack([pieces[0], *(piece[1:] for piece in pieces[1:])])
        strokes.append((path[:-1] if closed else path, closed))
    return strokes


def _links(skeleton: NDArray) -> dict[tuple[int, int], list[tuple[int, int]]]:
    """The neighbours of every skeleton pixel (row, column)."""
    pixels = set(map(tuple, np.argwhere(skeleton).tolist()))
    links = {}
    for row, column in pixels:
        near = [(row + a, column + b) for a, b in STRAIGHT if (row + a, column + b) in pixels]
        near += [
            (row + a, column + b)
            for a, b in DIAGONAL
            if (row + a, column + b) in pixels and (row + a, column) not in pixels and (row, column + b) not in pixels
        ]
        links[row, column] = near
    return links


def _nodes(links: dict) -> tuple[dict, list[NDArray]]:
    """The node of every end and crossing pixel, touching crossings being one; and the nodes' centres x, y."""
    node_of, centres = {}, []
    for pixel, near in links.items():
        if len(near) == 2 or pixel in node_of:
            continue
        cluster, stack = [], [pixel]
        while stack:
            one = stack.pop()
            if one in node_of:
                continue
            node_of[one] = len(centres)
            cluster.append(one)
            if len(links[one]) > 2:
                stack += [other for other in links[one] if len(links[other]) > 2 and other not in node_of]
        centres.append(np.mean(cluster, axis=0)[::-1])
    return node_of, centres


def _follow(pixel: tuple, first: tuple, links: dict, stops: dict) -> list[tuple]:
    """Pixels from one on through `first` to the next that is in `stops`."""
    path = [pixel, first]
    while path[-1] not in stops:
        a, b = links[path[-1]]
        path.append(b if a == path[-2] else a)
    return path


def _branch(path: list[tuple], nodes: tuple[int, int], centres: list[NDArray]) -> Branch:
    points = np.array(path, float)[:, ::-1]
    points[0], points[-1] = centres[nodes[0]], centres[nodes[1]]
    return Branch(points, nodes)


def _without_spurs(found: list[Branch], spur: float) -> list[Branch]:
    """Branches without the short ones that end loosely, shortest first; where two are left, they are one."""
    while True:
        found = _merged(found)
        degree = _ends(found)
        short = [
            k
            for k, branch in enumerate(found)
            if branch.nodes != (-1, -1)
            and (len(degree[branch.nodes[0]]) == 1) != (len(degree[branch.nodes[1]]) == 1)
            and _length(branch.points) < spur
        ]
        if not short:
            return found
        drop = min(short, key=lambda k: _length(found[k].points))
        found = found[:drop] + found[drop + 1 :]


def _merged(found: list[Branch]) -> list[Branch]:
    """Branches joined wherever just two ends meet."""
    found = list(found)
    while True:
        pair = next((ends for node, ends in _ends(found).items() if node >= 0 and len(ends) == 2), None)
        if pair is None:
            return found
        (a, end_a), (b, end_b) = pair
        if a == b:
            found[a] = Branch(found[a].points[:-1], (-1, -1))
            continue
        first = found[a].points if end_a == 1 else found[a].points[::-1]
        second = found[b].points if end_b == 0 else found[b].points[::-1]
        nodes = found[a].nodes[1 - end_a], found[b].nodes[1 - end_b]
        joint = Branch(np.vstack([first, second[1:]]), nodes)
        found = [branch for k, branch in enumerate(found) if k not in (a, b)] + [joint]


def _ends(found: list[Branch]) -> dict[int, list[tuple[int, int]]]:
    """The branch ends (branch, 0 or 1) that meet at each node."""
    ends = defaultdict(list)
    for k, branch in enumerate(found):
        if branch.nodes != (-1, -1):
            ends[branch.nodes[0]].append((k, 0))
            ends[branch.nodes[1]].append((k, 1))
    return ends


def _partners(found: list[Branch]) -> dict[tuple[int, int], tuple[int, int]]:
    """Which branch end runs on in which: at each node the smoothest pair first."""
    partner = {}
    for ends in _ends(found).values():
        ways = {end: _away(found[end[0]].points, end[1]) for end in ends}
        turns = sorted(
            (float(np.arccos(np.clip(-ways[a] @ ways[b], -1, 1))), a, b) for a in ends for b in ends if a < b
        )
        for turn, a, b in turns:
            if turn < BEND and a not in partner and b not in partner:
                partner[a], partner[b] = b, a
    return partner


def _away(points: NDArray, end: int) -> NDArray:
    """The direction (2,) in which a branch leaves its end 0 or 1."""
    path = points if end == 0 else points[::-1]
    way = path[min(LOOK, len(path) - 1)] - path[0]
    return way / max(float(np.linalg.norm(way)), 1e-9)


def _length(points: NDArray) -> float:
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
