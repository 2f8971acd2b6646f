"""A motion that was changed, back on its feet: what stood in the source stands where it stood.

An exaggerated squash would lift the feet off the ground, and what announces a leap would drag them along.  So the whole
motion is moved, drawing by drawing: it is as low as the source wherever that touches the ground and never below, and a
foot that stays in the source stays in the same place.  In between it goes over as calmly as can be (`offsets`).
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from capture.motion.tracks import CartoonMotion, Track
from retarget.stage import offsets, staging

NOTHING = 1e-6
"""Pixels that nothing need be moved by."""


def footed(motion: CartoonMotion, source: CartoonMotion) -> CartoonMotion:
    """The motion with its roots moved; unchanged where the source has no ground, or is not of pixels, y down."""
    level = staging.ground(source) if source.space == "pixels, y down" else None
    if level is None:
        return motion
    held = np.all([track.held for track in motion.tracks], axis=0)
    drawing = np.cumsum(~held | (np.arange(len(held)) == 0)) - 1
    first = np.flatnonzero(np.diff(drawing, prepend=-1))
    was, now = _lowest(source)[first], _lowest(motion)[first]
    seen = np.isfinite(was) & np.isfinite(now)
    tall = np.ptp(np.concatenate([keyset.points[0, keyset.outline] for keyset in source.keysets])[:, 1])
    touched = seen & (np.abs(was - level) <= staging.TOUCHING * tall)
    down = np.where(touched, was - now, np.nan)
    up = offsets.calmest(motion.times[first], staging.RISES, down, most=np.where(seen, level - now, np.inf))
    across = offsets.calmest(motion.times[first], staging.STRAYS, _strayed(motion, source, level)[first])
    offset = np.stack([across, up], axis=-1)[drawing]
    if np.abs(offset).max() < NOTHING:
        return motion
    tracks = [track if track.parent else _moved(track, offset) for track in motion.tracks]
    return replace(motion, tracks=tuple(tracks))


def _strayed(motion: CartoonMotion, source: CartoonMotion, level: float) -> NDArray:
    """How far feet that stay would have to be brought back along the ground (T,), NaN where none stays."""
    back = np.full(len(motion.times), np.nan)
    for contact in staging.contacts(source, level):
        stays = np.arange(contact.start, contact.stop)
        own = motion.points(contact.part)[stays, :, 0] @ contact.foot
        back[stays] = np.where(np.isnan(back[stays]), contact.way - own, back[stays])  # of two feet, the first
    return back


def _lowest(motion: CartoonMotion) -> NDArray:
    """The lowest point (T,) of the parts that are seen, -inf where none is."""
    lows = [np.where(track.visible, motion.outline(track.part)[..., 1].max(axis=1), -np.inf) for track in motion.tracks]
    return np.max(lows, axis=0)


def _moved(track: Track, offset: NDArray) -> Track:
    affine = track.affine.copy()
    affine[..., -1] += offset
    return replace(track, affine=affine)
