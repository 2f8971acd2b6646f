"""The posing desk without a screen: drags, pins, postures, beats, and rubber beside what was captured."""

import numpy as np
import pytest

from capture.pictures.decode import read_clip
from fixtures.write import CHARACTERS
from mocap.posing.choreography import read_dance
from mocap.posing.postures import read_pool
from mocap.posing.stance import read_stance
from mocap.skeletons.bvh import read_bvh, write_bvh
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion
from retarget.workbench.session import Session


@pytest.fixture
def session(tmp_path):
    opened = Session(tmp_path)
    opened.act({"do": "posing.begin", "who": "human"})
    yield opened
    opened.close()


@pytest.fixture
def kick(tmp_path):
    """A kick as a BVH file, from formulas."""
    from fixtures import skeletons

    figure = skeletons.kick(2.0, 30.0)
    skeleton = Skeleton(figure.names, figure.parents, np.array(figure.offsets, float))
    write_bvh(SkeletonMotion(skeleton, figure.translation, figure.rotation, 30.0), tmp_path / "kick.bvh")
    opened = Session(tmp_path, "kick.bvh")
    yield opened
    opened.close()


@pytest.fixture
def cat(tmp_path):
    """A drawing with marked joints: paths of an SVG."""
    (tmp_path / "cat.svg").write_bytes((CHARACTERS / "tomcat.svg").read_bytes())
    opened = Session(tmp_path)
    opened.act({"do": "posing.begin", "who": "cat.svg"})
    yield opened
    opened.close()


def joint(session, name):
    return session.state.figure.skeleton.names.index(name)


def places(session):
    return session.state.figure.pose.positions


def seen(session, look, **fields):
    (event,) = session.act({"look": f"posing.{look}", **fields})
    assert event["kind"] == "seen", event
    return np.frombuffer(event["data"], "<f4").reshape(event["shape"]), event


def test_a_dragged_joint_goes_along_pinned_ones_stay_and_one_undo_takes_the_drag_back(session, hop):
    before, hand, foot = places(session), joint(session, "RightHand"), joint(session, "LeftFoot")
    hop.done(session, "posing.pin", joint=foot)
    for n in range(1, 5):
        to = before[hand] + np.array([-0.05, 0.1, 0.1]) * n
        hop.done(session, "posing.drag", joint=hand, to=to.tolist(), gesture="g")
    assert np.abs(places(session)[hand] - to).max() < 2e-3
    assert np.abs(places(session)[foot] - before[foot]).max() < 1e-6
    hop.done(session, "undo")
    assert (places(session) == before).all() and session.state.figure.pinned == (foot,)


def test_a_posture_goes_by_its_extent_and_none_of_it_is_rest(session, hop):
    rest, head = places(session), joint(session, "Head")
    down = []
    for extent in (0.5, 1.0, 0.0):
        hop.done(session, "posing.mix", posture="bow", extent=extent)
        down.append(rest[head, 1] - places(session)[head, 1])
    assert 0 < down[0] < down[1] and down[2] == pytest.approx(0, abs=1e-9)


def test_a_kept_pose_is_a_posture_that_gives_the_pose_again_and_is_saved(session, hop):
    hand = joint(session, "LeftHand")
    hop.done(session, "posing.drag", joint=hand, to=(places(session)[hand] + [0.1, 0.4, 0.2]).tolist())
    posed = places(session)
    hop.done(session, "posing.keep", name="hello")
    hop.done(session, "posing.stand")
    assert np.abs(places(session) - posed).max() > 0.1
    hop.done(session, "posing.mix", posture="hello", extent=1.0)

    def apart(points):
        return np.linalg.norm(points[:, None] - points, axis=-1)

    assert np.allclose(apart(places(session)), apart(posed), atol=1e-6)  # where it is and heads is no posture's
    assert "hello" in read_pool(session.state.folder / "human.postures.json").names()


def test_postures_on_beats_are_danced_on_their_beats_and_saved(session, hop):
    hop.done(session, "posing.put", posture="arms up", beat=2.0)
    hop.done(session, "posing.put", posture="crouch", beat=6.0)
    hop.done(session, "posing.move", step=1, beat=5.0)
    (phrase,) = read_dance(session.state.folder / "human.dance.toml").phrases
    assert [(step.beat, step.posture) for step in phrase.steps] == [(2.0, "arms up"), (5.0, "crouch")]
    motion, said = seen(session, "danced")
    assert len(motion) == 8 * 12 and said["fps"] == 24
    hands, hips = motion[:, joint(session, "LeftHand"), 1], motion[:, joint(session, "Hips"), 1]
    assert hands[24] > hands.min() + 0.9 * np.ptp(hands) and hips[60] < hips.min() + 0.1 * np.ptp(hips)
    for slider, value in (("wild", 1.0), ("damping", 0.2)):
        hop.done(session, "posing.feel", slider=slider, value=value)
    soft, _ = seen(session, "danced")
    assert soft.shape == motion.shape and np.abs(soft - motion).max() > 0.01
    hop.done(session, "posing.drop", step=0)
    assert len(session.state.figure.dance.phrases[0].steps) == 1


def test_rubber_of_a_clip_goes_further_the_more_of_it_is_asked(kick):
    captured, _ = seen(kick, "clip")
    spans = []
    for omega in (1.0, 3.0):
        for slider, value in (("omega", omega), ("follow", 0.0)):
            kick.act({"do": "posing.feel", "slider": slider, "value": value})
        made, said = seen(kick, "rubber")
        assert len(made) == len(captured) and len(said["parents"]) == made.shape[1]
        spans.append(np.ptp(made, axis=0).max())
    assert spans[1] > 1.2 * spans[0]


def exported(session, hop, **message):
    """What is said when it is written."""
    heard = []
    stop = session.listen(heard.append)
    assert session.act({"work": "posing.export", **message})[-1]["kind"] == "done"
    hop.finished(session)
    stop()
    ended = next(event for event in heard if event["kind"] == "ended")
    assert ended["made"], ended
    return ended["sentence"]


def test_what_is_exported_is_a_file_that_a_reader_reads(kick, hop):
    hop.done(kick, "posing.put", posture="arms up", beat=1.0)
    hop.done(kick, "posing.save_pose")
    assert len(read_bvh(kick.state.folder / "kick.pose.bvh")) == 1
    hop.done(kick, "posing.feel", slider="omega", value=2.0)
    for what in ("dance", "rubber"):
        assert f"kick.{what}.bvh" in exported(kick, hop, what=what, kind=".bvh")
        assert len(read_bvh(kick.state.folder / f"kick.{what}.bvh")) > 10
    shown = kick.shown()["changed"]
    assert [one["file"] for one in shown["posing"]["made"]] == ["kick.rubber.bvh", "kick.dance.bvh", "kick.pose.bvh"]
    assert shown["stage"]["made"] == []
    (piece,) = kick.act({"look": "posing.made", "file": "kick.dance.bvh"})
    assert piece["data"] == (kick.state.folder / "kick.dance.bvh").read_bytes()
    assert "only what was exported here" in hop.refused(kick, {"look": "posing.made", "file": "kick.bvh"})


def test_whom_one_can_pose_and_what_one_can_hear_are_found_in_folders_below_too(kick):
    import json

    folder = kick.state.folder
    (folder / "below" / "bear").mkdir(parents=True)
    (folder / "below" / "bear" / "char_cfg.yaml").touch()
    (folder / "below" / "cat.svg").write_bytes((CHARACTERS / "tomcat.svg").read_bytes())
    (folder / "below" / "song.mid").touch()
    found = {look: json.loads(kick.act({"look": f"posing.{look}"})[0]["data"]) for look in ("others", "songs")}
    assert set(found["others"]) == {"kick.bvh", "below/bear", "below/cat.svg"}
    assert found["songs"] == ["below/song.mid"]


def test_a_dance_has_phrases_that_are_added_copied_changed_and_taken_out(session, hop):
    hop.done(session, "posing.put", posture="arms up", beat=2.0)
    hop.done(session, "posing.copy_phrase", phrase=0)
    hop.done(session, "posing.set_phrase", phrase=1, repeats=2, mirror=True, beats=4.0)
    hop.done(session, "posing.add_phrase")
    hop.done(session, "posing.move", step=0, phrase=0, into=2, beat=5.5, extent=0.5)
    path = session.state.folder / "human.dance.toml"
    first, second, third = read_dance(path).phrases
    assert first.steps == () and (second.beats, second.repeats, second.mirror) == (4.0, 2, True)
    assert [(step.beat, step.extent) for step in third.steps] == [(5.5, 0.5)]
    assert session.state.figure.dance.beats == 8 + 2 * 4 + 8
    assert "reach beyond its steps" in hop.refused(session, {"do": "posing.set_phrase", "phrase": 2, "beats": 4.0})
    hop.done(session, "posing.drop_phrase", phrase=0)
    assert len(read_dance(path).phrases) == 2
    assert "no phrase 7" in hop.refused(session, {"do": "posing.drop_phrase", "phrase": 7})


def test_pose_pins_sliders_and_music_are_there_again_when_the_workbench_was_closed(session, hop, song):
    hand, foot = joint(session, "RightHand"), joint(session, "LeftFoot")
    hop.done(session, "posing.pin", joint=foot)
    hop.done(session, "posing.drag", joint=hand, to=(places(session)[hand] + [-0.1, 0.4, 0.2]).tolist())
    hop.done(session, "posing.feel", slider="omega", value=4.5)
    chosen(session, hop)
    before = session.state.figure
    session.close()
    again = Session(session.state.folder)
    hop.done(again, "posing.begin", who="human")
    figure = again.state.figure
    assert (figure.pose.positions == before.pose.positions).all() and figure.pinned == (foot,)
    assert figure.slider("omega") == 4.5 and figure.music == before.music
    assert read_stance(session.state.folder / "human.posing.json").feel == {"omega": 4.5}
    again.close()


def test_a_figure_nobody_touched_leaves_no_pose_behind_and_undo_takes_it_back(session, hop):
    path = session.state.folder / "human.posing.json"
    assert not path.exists()
    hop.done(session, "posing.feel", slider="wild", value=0.5)
    assert path.exists()
    hop.done(session, "undo")
    assert not path.exists()


def test_what_another_program_wrote_is_read_again(kick, hop):
    from mocap.posing.choreography import Dance, Phrase, Step, write_dance

    hop.done(kick, "posing.put", posture="arms up", beat=1.0)
    write_dance(Dance((Phrase((Step(3.0, "bow"),)),)), kick.state.folder / "kick.dance.toml")
    told = hop.done(kick, "posing.move", step=0, beat=2.0)
    assert any("changed by another program" in event.get("sentence", "") for event in told)
    hop.done(kick, "reload")
    assert kick.state.figure.dance.phrases[0].steps == (Step(3.0, "bow"),)
    hop.done(kick, "undo")
    assert kick.state.figure.dance.phrases[0].steps[0].beat == 2.0


@pytest.fixture
def song(tmp_path):
    """Twelve seconds of clicks, two a second, the first after 0.3 s, as a WAV file."""
    import wave

    rate = 22050
    sound = np.zeros(12 * rate)
    t = np.arange(int(0.04 * rate)) / rate
    for when in np.arange(0.3, 11.9, 0.5):
        sound[int(when * rate) :][: len(t)] = 0.8 * np.exp(-t / 0.01) * np.sin(2 * np.pi * 1200 * t)
    with wave.open(str(tmp_path / "song.wav"), "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(rate)
        file.writeframes((sound * 32767).astype("<i2").tobytes())


def chosen(session, hop):
    assert session.act({"work": "posing.hear", "file": "song.wav"})[-1]["kind"] == "done"
    hop.finished(session)
    assert session.state.figure.music is not None


def test_music_is_heard_danced_to_and_its_pace_is_corrected(session, hop, song):
    chosen(session, hop)
    music = session.state.figure.music
    near = np.abs(np.array(music.times)[:, None] - np.arange(0.3, 11.9, 0.5)).min(axis=1)
    assert music.bpm == pytest.approx(120, rel=0.02) and np.median(near) < 0.02
    hop.done(session, "posing.put", posture="arms up", beat=2.0)
    motion, _ = seen(session, "danced")
    assert len(motion) == 12 * 24
    hands = motion[:, joint(session, "LeftHand"), 1]
    up = round(24 * music.beats().times[2])
    assert hands[up] > hands.min() + 0.9 * np.ptp(hands)
    hop.done(session, "posing.pace", by="half")
    later, _ = seen(session, "danced")
    up = round(24 * music.times[4])
    assert later[up, joint(session, "LeftHand"), 1] > hands.min() + 0.9 * np.ptp(hands)
    hop.done(session, "posing.tap", bpm=90.0, first=1.0)
    assert np.allclose(np.diff(session.state.figure.music.times), 60 / 90, atol=1e-3)
    (event,) = session.act({"look": "posing.heard"})
    assert event["type"] == "audio/wav" and event["data"][:4] == b"RIFF"
    hop.done(session, "posing.hush")
    assert session.state.figure.music is None


def test_some_seconds_of_a_dance_are_those_of_the_whole(session, hop):
    hop.done(session, "posing.invent", seed=2)
    whole, _ = seen(session, "danced")
    some, said = seen(session, "danced", start=4.0, seconds=2.0)
    assert said["first"] == 96 and len(some) == 48
    assert np.abs(some[8:-8] - whole[104:136]).max() < 0.03


def test_some_seconds_of_a_drawing_s_dance_are_those_of_the_whole_but_for_where_it_has_walked_to(cat, hop):
    hop.done(cat, "posing.invent", seed=2)
    whole, _ = seen(cat, "danced")
    some, said = seen(cat, "danced", start=4.0, seconds=2.0)
    assert said["first"] == 96 and len(some) == 48
    apart = some[8:-8] - whole[104:136]
    assert np.abs(apart[..., [0, 1, 3, 4]]).max() * 60 < 0.05  # turned and stretched alike, 60 pixels from a joint
    assert np.ptp(apart[:, 0, 2]) < 0.05 and np.abs(apart[:, 0, 5]).max() < 0.05


def drawn_at(session):
    """The parts of the drawing as they are shown: maps (P, 2, 3), by their names."""
    (event,) = session.act({"look": "posing.mesh"})
    held = session.state.figure.drawing
    shown = session.shown()["changed"]["posing"]["parts"]
    return held, np.array(shown).reshape(-1, 7)[:, :6].reshape(-1, 2, 3), event


def test_a_marked_drawing_is_posed_and_its_parts_go_with_its_joints(cat, hop):
    hand = joint(cat, "left_hand")
    to = places(cat)[hand] + [0.05, 0.3, 0]
    hop.done(cat, "posing.drag", joint=hand, to=to.tolist())
    held, maps, event = drawn_at(cat)
    tip = held.parts.names.index("left_hand 4")
    there = maps[tip] @ [*held.parts.stops[tip], 1]
    assert np.abs(there - places(cat)[hand][:2]).max() < 1e-4 and np.abs(there - to[:2]).max() < 0.02
    count = sum(piece["points"] for piece in event["pieces"])
    assert len(event["data"]) == 4 * count * (2 + event["parts"]) and all(piece["paths"] for piece in event["pieces"])
    hop.done(cat, "posing.undrag")
    _, maps, _ = drawn_at(cat)
    assert np.abs(maps[..., :2] - maps[0, :, :2]).max() < 1e-6


def test_a_marked_drawing_dances_as_it_is_exported_and_its_pose_is_a_picture(cat, hop):
    from PIL import Image

    hop.done(cat, "posing.invent", seed=1)
    parts, said = seen(cat, "danced")
    assert parts.shape[1:] == (len(said["parts"]), 7) and np.ptp(parts[..., :6], axis=0).max() > 0.1
    for kind in (".png", ".svg", ".bvh"):
        hop.done(cat, "posing.save_pose", kind=kind)
    picture = np.asarray(Image.open(cat.state.folder / "cat.pose.png"))
    assert picture.shape[2] == 4 and 0.05 < (picture[..., 3] > 127).mean() < 0.9
    assert "<path" in (cat.state.folder / "cat.pose.svg").read_text()
    exported(cat, hop, what="dance", kind=".gif")
    clip = read_clip(cat.state.folder / "cat.dance.gif")
    assert len(clip) == len(parts)


def test_the_skeleton_of_a_model_is_posed_and_carries_its_mesh(tmp_path, hop):
    from mocap.posing import poses
    from mocap.rubber import rubber
    from retarget.characters.figures.dancer import read_dancer
    from retarget.characters.figures.rubber_skin import posed, rubber_skin
    from retarget.commands.onward import write_performed

    dancer = read_dancer("lamp")
    still = poses.motion_of(dancer.skeleton, [poses.rest_of(dancer.skeleton)] * 2, 24.0)
    write_performed(still, dancer, tmp_path / "lamp.glb", None, 480, None)
    session = Session(tmp_path, "lamp.glb")
    last = len(session.state.figure.skeleton) - 1
    before = places(session)[last]
    hop.done(session, "posing.drag", joint=last, to=(before + [0.1, 0.05, 0]).tolist())
    assert np.linalg.norm(places(session)[last] - before) > 0.05
    (event,) = session.act({"look": "posing.others"})
    assert event["data"] == b'["lamp.glb"]'
    figure = session.state.figure
    goes = carried(*seen_body(session), np.array(session.shown()["changed"]["posing"]["joints"]).reshape(-1, 15))
    model, skin, moved = figure.body.body(poses.motion_of(figure.skeleton, [figure.pose], 24.0))
    made = rubber.plain(moved)
    truth = figure.body.unit * posed(rubber_skin(skin, model.points, made.subjoints), model.points, made)[0]
    assert np.abs(goes - truth).max() < 0.02 < np.abs(goes - figure.body.unit * model.points).max()
    hop.done(session, "posing.invent", seed=1)
    motion, _ = seen(session, "danced")
    assert motion.shape[1:] == (len(figure.skeleton), 15)
    session.close()


def seen_body(session):
    """The points (N, 3) of the model, the joints (N, 4) that carry them, and how much."""
    (event,) = session.act({"look": "posing.body"})
    numbers, count = np.frombuffer(event["data"], "<f4"), event["points"]
    points, _, which, much = np.split(numbers[: 14 * count], np.cumsum([3, 3, 4]) * count)
    return points.reshape(-1, 3), which.reshape(-1, 4).astype(int), much.reshape(-1, 4)


def carried(points, which, much, joints):
    maps = joints[:, :12].reshape(-1, 3, 4)[which]
    return np.einsum("nk,nkab,nb->na", much, maps[..., :3], points) + np.einsum("nk,nka->na", much, maps[..., 3])


@pytest.mark.parametrize(
    ("message", "must"),
    [
        ({"do": "posing.drag", "joint": 99, "to": [0, 0, 0]}, "no joint 99"),
        ({"do": "posing.drag", "joint": 1, "to": [0, 0, 1e9]}, "1e6"),
        ({"do": "posing.mix", "posture": "none", "extent": 1.0}, "must be one of"),
        ({"do": "posing.keep", "name": "x"}, "drag something first"),
        ({"do": "posing.take", "frame": 1}, "open a .bvh"),
        ({"look": "posing.rubber"}, "open a .bvh"),
        ({"look": "posing.danced"}, "put one there"),
        ({"work": "posing.export", "what": "rubber", "kind": ".bvh"}, "open a .bvh"),
        ({"work": "posing.export", "what": "dance", "kind": ".svg"}, "is written as"),
        ({"do": "posing.feel", "slider": "omega", "value": 50.0}, "0 to 20"),
        ({"do": "posing.feel", "slider": "rm", "value": 1.0}, "slider must be one of"),
        ({"do": "posing.pace", "by": "half"}, "music first"),
        ({"do": "posing.begin", "who": "../x.bvh"}, "lies outside"),
        ({"do": "posing.load", "name": "a.exe", "at": 0, "data": "", "last": True}, "music must be"),
        ({"work": "posing.hear", "file": "none.wav"}, "there is no"),
        ({"look": "posing.mesh"}, "skeleton only"),
    ],
)
def test_what_cannot_be_is_refused_in_a_sentence(session, hop, message, must):
    assert must in hop.refused(session, message).replace("1000000.0", "1e6")
