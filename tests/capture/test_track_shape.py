"""The bent template finds map and shape together, to a tenth of a pixel, shapes that no row shows included."""

import numpy as np
import pytest

from capture.fit.pixels import keyimages, layer, track_shape
from capture.fit.shapes import keyspace
from fixtures import maps, render
from fixtures.render import Fill

MIDDLE = (115, 95)
EVEN = np.full(3, 1 / 3)  # a third of every key's texture


@pytest.fixture(scope="module")
def template(bendy):
    place = keyimages.mesh_map(bendy.space.mean, bendy.keyset.faces, bendy.grid)
    return track_shape.shape_template(pulled(bendy, bendy.pictures, place), place, bendy.space)


def pulled(bendy, pictures, place):
    """The key frames' layers in the mean shape."""
    drawn = zip([bendy.as_layer(picture) for picture in pictures], bendy.keyset.points, bendy.keyset.removed)
    return [keyimages.pulled_layer(*key, place, bendy.grid.origin) for key in drawn]


def away(shift=(0, 0), angle=0.0, size=1.0):
    return maps.place(size * maps.turn(angle), MIDDLE, np.add(MIDDLE, shift))


def off(bendy, found, true):
    """Mean distance in pixels over the mesh of a map and mode weights from true points (N, 2)."""
    placed, alpha = found
    return np.linalg.norm(maps.move(placed, keyspace.mix(bendy.space, alpha)) - true, axis=-1).mean()


def exact(bendy, shape):
    """The mode weights (L,) nearest to a shape (N, 2)."""
    return np.tensordot(shape - bendy.space.mean, bendy.space.modes, axes=((0, 1), (1, 2)))


UNUSED = [(0, 1, 0.4), (0, 1, 0.75), (0, 2, 0.25), (1, 2, 0.3), (1, 2, 0.55)]  # between the rows of the key set


@pytest.mark.parametrize("row", UNUSED)
def test_the_weights_of_a_shape_that_no_row_shows_are_found(bendy, template, row):
    """The start: the right place but for 4 pixels and 3 degrees, and the mean shape."""
    shape, moved = bendy.row(*row), away((3.3, -2.1), 0.05)
    true = maps.move(moved, shape)
    placed, alpha = track_shape.refine(template, bendy.layer(true), np.eye(2, 3), np.zeros(3), EVEN)
    assert off(bendy, (placed, alpha), true) < 0.2  # pixels, mean over the mesh
    assert np.linalg.norm(alpha - exact(bendy, shape)) / np.sqrt(len(shape)) < 0.2  # pixels, root mean square
    assert track_shape.judged(template, bendy.layer(true), placed, alpha, EVEN).misfit < 0.3


@pytest.mark.parametrize("curl", [-1.3, -0.6, 0.5, 1.0])
def test_a_shape_drawn_by_formula_is_found(bendy, template, curl):
    """No in-between of ours is asked: the bar's own mesh is wound along a circle."""
    true = maps.move(away((4, 2), -0.06), bendy.wound(curl))
    found = track_shape.refine(template, bendy.layer(true), np.eye(2, 3), np.zeros(3), EVEN)
    assert off(bendy, found, true) < 0.2


def test_turns_stretches_and_shapes_together_are_told_apart(bendy, template):
    linear = maps.turn(0.7) @ [[1.2, 0.1], [0, 0.85]]
    true_map = maps.place(linear, MIDDLE, (118, 90))
    shape = bendy.row(1, 2, 0.3)
    true = maps.move(true_map, shape)
    start = maps.place(maps.turn(0.6), MIDDLE, (115, 92))
    placed, alpha = track_shape.refine(template, bendy.layer(true), start, np.zeros(3), EVEN)
    assert off(bendy, (placed, alpha), true) < 0.2
    assert np.allclose(placed[:, :2], linear, atol=0.02) and np.abs(alpha - exact(bendy, shape)).max() < 3


def test_the_truth_is_where_it_comes_to_rest(bendy, template):
    shape = bendy.row(0, 1, 0.4)
    found = track_shape.refine(template, bendy.layer(shape), np.eye(2, 3), exact(bendy, shape), EVEN)
    assert off(bendy, found, shape) < 0.1


def test_somebody_in_front_of_it_does_little_harm(bendy, template):
    """A fifth of the bar lies behind a grey post that the matte takes for the bar's own."""
    true = maps.move(away((2, -3)), bendy.row(0, 2, 0.25))
    picture, alpha = bendy.paint(true)
    post = [Fill(np.array([(110.0, 40), (131, 40), (131, 150), (110, 150)]), (60, 60, 60), true[bendy.keyset.outline])]
    assert 0.2 < render.matte(post, (230, 190)).sum() / alpha.sum() < 0.3
    hidden = bendy.as_layer(layer.composite(render.paint(picture, post), alpha, bendy.ground))
    found = track_shape.refine(template, hidden, np.eye(2, 3), np.zeros(3), EVEN)
    assert off(bendy, found, true) < 0.6


@pytest.mark.parametrize("known", [False, True])
@pytest.mark.parametrize("row", UNUSED[::2])
def test_behind_a_post_the_shape_is_still_found(bendy, template, row, known):
    """The matte is empty there, a quarter of the bar; whether that is told or not."""
    true = maps.move(away((2, -3), 0.03), bendy.row(*row))
    picture, alpha = bendy.paint(true)
    post = Fill(np.array([(103.0, 0), (126, 0), (126, 190), (103, 190)]), (0, 0, 0))
    clear = 1 - render.matte([post], (230, 190)).astype(np.float32)
    assert 0.2 < 1 - (alpha * clear).sum() / alpha.sum() < 0.32
    composed = layer.composite(picture, alpha * clear, bendy.ground)
    frame = layer.layer(composed, np.zeros(2), bendy.ground, 4, 0.0, clear if known else None)
    found = track_shape.refine(template, frame, np.eye(2, 3), np.zeros(3), EVEN)
    assert off(bendy, found, true) < 0.3  # pixels, what is hidden included


@pytest.mark.parametrize("size", [1.0, 2.0, 3.0])
def test_a_drawing_that_no_key_explains_is_met_nearly_as_well_as_the_shapes_can(bendy, template, size):
    """Every point is moved by a slow wave of so many pixels: only the nearest shape of the space is asked for.

    The fit listens to contrast and the measure to area: they agree to a third.
    """
    shape = bendy.row(0, 1, 0.4)
    x, y = (shape - MIDDLE).T
    true = shape + size * np.column_stack([np.sin(y / 25 + 1), np.sin(x / 25)])
    found = track_shape.refine(template, bendy.layer(true), np.eye(2, 3), exact(bendy, shape), EVEN)
    assert rms(bendy, found, true) < 1.33 * rms(bendy, nearest(bendy, true), true)


def rms(bendy, found, true):
    """Root mean square distance in pixels over the mesh."""
    placed, alpha = found
    return np.sqrt(((maps.move(placed, keyspace.mix(bendy.space, alpha)) - true) ** 2).sum(axis=1).mean())


def nearest(bendy, true):
    """The map and mode weights whose shape is nearest to points (N, 2), by another solver than ours."""
    from scipy.optimize import least_squares

    def left(unknown):
        shape = keyspace.mix(bendy.space, unknown[6:])
        return (maps.move(unknown[:6].reshape(2, 3), shape) - true).ravel()

    start = np.concatenate([np.eye(2, 3).ravel(), exact(bendy, true)])
    found = least_squares(left, start, x_scale=np.abs(start) + 1).x
    return found[:6].reshape(2, 3), found[6:]


def test_film_grain_costs_little(bendy, template):
    true = maps.move(away((3, 1), 0.04), bendy.row(1, 2, 0.55))
    picture, alpha = bendy.paint(true)
    noisy = np.clip(picture + 6 * np.random.default_rng(0).standard_normal(picture.shape), 0, 255)
    frame = bendy.as_layer(layer.composite(noisy, alpha, bendy.ground))
    found = track_shape.refine(template, frame, np.eye(2, 3), np.zeros(3), EVEN)
    assert off(bendy, found, true) < 0.25


def test_without_a_drawing_the_prior_leads_the_modes_home(bendy, template):
    """An empty frame says nothing: the map stays and the shape goes to the mean, no number runs away."""
    empty = bendy.as_layer(np.tile(np.float32([128, 128, 128, 0]), (190, 230, 1)))
    start = away((3, 4), 0.1)
    placed, alpha = track_shape.refine(template, empty, start, 2 * bendy.space.spread, EVEN)
    assert np.allclose(placed, start) and np.abs(alpha).max() < 1e-3 * bendy.space.spread[0]


@pytest.mark.parametrize("pixels", [0.5, 1.0])
def test_the_misfit_is_in_pixels(bendy, template, pixels):
    """Over all directions the squared misfit of a shift averages to half its square."""
    shape = bendy.row(0, 1, 0.4)
    frame, alpha = bendy.layer(shape), exact(bendy, shape)
    at_rest = track_shape.judged(template, frame, np.eye(2, 3), alpha, EVEN).misfit
    along, across = (
        track_shape.judged(template, frame, away(shift), alpha, EVEN).misfit for shift in ((pixels, 0), (0, pixels))
    )
    assert at_rest < 0.2
    assert np.sqrt(max(along**2 + across**2 - 2 * at_rest**2, 0)) == pytest.approx(pixels, rel=0.3)


def test_where_keys_differ_in_colour_the_textures_are_mixed(bendy):
    """A key that was painted brighter: with its texture the drawing fits, with the other's it does not."""
    bright = [picture + np.float32([40, 40, 40, 0]) * (key == 1) for key, picture in enumerate(bendy.pictures)]
    place = keyimages.mesh_map(bendy.space.mean, bendy.keyset.faces, bendy.grid)
    template = track_shape.shape_template(pulled(bendy, bright, place), place, bendy.space)
    shape = bendy.row(1, 1, 0)
    frame = bendy.as_layer(bendy.composite(shape) + np.float32([40, 40, 40, 0]))
    misfits = [
        track_shape.judged(template, frame, np.eye(2, 3), exact(bendy, shape), np.eye(3)[k]).misfit for k in (0, 1)
    ]
    assert misfits[1] < 0.4 * misfits[0]


def test_the_start_is_left_as_it_was(bendy, template):
    placed, alpha = np.eye(2, 3), np.ones(3)
    track_shape.refine(template, bendy.layer(bendy.row(0, 1, 0.4)), placed, alpha, EVEN)
    assert np.array_equal(placed, np.eye(2, 3)) and np.array_equal(alpha, np.ones(3))


def test_the_strongest_mode_moves_a_pixel_as_it_moves_the_mesh_there(bendy, template):
    mode = bendy.space.modes[0]
    for level in template.levels:
        distance = np.linalg.norm(level.points[:, None] - bendy.space.mean, axis=-1)
        near = distance.min(axis=1) < 1.5
        assert near.any()
        assert np.abs(level.modes[..., 0] - mode[distance.argmin(axis=1)])[near].max() < 0.1 * np.abs(mode).max()
