"""A drawing's meshes: one where one will do, and one more for every limb that is drawn across another.

A single mesh of the whole silhouette cannot follow an arm that swings in front of its body: both lie on the
same triangles.  Elements that the common mesh cannot carry get a mesh of their own, which hangs on the
first one at the point where both keep together best.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from capture.motion import triangulate
from retarget.characters.drawings import paths
from retarget.characters.drawings.embed import carried_mesh, embedding, samples, silhouette_mesh, silhouette_of
from retarget.characters.drawings.paths import DrawnPath

LEFT_BEHIND = 0.35
"""In mesh steps, root mean square: a bend of 60 degrees leaves 0.1 to 0.3, an arm swung by 40 degrees 0.4."""


SLIPS = 0.3
"""Of its own size: an element that changes less than this on a limb, such as a mouth, still rides on it."""

LIES = 0.25
"""Of its area: what lies less on a limb, such as a stem under its flower, cannot ride on it: it needs a mesh there."""


@dataclass(frozen=True, eq=False)
class Limb:
    """A mesh and the elements that ride on it."""

    elements: tuple[int, ...]
    silhouette: object  # shapely, key 0
    points: NDArray  # (K, n, 2) as drawn
    faces: NDArray  # (f, 3)
    outline: NDArray  # (b,)


@dataclass(frozen=True, eq=False)
class Joint:
    """Where a limb hangs on another: a point of its own mesh and the same point of the other's."""

    limb: slice  # the limb's points in the common point list
    own: int  # its point at the joint
    corners: NDArray  # (3,) points of the other mesh ...
    shares: NDArray  # (3,) ... and how they mix to the joint


def limbs(elements: list[list[DrawnPath]], step: float) -> list[Limb]:
    """The limbs of a drawing, given each element in its K keys; one if one mesh can carry them all.

    Otherwise the elements are gone through from the largest down: each rides on the limb that carries it
    best, if that is well enough, or is meshed with one it lies on, or becomes a limb of its own.
    """
    close = LEFT_BEHIND * step
    whole = _limb(elements, tuple(range(len(elements))), step)
    if not _torn(whole, elements, close):
        return [whole]
    shapes = [paths.painted(of_keys[0]) for of_keys in elements]
    found: list[Limb] = []
    for i in sorted(range(len(elements)), key=lambda i: -shapes[i].area):
        lies = [shapes[i].intersection(limb.silhouette).area > LIES * shapes[i].area for limb in found]
        off = [_off(limb, elements[i]) if on else np.inf for limb, on in zip(found, lies)]
        if off and min(off) <= max(close, SLIPS * np.linalg.norm(np.ptp(elements[i][0].points, axis=0))):
            best = int(np.argmin(off))
            found[best] = replace(found[best], elements=(*found[best].elements, i))
            continue
        overlaps = [shapes[i].intersection(limb.silhouette).area for limb in found]
        for number in np.argsort(overlaps)[::-1]:
            if overlaps[number] > 0:
                together = _limb(elements, (*found[number].elements, i), step)
                if not _torn(together, elements, close):
                    found[number] = together
                    break
        else:
            found.append(_limb(elements, (i,), step))
    return found


def grouped(elements: list[list[DrawnPath]], groups: list[tuple[int, ...]], step: float) -> list[Limb]:
    """A limb of its own for each group of elements, told by their numbers; the others' limbs come first."""
    taken = {number for group in groups for number in group}
    free = [number for number in range(len(elements)) if number not in taken]
    others = limbs([elements[number] for number in free], step) if free else []
    others = [replace(limb, elements=tuple(free[i] for i in limb.elements)) for limb in others]
    return [*others, *(_limb(elements, group, step) for group in groups)]


def _limb(elements: list[list[DrawnPath]], members: tuple[int, ...], step: float) -> Limb:
    of_members = [elements[i] for i in members]
    silhouette = silhouette_of([of_keys[0] for of_keys in of_members])
    mesh, faces, outline = silhouette_mesh(silhouette, step)
    return Limb(members, silhouette, carried_mesh(mesh, faces, of_members), faces, outline)


def _torn(limb: Limb, elements: list[list[DrawnPath]], close: float) -> bool:
    """Whether the mesh folds over in some key and yet leaves an element behind.

    A strong bend leaves some behind too, but does not fold; a small fold that leaves nothing behind is
    harmless.
    """
    corners = limb.points[:, limb.faces]
    areas = np.linalg.det(corners[:, :, 1:] - corners[:, :, :1])
    folds = bool((areas * areas[0] < 0).any())
    return folds and max(_off(limb, elements[i]) for i in limb.elements) > close


def _off(limb: Limb, of_keys: list[DrawnPath]) -> float:
    """How far the mesh leaves an element behind in its worst key, root mean square in the drawing's units."""
    face, shares = triangulate.locate(samples(of_keys[0]), limb.points[0], limb.faces)
    carried = np.einsum("pc,kpcx->kpx", shares, limb.points[:, limb.faces[face]])
    off = carried - np.stack([samples(path) for path in of_keys])
    return float(np.sqrt((off**2).sum(-1).mean(-1).max()))


def joined(found: list[Limb]) -> tuple[NDArray, NDArray, NDArray, tuple[Joint, ...]]:
    """All limbs as one mesh: points (K, N, 2) as drawn, faces (F, 3), outline (B,) and the joints."""
    starts = np.cumsum([0, *(limb.points.shape[1] for limb in found)])
    points = np.concatenate([limb.points for limb in found], axis=1)
    faces = np.concatenate([limb.faces + start for limb, start in zip(found, starts, strict=False)])
    outline = np.concatenate([limb.outline + start for limb, start in zip(found, starts, strict=False)])
    joints = []
    for number in range(1, len(found)):
        overlaps = [found[number].silhouette.intersection(other.silhouette).area for other in found[:number]]
        if (parent := int(np.argmax(overlaps))) >= 0 and overlaps[parent] > 0:
            joint = _joint(found[number], found[parent], starts[number], starts[parent])
            joints.append(joint)
    return points, faces, outline, tuple(joints)


def _joint(limb: Limb, other: Limb, start: int, other_start: int) -> Joint:
    """The limb's point that keeps closest to the other mesh over all keys, of those that lie on both."""
    import shapely

    inside = np.flatnonzero(shapely.intersects_xy(other.silhouette, *limb.points[0].T))
    if not len(inside):
        inside = np.arange(limb.points.shape[1])
    face, shares = triangulate.locate(limb.points[0, inside], other.points[0], other.faces)
    carried = np.einsum("pc,kpcx->kpx", shares, other.points[:, other.faces[face]])
    best = int(np.argmin(np.linalg.norm(carried - limb.points[:, inside], axis=-1).max(axis=0)))
    corners = other.faces[face[best]] + other_start
    return Joint(slice(start, start + limb.points.shape[1]), int(start + inside[best]), corners, shares[best])


def hang(shapes: NDArray, joints: tuple[Joint, ...], gaps: NDArray) -> NDArray:
    """Shapes (D, N, 2) with every limb moved to its joint, left open by `gaps` (D, J, 2)."""
    shapes = shapes.copy()
    for number, joint in enumerate(joints):
        shapes[:, joint.limb] += (gaps[:, number] - gaps_at(shapes, (joint,))[:, 0])[:, None]
    return shapes


def gaps_at(shapes: NDArray, joints: tuple[Joint, ...]) -> NDArray:
    """How far each limb's joint is from the mesh it hangs on (..., J, 2) in shapes (..., N, 2)."""
    if not joints:
        return np.zeros((*shapes.shape[:-2], 0, 2))
    there = [np.einsum("c,...cx->...x", joint.shares, shapes[..., joint.corners, :]) for joint in joints]
    return np.stack([shapes[..., joint.own, :] for joint in joints], axis=-2) - np.stack(there, axis=-2)


def embedded(found: list[Limb], elements: list[list[DrawnPath]]) -> object:
    """A sparse matrix (P, N) that carries all elements' control points along, each with its own limb."""
    from scipy import sparse

    sizes = [len(of_keys[0].points) for of_keys in elements]
    firsts = np.cumsum([0, *sizes])
    blocks, order = [], []
    for limb in found:
        points = np.concatenate([elements[i][0].points for i in limb.elements])
        blocks.append(embedding(limb.points[0], limb.faces, points))
        order += [np.arange(firsts[i], firsts[i + 1]) for i in limb.elements]
    back = np.argsort(np.concatenate(order))
    return sparse.block_diag(blocks, format="csr")[back]
