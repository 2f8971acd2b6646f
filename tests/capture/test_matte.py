"""The matte finds the layer whichever way it was pointed at, keeps its soft rim, and does not run off to a twin."""

from functools import lru_cache

import numpy as np
import pytest
from scipy.ndimage import binary_erosion

from capture.errors import InputError
from capture.pictures import matte
from fixtures import ball, hat, maps, render
from fixtures.render import Fill, Ink

SIZE = (160, 120)  # width, height
SKY, GRASS, RED, DARK, CREAM, INK = (
    (150, 190, 230),
    (110, 160, 90),
    (215, 70, 60),
    (170, 45, 50),
    (250, 235, 205),
    (40, 20, 30),
)
BODY = maps.smooth([(60, 30), (88, 34), (98, 62), (84, 92), (56, 94), (40, 66)])
TWIN = maps.ellipse((138, 24), 12, 10)
BOX = (32.0, 24.0, 74.0, 78.0)


def shapes(eye=False):
    """A shaded, inked blob."""
    ink = [Fill(BODY, RED), Fill(maps.ellipse((78, 80), 40, 24), DARK, BODY), Ink(BODY, INK, 3.0, closed=True)]
    return ink + ([Fill(maps.ellipse((66, 56), 9, 7), SKY)] if eye else [])


@lru_cache
def picture(twin=False, eye=False, fade=1.0, noise=4.0):
    """The blob (H, W, 3) on a meadow, with film grain; `twin` puts a patch of its own red elsewhere."""
    canvas = np.full((SIZE[1], SIZE[0], 3), SKY, np.uint8)
    ground = Fill(np.array([(-9, 84), (169, 84), (169, 129), (-9, 129)], float), GRASS)
    painted = render.paint(canvas, [ground, *([Fill(TWIN, RED)] if twin else []), *shapes(eye)])
    painted += noise * np.random.default_rng(1).standard_normal(painted.shape)
    return np.clip(np.rint(fade * painted), 0, 255).astype(np.uint8)


@lru_cache
def truth():
    """The blob's own coverage (H, W), 0-1."""
    return render.matte(shapes(), SIZE)


def overlap(a, b):
    """Intersection over union of soft mattes."""
    return np.minimum(a, b).sum() / np.maximum(a, b).sum()


STROKES = [np.array([(55, 60), (85, 60)]), np.array([(60, 86), (82, 86)]), np.array([(44, 58), (42, 66), (48, 78)])]
AROUND = [np.array([(10, 10), (10, 110)]), np.array([(20, 10), (140, 10)]), np.array([(20, 105), (140, 105)])]
SEEDS = {
    "outline": lambda image: matte.seed_outline(image, BODY),
    "box": lambda image: matte.seed_box(image, BOX),
    "scribbles": lambda image: matte.seed_scribbles(image, STROKES, AROUND),
}


@pytest.mark.parametrize("way", SEEDS)
def test_every_way_to_point_at_the_layer_finds_it(way):
    image = picture()
    model = matte.learn([SEEDS[way](image)])
    found = matte.cut(model, image)
    assert found.shape == truth().shape and found.dtype == np.float32
    assert overlap(found, truth()) > 0.95
    assert overlap(found > 0.5, truth() > 0.5) > 0.97


def test_a_colour_finds_the_flat_area_without_its_ink():
    """A colour says nothing of the ink round it: that takes an outline or a box."""
    image = picture()
    found = matte.cut(matte.learn([matte.seed_color(image, RED, tolerance=75)]), image)
    flat = render.matte([Fill(BODY, RED)], SIZE) * (1 - render.matte([Ink(BODY, INK, 3.0, closed=True)], SIZE))
    assert overlap(found, flat) > 0.95


def test_the_rim_is_soft_and_the_rest_is_not():
    image = picture(noise=0.0)
    found = matte.cut(matte.learn([matte.seed_outline(image, BODY)]), image)
    assert found.min() >= 0 and found.max() <= 1
    deep, far = binary_erosion(truth() == 1, iterations=3), binary_erosion(truth() == 0, iterations=3)
    assert (found[deep] == 1).all() and (found[far] == 0).all()
    rim = (truth() > 0.2) & (truth() < 0.8)  # pixels that the ink covers in part
    partly = (found > 0.02) & (found < 0.98)
    assert partly[rim].mean() > 0.6
    assert partly.sum() < 4 * rim.sum()  # a band of a pixel or two, no haze
    assert np.abs(found - truth())[rim].mean() < 0.3


def test_eyes_belong_to_the_layer_whatever_their_colour():
    """The eye has the sky's colour."""
    image = picture(eye=True)
    found = matte.cut(matte.learn([matte.seed_outline(image, BODY)]), image)
    assert overlap(found, truth()) > 0.95
    assert (found[render.matte([Fill(maps.ellipse((66, 56), 9, 7), SKY)], SIZE) == 1] == 1).all()


@pytest.mark.parametrize("way", ["outline", "box", "scribbles"])
def test_a_patch_of_the_same_colour_elsewhere_is_not_taken(way):
    image = picture(twin=True)
    seed = SEEDS[way](image)
    found = matte.cut(matte.learn([seed]), image, seed.inside)
    assert overlap(found, truth()) > 0.95
    assert found[render.matte([Fill(TWIN, RED)], SIZE) > 0].max() == 0


def test_a_twin_that_touches_is_cut_off_at_its_bridge():
    """A thin bridge of red leads to a large red field."""
    field = Fill(np.array([(120, -9), (169, -9), (169, 129), (120, 129)], float), RED)
    image = np.rint(render.paint(picture(noise=0.0), [Ink(np.array([(96, 60), (122, 60)]), RED, 3.0), field])).astype(
        np.uint8
    )
    model = matte.learn([matte.seed_outline(picture(noise=0.0), BODY)])
    found = matte.cut(model, image, (truth() > 0.5).astype(np.uint8))
    assert found[:, 122:].max() == 0
    assert overlap(found > 0.5, truth() > 0.5) > 0.93


def test_specks_are_dropped_and_large_pieces_kept():
    """A broad ink line may cut a layer in two: both halves are it, a speck is not."""
    halves = [Fill(maps.ellipse((50, 50), 22, 26), RED), Fill(maps.ellipse((100, 50), 20, 26), RED)]
    speck = Fill(maps.ellipse((75, 90), 4, 4), RED)
    canvas = np.full((SIZE[1], SIZE[0], 3), SKY, np.uint8)
    image = np.rint(render.paint(canvas, [*halves, speck])).astype(np.uint8)
    model = matte.learn([matte.seed_color(image, RED)])
    everywhere = np.ones(canvas.shape[:2], np.uint8)
    assert overlap(matte.cut(model, image, everywhere), render.matte(halves, SIZE)) > 0.95


def test_without_the_layers_colours_nothing_is_found():
    model = matte.learn([matte.seed_outline(picture(), BODY)])
    assert matte.cut(model, np.full((120, 160, 3), SKY, np.uint8), (truth() > 0.5).astype(np.uint8)).max() == 0


def test_the_model_follows_film_that_fades():
    """A frame's colours sink to a half within 40 frames: the first model loses the layer, the adapted one does not."""
    first = matte.learn([matte.seed_outline(picture(), BODY)])
    model, near = first, (truth() > 0.5).astype(np.uint8)
    for fade in np.linspace(1, 0.5, 40):
        image = picture(fade=float(fade))
        found = matte.cut(model, image, near)
        model = matte.adapt(model, image, found, rate=0.25)
    assert overlap(found, truth()) > 0.98
    assert overlap(matte.cut(first, image), truth()) < 0.8 * overlap(matte.cut(model, image), truth())


def test_adapting_to_the_same_picture_changes_nothing_that_is_seen():
    image = picture()
    model = matte.learn([matte.seed_outline(image, BODY)])
    found = matte.cut(model, image)
    for _ in range(10):
        model = matte.adapt(model, image, found)
    assert overlap(matte.cut(model, image), found) > 0.98
    assert np.isclose(model.inside.sum(), 1, atol=1e-3) and np.isclose(model.outside.sum(), 1, atol=1e-3)
    assert matte.adapt(model, image, np.ones_like(found)) is model  # no sure background: nothing to learn from


def test_colours_that_nobody_has_seen_do_no_harm():
    """Black and nearly black alone were learnt; then a white flash comes, far from both."""
    dark = np.full((SIZE[1], SIZE[0], 3), 16, np.uint8)
    dark[30:90, 40:110] = 0
    model = matte.learn([matte.seed_box(dark, (30, 20, 90, 80))])
    assert np.isfinite(model.probability()).all()
    flash = dark.copy()
    flash[:, 130:] = 255
    found = matte.cut(model, flash, (dark[..., 0] == 0).astype(np.uint8))
    assert np.isfinite(found).all() and found[:, 130:].max() == 0


def test_several_key_frames_teach_more_than_one():
    """In the second key the layer has turned green."""
    green = picture()[..., [1, 0, 2]]
    both = matte.learn([matte.seed_outline(picture(), BODY), matte.seed_outline(green, BODY)])
    assert overlap(matte.cut(both, picture()), truth()) > 0.9
    assert overlap(matte.cut(both, green), truth()) > 0.9


def test_a_picture_with_alpha_is_cut_like_one_without():
    image = picture()
    with_alpha = np.dstack([image, np.full(image.shape[:2], 255, np.uint8)])
    found = [matte.cut(matte.learn([matte.seed_outline(i, BODY)]), i) for i in (image, with_alpha)]
    assert np.array_equal(*found)


def test_a_colour_model_is_the_same_every_time():
    image = picture()
    a, b = (matte.learn([matte.seed_outline(image, BODY)]) for _ in range(2))
    assert np.array_equal(a.inside, b.inside) and np.array_equal(a.outside, b.outside)
    assert np.isclose(a.inside.sum(), 1, atol=1e-3) and ((a.probability() >= 0) & (a.probability() <= 1)).all()


def test_a_neighbour_of_the_same_colour_is_parted_at_the_ink_between_them():
    """A second red blob, inked like the first, overlaps it from behind; the ink they share is not claimed."""
    neighbour = BODY + (40, 0)
    behind = [Fill(neighbour, RED), Ink(neighbour, INK, 3.0, closed=True)]
    canvas = np.full((SIZE[1], SIZE[0], 3), SKY, np.uint8)
    image = np.rint(render.paint(canvas, [*behind, *shapes()])).astype(np.uint8)
    model = matte.learn([matte.seed_outline(image, BODY)])
    found = matte.cut(model, image, matte.fill(SIZE, BODY), slack=4.0)
    flat = truth() * (1 - render.matte([Ink(BODY, INK, 3.0, closed=True)], SIZE)) > 0.5
    assert overlap(found > 0.5, flat) > 0.97


def test_a_layer_that_has_grown_is_kept_whole():
    """The drawing before was shorter by a seventh, and a twin has taught the model to doubt the layer's colour."""
    image = picture(twin=True)
    model = matte.learn([matte.seed_outline(image, BODY)])
    before = BODY * (1, 0.86) + (0, 0.14 * BODY[:, 1].max())
    found = matte.cut(model, image, matte.fill(SIZE, before))
    assert overlap(found > 0.5, truth() > 0.5) > 0.97


def test_a_box_on_a_painted_ground_takes_no_ground_in():
    """The box crosses the horizon: both grounds occur inside it."""
    toon = hat.hat(busy=True, noise=2.0)
    image, coverage = toon.frame(20), toon.matte(20, "hat")
    rows, columns = np.nonzero(coverage > 0.5)
    x, y = columns.min() - 6.0, rows.min() - 6.0
    seed = matte.seed_box(image, (x, y, columns.max() + 6 - x, rows.max() + 6 - y))
    assert overlap(matte.cut_key(matte.learn([seed]), seed) > 0.5, coverage > 0.5) > 0.95


def test_a_colour_grows_to_the_whole_drawing():
    """The ball has ink, a stripe, a star and a shade beside the red that was picked."""
    toon = ball.ball(noise=2.0)
    seed = matte.seed_color(toon.frame(0), ball.RED)
    assert overlap(matte.cut_key(matte.learn([seed]), seed) > 0.5, toon.matte(0, "ball") > 0.5) > 0.99


def test_a_twin_in_sight_does_not_eat_the_layer_as_the_model_adapts():
    image, near = picture(twin=True), (truth() > 0.5).astype(np.uint8)
    model = matte.learn([matte.seed_outline(image, BODY)])
    for _ in range(60):
        model = matte.adapt(model, image, matte.cut(model, image, near))
    assert overlap(matte.cut(model, image, near) > 0.5, truth() > 0.5) > 0.98


# -- masks and outlines ---------------------------------------------------------------------------------------


def test_a_filled_outline_covers_what_lies_in_it():
    filled = matte.fill(SIZE, BODY)
    assert filled.shape == (120, 160) and filled.dtype == np.uint8
    assert overlap(filled, render.matte([Fill(BODY, RED)], SIZE)) > 0.96
    assert matte.fill((10, 8), np.array([(-50, -50), (50, -50), (50, 50), (-50, 50)])).all()


@pytest.mark.parametrize("step", [1.0, 3.0])
def test_a_traced_outline_lies_on_the_true_one(step):
    traced = matte.trace(render.matte([Fill(BODY, RED)], SIZE), step)
    fine = maps.even(BODY, 2000)
    gap = np.linalg.norm(traced[:, None] - fine, axis=-1).min(axis=1)
    assert gap.max() < 0.2
    lengths = np.linalg.norm(traced - np.roll(traced, -1, axis=0), axis=1)
    assert np.allclose(lengths, step, rtol=0.1)


def test_a_layer_that_leaves_the_picture_is_traced_along_its_border():
    half = np.zeros((20, 30), np.float32)
    half[:, :12] = 1
    traced = matte.trace(half)
    assert np.allclose(traced.min(axis=0), (-0.5, -0.5), atol=0.05) and np.allclose(
        traced.max(axis=0), (11.5, 19.5), atol=0.05
    )


# -- what cannot be used --------------------------------------------------------------------------------------


@pytest.mark.parametrize("box", [(0, 0, 0, 10), (-5, 0, 20, 20), (150, 100, 20, 30), (10, 10, 20, -3)])
def test_a_box_outside_the_picture_is_refused(box):
    with pytest.raises(InputError, match="160 x 120"):
        matte.seed_box(picture(), box)


def test_a_box_that_leaves_no_background_is_refused():
    with pytest.raises(InputError, match="whole picture"):
        matte.seed_box(picture(), (0, 0, 160, 120))


def test_a_colour_that_is_not_there_is_refused():
    with pytest.raises(InputError, match=r"\(0, 255, 0\)"):
        matte.seed_color(picture(), (0, 255, 0))


def test_too_few_pixels_to_learn_from_are_refused():
    dot = [np.array([(70.0, 60.0)])]
    with pytest.raises(InputError, match="at least 16 pixels known to be outside"):
        matte.learn([matte.seed_scribbles(picture(), STROKES, [])])
    with pytest.raises(InputError, match="at least 16 pixels known to be inside"):
        matte.learn([matte.seed_scribbles(picture(), [], AROUND)])
    with pytest.raises(InputError, match="at least 16 pixels known to be inside"):
        matte.learn([matte.seed_scribbles(picture(), dot, AROUND, width=1)])


def test_an_empty_matte_cannot_be_traced():
    with pytest.raises(InputError, match="empty"):
        matte.trace(np.zeros((20, 20)))
