"""Whether a body that plays several parts turns inside out: then its limbs are not where the source's are."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from retarget.characters.body import Body
from retarget.stage.perform import Performance

MUCH = 0.06
"""Of a body's area: a seam may fold over as much, as a sleeve does in an elbow."""


@dataclass(frozen=True)
class Folds:
    """How much of a body's one drawing lies upside down in its worst frame."""

    drawing: str
    share: float
    worst: int  # that frame, from 0
    frames: int  # in how many it is much

    def __str__(self) -> str:
        frames = f"{self.frames} frame{'s' * (self.frames != 1)}"
        return (
            f"{self.drawing}: it folds over itself in {frames}, {self.share:.0%} of it in frame {self.worst}: its "
            "limbs are not where the source's are, say in a cast's [[bodies.parts]] where they are, by line or region"
        )


def folds(performance: Performance) -> list[Folds]:
    """The drawn bodies of which more than a little lies upside down in some frame; models have no upside."""
    found = []
    for role in performance.roles:
        keys = role.target.keys
        if not isinstance(role.target, Body) or keys.points.shape[-1] != 2:
            continue
        area = _areas(keys.points[0][keys.faces])
        share = (np.abs(area) * (_areas(role.mesh()[:, keys.faces]) * area < 0)).sum(axis=1) / np.abs(area).sum()
        share = np.where(role.visible, share, 0)
        if share.max() > MUCH:
            name = role.target.inner.part.rsplit("/", 1)[-1]
            found.append(Folds(name, float(share.max()), int(share.argmax()), int((share > MUCH).sum())))
    return found


def _areas(corners: NDArray) -> NDArray:
    """Signed areas (...) of triangles (..., 3, 2), twice."""
    a, b = corners[..., 1, :] - corners[..., 0, :], corners[..., 2, :] - corners[..., 0, :]
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
