"""A model bends as the drawing does: not at all, by affine maps exactly, and along the outline."""

import numpy as np
import pytest

from capture.motion import affine, keys
from retarget.characters import lift
from retarget.characters.carried import carried_shapes
from retarget.characters.meshfiles import Material, Model


def prism(outline, depth=30.0):
    """A drawing's outline as a body of some depth, y up."""
    flat = np.concatenate([outline, outline]) * [1, -1]
    points = np.column_stack([flat, np.repeat([-depth / 2, depth / 2], len(outline))])
    here, after = np.arange(len(outline)), np.roll(np.arange(len(outline)), -1)
    faces = np.concatenate(
        [np.stack([here, after, after + len(here)], -1), np.stack([here, after + len(here), here + len(here)], -1)]
    )
    return Model(points, faces, (Material(),), np.zeros(len(faces), int), np.zeros((len(points), 2)))


def keyset(*outlines):
    return keys.keyset(tuple(f"key {n}" for n in range(len(outlines))), np.stack(outlines), spacing=15.0)


@pytest.mark.parametrize("plane", ["xy", "zy", (-1.0, 0.4, 1.0)])
def test_a_drawing_that_does_not_bend_bends_nothing(by_hand, plane):
    egg, model = by_hand.egg(), prism(by_hand.egg())
    shapes = carried_shapes(model, keyset(egg, egg), plane)
    np.testing.assert_array_equal(shapes[0], model.points)
    np.testing.assert_allclose(shapes[1], model.points, atol=1e-6)


@pytest.mark.parametrize("plane", ["xy", "-zy"])
def test_an_affine_map_of_the_drawing_is_one_of_the_model_in_its_plane(by_hand, plane):
    egg, model = by_hand.egg(), prism(by_hand.egg())
    move = np.array([[1.2, 0.5, 0], [-0.3, 0.8, 20]])
    seen = model.points @ lift.view(plane).T
    after = carried_shapes(model, keyset(egg, affine.apply(move, egg)), plane)[1] @ lift.view(plane).T
    stretch = np.ptp(egg, axis=0) / np.ptp(seen[:, :2], axis=0)  # box lies on box
    inner = np.diag(1 / stretch) @ move[:, :2] @ np.diag(stretch)
    np.testing.assert_allclose(affine.fit(seen[:, :2], after[:, :2])[:, :2], inner, atol=1e-6)
    np.testing.assert_allclose(
        affine.apply(affine.fit(seen[:, :2], after[:, :2]), seen[:, :2]), after[:, :2], atol=1e-5
    )
    np.testing.assert_allclose(after[:, 2], seen[:, 2], atol=1e-9)


def test_a_model_of_the_drawings_own_outline_follows_it(by_hand):
    egg = by_hand.egg()
    bent = by_hand.lean(egg, 40.0)
    model = prism(egg)
    truth = np.concatenate([bent, bent]) * [1, -1]
    exactly = carried_shapes(model, keyset(egg, bent), stiffness=0.0)[1]
    np.testing.assert_allclose(exactly[:, :2], truth, atol=1e-6)
    evenly = carried_shapes(model, keyset(egg, bent))[1]
    moved = np.linalg.norm(truth - model.points[:, :2], axis=1)
    assert np.linalg.norm(evenly[:, :2] - truth, axis=1).max() < 0.2 * moved.max()
    assert np.abs(evenly[:, :2] - truth).max() > 1e-3


def test_a_model_of_any_size_and_place_bends_alike(by_hand):
    egg = by_hand.egg()
    source = keyset(egg, by_hand.lean(egg, 40.0))
    model = prism(egg)
    far = Model(
        0.01 * model.points + [5, 6, 7], *(getattr(model, name) for name in ("faces", "materials", "surface", "uv"))
    )
    np.testing.assert_allclose(
        carried_shapes(far, source)[1], 0.01 * carried_shapes(model, source)[1] + [5, 6, 7], atol=1e-8
    )
