"""A sheet to judge proposed keys by: the source's key drawings above, the character's below.

In the first column places of both outlines that belong together have the same number: what a pin is made of.
"""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from capture.motion import affine
from capture.motion.keys import KeySet
from retarget.characters.drawings import paths
from retarget.characters.drawings.paths import DrawnPath
from retarget.characters.proposed.propose import Proposal
from retarget.stage.draw2d import draw_things

GREY, MARK, TEXT = (196, 204, 214), (214, 40, 40), (40, 40, 40)
NUMBERS = 22


def key_sheet(proposal: Proposal, source: KeySet, width: int = 320) -> NDArray:
    """Two rows of K tiles, `width` pixels wide each: one RGB uint8 picture."""
    shapes = affine.apply(source.removed, source.points)[:, source.outline]
    above = _places(list(shapes), width)
    below = _places([_controls(drawn) for drawn in proposal.versions], width)
    rows = [[], []]
    for k, name in enumerate(proposal.names):
        tile = np.full((width, width, 3), 255, np.uint8)
        outline = affine.apply(above[k], shapes[k])
        cv2.fillPoly(tile, [np.round(16 * outline).astype(np.int32)], GREY, cv2.LINE_AA, 4)
        things = [paths.moved(path, below[k]) for path in proposal.versions[k]]
        drawn = draw_things(things, (width, width)).astype(float)
        alpha = drawn[..., 3:] / 255
        under = (drawn[..., :3] * alpha + 255 * (1 - alpha)).astype(np.uint8)
        if k == 0:
            _numbered(tile, outline)
            _numbered(under, affine.apply(below[0], proposal.places))
        cv2.putText(tile, name, (8, 20), cv2.FONT_HERSHEY_SIMPLEX, 0.5, TEXT, 1, cv2.LINE_AA)
        rows[0].append(tile)
        rows[1].append(under)
    return np.concatenate([np.concatenate(row, axis=1) for row in rows])


def _controls(drawn: Sequence[DrawnPath]) -> NDArray:
    return np.concatenate([path.points for path in drawn])


def _places(shapes: list[NDArray], width: int) -> list[NDArray]:
    """Maps (2, 3) that bring shapes (N, 2) into the middle of a tile, all at the scale of the largest."""
    spans = [np.ptp(shape, axis=0).max() for shape in shapes]
    scale = 0.84 * width / max(spans)
    middles = [0.5 * (shape.min(axis=0) + shape.max(axis=0)) for shape in shapes]
    return [np.column_stack([scale * np.eye(2), width / 2 - scale * middle]) for middle in middles]


def _numbered(tile: NDArray, outline: NDArray) -> None:
    """Draw dots at some points of an outline (B, 2), with their numbers outside of it."""
    middle = outline.mean(axis=0)
    for number in range(0, len(outline), max(1, round(len(outline) / NUMBERS))):
        x, y = np.round(outline[number]).astype(int).tolist()
        cv2.circle(tile, (x, y), 2, MARK, -1, cv2.LINE_AA)
        away = outline[number] - middle
        at = outline[number] + 9 * away / max(np.linalg.norm(away), 1e-9) + (-6, 4)
        place = tuple(np.round(at).astype(int).tolist())
        cv2.putText(tile, str(number), place, cv2.FONT_HERSHEY_SIMPLEX, 0.34, (255, 255, 255), 3, cv2.LINE_AA)
        cv2.putText(tile, str(number), place, cv2.FONT_HERSHEY_SIMPLEX, 0.34, MARK, 1, cv2.LINE_AA)
