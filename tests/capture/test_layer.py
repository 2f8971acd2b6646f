"""Every size of a layer shows the same place, slopes are slopes, and beyond the picture lies the ground."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import map_coordinates

from capture.fit.pixels import layer
from fixtures import maps

relaxed = settings(deadline=None, max_examples=30, derandomize=True)
ORIGIN = np.array([37.0, 11.0])
SLOPES = np.array([(0.5, 0.3), (-0.2, 0.7), (0.1, -0.4)])  # of R, G, B along x and y
GROUND = np.array([90.0, 60.0, 30.0], np.float32)


def ramp(points):
    """Colours (..., 3) that rise evenly along x and y."""
    return np.asarray(points) @ SLOPES.T + 60


def ramp_layer(levels=4, flatness=0.25, shape=(97, 120)):
    y, x = np.mgrid[: shape[0], : shape[1]]
    picture = ramp(np.stack([x, y], -1) + ORIGIN)
    composed = layer.composite(picture, np.ones(shape, np.float32), GROUND)
    return layer.layer(composed, ORIGIN, GROUND, levels, flatness)


@pytest.mark.parametrize("level", range(4))
def test_all_levels_sample_the_same_place(level):
    """A ramp looks the same however much it is smoothed and halved, if no level is shifted."""
    points = ORIGIN + np.random.default_rng(level).uniform((30, 30), (85, 65), (300, 2))  # clear of the edges
    found = ramp_layer().sample(level, points)
    assert np.allclose(found[:, :3], ramp(points), atol=0.01)
    assert np.allclose(found[:, 3], layer.ALPHA_GAIN * (0.25 if level == 0 else 1))  # alpha counts less at full size


@pytest.mark.parametrize("level", range(4))
def test_slopes_are_per_full_size_pixel_at_every_level(level):
    points = ORIGIN + np.random.default_rng(level).uniform((30, 30), (85, 65), (50, 2))
    gx, gy = ramp_layer().sample_slopes(level, points)
    assert np.allclose(gx[:, :3], SLOPES[:, 0], atol=1e-3) and np.allclose(gy[:, :3], SLOPES[:, 1], atol=1e-3)
    assert np.allclose(gx[:, 3], 0) and np.allclose(gy[:, 3], 0)


@pytest.mark.parametrize("level", range(4))
def test_a_levels_pixels_are_where_points_of_says(level):
    made = ramp_layer()
    image = made.levels[level]
    at = layer.points_of(level, image.shape, ORIGIN)
    assert at.shape == (*image.shape[:2], 2) and np.array_equal(at[0, 0], ORIGIN)
    assert np.allclose(made.sample(level, at.reshape(-1, 2)).reshape(image.shape), image, atol=1e-3)


def test_each_level_is_half_the_one_before():
    made = ramp_layer(levels=5, shape=(97, 120))
    assert [image.shape for image in made.levels] == [(97, 120, 4), (49, 60, 4), (25, 30, 4), (13, 15, 4), (7, 8, 4)]
    assert all(image.dtype == np.float32 for image in made.levels)


def test_beyond_the_picture_lies_the_ground():
    made = ramp_layer()
    far = np.array([(-500.0, 20.0), (60.0, 900.0), (1e6, 1e6)])
    for level in range(4):
        assert np.allclose(made.sample(level, far), [*GROUND, 0])
        assert np.allclose(made.sample_slopes(level, far), 0)


@given(st.integers(0, 10**6), st.sampled_from((1, 2, 1023, 1024, 1025, 3000)))
@relaxed
def test_sampling_is_bilinear_for_any_number_of_points(seed, count):
    rng = np.random.default_rng(seed)
    image = rng.uniform(0, 255, (17, 23, 4)).astype(np.float32)
    at = rng.uniform((0, 0), (22, 16), (count, 2)).astype(np.float32)
    true = np.stack([map_coordinates(image[..., c].astype(float), at[:, ::-1].T, order=1) for c in range(4)], -1)
    assert np.allclose(layer.sample(image, at, np.zeros(4)), true, atol=0.02)


def test_a_composite_shows_the_layer_over_its_ground():
    rng = np.random.default_rng(0)
    picture, alpha = rng.integers(0, 256, (5, 6, 3)).astype(np.uint8), rng.uniform(size=(5, 6)).astype(np.float32)
    composed = layer.composite(picture, alpha, GROUND)
    assert np.allclose(composed[..., :3], alpha[..., None] * picture + (1 - alpha[..., None]) * GROUND, atol=1e-3)
    assert np.allclose(composed[..., 3], layer.ALPHA_GAIN * alpha)


def test_what_lies_behind_the_layer_does_not_matter():
    picture, other = np.random.default_rng(1).integers(0, 256, (2, 9, 9, 3)).astype(np.uint8)
    alpha = np.zeros((9, 9), np.float32)
    alpha[2:6, 3:7] = 1
    other[2:6, 3:7] = picture[2:6, 3:7]
    assert np.array_equal(layer.composite(picture, alpha, GROUND), layer.composite(other, alpha, GROUND))


def test_the_mean_colour_is_the_layers_alone():
    picture = np.full((8, 8, 3), (10, 20, 30), np.uint8)
    picture[2:5, 2:5] = (200, 100, 50)
    picture[2:5, 5] = (100, 0, 250)
    alpha = np.zeros((8, 8), np.float32)
    alpha[2:5, 2:5], alpha[2:5, 5] = 1, 0.5
    true = (9 * np.array((200, 100, 50)) + 1.5 * np.array((100, 0, 250))) / 10.5
    assert np.allclose(layer.mean_color(picture, alpha), true, atol=1e-3)
    assert np.allclose(layer.mean_color(picture, 0 * alpha), 0)  # of nothing: no warning, no NaN


def test_flatness_falls_from_one_to_zero_as_contrast_rises():
    alpha = np.ones((20, 20), np.float32)
    found = []
    for contrast in (0, 5, 15, 25, 40, 100):
        picture = np.full((20, 20, 3), 120.0)
        picture[:10] += contrast
        picture[10:] -= contrast
        found.append(layer.flatness(picture, alpha, np.full(3, 120.0)))
    assert found[0] == found[1] == 1 and found[-1] == found[-2] == 0 and 0 < found[3] < found[2] < 1
    assert found == sorted(found, reverse=True)
    assert layer.flatness(picture, 0 * alpha, np.full(3, 120.0)) == 1


@given(st.floats(1, 5000), st.floats(0.1, 1))
@relaxed
def test_the_smallest_picture_of_a_layer_is_9_to_18_pixels_wide(across, ratio):
    outline = maps.ellipse((300, 200), across / 2, ratio * across / 2)
    count = layer.levels_for(outline)
    assert 1 <= count <= 6
    if count > 1:
        assert across / 2 ** (count - 1) >= 8.99
    if count < 6:
        assert across / 2 ** (count - 1) < 18.01


@given(st.floats(-300, 900), st.floats(-300, 700), st.floats(0, 80))
@relaxed
def test_a_window_holds_the_outline_and_its_margin_as_far_as_the_picture_goes(x, y, margin):
    outline = maps.ellipse((x, y), 40, 25)
    rows, columns = layer.window(outline, (640, 480), margin)
    assert 0 <= rows.start < rows.stop <= 480 and 0 <= columns.start < columns.stop <= 640  # never empty
    low, high = outline.min(axis=0) - margin, outline.max(axis=0) + margin
    seen = np.array([(cx, cy) for cx in (0, 320, 639) for cy in (0, 240, 479)])
    inside = seen[((seen >= low) & (seen <= high)).all(axis=1)]
    assert all(columns.start <= cx < columns.stop and rows.start <= cy < rows.stop for cx, cy in inside)
    if (low >= 1).all() and (high <= (638, 478)).all():
        assert columns.start <= low[0] and columns.stop > high[0] and rows.start <= low[1] and rows.stop > high[1]
