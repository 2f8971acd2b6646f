"""Every kind of character in every kind of file: written, and found in it where it plays; or refused in a sentence."""

import json
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

from capture.errors import InputError
from capture.fit import action
from capture.motion import affine
from capture.pictures.decode import read_clip
from capture.pictures.encode import write_clip
from retarget.characters.bend import read_bent
from retarget.characters.drawing import read_drawing
from retarget.characters.mesh import read_mesh
from retarget.characters.meshfiles import read_model
from retarget.characters.picture import read_picture
from retarget.characters.puppet import KeyPose, read_puppet
from retarget.export import formats
from retarget.export.bodies import bodies, stage_to_space
from retarget.stage import draw2d
from retarget.stage.perform import perform

FRAMES = 5
SQUARE = np.array([(10, 10), (50, 10), (50, 50), (10, 50)], float)
KINDS = ("drawing", "still picture", "bent picture", "two pictures", "model", "figure", "stretched figure", "bent")
VECTOR, STILL = ("drawing", "bent"), ("drawing", "bent", "still picture")
HOLDS = {  # which kinds each file can hold; the rest is refused
    "a.json": STILL,
    "a.svg": STILL,
    "a.jsx": VECTOR,
    "0000.svg": KINDS,
    "a.glb": KINDS,
    "a.gltf": KINDS,
    "a.usda": KINDS,
}


def solid(folder, name, top):
    """A box of 2 x 3 x 1, its top moved aside."""
    corners = [(x + top * (y > 0), y, z) for x in (0, 2) for y in (0, 3) for z in (0, 1)]
    faces = ("1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4")
    text = "".join(f"v {x} {y} {z}\n" for x, y, z in corners) + "".join(f"f {face}\n" for face in faces)
    (folder / name).write_text(text)
    return folder / name


@pytest.fixture
def playing(tmp_path, by_hand, worm, arm):
    """A performance of each kind of character."""
    names, box = by_hand.names, np.zeros((60, 60, 4), np.uint8)
    box[10:50, 10:50] = (200, 40, 40, 255)
    files = [tmp_path / "one.png", tmp_path / "two.png"]
    for file, green in zip(files, (40, 160), strict=True):
        box[10:50, 10:50, 1] = green
        Image.fromarray(box).save(file)
    leans = [SQUARE, SQUARE + [[0, 0], [12, 0], [0, 0], [0, 0]]]
    weights = np.array([[1, 0], [0.6, 0.4], [0, 1], [-0.2, 1.2], [0.3, 0.7]])
    middle = np.array([160.0, 140.0])  # turned about it, all stay on the page
    moved = by_hand.motion(by_hand.tumble(FRAMES), weights, pivot=middle)
    alone = by_hand.motion(by_hand.tumble(FRAMES), np.ones((FRAMES, 1)), names=names[:1], pivot=middle)

    def figure():
        return read_puppet("egg", names, arm.file, [KeyPose("wave", 0.0), KeyPose("wave", 0.9)])

    def stretched():
        scale = figure().scale.copy()
        scale[1, 3] = (1.0, 1.6, 0.8)  # the elbow of the second key
        return replace(figure(), scale=scale)

    def swaying():
        up = np.linspace(0, 1, 30)
        lines = [np.stack([160 + 40 * t * up**2, 200 - 100 * up], -1) for t in range(FRAMES)]
        motion = action.capture_line(np.array(lines), part="egg")
        return perform(motion, [read_bent("egg", motion.keysets[0], worm[0])])

    made = {
        "drawing": lambda: perform(moved, [read_drawing("egg", names, worm)]),
        "still picture": lambda: perform(alone, [read_picture("egg", names[:1], files[:1], [SQUARE])]),
        "bent picture": lambda: perform(moved, [read_picture("egg", names, [files[0]] * 2, leans)]),
        "two pictures": lambda: perform(moved, [read_picture("egg", names, files, leans)]),
        "model": lambda: perform(
            moved, [read_mesh("egg", names, [solid(tmp_path, "a.obj", 0), solid(tmp_path, "b.obj", 1)])]
        ),
        "figure": lambda: perform(moved, [figure()]),
        "stretched figure": lambda: perform(moved, [stretched()]),
        "bent": swaying,
    }
    return lambda kind: made[kind]()


def written(performance, folder, name):
    """Write a file as the command would; returns its path."""
    path = folder / "made" / name
    (formats.bodies(path) or formats.drawings(path))(performance, path)
    return path


@pytest.mark.parametrize("name", HOLDS)
@pytest.mark.parametrize("kind", KINDS)
def test_a_character_is_in_the_file_or_the_file_is_refused(playing, tmp_path, kind, name):
    if name.startswith("a.usd"):
        pytest.importorskip("pxr", reason="USD needs the extra usd")
    performance = playing(kind)
    if kind not in HOLDS[name]:
        with pytest.raises(
            InputError, match=r"^part 'egg': .* can hold .*, this part is played by a .*: make a "
        ) as told:
            written(performance, tmp_path, name)
        assert ("3-D model" in str(told.value)) == (kind in ("model", "figure", "stretched figure"))
        assert not (tmp_path / "made").exists()
        return
    path = written(performance, tmp_path, name)
    if name == "a.json":
        told = json.loads(path.read_text())
        assert [layer["nm"] for layer in told["layers"]] == ["egg"] and told["op"] == FRAMES
    elif name == "a.jsx":
        assert '"name":"egg"' in path.read_text()
    elif name == "a.svg":
        (group,) = ElementTree.parse(path).getroot()
        assert group.get("data-name") == "egg"
        assert sum(not one.tag.endswith("Gradient") for one in group) == len(performance.posed(0))
    elif name == "0000.svg":
        assert sorted(file.name for file in path.parent.iterdir()) == [f"{t:04d}.svg" for t in range(FRAMES)]
        assert all(len(ElementTree.parse(file).getroot()) == 1 for file in path.parent.iterdir())
    elif name in ("a.glb", "a.gltf"):
        assert len(read_model(path).faces) == sum(
            len(body.faces) * max(1, len(body.looks)) for body in bodies(performance)
        )


@pytest.mark.parametrize("kind", KINDS)
def test_what_usd_plays_is_what_is_on_the_stage(playing, tmp_path, kind):
    """As usd-core bakes it: of models, figures and pictures every point, of drawings the box of what is seen."""
    pytest.importorskip("pxr", reason="USD needs the extra usd")
    from pxr import Usd, UsdGeom, UsdSkel

    performance = playing(kind)
    stage = Usd.Stage.Open(str(written(performance, tmp_path, "a.usda")))
    assert UsdSkel.BakeSkinning(stage.Traverse())
    meshes = [UsdGeom.Mesh(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    (role,), height = performance.roles, performance.size[1]
    for t in range(FRAMES):
        there = []
        for mesh in meshes:
            world = np.array(UsdGeom.XformCache(t).GetLocalToWorldTransform(mesh.GetPrim()))
            if abs(np.linalg.det(world)) > 1e-12:  # else it is another picture's turn
                there.append(np.array(mesh.GetPointsAttr().Get(t), float) @ world[:3, :3] + world[3, :3])
        there = np.concatenate(there)[:, :2]
        if kind in VECTOR:
            rows, columns = np.nonzero(draw2d.draw(performance, t)[..., 3])
            corners = np.array([(columns.min(), rows.max()), (columns.max(), rows.min())])
            low, high = affine.apply(stage_to_space(performance.size), corners)
            assert (there.min(axis=0) < low).all() and (there.max(axis=0) > high).all()
            assert max(low - there.min(axis=0)) < 12 / height and max(there.max(axis=0) - high) < 12 / height
        else:
            used = np.unique(role.target.keys.faces)
            truth = affine.apply(stage_to_space(performance.size), role.points[t, used, :2])
            away = np.linalg.norm(there[:, None] - truth, axis=-1)
            assert away.min(axis=1).max() < 2e-5 and away.min(axis=0).max() < 2e-5


def test_normals_of_a_stretched_figure_stand_on_its_faces(playing):
    """A mixture of a baked body's normals is what its mixed points have, roughly."""
    performance = playing("stretched figure")
    (body,) = bodies(performance)
    for t in range(FRAMES):
        points, mixed = (np.tensordot(body.weights[t], told, axes=1) for told in (body.shapes, body.normals))
        corners = points[body.faces]
        truth = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        truth /= np.linalg.norm(truth, axis=1, keepdims=True)
        told = mixed[body.faces].mean(axis=1)
        told /= np.linalg.norm(told, axis=1, keepdims=True)
        assert (truth * told).sum(axis=1).min() > np.cos(np.radians(25))


@pytest.mark.parametrize("name", ["a.mp4", "frames"])
@pytest.mark.parametrize("kind", KINDS)
def test_pictures_take_them_all(playing, tmp_path, kind, name):
    performance = playing(kind)
    behind = "white" if name == "a.mp4" else None
    write_clip(tmp_path / name, draw2d.draw_frames(performance, behind), performance.fps, performance.times)
    clip = read_clip(tmp_path / name)
    (width, height), there = performance.size, np.array(clip.size)
    assert len(clip) == FRAMES and (there - performance.size).max() <= 1  # a video's sizes are even
    for t in range(FRAMES):
        picture = clip[t][:height, :width]
        shown = picture[..., 3] > 127 if picture.shape[2] == 4 else (picture < 200).any(axis=-1)
        truth = draw2d.draw(performance, t)[..., 3] > 127
        assert (shown & truth).sum() > 0.7 * (shown | truth).sum()


def test_curves_are_the_motions_whoever_plays(tmp_path, by_hand):
    motion = by_hand.motion(by_hand.tumble(FRAMES), np.ones((FRAMES, 1)), names=("sit",))
    for name in ("a.csv", "a.curves.json"):
        formats.table(tmp_path / name)(motion, tmp_path / name)
        assert "egg" in (tmp_path / name).read_text()
        assert formats.bodies(tmp_path / name) is None
