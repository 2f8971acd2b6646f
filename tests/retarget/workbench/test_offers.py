"""Who is offered to play: what has the motion's keys is first, everything offered does play, built-in ones are copied."""

from types import SimpleNamespace

import pytest

from capture.errors import InputError
from fixtures import frog, hat, write
from retarget.characters.casts import cast as casting
from retarget.workbench.session import Session
from retarget.workbench.staging import offers

CHARACTERS = write.CHARACTERS


def motion(**parts):
    return SimpleNamespace(tracks=[SimpleNamespace(part=part, keys=keys) for part, keys in parts.items()])


def lay(folder, *names):
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).touch()


def first(folder, told):
    return offers.offers(folder, told)[0]


def test_drawings_named_after_all_keys_come_first_wherever_they_lie(tmp_path):
    lay(tmp_path, "ape.svg", "who/bee_sit.svg", "who/bee_leap.svg", "cat_sit.svg")
    best = first(tmp_path, motion(frog=("sit", "leap")))
    assert (best["name"], best["where"], best["how"]) == ("bee", "who", "play")
    assert set(best["files"]) == {"who/bee_sit.svg", "who/bee_leap.svg"}
    others = {one["name"]: one for one in offers.offers(tmp_path, motion(frog=("sit", "leap")))}
    assert others["ape.svg"]["how"] == "propose" and others["cat_sit.svg"]["files"] == ("cat_sit.svg",)


def test_where_nobody_has_the_keys_one_s_own_drawing_is_first_and_its_keys_are_proposed(tmp_path):
    lay(tmp_path, "ape.svg")
    best = first(tmp_path, motion(character=("k0", "k12")))
    assert (best["files"], best["how"]) == (("ape.svg",), "propose")
    assert first(tmp_path / "none", motion(character=("k0", "k12")))["files"] == ("built-in:bunny_sit.svg",)


def test_with_one_key_every_drawing_plays_as_it_is(tmp_path):
    lay(tmp_path, "ape.svg", "photo.jpg")
    assert {one["how"] for one in offers.offers(tmp_path, motion(character=("rest",)))} == {"play"}


def test_one_picture_plays_all_keys_and_one_drawing_all_parts(tmp_path):
    lay(tmp_path, "photo.jpg", "fox.glb", "ape.svg")
    hows = {one["name"]: one["how"] for one in offers.offers(tmp_path, motion(a=("k0", "k1")))}
    assert (hows["photo.jpg"], hows["fox.glb"], hows["ape.svg"]) == ("play", "play", "propose")
    limbs = motion(trunk=("k0", "k1"), arm=("k0",))
    assert {one["how"] for one in offers.offers(tmp_path, limbs)} == {"play"}


def test_the_clip_itself_is_nobody_who_plays(tmp_path):
    lay(tmp_path, "walk.webp", "ape.svg")
    named = [one["name"] for one in offers.offers(tmp_path, motion(a=("k",)), str(tmp_path / "walk.webp"))]
    assert "walk.webp" not in named and "ape.svg" in named


def test_built_in_drawings_are_copied_and_what_is_there_is_left_alone(tmp_path):
    assert offers.borrowed(tmp_path, ["built-in:bottle.svg", "mine.svg"]) == ["characters/bottle.svg", "mine.svg"]
    copied = tmp_path / "characters" / "bottle.svg"
    assert copied.read_bytes() == (CHARACTERS / "bottle.svg").read_bytes()
    copied.write_text("mine")
    offers.borrowed(tmp_path, ["built-in:bottle.svg"])
    assert copied.read_text() == "mine"
    assert "built-in:bottle.svg" not in {
        file for one in offers.offers(tmp_path, motion(a=("k",))) for file in one["files"]
    }
    for name in ("built-in:../write.py", "built-in:", "built-in:none.svg"):
        with pytest.raises(InputError, match="no built-in drawing"):
            offers.borrowed(tmp_path, [name])


@pytest.mark.parametrize(("toon", "who"), [(frog.frog, "bunny"), (hat.hat, "witch hat")])
def test_a_built_in_character_that_has_the_cartoon_s_keys_is_the_first_offer_and_plays_at_once(
    tmp_path, hop, toon, who
):
    from capture.motion import tracks

    truth = write.motion_of(toon())
    best = first(tmp_path, truth)
    assert (best["name"], best["how"]) == (who, "play") and len(best["files"]) == len(truth.tracks[0].keys)
    tracks.save(truth, tmp_path / "clip.motion.json")
    session = Session(tmp_path, "clip.motion.json")
    hop.done(session, "stage.play", files=list(best["files"]))
    (part,) = session.state.cast.parts
    assert {key.name for key in part.keys} == set(truth.tracks[0].keys)
    assert casting.targets(session.state.cast, session.state.motion)
    session.close()
