"""The workbench in a notebook: what its page is told and tells, by a socket of its own and by the notebook's channel."""

import json

import pytest

from capture.errors import InputError
from retarget.workbench import widget
from retarget.workbench.session import Session


@pytest.fixture
def talk(folder):
    sent = []
    talking = widget.Talk(Session(folder), lambda content, buffers=None: sent.append((content, buffers)))
    talking.sent = sent
    yield talking
    talking.close()


def kinds(talk):
    return [content["kind"] for content, _ in talk.sent]


@pytest.mark.parametrize("origin", ["http://localhost:8888", "http://127.0.0.1:8888", "https://localhost"])
def test_a_page_of_this_machine_gets_a_socket_and_may_open_it(talk, origin):
    talk.hear({"socket": origin})
    ((said, _),) = talk.sent
    assert said["address"].startswith("ws://127.0.0.1:") and talk.serving.token in said["address"]
    assert origin in talk.serving.origins


@pytest.mark.parametrize("origin", ["https://hub.example", "http://localhost.evil.example", "null", None, 7, {}])
def test_a_page_from_elsewhere_gets_none_and_no_server_is_started(talk, origin):
    talk.hear({"socket": origin})
    assert talk.sent == [({"kind": "socket", "address": ""}, None)] and talk.serving is None


def test_by_the_channel_everything_goes_too(talk):
    talk.hear({"shown": True})
    talk.hear({"do": "folder.open", "file": "hop.mp4", "id": 1})
    assert kinds(talk) == ["state", "state", "done"] and talk.session.state.name == "hop"
    talk.hear({"look": "capture.frame", "frame": 3, "id": 2})
    seen, (data,) = talk.sent[-1]
    assert seen["kind"] == "seen" and seen["id"] == 2 and data.startswith(b"\xff\xd8") and "data" not in seen
    json.dumps([content for content, _ in talk.sent])


@pytest.mark.parametrize("content", [None, "text", [], {}, {"do": "folder.open", "file": "../x"}])
def test_what_is_no_message_is_refused_and_the_page_stays(talk, content):
    talk.hear(content)
    assert kinds(talk) == ["refused"]


def test_a_page_that_has_a_socket_is_not_told_twice(talk):
    talk.hear({"socket": "http://localhost:8888"})
    talk.session.act({"do": "folder.open", "file": "hop.mp4"})
    assert kinds(talk) == ["socket"]


def test_the_widget_is_one_module_that_needs_no_file_beside_it(folder):
    pytest.importorskip("anywidget", reason="anywidget, of the extra notebook, is not installed")
    made = widget.workbench(folder / "hop.mp4")
    try:
        assert made.session.state.name == "hop"
        assert 'from "http' not in made._esm and len(made._esm) < 500_000
    finally:
        made.close()


def test_a_file_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(InputError, match="that is there"):
        widget.workbench(tmp_path / "none.mp4")
