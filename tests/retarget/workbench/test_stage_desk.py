"""The stage desk without a screen: who plays, how they stand, pins, proposals, pulls, and exports that are what is seen."""

import base64

import numpy as np
import pytest

from capture.motion import tracks
from capture.pictures.decode import read_clip
from retarget.characters.casts.castfile import read_cast
from retarget.workbench.session import Session
from retarget.workbench.staging import orbit, playing

FRAMES = 16


@pytest.fixture
def session(tmp_path, by_hand, worm):
    """A motion by hand, in which an egg leans and tumbles, and a worm's two drawings for it."""
    lean = np.linspace(0, 1, FRAMES)
    motion = by_hand.motion(by_hand.tumble(FRAMES), np.column_stack([1 - lean, lean]))
    tracks.save(motion, tmp_path / "hop.motion.json")
    opened = Session(tmp_path, "hop.motion.json")
    yield opened
    opened.close()


def worms(session):
    return sorted(file.name for file in session.state.folder.glob("worm_*.svg"))


def seen(session, what, **fields):
    import cv2

    (event,) = session.act({"look": f"stage.{what}", **fields})
    assert event["kind"] == "seen", event
    picture = cv2.imdecode(np.frombuffer(event["data"], np.uint8), cv2.IMREAD_UNCHANGED)
    return cv2.cvtColor(picture[..., :3], cv2.COLOR_BGR2RGB)


def ended(session, hop, what, **fields):
    heard = []
    stop = session.listen(heard.append)
    assert session.act({"work": f"stage.{what}", **fields})[-1]["kind"] == "done"
    hop.finished(session)
    stop()
    return next(event["sentence"] for event in heard if event["kind"] == "ended")


def test_a_chosen_drawing_plays_is_saved_and_can_be_taken_back(session, hop):
    hop.done(session, "stage.play", files=worms(session))
    cast = read_cast(session.state.folder / "hop.cast.toml")
    assert {key.name for key in cast.parts[0].keys} == set(session.state.motion.tracks[0].keys)
    hop.done(session, "undo")
    assert session.state.cast is None and not (session.state.folder / "hop.cast.toml").exists()


def test_what_is_seen_is_what_is_exported(session, hop):
    hop.done(session, "stage.play", files=worms(session))
    hop.done(session, "stage.background", what="#88bbdd")
    said = ended(session, hop, "export", kind="/")
    assert "hop-frames" in said and "16 frames" in said
    made = read_clip(session.state.folder / "hop-frames")
    for t in (0, 7, 15):
        assert (seen(session, "frame", frame=t) == made[t][..., :3]).all()


@pytest.mark.parametrize(("kind", "begins"), [(".gif", b"GIF8"), (".glb", b"glTF"), (".json", b"{"), (".csv", b"")])
def test_an_export_is_a_file_of_its_kind_and_is_named_in_the_end(session, hop, kind, begins):
    hop.done(session, "stage.play", files=worms(session))
    said = ended(session, hop, "export", kind=kind)
    file = session.state.folder / f"hop.retarget{kind}"
    assert file.name in said and file.read_bytes().startswith(begins) and file.stat().st_size > 100


def test_what_was_exported_can_be_had_from_the_page_and_nothing_else_can(session, hop):
    hop.done(session, "stage.play", files=worms(session))
    (session.state.folder / "hop.secret").write_text("mine")
    (session.state.folder / "hop.retarget.mp4").write_text("made by somebody else")
    ended(session, hop, "export", kind=".gif")
    (one,) = session.shown()["changed"]["stage"]["made"]
    file = session.state.folder / "hop.retarget.gif"
    assert (one["file"], one["path"], one["bytes"]) == (file.name, str(file), file.stat().st_size)
    assert "16 frames" in one["said"] and "captured to within" in one["said"]
    (seen,) = session.act({"look": "stage.made", "file": file.name})
    assert (seen["type"], seen["data"], seen["size"]) == ("image/gif", file.read_bytes(), file.stat().st_size)
    (rest,) = session.act({"look": "stage.made", "file": file.name, "at": 100})
    assert rest["data"] == file.read_bytes()[100:]
    for other in ("hop.secret", "hop.retarget.mp4", "hop.motion.json", "../hop.gif", "/etc/hostname", "hop\0", ""):
        assert "only what was exported here" in hop.refused(session, {"look": "stage.made", "file": other})
    hop.done(session, "folder.close")
    assert "only what was exported here" in hop.refused(session, {"look": "stage.made", "file": file.name})


def test_an_export_is_of_the_performance_that_it_was_made_of(session, hop):
    hop.done(session, "stage.play", files=worms(session))
    ended(session, hop, "export", kind=".gif")
    shown = session.shown()["changed"]["stage"]
    assert shown["made"][0]["of"] == shown["number"]
    hop.done(session, "stage.stand", who="egg", height=0.5)
    shown = session.shown()["changed"]["stage"]
    assert shown["made"][0]["of"] != shown["number"]


def test_a_cast_that_is_opened_again_shows_all_that_it_showed_when_it_was_made(session, hop):
    hop.done(session, "stage.play", files=worms(session))
    before = session.shown()["changed"]["stage"]
    again = Session(session.state.folder, "hop.motion.json")
    after = again.shown()["changed"]["stage"]
    assert [set(key) for key in after["cast"]["parts"][0]["keys"]] == [
        set(key) for key in before["cast"]["parts"][0]["keys"]
    ]
    assert after["plays"] == before["plays"] == worms(session)
    again.close()


def test_drawings_are_seen_small_built_in_ones_too_and_nothing_outside_is(session, hop):
    for file in (worms(session)[0], "built-in:pumpkin.svg"):
        small = seen(session, "small", file=file)
        assert max(small.shape) == 80 and small.std() > 10
    for file in ("../x.svg", "built-in:../write.py"):
        hop.refused(session, {"look": "stage.small", "file": file})


def test_a_taller_character_is_taller_without_learning_its_drawings_again(session, hop, monkeypatch):
    hop.done(session, "stage.play", files=worms(session))
    inked = [(seen(session, "frame", frame=0) < 250).any(axis=(1, 2)).sum()]
    monkeypatch.setattr(playing.casting, "targets", lambda *_: pytest.fail("the drawings were learnt again"))
    hop.done(session, "stage.stand", who="egg", height=0.5)
    inked.append((seen(session, "frame", frame=0) < 250).any(axis=(1, 2)).sum())
    assert inked[1] == pytest.approx(inked[0] / 2, abs=2)


def test_a_pinned_place_stays_and_a_pin_can_be_moved_and_taken_out(session, hop):
    hop.done(session, "stage.play", files=worms(session))
    hop.done(session, "stage.ground", on=False)
    played = playing.play(session.state.motion, session.state.cast)
    role = played.performance.roles[0]
    at = role.mesh()[6][role.target.keys.faces[5]].mean(axis=0)
    moves = np.ptp(role.mesh()[6:12][:, role.target.keys.faces[5]].mean(axis=1), axis=0).max()
    hop.done(session, "stage.pin", frame=6, at=at.tolist(), last=11)

    def way(number):
        now = playing.play(session.state.motion, session.state.cast).performance.roles[0].mesh()
        return now[6:12][:, role.target.keys.faces[5]].mean(axis=1)

    assert moves > 5, moves
    assert np.abs(way(0) - at).max() < 0.5
    hop.done(session, "stage.move_pin", number=0, to=[100.0, 200.0])
    assert np.abs(way(0) - [100, 200]).max() < 0.5
    hop.done(session, "stage.unpin", number=0)
    assert np.ptp(way(0), axis=0).max() == pytest.approx(moves, rel=1e-6)


def test_keys_are_proposed_from_one_drawing_and_one_can_be_pulled_into_shape(session, hop):
    first = next(file for file in worms(session) if "sit" in file)
    ended(session, hop, "propose", files=[first])
    (part,) = session.state.cast.parts
    assert {key.name for key in part.keys} == set(session.state.motion.tracks[0].keys)
    key = part.keys[1].name
    before = (session.state.cast.folder / part.keys[1].drawing).read_bytes()
    whole = seen(session, "drawing", part=part.name, key=key)
    pull = {"part": part.name, "key": key, "at": [160.0, 150.0], "to": [160.0, 130.0], "reach": 80.0}
    held = seen(session, "drawing", **pull)
    hop.done(session, "stage.pull", **pull)
    assert (seen(session, "drawing", part=part.name, key=key) == held).all() and (held != whole).any()
    assert (session.state.cast.folder / part.keys[1].drawing).read_bytes() == before
    hop.done(session, "undo")
    assert (seen(session, "drawing", part=part.name, key=key) == whole).all()


def test_a_file_is_loaded_piece_by_piece_and_takes_no_other_s_place(session, hop):
    data = bytes(range(256)) * 40
    for name in ("new.svg", "new-2.svg"):
        for at in range(0, len(data), 4000):
            piece = base64.b64encode(data[at : at + 4000]).decode()
            hop.done(session, "stage.load", name="new.svg", at=at, data=piece, last=at + 4000 >= len(data))
        assert (session.state.folder / name).read_bytes() == data
        data = data[::-1]
    assert not list(session.state.folder.glob(".upload*"))


@pytest.mark.parametrize(
    ("message", "must"),
    [
        ({"do": "stage.load", "name": "../x.svg", "at": 0, "data": ""}, "a file to load must be"),
        ({"do": "stage.load", "name": "x.py", "at": 0, "data": ""}, "a file to load must be"),
        ({"do": "stage.load", "name": "x.svg", "at": 9, "data": ""}, "must come whole"),
        ({"do": "stage.play", "files": ["../../etc/hostname"]}, "outside"),
        ({"do": "stage.play", "files": ["none.svg"]}, "there is no"),
        ({"do": "stage.stand", "who": "egg", "height": 1}, "choose a drawing first"),
        ({"look": "stage.frame", "frame": 3}, "choose a drawing first"),
        ({"work": "stage.export"}, "choose a drawing first"),
    ],
)
def test_what_cannot_be_is_refused_in_a_sentence(session, hop, message, must):
    assert must in hop.refused(session, message)


def test_a_model_turned_half_round_shows_its_other_side(session):
    from types import SimpleNamespace

    from retarget.stage.perform import Performance, Role

    points = np.random.default_rng(3).normal(size=(4, 9, 3)) * 50 + 200
    some = np.zeros(4)
    role = Role(SimpleNamespace(), points, some, 1.0, some, some, some, some, some)
    performance = Performance((role,), some, 24.0, (400, 400))
    half = orbit.seen_from(performance, np.pi, 0.0).roles[0].points
    middle = (points.min(axis=1) + points.max(axis=1))[:, None] / 2
    assert np.allclose(half - middle, (points - middle) * [-1, 1, -1])
    quarter = orbit.seen_from(orbit.seen_from(performance, 0.3, 0), -0.3, 0).roles[0].points
    assert np.abs(quarter - points).max() < 40
    assert np.allclose(np.linalg.det(orbit.turned(0.4, -0.7)), 1)
