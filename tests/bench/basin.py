"""From how far off a single fit finds the part: shares of trials that end within a pixel of the truth.

Each drawing is looked for from 30 % of the part's size off in eight directions, turned by 45 degrees either way, and
at half and at twice its size; size is the larger side of its box.  Parts under 48 pixels are listed apart.
"""

import numpy as np
from _common import cut, fitted, from_key

from capture.fit.pixels import model as models
from capture.motion import affine
from fixtures import jumps, maps, variants, write

FOUND = 1.0  # pixels, root mean square over the outline
SIZES = (190, 96, 48, 32)  # pixels: how large the part is in its key's drawing
SMALL = 48  # pixels from which a part counts as large enough
DRAWINGS = (4, 11, 18, 25, 32, 39)


def rows():
    """Per kind of part: all trials of parts of 48 pixels and more, then by size and by what was off."""
    figures = {}
    for kind, draw in (("affine", jumps.rigid_frog), ("keys", jumps.bending_frog)):
        found = {size: _trials(draw(), size) for size in SIZES}
        large = np.concatenate([np.concatenate(list(found[size].values())) for size in SIZES if size >= SMALL])
        figures[f"{kind}_found"] = large.mean()
        for size in SIZES:
            name = f"{kind}_{size}" if size >= SMALL else f"{kind}_small_{size}"
            figures[f"{name}_found"] = np.concatenate(list(found[size].values())).mean()
        for off in found[SIZES[0]]:
            figures[f"{kind}_{off}"] = np.concatenate([found[size][off] for size in SIZES if size >= SMALL]).mean()
    return figures


def _trials(toon, size):
    """Whether each trial found the part, by what was off."""
    across = np.ptp(toon.parts[0].points[0], axis=0).max()
    toon = variants.zoomed(toon, size / across)
    clip, part, truth = write.clip_in_memory(toon), toon.parts[0], from_key(toon)
    model = models.learn(write.shot_of(toon).parts[0], clip)
    found = {}
    for t in 2 * np.array(DRAWINGS):
        outline = part.points[t]
        frame = model.view.layer(*cut(model, clip, t, outline, margin=int(0.4 * size) + 8))
        for off, start in _starts(truth[t], outline):
            ended = fitted(model, frame, start)
            rms = np.sqrt(((ended - outline) ** 2).sum(axis=1).mean())
            found.setdefault(off, []).append(rms < FOUND)
    return {off: np.array(ends) for off, ends in found.items()}


def _starts(truth, outline):
    """What is off, and the map (2, 3) to start from."""
    low, high = outline.min(axis=0), outline.max(axis=0)
    centre, size = 0.5 * (low + high), (high - low).max()
    for angle in np.arange(8) * np.pi / 4:
        shift = 0.3 * size * np.array([np.cos(angle), np.sin(angle)])
        yield "shift_30_percent", affine.compose(np.column_stack([np.eye(2), shift]), truth)
    for angle in (-np.pi / 4, np.pi / 4):
        yield "turn_45_deg", affine.compose(maps.place(maps.turn(angle), centre, centre), truth)
    for name, scale in (("half_size", 0.5), ("twice_the_size", 2.0)):
        yield name, affine.compose(maps.place(scale * np.eye(2), centre, centre), truth)
