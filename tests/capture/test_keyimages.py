"""Pictures of rows show what was drawn in the key frames, bent to the row's shape, ink outside the outline too."""

import numpy as np
import pytest
from scipy.ndimage import binary_dilation, binary_erosion

from capture.fit.pixels import keyimages
from fixtures import maps, render
from fixtures.render import Fill


def covered(points, keyset, grid, deep=0):
    """Mask (H, W) of the grid's pixels that lie wholly within the mesh, and `deep` pixels from its edge."""
    shape = Fill(points[keyset.outline] - grid.origin, (0, 0, 0))
    inside = render.matte([shape], grid.shape[::-1]) == 1
    return binary_erosion(inside, iterations=deep) if deep else inside


def crop(picture, grid):
    """The grid's part of a full picture."""
    x, y = grid.origin
    return picture[y : y + grid.shape[0], x : x + grid.shape[1]]


def test_a_grid_holds_all_shapes_and_a_margin(bendy):
    low, high = bendy.grid.points()[0, 0], bendy.grid.points()[-1, -1]
    assert np.array_equal(low, bendy.grid.origin) and bendy.grid.points().shape == (*bendy.grid.shape, 2)
    assert (bendy.shapes.min(axis=(0, 1)) - low >= 12).all() and (high - bendy.shapes.max(axis=(0, 1)) >= 12).all()
    assert (bendy.shapes.min(axis=(0, 1)) - low < 13.01).all() and (high - bendy.shapes.max(axis=(0, 1)) < 14).all()


@pytest.mark.parametrize("row", [0, 1, 9, 17])
def test_a_mesh_map_says_where_every_pixel_is(bendy, row):
    """The place on the mesh and the way beyond it add up to the pixel itself."""
    place = keyimages.mesh_map(bendy.shapes[row], bendy.keyset.faces, bendy.grid)
    found = place.carry(bendy.shapes[row]) + place.beyond
    assert np.allclose(found, bendy.grid.points())
    assert np.allclose(place.shares.sum(axis=-1), 1)
    inside = covered(bendy.shapes[row], bendy.keyset, bendy.grid)
    assert (place.beyond[inside] == 0).all() and (place.shares[inside] > -0.3).all()  # faces are painted pixel by pixel
    outside = ~binary_dilation(inside, iterations=3)
    assert (np.linalg.norm(place.beyond[outside], axis=-1) >= 1).all()


def test_a_pixel_outside_belongs_to_the_nearest_place_of_the_mesh(bendy):
    points = bendy.shapes[0]
    place = keyimages.mesh_map(points, bendy.keyset.faces, bendy.grid)
    edge = maps.even(points[bendy.keyset.outline], 2000)
    distance = np.linalg.norm(place.beyond, axis=-1)
    for y, x in [(0, 0), (5, 70), (80, 20), (91, 142)]:
        true = np.linalg.norm(edge - bendy.grid.points()[y, x], axis=1).min()
        assert abs(distance[y, x] - true) < 1.5  # pixels: the nearest pixel of the mesh, not the nearest point


def test_a_carried_field_is_the_field_of_the_mesh_points(bendy):
    """An affine function of place is reproduced, for it is so on every face."""
    place = keyimages.mesh_map(bendy.shapes[1], bendy.keyset.faces, bendy.grid)
    values = bendy.shapes[1] @ np.array([(2.0, -1, 0), (0.5, 3, 1)]) + 7
    inside = covered(bendy.shapes[1], bendy.keyset, bendy.grid)
    true = bendy.grid.points() @ np.array([(2.0, -1, 0), (0.5, 3, 1)]) + 7
    assert np.allclose(place.carry(values)[inside], true[inside])


def row_pictures(bendy, shapes):
    """What the rows show at full size, (D, H, W, 4)."""
    drawn = [bendy.as_layer(picture) for picture in bendy.pictures]
    return [row.levels[0] for row in keyimages.row_layers(drawn, bendy.keyset, shapes, bendy.grid)]


def smoothed(bendy, points):
    """What a painter would have drawn, smoothed as layers are, on the grid."""
    return crop(bendy.layer(points).levels[0], bendy.grid)


def test_the_first_keys_row_is_its_own_picture(bendy):
    image = row_pictures(bendy, bendy.shapes[:1])[0]
    assert np.allclose(image, smoothed(bendy, bendy.shapes[0]), atol=1e-2)  # silhouette and surroundings too


@pytest.mark.parametrize("row", [(1, 1, 0.0), (0, 1, 0.5), (0, 2, 1 / 3), (1, 2, 5 / 6)])
def test_a_rows_picture_is_what_a_painter_would_have_drawn(bendy, row):
    """Painted from the faces of the row's mesh, it differs only where sampling softens the faces' edges."""
    at = np.flatnonzero(np.isclose(bendy.keyset.rows, row).all(axis=1))
    images = row_pictures(bendy, bendy.shapes)
    difference = np.abs(images[at[0]] - smoothed(bendy, bendy.shapes[at[0]]))
    deep = covered(bendy.shapes[at[0]], bendy.keyset, bendy.grid, 2)
    assert difference.mean() < 3 and np.median(difference[deep]) < 5
    assert np.abs(images[at[0]] - images[0]).mean() > 1.5 * difference.mean()  # and not where it was in key 0


@pytest.mark.parametrize("finest", [1, 2])
def test_rows_made_for_small_pictures_only_are_what_the_whole_ones_show_there(bendy, finest):
    drawn = [bendy.as_layer(picture) for picture in bendy.pictures]
    whole, small = (
        keyimages.row_layers(drawn, bendy.keyset, bendy.shapes[4:7], bendy.grid, first) for first in (0, finest)
    )
    for one, other in zip(whole, small):
        assert all(level.size == 0 for level in other.levels[:finest])
        for level in range(finest, len(one.levels)):
            assert one.levels[level].shape == other.levels[level].shape
            assert np.abs(one.levels[level] - other.levels[level]).mean() < 3  # of 255 grey levels


def test_all_keys_look_alike_when_they_are_pulled_into_one_shape(bendy):
    place = keyimages.mesh_map(bendy.space.mean, bendy.keyset.faces, bendy.grid)
    deep = covered(bendy.space.mean, bendy.keyset, bendy.grid, 2)
    true = smoothed(bendy, bendy.space.mean)
    for picture, points, removed in zip(bendy.pictures, bendy.keyset.points, bendy.keyset.removed):
        texture = keyimages.pulled_layer(bendy.as_layer(picture), points, removed, place, bendy.grid.origin).levels[0]
        assert texture.shape == (*bendy.grid.shape, 4)
        assert np.median(np.abs(texture - true)[deep]) < 6  # of 255 grey levels
        assert np.corrcoef(texture[deep][:, :3].ravel(), true[deep][:, :3].ravel())[0, 1] > 0.95


def test_ink_outside_the_outline_comes_along(bendy):
    """A dot 5 pixels above the bar stays 5 pixels above it when the whole key is moved."""
    points = bendy.shapes[0]
    top = points[bendy.keyset.outline][np.argmin(points[bendy.keyset.outline][:, 1])]
    dot = [Fill(maps.ellipse(top - (0, 5), 2, 2), (0, 0, 0))]
    picture = np.dstack([render.paint(np.full((190, 230, 3), 235), dot), np.zeros((190, 230))]).astype(np.float32)
    shift = np.array([(1, 0, 7), (0, 1, -4)], float)
    place = keyimages.mesh_map(points, bendy.keyset.faces, bendy.grid)
    drawn = bendy.as_layer(picture)
    seen = keyimages.pulled_layer(drawn, points, shift, place, bendy.grid.origin).levels[0][..., 0]
    true = crop(np.roll(drawn.levels[0][..., 0], (4, -7), (0, 1)), bendy.grid)
    assert np.allclose(seen, true, atol=0.5)
