"""What a stranger could try: names, files made to hurt, floods, and connections that only wait.  Each is refused."""

import asyncio
import base64
import json
import os
import socket
import struct
import time
import zlib
from dataclasses import replace

import numpy as np
import pytest

from capture.motion import tracks
from retarget.workbench.desks import Desk, Seen
from retarget.workbench.serving import impatient, server
from retarget.workbench.session import Session

websockets = pytest.importorskip("websockets")

SVG = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="{size}" height="{size}">{inside}<rect width="9" height="9"/></svg>'
)
LAUGHS = "".join(f'<!ENTITY a{n} "{f"&a{n - 1};" * 10}">' for n in range(1, 12))


def picture(width, height):
    """A PNG that says it is so large and has a few bytes for it."""

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        chunk(*one) for one in ((b"IHDR", head), (b"IDAT", zlib.compress(b"\0" * 999)), (b"IEND", b""))
    )


@pytest.fixture
def stage(tmp_path, by_hand, worm):
    """A session with a motion of an egg and drawings for its two keys."""
    lean = np.linspace(0, 1, 5)
    tracks.save(by_hand.motion(by_hand.tumble(5), np.column_stack([1 - lean, lean])), tmp_path / "hop.motion.json")
    opened = Session(tmp_path, "hop.motion.json")
    yield opened
    opened.close()


def drawn(folder, text):
    """The same drawing for both keys."""
    for key in ("sit", "lean"):
        (folder / f"it_{key}.svg").write_text(text)
    return ["it_sit.svg", "it_lean.svg"]


# --- names ---------------------------------------------------------------------------------------------------------

UPLOADS = (
    *(
        "../x.svg",
        "/usr/x.svg",
        "..\\x.svg",
        "C:\\x.svg",
        "C:x.svg",
        "\\\\host\\share\\x.svg",
        "a/b.svg",
        "x.svg:y.svg",
    ),
    *("NUL.svg", "con.svg", "Com1.svg", "lpt9.a.svg", " .svg", "..svg", ".hidden.svg", "x.svg ", "x.svg.", "x\0.svg"),
    *(
        "x\n.svg",
        "ä" * 150 + ".svg",
        "\u202egvs.svg",
        "x.exe",
        "x.toml",
        "hop.shot.toml",
        "index.html",
        "\ud800.svg",
    ),
)


@pytest.mark.parametrize("name", UPLOADS)
def test_a_file_to_load_must_have_a_plain_name(hop, stage, name):
    before = sorted(stage.state.folder.parent.rglob("*"))
    data = base64.b64encode(b"<svg/>").decode()
    assert "must" in hop.refused(stage, {"do": "stage.load", "name": name, "at": 0, "data": data})
    assert sorted(stage.state.folder.parent.rglob("*")) == before


OPENED = (
    "../o.mp4",
    "/dev/zero",
    "/etc/hostname",
    "a/../../o.mp4",
    "link.mp4",
    "into",
    "\\\\host\\share\\o.mp4",
    "~",
    "",
)


@pytest.mark.parametrize("name", OPENED)
@pytest.mark.parametrize("message", [{"do": "folder.open"}, {"do": "stage.background"}, {"do": "stage.play"}])
def test_no_name_leads_out_of_the_folder(hop, stage, name, message):
    folder = stage.state.folder
    hop.done(stage, "stage.play", files=["worm_sit.svg", "worm_lean.svg"])
    (folder.parent / "o.mp4").write_bytes(b"secret")
    (folder / "a").mkdir()
    (folder / "link.mp4").symlink_to(folder.parent / "o.mp4")
    (folder / "into").symlink_to(folder.parent)
    field = {"folder.open": "file", "stage.background": "what", "stage.play": "files"}[message["do"]]
    if field == "what" and not name:
        return  # none at all
    sentence = hop.refused(stage, {**message, field: [name] if field == "files" else name})
    assert "secret" not in sentence and "fault" not in sentence
    (folder.parent / "o.mp4").unlink()


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no pipes with names")
@pytest.mark.parametrize("name", ["pipe.mp4", "pipe.shot.toml"])
def test_a_pipe_is_not_waited_for(hop, stage, name):
    os.mkfifo(stage.state.folder / name)
    assert "choose a file" in hop.refused(stage, {"do": "folder.open", "file": name})


@pytest.mark.parametrize("clip", ["/dev/zero", "/etc/hostname", "../o.mp4", "link.mp4"])
def test_a_shot_from_elsewhere_does_not_reach_out_of_its_folder(hop, stage, clip):
    folder = stage.state.folder
    (folder / "link.mp4").symlink_to("/etc/hostname")
    (folder / "other.shot.toml").write_text(f'clip = "{clip}"\n')
    assert "must lie in" in hop.refused(stage, {"do": "folder.open", "file": "other.shot.toml"})


def test_a_cast_from_elsewhere_does_not_reach_out_of_its_folder(hop, stage):
    folder = stage.state.folder
    (folder / "other.motion.json").write_bytes((folder / "hop.motion.json").read_bytes())
    (folder / "other.cast.toml").write_text('[[bodies]]\ndrawing = "/dev/zero"\n')
    assert "must lie in" in hop.refused(stage, {"do": "folder.open", "file": "other.motion.json"})
    hop.done(stage, "stage.play", files=["worm_sit.svg", "worm_lean.svg"])
    file = folder / "hop.cast.toml"
    file.write_text(file.read_text().replace("worm_sit.svg", "../../worm_sit.svg"))
    assert "must lie in" in hop.refused(stage, {"do": "reload"})


def test_who_starts_the_workbench_on_a_shot_has_chosen_the_clip_that_it_names(hop, clip, tmp_path):
    (tmp_path / "shots").mkdir()
    (tmp_path / "hop.mp4").write_bytes(clip.read_bytes())
    (tmp_path / "shots" / "hop.shot.toml").write_text('clip = "../hop.mp4"\n')
    session = Session(tmp_path / "shots", "hop.shot.toml")
    assert session.act({"look": "capture.frame", "frame": 3})[0]["kind"] == "seen"
    hop.done(session, "reload")
    session.close()


# --- files made to hurt ---------------------------------------------------------------------------------------------


def test_a_picture_that_would_fill_the_memory_is_refused_and_what_was_open_stays(hop, stage):
    folder = stage.state.folder
    (folder / "huge.png").write_bytes(picture(60_000, 60_000))
    (folder / "many").mkdir()
    for n in range(2):
        (folder / "many" / f"{n}.png").write_bytes(picture(60_000, 60_000))
    for name in ("huge.png", "many"):
        assert "decode" in hop.refused(stage, {"do": "folder.open", "file": name})
        assert stage.state.name == "hop" and not (folder / "huge.shot.toml").exists()
    assert "megapixels" in hop.refused(stage, {"do": "stage.play", "files": ["huge.png"]})


@pytest.mark.parametrize(
    ("text", "must"),
    [
        (
            f"<!DOCTYPE l [<!ENTITY a0 'lol'>{LAUGHS}]>" + SVG.format(size=20, inside="<desc>&a11;</desc>"),
            "well-formed",
        ),
        ("<!DOCTYPE l [<!ENTITY a SYSTEM 'file:///etc/hostname'>]>" + SVG.format(size=20, inside="&a;"), "well-formed"),
        (SVG.format(size=20, inside='<g id="a"><use href="#a"/></g>'), "use"),
    ],
)
def test_an_svg_that_laughs_reaches_out_or_never_ends_is_refused(hop, stage, text, must):
    began = time.process_time()
    assert must in hop.refused(stage, {"do": "stage.play", "files": drawn(stage.state.folder, text)})
    assert time.process_time() - began < 2


def test_what_an_svg_names_elsewhere_is_left_out(hop, stage):
    inside = '<image href="file:///etc/hostname"/><use href="http://evil.example/x.svg#a"/><script>alert(1)</script>'
    hop.done(stage, "stage.play", files=drawn(stage.state.folder, SVG.format(size=20, inside=inside)))
    (told,) = stage.act({"look": "stage.told"})
    assert b"nothing outside the drawing is fetched" in told["data"] and b"scripts are left out" in told["data"]


def test_a_page_or_a_stage_that_would_fill_the_memory_is_refused(hop, stage):
    hop.done(stage, "stage.play", files=drawn(stage.state.folder, SVG.format(size=60_000, inside="")))
    (event,) = stage.act({"look": "stage.drawing", "part": "egg", "key": "sit"})
    assert event["kind"] == "refused" and "pixels" in event["sentence"]
    wide = replace(stage.state.motion, size=(60_000, 60_000))
    tracks.save(wide, stage.state.folder / "wide.motion.json")
    hop.done(stage, "folder.open", file="wide.motion.json")
    hop.done(stage, "stage.play", files=["worm_sit.svg", "worm_lean.svg"])
    hop.done(stage, "stage.background", what="white")
    (event,) = stage.act({"look": "stage.frame", "frame": 0})
    assert event["kind"] == "refused" and "pixels" in event["sentence"]


@pytest.mark.parametrize(
    "uri", ["/dev/zero", "../../../../etc/hostname", "file:///etc/hostname", "http://evil.example/b"]
)
def test_a_model_does_not_reach_out_of_its_folder(hop, stage, uri):
    told = {
        "asset": {"version": "2.0"},
        "buffers": [{"uri": uri, "byteLength": 36}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
    }
    (stage.state.folder / "it.gltf").write_text(json.dumps(told))
    assert "must lie beside it" in hop.refused(stage, {"do": "stage.play", "files": ["it.gltf"]})


def test_a_clip_that_went_away_is_closed_and_that_is_told(hop, session, folder):
    hop.done(session, "capture.add_part", name="hat")
    heard = []
    session.listen(heard.append)
    (folder / "hop.mp4").unlink()
    assert session.shown()["changed"]["folder"]["at"]["open"] == ""
    assert "hop.mp4" in heard[-1]["sentence"] and "hat" in (folder / "hop.shot.toml").read_text()


# --- floods and silence ----------------------------------------------------------------------------------------------


@pytest.fixture
def patient(tmp_path, monkeypatch):
    """A server whose session has a look that takes three seconds, and which waits for nobody longer than half of one."""
    monkeypatch.setattr(impatient, "PATIENCE", 0.5)

    def slow(state):
        time.sleep(3)
        return Seen("text/plain", b"seen")

    def named(state, name: str):
        return state

    table = Desk("test", lambda state: {}, actions={"named": named}, looks={"slow": slow})
    running = server.start(Session(tmp_path, tables=(table,)))
    yield running
    running.stop()


def connect(serving):
    address = f"ws://127.0.0.1:{serving.port}/socket?token={serving.token}"
    return websockets.connect(address, origin=f"http://127.0.0.1:{serving.port}")


async def answer(connection, number):
    """Seconds until the answer of this number comes."""
    began = time.monotonic()
    while True:
        said = await asyncio.wait_for(connection.recv(), 20)
        if isinstance(said, str) and json.loads(said).get("id") == number:
            return time.monotonic() - began


def test_looks_that_take_long_keep_nobody_from_acting(patient):
    async def talk():
        pages = [await connect(patient) for _ in range(4)]
        for page in pages:
            for number in range(20):
                await page.send(json.dumps({"look": "test.slow", "id": 1000 + number}))
        await asyncio.sleep(0.2)
        await pages[-1].send(json.dumps({"do": "test.named", "name": "x", "id": 7}))
        taken = await answer(pages[-1], 7)
        for page in pages:
            page.transport.abort()
        return taken

    assert asyncio.run(talk()) < 2


def test_a_page_that_asks_for_everything_at_once_is_let_go_and_others_go_on(patient):
    async def talk():
        async with connect(patient) as other:
            async with connect(patient) as greedy:
                with pytest.raises(websockets.ConnectionClosed) as closed:
                    for number in range(10 * server.WAITING):
                        await greedy.send(json.dumps({"look": "test.slow", "id": number}))
                    while True:
                        await asyncio.wait_for(greedy.recv(), 20)
            await other.send(json.dumps({"do": "test.named", "name": "x", "id": 7}))
            return closed.value.rcvd.code, await answer(other, 7)

    code, taken = asyncio.run(talk())
    assert code == 1013 and taken < 3


def test_thousands_of_actions_at_once_are_all_answered(patient):
    async def talk():
        async with connect(patient) as page:
            for number in range(3000):
                await page.send(json.dumps({"do": "test.named", "name": "x" * 50, "id": number}))
                if number % 500 == 499:
                    await answer(page, number)

    asyncio.run(talk())


def test_who_opens_a_connection_and_says_nothing_more_is_let_go(patient):
    with socket.create_connection(("127.0.0.1", patient.port), 5) as silent:
        silent.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX: ")
        silent.settimeout(5)
        began = time.monotonic()
        assert silent.recv(1000) == b"" and time.monotonic() - began < 4

    async def talk():
        async with connect(patient) as page:  # a page may be silent for as long as it likes
            await asyncio.sleep(1.2)
            await page.send(json.dumps({"do": "test.named", "name": "x", "id": 7}))
            return await answer(page, 7)

    assert asyncio.run(talk()) < 3


@pytest.mark.parametrize(
    "fields",
    [
        '{"name": NaN}',
        '{"name": "x", "more": 1}',
        '{"name": 1e999}',
        "{" + '"a":{' * 3000 + "}" * 3001,
        '{"name": "\\ud800"}',
    ],
)
def test_what_is_no_plain_json_is_refused(patient, fields):
    async def talk():
        async with connect(patient) as page:
            await page.recv()
            await page.send(fields.replace("{", '{"do": "test.named", "id": 7, ', 1))
            return json.loads(await asyncio.wait_for(page.recv(), 10))

    assert asyncio.run(talk())["kind"] == "refused"
