"""Covered and gone: a bar that passes over a fifth of the part, in a colour of its own and in the part's, and absence.

Errors are those of the drawn outline, covered or not; a frame counts as covered where the bar hides 5 % of the part.
"""

import numpy as np
from _common import LOST, captured, off

from fixtures import frog, jumps, variants

BARS = {"plum": (124, 92, 150), "own_color": frog.GREEN}
COVERED = 0.05  # share of the part
GONE = 46  # the frame from which the part is out of the picture, or on its way out; all keys come before it
HOME = 6  # frames that it stays away
BAR = (44, 90)  # the frames that the bar is on screen: after the last key
OVER_KEYS = (18, 78)  # and where it covers a fifth and a third of two of the four key drawings


def rows():
    """Medians while covered and after, what is lost after, and frames until a part that was away is found again."""
    figures = {}
    for kind, draw in (("affine", jumps.rigid_frog), ("keys", jumps.bending_frog)):
        for name, color in BARS.items():
            found = _bar(variants.barred(draw(), color, 0.2, *BAR))
            figures |= {f"{kind}_{name}_{key}": value for key, value in found.items()}
        figures |= {f"{kind}_gone_{key}": value for key, value in _away(variants.gone(draw(), GONE, HOME)).items()}
    over_keys = _bar(variants.barred(jumps.bending_frog(), BARS["plum"], 0.2, *OVER_KEYS))
    figures |= {f"keys_bar_over_keys_{key}": value for key, value in over_keys.items()}
    leaving = variants.leaving(jumps.rigid_frog(), GONE)  # over the picture's edge, which cuts it in between
    return figures | {f"affine_leaving_{key}": value for key, value in _away(leaving).items()}


def _bar(toon):
    hidden = np.array([_hidden(toon, t) for t in range(len(toon))])
    under = np.flatnonzero(hidden > COVERED)
    after = np.arange(len(toon)) > under[-1]
    motion, _, _ = captured(toon)
    error = off(motion, toon)
    return {
        "covered_share": np.median(hidden[under]),
        "covered_px": np.median(error[under]),
        "covered_lost": np.count_nonzero(np.median(error[under], axis=1) > LOST),
        "after_px": np.median(error[after]),
        "after_lost": np.count_nonzero(np.median(error[after], axis=1) > LOST),
    }


def _hidden(toon, t):
    if not toon.foreground(t):
        return 0.0
    name = toon.parts[0].name
    return 1 - toon.matte(t, name, visible=True).sum() / toon.matte(t, name).sum()


def _away(toon):
    """`away_seen`: frames without the part in which the capture claims to see it."""
    points = toon.parts[0].points
    low, high = points.min(axis=1), points.max(axis=1)
    inside = (high > 0).all(axis=1) & (low < toon.size).all(axis=1)  # at least in part
    away = np.flatnonzero(~inside)
    whole = ((low > 0) & (high < toon.size)).all(axis=1)
    back = np.flatnonzero(whole & (np.arange(len(toon)) > away[-1]))
    motion, _, _ = captured(toon)
    error = np.median(off(motion, toon), axis=1)
    found = np.flatnonzero(error[back] <= LOST)
    return {
        "frames": len(away),
        "away_seen": np.count_nonzero(motion.tracks[0].visible[away]),
        "frames_until_found": found[0] if len(found) else len(back),
        "after_px": np.median(error[back]),
        "after_lost": np.count_nonzero(error[back] > LOST),
    }
