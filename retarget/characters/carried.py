"""Key shapes for a model that has none, carried over from a drawing's: less work for the animator (section 4).

Where the drawing bends from its first key to another, the model bends along, through its whole depth.  The result is a
proposal: good enough to see the motion, and a start for an animator to correct.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from capture.motion import affine
from capture.motion.keys import KeySet
from retarget.characters import lift
from retarget.characters.meshfiles import Model

STIFFNESS = 0.2
"""How much a bend is evened out against the outline's own, where one is the drawing's height: details stay whole."""

MOST = 160
"""Outline points that are followed."""


def carried_shapes(
    model: Model, source: KeySet, plane: str | Sequence[float] = "xy", stiffness: float = STIFFNESS
) -> NDArray:
    """The model's shapes (K, N, 3), the first its own, for the keys of a drawing seen in the same plane.

    Both are laid into one frame, first key on first key, box on box.  Each key's outline then is a thin-plate spline
    of the first one's, which also moves what lies inside and beside it.
    """
    from scipy.interpolate import RBFInterpolator

    view = lift.view(plane)
    seen = (model.points @ view.T)[:, :2]
    drawn = affine.apply(source.removed, source.points)[:, source.outline]
    drawn = drawn[:, :: max(1, -(-drawn.shape[1] // MOST))]
    low, high = drawn[0].min(axis=0), drawn[0].max(axis=0)
    edges = seen[np.unique(model.faces)]
    least, span = edges.min(axis=0), np.ptp(edges, axis=0)
    tall = max(high[1] - low[1], 1e-9 * np.ptp(drawn))
    size = np.where(span > 0, (high - low) / np.where(span > 0, span, 1), 1.0)  # drawing pixels for a unit, in x and y
    at = ((seen - least) * size + low) / tall
    _, first = np.unique(np.round(drawn[0] / tall, 6), axis=0, return_index=True)  # a spline needs each place once
    shapes = [model.points]
    for key in drawn[1:]:
        bend = RBFInterpolator(drawn[0, first] / tall, (key - drawn[0])[first] / tall, smoothing=stiffness)
        moved = bend(at) * tall / size
        shapes.append(model.points + moved @ view[:2])
    return np.stack(shapes)
