"""A model bends as the drawing does: not at all, by affine maps as one, and along the outline; slim limbs swing."""

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
    found = affine.fit(seen[:, :2], after[:, :2])
    assert min(np.abs(found[:, :2] - one).max() for one in (inner, move[:, :2])) < 0.01  # or as the drawing itself does
    np.testing.assert_allclose(affine.apply(found, seen[:, :2]), after[:, :2], atol=0.05)
    np.testing.assert_allclose(after[:, 2], seen[:, 2], atol=1e-9)


def test_a_model_of_the_drawings_own_outline_follows_it(by_hand):
    egg = by_hand.egg()
    bent = by_hand.lean(egg, 40.0)
    model = prism(egg)
    truth = np.concatenate([bent, bent]) * [1, -1]
    found = carried_shapes(model, keyset(egg, bent))[1]
    np.testing.assert_allclose(found[:, :2], truth, atol=0.05)


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


def test_a_slim_limb_swings_and_keeps_its_form(by_hand):
    """A bar half as wide as the source's, that turns by 50 degrees above its middle, is not sheared flat."""

    def bar(wide, bent):
        along = np.linspace(0, 200, 24)
        turn = np.radians(50) * np.clip((along - 90) / 20, 0, 1) * bent
        middle = np.stack([np.cumsum(np.sin(turn)), -np.cumsum(np.cos(turn))], axis=-1) * 200 / 23
        aside = wide / 2 * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
        return np.concatenate([middle - aside, (middle + aside)[::-1]]) + 300

    source = keyset(bar(60.0, 0.0), bar(60.0, 1.0))
    shapes = carried_shapes(prism(bar(30.0, 0.0)), source)
    upper = shapes[:, [23, 24]]  # the bar's end, left and right
    assert np.linalg.norm(upper[1, 1] - upper[1, 0]) == pytest.approx(30, rel=0.1)
    way = (upper[1, 1] - upper[1, 0])[:2]
    assert np.degrees(np.arctan2(-way[1], way[0])) == pytest.approx(50, abs=6)
