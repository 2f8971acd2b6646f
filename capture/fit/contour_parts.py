"""Contour capture of a drawing in parts, with soft seams and joints that hold (Bregler et al. 2002, 3.1.4 and 3.2).

Parts are fitted in turn, each to what the others leave of the picture, until nothing moves.  A part that hangs on
another keeps its joint: the pivot goes where the parent carries it, and only the linear part is free.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.fit.shapes import weights as key_weights
from capture.motion import affine, keys
from capture.motion.keys import KeySet
from capture.motion.parts import blended
from capture.motion.tracks import CartoonMotion, relative_to_parents, track_of


@dataclass(frozen=True, eq=False)
class Joint:
    """A part of a drawing: its name, what it hangs on ("" for nothing), and its pivot in key 0."""

    part: str
    parent: str
    pivot: NDArray  # (2,)
    order: int = 0


def capture_parts(
    tracked: NDArray,
    keyset: KeySet,
    shares: NDArray,
    joints: list[Joint],
    fps: float = 24.0,
    size: tuple[int, int] = (640, 480),
    rounds: int = 12,
) -> CartoonMotion:
    """Capture mesh points seen at `tracked` (T, N, 2) as P parts with shares (N, P), parents listed before children.

    Every part uses the whole key set with weights of its own.
    """
    tracked = np.asarray(tracked, float)
    _check(joints, shares, keyset)
    rows = keys.shapes(keyset)
    count, frames = len(joints), len(tracked)
    maps = np.tile(affine.fit(keyset.points[0], tracked), (count, 1, 1, 1))
    weights = np.zeros((count, frames, len(rows)))
    weights[:, :, 0] = 1
    names = [joint.part for joint in joints]
    near = [int(np.linalg.norm(keyset.points[0] - joint.pivot, axis=1).argmin()) for joint in joints]
    for _ in range(rounds):
        for number, joint in enumerate(joints):
            share = shares[:, number]
            shapes = np.einsum("ptr,rnd->ptnd", weights, rows)
            shape = np.einsum("np,ptnd->tnd", shares, shapes)
            left = tracked - blended(shares, shapes, maps)
            goal = affine.apply(maps[number], shape) + left
            if joint.parent:
                parent = maps[names.index(joint.parent)]
                bent = (
                    joint.pivot + shape[:, near[number]] - keyset.points[0, near[number]]
                )  # where keys bend the joint to
                maps[number] = _about_joint(shape, goal, share, bent, affine.apply(parent, bent[:, None])[:, 0])
            else:
                maps[number] = _weighted_fit(shape, goal, share)
            if len(rows) > 1:
                own = shapes[number] + affine.apply(affine.invert(maps[number]), goal) - shape
                root = np.sqrt(share)[:, None]
                weights[number] = key_weights.fit_weights(own * root, rows * root, keyset.rows)
    off = np.linalg.norm(tracked - blended(shares, np.einsum("ptr,rnd->ptnd", weights, rows), maps), axis=-1)
    residual = np.sqrt(np.einsum("tn,np->pt", off**2, shares) / shares.sum(axis=0)[:, None])
    found = tuple(
        track_of(
            joint.part,
            keyset,
            maps[number],
            weights[number],
            residual[number],
            pivot=joint.pivot,
            parent=joint.parent,
            order=joint.order,
        )
        for number, joint in enumerate(joints)
    )
    return relative_to_parents(CartoonMotion(found, (keyset,) * count, np.arange(frames) / fps, fps, size))


def _weighted_fit(source: NDArray, target: NDArray, weight: NDArray) -> NDArray:
    """The plain maps (T, 2, 3) from source to target (T, N, 2), points counting by their weight (N,)."""
    total = weight.sum()
    from_, to = ((points * weight[:, None]).sum(axis=1) / total for points in (source, target))
    return _linear(source - from_[:, None], target - to[:, None], weight, from_, to)


def _about_joint(source: NDArray, target: NDArray, weight: NDArray, pivot: NDArray, held: NDArray) -> NDArray:
    """The plain maps (T, 2, 3) that put the pivot (T, 2) where it is held (T, 2) and bring the rest nearest."""
    return _linear(source - pivot[:, None], target - held[:, None], weight, pivot, held)


def _linear(source: NDArray, target: NDArray, weight: NDArray, from_: NDArray, to: NDArray) -> NDArray:
    cross = np.einsum("tni,n,tnj->tij", target, weight, source)
    own = np.einsum("tni,n,tnj->tij", source, weight, source)
    own = own + 1e-9 * np.trace(own, axis1=1, axis2=2)[:, None, None] * np.eye(2)
    linear = cross @ np.linalg.inv(own)
    return np.concatenate([linear, (to - (linear @ from_[..., None])[..., 0])[..., None]], axis=-1)


def _check(joints: list[Joint], shares: NDArray, keyset: KeySet) -> None:
    if shares.shape != (keyset.points.shape[1], len(joints)):
        raise InputError(
            f"shares must be given for every point and part, {keyset.points.shape[1]} points and {len(joints)} parts, "
            f"their shape is {shares.shape}"
        )
    if not np.allclose(shares.sum(axis=1), 1):
        raise InputError("the shares of a point must sum to 1: normalise each row")
    for number, joint in enumerate(joints):
        before = [other.part for other in joints[:number]]
        if joint.parent and joint.parent not in before:
            raise InputError(f"part {joint.part!r} hangs on {joint.parent!r}, which must be listed before it")
