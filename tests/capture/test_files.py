"""Outputs appear whole or not at all."""

import errno
import os

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from capture.errors import InputError
from capture.files import folder_written_beside, written_beside


def contents(folder):
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


@given(old=st.none() | st.binary(), new=st.binary(), fails=st.booleans())
@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_file_is_wholly_new_or_wholly_old(tmp_path_factory, old, new, fails):
    folder = tmp_path_factory.mktemp("out")
    target = folder / "ball.mp4"
    if old is not None:
        target.write_bytes(old)
    before = contents(folder)
    try:
        with written_beside(target) as beside:
            beside.write_bytes(new)
            assert contents(folder).get("ball.mp4") == old
            if fails:
                raise RuntimeError
    except RuntimeError:
        assert contents(folder) == before
    else:
        assert contents(folder) == {"ball.mp4": new}


@pytest.mark.parametrize("context", [written_beside, folder_written_beside])
@pytest.mark.parametrize("stop", [KeyboardInterrupt, SystemExit, InputError])
def test_nothing_is_left_after_any_kind_of_stop(tmp_path, context, stop):
    with pytest.raises(stop), context(tmp_path / "made" / "out"):
        raise stop
    assert list(tmp_path.iterdir()) == []


def test_the_temporary_file_is_a_neighbour_with_the_same_suffix(tmp_path):
    with written_beside(tmp_path / "walk.motion.json") as beside:
        assert (beside.parent, beside.suffix) == (tmp_path, ".json")


def test_the_file_has_the_usual_permissions(tmp_path):
    with written_beside(tmp_path / "a.txt") as beside:
        beside.write_text("a")
    (tmp_path / "b.txt").write_text("b")
    assert (tmp_path / "a.txt").stat().st_mode == (tmp_path / "b.txt").stat().st_mode


def test_a_link_stays_a_link(tmp_path):
    (tmp_path / "real.txt").write_text("old")
    (tmp_path / "link.txt").symlink_to(tmp_path / "real.txt")
    with written_beside(tmp_path / "link.txt") as beside:
        beside.write_text("new")
    assert (tmp_path / "link.txt").is_symlink() and (tmp_path / "real.txt").read_text() == "new"


def test_one_missing_folder_is_made_and_two_are_refused(tmp_path):
    with written_beside(tmp_path / "out" / "a.txt") as beside:
        beside.write_text("a")
    assert contents(tmp_path) == {"out/a.txt": b"a"}
    with pytest.raises(InputError, match="must exist"), written_beside(tmp_path / "x" / "y" / "a.txt"):
        pass
    assert contents(tmp_path) == {"out/a.txt": b"a"}


@pytest.mark.parametrize("path", ["/dev/null", "/proc/a.txt", "/dev/null/a.txt", "."])
def test_a_place_that_cannot_be_written_is_an_input_error(path):
    with pytest.raises(InputError), written_beside(path):
        pass


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_without_write_permission_is_an_input_error(tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(InputError, match="can be written"), written_beside(tmp_path / "a.txt"):
        pass


@pytest.mark.parametrize("context", [written_beside, folder_written_beside])
def test_a_full_disk_is_an_input_error_and_other_faults_are_not(tmp_path, context):
    with pytest.raises(InputError, match="full"), context(tmp_path / "a"):
        raise OSError(errno.ENOSPC, "No space left on device")
    with pytest.raises(FileNotFoundError), context(tmp_path / "a"):
        (tmp_path / "not there").read_bytes()
    assert contents(tmp_path) == {}


def test_a_folder_of_frames_is_replaced_with_no_old_frame_left(tmp_path):
    target = tmp_path / "frames"
    for count in (3, 2):
        with folder_written_beside(target) as folder:
            for i in range(count):
                (folder / f"{i:04d}.png").write_bytes(bytes([count]))
        assert contents(tmp_path) == {f"frames/{i:04d}.png": bytes([count]) for i in range(count)}


@pytest.mark.parametrize("name", ["notes.txt", "walk0001.png", "001.png", "0001.png.bak", ".hidden"])
def test_a_folder_with_anything_else_in_it_is_never_replaced(tmp_path, name):
    target = tmp_path / "frames"
    target.mkdir()
    (target / "0000.png").write_bytes(b"frame")
    (target / name).write_bytes(b"mine")
    before = contents(tmp_path)
    with pytest.raises(InputError, match="it also holds"), folder_written_beside(target):
        pass
    assert contents(tmp_path) == before


def test_a_file_put_into_the_folder_meanwhile_is_not_lost(tmp_path):
    target = tmp_path / "frames"
    target.mkdir()
    with pytest.raises(InputError), folder_written_beside(target) as folder:
        (folder / "0000.png").write_bytes(b"frame")
        (target / "notes.txt").write_bytes(b"mine")
    assert contents(tmp_path) == {"frames/notes.txt": b"mine"}


def test_a_file_is_no_folder_and_a_folder_no_file(tmp_path):
    (tmp_path / "file").write_text("a")
    (tmp_path / "folder").mkdir()
    with pytest.raises(InputError, match="must be a folder"), folder_written_beside(tmp_path / "file"):
        pass
    with pytest.raises(InputError, match="must be a file"), written_beside(tmp_path / "folder"):
        pass
