"""A drawing's meshes: one where one will do, and one more for every limb that is drawn across another.

A single mesh of the whole silhouette cannot follow an arm that swings in front of its body: both lie on the
same triangles.  Elements that the common mesh cannot carry get a mesh of their own, which hangs on the
first one at the point where both keep together best.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from capture.motion import triangulate
from retarget.characters.embed import carried_mesh, embedding, samples, silhouette_mesh, silhouette_of
from retarget.characters.paths import DrawnPath


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
    """The limbs of a drawing, given each element in its K keys; the main one comes first.

    An element is carried when the mesh comes within a mesh step of it in every key (root mean square).
    """
    found, left = [], list(range(len(elements)))
    while left:
        members, out = left, []
        while True:
            limb = _limb(elements, members, step)
            off = np.array([_off(limb, elements[i]) for i in members])
            lost = off > max(step, 0.5 * off.max())
            if not lost.any() or len(members) == 1:
                break
            if lost.all():  # keep what paints most; it is what the others move across
                lost[np.argmax([silhouette_of([elements[i][0]]).area for i in members])] = False
            out += [i for i, gone in zip(members, lost, strict=True) if gone]
            members = [i for i, gone in zip(members, lost, strict=True) if not gone]
        riding = [i for i in out if _off(limb, elements[i]) <= step]
        limb = Limb((*members, *riding), limb.silhouette, limb.points, limb.faces, limb.outline)
        found.append(limb)
        left = [i for i in out if i not in riding]
    return found


def _limb(elements: list[list[DrawnPath]], members: list[int], step: float) -> Limb:
    of_members = [elements[i] for i in members]
    silhouette = silhouette_of([of_keys[0] for of_keys in of_members])
    mesh, faces, outline = silhouette_mesh(silhouette, step)
    return Limb(tuple(members), silhouette, carried_mesh(mesh, faces, of_members), faces, outline)


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
