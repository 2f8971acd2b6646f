"""What a graphics card is given of a model: the same triangles, the same normals, points to the last digit."""

import msgspec
import numpy as np
import pytest

from capture.motion import tracks
from retarget.characters.models.mesh import surface_of
from retarget.characters.models.model import Material, Model
from retarget.workbench.session import Session
from retarget.workbench.staging import solids
from retarget.workbench.staging.staged import played_of

CUBE = "\n".join(
    [f"v {x} {y} {z}" for x in (-1, 1) for y in (0, 2) for z in (-1, 1)]
    + ["f 1 2 4 3", "f 5 7 8 6", "f 1 5 6 2", "f 3 4 8 7", "f 1 3 7 5", "f 2 6 8 4"]
)


def ball(around=24, rows=13):
    """A ball with a seam and two materials, and a square that stands off it."""
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, around + 1), np.linspace(0, np.pi, rows))
    points = np.stack([np.sin(v) * np.sin(u), np.cos(v), np.sin(v) * np.cos(u)], axis=-1).reshape(-1, 3)
    corner = (np.arange(rows - 1)[:, None] * (around + 1) + np.arange(around)).ravel()
    below = corner + around + 1
    faces = np.concatenate([np.stack([corner, below, below + 1], -1), np.stack([corner, below + 1, corner + 1], -1)])
    square = len(points) + np.array([[0, 1, 2], [0, 2, 3]])
    points = np.concatenate([points, [[1, 0, 0], [3, 0, 0], [3, 1, 1], [1, 1, 1]]])
    faces = np.concatenate([faces, square])
    number = np.arange(len(faces)) % 2
    looks = (Material((1.0, 0.0, 0.0, 1.0)), Material((0.0, 0.0, 1.0, 0.5)))
    return Model(points, faces, looks, number, np.random.default_rng(1).random((len(points), 2)))


def test_corners_give_back_every_triangle_in_its_material_with_its_normals():
    model = ball()
    surface = surface_of(model)
    found = solids.corners(surface)
    drawn = np.zeros(len(model.faces), int)
    sides = np.cross(*np.moveaxis(np.diff(model.points[model.faces], axis=1), 1, 0))
    wanted = {}  # by triangle: its material and the normals at its corners, as the exporting rasteriser has them
    normals = (surface.smooth @ sides).reshape(-1, 3, 3)
    for face, number, own in zip(model.faces, model.surface, normals, strict=True):
        wanted[tuple(face)] = number, own
    ours = np.cross(*np.moveaxis(np.diff(model.points[found.point[found.faces]], axis=1), 1, 0))
    for material, first, count in found.spans:
        for face in range(first, first + count):
            corners = found.faces[face]
            number, own = wanted[tuple(found.point[corners].tolist())]
            assert number == material
            mine = [ours[found.beside[found.first[c] : found.first[c + 1]]].sum(axis=0) for c in corners]
            np.testing.assert_allclose(mine, own, atol=1e-12)
            drawn[face] += 1
    assert (drawn == 1).all() and len(wanted) == len(drawn)
    assert (found.uv == model.uv[found.point].astype(np.float32)).all()


def test_only_hard_edges_cost_corners():
    model = ball()
    found = solids.corners(surface_of(model))
    assert len(found.point) < 1.3 * len(model.points)  # at the poles faces have no area, and so no side
    cube = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    quads = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    box = Model(cube, faces, (Material(),), np.zeros(12, int), np.zeros((8, 2)))
    assert len(solids.corners(surface_of(box)).point) == 24  # a corner of a box has three normals


@pytest.fixture
def session(tmp_path, by_hand, hop):
    tracks.save(by_hand.motion(by_hand.tumble(9), np.ones((9, 1)), ("sit",)), tmp_path / "hop.motion.json")
    (tmp_path / "cube.obj").write_text(CUBE, encoding="utf-8")
    opened = Session(tmp_path, "hop.motion.json")
    hop.done(opened, "stage.play", files=["cube.obj"])
    yield opened
    opened.close()


def look(session, what, **fields):
    (event,) = session.act({"look": f"stage.{what}", **fields})
    assert event["kind"] == "seen", event
    return event


def test_a_page_gets_the_performance_itself_piece_by_piece(session, monkeypatch):
    told = msgspec.json.decode(look(session, "space")["data"])
    (role,) = played_of(session.state).performance.roles
    assert told["size"] == [320, 240] and told["roles"][0]["solid"]
    assert told["ground"] == pytest.approx(np.percentile(role.mesh()[..., 1].max(axis=1), 95))
    count = look(session, "solid", who=0)["corners"]
    monkeypatch.setattr(solids, "PIECE", 12 * count * 4)  # four frames to a piece
    got = []
    while len(got) < 9:
        event = look(session, "places", who=0, first=len(got), count=1000)
        assert event["count"] <= 4 and len(event["data"]) <= solids.PIECE
        got += list(np.frombuffer(event["data"], np.float32).reshape(-1, count, 3))
    point = solids.corners(role.target.surface).point
    assert (np.array(got) == role.mesh()[:, point].astype(np.float32)).all()


@pytest.mark.parametrize(
    ("message", "must"),
    [
        ({"look": "stage.solid", "who": 1}, "there is no number 1"),
        ({"look": "stage.places", "who": 0, "first": 9}, "there is no frame 9"),
        ({"look": "stage.texture", "who": 0, "material": 0}, "must have a texture"),
        ({"look": "stage.texture", "who": 0, "material": 7}, "must have a texture"),
    ],
)
def test_what_is_not_there_is_refused_in_a_sentence(session, hop, message, must):
    assert must in hop.refused(session, message)


def test_a_drawing_alone_is_what_it_is_in_the_whole(session, hop, worm):
    hop.done(session, "stage.play", files=[worm[0].name])
    import cv2

    alone = cv2.imdecode(np.frombuffer(look(session, "flat", who=0, frame=3)["data"], np.uint8), cv2.IMREAD_UNCHANGED)
    whole = cv2.imdecode(np.frombuffer(look(session, "frame", frame=3)["data"], np.uint8), cv2.IMREAD_UNCHANGED)
    alpha = alone[..., 3:] / 255.0
    assert np.abs(alone[..., :3] * alpha + 255 * (1 - alpha) - whole[..., :3]).max() <= 1
    assert "must be a model" in hop.refused(session, {"look": "stage.solid", "who": 0})
