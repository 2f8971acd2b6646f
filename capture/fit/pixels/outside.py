"""Drawings outside the keys' span: what the keys can say of them, found by way of what is drawn.

No two drawings are alike, and no mix of keys is quite the frame's.  A template that bends through the keys alone is
then pulled to and fro by what it cannot follow: a line that is off by more than its own width tells nothing, and a
line tells nothing of the way along itself.  So the template is let loose: beside the keys' modes it follows a smooth
field, which goes where the picture leads; that is the drawing as it is.  Of all the key-shape space the nearest to
its outline is the answer, as in contour capture (Bregler et al. 2002, section 3.2).
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from capture.fit.pixels import track_shape
from capture.fit.pixels.judge import Judgement
from capture.fit.pixels.keyimages import MeshMap
from capture.fit.pixels.layer import Layer
from capture.fit.pixels.track_shape import ShapeTemplate
from capture.fit.shapes import keyspace
from capture.fit.shapes.fields import smooth_fields
from capture.fit.shapes.keyspace import KeySpace
from capture.motion import affine

UNSAID = 0.4  # pixels of misfit: below this the keys say all that the picture's noise lets one see
LOOSER = 2.0  # pixels of push to a pixel of misfit: slopes see one direction of two, and only what agrees is counted
SIZES = (1, 0)  # the levels at which the template is let loose: half size, where it has far to go, and full size
EVERY = 6  # at full size one telling pixel in six: fields are smooth
FEWER = 0.02  # share of the pixels that may cease to agree: more, and the field follows somebody else


@dataclass(frozen=True, eq=False)
class LooseTemplate:
    """A template bent by the keys' modes and by smooth fields."""

    template: ShapeTemplate  # its modes are the keys' L and the fields' F; spreads of the fields are for 1 pixel
    space: KeySpace  # the keys' modes alone
    outline: NDArray  # (B,) mesh points of the boundary
    fields: NDArray  # (F, B, 2) the fields on the outline


def loose_template(textures: list[Layer], place: MeshMap, space: KeySpace, outline: NDArray) -> LooseTemplate:
    """Prepare K textures on the grid of the mean shape's mesh map."""
    fields, spread = smooth_fields(space.mean)
    both = replace(space, modes=np.concatenate([space.modes, fields]), spread=np.append(space.spread, spread))
    template = track_shape.shape_template(textures, place, both, EVERY, SIZES)
    return LooseTemplate(template, space, outline, fields[:, outline])


def by_way_of_the_drawing(
    loose: LooseTemplate, frame: Layer, placed: NDArray, alpha: NDArray, amounts: NDArray, misfit: float
) -> tuple[NDArray, NDArray]:
    """Map (2, 3) and the keys' mode weights (L,), from ones that leave a `misfit` in pixels.

    They come back as they were where the keys say enough, and where the field finds no more of the part than they.
    """
    if not UNSAID < misfit < np.inf:
        return placed, alpha
    count, template = len(alpha), loose.template
    spread = np.append(template.spread[:count], LOOSER * misfit * template.spread[count:])
    template = replace(template, spread=spread)
    start = np.append(alpha, np.zeros(len(spread) - count))
    seen, bent = track_shape.refine(template, frame, placed, start, amounts, *SIZES)
    before, after = (
        track_shape.judged(template, frame, where, how, amounts) for where, how in ((placed, start), (seen, bent))
    )
    if not np.isfinite(seen).all() or not _better(after, before):
        return placed, alpha
    drawn = keyspace.mix(_on_outline(loose), bent[:count]) + np.tensordot(bent[count:], loose.fields, axes=1)
    return keyspace.nearest(loose.space, affine.apply(seen, drawn), loose.outline, seen, bent[:count])


def _better(after: Judgement, before: Judgement) -> bool:
    return after.misfit < before.misfit and after.agreeing > before.agreeing - FEWER


def _on_outline(loose: LooseTemplate) -> KeySpace:
    return replace(loose.space, mean=loose.space.mean[loose.outline], modes=loose.space.modes[:, loose.outline])
