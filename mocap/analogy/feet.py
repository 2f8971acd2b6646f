"""Feet of a made-up motion that stand where they step (Wu et al. 2008, section 3.7).

A foot that was on the ground in B, and is near it in B', is meant to stand.  It is held at the one place where it
strays least, by turning the leg's joints; hips that are too high for that come down a little.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mocap.analogy.carry import shifted
from mocap.analogy.curves import hips
from mocap.analogy.lend import larger
from mocap.bodies.body import find_body
from mocap.bodies.contacts import SHORTEST, find_contacts, floors, runs, speeds
from mocap.bodies.reach import reached
from mocap.report import skate
from mocap.rubber.constrain import BLEND, Goal, easing
from mocap.skeletons.skeleton import SkeletonMotion
from mocap.skeletons.units import STATURE, stature

NEAR, CALM = 0.1, 1.0
"""A foot that is meant to stand does, if it is no higher than so many metres over the floor and no faster, m/s."""

OFF = 1e-3
"""Metres: what is so near to where it must be is there."""

EVEN = 0.05
"""Seconds: how high feet stand is known of whole frames of other motions, and must not jump from one to the next."""

REACH = 0.995
"""Of a leg's length: nearer to straight it would snap."""


def meant(
    one: SkeletonMotion, two: SkeletonMotion, three: SkeletonMotion, moments: NDArray, changed: Sequence[str]
) -> tuple[tuple[int, ...], NDArray, NDArray]:
    """The joints of B that stand, in which frames of B' (T, F) they are meant to, and how high they then are, metres.

    It is an analogy of its own: a foot does what it does in B where it does the same in A and A', else what it does in
    A'.  So a run made of a walk flies where its A' flies.  `moments` (T, 3) are the frames, at B's rate, of A, A' and B
    that each frame of B' comes of; a leg of which nothing is `changed` stands as in B.
    """
    body = find_body(three.skeleton, three.positions())
    given, before, after = (_stands(motion, three, moments[:, k]) for motion, k in ((three, 2), (one, 0), (two, 1)))
    columns, heights = [], []
    for name, joints in body.parts.items():
        if not name.endswith("leg"):
            continue
        stands, height = given[name]
        moved = any(three.skeleton.names[joint] in changed for joint in joints)
        if moved and name in before and name in after:
            one_stands, two_stands = before[name][0] > 0, after[name][0] > 0
            all_stand = one_stands & two_stands & (stands > 0)
            together = after[name][1] + height - before[name][1]
            stands, height = np.where(one_stands == two_stands, given[name], after[name])
            height = np.where(all_stand, together, height)
        columns.append(_lasting(stands.astype(bool), three.fps))
        heights.append(height)
    if not columns:
        return body.feet, np.zeros((len(moments), 0), bool), np.zeros((len(moments), 0))
    return body.feet, np.stack(columns, axis=-1), np.stack(heights, axis=-1)


def _lasting(stands: NDArray, fps: float) -> NDArray:
    """Contacts (T,) without those for an instant, where A and A' do not begin to stand in quite the same frame."""
    kept = np.zeros_like(stands)
    for first, stop in runs(stands):
        kept[first:stop] = stop - first >= min(SHORTEST * fps, len(stands))
    return kept


def calm(motion: SkeletonMotion, feet: Sequence[int], stand: NDArray) -> NDArray:
    """Of the frames in which feet are meant to `stand` (T, F) those in which they could, and those in which they do."""
    body = find_body(motion.skeleton, motion.positions())
    tall = stature(motion, body) / STATURE or 1.0
    places = motion.positions()[:, feet]
    near = places[..., 1] - floors(places, motion.fps, tall) < NEAR * tall
    slow = speeds(places, motion.fps) < CALM * tall
    return find_contacts(motion, feet) | (stand & near & slow)


def slide(motion: SkeletonMotion) -> float:
    """Mean speed along the floor of a motion's feet while they stand, metres a second."""
    feet = find_body(motion.skeleton, motion.positions()).feet
    mean = skate(motion.positions()[:, feet], find_contacts(motion, feet), motion.fps) / 100 if feet else np.nan
    return mean if np.isfinite(mean) else 0.0


def standing(
    motion: SkeletonMotion,
    feet: Sequence[int],
    contacts: NDArray,
    slide: float = 0.0,
    heights: NDArray | None = None,
    blend: float = BLEND,
) -> SkeletonMotion:
    """The motion (T frames) with the joints `feet` (F,) standing in their contacts (T, F); bones keep their lengths.

    They are at `heights` (T, F), by default at their mean ones.  On average they slide no faster than `slide` metres a
    second; those that slide least are left alone.
    """
    places = motion.positions()[:, feet]
    most = _most(places, contacts, motion.fps, slide)
    off = 0.0 if heights is None else np.abs(heights - places[..., 1])[contacts].max(initial=0.0)
    if not contacts.any() or (np.isinf(most) and off < OFF):
        return motion
    goals = [
        _stand(
            joint,
            places[:, foot],
            contacts[:, foot],
            None if heights is None else heights[:, foot],
            motion.fps,
            most,
            blend,
        )
        for foot, joint in enumerate(feet)
        if contacts[:, foot].any()
    ]
    body = hips(motion)
    return reached(_lowered(motion, goals, body), goals, body)


def _most(feet: NDArray, contacts: NDArray, fps: float, mean: float) -> float:
    """How fast a foot (T, F, 3) may slide in one contact so that all do by `mean` metres a second; inf if they do."""
    slides = [_speed(feet[a:b, k], fps) for k in range(len(contacts.T)) for a, b in runs(contacts[:, k]) if b - a > 1]
    frames = [b - a - 1 for k in range(len(contacts.T)) for a, b in runs(contacts[:, k]) if b - a > 1]
    if not slides or np.average(slides, weights=frames) <= mean:
        return np.inf
    slowest, share = np.sort(slides), np.array(frames)[np.argsort(slides)] / sum(frames)
    below = np.concatenate([[0], np.cumsum(slowest * share)])[:-1]  # what those slower than each add to the mean
    above = np.cumsum(share[::-1])[::-1]
    caps = (mean - below) / above
    return float(caps[np.argmax(slowest > caps)])


def _speed(places: NDArray, fps: float) -> float:
    """Mean speed along the floor of one foot (n, 3), metres a second."""
    return float(np.linalg.norm(np.diff(places[:, [0, 2]], axis=0), axis=1).mean() * fps) if len(places) > 1 else 0.0


def _stands(motion: SkeletonMotion, goal: SkeletonMotion, frames: NDArray) -> dict[str, NDArray]:
    """For each leg whether its foot stands and how high it is (2, T), in frames (T,) at the rate of `goal`.

    Heights are those of a figure as tall as `goal`.
    """
    places = motion.positions()
    body = find_body(motion.skeleton, places)
    legs = [name for name in body.parts if name.endswith("leg")]
    own = np.round(frames * motion.fps / goal.fps).astype(int).clip(0, len(motion) - 1)
    found = find_contacts(motion, body.feet)[own]
    taller = larger(motion, goal)
    return {
        name: np.stack([found[:, k], taller * places[own, foot, 1]])
        for k, (name, foot) in enumerate(zip(legs, body.feet))
    }


def _stand(
    joint: int, places: NDArray, contact: NDArray, height: NDArray | None, fps: float, most: float, blend: float
) -> Goal:
    """A goal about the mean place of every stretch of contact, at `height` (T,); between two where the joint is."""
    from scipy.ndimage import gaussian_filter1d

    held = places.copy()
    for first, stop in runs(contact):
        own = places[first:stop]
        middle = own.mean(axis=0)
        held[first:stop] = middle + min(1.0, most / max(_speed(own, fps), 1e-9)) * (own - middle)
        if height is None:
            continue
        off = height[first:stop] - own[:, 1]
        held[first:stop, 1] = own[:, 1] + gaussian_filter1d(off, EVEN * fps, mode="nearest")
    hold = easing(contact, fps, blend)
    known = np.flatnonzero(contact)
    shift = np.stack([np.interp(np.arange(len(held)), known, (held - places)[known, k]) for k in range(3)], axis=-1)
    return Goal(joint, places + shift, hold)


def _lowered(motion: SkeletonMotion, goals: Sequence[Goal], body: int) -> SkeletonMotion:
    """The motion with the hips let down, smoothly, where a leg would have to be longer than it is."""
    from scipy.ndimage import gaussian_filter1d, maximum_filter1d

    world, parents = motion.world(), motion.skeleton.parents
    lack = np.zeros(len(motion))
    for goal in goals:
        way = [goal.joint]
        while parents[way[-1]] not in (body, -1):
            way.append(parents[way[-1]])
        hip = world[:, way[-1], :, 3]
        length = REACH * sum(np.linalg.norm(motion.translation[:, joint], axis=1).mean() for joint in way[:-1])
        wanted = goal.hold[:, None] * goal.places + (1 - goal.hold)[:, None] * world[:, goal.joint, :, 3]
        aside = np.minimum(np.linalg.norm((wanted - hip)[:, [0, 2]], axis=1), 0.9 * length)
        lack = np.maximum(lack, hip[:, 1] - wanted[:, 1] - np.sqrt(length**2 - aside**2))
    lack = np.where(np.max([goal.hold for goal in goals], axis=0) > 0, lack, 0.0)
    if lack.max() <= 0:
        return motion
    width = BLEND * motion.fps
    down = gaussian_filter1d(maximum_filter1d(lack, 2 * int(2 * width) + 1), width, mode="nearest")
    return shifted(motion, down[:, None] * [0, -1.0, 0])
