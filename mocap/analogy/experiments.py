"""The paper's four experiments (Wu et al. 2008, section 4), each with a report card: style, content, rhythm, and all.

They are one analogy with its knobs; what differs is what A and A' are, and what to look for.
"""

from dataclasses import dataclass

import numpy as np

from mocap import report
from mocap.analogy import curves as curving
from mocap.analogy.analogy import Knobs, analogy
from mocap.bodies.body import find_body
from mocap.bodies.contacts import find_contacts
from mocap.skeletons.skeleton import SkeletonMotion


@dataclass(frozen=True)
class Card:
    """How clean a motion is."""

    seconds: float
    skate: float  # cm/s along the floor while in contact
    jerk: float  # m/s^3, root mean square over joints
    beyond: float  # degrees that its joints turn beyond what they do in A, A' and B; 1 in 100 goes farther

    def __str__(self) -> str:
        return (
            f"{self.seconds:5.2f} s, feet skate {self.skate:4.1f} cm/s, jerk {self.jerk:6.0f} m/s3, "
            f"joints {self.beyond:4.1f} deg beyond"
        )


@dataclass(frozen=True, eq=False)
class Experiment:
    """A quadruple: A is to A' as B is to B'."""

    one: SkeletonMotion
    two: SkeletonMotion
    three: SkeletonMotion
    loose: SkeletonMotion  # B' before its feet were made to stand
    made: SkeletonMotion  # B'

    def cards(self) -> dict[str, Card]:
        """What there was, what was made, and what that was before the feet stood."""
        told = {"A": self.one, "A'": self.two, "B": self.three, "B' before feet": self.loose, "B'": self.made}
        widest = [_turns(motion, self.three) for motion in (self.one, self.two, self.three)]
        low = np.min([turns.min(axis=0) for turns in widest], axis=0)
        high = np.max([turns.max(axis=0) for turns in widest], axis=0)
        return {name: _card(motion, _turns(motion, self.three), low, high) for name, motion in told.items()}


def style(one: SkeletonMotion, two: SkeletonMotion, three: SkeletonMotion) -> Experiment:
    """How one moves (4.1): walking is to running as walking tired is to running tired."""
    return _experiment(one, two, three, Knobs())


def content(one: SkeletonMotion, two: SkeletonMotion, three: SkeletonMotion) -> Experiment:
    """What one does (4.2): crouching ahead is to crouching aside as walking is to walking aside, and upright."""
    return _experiment(one, two, three, Knobs(time=False))


def rhythm(one: SkeletonMotion, two: SkeletonMotion, three: SkeletonMotion) -> Experiment:
    """When one does it (4.3): a slow walk is to a fast one as something else is to the same, faster."""
    return _experiment(one, two, three, Knobs(space=False))


def features(one: SkeletonMotion, two: SkeletonMotion, three: SkeletonMotion) -> Experiment:
    """All of it (4.4): style, speed and path of somebody drunk, for somebody who does something else."""
    return _experiment(one, two, three, Knobs())


def apart(one: SkeletonMotion, other: SkeletonMotion) -> float:
    """How far the joints of two motions of one skeleton are turned apart: degrees, root mean square, hips left out."""
    from scipy.spatial.transform import Rotation

    count = min(len(one), len(other))
    joints = curving.jointed(one.skeleton, curving.hips(one))
    turns = [Rotation.from_quat(motion.rotation[:count, joints].reshape(-1, 4)) for motion in (one, other)]
    return float(np.degrees(np.sqrt(np.mean((turns[0].inv() * turns[1]).magnitude() ** 2))))


def _experiment(one: SkeletonMotion, two: SkeletonMotion, three: SkeletonMotion, knobs: Knobs) -> Experiment:
    from dataclasses import replace

    loose = analogy(one, two, three, replace(knobs, feet=False))
    return Experiment(one, two, three, loose, analogy(one, two, three, knobs))


def _turns(motion: SkeletonMotion, goal: SkeletonMotion) -> np.ndarray:
    """Rotation vectors of the joints that `goal` has (T, 3 C), on its skeleton."""
    from mocap.analogy.lend import lent

    own = motion if motion.skeleton.names == goal.skeleton.names else lent(motion, goal)[0]
    neutral = curving.neutral(goal)
    curves, _ = curving.of_skeleton(own, neutral, curving.first_turns(goal, neutral))
    return curves.values[:, len(curving.ROOT) :]


def _card(motion: SkeletonMotion, turns: np.ndarray, low: np.ndarray, high: np.ndarray) -> Card:
    places = motion.positions()
    feet = list(find_body(motion.skeleton, places).feet)
    beyond = np.maximum(np.maximum(low - turns, turns - high), 0)
    return Card(
        seconds=len(motion) / motion.fps,
        skate=report.skate(places[:, feet], find_contacts(motion, feet), motion.fps),
        jerk=report.jerk(places, motion.fps),
        beyond=float(np.degrees(np.percentile(beyond, 99))),
    )
