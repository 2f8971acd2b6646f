"""A limb as a captured cartoon: its outline's key poses and in-betweens, which any cast can play.

What plays a motion of sub-links must have joints.  A drawing for each key pose needs none: the limb's outline in every
frame is captured like a cartoon's (Bregler et al. 2002), and the keys are its extremes, as an animator would choose.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.motion import affine
from capture.motion.tracks import CartoonMotion, total_affine

SLIM = 0.16
"""A limb's outline is so wide where nothing is said, as a share of its length."""

CAP = 3
"""Points on a limb's round end."""


def by_key_poses(
    lent: CartoonMotion,
    joints: Sequence[str],
    most_keys: int = 4,
    close: float | None = None,
    width: float | None = None,
    part: str = "limb",
) -> CartoonMotion:
    """A motion of sub-links as one of a single part with key poses: the limb that leads to `joints`, such as
    ("left_elbow", "left_hand").

    At most `most_keys` poses, as few as redraw all frames within `close` pixels, without it 4 % of the limb's length.
    """
    from capture.fit.contour import capture_outlines
    from capture.fit.suggest import suggest

    outlines = limb_outlines(lent, joints, width)
    length = np.linalg.norm(np.diff(outlines[0], axis=0), axis=1).sum() / 2
    chosen = suggest(outlines, 0.04 * length if close is None else close, most_keys)
    return capture_outlines(outlines, chosen.key_frames, lent.fps, lent.size, part)


def limb_outlines(lent: CartoonMotion, joints: Sequence[str], width: float | None = None) -> NDArray:
    """The outline (T, B, 2) of a limb: round the sub-links that lead to joints, as thick as they are."""
    names = [
        track.part
        for joint in joints
        for track in lent.tracks
        if track.part == joint or (track.part.rpartition(" ")[0] == joint and track.part.rpartition(" ")[2].isdigit())
    ]
    if not names or any(lent.track(b).parent != a for a, b in pairwise(names)):
        known = ", ".join(dict.fromkeys(track.part.partition(" ")[0] for track in lent.tracks))
        raise InputError(
            f"a limb must be joints that follow each other, got {', '.join(joints) or 'none'}: the motion has {known}"
        )
    ends = [_ends(lent, name) for name in names]
    drawn = sum(np.linalg.norm(stop - start) for start, stop in ends)
    half = 0.5 * (SLIM * drawn if width is None else width)
    line, thick = [], []
    for name, (start, stop) in zip(names, ends, strict=True):
        maps = total_affine(lent, name)
        line.append(affine.apply(maps, start[None])[:, 0])
        side = np.array([start[1] - stop[1], stop[0] - start[0]]) / np.linalg.norm(stop - start)
        thick.append(np.linalg.norm(maps[..., :2] @ side, axis=-1))
    line.append(affine.apply(maps, stop[None])[:, 0])
    thick.append(thick[-1])
    points, radius = np.stack(line, axis=1), half * np.stack(thick, axis=1)  # (T, n, 2), (T, n)
    way = np.gradient(points, axis=1)
    way /= np.maximum(np.linalg.norm(way, axis=-1, keepdims=True), 1e-12)
    side = np.stack([-way[..., 1], way[..., 0]], axis=-1)
    reach = radius[..., None]
    angle = np.pi * np.arange(1, CAP + 1) / (CAP + 1)
    tip = points[:, -1:] + reach[:, -1:] * (
        np.cos(angle)[:, None] * side[:, -1:] + np.sin(angle)[:, None] * way[:, -1:]
    )
    return np.concatenate([points + reach * side, tip, (points - reach * side)[:, ::-1]], axis=1)


def _ends(lent: CartoonMotion, name: str) -> tuple[NDArray, NDArray]:
    """Where a sub-link starts and stops at rest, by its quad."""
    quad = lent.keyset(name).points[0]
    return 0.5 * (quad[0] + quad[3]), 0.5 * (quad[1] + quad[2])
