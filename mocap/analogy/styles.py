"""Styles by formula, for where no capture of them is at hand: crouching, stepping aside, drunk, slow and fast.

Each is made of a motion, upright and in metres, whose feet go on standing where they stood.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mocap.analogy import curves as curving
from mocap.analogy.carry import shifted
from mocap.bodies.body import find_body
from mocap.bodies.reach import reached
from mocap.rubber.constrain import Goal
from mocap.skeletons.skeleton import SkeletonMotion


def crouched(motion: SkeletonMotion, lower: float = 0.15, bend: float = 0.4) -> SkeletonMotion:
    """The motion with its hips so many metres `lower`, its back bent forward by `bend` radians, its feet there."""
    feet = _feet(motion)
    low = shifted(motion, np.tile([0, -lower, 0], (len(motion), 1)))
    return _footed(leaning(low, bend), feet, motion.positions()[:, feet])


def drunk(motion: SkeletonMotion, sway: float = 0.08, roll: float = 0.25, slower: float = 1.25) -> SkeletonMotion:
    """The motion `slower`, its hips swaying aside by so many metres and its back rolling by so many radians."""
    motion = sped(motion, 1 / slower)
    feet = _feet(motion)
    t = np.arange(len(motion)) / motion.fps
    wave = np.sin(2 * np.pi * t / 1.7) + 0.6 * np.sin(2 * np.pi * t / 1.07 + 1)  # seconds; never quite the same
    aside = facing(motion)[:, [2, 1, 0]] * [1, 0, -1]
    swayed = shifted(motion, sway * wave[:, None] * aside)
    return _footed(leaning(swayed, 0.15, roll * wave), feet, motion.positions()[:, feet])


def aside(motion: SkeletonMotion, share: float = 0.5) -> SkeletonMotion:
    """The motion going to its left, not ahead: steps as long, times `share`, body and arms facing as before."""
    feet = _feet(motion)
    ahead = facing(motion).mean(axis=0)
    ahead /= np.linalg.norm(ahead)
    left = np.array([ahead[2], 0, -ahead[0]])
    places = motion.positions()
    hips = places[:, curving.hips(motion)]
    way = ((hips - hips[0]) @ ahead)[:, None]
    moved = shifted(motion, way * (share * left - ahead))
    step = ((places[:, feet[::2]] - hips[:, None]) @ ahead)[..., None].repeat(2, axis=1)
    # what an ankle goes ahead of the hips it goes to the left of them, and its toe with it
    standing = places[:, feet] + (way * (share * left - ahead))[:, None] + step * (share * left - ahead)
    return _footed(moved, feet, standing)


def sped(motion: SkeletonMotion, times: float) -> SkeletonMotion:
    """The motion so many times as fast, at its frame rate."""
    told, start = curving.of_skeleton(motion)
    count = round((len(motion) - 1) / times) + 1
    values = curving.sampled(told.values, np.linspace(0, len(motion) - 1, count))
    values[:, np.isin(told.kinds, curving.RATES)] *= (len(motion) - 1) / (count - 1)
    return curving.to_skeleton(replace(told, values=values), start, motion)


def leaning(motion: SkeletonMotion, ahead: float, left: NDArray | float = 0.0) -> SkeletonMotion:
    """The motion with its back leaning ahead and to its left by radians, one for all or (T,)."""
    from scipy.spatial.transform import Rotation

    hips = motion.skeleton.path(curving.hips(motion))
    spine = [k for k in find_body(motion.skeleton, motion.positions()).parts.get("spine", ()) if k not in hips]
    if not spine:
        return motion
    parent = motion.world()[:, motion.skeleton.parents[spine[0]], :, :3]
    front = facing(motion)
    across = front[:, [2, 1, 0]] * [1, 0, -1]  # to the left
    turn = np.broadcast_to(ahead, len(motion))[:, None] * across - np.broadcast_to(left, len(motion))[:, None] * front
    own = Rotation.from_rotvec(np.einsum("tji,tj->ti", parent, turn))  # in the space of what the spine hangs on
    rotation = motion.rotation.copy()
    rotation[:, spine[0]] = (own * Rotation.from_quat(rotation[:, spine[0]])).as_quat()
    return replace(motion, rotation=rotation)


def _footed(motion: SkeletonMotion, feet: Sequence[int], places: NDArray) -> SkeletonMotion:
    """The motion with its feet at places (T, F, 3)."""
    every = np.ones(len(motion))
    return reached(motion, [Goal(foot, places[:, k], every) for k, foot in enumerate(feet)], curving.hips(motion), 40)


def _feet(motion: SkeletonMotion) -> list[int]:
    """Ankles and toes."""
    toes = find_body(motion.skeleton, motion.positions()).feet
    return [joint for toe in toes for joint in (motion.skeleton.parents[toe], toe)]


def facing(motion: SkeletonMotion) -> NDArray:
    """Where the body faces (T, 3), along the floor: across the hips, with the left leg on its left."""
    places, parts = motion.positions(), find_body(motion.skeleton, motion.positions()).parts
    left = places[:, parts["left leg"][0]] - places[:, parts["right leg"][0]]
    front = np.stack([-left[:, 2], 0 * left[:, 1], left[:, 0]], axis=-1)
    return front / np.maximum(np.linalg.norm(front, axis=1, keepdims=True), 1e-9)
