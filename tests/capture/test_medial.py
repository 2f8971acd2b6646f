"""The medial line of strokes drawn along known curves is that curve, and over time it stays the same line."""

import numpy as np
import pytest

from capture.errors import InputError
from capture.fit.curves import medial
from fixtures import maps, render
from fixtures.render import Fill, Ink

SIZE = (320, 260)


def arc(bend, length=170.0, centre=(160, 130), turn=0.0, count=200):
    """A circular arc (count, 2) of `bend` radians in all, that stands upright and starts below."""
    s = np.linspace(-0.5, 0.5, count)
    angle = bend * s
    steps = np.column_stack([np.sin(angle), -np.cos(angle)]) * length / (count - 1)
    line = np.cumsum(steps, axis=0)
    return (line - line.mean(axis=0)) @ maps.turn(turn).T + centre


def stroke(line, width=30.0):
    return render.matte([Ink(line, (0, 0, 0), width)], SIZE)


def distance(points, curve):
    """How far points (N, 2) lie from a polyline (M, 2)."""
    a, b = curve[:-1], curve[1:]
    way = b - a
    share = np.clip(((points[:, None] - a) * way).sum(-1) / (way**2).sum(-1), 0, 1)
    return np.linalg.norm(points[:, None] - a - share[..., None] * way, axis=-1).min(axis=1)


@pytest.mark.parametrize("bend", [0.0, 0.8, 1.8, 3.0])
@pytest.mark.parametrize("width", [8.0, 30.0])
def test_the_middle_of_a_thick_arc_is_the_arc(bend, width):
    true = arc(bend, turn=0.3)
    line = medial.medial_line(stroke(true, width))
    inner = line[4:-4]
    assert distance(inner, true).max() < 1.0  # pixels
    assert np.linalg.norm(line[0] - true[0]) < 0.7 * width and np.linalg.norm(line[-1] - true[-1]) < 0.7 * width
    assert medial.arc_length(line)[-1] == pytest.approx(170 + width, abs=0.06 * 170)


def test_a_hard_mask_is_as_good_as_a_soft_one():
    true = arc(1.4)
    for matte in (stroke(true) > 0.5, (stroke(true) * 255).astype(np.uint8)):
        assert distance(medial.medial_line(matte)[4:-4], true).max() < 1.0


def test_the_points_are_evenly_spaced():
    line = medial.medial_line(stroke(arc(2.0)), count=31)
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    assert line.shape == (31, 2) and np.ptp(steps) < 0.02 * steps.mean()


def test_the_line_of_a_box_runs_from_side_to_side_and_not_into_a_corner():
    box = maps.move(maps.place(maps.turn(0.4), (0, 0), (160, 130)), [(-80, -15), (80, -15), (80, 15), (-80, 15)])
    line = medial.medial_line(render.matte([Fill(box, (0, 0, 0))], SIZE))
    level = (line - (160, 130)) @ maps.turn(0.4)
    assert np.abs(level[:, 1]).max() < 1.0 and np.abs(np.abs(level[[0, -1], 0]) - 80).max() < 1.5


def test_short_limbs_and_whiskers_do_not_draw_the_line_aside():
    true = arc(0.5)
    limb = np.array([[160, 130], [185, 120]])
    hair = np.array([[160, 60], [230, 45]])
    matte = render.matte([Ink(true, (0, 0, 0), 30), Ink(limb, (0, 0, 0), 10), Ink(hair, (0, 0, 0), 1.5)], SIZE)
    assert distance(medial.medial_line(matte)[4:-4], true).max() < 2.5


def test_given_ends_are_where_the_line_starts_and_stops():
    true = arc(1.0, length=200)
    limb = np.column_stack([np.linspace(160, 290, 30), np.linspace(130, 130, 30)])
    matte = render.matte([Ink(true, (0, 0, 0), 26), Ink(limb, (0, 0, 0), 14)], SIZE)
    ends = np.array([true[0], true[-1]])
    line = medial.medial_line(matte, ends)
    assert np.allclose(line[[0, -1]], ends, atol=0.01) and distance(line, true).max() < 2.5


def test_over_time_the_ends_never_swap_even_through_a_full_turn():
    turns = np.linspace(0, 2 * np.pi, 33)
    true = np.stack([arc(1.2 * np.sin(turn), turn=turn) for turn in turns])
    lines = medial.medial_lines([stroke(line) for line in true])
    assert np.linalg.norm(lines[:, 0] - true[:, 0], axis=-1).max() < 21
    assert np.linalg.norm(lines[:, -1] - true[:, -1], axis=-1).max() < 21
    assert max(distance(line[4:-4], curve).max() for line, curve in zip(lines, true)) < 1.0


def test_a_first_pair_of_ends_says_which_way_the_line_runs():
    true = np.stack([arc(0.6, turn=turn) for turn in np.linspace(0, 0.5, 4)])
    mattes = [stroke(line) for line in true]
    up = medial.medial_lines(mattes)
    down = medial.medial_lines(mattes, ends=true[0, [-1, 0]])
    assert np.allclose(up, down[:, ::-1], atol=0.5) and (up[:, 0, 1] > up[:, -1, 1]).all()


def test_steadying_leaves_an_even_travel_alone_and_halves_flicker():
    still = arc(0.7, count=20)
    travel = still + np.arange(30)[:, None, None] * [2.0, -1.0]
    assert np.allclose(medial.steadied(travel, 2.0), travel, atol=1e-9)
    noise = np.random.default_rng(5).normal(size=travel.shape)
    left = medial.steadied(travel + noise, 1.5) - travel
    assert np.diff(left, 2, axis=0).std() < 0.3 * np.diff(noise, 2, axis=0).std()


@pytest.mark.parametrize(
    "give",
    [
        lambda: medial.medial_line(np.zeros((50, 50))),
        lambda: medial.medial_line(np.ones((5, 5, 3))),
        lambda: medial.medial_line(stroke(arc(0.5)), np.array([[10.0, 10.0], [10.0, 10.0]])),
        lambda: medial.medial_line(stroke(arc(0.5)), np.array([[10.0, np.nan], [10.0, 10.0]])),
        lambda: medial.medial_lines([]),
        lambda: medial.medial_lines([stroke(arc(0.5))] * 2, np.zeros((3, 2, 2))),
    ],
)
def test_what_has_no_medial_line_is_refused_in_one_sentence(give):
    with pytest.raises(InputError):
        give()
