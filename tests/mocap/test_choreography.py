"""Dances as files, and as steps one after the other."""

from dataclasses import fields, replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from capture.errors import InputError
from mocap.posing.choreography import Dance, Phrase, Step, pulses, read_dance, unrolled, write_dance

WAVE = Phrase((Step(0, "arms up"), Step(2.5, "bow", 0.5, "spine", 0.25)), 4, 3, mirror=True)
CLOSE = Phrase((Step(1, "arms out"),), 2, half=True)


def test_phrases_come_one_after_the_other_mirrored_every_second_time():
    steps = unrolled(Dance((WAVE, CLOSE)))
    assert [(s.beat, s.posture, s.mirror) for s in steps] == [
        *[(0, "arms up", False), (2.5, "bow", False), (4, "arms up", True), (6.5, "bow", True)],
        *[(8, "arms up", False), (10.5, "bow", False), (14, "arms out", False)],
    ]
    assert Dance((WAVE, CLOSE)).beats == 16


def test_half_time_takes_two_beats_for_each_and_holds_twice_as_long():
    slow = Dance((Phrase(WAVE.steps, 4, half=True),))
    assert [(s.beat, s.hold) for s in unrolled(slow)] == [(0, 0), (5, 0.5)]


def test_a_mirrored_step_in_a_mirrored_phrase_is_as_it_was():
    steps = unrolled(Dance((Phrase((Step(0, "a", mirror=True),), 1, 2, mirror=True),)))
    assert [step.mirror for step in steps] == [True, False]


def test_a_dance_goes_on_while_the_music_lasts_and_ends_with_it():
    beats = [step.beat for step in unrolled(Dance((WAVE,)), 30)]
    assert beats[:3] == [0, 2.5, 4] and beats[-1] == 28 and len(beats) == 15
    assert [step.beat for step in unrolled(Dance((WAVE,)), 3)] == [0, 2.5]


def test_the_pulse_is_half_way_to_every_beat_but_where_a_step_is():
    beats = pulses(Dance((replace(WAVE, pulse="nod", depth=0.2, repeats=1), CLOSE)))
    assert [(s.beat, s.posture) for s in beats] == [
        *[(0, "rest"), (0.5, "nod"), (1, "rest"), (1.5, "nod"), (2, "rest"), (3, "rest"), (3.5, "nod")],
        (4, "rest"),
    ]
    assert {s.extent for s in beats if s.posture == "nod"} == {0.2}


texts = st.text(min_size=1, max_size=8)
numbers = st.floats(0, 7.9, allow_subnormal=False)
dances = st.lists(
    st.builds(
        Phrase,
        st.lists(st.builds(Step, numbers, texts, st.floats(-3, 3), texts, numbers, st.booleans()), min_size=1).map(
            tuple
        ),
        st.floats(8, 64),
        st.integers(1, 9),
        st.booleans(),
        st.booleans(),
        st.text(max_size=4),
        st.floats(-2, 2),
    ),
    min_size=1,
    max_size=4,
).map(lambda phrases: Dance(tuple(phrases)))


@settings(max_examples=60, deadline=None)
@given(dances)
def test_what_is_written_is_read(tmp_path_factory, dance):
    path = tmp_path_factory.mktemp("dances") / "a.dance.toml"
    write_dance(dance, path)
    assert read_dance(path) == dance


def test_every_field_comes_through_the_file():
    """The dances above are random; here no field has the value it has without saying."""
    step = Step(1.5, "bow", 0.5, "spine", 0.25, True)
    phrase = Phrase((step,), 4.0, 3, True, True, "nod", 0.5)
    for record in (step, phrase):
        assert all(getattr(record, one.name) != one.default for one in fields(record))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "phrases"),
        ("[[phrases]]\nbeats = 8\n", "Step|steps"),
        ("[[phrases]]\nsteps = []\n", "has none"),
        ("[[phrases]]\n[[phrases.steps]]\nbeat = 0\npostur = 'a'\n", "posture"),
        ("[[phrases]]\n[[phrases.steps]]\nbeat = 0\nposture = 'a'\nextend = 1\n", "'extend' is no field"),
        ("[[phrases]]\nbpm = 3\n[[phrases.steps]]\nbeat = 0\nposture = 'a'\n", "'bpm' is no field"),
        ("[[phrases]]\n[[phrases.steps]]\nbeat = 8\nposture = 'a'\n", "from 0 to before 8"),
        ("[[phrases]]\n[[phrases.steps]]\nbeat = nan\nposture = 'a'\n", "from 0 to before 8"),
        ("[[phrases]]\nbeats = 0\n[[phrases.steps]]\nbeat = 0\nposture = 'a'\n", "last some beats"),
        ("[[phrases]]\nrepeats = 0\n[[phrases.steps]]\nbeat = 0\nposture = 'a'\n", "danced once or more"),
        ("[[phrases]]\n[[phrases.steps]]\nbeat = 0\nposture = 'a'\nextent = inf\n", "extent"),
        ("[[phrases]]\n[[phrases.steps]]\nbeat = 0\nposture = 'a'\nhold = -1\n", "held"),
        ("[[phrases]]\n[[phrases.steps]]\nbeat = 0\nposture = ''\n", "name its posture"),
        ("phrases = 3", "must be a"),
        ("not toml", "must be a"),
    ],
)
def test_what_is_no_dance_is_refused_in_one_sentence(tmp_path, text, said):
    path = tmp_path / "a.dance.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=said) as refused:
        read_dance(path)
    assert str(path) in str(refused.value)


def test_a_dance_without_end_and_a_file_that_is_not_there_are_refused(tmp_path):
    with pytest.raises(InputError, match="at most"):
        unrolled(Dance((Phrase((Step(0, "a"),), 0.001),)), 100)
    with pytest.raises(InputError, match="there is no"):
        read_dance(tmp_path / "none.dance.toml")
