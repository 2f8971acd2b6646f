"""A body's joints dragged: they begin where the source's are, move as told, and what was not told stays the source's."""

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest

from capture.motion import affine, keys, tracks
from capture.motion.tracks import CartoonMotion, Track
from retarget.workbench.session import Session
from retarget.workbench.staging import limbs
from retarget.workbench.staging.staged import played_of

SVG = """<svg xmlns="http://www.w3.org/2000/svg" width="320" height="240">
<path d="M60 90 L160 90 L160 130 L60 130 Z" fill="#a06040"/>
<path d="M150 95 L260 95 L260 125 L150 125 Z" fill="#40a060"/></svg>"""
FRAMES = 7


def bar(x0, x1, y0, y1, steps=12):
    """A bar's outline (4 steps, 2)."""
    corners = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]], float)
    share = np.arange(steps)[:, None] / steps
    return np.concatenate([a + share * (b - a) for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)])


def arm():
    """An upper arm that stays, and a lower arm that turns about the elbow at (160, 110)."""
    outlines = {"upper": bar(60, 160, 90, 130), "lower": bar(150, 260, 95, 125)}
    pivots = {"upper": np.array([70.0, 110]), "lower": np.array([160.0, 110])}
    sets = [keys.keyset(("rest",), outline[None], spacing=12.0) for outline in outlines.values()]
    made = []
    for (part, pivot), source in zip(pivots.items(), sets, strict=True):
        turns = np.linspace(0, 0.0 if part == "upper" else 0.8, FRAMES)
        maps = np.stack([np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0]]) for a in turns])  # about it
        fields = {"pivot": pivot, "keys": ("rest",), "rows": source.rows, "affine": maps}
        fields |= {"weights": np.ones((FRAMES, 1)), "residual": np.zeros(FRAMES), "visible": np.ones(FRAMES, bool)}
        parent = "" if part == "upper" else "upper"
        made.append(Track(part, parent, held=np.zeros(FRAMES, bool), order=np.full(FRAMES, len(made)), **fields))
    return CartoonMotion(tuple(made), tuple(sets), np.arange(FRAMES) / 24, 24.0, (320, 240))


@pytest.fixture
def session(tmp_path, hop):
    tracks.save(arm(), tmp_path / "arm.motion.json")
    (tmp_path / "sleeve.svg").write_text(SVG, encoding="utf-8")
    opened = Session(tmp_path, "arm.motion.json")
    hop.done(opened, "stage.play", files=["sleeve.svg"])
    yield opened
    opened.close()


def who(session):
    (body,) = session.state.cast.bodies
    return body.drawing


def seen(session):
    (event,) = session.act({"look": "stage.body", "who": who(session)})
    assert event["kind"] == "seen", event
    picture = cv2.imdecode(np.frombuffer(event["data"], np.uint8), cv2.IMREAD_COLOR)
    assert picture.shape == (240, 320, 3)
    return {limb["part"]: limb for limb in json.loads(json.dumps(event["limbs"]))}


def test_untold_joints_are_shown_where_the_source_s_are_on_the_drawing(session):
    found = seen(session)
    assert found["lower"]["joint"] == pytest.approx([160, 110], abs=0.5)
    assert found["upper"]["joint"] == pytest.approx([70, 110], abs=0.5)
    assert not any(limb["told"] or limb["end"] for limb in found.values())


def test_a_dragged_joint_is_where_the_part_turns_and_is_taken_back(session, hop):
    def center():
        """The place that stays while the lower arm's end turns."""
        (role,) = played_of(session.state).performance.roles
        points = role.mesh()
        end = points[0, :, 0] > 235
        moved = affine.fit_similarity(points[0, end], points[-1, end])
        return np.linalg.solve(np.eye(2) - moved[:, :2], moved[:, 2])

    hop.done(session, "stage.ground", on=False)  # an arm has no feet
    hop.done(session, "stage.joint", who=who(session), part="lower", to=[200.0, 110.0])
    assert seen(session)["lower"] == {"part": "lower", "joint": [200, 110], "end": None, "told": True}
    assert center() == pytest.approx([200, 110], abs=1)
    assert [limb.pivot for limb in session.state.cast.bodies[0].parts] == [None, (200, 110)]
    hop.done(session, "undo")
    assert center() == pytest.approx([160, 110], abs=1) and session.state.cast.bodies[0].parts == ()


def test_limbs_with_lines_have_ends_that_can_be_dragged(session, hop):
    name = who(session)
    assert "must have a line" in hop.refused(
        session, {"do": "stage.joint", "who": name, "part": "lower", "to": [1, 2], "end": True}
    )
    hop.done(session, "stage.lines", who=name)
    found = seen(session)
    assert found["lower"]["joint"] == pytest.approx([160, 110], abs=0.5)
    assert found["lower"]["end"] == pytest.approx([250, 110], abs=1)  # as far beyond its middle, at 205
    hop.done(session, "stage.joint", who=name, part="lower", to=[240, 150], end=True)
    hop.done(session, "stage.joint", who=name, part="lower", to=[170, 112])
    (upper, lower) = session.state.cast.bodies[0].parts
    assert lower.line == ((170, 112), (240, 150)) and len(upper.line) == 2
    assert np.isfinite(played_of(session.state).performance.roles[0].points).all()


@pytest.mark.parametrize(
    ("message", "must"),
    [
        ({"do": "stage.joint", "part": "foot", "to": [1, 2]}, "must be one of upper, lower"),
        ({"do": "stage.joint", "who": "nobody", "part": "lower", "to": [1, 2]}, "a body must be one of"),
        ({"look": "stage.body", "who": "nobody"}, "a body must be one of"),
    ],
)
def test_what_cannot_be_is_refused_in_a_sentence(session, hop, message, must):
    assert must in hop.refused(session, {"who": who(session), **message})


def test_a_part_that_turns_about_its_middle_ends_at_its_farthest_point(session):
    motion = session.state.motion
    first = replace(motion.tracks[0], pivot=np.array([110.0, 110]))
    motion = replace(motion, tracks=(first, motion.tracks[1]))
    target = next(iter(played_of(session.state).performance.roles)).target
    joint, end = limbs._lines(target, motion)["upper"]
    assert np.linalg.norm(end - joint) > 45
