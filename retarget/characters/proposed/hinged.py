"""Shapes of a drawing that an animator names as limbs: each its own mesh, hinged on the next one towards the trunk.

One outline cannot tell a thigh that lies folded before the body from the body.  A limb is told which place of the
source it goes as, and that is all: what else belongs to it, what it hangs on and where is found here.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from capture.motion import triangulate
from retarget.characters.drawings import paths
from retarget.characters.drawings.embed import samples, silhouette_mesh, silhouette_of
from retarget.characters.drawings.limbs import Joint, Limb
from retarget.characters.drawings.paths import DrawnPath
from retarget.characters.proposed.ways import Ways

MOSTLY = 0.5
"""Of an element's curves: it rides on the limb that holds so much of it; ink that lies along a limb counts extra."""

NEAR = 0.02
"""Of an element's curves: what it counts for that a limb is drawn right before or after it, against one more away."""


def limbs_of(drawn: Sequence[DrawnPath], named: Sequence[int], step: float) -> list[Limb]:
    """The trunk, then a limb for each element named, with what is drawn on each; the drawing's one key as its mesh."""
    import shapely

    shapes = [paths.painted(path) for path in drawn]
    trunk = max(set(range(len(drawn))) - set(named), key=lambda i: shapes[i].area)
    seeds = [trunk, *named]
    groups: list[list[int]] = [[] for _ in seeds]
    for i, path in enumerate(drawn):
        dots = shapely.points(samples(path))
        inside = [shapely.dwithin(shapes[seed], dots, 0.5 * step).mean() for seed in seeds]
        round_it = [shapely.dwithin(shapes[seed].boundary, dots, step).mean() for seed in seeds]
        away = [min(abs(i - seed), 1 / NEAR) for seed in seeds]
        score = np.array(inside) + MOSTLY * np.array(round_it) - NEAR * np.array(away)
        best = int(np.argmax(score))
        groups[seeds.index(i) if i in seeds else best if inside[best] > MOSTLY else 0].append(i)
    found = []
    for members in groups:
        silhouette = silhouette_of([drawn[i] for i in members])
        mesh, faces, outline = silhouette_mesh(silhouette, step)
        found.append(Limb(tuple(members), silhouette, mesh[None], faces, outline))
    return found


def parents_of(ways: Ways, places: NDArray) -> list[int]:
    """For the limbs that go as places (L, 2) of the source: which limb each hangs on, counted from 1, or 0, the trunk.

    The source knows how a body is joined: from the middle of its trunk along its inside, the nearest place comes first.
    """
    from scipy import sparse
    from scipy.sparse import csgraph

    ends = np.concatenate([ways.faces[:, [0, 1]], ways.faces[:, [1, 2]], ways.faces[:, [2, 0]]])
    lengths = np.linalg.norm(ways.rest[ends[:, 0]] - ways.rest[ends[:, 1]], axis=1)
    middles = ways.rest[ways.faces].mean(axis=1)
    depth = np.linalg.norm(middles[:, None] - ways.rest[ways.outline], axis=-1).min(axis=1)
    nearest = np.linalg.norm(places[:, None] - ways.rest, axis=-1).argmin(axis=1)
    stops = [ways.faces[depth.argmax(), 0], *nearest]
    graph = sparse.csr_matrix((lengths, ends.T), shape=(len(ways.rest),) * 2)
    away = csgraph.dijkstra(graph, directed=False, indices=stops)[:, stops]
    parents, joined = [-1] * len(stops), [0]
    while len(joined) < len(stops):
        left = [i for i in range(len(stops)) if i not in joined]
        new, old = min(((i, j) for i in left for j in joined), key=lambda pair: away[pair])
        parents[new] = old
        joined.append(new)
    return parents[1:]


def hinges(found: Sequence[Limb], parents: Sequence[int]) -> tuple[Joint, ...]:
    """Where the limbs hang on their parents, those nearest to the trunk first.

    A joint is deep in both and lies at a limb's end: far from its middle and from its other joints.
    """
    starts = np.cumsum([0, *(limb.points.shape[1] for limb in found)])
    middles = [np.array(limb.silhouette.centroid.coords[0]) for limb in found]
    order, hung = [], {0}
    while len(order) < len(parents):
        ready = [i for i, parent in enumerate(parents, 1) if parent in hung and i not in hung]
        order += ready
        hung |= set(ready)
    ends: list[list[NDArray]] = [[] for _ in found]
    joints = {}
    for i in reversed(order):
        parent = parents[i - 1]
        apart = [middles[i], *ends[i], *([middles[parent]] if parent else [])]
        own = _end(found[i], found[parent], np.array(apart))
        place = found[i].points[0, own]
        ends[i].append(place)
        ends[parent].append(place)
        face, shares = triangulate.locate(place[None], found[parent].points[0], found[parent].faces)
        corners = found[parent].faces[face[0]] + starts[parent]
        joints[i] = Joint(slice(starts[i], starts[i + 1]), int(starts[i] + own), corners, shares[0])
    return tuple(joints[i] for i in order)


def _end(limb: Limb, other: Limb, apart: NDArray) -> int:
    """The limb's mesh point deep in both that is farthest from some places (A, 2) in all; the nearest if none is."""
    import shapely

    points = shapely.points(limb.points[0])
    depth = np.minimum(
        *(
            np.where(shapely.contains(one.silhouette, points), shapely.distance(one.silhouette.boundary, points), 0)
            for one in (limb, other)
        )
    )
    if depth.max() <= 0:
        return int(shapely.distance(other.silhouette, points).argmin())
    far = np.linalg.norm(limb.points[0][:, None] - apart, axis=-1).sum(axis=1)
    return int(np.where(depth >= MOSTLY * depth.max(), far, -1).argmax())
