"""A motion that was changed, back on its feet: what stands in the source stands.

An exaggerated squash would lift the feet off the ground, and what announces a leap would drag them along.  So all of it
is moved, drawing by drawing: it is as low as the source wherever that touches the ground and never below, and a foot
that stays in the source stays.  Where is left open: a longer stride goes farther.  In between it is moved as calmly as
can be (`offsets`).
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
    contacts = staging.contacts(source, level)
    was, now = _lowest(source)[first], _lowest(motion)[first]
    seen = np.isfinite(was) & np.isfinite(now)
    tall = np.ptp(np.concatenate([keyset.points[0, keyset.outline] for keyset in source.keysets])[:, 1])
    touched = seen & (np.abs(was - level) <= staging.TOUCHING * tall)
    down = np.where(touched, was - now, np.nan)
    up = offsets.calmest(motion.times[first], staging.RISES, down, most=np.where(seen, level - now, np.inf))
    feet = staging.one_at_a_time([_strayed(motion, contact, drawing) for contact in contacts])
    begun = np.full(len(first), np.nan)
    if feet and feet[0][0][0] == 0:  # who begins on the ground begins where the source does
        on, path = feet.pop(0)
        begun[on] = path
    across = offsets.calmest(motion.times[first], staging.STRAYS, begun, feet)
    offset = np.stack([across, up], axis=-1)[drawing]
    if np.abs(offset).max() < NOTHING:
        return motion
    tracks = [track if track.parent else _moved(track, offset) for track in motion.tracks]
    return replace(motion, tracks=tuple(tracks))


def _strayed(motion: CartoonMotion, contact: staging.Contact, drawing: NDArray) -> offsets.Path:
    """The drawings (n,) of a contact, and how far its foot would have to be brought back along the ground (n,)."""
    own = motion.points(contact.part)[contact.start : contact.stop, :, 0] @ contact.foot
    on, at = np.unique(drawing[contact.start : contact.stop], return_index=True)
    return on, (contact.way - own)[at]


def _lowest(motion: CartoonMotion) -> NDArray:
    """The lowest point (T,) of the parts that are seen, -inf where none is."""
    lows = [np.where(track.visible, motion.outline(track.part)[..., 1].max(axis=1), -np.inf) for track in motion.tracks]
    return np.max(lows, axis=0)


def _moved(track: Track, offset: NDArray) -> Track:
    affine = track.affine.copy()
    affine[..., -1] += offset
    return replace(track, affine=affine)
