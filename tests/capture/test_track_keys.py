"""Eigen-images find a drawing and its rough shape from far off; the paper's step and its shortcut are the same step."""

import numpy as np
import pytest

from capture.fit.pixels import keyimages, layer, track_keys
from capture.fit.shapes import keyspace
from fixtures import maps, render

MIDDLE = (115, 95)


@pytest.fixture(scope="module")
def rows(bendy):
    drawn = [bendy.as_layer(picture) for picture in bendy.pictures]
    return keyimages.row_layers(drawn, bendy.keyset, bendy.shapes, bendy.grid)


@pytest.fixture(scope="module")
def template(bendy, rows):
    return track_keys.eigen_template(rows, bendy.space.mean[bendy.keyset.outline], bendy.space)


def away(pixels=0.0, way=0.0, angle=0.0, size=1.0):
    """A map that turns and scales about the bar's middle and moves it so many pixels."""
    shift = pixels * np.array([np.cos(way), np.sin(way)])
    return maps.place(size * maps.turn(angle), MIDDLE, MIDDLE + shift)


def off(bendy, found, true):
    """Mean distance in pixels over the mesh of a map and mode weights from true points (N, 2)."""
    placed, alpha = found
    return np.linalg.norm(maps.move(placed, keyspace.mix(bendy.space, alpha)) - true, axis=-1).mean()


def test_eigen_images_are_orthonormal_at_every_level(template):
    for level in template.levels:
        count = level.images.shape[1]
        assert 3 <= count <= 10
        assert np.allclose(level.images.T @ level.images, np.eye(count), atol=1e-8)


def test_the_mean_is_subtracted(template, rows):
    """The rows' own weights average to none: the mean image is not among the eigen-images."""
    for number, level in enumerate(template.levels):
        own = np.stack([(row.sample(number, level.points) - level.mean).ravel() @ level.images for row in rows])
        assert np.abs(own.mean(axis=0)).max() < 1e-3 * np.abs(own).max()


def test_ten_images_hold_nearly_all_there_is_to_see(template, rows):
    for number, level in enumerate(template.levels):
        for row in rows:
            difference = (row.sample(number, level.points) - level.mean).ravel()
            left = difference - level.images @ (level.images.T @ difference)
            assert np.linalg.norm(left) < 0.35 * np.linalg.norm(difference) + 1


@pytest.mark.parametrize("level", [0, 1, 2])
@pytest.mark.parametrize("row", [(0, 0, 0), (0, 1, 0.4), (1, 2, 0.55)])
def test_solving_jointly_and_with_the_weights_eliminated_takes_the_same_steps(bendy, template, level, row):
    """Eqs. 14-15 against their projected form, from a poor start, six iterations long."""
    frame = bendy.layer(maps.move(away(3, 1.0, 0.05), bendy.row(*row)))
    joint = eliminated = np.eye(2, 3)
    for _ in range(6):
        joint, weights = track_keys.joint_step(template, frame, joint, level)
        eliminated, same = track_keys.eliminated_step(template, frame, eliminated, level)
        assert np.allclose(joint, eliminated, rtol=0, atol=1e-8)
        assert np.allclose(weights, same, rtol=0, atol=1e-8 * np.abs(weights).max())


def test_the_papers_steps_come_to_rest_on_the_drawing(bendy, template):
    """The signs of eqs. 12 and 15: printed as they are, the steps run away."""
    true = maps.move(away(3, 1.0, 0.05), bendy.row(0, 1, 0.4))
    placed, frame = np.eye(2, 3), bendy.layer(true)
    for _ in range(25):
        placed, weights = track_keys.joint_step(template, frame, placed, 1)
    last, _ = track_keys.joint_step(template, frame, placed, 1)
    assert np.allclose(last, placed, atol=0.02)
    alpha = weights @ template.levels[1].to_modes
    assert off(bendy, (placed, alpha), true) < 0.5


@pytest.mark.parametrize("row", [(0, 0, 0), (1, 1, 0), (2, 2, 0), (0, 1, 0.5), (0, 2, 1 / 6), (1, 2, 2 / 3)])
@pytest.mark.parametrize("way", [0.5, 2.6, 4.7])
def test_a_rows_own_picture_is_found_from_20_pixels_off(bendy, template, row, way):
    true = maps.move(away(20, way), bendy.row(*row))
    assert off(bendy, track_keys.acquire(template, bendy.layer(true), np.eye(2, 3), finest=1), true) < 0.4


@pytest.mark.parametrize("angle, size", [(0.6, 1.0), (-0.6, 1.0), (0.2, 1.25), (0.0, 0.8)])
def test_a_turned_or_scaled_drawing_is_found_too(bendy, template, angle, size):
    true = maps.move(away(10, 1.0, angle, size), bendy.row(0, 1, 0.4))
    assert off(bendy, track_keys.acquire(template, bendy.layer(true), np.eye(2, 3), finest=1), true) < 0.4


@pytest.mark.parametrize("row", [(0, 1, 0.4), (0, 2, 0.75), (1, 2, 0.3)])
def test_shapes_between_the_rows_are_found_though_no_row_shows_them(bendy, template, row):
    true = maps.move(away(12, 3.0, 0.1), bendy.row(*row))
    placed, alpha = track_keys.acquire(template, bendy.layer(true), np.eye(2, 3), finest=1)
    assert off(bendy, (placed, alpha), true) < 0.4
    goal = np.tensordot(bendy.row(*row) - bendy.space.mean, bendy.space.modes, axes=((0, 1), (1, 2)))
    assert np.linalg.norm(alpha - goal) < 0.15 * bendy.space.spread[0]


@pytest.mark.parametrize("row", [(0, 0, 0), (0, 1, 0.4), (1, 2, 0.55)])
@pytest.mark.parametrize(
    "start",
    [away(31, 0.0), away(31, 2.2), away(31, 4.0)]  # 30 % of its size
    + [away(angle=np.pi / 4), away(angle=-np.pi / 4), away(size=0.5), away(size=2.0)],
)
def test_every_start_comes_home(bendy, start, row):
    """From far off in place, turn or size, whatever the shape."""
    count = layer.levels_for(bendy.space.mean[bendy.keyset.outline])

    def sized(points):
        return layer.layer(bendy.composite(points), np.zeros(2), bendy.ground, count, 0.0)

    drawn = [sized(maps.move(removed, points)) for removed, points in zip(bendy.keyset.removed, bendy.keyset.points)]
    rows = keyimages.row_layers(drawn, bendy.keyset, bendy.shapes, bendy.grid, track_keys.FINEST)
    template = track_keys.eigen_template(rows, bendy.space.mean[bendy.keyset.outline], bendy.space)
    shape = bendy.row(*row)
    assert off(bendy, track_keys.acquire(template, sized(shape), start), shape) < 0.6  # pixels: near enough to refine


@pytest.mark.parametrize("row", [(1, 1, 0), (0, 2, 0.75), (1, 2, 0.3)])
def test_what_is_hidden_is_left_out(bendy, template, row):
    """A quarter of the bar lies behind a post; its matte is empty there, and that is told."""
    true = maps.move(away(8, 1.0), bendy.row(*row))
    picture, alpha = bendy.paint(true)
    post = render.Fill(np.array([(107.0, 0), (130, 0), (130, 190), (107, 190)]), (0, 0, 0))
    clear = 1 - render.matte([post], (230, 190)).astype(np.float32)
    composed = layer.composite(picture, alpha * clear, bendy.ground)
    seen = layer.layer(composed, np.zeros(2), bendy.ground, 4, 0.0, clear)
    assert off(bendy, track_keys.acquire(template, seen, np.eye(2, 3), finest=1), true) < 0.6


def test_equal_rows_leave_a_plain_affine_tracker(bendy, rows):
    """No eigen-images, no modes: nothing divides by their number."""
    space = keyspace.extended_space(bendy.shapes[[0, 0, 0]])
    plain = track_keys.eigen_template([rows[0]] * 3, bendy.shapes[0][bendy.keyset.outline], space)
    true = away(9, 1.0, 0.2)
    placed, alpha = track_keys.acquire(plain, bendy.layer(maps.move(true, bendy.shapes[0])), np.eye(2, 3))
    assert alpha.shape == (0,)
    assert np.linalg.norm(maps.move(placed, bendy.shapes[0]) - maps.move(true, bendy.shapes[0]), axis=1).mean() < 0.2


def test_the_finest_level_asked_for_may_be_more_than_there_are(bendy, template):
    frame = bendy.layer(bendy.row(0, 1, 0.5))
    for finest in (0, 2, 99):
        placed, alpha = track_keys.acquire(template, frame, np.eye(2, 3), finest)
        assert placed.shape == (2, 3) and np.isfinite(alpha).all()
