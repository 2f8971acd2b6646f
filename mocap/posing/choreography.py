"""`*.dance.toml`: which posture comes on which beat.

    [[phrases]]                      # one after the other; after the last the first again, while the music lasts
    beats = 8                        # how long the phrase is
    repeats = 2                      # how often it is danced in all
    mirror = true                    # every second time with left and right swapped
    half = false                     # twice as slowly: its beats are every second beat of the music
    pulse = "crouch"                 # a posture besides, between beats alone, so that the dancer comes up on each
    depth = 0.3                      # its extent

    [[phrases.steps]]
    beat = 0                         # of the phrase, from 0; 1.5 is half-way between the second and the third
    posture = "arms up"              # the pool's name for it, or "rest"
    extent = 1.0                     # 0 is rest, 1 the posture, 2 twice as far
    part = "left arm"                # this much of the body alone; all of it without
    hold = 0.5                       # beats that it is kept, before the move to the next may begin
    mirror = false                   # with left and right swapped

All but a step's beat and posture can be left out.
"""

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from capture.errors import InputError
from capture.files import written_beside
from capture.records import read_record

REST = "rest"

MOST = 10_000
"""Steps of a dance, and beats of a phrase, at most: more is a slip, and would take for ever."""


@dataclass(frozen=True)
class Step:
    """One posture on one beat."""

    beat: float
    posture: str
    extent: float = 1.0
    part: str = ""
    hold: float = 0.0
    mirror: bool = False


@dataclass(frozen=True)
class Phrase:
    """Steps that belong together, and come again together."""

    steps: tuple[Step, ...] = ()
    beats: float = 8.0
    repeats: int = 1
    mirror: bool = False
    half: bool = False
    pulse: str = ""
    depth: float = 0.3


@dataclass(frozen=True)
class Dance:
    """Phrases one after the other."""

    phrases: tuple[Phrase, ...]

    @property
    def beats(self) -> float:
        """How many beats it takes."""
        return sum(phrase.beats * phrase.repeats * (2 if phrase.half else 1) for phrase in self.phrases)


def unrolled(dance: Dance, beats: float | None = None) -> tuple[Step, ...]:
    """The steps of a dance in the order of their beats, counted from its beginning.

    It lasts so many beats: cut where it is longer, danced again from its beginning where it is shorter; once without.
    """
    return _repeated(dance, beats, _steps)


def pulses(dance: Dance, beats: float | None = None) -> tuple[Step, ...]:
    """The steps of what a dancer does besides: its pulse half-way to every beat, and rest on it.

    Where a step lies half-way there is none, so that on its beat every posture is what it is.
    """
    return _repeated(dance, beats, _pulse)


def read_dance(path: str | Path) -> Dance:
    """Read a `*.dance.toml`; a misspelt, missing or impossible field is refused by its name."""

    def known(dance: Dance, stored: Any) -> Dance:
        _refuse_unknown(stored)
        return checked(dance)

    return read_record(path, Dance, known, "a choreography", "a *.dance.toml of phrases and steps")


def write_dance(dance: Dance, path: str | Path) -> None:
    """Write a `*.dance.toml`: what `read_dance` reads of it is equal."""
    lines = []
    for phrase in checked(dance).phrases:
        lines += ["[[phrases]]", *_table(phrase), ""]
        for step in phrase.steps:
            lines += ["[[phrases.steps]]", *_table(step), ""]
    with written_beside(path) as beside:
        beside.write_text("\n".join(lines), encoding="utf-8")


def checked(dance: Dance) -> Dance:
    """The dance, if it can be danced."""
    if not any(phrase.steps for phrase in dance.phrases):
        raise InputError("a dance must have steps, this one has none: add phrases with steps")
    for number, phrase in enumerate(dance.phrases, 1):
        if not 0 < phrase.beats <= MOST or not 1 <= phrase.repeats <= MOST:
            raise InputError(
                f"a phrase must last some beats and be danced once or more, phrase {number} lasts {phrase.beats:g} and "
                f"is danced {phrase.repeats} times: give a whole number from 1 to {MOST}"
            )
        if not abs(phrase.depth) <= 10:
            raise InputError(f"a depth must be between -10 and 10, that of phrase {number} is {phrase.depth:g}")
        for step in phrase.steps:
            _check(step, phrase, number)
    return dance


def _check(step: Step, phrase: Phrase, number: int) -> None:
    if not 0 <= step.beat < phrase.beats:
        raise InputError(
            f"a step must be on a beat of its phrase, from 0 to before {phrase.beats:g}, phrase {number} has "
            f"{step.posture!r} on beat {step.beat:g}: the first beat is 0"
        )
    if not abs(step.extent) <= 10:
        raise InputError(
            f"an extent must be between -10 and 10, that of {step.posture!r} in phrase {number} is {step.extent:g}: "
            "1 is the posture itself"
        )
    if not 0 <= step.hold <= MOST:
        raise InputError(f"a posture must be held 0 beats or more, {step.posture!r} in phrase {number}: {step.hold:g}")
    if not step.posture:
        raise InputError(f"a step must name its posture, the one on beat {step.beat:g} of phrase {number} does not")


def _repeated(dance: Dance, beats: float | None, of: Callable[[Phrase], list[Step]]) -> tuple[Step, ...]:
    """What `of` makes of each phrase, for as long as the dance lasts."""
    checked(dance)
    steps, start = [], 0.0
    while start == 0 or (beats is not None and start <= beats):
        for phrase, swapped in _turns(dance):
            slow = 2 if phrase.half else 1
            for step in of(phrase):
                beat, hold = start + slow * step.beat, slow * step.hold
                steps.append(replace(step, beat=beat, hold=hold, mirror=step.mirror != swapped))
            start += slow * phrase.beats
            if len(steps) > MOST or start > MOST:
                raise InputError(
                    f"a dance must have at most {MOST} beats and steps, this one has more: let it end earlier"
                )
    steps = [step for step in steps if beats is None or step.beat <= beats]
    return tuple(sorted(steps, key=lambda step: step.beat))


def _turns(dance: Dance) -> Iterator[tuple[Phrase, bool]]:
    """The phrases as often as they are danced, and whether mirrored."""
    for phrase in dance.phrases:
        for turn in range(phrase.repeats):
            yield phrase, phrase.mirror and turn % 2 == 1


def _steps(phrase: Phrase) -> list[Step]:
    return list(phrase.steps)


def _pulse(phrase: Phrase) -> list[Step]:
    if not phrase.pulse:
        return [Step(0.0, REST)]  # what was before it ends
    taken = {step.beat for step in phrase.steps}
    halves = [beat + 0.5 for beat in range(int(phrase.beats)) if beat + 0.5 not in taken]
    down = [Step(beat, phrase.pulse, phrase.depth) for beat in halves if beat < phrase.beats]
    return [Step(float(beat), REST) for beat in range(int(np.ceil(phrase.beats)))] + down


def _table(record: Phrase | Step) -> list[str]:
    """The fields that are not what they are without saying."""
    lines = []
    for one in fields(record):
        value = getattr(record, one.name)
        if one.name != "steps" and value != one.default:
            lines.append(f"{one.name} = {json.dumps(value, ensure_ascii=False)}".replace("\x7f", "\\u007f"))
    return lines


def _refuse_unknown(stored: dict) -> None:
    """Fields that are none are typing slips and would be passed over silently."""
    phrases = stored.get("phrases", [])
    levels = [(Dance, stored), *((Phrase, phrase) for phrase in phrases)]
    levels += [(Step, step) for phrase in phrases for step in phrase.get("steps", [])]
    for kind, table in levels:
        known = [one.name for one in fields(kind)]
        unknown = [name for name in table if name not in known]
        if unknown:
            raise InputError(
                f"{unknown[0]!r} is no field of a dance here, there are {', '.join(known)}: correct its name"
            )
