"""What more pixels and more frames cost: processor time at three sizes and lengths, and the slopes between them.

A slope is that of the logarithm of time over the logarithm of pixels, or of frames: 1 where cost grows in proportion.
Learning is timed apart, for it does not grow with the clip.
"""

import numpy as np
from _common import captured

from fixtures import jumps, variants

ZOOMS = (0.5, 1.0, 2.0)  # pictures of 320 x 240, 640 x 480 and 1280 x 960, with the part in proportion
LENGTHS = (24, 48, 72)  # drawings of two frames


def rows():
    """Milliseconds a frame, and slopes, of an affine part and of one with keys."""
    figures = {}
    for kind, draw in (("affine", jumps.rigid_frog), ("keys", jumps.bending_frog)):
        pixels, seconds = [], []
        for zoom in ZOOMS:
            toon = variants.zoomed(draw(count=24), zoom)
            seconds.append(_following(toon) / len(toon))
            pixels.append(toon.size[0] * toon.size[1])
            figures[f"{kind}_ms_a_frame_at_{toon.size[0]}"] = 1e3 * seconds[-1]
        figures[f"{kind}_slope_over_pixels"] = _slope(pixels, seconds)
        seconds = [_following(variants.zoomed(draw(count=count), 0.5)) for count in LENGTHS]
        figures |= {f"{kind}_s_for_{2 * count}_frames": spent for count, spent in zip(LENGTHS, seconds)}
        figures[f"{kind}_slope_over_frames"] = _slope(LENGTHS, seconds)
    return figures


def _following(toon):
    _, seconds, learning = captured(toon)
    return seconds - learning


def _slope(amounts, seconds):
    return np.polyfit(np.log(amounts), np.log(seconds), 1)[0]
