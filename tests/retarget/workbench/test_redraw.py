"""Keys corrected by hand: a stroke drawn anew goes where the pen went, the rest stays, and all keys still correspond."""

import json

import numpy as np
import pytest

from capture.motion import affine, tracks
from retarget.characters.drawings import paths
from retarget.characters.drawings.paths import DrawnPath
from retarget.characters.drawings.svg import read_svg
from retarget.workbench.session import Session
from retarget.workbench.staging import redraw
from retarget.workbench.staging.staged import played_of

ROUND = 4 / 3 * np.tan(np.pi / 8)  # how far control points of a quarter of a circle stand off, in radii


def circle(center, radius, closed=True):
    """A circle, or an arc open at its end, as four quarters (13, 2)."""
    turns = np.arange(4)[:, None] * np.pi / 2
    a, b = np.array([np.cos(turns), np.sin(turns)]), np.array([-np.sin(turns), np.cos(turns)])
    a, b = a[..., 0].T, b[..., 0].T
    quarters = np.stack([a, a + ROUND * b, np.roll(a, -1, 0) - ROUND * np.roll(b, -1, 0)], axis=1).reshape(-1, 2)
    points = center + radius * np.vstack([quarters, quarters[:1]])
    return DrawnPath("ring", "MCCCCZ", points, np.array([0, 13]), np.array([closed]))


def spline(points):
    """An open wave (10, 2) through four places, in three curves."""
    return DrawnPath("wave", "MCCC", np.asarray(points, float), np.array([0, 10]), np.array([False]))


WAVE = spline([[x, 100 + 20 * np.sin(x / 30)] for x in np.linspace(0, 180, 10)])


def line_of(path):
    return paths.flatten(path, 40)[0]


def away(line, other):
    """How far the places of a line lie from another line's, at most."""
    return max(np.linalg.norm(other - place, axis=1).min() for place in line)


@pytest.mark.parametrize("start", [0.0, 2.0])
@pytest.mark.parametrize("way", [1, -1])
def test_a_closed_stroke_drawn_round_becomes_what_was_drawn_and_begins_where_it_began(start, way):
    angle = start + way * np.linspace(0, 2 * np.pi, 300)
    drawn = np.array([104, 97]) + np.column_stack([60 * np.cos(angle), 30 * np.sin(angle)])
    (made,) = redraw.redrawn([circle([100, 100], 40)], 0, drawn)
    assert made.points.shape == (13, 2) and made.commands == "MCCCCZ"
    assert away(line_of(made), drawn) < 1.0 and away(drawn, line_of(made)) < 1.5
    assert np.linalg.norm(made.points[0] - made.points[-1]) < 1e-9
    assert made.points[0] == pytest.approx([164, 97], abs=6)  # the old one began at its right too
    assert made.points[3][1] > 110  # and went on downwards


def test_a_stretch_drawn_anew_changes_only_the_curves_it_lies_on():
    t = np.linspace(0, 1, 60)
    arc = np.column_stack([100 + 40 * np.cos(0.2 + 1.1 * t), 100 + 40 * np.sin(0.2 + 1.1 * t)])
    out = arc + 12 * np.sin(np.pi * t)[:, None] * (arc - 100) / 40
    ring = circle([100, 100], 40)
    for drawn in (out, out[::-1]):
        (made,) = redraw.redrawn([ring], 0, drawn)
        assert away(out, line_of(made)) < 4 < 11 < away(out, line_of(ring))  # as near as one curve can
        assert (made.points[3:-1] == ring.points[3:-1]).all()  # three of the four quarters
        assert away(line_of(made)[45:], line_of(ring)) < 1e-6


def test_a_stretch_over_where_a_closed_stroke_begins_leaves_it_closed():
    angle = np.linspace(-0.6, 0.6, 80)
    out = 100 + (40 + 10 * np.cos(angle / 0.6 * np.pi / 2))[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    (made,) = redraw.redrawn([circle([100, 100], 40)], 0, out)
    assert np.linalg.norm(made.points[0] - made.points[-1]) < 1e-9
    assert made.points[0] == pytest.approx([150, 100], abs=0.5)


def test_an_open_stroke_keeps_its_ends_where_the_pen_does_not_go():
    new = np.column_stack([np.linspace(62, 118, 50), 100 - 10 * np.sin(np.linspace(0, np.pi, 50))])
    (made,) = redraw.redrawn([WAVE], 0, new)
    assert (made.points[:1] == WAVE.points[:1]).all() and (made.points[-1:] == WAVE.points[-1:]).all()
    assert np.abs(made.points - WAVE.points).max() > 5


def test_of_a_path_with_holes_the_ring_under_the_pen_is_drawn_anew():
    outer, inner = circle([100, 100], 40), circle([100, 100], 15)
    both = DrawnPath(
        "o", "MCCCCZMCCCCZ", np.vstack([outer.points, inner.points]), np.array([0, 13, 26]), np.array([True, True])
    )
    angle = np.linspace(0, 2 * np.pi, 200)
    (made,) = redraw.redrawn([both], 0, 100 + 20 * np.column_stack([np.cos(angle), np.sin(angle)]))
    assert (made.points[:13] == outer.points).all()
    assert np.allclose(np.linalg.norm(made.points[13::3] - 100, axis=1), 20, atol=0.5)


@pytest.fixture
def session(tmp_path, by_hand, worm, hop):
    lean = np.linspace(0, 1, 8)
    motion = by_hand.motion(by_hand.tumble(8), np.column_stack([1 - lean, lean]))
    tracks.save(motion, tmp_path / "hop.motion.json")
    opened = Session(tmp_path, "hop.motion.json")
    hop.done(opened, "stage.play", files=[file.name for file in worm])
    yield opened
    opened.close()


def look(session, what, **fields):
    (event,) = session.act({"look": f"stage.{what}", **fields})
    assert event["kind"] == "seen", event
    return event


@pytest.mark.parametrize("what", ["pull", "draw"])
def test_a_key_with_lines_and_arcs_still_plays_once_it_was_corrected(session, hop, what):
    folder = session.state.folder
    before = {file.name: file.read_bytes() for file in folder.glob("*.svg")}
    strokes = json.loads(look(session, "strokes", part="egg", key="lean")["data"])
    if what == "draw":  # its body, half as wide again
        body = np.array(strokes[0][0])
        wider = body.mean(axis=0) + (body - body.mean(axis=0)) * [1.5, 1.0]
        hop.done(session, "stage.draw", part="egg", key="lean", stroke=0, line=wider.tolist())
    else:
        hop.done(session, "stage.pull", part="egg", key="lean", at=[180, 110], to=[200, 100], reach=60)
    keys = session.state.cast.parts[0].keys
    assert keys[1].drawing == "worm_lean.edit1.svg"
    assert {name: (folder / name).read_bytes() for name in before} == before
    role = played_of(session.state).performance.roles[0]  # both keys have the same commands again
    assert np.isfinite(role.points).all()
    if what == "draw":
        made = read_svg(folder / keys[1].drawing)[0][0]
        assert np.ptp(line_of(made)[:, 0]) == pytest.approx(1.5 * np.ptp(body[:, 0]), rel=0.05)
    hop.done(session, "undo")
    names = [key.drawing.rpartition("/")[2] for key in session.state.cast.parts[0].keys]
    assert names == ["worm_sit.svg", "worm_lean.svg"]


def test_what_was_corrected_is_no_drawing_to_be_chosen(session, hop):
    hop.done(session, "stage.pull", part="egg", key="lean", at=[180, 110], to=[200, 100], reach=60)
    offers = session.shown()["changed"]["stage"]["offers"]
    own = [file for offer in offers for file in offer["files"] if not file.startswith("built-in:")]
    assert sorted(own) == ["worm_lean.svg", "worm_sit.svg"]


@pytest.mark.parametrize(
    ("fields", "must"),
    [
        ({"stroke": 99, "line": [[0, 0], [1, 1], [5, 5]]}, "there is no stroke 99"),
        ({"stroke": 0, "line": [[5, 5], [5, 5]]}, "must be drawn over some way"),
        ({"stroke": 0, "line": [[5, 5]]}, "draw: "),
        ({"stroke": 3, "line": [[0, 0], [-50, 0], [-50, 90], [0, 40]]}, "must run along the line"),
    ],
)
def test_a_stroke_that_cannot_be_drawn_is_refused_in_a_sentence(session, hop, fields, must):
    assert must in hop.refused(session, {"do": "stage.draw", "part": "egg", "key": "sit", **fields})


def test_a_picture_s_outlines_come_into_the_hand_as_they_were(session, hop):
    import cv2

    picture = np.zeros((200, 160, 4), np.uint8)
    cv2.ellipse(picture, (80, 100), (50, 80), 10, 0, 360, (60, 120, 200, 255), -1)
    cv2.imwrite(str(session.state.folder / "egg.png"), picture)
    hop.done(session, "stage.play", files=["egg.png"])
    before = played_of(session.state).performance.roles[0]
    hop.done(session, "stage.outlines", part="egg")
    keys = session.state.cast.parts[0].keys
    assert len(keys) == 2 and len(keys[0].outline) == len(keys[1].outline) > 30
    after = played_of(session.state).performance.roles[0]
    assert np.abs(after.mesh().mean(axis=1) - before.mesh().mean(axis=1)).max() < 2  # but for the outline's soft border
    x, y = keys[1].outline[7]
    hop.done(session, "stage.drag_point", part="egg", key="lean", index=7, to=[x + 9, y], reach=0.0)
    assert session.state.cast.parts[0].keys[1].outline[7] == pytest.approx((x + 9, y))
    hop.done(session, "undo"), hop.done(session, "undo")
    assert session.state.cast.parts[0].keys[1].outline == ()
    sentence = hop.refused(session, {"do": "stage.outlines", "part": "leg"})
    assert "must be played by a picture" in sentence


def test_a_key_in_small_shows_the_source_s_and_its_own(session):
    import cv2

    def small(**fields):
        data = look(session, "thumb", part="egg", **fields)["data"]
        return cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)

    source, own = small(key="lean", of="source"), small(key="lean")
    assert max(source.shape) <= 161 and max(own.shape) <= 160
    inked = (source < 200).any(axis=2)
    height, width = np.ptp(np.nonzero(inked), axis=1) + 1
    lean = session.state.motion.keyset("egg")
    outline = affine.apply(lean.removed, lean.points)[1, lean.outline]
    assert width / height == pytest.approx(np.ptp(outline[:, 0]) / np.ptp(outline[:, 1]), rel=0.05)
    assert (own != 255).any() and (small(key="sit").shape != own.shape or (small(key="sit") != own).any())
