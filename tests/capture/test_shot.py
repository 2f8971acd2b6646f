"""A shot survives its file, may be written by hand in a line, and says in a sentence what is wrong with it."""

import os
import string
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from capture.errors import InputError
from capture.pictures.shot import KeyDrawing, Part, Shot, check, read_shot, write_shot

relaxed = settings(deadline=None, max_examples=30, derandomize=True)
number = st.floats(allow_nan=False, allow_infinity=False)
point = st.tuples(number, number)
strokes = st.lists(st.lists(point, min_size=1, max_size=3).map(tuple), max_size=2).map(tuple)
LOOP = ((10.0, 10.0), (20.0, 10.0), (20.0, 25.5))


@st.composite
def parts(draw, name):
    count, corners = draw(st.integers(1, 3)), draw(st.integers(3, 5))
    names = draw(st.lists(st.text(), min_size=count, max_size=count, unique=True))
    outline = st.lists(point, min_size=corners, max_size=corners).map(tuple)
    keys = tuple(KeyDrawing(n, draw(st.integers(0, 99)), draw(outline)) for n in names)
    return Part(
        name,
        keys,
        pivot=draw(st.none() | point),
        box=draw(st.none() | st.tuples(number, number, number, number)),
        color=draw(st.none() | st.tuples(*[st.integers(0, 255)] * 3)),
        inside=draw(strokes),
        outside=draw(strokes),
        order=draw(st.integers(-3, 3)),
    )


@st.composite
def shots(draw):
    names = draw(st.lists(st.text(min_size=1), min_size=1, max_size=3, unique=True))
    made = [draw(parts(name)) for name in names]
    hung = [replace(part, parent=draw(st.sampled_from(["", *names[:n]]))) for n, part in enumerate(made)]
    return Shot(
        draw(st.text(string.ascii_letters + " é\"'#", min_size=1)),
        tuple(hung),
        start=draw(st.integers(0, 9)),
        stop=draw(st.none() | st.integers(10, 99)),
        fps=draw(st.none() | st.floats(1, 120)),
        tile=draw(st.none() | st.tuples(st.integers(1, 99), st.integers(1, 99))),
    )


@given(shots())
@relaxed
def test_a_shot_that_went_through_its_file_is_the_same_shot(tmp_path_factory, shot):
    folder = tmp_path_factory.mktemp("shot")
    shot = replace(shot, clip=str(folder / shot.clip))
    write_shot(shot, folder / "a.shot.toml")
    assert read_shot(folder / "a.shot.toml") == shot


@pytest.mark.parametrize("name", ["two\nlines", "tab\t", 'quote " and \\ slash', "\x7f\x00", "зонт 🎩", "#[x]="])
def test_names_may_hold_any_sign(tmp_path, name):
    shot = Shot(str(tmp_path / "a.mp4"), (Part(name, (KeyDrawing(name),)),))
    write_shot(shot, tmp_path / "a.shot.toml")
    assert read_shot(tmp_path / "a.shot.toml") == shot


def test_a_rate_is_kept_exactly(tmp_path):
    write_shot(Shot(str(tmp_path / "a.mp4"), fps=24000 / 1001), tmp_path / "a.shot.toml")
    assert read_shot(tmp_path / "a.shot.toml").fps == 24000 / 1001


def test_numbers_out_of_arrays_are_written_as_numbers(tmp_path):
    outline = tuple((x, y) for x, y in np.array(LOOP))
    shot = Shot(
        str(tmp_path / "a.mp4"),
        (Part(keys=(KeyDrawing("a", np.int64(3), outline),), color=tuple(np.uint8([1, 2, 3]))),),
    )
    write_shot(shot, tmp_path / "a.shot.toml")
    part = read_shot(tmp_path / "a.shot.toml").parts[0]
    assert part.keys[0] == KeyDrawing("a", 3, LOOP) and part.color == (1, 2, 3)


def read(tmp_path, text):
    (tmp_path / "a.shot.toml").write_text(text, encoding="utf-8")
    return read_shot(tmp_path / "a.shot.toml")


def test_one_line_is_a_whole_shot(tmp_path):
    assert read(tmp_path, 'clip = "walk.mp4"') == Shot(str(tmp_path / "walk.mp4"))


def test_a_clip_is_found_beside_the_file_that_names_it(tmp_path):
    (tmp_path / "shots").mkdir()
    write_shot(Shot(str(tmp_path / "clips" / "a.mp4")), tmp_path / "shots" / "a.shot.toml")
    assert "../clips/a.mp4" in (tmp_path / "shots" / "a.shot.toml").read_text()
    found = read_shot(tmp_path / "shots" / "a.shot.toml").clip
    assert os.path.normpath(found) == str(tmp_path / "clips" / "a.mp4")
    assert read(tmp_path, 'clip = "/elsewhere/a.mp4"').clip == os.path.join(os.sep, "elsewhere", "a.mp4")


def test_outlines_of_all_keys_come_as_one_array():
    part = Part(keys=(KeyDrawing("a", 0, LOOP), KeyDrawing("b", 5, LOOP[::-1])))
    assert np.array_equal(part.outlines(), [LOOP, LOOP[::-1]])


PARTS = 'clip = "a.mp4"\n[[parts]]\nname = "body"\n'
KEYS = PARTS + '[[parts.keys]]\nname = "a"\noutline = [[0, 0], [9, 0], [9, 9]]\n'


@pytest.mark.parametrize(
    "text, words",
    [
        ("", "`clip`"),
        ("clip = ", "TOML"),
        ("clip = " + "[" * 5000 + "]" * 5000, "TOML"),
        ('clip = "a.mp4"\nstrat = 3', "'strat' is no field here.*start"),
        (PARTS + "boxx = [1, 2, 3, 4]", "'boxx' is no field here.*box"),
        (KEYS + "farme = 3", "'farme' is no field here.*frame"),
        (PARTS + "box = [1, 2, 3]", "length 4"),
        (PARTS + "box = [1, 2, 3, nan]", "'body'.*finite"),
        (KEYS.replace("[9, 0]", "[inf, 0]"), "'body'.*finite"),
        (PARTS + 'color = "red"', "color"),
        (KEYS + "frame = 2.5", "frame"),
        (PARTS.replace("[[parts]]", "[parts]"), "parts"),
        ('clip = "a.mp4"\nparts = []', "at least one part"),
        ('clip = "a.mp4"\nparts = [3]', "parts"),
        (PARTS + "keys = []", "at least one key"),
        (PARTS + '[[parts]]\nname = "body"', "must differ.*body, body"),
        (PARTS + 'parent = "tail"', "'tail', which is none of body"),
        (PARTS + 'parent = "body"', "must not hang on itself"),
        (PARTS + 'parent = "arm"\n[[parts]]\nname = "arm"\nparent = "body"', "must not hang on itself"),
        (KEYS + '[[parts.keys]]\nname = "b"\noutline = [[0, 0], [9, 0]]', "same number of points, got a 3, b 2"),
        (KEYS + '[[parts.keys]]\nname = "a"\noutline = [[0, 0], [9, 0], [9, 9]]', "must differ, got a, a"),
        (PARTS + '[[parts.keys]]\nname = "a"\n[[parts.keys]]\nname = "b"', "needs an outline for each"),
    ],
)
def test_a_wrong_shot_is_refused_in_a_sentence_that_names_the_file_once(tmp_path, text, words):
    with pytest.raises(InputError, match=words) as caught:
        read(tmp_path, text)
    assert str(caught.value).count(str(tmp_path / "a.shot.toml")) == 1 and "\n" not in str(caught.value)


def test_a_shot_that_is_not_there_or_no_text_is_one_sentence(tmp_path):
    (tmp_path / "b.shot.toml").write_bytes(b"clip = '\xff'")
    for name in ("none.shot.toml", "b.shot.toml", "."):
        with pytest.raises(InputError, match=r"shot file"):
            read_shot(tmp_path / name)


def test_a_shot_of_many_parts_on_one_is_fine():
    body = Part("body")
    shot = Shot("a.mp4", (Part("hand", parent="arm"), body, Part("arm", parent="body"), Part("leg", parent="body")))
    assert check(shot) is shot
