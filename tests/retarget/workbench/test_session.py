"""The workbench without a screen: messages in, events out, and what lies on disk."""

import numpy as np
import pytest

from capture.pictures.shot import Part, read_shot
from retarget.workbench.session import Session


def test_every_action_is_on_disk_when_it_is_answered(hop, session, folder):
    hop.done(session, "capture.box", part="character", frame=3, box=[10, 20, 60, 50])
    (part,) = read_shot(folder / "hop.shot.toml").parts
    assert part.box == (10, 20, 60, 50) and part.keys[0].frame == 3


def test_a_look_changes_nothing_and_writes_nothing(session, folder):
    before = sorted(folder.iterdir())
    (seen,) = session.act({"look": "capture.frame", "frame": 7, "id": 5})
    assert seen["kind"] == "seen" and seen["id"] == 5 and seen["type"] == "image/jpeg"
    assert sorted(folder.iterdir()) == before and session.revision == 0


def test_a_frame_looks_like_the_clip_s(hop, session):
    import cv2

    (seen,) = session.act({"look": "capture.frame", "frame": 7})
    shown = cv2.cvtColor(cv2.imdecode(np.frombuffer(seen["data"], np.uint8), cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB)
    assert np.abs(shown.astype(int) - hop.picture(7)).mean() < 2


def test_the_matte_covers_what_was_drawn(hop, session):
    import cv2

    hop.done(session, "capture.box", part="character", frame=0, box=hop.around(0))
    (seen,) = session.act({"look": "capture.matte", "part": "character"})
    alpha = cv2.imdecode(np.frombuffer(seen["data"], np.uint8), cv2.IMREAD_UNCHANGED)[..., 3] > 127
    truth = np.abs(hop.picture(0).astype(int) - (226, 236, 242)).sum(axis=-1) > 60
    assert (alpha & truth).sum() / (alpha | truth).sum() > 0.9


def test_undo_and_redo_bring_back_the_state_and_its_file(hop, session, folder):
    hop.done(session, "capture.box", part="character", frame=0, box=[10, 20, 60, 50])
    one = (folder / "hop.shot.toml").read_text()
    hop.done(session, "capture.outline", part="character", frame=2, points=hop.ring(2))
    two = (folder / "hop.shot.toml").read_text()
    hop.done(session, "undo")
    assert (folder / "hop.shot.toml").read_text() == one
    hop.done(session, "redo")
    assert (folder / "hop.shot.toml").read_text() == two != one
    hop.done(session, "undo")
    hop.done(session, "undo")
    assert not (folder / "hop.shot.toml").exists()  # as it was before anything was done
    assert session.act({"do": "undo"})[-1]["kind"] == "done"  # nothing to undo is no error


def test_what_was_undone_is_gone_when_something_else_is_done(hop, session):
    for name in ("arm", "leg"):
        hop.done(session, "capture.add_part", name=name)
    hop.done(session, "undo")
    hop.done(session, "capture.add_part", name="hat")
    hop.done(session, "redo")
    assert [part.name for part in session.state.shot.parts] == ["character", "arm", "hat"]


def test_a_drag_is_one_step_and_ends_where_the_hand_ended(hop, session):
    hop.done(session, "capture.outline", part="character", frame=0, points=hop.ring())
    start = hop.outline_of(session)
    for step in range(1, 9):
        to = [float(v) for v in start[5] + (step, 2 * step)]
        drag = {"part": "character", "key": "rest", "index": 5, "to": to, "reach": 20, "gesture": "g1"}
        hop.done(session, "capture.drag_point", **drag)
    moved = hop.outline_of(session)
    assert np.allclose(moved[5], start[5] + (8, 16), atol=1e-3)
    hop.done(session, "undo")
    assert np.array_equal(hop.outline_of(session), start)
    hop.done(session, "capture.drag_point", **{**drag, "gesture": "g2"})  # all at once comes to the same
    assert np.array_equal(hop.outline_of(session), moved)


def test_a_drag_that_does_not_end_is_on_disk_within_a_second(hop, session, folder):
    hop.done(session, "capture.outline", part="character", frame=0, points=hop.ring())
    before = (folder / "hop.shot.toml").read_text()
    drag = {"part": "character", "key": "rest", "index": 0, "to": [90.0, 130.0], "gesture": "g"}
    hop.done(session, "capture.drag_point", **drag)
    assert (folder / "hop.shot.toml").read_text() == before  # not for every place that it comes through
    hop.until(lambda: (folder / "hop.shot.toml").read_text() != before, seconds=1)
    assert read_shot(folder / "hop.shot.toml").parts == session.state.shot.parts


def test_an_outline_drawn_in_another_frame_gets_the_points_of_the_first(hop, session):
    hop.done(session, "capture.outline", part="character", frame=0, points=hop.ring(0))
    turned = hop.ring(9)[13:] + hop.ring(9)[:13]  # begun elsewhere
    hop.done(session, "capture.outline", part="character", frame=9, points=turned)
    first, second = hop.outline_of(session, 0), hop.outline_of(session, 1)
    assert first.shape == second.shape
    which = [
        np.linalg.norm(np.array(hop.ring(t))[:, None] - line, axis=-1).argmin(axis=0)
        for t, line in ((0, first), (9, second))
    ]
    apart = np.abs(which[0] - which[1])
    assert np.minimum(apart, hop.points - apart).max() <= 2  # the same place of the bean, to a twentieth of its length


@pytest.mark.parametrize(
    "message",
    [
        {"do": "capture.box"},
        {"do": "capture.box", "part": "character", "frame": 0, "box": [1, 2, 3]},
        {"do": "capture.box", "part": "character", "frame": -1, "box": [1, 2, 30, 40]},
        {"do": "capture.box", "part": "nobody", "frame": 0, "box": [1, 2, 30, 40]},
        {"do": "capture.box", "part": "character", "frame": 0, "box": [1, 2, 30, 40], "more": 1},
        {"do": "capture.box", "part": "character", "frame": 0, "box": [1e300, 2, 30, 40]},
        {"do": "capture.outline", "part": "character", "frame": 0, "points": []},
        {"do": "capture.outline", "part": "character", "frame": 0, "points": [[1, 1], [2, 2], [3, 3]]},
        {"do": "capture.drag_point", "part": "character", "key": "rest", "index": 4, "to": [1, 2]},
        {"do": "capture.fix_frame", "part": "character", "frame": 3},
        {"do": "capture.remove_key", "part": "character", "key": "rest"},
        {"do": "capture.stretch", "start": 5, "stop": 5},
        {"do": "capture.__class__"},
        {"look": "capture.frame", "frame": 10**6},
        {"look": "capture.captured", "part": "character"},
        {"work": "capture.capture"},
        {"work": "capture.nothing"},
    ],
)
def test_what_cannot_be_done_is_refused_in_a_sentence_and_changes_nothing(hop, session, folder, message):
    before = sorted(folder.iterdir())
    sentence = hop.refused(session, message)
    assert len(sentence) > 20 and "Traceback" not in sentence and "fault of tooncap" not in sentence
    assert sorted(folder.iterdir()) == before


def test_a_file_that_another_program_changed_is_left_alone_and_read_again_on_demand(hop, session, folder):
    hop.done(session, "capture.box", part="character", frame=0, box=[10, 20, 60, 50])
    other = (folder / "hop.shot.toml").read_text().replace("60.0", "61.0")
    (folder / "hop.shot.toml").write_text(other)
    events = hop.done(session, "capture.box", part="character", frame=0, box=[10, 20, 70, 50])
    assert any(event["kind"] == "told" and "another program" in event["sentence"] for event in events)
    assert (folder / "hop.shot.toml").read_text() == other
    hop.done(session, "reload")
    assert session.state.shot.parts[0].box == (10, 20, 61, 50)
    hop.done(session, "undo")  # and what was done here meanwhile is not lost either
    assert read_shot(folder / "hop.shot.toml").parts[0].box == (10, 20, 70, 50)


def test_all_pages_hear_the_same_and_a_new_one_sees_all(hop, session):
    first, second = [], []
    ends = session.listen(first.append)
    session.listen(second.append)
    hop.done(session, "capture.add_part", name="hat")
    ends()
    hop.done(session, "capture.add_part", name="arm")
    assert first == second[:1] and len(second) == 2
    assert second[0]["changed"]["capture"]["parts"][1]["name"] == "hat"
    assert [part["name"] for part in session.shown()["changed"]["capture"]["parts"]] == ["character", "hat", "arm"]


def test_only_what_changed_is_sent(hop, session):
    heard = []
    session.listen(heard.append)
    hop.done(session, "capture.add_part", name="hat")
    assert set(heard[0]["changed"]) == {"capture"} and set(heard[0]["changed"]["capture"]) == {"parts"}


def test_parts_that_hung_on_a_removed_one_hang_on_what_it_hung_on(hop, session):
    for name, parent in (("torso", ""), ("arm", "torso"), ("hand", "arm")):
        hop.done(session, "capture.add_part", name=name)
        hop.done(session, "capture.hang_part", part=name, parent=parent)
    hop.done(session, "capture.remove_part", part="arm")
    hop.done(session, "capture.rename_part", part="torso", to="chest")
    assert {part.name: part.parent for part in session.state.shot.parts}["hand"] == "chest"
    assert "hang on itself" in hop.refused(session, {"do": "capture.hang_part", "part": "chest", "parent": "hand"})


def test_opening_something_else_keeps_what_was_done_and_begins_a_new_past(hop, session, folder):
    (folder / "jump.mp4").write_bytes((folder / "hop.mp4").read_bytes())
    hop.done(session, "capture.add_part", name="hat")
    hop.done(session, "folder.open", file="jump.mp4")
    assert session.state.name == "jump" and not session.history.past
    hop.done(session, "folder.open", file="hop.shot.toml")
    assert [part.name for part in session.state.shot.parts] == ["character", "hat"]


def test_a_page_gets_every_field_of_a_part_also_of_one_read_from_a_file(folder):
    (folder / "other.shot.toml").write_text('clip = "hop.mp4"\n[[parts]]\nname = "bean"\n[[parts.keys]]\nframe = 2\n')
    (part,) = Session(folder, "other.shot.toml").shown()["changed"]["capture"]["parts"]
    assert set(part) == set(Part.__dataclass_fields__) and part["box"] is None and list(part["inside"]) == []
    assert set(part["keys"][0]) == {"name", "frame", "outline"}


def test_a_stretch_may_begin_anywhere_until_a_key_is_drawn_outside_it(hop, session):
    hop.done(session, "capture.stretch", start=4, stop=20)
    assert (session.state.shot.start, session.state.shot.stop) == (4, 20)
    hop.done(session, "capture.outline", part="character", frame=6, points=hop.ring(6))
    assert "character rest" in hop.refused(session, {"do": "capture.stretch", "start": 8})
    hop.done(session, "capture.stretch", start=0)
    assert session.state.shot.stop is None
