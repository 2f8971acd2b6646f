"""Records from their files: what is read, and every fault in a sentence."""

from dataclasses import dataclass

import pytest

from capture.errors import InputError
from capture.records import read_record


@dataclass(frozen=True)
class Hat:
    colour: str
    tall: float = 1.0


def told(hat, stored):
    if "feather" in stored:
        raise InputError("a hat must have no feather, take it off")
    return hat


@pytest.mark.parametrize(
    ("name", "text"), [("a.hat.toml", 'colour = "red"\ntall = 2\n'), ("a.hat.json", '{"colour": "red", "tall": 2}')]
)
def test_toml_and_json_hold_the_same_record(tmp_path, name, text):
    (tmp_path / name).write_text(text)
    assert read_record(tmp_path / name, Hat, told, "a hat", "a hat file") == Hat("red", 2.0)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (None, "a hat must be a file that exists: there is no "),
        ("colour = 3", "must be a hat file: "),
        ("colour = ", "must be a hat file: "),
        (b"\xff\xfe", "must be a hat file: "),
        ('colour = "red"\nfeather = 1', "a.toml: a hat must have no feather"),
    ],
)
def test_what_is_no_record_is_refused_and_the_file_is_named(tmp_path, text, said):
    path = tmp_path / "a.toml"
    if text is not None:
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(InputError, match=r"a\.toml") as refused:
        read_record(path, Hat, told, "a hat", "a hat file")
    assert said in str(refused.value)
