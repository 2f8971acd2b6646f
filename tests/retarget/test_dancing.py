"""`tooncap mocap dance`: to music, by whom one likes, into every kind of file."""

import json

import av
import numpy as np
import pytest

from capture.pictures.decode import read_clip
from fixtures.write import CHARACTERS
from mocap.posing.choreography import read_dance
from mocap.posing.postures import Pool, Posture, read_pool, write_pool
from mocap.skeletons.bvh import read_bvh
from retarget import cli
from retarget.characters.figures.dancer import read_dancer
from retarget.characters.figures.skin import read_skin, sampled, skinned
from retarget.characters.models.meshfiles import read_model


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def dance(*given):
    return cli.main(["mocap", "dance", *map(str, given)])


def song(path, bpm, beats):
    """A MIDI file with a note on every beat."""
    import mido

    file = mido.MidiFile(ticks_per_beat=480)
    track = mido.MidiTrack()
    file.tracks.append(track)
    track.append(mido.MetaMessage("set_tempo", tempo=mido.bpm2tempo(bpm)))
    for _ in range(beats):
        track.append(mido.Message("note_on", note=72, time=0))
        track.append(mido.Message("note_off", note=72, time=480))
    file.save(path)


def test_a_song_is_danced_as_long_as_it_lasts(capsys):
    song("song.mid", 96, 16)
    assert dance("song.mid", "-o", "song.bvh") == 0
    said = capsys.readouterr().out
    motion = read_bvh("song.bvh")
    assert len(motion) == 240 and motion.fps == pytest.approx(24)  # 16 beats at 96 a minute are ten seconds
    assert said.startswith("song.bvh: 240 frames at 24 a second") and "96.0 a minute" in said
    assert np.ptp(motion.positions(), axis=0).max() > 0.5  # metres


def test_quick_music_is_danced_at_half_its_tempo_unless_every_beat_is_wanted(capsys):
    song("song.mid", 160, 16)
    assert dance("song.mid", "-o", "a.bvh") == 0
    said = capsys.readouterr()
    assert "80.0 a minute" in said.out and "every second" in said.err
    assert dance("song.mid", "-o", "a.bvh", "--every") == 0
    assert "160.0 a minute" in capsys.readouterr().out


def test_what_was_made_up_can_be_written_edited_and_danced_again():
    given = ("--beats", 16, "--seed", 3)
    assert dance(*given, "-o", "one.bvh") == 0
    assert dance(*given, "-o", "x.dance.toml") == 0 and dance(*given, "-o", "x.postures.json") == 0
    assert dance("--beats", 16, "--steps", "x.dance.toml", "--postures", "x.postures.json", "-o", "two.bvh") == 0
    np.testing.assert_allclose(read_bvh("one.bvh").rotation, read_bvh("two.bvh").rotation, atol=1e-9)
    assert read_dance("x.dance.toml").beats == 16 and read_pool("x.postures.json").kind == "human"


def test_on_every_beat_of_the_film_a_click_is_heard_and_its_posture_seen():
    """A flag that is up on even beats and down on odd ones: pictures and sound are held against each other."""
    write_pool(Pool((Posture("up", {"hinge": (0.0, 0.0, -0.9)}),)), "flag.postures.json")
    text = '[[phrases]]\nbeats = 2\n[[phrases.steps]]\nbeat = 0\nposture = "up"\n[[phrases.steps]]\nbeat = 1\nposture = "rest"\n'
    with open("flag.dance.toml", "w") as file:
        file.write(text)
    lamp = ("--skeleton", "lamp", "--postures", "flag.postures.json", "--steps", "flag.dance.toml")
    assert dance("-o", "flag.mp4", "--bpm", 100, "--beats", 8, "--size", 128, *lamp) == 0
    with av.open("flag.mp4") as read:
        pictures = [frame.to_ndarray(format="gray") for frame in read.decode(video=0)]
    with av.open("flag.mp4") as read:
        sound = np.concatenate([frame.to_ndarray().mean(axis=0) for frame in read.decode(audio=0)])
        rate = read.streams.audio[0].rate
    assert len(pictures) == 116  # 8 beats of 0.6 s: 115.2 frames
    seen = [np.argwhere(picture < 180).mean(axis=0)[1] for picture in pictures]  # how far right the figure is
    up, down = seen[round(2 * 14.4)], seen[round(3 * 14.4)]
    assert abs(up - down) > 8
    for beat in range(1, 8):
        goal, other = (up, down) if beat % 2 == 0 else (down, up)
        assert abs(seen[round(beat * 14.4)] - goal) < 0.07 * abs(goal - other)
        at = round(beat * 0.6 * rate)
        click = np.abs(sound[at - rate // 10 : at + rate // 5])
        assert abs(int(np.argmax(click > 0.2 * np.abs(sound).max())) - rate // 10) < 0.025 * rate


@pytest.mark.parametrize(("who", "drawn"), [("human", "tomcat.svg"), ("flower", "flower.marks.toml")])
def test_a_drawing_with_marked_joints_dances(who, drawn):
    given = ("--skeleton", who, "--drawing", CHARACTERS / drawn, "--size", 160)
    assert dance("--beats", 2, "-o", "drawn.gif", *given) == 0
    clip = read_clip("drawn.gif")
    assert len(clip) == 24 and clip[0].shape[1] == 160
    assert np.abs(clip[0].astype(int) - clip[20].astype(int)).max() > 100


@pytest.mark.parametrize("who", ["human", "flower"])
def test_a_built_in_dancer_has_a_body_in_a_3d_file(who):
    assert dance("--beats", 4, "--skeleton", who, "-o", "a.glb") == 0
    skin, model = read_skin("a.glb"), read_model("a.glb")
    (name,) = skin.animations
    moved = skinned(skin, model.points, sampled(skin, name, np.array([0.0, 0.9, 1.5])))
    assert np.isfinite(moved).all() and np.abs(moved[1] - moved[0]).max() > 0.1
    assert moved[..., 1].min() > -0.1 * np.ptp(moved[..., 1])  # on the ground


def test_a_model_with_a_skin_dances_itself_and_keeps_its_shape_and_place(arm):
    assert dance("--beats", 4, "--skeleton", "arm.gltf", "-o", "danced.glb") == 0
    before, after = read_model("arm.gltf"), read_model("danced.glb")
    assert len(before.faces) == len(after.faces)
    np.testing.assert_allclose(np.ptp(after.points, axis=0), np.ptp(before.points, axis=0), atol=1e-4)
    assert dance("--beats", 4, "--skeleton", "arm.gltf", "-o", "danced.gif", "--size", 80) == 0


def test_dancers_stand_on_the_floor_in_metres():
    for name in ("human", "flower", "lamp"):
        dancer = read_dancer(name)
        assert dancer.rest.shape == (len(dancer.skeleton), 4)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (["song.mid", "--bpm", "100"], "not both"),
        (["none.mid"], "there is no"),
        (["broken.mid"], "must be a MIDI file"),
        (["notes.txt"], "a .mid file or a recording"),
        (["--bpm", "1000"], "40 to 240"),
        (["--bpm", "nan"], "40 to 240"),
        (["--beats", "0"], "1 to 10000"),
        (["--skeleton", "dog"], "human, flower, lamp"),
        (["--skeleton", "none.bvh"], "there is no"),
        (["--postures", "none.postures.json"], "there is no"),
        (["--postures", "empty.postures.json"], "empty"),
        (["--postures", "other.postures.json"], "take a pool made for it"),
        (["--steps", "none.dance.toml"], "there is no"),
        (["--steps", "bad.dance.toml"], "no such posture"),
        (["--seed", "-1"], "0 or more"),
        (["--extent", "nan"], "between -10 and 10"),
        (["--wild", "nan"], "damping"),
        (["--damping", "-1"], "damping"),
        (["--damping", "0"], "never arrives"),
        (["--quick", "0"], "above 0"),
        (["--rate", "0"], "1 to 1000"),
        (["-o", "a.svg"], "nobody drawn"),
        (["-o", "a.xyz"], "must end in"),
        (["-o", "a.bvh", "--drawing", str(CHARACTERS / "tomcat.svg")], "holds a skeleton"),
        (["--drawing", "none.svg"], "none.svg"),
    ],
)
def test_what_cannot_be_danced_is_said_in_one_line_and_nothing_is_written(here, capsys, given, said):
    song("song.mid", 100, 8)
    (here / "broken.mid").write_bytes(b"MThd broken")
    (here / "notes.txt").write_text("la la la")
    (here / "empty.postures.json").write_text(json.dumps({"version": 1, "kind": "", "postures": []}))
    write_pool(Pool((Posture("a", {"no joint": (0.1, 0.0, 0.0)}),)), here / "other.postures.json")
    (here / "bad.dance.toml").write_text('[[phrases]]\n[[phrases.steps]]\nbeat = 0\nposture = "no such posture"\n')
    before = sorted(here.iterdir())
    out = [] if "-o" in given else ["-o", "a.gif"]
    assert dance(*given, *out, "--size", "64") == 2
    told = capsys.readouterr().err.strip().splitlines()
    assert said in told[-1] and told[-1].startswith("tooncap: ")
    assert sorted(here.iterdir()) == before
