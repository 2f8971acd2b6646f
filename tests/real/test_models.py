"""Real models: they are read as another reader reads them, and the hopping rabbit plays a cow and a fox."""

import numpy as np
import pytest

from capture.fit.contour import capture_outlines
from capture.fit.suggest import suggest
from capture.pictures.encode import write_picture
from retarget.characters.models import lift
from retarget.characters.models.mesh import mesh, read_mesh
from retarget.characters.models.meshfiles import read_model
from retarget.characters.proposed.carried import carried_shapes
from retarget.stage import draw2d
from retarget.stage.perform import perform


@pytest.fixture(scope="module")
def hop(rabbit_body):
    """The rabbit's body, captured from its outlines."""
    return capture_outlines(rabbit_body, suggest(rabbit_body, 4.0, 4).key_frames, 30.0, (512, 512), "body")


@pytest.mark.parametrize("name", ["Fox.glb", "MorphStressTest.gltf", "spot.obj"])
def test_a_model_is_read_as_trimesh_reads_it(data, name):
    trimesh = pytest.importorskip("trimesh", reason="trimesh, of the extra mesh, is not installed")
    model = read_model(data / "meshes" / name)
    with np.errstate(all="ignore"):
        other = trimesh.load(data / "meshes" / name, process=False, force="mesh")
    ours, theirs = (np.sort(points[faces].reshape(-1, 9), axis=0) for points, faces in _both(model, other))
    np.testing.assert_allclose(ours, theirs, atol=1e-5 * np.ptp(model.points))


def _both(model, other):
    return (model.points, model.faces), (np.asarray(other.vertices), np.asarray(other.faces))


def test_the_morph_targets_of_the_stress_test_raise_one_pillar_each(data):
    model = read_model(data / "meshes" / "MorphStressTest.gltf")
    assert list(model.morphs) == [f"Key {n}" for n in range(1, 9)]
    moved = np.stack([np.abs(delta).max(axis=1) > 1e-3 for delta in model.morphs.values()])
    assert moved.sum(axis=0).max() == 1 and moved.any(axis=1).all()
    keyed = read_mesh("floor", ("rest", "key 3"), [data / "meshes" / "MorphStressTest.gltf"] * 2)
    assert keyed.keys.points.shape == (2, len(model.points), 3)


@pytest.mark.parametrize(("name", "plane"), [("spot.obj", "zy"), ("Fox.glb", "-zy")])
def test_the_rabbits_hop_is_lent_to_a_model(data, hop, sheets, name, plane):
    """It leaves the ground when the rabbit does, as high; the whole of it is drawn, and nothing else."""
    source = hop.keysets[0]
    model = read_model(data / "meshes" / name)
    shapes = carried_shapes(model, source, plane)
    played = perform(hop, [mesh("body", source.names, model, shapes, plane, lift.keeping_volume)])
    frames = [draw2d.draw(played, t, size=(256, 256)) for t in range(0, len(hop.times), 5)]
    write_picture(sheets / f"rabbit_to_{name.split('.')[0].lower()}.png", _on_grey(np.hstack(frames)))
    lowest = played.roles[0].points[..., 1].max(axis=1)
    rabbit = hop.outline("body")[..., 1].max(axis=1)
    tall = np.ptp(rabbit)
    assert np.abs((lowest - lowest[0]) - (rabbit - rabbit[0])).max() < 0.5 * tall
    assert np.corrcoef(lowest, rabbit)[0, 1] > 0.9
    for frame in frames:
        assert _pieces(frame[..., 3] > 127) <= 2  # the body, and at most an ear that shows apart
        assert 0.02 < (frame[..., 3] > 127).mean() < 0.5


def _pieces(mask):
    from skimage.measure import label

    sizes = np.bincount(label(mask).ravel())[1:]
    return int((sizes > 12).sum())


def _on_grey(picture):
    alpha = picture[..., 3:] / 255
    return np.round(picture[..., :3] * alpha + 230 * (1 - alpha)).astype(np.uint8)
