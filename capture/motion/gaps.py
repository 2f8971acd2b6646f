"""What a part does while it is hidden: it goes, turning, from where it was seen last to where it is seen next.

A capture marks frames in which a part is not seen and holds its pose there.  A new character may be thinner than
the old one was, and show what that hid.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from capture.motion import affine
from capture.motion.tracks import CartoonMotion, Track


def bridged(motion: CartoonMotion) -> CartoonMotion:
    """The motion with every part seen in all frames; what is hidden at either end of the clip keeps its pose.

    Between, a part's own map turns evenly, the shorter way round, and its stretch, its place and its weights go
    straight.  A held drawing stays held.
    """
    return replace(motion, tracks=tuple(_bridged(track) for track in motion.tracks))


def limbs_bridged(motion: CartoonMotion) -> CartoonMotion:
    """The motion with limbs, parts that hang on another, seen between frames in which they were, if their parent is.

    An arm that passes behind its body does not go away.  What hangs on nothing may have, and stays hidden.
    """
    whole = {track.part: track for track in bridged(motion).tracks}
    seen: dict[str, NDArray] = {}

    def of(track: Track) -> NDArray:
        if track.part not in seen:
            here = track.visible
            between = np.maximum.accumulate(here) & np.maximum.accumulate(here[::-1])[::-1]
            seen[track.part] = here | (between & of(motion.track(track.parent))) if track.parent else here
        return seen[track.part]

    tracks = (whole[track.part] if track.parent else track for track in motion.tracks)
    return replace(motion, tracks=tuple(replace(track, visible=of(motion.track(track.part))) for track in tracks))


def _bridged(track: Track) -> Track:
    seen = np.flatnonzero(track.visible)
    if len(seen) in (0, len(track.visible)):
        return track
    count = np.arange(len(track.visible))
    first = np.maximum.accumulate(np.where(track.held, 0, count))  # the frame in which a held drawing came
    after = np.clip(np.searchsorted(seen, first), 0, len(seen) - 1)
    before = np.clip(np.searchsorted(seen, first, side="right") - 1, 0, len(seen) - 1)
    a, b = seen[before], seen[after]
    share = np.where(b > a, (first - a) / np.maximum(b - a, 1), 0.0)
    found = _between(track.affine[a], track.affine[b], share)
    weights = (1 - share)[:, None] * track.weights[a] + share[:, None] * track.weights[b]
    hidden = ~track.visible
    return replace(
        track,
        affine=np.where(hidden[:, None, None], found, track.affine),
        weights=np.where(hidden[:, None], weights, track.weights),
        visible=np.ones_like(track.visible),
    )


def _between(start: NDArray, stop: NDArray, share: NDArray) -> NDArray:
    """Maps (T, 2, 3) that are shares (T,) of the way from `start` to `stop` (T, 2, 3), turned apart from stretched."""
    angle = affine.turn(start)
    further = (affine.turn(stop) - angle + np.pi) % (2 * np.pi) - np.pi
    straight = [_turned(-affine.turn(maps)) @ maps[..., :2] for maps in (start, stop)]
    part = share[:, None, None]
    linear = _turned(angle + share * further) @ ((1 - part) * straight[0] + part * straight[1])
    return np.concatenate([linear, (1 - part) * start[..., 2:] + part * stop[..., 2:]], axis=-1)


def _turned(angle: NDArray) -> NDArray:
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([np.stack([c, -s], axis=-1), np.stack([s, c], axis=-1)], axis=-2)
