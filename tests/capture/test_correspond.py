"""Contours of different point counts, starts and ways round are laid on each other point by point."""

from functools import lru_cache

import numpy as np
import pytest

from capture.errors import InputError
from capture.fit.curves import correspond, monotone
from capture.pictures import contours
from fixtures import frog, maps


@lru_cache
def frog_points():
    """The frog's true outlines (T, N, 2)."""
    return frog.frog().parts[0].points


def messy(outline, rng, noise=0.5):
    """The outline with another number of points, another start, either way round, and noise in pixels."""
    points = maps.even(outline, rng.integers(130, 260))
    points = np.roll(points + noise * rng.normal(size=points.shape), rng.integers(len(points)), axis=0)
    return points[::-1] if rng.random() < 0.5 else points


def place_of(points, outline):
    """Fractional indices (n,) of the places on a dense copy of the outline nearest to points (n, 2)."""
    index = np.arange(0, len(outline), 0.02)
    dense = correspond.places(outline, index)
    return index[((points[:, None] - dense) ** 2).sum(axis=2).argmin(axis=1)]


def bumpy(count, start=0.0):
    """A circle of radius 60 with one bump, begun anywhere, and the angle (count,) of each point."""
    angle = start + np.linspace(0, 2 * np.pi, count, endpoint=False)
    radius = 60 + 25 * np.exp(-((np.angle(np.exp(1j * (angle - 1.0))) / 0.3) ** 2))
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)]), angle


def test_a_frog_is_matched_with_its_other_poses_however_they_were_traced():
    points, rng = frog_points(), np.random.default_rng(3)
    off = []
    for t in frog.frog().parts[0].key_frames[1:]:
        target = messy(points[t], rng)
        found = correspond.places(target, correspond.match(points[0], target))
        off.append(np.linalg.norm(found - points[t], axis=1))
    assert np.median(off) < 4 and np.percentile(off, 95) < 16  # pixels, of an outline of 780


def test_a_whole_clip_of_contours_keeps_its_points_without_drift():
    points, rng = frog_points(), np.random.default_rng(4)
    clip = [points[0], *(messy(outline, rng) for outline in points[1:])]
    clockwise = contours.signed_area(points[0]) > 0
    aligned = correspond.align_all(clip, count=len(points[0]))
    rest = points[0] if clockwise else np.roll(points[0, ::-1], 1, axis=0)
    assert np.allclose(aligned[0], maps.even(rest, len(rest)))
    at = place_of(aligned[0], points[0])
    truth = np.stack([correspond.places(outline, at) for outline in points])
    off = np.linalg.norm(aligned - truth, axis=-1)
    assert np.median(off) < 2.5 and np.median(off[-10:]) < 3.0 and np.median(off, axis=1).max() < 8
    assert all(contours.signed_area(outline) > 0 for outline in aligned)


def test_any_frame_can_be_the_reference_and_keys_are_matched_with_it_directly():
    points, rng = frog_points()[:30:3], np.random.default_rng(5)
    clip = [messy(outline, rng) for outline in points]
    for keys in ((), (0, 9)):
        aligned = correspond.align_all(clip, 60, reference=4, keys=keys)
        at = place_of(aligned[4], points[4])
        off = [np.median(np.linalg.norm(correspond.places(p, at) - found, axis=1)) for p, found in zip(points, aligned)]
        assert np.median(off) < 3 and np.max(off) < 9  # pixels


@pytest.mark.parametrize("seed", range(4))
def test_one_bump_is_enough_to_find_the_start(seed):
    rng = np.random.default_rng(seed)
    source, angle = bumpy(rng.integers(90, 200), rng.uniform(0, 6))
    target, truth = bumpy(rng.integers(90, 200), rng.uniform(0, 6))
    away = maps.place(rng.uniform(0.4, 3) * maps.turn(rng.uniform(-3, 3)), (0, 0), 300 * rng.normal(size=2))
    at = correspond.match(source, maps.move(away, target)[::-1])
    found = np.interp(
        len(target) - 1 - at, np.arange(-1, len(target) + 1), np.unwrap(np.r_[truth[-1], truth, truth[0]])
    )
    assert np.abs(np.angle(np.exp(1j * (found - angle)))).max() < 0.03  # radians


def test_a_curve_matched_with_itself_stays_where_it_is():
    outline = frog_points()[0]
    at = correspond.match(outline, outline)
    assert np.abs((at - np.arange(len(outline)) + 50) % len(outline) - 50).max() < 0.25


def test_curves_that_stand_alike_are_matched_top_to_top():
    """Both are long and round; one's bump is at the top, the other's at the bottom."""
    angle = np.linspace(0, 2 * np.pi, 120, endpoint=False)
    long = np.stack([np.cos(angle), 2 * np.sin(angle)], axis=-1)
    bump = np.exp(-((np.angle(np.exp(1j * (angle - np.pi / 2))) / 0.25) ** 2))[:, None]
    source, target = long * (1 + 0.2 * bump), -long * (1 + 0.2 * bump)
    by_looks = correspond.places(target, correspond.match(source, target))
    upright = correspond.places(target, correspond.match(source, target, laid=30.0))
    assert (by_looks * source).sum() < 0 < (upright * source).sum()


def test_positions_run_once_round():
    source, _ = bumpy(70)
    target, _ = bumpy(133, 2.0)
    at = correspond.match(source, target)
    steps = (np.roll(at, -1) - at) % len(target)
    assert (steps > 0).all() and np.isclose(steps.sum(), len(target))


def test_pins_are_obeyed_exactly_even_where_they_are_wrong():
    points = frog_points()
    pins = [(10, 33.25), (40, 60), (75, 99.5)]
    at = correspond.match(points[0], points[26], pins=pins)
    assert [at[a] for a, _ in pins] == [b for _, b in pins]
    steps = (np.roll(at, -1) - at) % len(points[26])
    assert (steps > 0).all() and np.isclose(steps.sum(), len(points[26]))
    nose = points[0, 20] + (0.3, -0.2)
    at = correspond.match(points[0], points[26], pins=[(nose, points[26, 20] + 0.01)])
    assert abs(at[20] - 20) < 0.05


def test_pins_of_a_clip_are_obeyed_in_their_frames():
    points, rng = frog_points()[::10], np.random.default_rng(6)
    clip = [points[0], *(messy(outline, rng) for outline in points[1:])]
    held = {2: [(7, 100)], 5: [(50, 20)]}
    aligned = correspond.align_all(clip, 60, pins=held)
    assert np.array_equal(aligned[2, 7], clip[2][100]) and np.array_equal(aligned[5, 50], clip[5][20])


def test_pins_that_cross_are_refused():
    points = frog_points()
    with pytest.raises(InputError, match="same order"):
        correspond.match(points[0], points[26], pins=[(10, 10), (30, 60), (60, 30)])
    with pytest.raises(InputError, match="index from 0 to"):
        correspond.match(points[0], points[26], pins=[(10, 1000)])
    with pytest.raises(InputError, match="frames 0 to 1"):
        correspond.align_all([points[0], points[1]], pins={7: [(0, 0)]})


@pytest.mark.parametrize("seed", range(4))
def test_open_curves_are_matched_either_way_round(seed):
    rng = np.random.default_rng(seed)
    s = np.linspace(0, 1, 300)

    def hook(u, bend):
        angle = bend * u + 2.5 * u**3
        return 200 / len(u) * np.cumsum(np.column_stack([np.cos(angle), np.sin(angle)]), axis=0)

    source, bent = maps.even(hook(s, 0.3), 80, closed=False), maps.even(hook(s, 1.0), 131, closed=False)
    bent = bent + 0.3 * rng.normal(size=bent.shape)
    found = correspond.places(bent[::-1], correspond.match(source, bent[::-1], closed=False), closed=False)
    truth = maps.even(bent, 80, closed=False)
    assert np.linalg.norm(found - truth, axis=1).max() < 8 and np.allclose(found[[0, -1]], bent[[0, -1]])


def test_an_open_clip_keeps_its_direction():
    lines = [
        np.column_stack([np.linspace(0, 200, 50 + t), 30 * np.sin(np.linspace(0, 6.3, 50 + t) + 0.1 * t)])
        for t in range(12)
    ]
    aligned = correspond.align_all([line[::-1] if t % 2 else line for t, line in enumerate(lines)], 40, closed=False)
    assert aligned.shape == (12, 40, 2)
    assert np.allclose(aligned[:, 0], [line[0] for line in lines]) and np.allclose(
        aligned[:, -1], [line[-1] for line in lines]
    )


def test_a_held_drawing_is_held():
    points = frog_points()
    aligned = correspond.align_all([points[0], points[8], points[8], points[8]], 50)
    assert np.array_equal(aligned[1], aligned[2]) and np.array_equal(aligned[2], aligned[3])


def test_the_compiled_paths_are_those_of_the_plain_loops():
    rng = np.random.default_rng(0)
    for closed in (True, False):
        cost, nominal = rng.random((9, 27)), np.full(9 if closed else 8, 3.0 if closed else 3.25)
        base = np.rint(np.append(0, np.cumsum(nominal))).astype(int)
        starts = np.arange(27) if closed else np.zeros(1, int)
        tolls = monotone.STRETCH * np.log(np.arange(1, 13) / nominal[:, None]) ** 2
        slow = monotone._paths(cost, base, starts, 6, tolls, closed)
        fast = monotone._compiled()(cost, base, starts, 6, tolls, closed)
        assert np.array_equal(slow[0], fast[0]) and np.allclose(slow[1], fast[1])


def test_the_path_is_the_cheapest_of_all_that_there_are():
    """A second opinion: every path of a small open problem, one by one."""
    from itertools import product

    rng = np.random.default_rng(1)
    cost, nominal = rng.random((5, 13)), np.full(4, 3.0)
    paths, sums = monotone._cheapest(cost, np.arange(0, 13, 3), np.zeros(1, int), 13, nominal, closed=False)
    best = min(
        sum(cost[np.arange(5), np.append(0, np.cumsum(steps))])
        + monotone.STRETCH * (np.log(np.array(steps) / 3.0) ** 2).sum()
        for steps in product(range(1, 13), repeat=4)
        if sum(steps) == 12
    )
    assert np.isclose(sums[0], best)
    assert np.isclose(
        cost[np.arange(5), paths[0]].sum() + monotone.STRETCH * (np.log(np.diff(paths[0]) / 3.0) ** 2).sum(), best
    )


@pytest.mark.parametrize(
    "curve, closed, sentence",
    [
        ([[0, 0], [1, 1]], True, "at least 3 different points, got 2"),
        ([[3, 3]] * 9, True, "all its 9 points are equal"),
        ([[0, 0], [np.nan, 1], [2, 5]], True, "point 1 holds NaN"),
        (np.zeros((5, 3)), True, "shape"),
        ([[0, 0]], False, "points are equal"),
    ],
)
def test_what_is_no_curve_is_refused_in_a_sentence(curve, closed, sentence):
    good = bumpy(50)[0]
    for pair in ((good, curve), (curve, good)):
        with pytest.raises(InputError, match=sentence):
            correspond.match(*pair, closed=closed)
