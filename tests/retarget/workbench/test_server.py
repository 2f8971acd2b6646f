"""Who may talk to the workbench, and what it says to messages that are none."""

import asyncio
import json
import struct
import urllib.error
import urllib.request

import pytest

from retarget.workbench.serving import server
from retarget.workbench.session import Session

websockets = pytest.importorskip("websockets")


@pytest.fixture(scope="module")
def serving(tmp_path_factory):
    folder = tmp_path_factory.mktemp("served")
    (folder / "inner").mkdir()
    (folder.parent / "secret.shot.toml").write_text('clip = "a.mp4"')
    running = server.start(Session(folder / "inner"))
    yield running
    running.stop()


def got(serving, path, **headers):
    """The code and the text that come back for a path."""
    request = urllib.request.Request(f"http://127.0.0.1:{serving.port}{path}", headers=headers)
    try:
        with urllib.request.urlopen(request, timeout=10) as answer:
            return answer.status, answer.read().decode()
    except urllib.error.HTTPError as error:
        with error:
            return error.code, error.read().decode()


def talked(serving, sent, token=None, origin=None):
    """The events that come back up to the answer; "closed" with the code where the server hangs up."""

    async def talk():
        own = f"http://127.0.0.1:{serving.port}" if origin is None else origin
        address = f"ws://127.0.0.1:{serving.port}/socket?token={serving.token if token is None else token}"
        try:
            async with websockets.connect(address, origin=own or None) as socket:
                events = [json.loads(await socket.recv())]
                await socket.send(sent)
                while events[-1]["kind"] not in ("done", "refused", "seen"):
                    said = await asyncio.wait_for(socket.recv(), 10)
                    if isinstance(said, bytes):
                        (length,) = struct.unpack_from("<I", said)
                        events.append({**json.loads(said[4 : 4 + length]), "data": said[4 + length :]})
                    else:
                        events.append(json.loads(said))
                return events
        except websockets.InvalidStatus as error:
            return error.response.status_code
        except websockets.ConnectionClosed as error:
            return error.rcvd.code if error.rcvd else "gone"

    return asyncio.run(talk())


def test_the_page_and_its_modules_come_to_who_holds_the_token(serving):
    code, text = got(serving, f"/?token={serving.token}")
    assert code == 200 and "<title>" in text
    assert got(serving, "/static/workbench.js")[0] == 200


@pytest.mark.parametrize("path", ["/?token=", "/?token=wrong", "/nothing", "/nothing?token="])
def test_without_the_right_token_there_is_no_page(serving, path):
    assert got(serving, path)[0] == 403


def test_a_page_of_another_origin_gets_nothing(serving):
    assert got(serving, f"/?token={serving.token}", Origin="http://evil.example")[0] == 403
    assert talked(serving, "{}", origin="http://evil.example") == 403
    assert talked(serving, "{}", origin="null") == 403
    assert talked(serving, "{}", origin="") == 403  # no page at all


def test_a_name_that_was_led_here_from_elsewhere_is_refused(serving):
    """DNS rebinding: the browser takes evil.example for us, but still says whom it calls."""
    evil = f"evil.example:{serving.port}"
    assert got(serving, f"/?token={serving.token}", Host=evil)[0] == 421
    assert got(serving, "/static/workbench.js", Host=evil)[0] == 421


@pytest.mark.parametrize("token", ["", "wrong"])
def test_the_socket_is_closed_to_who_lacks_the_token(serving, token):
    assert talked(serving, "{}", token=token) == 403


def test_only_the_page_s_own_files_are_served(serving):
    assert got(serving, "/static/../server.py")[0] == 404
    assert got(serving, "/static/%2e%2e/server.py")[0] == 404
    assert got(serving, "/static//etc/hostname")[0] == 404


@pytest.mark.parametrize(
    "sent", ["", "no json", "[1, 2]", "null", '{"do": 7}', '{"do": "rm"}', b"\x00\x01", "[" * 5000]
)
def test_a_message_that_is_none_is_refused_in_a_sentence_and_the_page_stays(serving, sent):
    assert talked(serving, sent)[-1]["kind"] == "refused"


def test_an_oversized_message_ends_the_connection(serving):
    assert talked(serving, json.dumps({"do": "x" * server.LARGEST})) == 1009


@pytest.mark.parametrize("file", ["../secret.shot.toml", "/etc/hostname", "..", "inner/../../secret.shot.toml", "a\0b"])
def test_a_path_outside_the_folder_is_not_opened(serving, file):
    refused = talked(serving, json.dumps({"do": "folder.open", "file": file}))[-1]
    assert refused["kind"] == "refused" and ("outside" in refused["sentence"] or "there is no" in refused["sentence"])


def test_a_link_that_leads_outside_is_not_followed(serving):
    folder = serving.session.state.folder
    (folder / "link.shot.toml").symlink_to(folder.parent.parent / "secret.shot.toml")
    refused = talked(serving, json.dumps({"do": "folder.open", "file": "link.shot.toml"}))[-1]
    assert refused["kind"] == "refused" and "outside" in refused["sentence"]


def test_the_page_may_load_nothing_from_elsewhere(serving):
    with urllib.request.urlopen(serving.address, timeout=10) as answer:
        policy = answer.headers["content-security-policy"]
    assert policy.startswith("default-src 'self';") and "frame-ancestors 'none'" in policy


def test_who_goes_away_in_the_middle_leaves_the_server_as_it_was(serving):
    async def leave():
        address = f"ws://127.0.0.1:{serving.port}/socket?token={serving.token}"
        socket = await websockets.connect(address, origin=f"http://127.0.0.1:{serving.port}")
        for number in range(50):
            await socket.send(json.dumps({"do": "undo", "id": number}))
        socket.transport.abort()

    asyncio.run(leave())
    assert talked(serving, '{"do": "undo"}')[-1]["kind"] == "done"
