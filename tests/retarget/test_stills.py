"""A picture that is only moved is told in four words, which make its map again."""

from dataclasses import replace

import numpy as np
from PIL import Image

from capture.motion import affine
from retarget.characters.photos.picture import read_picture
from retarget.characters.target import REST
from retarget.export.elements import page_of
from retarget.export.stills import still_of
from retarget.stage.perform import perform


def photo(tmp_path, part="egg"):
    pixels = np.zeros((300, 200, 4), np.uint8)
    pixels[40:260, 30:170] = (200, 60, 0, 255)
    pixels[40:140, 30:170] = (0, 60, 200, 255)
    Image.fromarray(pixels).save(tmp_path / "photo.png")
    return read_picture(part, (REST,), [tmp_path / "photo.png"], [None])


def test_the_four_words_make_the_map_again(tmp_path, by_hand):
    maps = by_hand.tumble(9)
    maps[..., :2] = maps[..., :2] @ [[1, 0.6], [0, 0.5]]
    maps[5:, :, 1] *= -1
    performance = perform(by_hand.motion(maps, [[1.0]] * 9, names=("sit",)), [photo(tmp_path)])
    (element,) = page_of(performance).layers[0].elements
    still = still_of(element)
    layer = element.drawn[0].layers[0][0]
    height, width = still.pixels.shape[:2]
    assert np.abs(np.diff(still.turn)).max() < 40
    for place, drawn in zip(still.maps(), element.drawn, strict=True):
        back = affine.apply(affine.invert(place), drawn.points)  # on the cut-out, from its corner
        assert back.min() > 0 and (back < [width, height]).all()
        size = np.ptp(back, axis=0) / np.ptp(layer.points, axis=0)
        np.testing.assert_allclose(back - back[0], (layer.points - layer.points[0]) * size, atol=1e-6)
        inside = np.abs(layer.points - [100, 150]).max(axis=1) < 60
        x, y = (back[inside] - 0.5).round().astype(int).T
        blue = still.pixels[y, x, 2] > 128
        near = np.abs(layer.points[inside, 1] - 139.5) < 3  # at the border of the colours it may be either
        assert (blue == (layer.points[inside, 1] < 139.5))[~near].all()


def test_a_picture_that_bends_or_changes_is_no_still(tmp_path, by_hand):
    performance = perform(by_hand.motion(by_hand.tumble(3), [[1.0]] * 3, names=("sit",)), [photo(tmp_path)])
    (role,) = performance.roles
    bent = role.points.copy()
    bent[1] += np.sin(bent[1, :, ::-1] / 9)
    (element,) = page_of(replace(performance, roles=(replace(role, points=bent),))).layers[0].elements
    assert still_of(element) is None
