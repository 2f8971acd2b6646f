"""Hits: frames in which a hand or a foot, thrown out fast, is where something is to be hit, and has to be still.

An arm is stretched out by a blow and comes back at once; a kick takes a foot as suddenly away from below its hip.
Hands and feet that walk or run do not go so far so fast, and those that reach do not come back so soon.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from mocap.bodies.body import Body
from mocap.rubber.constrain import Goal, constrained, easing
from mocap.rubber.subjoints import SubJoints

OUT = {"arm": 0.25, "leg": 0.55}
"""A blow takes a limb's tip away by so much of the limb's length, and lets as much of it go again."""

FAST = 1.5
"""Metres a second, for a person of usual height, at which it goes away."""

SOON = 0.3
"""Seconds within which a limb is thrown out, and within which it is drawn back."""

BLEND = 0.2
"""Seconds before a hit in which a limb nears its captured way, and after it in which it leaves it."""


def find_hits(places: NDArray, body: Body, fps: float, scale: float = 1.0) -> tuple[tuple[int, int], ...]:
    """The joint and the frame of each hit, in order of time, by arms and legs of captured joints (T, J, 3), metres.

    `scale` is how many times as tall as a usual person the body is.
    """
    from scipy.signal import find_peaks

    found = []
    near = max(round(SOON * fps), 1)
    for name, joints in body.parts.items():
        limb = name[-3:]
        if limb not in OUT or len(joints) < 3:
            continue
        joint = tip(name, body)
        way = places[:, joint] - places[:, _base(joints, places)]
        long = np.linalg.norm(way, axis=1).max()
        away = np.linalg.norm(way + ([0, long, 0] if limb == "leg" else 0), axis=1)
        speed = np.gradient(away, 1 / fps) if len(away) > 1 else np.zeros(len(away))
        for peak in find_peaks(away, distance=near)[0].tolist():
            before, after = slice(max(peak - near, 0), peak + 1), slice(peak, peak + near + 1)
            out = away[peak] - max(away[before].min(), away[after].min())
            if out > OUT[limb] * long and speed[before].max() > FAST * scale:
                found.append((joint, peak))
    return tuple(sorted(found, key=lambda hit: hit[1]))


def met(
    positions: NDArray, subjoints: SubJoints, captured: NDArray, hits: Sequence[tuple[int, int]], fps: float
) -> NDArray:
    """Sub-joints (T, S, 3) with each joint of `hits` where it was captured (T, J, 3) in its frame.

    Nearing the hit the limb goes over to its captured way, so that it hits from where it did.
    """
    goals = []
    for joint in dict.fromkeys(joint for joint, _ in hits):
        frames = np.zeros(len(positions), bool)
        frames[[frame for other, frame in hits if other == joint]] = True
        goals.append(Goal(joint, captured[:, joint], easing(frames, fps, BLEND)))
    return constrained(positions, subjoints, goals)


def tip(name: str, body: Body) -> int:
    """The joint that an arm or a leg hits with: its wrist; of a leg the ankle, for a toe is pointed at will."""
    joints = body.parts[name]
    toe = name.endswith("leg") and len(joints) > 3 and joints[-1] in body.feet
    return joints[-2] if toe else joints[-1]


def _base(joints: Sequence[int], places: NDArray) -> int:
    """Where a limb is swung from: the near end of its longest link but the last, a shoulder and not a collarbone."""
    links = [np.linalg.norm(places[0, a] - places[0, b]) for a, b in pairwise(joints)]
    return next(joint for joint, link in zip(joints, links) if link > 0.6 * max(links))
