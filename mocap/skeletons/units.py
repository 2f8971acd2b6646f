"""Which way is up and how long a unit is: files do not say, bodies do.

A person's head is over its feet and a person is as tall as people are; a beast's legs are under it.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mocap.bodies.body import Body, find_body, rest_places
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion

METRES = {
    "metres": 1.0,
    "centimetres": 0.01,
    "millimetres": 0.001,
    "inches": 0.0254,
    "units of 5.64 cm (CMU's: inches times 0.45)": 0.0254 / 0.45,
}
STATURE, PERSON = 1.7, (0.9, 2.2)
"""Metres a person is tall, and how small or tall one may be before a unit is not believed."""
LEG = 0.491
"""From hip to ankle, of a person's stature (Drillis and Contini 1966: 0.530 less 0.039)."""
BEAST = (0.2, 8.0)
"""Metres from tip to tip of what is no person."""
LOW = 0.6
"""Who keeps lower than this share of a leg all the time lies, whatever the axes are."""


def upright(motion: SkeletonMotion) -> SkeletonMotion:
    """The motion in metres, y up; the facing stays.  What was inferred is said in `notes`.

    A person of no known unit is taken to be 1.7 m tall.  What is upright and in metres stays as it is.
    """
    places = motion.positions()
    body = find_body(motion.skeleton, places)
    up, notes = _up(motion.skeleton, body, places)
    factor, said = _metres(motion, body)
    turned = _turned(motion, body, up)
    skeleton = replace(motion.skeleton, offsets=factor * turned.skeleton.offsets)
    notes = tuple(note for note in (*motion.notes, *notes, *said) if note)
    return replace(turned, skeleton=skeleton, translation=factor * turned.translation, notes=notes)


def stature(motion: SkeletonMotion, body: Body) -> float:
    """How tall a person with such legs stands, in the motion's unit; 0 for what has not two legs."""
    legs = [body.parts.get(f"{side} leg", ()) for side in ("left", "right")]
    if len(body.legs()) != 2 or not all(legs):
        return 0.0
    lengths = link_lengths(motion)
    return float(np.mean([lengths[list(_to_ankle(leg))].sum() for leg in legs])) / LEG


def _to_ankle(leg: tuple[int, ...]) -> tuple[int, ...]:
    return leg[1:-1] if len(leg) > 3 else leg[1:]


def link_lengths(motion: SkeletonMotion) -> NDArray:
    """How long the link above each joint is (J,), the median over time; roots 0.

    Some files give no lengths at rest and move each joint instead.
    """
    lengths = np.median(np.linalg.norm(motion.translation, axis=-1), axis=0)
    return np.where(np.array(motion.skeleton.parents) < 0, 0.0, lengths)


def _up(skeleton: Skeleton, body: Body, places: NDArray) -> tuple[tuple[int, int], list[str]]:
    """The axis that is up (1 or 2) and its sign."""
    moving, still = _over(body, places), _over(body, rest_places(skeleton)[None])
    if moving is None:
        return (1, 1), ["it has no legs to tell which way is up; y was taken"]
    axis = 1 + int(np.abs(moving[1:]).argmax())
    clear = abs(moving[axis]) > 0.7
    rest = 1 + int(np.abs(still[1:]).argmax())
    said_by_rest = abs(still[rest]) > 0.9
    if clear and said_by_rest and rest != axis and _lies(body, places, rest):
        clear = False
    if not clear:
        axis, sign = (rest, int(np.sign(still[rest]))) if said_by_rest else (1, 1)
        return (axis, sign), [f"it never stands upright; {'-' * (sign < 0)}{'xyz'[axis]} was taken for up"]
    sign = int(np.sign(moving[axis]))
    if sign < 0 and said_by_rest and rest == axis and still[axis] > 0:  # a handstand
        sign = 1
    notes = [f"its {'-' * (sign < 0)}{'xyz'[axis]} axis was up; it was turned, so that y is"]
    return (axis, sign), notes if (axis, sign) != (1, 1) else []


def _over(body: Body, places: NDArray) -> NDArray | None:
    """Which way the body is over its feet (3,), a mean of unit vectors: 1 long where it never changes."""
    legs = body.legs()
    if not legs:
        return None
    feet = sum(places[:, leg[-1]] for leg in legs) / len(legs)
    upper = [body.parts["head"][-1]] if len(legs) == 2 and "head" in body.parts else [leg[0] for leg in legs]
    way = places[:, upper].mean(axis=1) - feet
    return (way / np.maximum(np.linalg.norm(way, axis=-1, keepdims=True), 1e-12)).mean(axis=0)


def _lies(body: Body, places: NDArray, axis: int) -> bool:
    leg = body.legs()[0]
    length = np.linalg.norm(np.diff(places[0, list(leg)], axis=0), axis=-1).sum()
    height = places[..., axis]
    return bool((height.max() - np.percentile(height, 1)) < LOW * length)


def _metres(motion: SkeletonMotion, body: Body) -> tuple[float, list[str]]:
    """Metres in the motion's unit."""
    tall = stature(motion, body)
    if tall > 0:
        heights = {unit: tall * metres for unit, metres in METRES.items()}
        people = {unit: height for unit, height in heights.items() if PERSON[0] <= height <= PERSON[1]}
        if not people:
            return STATURE / tall, [f"no unit makes it as tall as a person; it was made {STATURE} m tall"]
        unit = min(people, key=lambda unit: abs(np.log(people[unit] / STATURE)))
        notes = [f"its lengths are in {unit}: the figure is {people[unit]:.2f} m tall; they were turned into metres"]
        return METRES[unit], notes if unit != "metres" else []
    size = float(link_lengths(motion).sum())
    for unit in ("metres", "centimetres", "millimetres", "inches"):
        if BEAST[0] <= size * METRES[unit] <= BEAST[1]:
            notes = [f"its lengths are in {unit}, if it is about {size * METRES[unit]:.2g} m of links; now in metres"]
            return METRES[unit], notes if unit != "metres" else []
    if size == 0:
        return 1.0, ["its joints all lie in one place, so its unit is unknown; metres were taken"]
    return 1 / size, ["no unit makes it as large as a living thing; it was given 1 m of links"]


def _turned(motion: SkeletonMotion, body: Body, up: tuple[int, int]) -> SkeletonMotion:
    """The motion with y where the axis `up` was, turned about x."""
    from scipy.spatial.transform import Rotation

    angle = {(1, 1): 0.0, (2, 1): -90.0, (1, -1): 180.0, (2, -1): 90.0}[up]
    if angle == 0:
        return motion
    skeleton, turn = motion.skeleton, Rotation.from_euler("x", angle, degrees=True)
    matrix = np.round(turn.as_matrix())
    rest = _over(body, rest_places(skeleton)[None])
    if rest is not None and up[1] * rest[up[0]] > 0.5:  # the rest pose has the same axis up: all is turned
        xyz = motion.rotation[..., :3] @ matrix.T
        rotation = np.concatenate([xyz, motion.rotation[..., 3:]], axis=-1)
        offsets, translation = skeleton.offsets @ matrix.T, motion.translation @ matrix.T
        return replace(motion, skeleton=replace(skeleton, offsets=offsets), translation=translation, rotation=rotation)
    roots = [joint for joint, parent in enumerate(skeleton.parents) if parent < 0]
    offsets, translation, rotation = skeleton.offsets.copy(), motion.translation.copy(), motion.rotation.copy()
    offsets[roots], translation[:, roots] = offsets[roots] @ matrix.T, translation[:, roots] @ matrix.T
    for root in roots:
        rotation[:, root] = (turn * Rotation.from_quat(rotation[:, root])).as_quat()
    return replace(motion, skeleton=replace(skeleton, offsets=offsets), translation=translation, rotation=rotation)
