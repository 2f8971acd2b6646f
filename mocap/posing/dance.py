"""A dance: postures of a pool, on the beats of a piece of music, by a skeleton's elastic joints."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from mocap.bodies.body import Body, find_body
from mocap.posing import mirror
from mocap.posing.arrive import arriving
from mocap.posing.beats import Beats
from mocap.posing.choreography import REST, Dance, Step, pulses, unrolled
from mocap.posing.elastic import Elastic, felt
from mocap.posing.postures import Pool, posed, turns_of
from mocap.posing.standing import stood
from mocap.posing.starting import kind_of
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion

SPRINGS = felt(2.2, 0.8)
"""Brisk, and hardly swinging over."""

FLIES = 0.02
"""Metres that a hop leaves the floor before it is a flight."""

HOP = 1.2
"""A hop is so many times as high as it needs to be."""


def danced(
    skeleton: Skeleton,
    pool: Pool,
    dance: Dance,
    music: Beats,
    fps: float = 24.0,
    springs: Elastic = SPRINGS,
    extent: float = 1.0,
    rest: NDArray | None = None,
    between: tuple[float, float] | None = None,
) -> SkeletonMotion:
    """The motion of a skeleton, upright and in metres, that dances as long as the music lasts, its feet on the floor.

    Its beats are those of the music, from the first; each posture is reached when its beat sounds.  What several steps
    of one beat do to a joint is added; a joint that a part's steps do not concern goes on.  From one leg to the other
    it hops.  `rest` (J, 4) is how joints stand at rest, `springs` are the elastic joints', and `extent` is how far all
    postures go.  `between` two moments, in seconds, only those frames are made: they are the same in all of it, but for
    what is smoothed at their ends.
    """
    if not 1 <= fps <= 1000:
        raise InputError(f"frames a second must be 1 to 1000, got {fps:g}: 24 is film")
    if not abs(extent) <= 10:
        raise InputError(f"the extent of a dance must be between -10 and 10, got {extent:g}: 1 is as its postures are")
    at_rest = posed(skeleton, np.zeros((1, len(skeleton), 3)), fps, rest).world()[0]
    body = find_body(skeleton, at_rest[..., 3])
    at = np.arange(max(int(np.ceil(music.seconds * fps - 1e-9)), 1)) / fps
    beats = _beats_until(at[-1], music)
    if between is not None:
        at = at[(at >= between[0] - 1e-9) & (at < between[1])]
        if not len(at):
            raise InputError(f"what is made of a dance must be some of its {music.seconds:g} s, got {between}")
    steps, layers = unrolled(dance, beats), []
    for own in (steps, pulses(dance, beats)):
        goals = _goals(skeleton, body, pool, own, at_rest, extent)
        concerned = np.array([joints_of(step.part, body) for step in own])
        layers.append(_layer(own, goals, concerned, music, at, springs))
    feet = () if kind_of(skeleton, rest) == "plant" else body.feet
    plain, whole = (
        _on_floor(posed(skeleton, turns, fps, rest), feet, at_rest[..., 3]) for turns in (layers[0], sum(layers))
    )
    when = music.at(np.unique([step.beat for step in steps]))
    roots = [joint for joint, parent in enumerate(skeleton.parents) if parent < 0]
    translation = whole.translation.copy()
    height = _hops(plain.translation[:, roots, 1], at, when)
    translation[:, roots, 1] += height
    translation[:, roots] = _flown(translation[:, roots], height, at)
    return replace(whole, translation=translation)


def _beats_until(end: float, music: Beats) -> float:
    """How many beats after the first a moment is: a move to one that is not seen need not begin."""
    inside = float(np.interp(end, music.times, np.arange(len(music.times))))
    return inside + max(end - music.times[-1], 0) * music.bpm / 60


def _hops(height: NDArray, at: NDArray, when: NDArray) -> NDArray:
    """By how much a figure (T, R) leaves the floor at moments (T,), for roots (T, R) that stand so high.

    Who changes from one leg to the other between two beats would sink to the floor half-way, with both legs lifted
    half.  A dancer hops: nowhere are roots lower than on both of the beats `when` (M,) around.
    """
    on_beats = np.array([np.interp(np.concatenate([at[:1], when, at[-1:]]), at, own) for own in height.T]).T
    after = np.searchsorted(when, at, side="right") + 1
    least = np.minimum(on_beats[after - 1], on_beats[after])
    return HOP * np.maximum(least - height, 0)


def _flown(places: NDArray, height: NDArray, at: NDArray) -> NDArray:
    """Roots (T, R, 3) that hop by `height` (T, R) at moments (T,) fly straight from take-off to landing.

    Half-way between two legs no foot stands: a root that followed the lower one would be thrown back, and come again.
    """
    flown = places.copy()
    for root in range(places.shape[1]):
        stands = height[:, root] <= FLIES
        for axis in (0, 2):
            flown[:, root, axis] = np.interp(at, at[stands], places[stands, root, axis])
    return flown


def _layer(
    steps: Sequence[Step], goals: NDArray, concerned: NDArray, music: Beats, at: NDArray, springs: Elastic
) -> NDArray:
    """How joints turn (T, J, 3) at moments (T,), for goals (M, J, 3) of steps that concern joints (M, J)."""
    beats = np.round([step.beat for step in steps], 6)
    when, hold = music.at(beats), music.at(beats + [step.hold for step in steps]) - music.at(beats)
    turns = np.zeros((len(at), *goals.shape[1:]))
    kinds = np.array([np.broadcast_to(part, goals.shape[1]) for part in vars(springs).values()])  # (3, J)
    alike = np.concatenate([kinds, concerned])
    for own in np.unique(alike, axis=1).T:  # joints that the same steps concern, and of like springs, move together
        joints, mine = np.flatnonzero((alike == own[:, None]).all(axis=0)), np.flatnonzero(own[3:])
        if not len(mine):
            continue
        together = [list(group) for _, group in groupby(mine, key=lambda step: beats[step])]
        summed = np.array([goals[group][:, joints].sum(axis=0) for group in together])
        held = np.array([hold[group].max() for group in together])
        turns[:, joints] = arriving(Elastic(*own[:3]), at, when[[group[0] for group in together]], summed, held)
    return turns


def joints_of(part: str, body: Body) -> NDArray:
    """Which joints (J,) a part has: "left arm" and the like, "arms", "legs", or "" for all."""
    if not part:
        return np.ones(len(body.label), bool)
    own = np.array([label == part or (part.endswith("s") and label.endswith(part[:-1])) for label in body.label])
    if not own.any():
        raise InputError(f"a part must be one of {', '.join(sorted(set(body.label)))}; this body has no {part!r}")
    return own


def _goals(
    skeleton: Skeleton, body: Body, pool: Pool, steps: Sequence[Step], at_rest: NDArray, extent: float
) -> NDArray:
    """The turns (M, J, 3) that each step asks for."""
    pairs = mirror.counterparts(skeleton, body)
    axis = mirror.across(at_rest[..., 3], pairs)
    known = {}
    for name in {step.posture for step in steps}:
        still = name == REST and REST not in pool.names()
        known[name] = np.zeros((len(skeleton), 3)) if still else turns_of(pool[name], skeleton)
    goals = np.array([extent * step.extent * known[step.posture] for step in steps])
    swapped = np.array([step.mirror for step in steps])
    goals[swapped] = mirror.mirrored(goals[swapped], pairs, axis, at_rest[..., :3])
    return goals


def _on_floor(motion: SkeletonMotion, feet: Sequence[int], places: NDArray) -> SkeletonMotion:
    """The motion so high that its feet, or without them what is lowest, are on the floor, and stay where they are."""
    low = places[list(feet) or slice(None), 1].min()
    translation = motion.translation.copy()
    roots = [joint for joint, parent in enumerate(motion.skeleton.parents) if parent < 0]
    translation[:, roots, 1] -= low
    return stood(replace(motion, translation=translation), feet, places - [0, low, 0])
