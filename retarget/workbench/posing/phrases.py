"""The dance at the posing desk: phrases one after the other, steps on their beats; each edit is a new dance."""

from dataclasses import replace
from typing import Annotated, Any

from msgspec import Meta

from capture.errors import InputError
from mocap.posing.choreography import Dance, Phrase, Step, checked
from retarget.workbench.fields import Name, Number
from retarget.workbench.figure import BEATS, Figure, check_posture
from retarget.workbench.posing.posed import Extent, figure_in, with_figure
from retarget.workbench.state import State

Beat = Annotated[float, Meta(ge=0, le=1000)]
Length = Annotated[float, Meta(ge=1, le=64)]
Times = Annotated[int, Meta(ge=1, le=64)]
GRAIN = 0.25  # of a beat: no step is nearer to the end of its phrase
MOST = 64  # phrases


def shown(figure: Figure) -> dict[str, Any]:
    """The dance as plain values."""
    phrases = [
        {
            **{name: getattr(phrase, name) for name in ("beats", "repeats", "mirror", "half", "pulse", "depth")},
            "steps": [
                {name: getattr(step, name) for name in ("beat", "posture", "extent", "part", "hold", "mirror")}
                for step in phrase.steps
            ],
        }
        for phrase in figure.dance.phrases
    ]
    return {"beats": figure.dance.beats, "phrases": phrases}


def put(state: State, posture: Name, beat: Beat, extent: Extent = 1.0, phrase: Number = 0) -> State:
    """Put a posture on a beat."""
    figure = figure_in(state)
    check_posture(figure, posture)
    return _stepped(state, phrase, [*_phrase(figure, phrase).steps, Step(beat, posture, extent)])


def move(
    state: State,
    step: Number,
    beat: Beat | None = None,
    extent: Extent | None = None,
    phrase: Number = 0,
    into: Number | None = None,
) -> State:
    """Move a step to another beat, or make it larger."""
    figure = figure_in(state)
    steps = _steps(figure, phrase, step)
    old = steps.pop(step)
    new = replace(old, extent=old.extent if extent is None else round(extent, 3))
    goal = phrase if into is None else into
    to = old.beat if beat is None else min(beat, _phrase(figure, goal).beats - GRAIN)
    new = replace(new, beat=max(to, 0.0))
    if goal == phrase:
        return _stepped(state, phrase, [*steps, new])
    phrases = _with_steps(figure, phrase, steps).phrases
    return _stepped(state, goal, [*phrases[goal].steps, new], Dance(phrases))


def drop(state: State, step: Number, phrase: Number = 0) -> State:
    """Take a step out."""
    steps = _steps(figure_in(state), phrase, step)
    del steps[step]
    return _stepped(state, phrase, steps)


def add_phrase(state: State) -> State:
    """Add a phrase."""
    return _of_phrases(state, (*figure_in(state).dance.phrases, Phrase((), BEATS)))


def copy_phrase(state: State, phrase: Number) -> State:
    """Copy a phrase."""
    figure = figure_in(state)
    one, phrases = _phrase(figure, phrase), figure.dance.phrases
    return _of_phrases(state, (*phrases[: phrase + 1], one, *phrases[phrase + 1 :]))


def drop_phrase(state: State, phrase: Number) -> State:
    """Take a phrase out."""
    figure = figure_in(state)
    _phrase(figure, phrase)
    left = tuple(one for n, one in enumerate(figure.dance.phrases) if n != phrase)
    return _of_phrases(state, left or (Phrase((), BEATS),))


def set_phrase(
    state: State,
    phrase: Number,
    beats: Length | None = None,
    repeats: Times | None = None,
    mirror: bool | None = None,
    half: bool | None = None,
) -> State:
    """Change a phrase."""
    figure = figure_in(state)
    one = _phrase(figure, phrase)
    told = {"beats": beats, "repeats": repeats, "mirror": mirror, "half": half}
    new = replace(one, **{name: value for name, value in told.items() if value is not None})
    late = [step for step in new.steps if step.beat >= new.beats]
    if late:
        raise InputError(
            f"a phrase must reach beyond its steps, {late[0].posture!r} is on beat {late[0].beat + 1:g} of "
            f"{new.beats:g}: take it out first"
        )
    phrases = tuple(new if n == phrase else old for n, old in enumerate(figure.dance.phrases))
    return _of_phrases(state, phrases)


def invent(state: State, seed: Number = 0) -> State:
    """Make a dance up."""
    from mocap.posing.invent import invented

    figure = figure_in(state)
    made = invented(figure.pool, figure.skeleton, 32, seed, figure.rest)
    phrases: list[Phrase] = []
    for phrase in made.phrases:  # what comes twice in a row is danced twice
        if phrases and replace(phrases[-1], repeats=1) == phrase:
            phrases[-1] = replace(phrases[-1], repeats=phrases[-1].repeats + 1)
        else:
            phrases.append(phrase)
    return with_figure(state, replace(figure, dance=Dance(tuple(phrases))))


ACTIONS = (put, move, drop, add_phrase, copy_phrase, drop_phrase, set_phrase, invent)


def _phrase(figure: Figure, number: int) -> Phrase:
    phrases = figure.dance.phrases
    if number >= len(phrases):
        raise InputError(f"the dance has {len(phrases)} phrases, counted from 0; there is no phrase {number}")
    return phrases[number]


def _steps(figure: Figure, phrase: int, step: int) -> list[Step]:
    """The steps of a phrase, among which there is the one meant."""
    steps = list(_phrase(figure, phrase).steps)
    if step >= len(steps):
        raise InputError(f"the phrase has {len(steps)} steps, counted from 0; there is no step {step}")
    return steps


def _with_steps(figure: Figure, phrase: int, steps: list[Step]) -> Dance:
    ordered = tuple(sorted(steps, key=lambda step: (step.beat, step.posture)))
    phrases = list(figure.dance.phrases)
    phrases[phrase] = replace(_phrase(figure, phrase), steps=ordered)
    return Dance(tuple(phrases))


def _stepped(state: State, phrase: int, steps: list[Step], dance: Dance | None = None) -> State:
    figure = figure_in(state)
    figure = figure if dance is None else replace(figure, dance=dance)
    return _of_phrases(state, _with_steps(figure, phrase, steps).phrases)


def _of_phrases(state: State, phrases: tuple[Phrase, ...]) -> State:
    if len(phrases) > MOST:
        raise InputError(f"a dance must have {MOST} phrases at most here: take one out, or let one come several times")
    dance = Dance(phrases)
    if any(phrase.steps for phrase in phrases):
        checked(dance)
    return with_figure(state, replace(figure_in(state), dance=dance))
