"""Rendering: coverage known by hand, straight alpha, no fringes."""

from dataclasses import replace

import numpy as np
import pytest

from capture.errors import InputError
from retarget.characters.drawings.drawing import outline_drawing
from retarget.characters.drawings.paths import DrawnPath, Gradient
from retarget.stage.draw2d import draw, draw_frames, draw_things
from retarget.stage.perform import perform

WHITE, RED = np.array([1.0, 1, 1, 1]), np.array([1.0, 0, 0, 1])


def polygon(*rings, **look):
    points, starts = [], [0]
    for ring in rings:
        ring = np.array([*ring, ring[0]], float)
        steps = np.linspace(ring[:-1], ring[1:], 4)[1:]  # thirds of every side
        points += [ring[:1], steps.swapaxes(0, 1).reshape(-1, 2)]
        starts.append(sum(map(len, points)))
    closed = np.ones(len(rings), bool)
    look = {"fill": WHITE, **look}
    return DrawnPath("test", "", np.vstack(points), np.array(starts), closed, **look)


def box(x0, y0, x1, y1):
    return [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]


def disc(radius, centre=(32, 32), **look):
    k = 0.5522847498 * radius
    r = radius
    quarter = np.array([[r, 0], [r, k], [k, r], [0, r]])
    turn = np.array([[0, 1], [-1, 0]])
    points = [quarter[:1]] + [quarter[1:] @ np.linalg.matrix_power(turn, n) for n in range(4)]
    points = np.vstack(points) + centre
    return DrawnPath("disc", "", points, np.array([0, 13]), np.array([True]), **look)


def test_pixel_0_0_is_the_centre_of_the_top_left_pixel():
    image = draw_things([polygon(box(1.5, 2.5, 4.5, 4.5))], (8, 8))
    truth = np.zeros((8, 8), int)
    truth[3:5, 2:5] = 255
    np.testing.assert_array_equal(image[..., 3], truth)
    half = draw_things([polygon(box(-0.5, -0.5, 2, 1))], (8, 8))[..., 3] / 255
    np.testing.assert_allclose(half[0, :4], [1, 1, 0.5, 0], atol=0.01)
    np.testing.assert_allclose(half[:3, 0], [1, 0.5, 0], atol=0.01)


def test_white_on_nothing_has_no_dark_fringe():
    image = draw_things([disc(20, fill=WHITE), disc(9, centre=(40, 40), fill=WHITE)], (64, 64))
    assert set(np.unique(image[..., 3])) > {0, 255}
    assert image[image[..., 3] > 0][:, :3].min() >= 254
    fading = draw_things([disc(20, fill=WHITE, stroke=WHITE, width=4, opacity=0.5)], (64, 64))
    assert fading[fading[..., 3] > 0][:, :3].min() >= 253


def test_the_area_of_a_disc_is_that_of_a_disc():
    for radius in (3, 10, 25):
        cover = draw_things([disc(radius, (31.7, 32.2), fill=WHITE)], (64, 64))[..., 3].sum() / 255
        assert cover == pytest.approx(np.pi * radius**2, rel=0.01)


def test_a_stroke_is_as_wide_as_it_says_and_even_all_round():
    for width in (0.5, 2, 5):
        image = draw_things([disc(20, stroke=WHITE, width=width)], (65, 65))
        assert image[..., 3].sum() / 255 == pytest.approx(2 * np.pi * 20 * width, rel=0.03)
    alpha = image[..., 3].astype(float)
    y, x = np.mgrid[:65, :65] - 32.0
    sector = (np.arctan2(y, x) // (np.pi / 8)).astype(int)
    sums = [alpha[sector == k].sum() for k in range(-8, 8)]
    assert np.std(sums) < 0.06 * np.mean(sums)


def test_a_stroke_that_leaves_the_page_is_drawn_as_far_as_it_is_on_it():
    inside = draw_things([disc(20, (40, 40), stroke=WHITE, width=3)], (80, 80))
    cut = draw_things([disc(20, (40 - 30, 40), stroke=WHITE, width=3)], (50, 80))
    np.testing.assert_allclose(cut[..., 3].astype(int), inside[:, 30:, 3].astype(int), atol=1)


def test_round_caps_add_half_a_disc_at_each_end_and_square_ones_half_a_square():
    line = replace(polygon([(20, 20), (44, 20)]), fill=None, stroke=WHITE, width=8)
    line = replace(line, points=line.points[:4], starts=np.array([0, 4]), closed=np.array([False]))
    area = {
        cap: draw_things([replace(line, cap=cap)], (64, 40))[..., 3].sum() / 255 for cap in ("butt", "round", "square")
    }
    assert area["butt"] == pytest.approx(24 * 8, rel=0.01)
    assert area["round"] == pytest.approx(24 * 8 + np.pi * 16, rel=0.02)
    assert area["square"] == pytest.approx(24 * 8 + 64, rel=0.01)


def test_dashes_leave_gaps():
    line = replace(polygon([(10, 20), (50, 20)]), fill=None, stroke=WHITE, width=2, dashes=(4.0, 6.0))
    line = replace(line, points=line.points[:4], starts=np.array([0, 4]), closed=np.array([False]))
    cover = draw_things([line], (64, 40))[..., 3].sum() / 255
    assert cover == pytest.approx(4 * 4 * 2, rel=0.05)


@pytest.mark.parametrize("turned", [False, True])
def test_an_even_odd_hole_is_a_hole_whichever_way_it_runs(turned):
    hole = box(3.5, 3.5, 7.5, 7.5)
    image = draw_things([polygon(box(0.5, 0.5, 10.5, 10.5), hole[::-1] if turned else hole, evenodd=True)], (12, 12))
    assert image[..., 3].sum() / 255 == pytest.approx(100 - 16, abs=0.2)
    assert image[5, 5, 3] == 0


def test_a_linear_gradient_runs_from_its_first_to_its_last_colour():
    place = np.array([[10.0, 0, 5], [0, 10, 0]])
    gradient = Gradient(np.array([0.0, 1]), np.array([[1.0, 0, 0, 1], [0, 0, 1, 0.5]]), place)
    image = draw_things([polygon(box(-0.5, -0.5, 20.5, 9.5), fill=gradient)], (21, 10)) / 255
    t = np.clip((np.arange(21) - 5) / 10, 0, 1)
    np.testing.assert_allclose(image[4, :, 3], 1 - 0.5 * t, atol=0.01)
    np.testing.assert_allclose(image[4, :, 0], 1 - t, atol=0.01)
    np.testing.assert_allclose(image[4, :, 2], t, atol=0.01)
    for spread, beyond in (("reflect", 0.6), ("repeat", 0.4)):
        again = draw_things([polygon(box(-0.5, -0.5, 20.5, 9.5), fill=replace(gradient, spread=spread))], (21, 10))
        assert again[4, 19, 2] / 255 == pytest.approx(beyond, abs=0.01)


def test_a_radial_gradient_is_round_its_focus():
    place = np.array([[10.0, 0, 15], [0, 10, 15]])
    stops = np.array([0.0, 1]), np.array([[0.0, 0, 0, 1], [1, 1, 1, 1]])
    for focus in (np.zeros(2), np.array([0.5, 0.0])):
        gradient = Gradient(*stops, place, focus)
        image = draw_things([polygon(box(-0.5, -0.5, 30.5, 30.5), fill=gradient)], (31, 31))[..., 0] / 255
        at = 15 + 10 * focus
        assert image[int(at[1]), int(at[0])] < 0.01
        np.testing.assert_allclose([image[15, 25], image[15, 5], image[5, 15]], 1, atol=0.01)
        middle = (at + [25, 15]) / 2  # half-way from the focus to the circle
        assert np.interp(middle[0], np.arange(31), image[15]) == pytest.approx(0.5, abs=0.01)


def test_drawing_over_a_background_is_drawing_on_nothing_and_laying_it_over():
    rng = np.random.default_rng(1)
    photo = rng.integers(0, 256, (64, 64, 3), dtype=np.uint8)
    place = np.array([[40.0, 0, 12], [0, 40, 12]])
    gradient = Gradient(np.array([0.0, 1]), np.array([[1.0, 0, 0, 1], [0, 0, 1, 0.2]]), place)
    things = [disc(20, fill=gradient), disc(12, (40, 40), fill=RED, stroke=WHITE, width=4, opacity=0.5)]
    over, alone = draw_things(things, (64, 64), photo), draw_things(things, (64, 64)).astype(float)
    alpha = alone[..., 3:] / 255
    assert over.shape == (64, 64, 3)
    assert np.abs(alone[..., :3] * alpha + photo * (1 - alpha) - over).max() < 4


def test_fill_and_stroke_of_a_fading_shape_fade_as_one():
    image = draw_things([disc(20, fill=RED, stroke=RED, width=10, opacity=0.5)], (65, 65))
    inside = image[32, 32 - 24 : 32 + 24, 3].astype(int)
    assert np.ptp(inside) <= 1 and inside[0] == pytest.approx(128, abs=1)


def egg_performance(by_hand, frames=3):
    motion = by_hand.motion(by_hand.tumble(frames), np.ones((frames, 1)), names=("sit",))
    return perform(motion, [outline_drawing("egg", motion.keyset("egg"), RED, WHITE, 2.0)])


def test_frames_come_at_the_motions_size_or_at_the_width_asked_for(by_hand):
    performance = egg_performance(by_hand)
    frames = list(draw_frames(performance))
    assert [frame.shape for frame in frames] == [(240, 320, 4)] * 3
    small = list(draw_frames(performance, size=160))
    assert small[0].shape == (120, 160, 4)
    shrunk = frames[1].reshape(120, 2, 160, 2, 4)[..., 3].mean(axis=(1, 3))
    # of 255: fill and stroke share border pixels, which are finer in the larger picture
    assert np.abs(shrunk - small[1][..., 3]).max() < 24


def test_a_background_can_be_a_colour_an_image_or_frames(by_hand):
    performance = egg_performance(by_hand)
    assert tuple(draw(performance, 0, "#0000ff")[0, 0]) == (0, 0, 255)
    assert tuple(draw(performance, 0, (1, 2, 3))[0, 0]) == (1, 2, 3)
    half = np.full((120, 160, 3), 7, np.uint8)
    assert tuple(draw(performance, 0, half)[0, 0]) == (7, 7, 7)
    clip = [np.full((240, 320, 3), 10 * t, np.uint8) for t in range(2)]
    corners = [frame[0, 0, 0] for frame in draw_frames(performance, clip)]
    assert corners == [0, 10, 10]


def test_a_background_that_is_none_is_refused(by_hand):
    performance = egg_performance(by_hand)
    with pytest.raises(InputError, match="'nocolour'"):
        draw(performance, 0, "nocolour")
    with pytest.raises(InputError, match=r"\(4, 4\)"):
        draw(performance, 0, np.zeros((4, 4)))
    with pytest.raises(InputError, match="at least 1 pixel"):
        next(draw_frames(performance, size=0))
