"""What is opened: files in folders below, clips from elsewhere piece by piece, sheets; what cannot be read changes nothing."""

import base64
import json

import numpy as np
import pytest

from capture.pictures.encode import write_clip
from capture.pictures.shot import read_shot
from retarget.workbench.folder import sheets, upload
from retarget.workbench.session import Session

SPRITE = (20, 30)


@pytest.fixture
def empty(tmp_path):
    opened = Session(tmp_path)
    yield opened
    opened.close()


def loaded(session, name, data, step=4000):
    """The last answer to a file that is sent in pieces."""
    for at in range(0, max(len(data), 1), step):
        piece = base64.b64encode(data[at : at + step]).decode()
        said = session.act(
            {"do": "folder.load", "name": name, "at": at, "data": piece, "last": at + step >= len(data)}
        )[-1]
        if said["kind"] == "refused":
            break
    return said


def names(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


def test_a_clip_from_elsewhere_is_copied_whole_and_opened(empty, clip):
    assert loaded(empty, "hop.mp4", clip.read_bytes())["kind"] == "done"
    assert (empty.state.folder / "hop.mp4").read_bytes() == clip.read_bytes()
    assert empty.state.name == "hop" and empty.shown()["changed"]["capture"]["clip"]["frames"] == 36


@pytest.mark.parametrize("ending", [".gif", ".webm", ".mkv", ".mov"])
def test_clips_of_all_kinds_are_opened(empty, hop, tmp_path_factory, ending):
    made = tmp_path_factory.mktemp("clips") / "hop.mov"
    made = made.with_suffix(ending if ending != ".mkv" else ".mp4")
    write_clip(made, [hop.picture(t) for t in range(5)], 12)
    loaded(empty, f"hop{ending}", made.read_bytes())
    assert empty.shown()["changed"]["capture"]["clip"]["frames"] == 5


def test_the_same_file_again_goes_on_with_its_work_and_another_of_its_name_gets_one_of_its_own(empty, hop, clip):
    loaded(empty, "hop.mp4", clip.read_bytes())
    hop.done(empty, "capture.box", part="character", frame=0, box=hop.around(0))
    box = empty.state.shot.parts[0].box
    hop.done(empty, "folder.close")
    loaded(empty, "hop.mp4", clip.read_bytes())
    assert empty.state.name == "hop" and empty.state.shot.parts[0].box == box
    write_clip(clip.with_name("other.mp4"), [hop.picture(t) for t in range(4)], 24)
    hop.done(empty, "folder.close")
    loaded(empty, "hop.mp4", clip.with_name("other.mp4").read_bytes())
    assert empty.state.name == "hop-2" and empty.state.shot.parts[0].box is None
    assert read_shot(empty.state.folder / "hop.shot.toml").parts[0].box == box


def test_a_clip_takes_no_name_that_other_work_goes_by(empty, hop, clip):
    loaded(empty, "hop.mp4", clip.read_bytes())
    hop.done(empty, "capture.box", part="character", frame=0, box=hop.around(0))
    write_clip(clip.with_name("hop.gif"), [hop.picture(t) for t in range(4)], 24)
    loaded(empty, "hop.gif", clip.with_name("hop.gif").read_bytes())
    assert empty.state.name == "hop-2" and (empty.state.folder / "hop-2.gif").exists()


@pytest.mark.parametrize(
    ("name", "data", "must"),
    [
        ("broken.mp4", b"no video at all" * 700, "broken.mp4"),
        ("broken.gif", b"GIF89a" + bytes(9000), "broken.gif"),
        ("broken.bvh", b"HIERARCHY\nnonsense" * 500, "broken.bvh"),
        ("empty.mp4", b"", "empty"),
        ("bunny.svg", b"<svg/>", "open a clip first"),
        ("../out.mp4", b"x", "a file to load must be"),
        ("/etc/out.mp4", b"x", "a file to load must be"),
        ("a/b.mp4", b"x", "a file to load must be"),
        ("..\\out.mp4", b"x", "a file to load must be"),
        ("nul\0.mp4", b"x", "a file to load must be"),
        (".mp4", b"x", "a file to load must be"),
        ("ü" * 150 + ".mp4", b"x", "a file to load must be"),
        ("run.sh", b"x", "a file to load must be"),
    ],
)
def test_what_cannot_be_is_refused_in_a_sentence_and_nothing_of_it_is_left(empty, name, data, must):
    before = empty.state
    said = loaded(empty, name, data)
    assert said["kind"] == "refused" and must in said["sentence"] and ".upload" not in said["sentence"]
    assert empty.state is before and list(empty.state.folder.iterdir()) == []


def test_a_clip_in_the_folder_that_cannot_be_read_is_refused_and_nothing_is_closed(empty, hop, clip):
    loaded(empty, "hop.mp4", clip.read_bytes())
    (empty.state.folder / "broken.mp4").write_bytes(b"no video" * 100)
    assert "broken.mp4" in hop.refused(empty, {"do": "folder.open", "file": "broken.mp4"})
    assert empty.state.name == "hop"


def test_what_is_called_off_leaves_nothing(empty, hop):
    hop.done(empty, "folder.load", name="hop.mp4", at=0, data=base64.b64encode(b"begun").decode(), last=False)
    assert names(empty.state.folder) == [".upload-hop.mp4"]
    hop.done(empty, "folder.drop", name="hop.mp4")
    assert names(empty.state.folder) == []


def test_what_a_closed_page_left_long_ago_goes_with_the_next_file(empty, hop, clip, monkeypatch):
    hop.done(empty, "folder.load", name="old.mp4", at=0, data=base64.b64encode(b"begun").decode(), last=False)
    loaded(empty, "hop.mp4", clip.read_bytes())
    assert ".upload-old.mp4" in names(empty.state.folder)
    monkeypatch.setattr(upload, "FORGOTTEN", -1)
    loaded(empty, "hop.mp4", clip.read_bytes())
    assert ".upload-old.mp4" not in names(empty.state.folder)


def test_a_file_larger_than_the_bound_is_refused_and_goes(empty, monkeypatch):
    monkeypatch.setattr(upload, "LARGEST", 10_000)
    assert "GB" in loaded(empty, "hop.mp4", bytes(20_000))["sentence"]
    assert names(empty.state.folder) == []


def test_a_clip_in_a_folder_below_is_opened_there_and_its_files_lie_beside_it(tmp_path, hop, clip):
    (tmp_path / "takes" / "one").mkdir(parents=True)
    (tmp_path / "takes" / "one" / "hop.mp4").write_bytes(clip.read_bytes())
    session = Session(tmp_path)
    hop.done(session, "folder.open", file="takes/one/hop.mp4")
    hop.done(session, "capture.box", part="character", frame=0, box=hop.around(0))
    assert session.state.name == "takes/one/hop" and session.state.folder == tmp_path.resolve()
    assert names(tmp_path) == ["takes/one/hop.mp4", "takes/one/hop.shot.toml"]
    box = session.state.shot.parts[0].box
    hop.done(session, "folder.close")
    assert {one["file"] for one in session.shown()["changed"]["folder"]["files"]} == {
        "takes/one/hop.mp4",
        "takes/one/hop.shot.toml",
    }
    hop.done(session, "folder.open", file="takes/one/hop.shot.toml")
    assert session.state.shot.parts[0].box == box
    hop.done(session, "reload")
    assert session.state.name == "takes/one/hop"
    session.close()


def test_motion_capture_in_a_folder_below_is_opened(tmp_path, hop):
    from fixtures import skeletons
    from mocap.skeletons.bvh import write_bvh
    from mocap.skeletons.skeleton import Skeleton, SkeletonMotion

    figure = skeletons.walk(0.2, 30.0)
    skeleton = Skeleton(figure.names, figure.parents, figure.offsets)
    (tmp_path / "moves").mkdir()
    motion = SkeletonMotion(skeleton, figure.translation, figure.rotation, 30.0)
    write_bvh(motion, tmp_path / "moves" / "walk.bvh")
    session = Session(tmp_path)
    hop.done(session, "folder.open", file="moves/walk.bvh")
    assert session.state.figure.motion is not None and session.state.figure.file == "moves/walk.bvh"
    session.close()


def test_a_folder_of_pictures_is_a_clip_from_outside_and_from_within(tmp_path, hop):
    import cv2

    (tmp_path / "walk").mkdir()
    for n in range(4):
        cv2.imwrite(str(tmp_path / "walk" / f"{n:04}.png"), hop.picture(n))
    for at, file, name in ((tmp_path, "walk", "walk"), (tmp_path / "walk", ".", "walk")):
        session = Session(at)
        hop.done(session, "folder.open", file=file)
        assert session.state.name == name and session.shown()["changed"]["capture"]["clip"]["frames"] == 4
        session.close()


def sheet(frames=12, across=4):
    """A sprite sheet (90, 80, 4): sprites of SPRITE with a blob each, whose place differs."""
    width, height = SPRITE
    picture = np.zeros((height * (frames // across), width * across, 4), np.uint8)
    for n in range(frames):
        y, x = divmod(n, across)
        picture[y * height + 4 : y * height + 22, x * width + 3 + n % 2 : x * width + 15] = (200, 90, 40, 255)
    return picture


def test_the_size_of_a_sheet_s_drawings_is_seen_and_a_sheet_is_opened_with_it(empty, hop):
    import cv2

    data = cv2.imencode(".png", sheet())[1].tobytes()
    assert loaded(empty, "run.png", data)["kind"] == "done" and not empty.state.name
    (seen,) = empty.act({"look": "folder.arrived", "name": "run.png"})
    told = json.loads(seen["data"])
    assert told == {"file": "run.png", "still": True, "width": 80, "height": 90, "tile": list(SPRITE)}
    hop.done(empty, "folder.open", file="run.png", tile=SPRITE)
    assert empty.shown()["changed"]["capture"]["clip"]["frames"] == 12
    hop.done(empty, "capture.box", part="character", frame=0, box=[2, 2, 16, 24])
    assert read_shot(empty.state.folder / "run.shot.toml").tile == SPRITE


def test_a_sheet_s_grid_is_found_on_a_coloured_ground_and_one_drawing_is_the_whole():
    drawn = sheet()
    on_white = np.where(drawn[..., 3:] > 0, drawn[..., :3], 255).astype(np.uint8)
    assert sheets.tile_of(drawn) == SPRITE and sheets.tile_of(on_white) == SPRITE
    assert sheets.tile_of(np.zeros((50, 60, 3), np.uint8)) == (60, 50)
    assert sheets.tile_of(np.full((50, 60, 4), 255, np.uint8)) == (60, 50)
