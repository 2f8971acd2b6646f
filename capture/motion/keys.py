"""Key shapes of one part, and the in-betweens between them (Bregler et al. 2002, sections 3.1.2-3.1.3).

Source and target are both a `KeySet`, aligned by the same function: what a key turned, stretched or
moved against key 0 is taken out (eq. 5) and kept beside it.  Otherwise a key's own turn would hide in the
weights and be lost on the target.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.motion import affine, arap, triangulate

Inbetweener = Callable[["KeySet"], NDArray]
"""A rule that draws the rows of a key set: shapes (D, N, d), aligned to key 0.  `rigid` and `straight` are two."""


@dataclass(frozen=True, eq=False)
class KeySet:
    """The key drawings of one part as one mesh in K shapes, all aligned to key 0.

    Weights are over rows [i, j, s]: key i, s of the way to key j; a key itself is [i, i, 0].
    """

    names: tuple[str, ...]  # K
    points: NDArray  # (K, N, d), aligned to key 0; the outline's own points come first
    faces: NDArray  # (F, 3)
    outline: NDArray  # (B,) the boundary, point by point in order
    rows: NDArray  # (D, 3)
    removed: NDArray  # (K, d, d + 1) from an aligned key back to where it was drawn
    keeps_stretch: bool = False  # only turns and shifts were removed: stretch is the keys' own (preservation of volume)

    @cached_property
    def _as_rigid(self) -> NDArray:
        """What `rigid` gives, read-only: learning and the weights both ask for it."""
        drawn = affine.apply(self.removed, self.points)
        drawn[np.linalg.det(self.removed[..., :-1]) < 0, :, 0] *= -1  # half-way to its mirror image it has no width
        between = arap.inbetweens(drawn, self.faces, self.rows)
        removed = against(drawn[0, self.outline], between[:, self.outline], self.keeps_stretch)
        shapes = affine.apply(affine.invert(removed), between)
        shapes.flags.writeable = False
        return shapes


def keyset(
    names: tuple[str, ...],
    outlines: NDArray,
    inbetweens: int = 5,
    spacing: float | None = None,
    keeps_stretch: bool = False,
) -> KeySet:
    """Mesh and align K corresponding closed outlines (K, B, 2), with `inbetweens` rows for every pair of keys.

    The inside of a later key is carried over from key 0 as rigidly as possible.
    """
    counts = {len(outline) for outline in outlines}
    if len(counts) > 1:
        told = ", ".join(f"{name} {len(outline)}" for name, outline in zip(names, outlines))
        raise InputError(f"keys must have outlines of the same number of points, got {told}: bring them into line")
    outlines = np.asarray(outlines, float)
    if outlines.ndim != 3 or len(names) != len(outlines) or outlines.shape[1] < 3:
        raise InputError(
            f"keys need one outline each, of the same number (3 or more) of points: {len(names)} keys "
            f"{', '.join(names)} came with outlines of shape {outlines.shape}"
        )
    outlines, loop, inside, faces = triangulate.triangulate(outlines, spacing)
    boundary = outlines.shape[1]
    rest = np.vstack([outlines[0], inside])
    handles = np.repeat(np.arange(boundary)[:, None], 3, axis=1)
    shares = np.tile([1.0, 0.0, 0.0], (boundary, 1))
    # aligned first, or a key that is merely stretched would get another inside
    aligned, removed = align(outlines, loop, keeps_stretch)
    points = [rest]
    for outline in aligned[1:]:
        carried = arap.carry(rest, faces, handles, shares, outline)
        points.append(np.vstack([outline, carried[boundary:]]))
    rows = inbetween_rows(len(names), inbetweens)
    return KeySet(tuple(names), np.stack(points), faces, loop, rows, removed, keeps_stretch)


def align(drawn: NDArray, outline: NDArray, keeps_stretch: bool = False) -> tuple[NDArray, NDArray]:
    """Take out of keys (K, N, d) the affine map against key 0 (eq. 5), measured on the `outline` points (B,).

    With `keeps_stretch` only its turn and shift are taken out.

    Returns aligned keys (K, N, d) and the removed maps (K, d, d + 1): drawn = removed applied to aligned.
    Source and target go through this same function, each against its own key 0.
    """
    drawn = np.asarray(drawn, float)
    removed = against(drawn[0, outline], drawn[:, outline], keeps_stretch)
    removed[0] = affine.identity(drawn.shape[-1])
    flat = np.flatnonzero(np.linalg.cond(removed[..., :-1]) > 1e8)
    if len(flat):
        raise InputError(
            f"the outline of a key must not be squashed flat, that of key {flat[0]} (counted from 0) is a line or a "
            "point against key 0: draw it again"
        )
    return affine.apply(affine.invert(removed), drawn), removed


def against(rest: NDArray, moved: NDArray, keeps_stretch: bool = False) -> NDArray:
    """The maps (..., d, d + 1) of rest onto moved (..., N, d): affine, or with `keeps_stretch` turn and shift."""
    return affine.fit_similarity(rest, moved, scaled=False) if keeps_stretch else affine.fit(rest, moved)


def inbetween_rows(keys: int, inbetweens: int = 5) -> NDArray:
    """Rows (D, 3): each key, then `inbetweens` steps of every pair once, D = K + K (K - 1) / 2 * M.

    Erratum: section 3.1.3 counts (K - 1)(K - 2) M, which is none for two keys.
    """
    rows = [(i, i, 0.0) for i in range(keys)]
    steps = np.arange(1, inbetweens + 1) / (inbetweens + 1)
    rows += [(i, j, s) for i in range(keys) for j in range(i + 1, keys) for s in steps]
    return np.array(rows, float)


def rigid(keys: KeySet) -> NDArray:
    """All rows (D, N, d) as rigid as possible, aligned to key 0.

    In-betweens are made of the keys as they were drawn and aligned afterwards, each by the same eq. 5: a bent leg that
    was squeezed by the alignment would not bend like a leg.
    """
    return keys._as_rigid


def straight(keys: KeySet) -> NDArray:
    """All rows (D, N, d) on straight lines between the aligned keys."""
    return arap.straight_inbetweens(keys.points, keys.faces, keys.rows)


def shapes(keys: KeySet, rule: Inbetweener = rigid) -> NDArray:
    """All rows redrawn (D, N, d) by the rule; as rigid as possible unless told otherwise."""
    return rule(keys)


def fold(rows: NDArray, weights: NDArray, keys: int) -> NDArray:
    """Weights over rows (..., D) as weights over keys (..., K): a row gives 1 - s to key i and s to key j."""
    rows = np.asarray(rows, float)
    table = np.zeros((len(rows), keys))
    at = np.arange(len(rows))
    np.add.at(table, (at, rows[:, 0].astype(int)), 1 - rows[:, 2])
    np.add.at(table, (at, rows[:, 1].astype(int)), rows[:, 2])
    return np.asarray(weights) @ table


def with_rows(keys: KeySet, rows: NDArray) -> KeySet:
    """The same keys with other in-between rows (D, 3), such as those of a captured motion."""
    return replace(keys, rows=np.asarray(rows, float))
