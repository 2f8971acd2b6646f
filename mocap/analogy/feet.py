"""Feet of a made-up motion that stand where they step (Wu et al. 2008, section 3.7).

A foot that was on the ground in B, and is near it in B', is meant to stand.  It is held at the one place where it
strays least, by turning the leg's joints; hips that are too high for that come down a little.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mocap.analogy.curves import hips
from mocap.body import find_body
from mocap.contacts import find_contacts, floors, speeds
from mocap.reach import reached
from mocap.rubber.constrain import BLEND, Goal, easing
from mocap.skeleton import SkeletonMotion
from mocap.units import STATURE, stature

NEAR, CALM = 0.1, 1.0
"""A foot that stands in B stands in B' too, if it is no higher than so many metres there and moves no faster, m/s."""

REACH = 0.995
"""Of a leg's length: nearer to straight it would snap."""


def meant(made: SkeletonMotion, given: SkeletonMotion, when: NDArray) -> tuple[tuple[int, ...], NDArray, float]:
    """The joints that stand, in which frames of B' they are meant to (T, F), and how fast they slid in B, m/s.

    Those are the frames in which they stand, and those in which they stood in B, whose frame t comes at `when[t]`, and
    are near the ground and calm: a run made of a walk flies where its A' flies.
    """
    body = find_body(made.skeleton, given.positions())
    feet = body.feet
    if not feet:
        return feet, np.zeros((len(made), 0), bool), 0.0
    tall = stature(given, body) / STATURE or 1.0
    then = np.interp(np.linspace(0, when[-1], len(made)), when, np.arange(len(when)))
    before = find_contacts(given, feet)
    stood = before[np.round(then).astype(int)]
    places = made.positions()[:, feet]
    near = places[..., 1] - floors(places, made.fps, tall) < NEAR * tall
    calm = speeds(places, made.fps) < CALM * tall
    return (
        feet,
        find_contacts(made, feet) | (stood & near & calm),
        _slide(given.positions()[:, feet], before, given.fps),
    )


def standing(
    motion: SkeletonMotion, feet: Sequence[int], contacts: NDArray, slide: float = 0.0, blend: float = BLEND
) -> SkeletonMotion:
    """The motion (T frames) with the joints `feet` (F,) standing in their contacts (T, F); bones keep their lengths.

    A foot that slides on average faster than `slide` metres a second in a contact is slowed down to that.
    """
    places = motion.positions()
    goals = [
        _stand(joint, places[:, joint], contacts[:, foot], motion.fps, slide, blend)
        for foot, joint in enumerate(feet)
        if contacts[:, foot].any()
    ]
    if not goals:
        return motion
    body = hips(motion)
    return reached(_lowered(motion, goals, body), goals, body)


def _slide(feet: NDArray, contacts: NDArray, fps: float) -> float:
    """Mean speed of feet (T, F, 3) in their contacts, metres a second."""
    both = contacts[1:] & contacts[:-1]
    return float(np.linalg.norm(np.diff(feet[..., [0, 2]], axis=0), axis=-1)[both].mean() * fps) if both.any() else 0.0


def _stand(joint: int, places: NDArray, contact: NDArray, fps: float, slide: float, blend: float) -> Goal:
    """A goal about the mean place of every stretch of contact, and between two of them where the joint is."""
    held = places.copy()
    for first, stop in np.flatnonzero(np.diff(np.r_[0, contact, 0])).reshape(-1, 2):
        own = places[first:stop]
        speed = np.linalg.norm(np.diff(own[:, [0, 2]], axis=0), axis=1).mean() * fps if stop - first > 1 else 0.0
        middle = own.mean(axis=0)
        held[first:stop] = middle + min(1.0, slide / max(speed, 1e-9)) * (own - middle)
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
    above = parents[body]
    turn = np.eye(3) if above < 0 else world[:, above, :, :3]
    translation = motion.translation.copy()
    translation[:, body] -= np.swapaxes(turn, -1, -2) @ np.array([0, 1.0, 0]) * down[:, None]
    return replace(motion, translation=translation)
