"""How large the drawings on a sprite sheet are, as far as the sheet tells."""

import numpy as np
from numpy.typing import NDArray

SMALLEST = 8  # pixels of a drawing


def tile_of(picture: NDArray) -> tuple[int, int]:
    """The (width, height) of the finest grid from the top left whose lines cross no ink; the whole where none does.

    Of grids that are about as fine, one that divides the sheet evenly is likelier.
    """
    ink = _ink(picture)
    return _pitch(ink.any(axis=0)), _pitch(ink.any(axis=1))


def _pitch(inked: NDArray) -> int:
    """The distance of lines that all lie between drawings, with a drawing between any two of them."""
    size = len(inked)
    last = int(np.flatnonzero(inked)[-1]) + 1 if inked.any() else size
    finest = 0
    for pitch in range(SMALLEST, min(size // 2 + 1, last)):
        lines = np.arange(pitch, last, pitch)
        cells = np.add.reduceat(inked[:last], np.concatenate([[0], lines]))
        if not (inked[lines] & inked[lines - 1]).any() and cells.all():
            if size % pitch == 0:
                return pitch
            finest = finest or pitch
        if finest and pitch >= 2 * finest:
            break
    return finest or size


def _ink(picture: NDArray) -> NDArray:
    """Pixels (H, W) of drawings: what is not clear, or not the colour of the corner."""
    if picture.shape[2] == 4 and picture[..., 3].min() < 128:
        return picture[..., 3] >= 16
    return np.abs(picture[..., :3].astype(int) - picture[0, 0, :3]).max(axis=-1) > 24
