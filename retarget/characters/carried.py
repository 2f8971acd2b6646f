"""Key shapes for a model or a photograph that has none, carried over from a drawing's: less work for the animator
(section 4).

Where the drawing bends from its first key to another, it bends along, a model through its whole depth.  The result is a
proposal: good enough to see the motion, and a start for an animator to correct.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.motion.keys import KeySet
from retarget.characters import along, lift
from retarget.characters.meshfiles import Model

EVENLY = 1.0
"""How much a photograph is evened out: it is seldom built like the source, and is then better bent as a whole."""

ACROSS = 600
"""Pixels: a silhouette is as large as this when it is traced."""


def carried_shapes(model: Model, source: KeySet, plane: str | Sequence[float] = "xy") -> NDArray:
    """The model's shapes (K, N, 3), the first its own, for the keys of a drawing seen in the same plane.

    What is seen of the model is laid on the drawing's first key, box on box, and goes `along`.
    """
    view = lift.view(plane)
    seen = (model.points @ view.T)[:, :2]
    moved = along.gone_along(_silhouette(seen, model.faces), seen, source)
    return model.points + (moved - seen) @ view[:2]


def carried_outline(outline: NDArray, source: KeySet, name: str = "the picture") -> NDArray:
    """An outline (B, 2) in the source's K keys (K, B, 2), the first as it is: it goes `along`."""
    import shapely

    made = along.gone_along(shapely.Polygon(outline), np.asarray(outline, float), source, EVENLY)
    for key, bent in zip(source.names, made, strict=True):
        if not shapely.Polygon(bent).is_valid:
            raise InputError(
                f"{name} must have an outline for key {key!r}: bent as the captured key is, its own one would cross "
                "itself; give it in the cast"
            )
    return made


def _silhouette(seen: NDArray, faces: NDArray) -> object:
    """What faces (F, 3) cover of the plane, as a shapely shape without holes."""
    import cv2
    import shapely

    corners = seen[np.unique(faces)]
    low, scale = corners.min(axis=0), ACROSS / max(np.ptp(corners, axis=0).max(), 1e-300)
    at = np.round(((seen - low) * scale + 2) * 16).astype(np.int32)
    width, height = np.ceil(np.ptp(corners, axis=0) * scale).astype(int) + 5
    mask = np.zeros((height, width), np.uint8)
    for face in at[faces]:
        cv2.fillConvexPoly(mask, face, 1, shift=4)
    contours = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0]
    rings = [contour[:, 0] for contour in contours if len(contour) > 3]
    solids = [shapely.make_valid(shapely.Polygon((ring - 2) / scale + low)).buffer(0.5 / scale) for ring in rings]
    return shapely.union_all(solids)
