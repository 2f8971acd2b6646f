"""What lies in a folder: kinds, folders below, frames as one clip, bounds, and nothing told twice that did not change."""

import os
import time

import pytest

from retarget.workbench.folder import listing


@pytest.fixture
def folder(tmp_path):
    for name in (
        *("hop.mp4", "hop.shot.toml", "hop.motion.json", "notes.txt", ".hidden.mp4", "hop.retarget.gif"),
        *(
            "characters/bunny_sit.svg",
            "characters/bunny_leap.svg",
            "characters/bunny_leap.edit1.svg",
            "clips/old/run.bvh",
        ),
        *(f"walk/{n:04}.png" for n in range(9)),
        *(f"hop-drawings/{n:04}.svg" for n in range(9)),
        *("two/eye1.png", "two/eye2.png", ".git/x.mp4", "a/b/c/deep.mp4", "a/b/c/d/deeper.mp4"),
    ):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    return tmp_path


def files(folder, kind):
    return {one["file"] for one in listing.listing(folder).files if one["kind"] == kind}


def test_files_are_found_in_folders_three_deep_and_hidden_ones_are_not(folder):
    assert files(folder, "clip") == {"hop.mp4", "walk", "two", "a/b/c/deep.mp4"}
    assert files(folder, "shot") == {"hop.shot.toml"} and files(folder, "bvh") == {"clips/old/run.bvh"}
    assert listing.listing(folder).files[0]["kind"] == "shot"
    assert not listing.listing(folder).more


def test_numbered_pictures_are_a_clip_and_no_drawings_but_two_may_be_both(folder):
    drawn = {"characters/bunny_sit.svg", "characters/bunny_leap.svg", "two/eye1.png", "two/eye2.png"}
    assert files(folder, "drawing") == drawn
    assert files(folder / "walk", "clip") == {"."}


def test_key_drawings_named_after_frames_are_drawings(tmp_path):
    keys = {f"bunny_keys/bunny_k{n}.svg" for n in (0, 22, 39, 44, 57)}
    (tmp_path / "bunny_keys").mkdir()
    for name in keys:
        (tmp_path / name).touch()
    assert files(tmp_path, "drawing") == keys


def test_what_the_workbench_made_is_offered_neither_as_a_clip_nor_as_a_drawing(folder):
    assert files(folder, "made") == {"hop.retarget.gif", "characters/bunny_leap.edit1.svg"}


def test_what_comes_later_is_seen_and_what_did_not_change_is_not_looked_up_again(folder, monkeypatch):
    past = time.time() - 60
    for at, _, _ in os.walk(folder):
        os.utime(at, (past, past))
    listing.listing(folder)
    with monkeypatch.context() as patched:
        patched.setattr(listing, "_kinds", lambda *_: pytest.fail("the folder was looked up again"))
        listing.listing(folder)
    (folder / "characters" / "pumpkin.svg").touch()
    assert "characters/pumpkin.svg" in files(folder, "drawing")
    (folder / "characters" / "pumpkin.svg").unlink()
    assert "characters/pumpkin.svg" not in files(folder, "drawing")


def test_of_thousands_of_files_the_nearest_are_listed_and_it_is_said_that_there_are_more(tmp_path):
    (tmp_path / "below").mkdir()
    for n in range(2000):
        (tmp_path / "below" / f"take {n} a.mp4").touch()
    (tmp_path / "mine.mp4").touch()
    began = time.process_time()
    found = listing.listing(tmp_path)
    assert time.process_time() - began < 0.5
    assert found.more and len(found.files) == listing.LISTED and found.files[0]["file"] == "mine.mp4"


def test_no_more_names_are_looked_at_than_the_bound(tmp_path, monkeypatch):
    monkeypatch.setattr(listing, "LOOKED_AT", 10)
    for n in range(30):
        (tmp_path / f"take {n} a.mp4").touch()
    assert listing.listing(tmp_path).more and len(listing.listing(tmp_path).files) <= 10


@pytest.mark.skipif(not hasattr(os, "symlink") or os.name != "posix", reason="links as POSIX has them")
def test_links_to_folders_are_not_followed(tmp_path):
    (tmp_path / "round").symlink_to(tmp_path)
    (tmp_path / "hop.mp4").touch()
    assert files(tmp_path, "clip") == {"hop.mp4"}


def test_what_has_joints_is_a_figure_and_music_is_music(folder):
    jointed, plain = b'<svg xmlns="http://www.w3.org/2000/svg"><g id="joints"/></svg>', b"<svg/>"
    (folder / "cat").mkdir()
    for name in ("char_cfg.yaml", "texture.png", "mask.png", "dance.bvh"):
        (folder / "cat" / name).touch()
    (folder / "puppet.svg").write_bytes(jointed)
    (folder / "rock.svg").write_bytes(plain)
    (folder / "fox.glb").write_bytes(b'glTF {"skins":[{}]}')
    (folder / "table.glb").write_bytes(b'glTF {"nodes":[{}]}')
    for name in ("clips/dog.marks.toml", "clips/song.mid"):
        (folder / name).touch()
    assert files(folder, "figure") == {"cat", "puppet.svg", "fox.glb", "clips/dog.marks.toml"}
    assert files(folder, "drawing") >= {"puppet.svg", "rock.svg", "fox.glb", "table.glb"}  # they can be cast too
    assert not any(one.startswith("cat") for one in files(folder, "clip") | files(folder, "drawing"))
    assert "cat/dance.bvh" in files(folder, "bvh") and files(folder, "music") == {"clips/song.mid"}
    assert not files(folder / "cat", "figure")  # an opened folder is no figure of itself
    assert listing.listing(folder).of("music", "shot") == ["hop.shot.toml", "clips/song.mid"]


def test_a_file_that_becomes_a_figure_is_one_then(folder):
    (folder / "fox.glb").write_bytes(b'glTF {"nodes":[{}]}')
    assert not files(folder, "figure")
    (folder / "fox.glb").unlink()
    (folder / "fox.glb").write_bytes(b'glTF {"skins":[{}]}  ')
    assert files(folder, "figure") == {"fox.glb"}


def test_a_listing_that_says_the_same_is_the_same(folder):
    before = listing.listing(folder)
    (folder / "notes.txt").write_text("more")
    (folder / "more.txt").touch()
    assert listing.listing(folder) is before
    (folder / "new.svg").touch()
    assert listing.listing(folder) is not before
