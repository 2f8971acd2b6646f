"""What is learnt of a part before its frames are gone through: its keys, its colours, and which key looks like what."""

import numpy as np
import pytest

from capture.errors import InputError
from capture.fit.pixels import model as models
from capture.motion import keys
from capture.pictures.clip import clip_of
from capture.pictures.shot import KeyDrawing, Part
from fixtures import maps, render
from fixtures.render import Fill, Ink

SIZE = (160, 120)
RED, INK = (215, 70, 60), (40, 20, 30)
RIM = maps.even(maps.smooth([(60, 30), (88, 34), (98, 62), (84, 92), (56, 94), (40, 66)]), 60)
BOX = (30.0, 20.0, 80.0, 86.0)


def frame(shift=(0, 0)):
    """A red blob with an ink line and two eyes on a pale wall, moved by so many pixels."""
    eyes = [Fill(maps.ellipse(np.add(at, shift), 6, 8), (250, 235, 205)) for at in ((62, 56), (80, 58))]
    rim = RIM + shift
    shapes = [Fill(rim, RED), *eyes, Ink(rim, INK, 3.0, closed=True)]
    return np.rint(render.paint(np.full((SIZE[1], SIZE[0], 3), (180, 205, 225)), shapes)).astype(np.uint8)


@pytest.fixture(scope="module")
def blob():
    return clip_of(np.stack([frame((4 * t, 0)) for t in range(4)]))


def outlined(outline):
    return tuple((float(x), float(y)) for x, y in outline)


def gap(outline, true):
    """Largest distance in pixels of an outline's points from a true outline."""
    return np.linalg.norm(outline[:, None] - maps.even(true, 2000), axis=-1).min(axis=1).max()


@pytest.fixture(scope="module")
def bar(bendy):
    """The bending bar as a part with three keys, learnt from a clip of three frames."""
    drawn = maps.move(bendy.keyset.removed, bendy.keyset.points)
    clip = clip_of(np.stack([bendy.paint(points)[0] for points in drawn]))
    given = [KeyDrawing(name, t, outlined(drawn[t][bendy.keyset.outline])) for t, name in enumerate(bendy.keyset.names)]
    return models.learn(Part("bar", tuple(given)), clip)


# -- a part with one key --------------------------------------------------------------------------------------


@pytest.mark.parametrize("given", [{"box": BOX}, {"keys": (KeyDrawing("rest", 0, outlined(RIM)),)}])
def test_a_box_or_an_outline_is_enough_for_a_part_with_one_key(blob, given):
    model = models.learn(Part("blob", **given), blob)
    assert model.shape is None and model.keyset.points.shape[0] == 1
    outline = models.outline_at(model, np.eye(2, 3), np.zeros(0))
    assert gap(outline, RIM) < 3  # a box finds the outer edge of the ink, the true outline is its middle
    assert np.array_equal(models.mesh_shape(model, np.zeros(0)), model.keyset.points[0])
    ink_too = 0.25 * np.array(INK) + 0.75 * np.array(RED)
    assert np.abs(model.view.ground - ink_too).max() < 45  # about the blob's colour, nothing of the wall's


def test_scribbles_are_enough_too(blob):
    inside = (((56.0, 80.0), (84.0, 80.0)), ((52.0, 40.0), (90.0, 42.0)), ((59.0, 30.5), (87.0, 34.5)))
    outside = (((10.0, 10.0), (150.0, 10.0)), ((10.0, 110.0), (150.0, 110.0)))
    model = models.learn(Part("blob", inside=inside, outside=outside), blob)
    assert gap(models.outline_at(model, np.eye(2, 3), np.zeros(0)), RIM) < 3


def test_a_placed_outline_is_the_outline_placed(blob):
    model = models.learn(Part("blob", box=BOX), blob)
    placed = maps.place(maps.turn(0.3), (70, 60), (100, 50))
    found = models.outline_at(model, placed, np.zeros(0))
    assert np.allclose(found, maps.move(placed, models.outline_at(model, np.eye(2, 3), np.zeros(0))))


def test_the_key_frame_is_counted_as_the_shot_counts(blob):
    """The clip was opened at the shot's frame 10: key frame 12 is its third."""
    part = Part("blob", (KeyDrawing("rest", 12, outlined(RIM + (8, 0))),))
    assert models.key_frames(part, blob, first=10) == [2]
    outline = models.outline_at(models.learn(part, blob, first=10), np.eye(2, 3), np.zeros(0))
    assert np.allclose(outline, RIM + (8, 0))


# -- a part with several keys ---------------------------------------------------------------------------------


def test_the_keys_are_those_that_were_drawn(bar, bendy):
    assert bar.keyset.names == bendy.keyset.names
    drawn = maps.move(bendy.keyset.removed, bendy.keyset.points)[:, bendy.keyset.outline]
    assert np.allclose(maps.move(bar.keyset.removed, bar.keyset.points)[:, bar.keyset.outline], drawn)


def test_every_row_is_a_mix_of_the_modes(bar):
    shapes = keys.shapes(bar.keyset)
    found = np.stack([models.mesh_shape(bar, alpha) for alpha in bar.shape.space.coefficients])
    assert np.linalg.norm(found - shapes, axis=-1).max() <= bar.shape.space.error + 1e-9 <= 0.1


def test_rough_key_weights_are_right_at_the_keys_and_sensible_everywhere(bar):
    at_keys = np.stack([models.amounts(bar.shape, alpha) for alpha in bar.shape.space.coefficients[:3]])
    assert np.allclose(at_keys, np.eye(3), atol=0.2)
    rng = np.random.default_rng(0)
    for alpha in rng.normal(size=(100, len(bar.shape.space.modes))) * 3 * bar.shape.space.spread:
        amounts = models.amounts(bar.shape, alpha)
        assert amounts.min() >= 0 and amounts.sum() == pytest.approx(1)


def test_templates_have_the_sizes_that_the_outline_bears(bar):
    count = bar.view.levels
    assert count == 4  # the bar is 104 pixels long: 13 at an eighth of the size
    assert len(bar.rigid.levels) == len(bar.shape.eigen.levels) == len(bar.shape.bent.levels) == count


# -- what cannot be used --------------------------------------------------------------------------------------


@pytest.mark.parametrize("number", [9, 14, 10**6])
def test_a_key_frame_beyond_the_shot_is_refused(blob, number):
    part = Part("blob", (KeyDrawing("rest", number, outlined(RIM)),))
    with pytest.raises(InputError, match=f"'blob'.*10 to 13, got {number}"):
        models.learn(part, blob, first=10)


@pytest.mark.parametrize("shift", [(300, 0), (0, 200), (-150, 0), (0, -120)])
def test_an_outline_beside_the_picture_is_refused(blob, shift):
    with pytest.raises(InputError, match=r"'blob', key 'rest'.*160 x 120"):
        models.learn(Part("blob", (KeyDrawing("rest", 0, outlined(RIM + shift)),)), blob)


def test_a_part_without_any_hint_is_refused(blob):
    with pytest.raises(InputError, match="'blob' must say which pixels"):
        models.learn(Part("blob"), blob)


def test_a_box_with_nothing_in_it_is_refused(blob):
    """The wall alone: no matte can come of it."""
    with pytest.raises(InputError):
        models.learn(Part("blob", box=(110.0, 5.0, 45.0, 40.0)), clip_of(np.full((1, 120, 160, 3), 200, np.uint8)))


def test_an_outline_of_two_points_is_refused(blob):
    with pytest.raises(InputError):
        models.learn(Part("blob", (KeyDrawing("rest", 0, ((50.0, 50.0), (80.0, 60.0))),)), blob)
