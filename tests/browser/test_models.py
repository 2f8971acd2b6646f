"""A 3-D model that plays a part, written to a file: three.js shows our own points, and our own pictures of them."""

from dataclasses import replace

import numpy as np
import pytest

from capture.motion import affine, keys
from capture.motion.tracks import CartoonMotion, track_of
from retarget.characters.models import lift
from retarget.characters.models.mesh import mesh
from retarget.characters.models.meshfiles import read_model
from retarget.characters.models.model import Material, Model
from retarget.export.bodies import bodies, stage_to_space
from retarget.export.gltf import write_bodies, write_glb
from retarget.stage import zbuffer
from retarget.stage.draw2d import draw
from retarget.stage.perform import perform

SIZE = (320, 240)


def motion(frames=6, wild=True):
    """A disc that shears, squashes and travels, with weights from -0.5 to 1.5 over two keys."""
    angle = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    disc = np.stack([150 + 40 * np.sin(angle), 150 - 50 * np.cos(angle)], axis=-1)
    bent = disc + np.stack([((200 - disc[:, 1]) / 20) ** 2, 0 * angle], axis=-1)
    source = keys.keyset(("rest", "bend"), np.stack([disc, bent]), spacing=12.0)
    way = np.linspace(0, 1, frames)
    maps = np.zeros((frames, 2, 3))
    for t, s in enumerate(way):
        c, n = np.cos(1.5 * s), np.sin(1.5 * s)
        maps[t, :, :2] = np.array([[c, -n], [n, c]]) @ [[1 + 0.3 * s, 0.5 * s], [0, 1 - 0.3 * s]]
        maps[t, :, 2] = [150, 150] - maps[t, :, :2] @ [150, 150] + [25 * s, -20 * s]
    weights = np.zeros((frames, len(source.rows)))
    weights[:, 1] = np.linspace(-0.5, 1.5, frames) if wild else way
    weights[:, 0] = 1 - weights[:, 1]
    track = track_of("knot", source, maps, weights, np.zeros(frames))
    return CartoonMotion((track,), (source,), np.arange(frames) / 24, 24.0, SIZE)


def knot():
    """A tube along a trefoil, which crosses in front of itself; half of it in one material, half in another."""
    around, along = 24, 160
    s = np.linspace(0, 2 * np.pi, along + 1)
    line = np.stack([np.sin(s) + 2 * np.sin(2 * s), np.cos(s) - 2 * np.cos(2 * s), -1.5 * np.sin(3 * s)], axis=-1)
    ahead = np.gradient(line, axis=0)
    ahead[[0, -1]] = line[1] - line[-2]
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    side = np.cross(ahead, [0.0, 0, 1])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    a = np.linspace(0, 2 * np.pi, around + 1)[None, :, None]
    points = line[:, None] + 0.6 * (np.cos(a) * side[:, None] + np.sin(a) * np.cross(ahead, side)[:, None])
    uv = np.stack(np.broadcast_arrays(s[:, None] * 8 / np.pi, a[..., 0] / np.pi), axis=-1).reshape(-1, 2)
    corner = (np.arange(along)[:, None] * (around + 1) + np.arange(around)).ravel()
    below = corner + around + 1
    faces = np.concatenate([np.stack([corner, corner + 1, below + 1], -1), np.stack([corner, below + 1, below], -1)])
    y, x = np.mgrid[:64, :64]
    picture = np.stack([4 * x, 4 * y, 128 + 60 * np.sin(x / 4), 255 + 0 * x], axis=-1).astype(np.uint8)
    looks = (Material((1.0, 1.0, 1.0, 1.0), picture), Material((0.9, 0.5, 0.2, 1.0)))
    surface = (faces[:, 0] > len(uv) // 2).astype(int)
    points = points.reshape(-1, 3)
    bent = points + np.stack([0.1 * points[:, 1] ** 2, 0 * points[:, 0], 0.1 * points[:, 0] ** 2], axis=-1)
    return Model(points, faces, looks, surface, uv), np.stack([points, bent])


def playing(plane="xy", wild=True):
    model, shapes = knot()
    return perform(motion(wild=wild), [mesh("knot", ("rest", "bend"), model, shapes, plane, lift.keeping_volume)])


def frame_times(performance):
    return np.float32(performance.times).tolist()


@pytest.mark.parametrize("plane", ["xy", (-1.0, 0.4, 1.0)])
def test_three_plays_the_points_of_a_model(three, validate, tmp_path, plane):
    performance = playing(plane)
    write_glb(performance, tmp_path / "knot.glb")
    issues = validate(tmp_path / "knot.glb")
    assert (issues["numErrors"], issues["numWarnings"]) == (0, 0), issues["messages"]
    meshes = three(tmp_path / "knot.glb", frame_times(performance)).meshes
    assert len(meshes) == 2
    role = performance.roles[0]
    truth = affine.apply(lift.lifted(stage_to_space(SIZE), 1 / SIZE[1]), role.points)
    truth[..., 2] += np.abs(role.points[..., 2]).max() / SIZE[1]  # the whole of it lies before the stage's back
    for number, (shown, body) in enumerate(zip(meshes, bodies(performance), strict=True)):
        chosen = np.unique(role.target.surface.faces[role.target.surface.number == number])
        low, high = shown.points.min(axis=1), shown.points.max(axis=1)
        size = np.ptp(truth[0], axis=0).max()
        np.testing.assert_allclose(low, truth[:, chosen].min(axis=1), atol=1e-4 * size)
        np.testing.assert_allclose(high, truth[:, chosen].max(axis=1), atol=1e-4 * size)
        points = {tuple(point) for point in np.round(truth[3, chosen] / size, 3)}
        assert len(body.shapes[0]) == shown.points.shape[1] and len(points) > 1000
        off = [np.abs(truth[3, chosen] - point).max(axis=1).min() for point in shown.points[3, ::37]]
        assert max(off) < 1e-4 * size


def test_three_draws_the_model_that_we_draw(three, tmp_path, monkeypatch):
    """Without lights, which every program sets up in its own way: what lies in front, textures, repeats, edges."""
    performance = playing(wild=False)
    monkeypatch.setattr(zbuffer, "LIGHTS", np.array([[0.0, 0, 1, 0]]))
    monkeypatch.setattr(zbuffer, "AMBIENT", 1.0)
    plain = tuple(replace(body, normals=None) for body in bodies(performance))
    write_bodies(plain, performance.times, performance.fps, tmp_path / "knot.glb", SIZE[0] / SIZE[1])
    times = frame_times(performance)
    for t, shown in enumerate(three(tmp_path / "knot.glb", times, times, SIZE).pictures):
        ours = draw(performance, t, "white").astype(float)
        off = np.abs(_soft(ours) - _soft(shown))
        assert off.mean() < 0.6 and np.percentile(off, 99.5) < 25, t
        assert np.abs(_soft(ours[:, ::-1]) - _soft(shown)).mean() > 10 * off.mean()


@pytest.mark.parametrize("first", [0, 1])
def test_three_keeps_the_drawn_order_of_models_that_lie_in_one_another(three, tmp_path, monkeypatch, first):
    monkeypatch.setattr(zbuffer, "LIGHTS", np.array([[0.0, 0, 1, 0]]))
    monkeypatch.setattr(zbuffer, "AMBIENT", 1.0)
    large = motion(3, wild=False)
    order = np.array([first, 1 - first, first])
    track = replace(large.tracks[0], part="small", order=order)
    both = replace(large, tracks=(replace(large.tracks[0], order=1 - order), track), keysets=2 * large.keysets)
    model, shapes = knot()
    small = replace(mesh("small", ("rest", "bend"), model, shapes, (1, 1, 1)), height=0.6)
    performance = perform(both, [mesh("knot", ("rest", "bend"), model, shapes), small])
    plain = tuple(replace(body, normals=None) for body in bodies(performance))
    write_bodies(plain, performance.times, performance.fps, tmp_path / "both.glb", SIZE[0] / SIZE[1])
    times = frame_times(performance)
    for t, shown in enumerate(three(tmp_path / "both.glb", times, times, SIZE).pictures):
        off = np.abs(_soft(draw(performance, t, "white")) - _soft(shown))
        assert off.mean() < 0.6 and np.percentile(off, 99.5) < 25, t


def test_a_model_written_and_read_back_is_the_model(tmp_path):
    performance = playing()
    write_glb(performance, tmp_path / "knot.glb")
    again = read_model(tmp_path / "knot.glb")
    assert len(again.materials) == 2 and list(again.morphs) == ["bend"]
    assert len(again.faces) == len(performance.roles[0].target.surface.faces)


def _soft(image):
    import cv2

    return cv2.blur(np.asarray(image, np.float32), (3, 3))
