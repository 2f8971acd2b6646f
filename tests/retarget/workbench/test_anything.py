"""Whatever a page may send: a session answers with events, never with an exception, and a refusal changes nothing."""

import types
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from capture.motion import tracks
from retarget.workbench import session as sessions
from retarget.workbench.serving import wire
from retarget.workbench.session import Session
from retarget.workbench.tables import DESKS

SLOW = ("posing.danced", "posing.rubber")  # what they take is bounded by their sliders, and is tested there
TABLES = {"do": "actions", "look": "looks", "work": "work"}
NAMES = (
    *("character", "rest", "hop", "hop.mp4", "worm_lean.svg", "hop.shot.toml", "", " ", ".", "..", "../hop.mp4", "/"),
    *("/dev/zero", "a\0b", "C:\\x.png", "\\\\host\\share\\x.png", "CON", "NUL.png", "x.png:y.svg", "~", "%2e%2e"),
    *("ä" * 60, "x" * 200 + ".png", "ä" * 150 + ".png", "\ud800", "\u202egnp.exe", "__class__", ".mp4", "/0000.svg"),
)
NUMBERS = (0, 1, -1, 3, 35, 36, 2**31, 2**63, 2**64, 10**30, 0.5, -0.0, 1e-320, 1e5, 1e308, -1e308, 60.0, 99.5)
PLAIN = (
    st.none() | st.booleans() | st.sampled_from(NUMBERS) | st.floats() | st.sampled_from(NAMES) | st.text(max_size=9)
)
JSON = st.recursive(
    PLAIN, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=6), inner, max_size=4)
)


def like(kind: Any) -> st.SearchStrategy:
    """Values that a field of this type could take, and some that it could not quite."""
    origin, inner = get_origin(kind), get_args(kind)
    if origin is Annotated:
        return like(inner[0])
    if origin is Literal:
        return st.sampled_from(inner)
    if origin in (Union, types.UnionType):
        return st.one_of(*map(like, inner))
    if origin is tuple:
        return st.tuples(*map(like, inner)).map(list)
    if origin is list:
        return st.lists(like(inner[0]), max_size=9)
    if origin is dict:
        return st.dictionaries(st.sampled_from(NAMES), like(inner[1]), max_size=3)
    known = {bool: st.booleans(), int: st.integers(-1, 40), float: st.floats(-9, 300), str: st.sampled_from(NAMES)}
    return known.get(kind, st.just("AAAA"))  # bytes go in base 64


def messages() -> st.SearchStrategy:
    """Messages to everything that the desks' tables hold, most of them nearly right."""
    made = []
    for verb, table in TABLES.items():
        for desk in DESKS:
            for name, function in getattr(desk, table).items():
                if (whole := f"{desk.name}.{name}") in SLOW:
                    continue
                function = function.prepare if verb == "work" else function
                hints = list(get_type_hints(function, include_extras=True).items())[1:]
                fields = {field: like(kind) | PLAIN for field, kind in hints if field != "return"}
                made.append(st.fixed_dictionaries({verb: st.just(whole)}, optional=fields))
                made.append(
                    st.fixed_dictionaries({verb: st.just(whole), **{f: like(k) for f, k in hints if f in fields}})
                )
    plain = [st.fixed_dictionaries({"do": st.sampled_from(("undo", "redo", "reload", "cancel"))})]
    return st.one_of(*made, *plain)


@pytest.fixture(scope="module")
def places(tmp_path_factory, clip):
    """A folder with a clip, and the folder above it, which nothing may come into."""
    above = tmp_path_factory.mktemp("above")
    (above / "here").mkdir()
    (above / "here" / "hop.mp4").write_bytes(clip.read_bytes())
    (above / "secret.mp4").write_bytes(clip.read_bytes())
    return above


@pytest.fixture(scope="module")
def opened(places):
    session = Session(places / "here", "hop.mp4")
    yield session
    session.close()


@pytest.fixture
def staged(tmp_path, by_hand, worm):
    """A motion that is played: so everything at the stage can be reached."""
    lean = np.linspace(0, 1, 5)
    tracks.save(by_hand.motion(by_hand.tumble(5), np.column_stack([1 - lean, lean])), tmp_path / "egg.motion.json")
    session = Session(tmp_path, "egg.motion.json")
    session.act({"do": "stage.play", "files": ["worm_sit.svg", "worm_lean.svg"]})
    yield session
    session.close()


LOOSE = settings(deadline=None, derandomize=True, max_examples=200, suppress_health_check=list(HealthCheck))


@LOOSE
@given(message=JSON | st.dictionaries(st.sampled_from(("do", "look", "work", "id", "gesture")), JSON))
def test_any_json_is_answered(opened, message):
    events = opened.act(message)
    assert events[-1]["kind"] in ("done", "refused", "seen")
    for event in events:
        wire.packed(event)


@LOOSE
@given(message=messages())
def test_nearly_right_messages_are_done_or_refused_in_a_sentence(opened, places, message):
    nearly_right(opened, message)
    assert sorted(path.name for path in places.iterdir()) == ["here", "secret.mp4"]
    assert opened.shown()["kind"] == "state"


@LOOSE
@given(message=messages())
def test_and_so_they_are_while_something_plays(staged, message):
    nearly_right(staged, message)
    if staged.state.name != "egg":  # it has opened something else
        staged.act({"do": "folder.open", "file": "egg.motion.json"})


def nearly_right(session, message):
    before = session.state
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(sessions.working, "start", lambda *_: None)
        events = session.act(message)
    for event in events:
        wire.packed(event)
    if events[-1]["kind"] == "refused":
        assert session.state is before
        assert "fault of tooncap" not in events[-1]["sentence"], (message, events[-1])
