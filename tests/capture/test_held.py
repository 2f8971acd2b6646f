"""A held drawing is told from a new one, also under grain and codecs, and slow movement is not taken for holding."""

import cv2
import numpy as np
import pytest

from capture.pictures.held import is_held
from fixtures import maps, render
from fixtures.render import Fill, Ink

SIZE = (200, 160)
WINDOW = (slice(10, 150), slice(10, 190))
RED, INK, SKY, GRASS = (215, 70, 60), (40, 20, 30), (150, 190, 230), (110, 160, 90)
SAME_GREY = (118, 166, 60)  # as light as RED: only its hue differs


def drawn(shift=0.0, color=RED, ground=SKY, light=1.0):
    """A blob with an ink line over a horizon (H, W, 3) float, moved by so many pixels."""
    canvas = np.full((SIZE[1], SIZE[0], 3), ground, np.uint8)
    body = maps.ellipse((90 + shift, 80 + 0.3 * shift), 40, 32)
    field = Fill(np.array([(-9, 110), (209, 110), (209, 169), (-9, 169)], float), GRASS)
    return light * render.paint(canvas, [field, Fill(body, color), Ink(body, INK, 3.0, closed=True)])


def filmed(picture, noise=0.0, seed=0, jpeg=None):
    """The picture as uint8, with grain of so many grey levels, and through a codec."""
    grain = noise * np.random.default_rng(seed).standard_normal(picture.shape)
    frame = np.clip(np.rint(picture + grain), 0, 255).astype(np.uint8)
    return frame if jpeg is None else cv2.imdecode(cv2.imencode(".jpg", frame, [cv2.IMWRITE_JPEG_QUALITY, jpeg])[1], 1)


FILMS = [(0, None), (2, None), (6, None), (12, None), (2, 60), (6, 60), (12, 40)]


@pytest.mark.parametrize("noise, jpeg", FILMS)
def test_the_same_drawing_is_held_however_noisy_the_film(noise, jpeg):
    assert is_held(filmed(drawn(), noise, 1, jpeg), filmed(drawn(), noise, 2, jpeg), WINDOW)


@pytest.mark.parametrize("noise, jpeg", FILMS)
@pytest.mark.parametrize("shift", [0.6, 2.0, 20.0])
def test_a_new_drawing_is_not_held_however_noisy_the_film(noise, jpeg, shift):
    assert not is_held(filmed(drawn(), noise, 1, jpeg), filmed(drawn(shift), noise, 2, jpeg), WINDOW)


def test_in_a_clean_picture_a_third_of_a_pixel_is_movement():
    assert not is_held(filmed(drawn()), filmed(drawn(0.35)), WINDOW)


def test_what_moves_slowly_is_found_out_by_comparing_with_the_picture_last_looked_at():
    first = filmed(drawn())
    told = [is_held(first, filmed(drawn(0.1 * step)), WINDOW) for step in range(1, 8)]
    assert told[0] and not any(told[3:])


def test_film_that_flickers_as_a_whole_shows_the_same_drawing():
    assert is_held(filmed(drawn(), 4, 1), filmed(drawn(light=1.02), 4, 2), WINDOW)


def test_a_layer_as_light_as_its_ground_is_told_by_its_hue():
    def blob(shift):
        body = maps.ellipse((90 + shift, 80), 40, 32)
        return render.paint(np.full((SIZE[1], SIZE[0], 3), SAME_GREY, np.uint8), [Fill(body, RED)])

    assert np.abs(blob(0).mean(axis=-1) - blob(3).mean(axis=-1)).max() < 1  # grey pictures would not differ
    assert not is_held(filmed(blob(0)), filmed(blob(3)), WINDOW)


def test_only_the_window_counts():
    other = filmed(drawn())
    other[:, :8] = 255
    assert is_held(filmed(drawn()), other, WINDOW)
    assert not is_held(filmed(drawn()), other, (slice(0, 160), slice(0, 190)))


def test_alpha_is_left_out():
    alpha = np.arange(SIZE[0] * SIZE[1], dtype=np.uint8).reshape(SIZE[1], SIZE[0])
    one, other = (np.dstack([filmed(drawn()), each]) for each in (alpha, 255 - alpha))
    assert is_held(one, other, WINDOW)
