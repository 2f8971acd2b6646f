"""Lines drawn by formula are found again: clean ink within half a pixel, pencil on bad paper within one."""

import numpy as np
import pytest

from capture.errors import InputError
from capture.pictures import lineart
from capture.pictures.lineart import pencil_lines, strokes_of
from fixtures import maps, render
from fixtures.render import Ink

SIZE = (240, 180)  # width, height
SNAKE = maps.smooth([(25, 40), (80, 25), (120, 90), (60, 130), (130, 155), (210, 120), (200, 40)], closed=False) + (
    0.31,
    0.17,
)
BEAN = maps.smooth([(60, 40), (140, 30), (200, 70), (180, 130), (120, 110), (70, 150), (40, 100)]) + (0.31, 0.17)


def drawn(*inks, paper=255, size=SIZE):
    """White paper (H, W, 3) uint8 with ink on it."""
    canvas = np.full((size[1], size[0], 3), paper, np.uint8)
    return np.rint(render.paint(canvas, inks)).astype(np.uint8)


def pencil(curve, closed, seed=0, width=2.5):
    """A curve in grey pencil, of changing pressure, on paper that is stained, grainy and darker towards a corner."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[: SIZE[1], : SIZE[0]]
    paper = 215 - 0.22 * x - 0.15 * y + 12 * np.sin(x / 37) * np.cos(y / 29)
    line = render.covered(Ink(curve, (0, 0, 0), width, closed), SIZE)
    (x0, y0, x1, y1), alpha = line
    pressure = np.zeros(paper.shape)
    pressure[y0:y1, x0:x1] = alpha
    tooth = 0.8 + 0.2 * rng.random(paper.shape)
    grey = paper * (1 - pressure * tooth * (0.5 + 0.15 * np.sin(x / 23))) + 3.5 * rng.normal(size=paper.shape)
    return np.clip(np.rint(grey), 0, 255).astype(np.uint8)


def apart(found, truth, closed):
    """Distances of the found points (n, 2) from the true curve, and of the true points from the found curve."""
    dense, back = maps.even(truth, 4000, closed), maps.even(found, 4000, closed)

    def nearest(a, b):
        return np.sqrt(((a[:, None] - b) ** 2).sum(axis=2).min(axis=1))

    return nearest(found, dense), nearest(maps.even(truth, 400, closed), back)


@pytest.mark.parametrize("width", [1.6, 3.0, 6.0])
@pytest.mark.parametrize("curve, closed", [(SNAKE, False), (BEAN, True)])
def test_a_drawn_line_is_found_within_half_a_pixel(curve, closed, width):
    strokes = strokes_of(drawn(Ink(curve, (20, 20, 30), width, closed)))
    assert len(strokes) == 1 and strokes[0].closed == closed
    on, whole = apart(strokes[0].points, curve, closed)
    assert on.max() < 0.5
    assert whole.max() < 0.5  # the ends too
    assert abs(strokes[0].width - width) < 0.5


def test_a_line_on_nothing_is_found_by_its_alpha():
    (x0, y0, x1, y1), alpha = render.covered(Ink(SNAKE, (0, 0, 0), 3.0), SIZE)
    for color in (0, 255):
        image = np.full((SIZE[1], SIZE[0], 4), color, np.uint8)
        image[..., 3] = 0
        image[y0:y1, x0:x1, 3] = np.rint(255 * alpha)
        (stroke,) = strokes_of(image)
        assert apart(stroke.points, SNAKE, False)[0].max() < 0.5


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("curve, closed", [(SNAKE, False), (BEAN, True)])
def test_a_pencil_line_on_uneven_paper_is_found_within_a_pixel(curve, closed, seed):
    stroke = pencil_lines(pencil(curve, closed, seed))[0]
    assert stroke.closed == closed
    on, whole = apart(stroke.points, curve, closed)
    assert on.max() < 1.0 and np.median(on) < 0.3
    assert np.percentile(whole, 97) < 1.0


def test_a_line_runs_on_through_a_crossing():
    knot = maps.smooth([(20, 150), (120, 60), (160, 25), (120, 20), (100, 60), (190, 150)], closed=False)
    (stroke,) = strokes_of(drawn(Ink(knot, (0, 0, 0), 2.5)))
    assert not stroke.closed and np.percentile(apart(stroke.points, knot, False)[1], 98) < 1.0


def test_a_figure_with_a_mouth_gives_its_outline_first():
    mouth = maps.smooth([(70, 150), (100, 95), (140, 80)], closed=False)  # begins on the outline
    first, *others = strokes_of(drawn(Ink(BEAN, (0, 0, 0), 3.0, closed=True), Ink(mouth, (0, 0, 0), 2.0)))
    assert first.closed and len(others) == 1
    on, whole = apart(first.points, BEAN, True)
    assert np.percentile(on, 90) < 0.5 and on.max() < 1.5 and whole.max() < 1.5


def test_a_hair_on_the_line_is_a_spur_and_goes():
    hair = np.array([(120.0, 92.0), (125.0, 88.0)])
    (stroke,) = strokes_of(drawn(Ink(SNAKE, (0, 0, 0), 4.0), Ink(hair, (0, 0, 0), 2.0)))
    assert apart(stroke.points, SNAKE, False)[0].max() < 1.5


def test_drawings_become_contours():
    images = [drawn(Ink(BEAN + (t, 0), (0, 0, 0), 2.5, closed=True)) for t in range(3)]
    found = lineart.contours_of_drawings(images)
    assert len(found) == 3 and found.closed
    gap = [drawn(Ink(np.roll(BEAN, 5, axis=0)[:-3], (0, 0, 0), 2.5))]
    assert lineart.contours_of_drawings(images + gap).closed
    with pytest.raises(InputError, match="frame 3 is open"):
        lineart.contours_of_drawings([*images, drawn(Ink(SNAKE, (0, 0, 0), 2.5))])


@pytest.mark.parametrize("lines", [strokes_of, pencil_lines])
def test_a_picture_without_lines_is_refused_in_a_sentence(lines):
    for image in (
        np.full((50, 60, 3), 255, np.uint8),
        np.zeros((50, 60, 4), np.uint8),
        np.full((50, 60), 200, np.uint8),
    ):
        with pytest.raises(InputError, match="must hold"):
            lines(image)
    with pytest.raises(InputError, match="must be a picture"):
        lines(np.zeros((0, 0, 3), np.uint8))
    with pytest.raises(InputError, match="finite"):
        lines(np.full((20, 20), np.nan))
    dot = drawn(Ink(np.array([(100.0, 100.0), (100.5, 100.0)]), (0, 0, 0), 3.0))
    with pytest.raises(InputError, match="must hold"):
        lines(dot)


def test_bare_noisy_paper_holds_no_line():
    grain = np.random.default_rng(0).normal(200, 4, (120, 160)).clip(0, 255).astype(np.uint8)
    with pytest.raises(InputError, match="stand out"):
        pencil_lines(grain)
