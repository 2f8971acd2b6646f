"""A dance made up from a pool: phrases of eight beats, the second half in the mirror of the first, that come again.

Nothing is drawn from data: it is a beginning that somebody can edit, as a `*.dance.toml`.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from mocap.body import find_body
from mocap.posing.choreography import Dance, Phrase, Step
from mocap.posing.postures import Pool, Posture, posed, turns_of
from mocap.posing.starting import kind_of
from mocap.skeleton import Skeleton

RHYTHMS = (*((0, 1, 2, 3),) * 4, (0, 1, 2), (0, 2, 3), (0, 1.5, 3), (0, 2))
"""On which of four beats there is a posture."""

FORM = "AABA"
PULSES = ("crouch", "head down", "bow")
"""What a dancer does a little of between beats, so that it comes up on them: the first that the pool has."""

DEPTH = 0.45


def invented(pool: Pool, skeleton: Skeleton, beats: float, seed: int = 0, rest: NDArray | None = None) -> Dance:
    """A dance for so many beats; the same for the same seed.  `rest` (J, 4) is how joints stand at rest.

    Large postures are danced more often than small ones, and with others that move other joints; one foot at least
    stands.  A posture is followed by its mirror image or by another.  Between beats the knees dip.
    """
    if seed < 0:
        raise InputError(f"a seed must be 0 or more, got {seed}: each number makes another dance")
    rng = np.random.default_rng(seed)
    sizes, legs = _sizes(pool, skeleton, rest), _legs(skeleton, rest)
    phrases: list[Phrase] = []
    theme = _phrase(pool, sizes, legs, rng)
    while sum(phrase.beats * phrase.repeats for phrase in phrases) < beats:
        part = FORM[len(phrases) % len(FORM)]
        phrases.append(theme if part == "A" else _phrase(pool, sizes, legs, rng))
    return Dance(tuple(phrases or [theme]))


def _phrase(pool: Pool, sizes: NDArray, legs: list[set[str]], rng: np.random.Generator) -> Phrase:
    """Four beats, and the same four mirrored."""
    steps: list[Step] = []
    main = -1
    for beat in RHYTHMS[rng.integers(len(RHYTHMS))]:
        last = [step for step in steps if step.beat == steps[-1].beat]
        if last and not last[0].mirror and rng.random() < 0.4:
            steps += [replace(step, beat=beat, mirror=True) for step in last]
            continue
        large = np.where((sizes > 0.5 * sizes.max()) & (np.arange(len(sizes)) != main), sizes, 0.0)
        main = int(rng.choice(len(sizes), p=large / large.sum())) if large.any() else 0
        steps.append(Step(beat, pool.postures[main].name, 1.0 if beat == 0 else _round(rng.uniform(0.75, 1.0))))
        taken = [main]
        for likely in (0.9, 0.5):
            beside = np.where(_beside(pool, taken, legs), sizes, 0.0)
            if beside.any() and rng.random() < likely:
                taken.append(int(rng.choice(len(sizes), p=beside / beside.sum())))
                steps.append(Step(beat, pool.postures[taken[-1]].name, _round(rng.uniform(0.5, 0.9))))
    pulse = next((name for name in PULSES if name in pool.names()), "")
    return Phrase(tuple(steps), 4, 2, mirror=True, pulse=pulse, depth=DEPTH if pulse else Phrase.depth)


def _beside(pool: Pool, taken: list[int], legs: list[set[str]]) -> NDArray:
    """Which postures (K,) go along with others: those that turn other joints, and lift no second leg."""
    turned = set().union(*(pool.postures[one].turns for one in taken))
    stands = not any(turned & leg for leg in legs)
    return np.array(
        [
            not turned & set(posture.turns)
            and (not _lifts(posture, legs) if stands else not any(set(posture.turns) & leg for leg in legs))
            for posture in pool.postures
        ]
    )


def _lifts(posture: Posture, legs: list[set[str]]) -> bool:
    """Whether some legs are turned and some are not."""
    moved = [bool(set(posture.turns) & leg) for leg in legs]
    return any(moved) and not all(moved)


def _sizes(pool: Pool, skeleton: Skeleton, rest: NDArray | None) -> NDArray:
    """How large each posture (K,) is: the more joints it turns and the farther all are moved, the larger."""
    turns = np.array([turns_of(posture, skeleton) for posture in pool.postures])
    places = posed(skeleton, np.concatenate([np.zeros_like(turns[:1]), turns]), 1.0, rest).positions()
    far = np.linalg.norm(places[1:] - places[0], axis=-1).mean(axis=-1)
    return np.sqrt(far * turns.any(axis=-1).sum(axis=-1))


def _legs(skeleton: Skeleton, rest: NDArray | None) -> list[set[str]]:
    """What the joints of each leg are called; what grows in one place has none."""
    if kind_of(skeleton, rest) == "plant":
        return []
    body = find_body(skeleton, posed(skeleton, np.zeros((1, len(skeleton), 3)), 1.0, rest).positions())
    kinds = sorted({label for label in body.label if label.endswith("leg")})
    return [{name for name, label in zip(skeleton.names, body.label) if label == kind} for kind in kinds]


def _round(value: float) -> float:
    return round(float(value), 2)
