"""A whole clip at once: less jitter, no lag, the same three constraints, and the time it takes grows with T alone."""

from time import process_time

import numpy as np
import pytest

from capture.fit.shapes import smooth_weights
from capture.fit.shapes.weights import fit_smooth, fit_weights, supports
from capture.motion import keys

LOW, HIGH = -0.5, 1.5


def poses(count=4, inbetweens=3):
    """A blob of 30 points in `count` poses, some 20 pixels apart, and the rows between them."""
    angle = np.linspace(0, 2 * np.pi, 30, endpoint=False)
    base = np.column_stack([100 * np.cos(angle), 70 * np.sin(angle)])
    drawn = [
        base + 40 * np.column_stack([np.cos(k * angle + k), np.sin((k + 1) * angle)]) * (k > 0) for k in range(count)
    ]
    rows = keys.inbetween_rows(count, inbetweens)
    i, j, s = rows[:, 0].astype(int), rows[:, 1].astype(int), rows[:, 2, None, None]
    drawn, bend = np.array(drawn), 12 * np.sin(3 * angle)[:, None] * (1, -1)
    return rows, (1 - s) * drawn[i] + s * drawn[j] + 4 * s * (1 - s) * bend


ROWS, SHAPES = poses()


def along(way):
    """The shapes (T, N, 2) on the way from pose to pose: 1.3 is 0.3 of the way from pose 1 to pose 2."""
    found = np.empty((len(way), *SHAPES.shape[1:]))
    for t, at in enumerate(np.clip(way, 0, 3 - 1e-9)):
        chain = chain_of(int(at))
        step = (at - int(at)) * (len(chain) - 1)
        part = step - int(step)
        found[t] = (1 - part) * SHAPES[chain[int(step)]] + part * SHAPES[chain[int(step) + 1]]
    return found


def chain_of(i):
    between = np.flatnonzero((ROWS[:, :2] == (i, i + 1)).all(axis=1))
    return [i, *between, i + 1]


def mixed(weights):
    return np.tensordot(weights, SHAPES, axes=1)


def jitter(error):
    """Root of the mean squared second difference over time."""
    return np.sqrt(np.mean(np.diff(error, 2, axis=0) ** 2))


def eased(frames=120):
    """From pose 0 to pose 3 and back, slowly at the ends."""
    return 1.5 - 1.5 * np.cos(2 * np.pi * np.arange(frames) / frames)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("half_width", [1.0, 2.4])
def test_jitter_is_at_most_half(seed, half_width):
    true = along(eased())
    noisy = true + np.random.default_rng(seed).normal(0, 4, true.shape)
    plain, smooth = fit_weights(noisy, SHAPES, ROWS), fit_smooth(noisy, SHAPES, ROWS, half_width)
    assert jitter(mixed(smooth) - true) < 0.5 * jitter(mixed(plain) - true)
    corners_cut = 1.0 if half_width == 1.0 else 1.1  # the way turns sharply at every pose
    assert np.std(mixed(smooth) - true) < corners_cut * np.std(mixed(plain) - true)
    folded = [keys.fold(ROWS, w, 4) for w in (smooth, plain)]
    assert jitter(folded[0]) < 0.5 * jitter(folded[1])


def test_nothing_lags_behind():
    way = 1.5 + 1.2 * np.sin(2 * np.pi * np.arange(160) / 24)
    true = along(way)
    smooth = mixed(fit_smooth(true + np.random.default_rng(0).normal(0, 3, true.shape), SHAPES, ROWS, 2.0))
    speed = [np.diff(shapes, axis=0).reshape(159, -1) for shapes in (true, smooth)]
    alike = {shift: np.sum(speed[0][10:-10] * speed[1][10 + shift : 149 + shift]) for shift in range(-5, 6)}
    assert max(alike, key=alike.get) == 0
    assert np.isclose(alike[1], alike[-1], rtol=0.02)  # and it leans neither way


def test_a_fast_move_keeps_its_peak():
    """From pose 0 to half-way and back within 16 frames: smoothing over 1.5 frames takes off a few percent."""
    bump = np.where(np.abs(np.arange(80) - 40) < 8, 0.5 + 0.5 * np.cos(np.pi * (np.arange(80) - 40) / 8), 0.0)
    true = along(bump)
    smooth = fit_smooth(true, SHAPES, ROWS, 1.5)
    folded = keys.fold(ROWS, smooth, 4)[:, 1]
    assert folded.argmax() == 40 and folded.max() > 0.95
    assert np.linalg.norm(mixed(smooth)[40] - true[40]) < 0.05 * np.linalg.norm(true[40] - true[0])


def test_an_error_in_one_frame_falls_to_half_at_the_half_width():
    """Two keys in a straight line, weights far from their bounds: the filter is linear and its kernel can be seen."""
    shapes, rows = SHAPES[:2], keys.inbetween_rows(2, 0)
    way = np.full(61, 0.5)
    way[30] = 0.7
    tracked = (1 - way)[:, None, None] * shapes[0] + way[:, None, None] * shapes[1]
    for half_width in (2, 3, 5):
        kernel = fit_smooth(tracked, shapes, rows, half_width)[:, 1] - 0.5
        assert kernel.argmax() == 30 and np.allclose(kernel, kernel[::-1], atol=1e-7)
        assert np.isclose(
            kernel[30 + half_width] / kernel[30], 0.5, atol=0.05
        )  # the formula is that of continuous time
        assert np.isclose(kernel.sum(), 0.2, atol=1e-6)


def test_an_even_motion_is_left_as_it_is():
    shapes, rows = SHAPES[:2], keys.inbetween_rows(2, 0)
    s = np.linspace(-0.2, 1.3, 40)
    true = np.column_stack([1 - s, s])
    assert np.allclose(fit_smooth(np.tensordot(true, shapes, axes=1), shapes, rows, 4.0), true, atol=1e-6)


def test_no_smoothness_is_frame_by_frame():
    noisy = along(eased(30)) + np.random.default_rng(1).normal(0, 4, (30, *SHAPES.shape[1:]))
    assert np.array_equal(fit_smooth(noisy, SHAPES, ROWS, 0.0), fit_weights(noisy, SHAPES, ROWS, simpler=1.06))
    for frames in (1, 2):
        assert fit_smooth(noisy[:frames], SHAPES, ROWS, 2.0).shape == (frames, len(ROWS))


@pytest.mark.parametrize("most", [1, 2, 3, 4])
def test_the_three_constraints_hold(most):
    noisy = along(eased(60)) + np.random.default_rng(most).normal(0, 60, (60, *SHAPES.shape[1:]))
    weights = fit_smooth(noisy, SHAPES, ROWS, 2.0, most)
    assert np.allclose(weights.sum(axis=1), 1, atol=1e-7)
    assert weights.min() >= LOW - 1e-9 and weights.max() <= HIGH + 1e-9
    allowed = [set(support) for support in supports(ROWS, most)]
    assert all(any(set(np.flatnonzero(frame)) <= support for support in allowed) for frame in weights)


def test_the_program_is_the_one_that_cvxpy_solves_where_there_is_one_support():
    import cvxpy as cp

    shapes, rows, power = SHAPES[:3], keys.inbetween_rows(3, 0), smooth_weights.strength(1.7)
    tracked = along(eased(25)) + np.random.default_rng(3).normal(0, 30, (25, *SHAPES.shape[1:]))
    w, flat = cp.Variable((25, 3)), shapes.reshape(3, -1) / 100
    shape = w @ flat
    misfit = cp.sum_squares(shape - tracked.reshape(25, -1) / 100)
    wish = misfit + power * cp.sum_squares(shape[:-2] - 2 * shape[1:-1] + shape[2:])
    cp.Problem(cp.Minimize(wish), [cp.sum(w, axis=1) == 1, w >= LOW, w <= HIGH]).solve(solver="CLARABEL")
    assert np.allclose(fit_smooth(tracked, shapes, rows, 1.7, simpler=1.0), w.value, atol=1e-4)


def test_what_it_minimises_is_less_than_for_weights_found_frame_by_frame():
    noisy = along(eased(80)) + np.random.default_rng(5).normal(0, 8, (80, *SHAPES.shape[1:]))

    def whole(weights):
        second = np.diff(mixed(weights), 2, axis=0)
        return np.sum((mixed(weights) - noisy) ** 2) + smooth_weights.strength(2.0) * np.sum(second**2)

    each = smooth_weights.Spacing(np.ones(80), np.ones(79), smooth_weights.strength(2.0))
    evened = smooth_weights.even(noisy, each)
    smooth = whole(fit_smooth(noisy, SHAPES, ROWS, 2.0))
    assert smooth < whole(fit_weights(noisy, SHAPES, ROWS)) and smooth < whole(fit_weights(evened, SHAPES, ROWS))


def test_on_twos_the_steps_stay_steps_and_jitter_is_at_most_half():
    """Smoothed as if every frame were a drawing, a cartoon on twos and ones would be smeared."""
    drawing = np.cumsum(np.isin(np.arange(160) % 8, (0, 2, 4, 5, 6)))
    shown = np.searchsorted(drawing, drawing)  # the first frame with that drawing
    true = along(1.5 + 1.3 * np.sin(2 * np.pi * shown / 160))
    noisy = true + np.random.default_rng(0).normal(0, 6, true.shape)
    plain = jitter(mixed(fit_weights(noisy, SHAPES, ROWS)) - true)
    smooth = fit_smooth(noisy, SHAPES, ROWS, 1.2, drawing=drawing)
    assert np.array_equal(smooth, smooth[shown])
    smeared = jitter(mixed(fit_smooth(noisy, SHAPES, ROWS, 1.2)) - true)
    assert jitter(mixed(smooth) - true) < 0.5 * min(plain, smeared)


def test_drawings_held_for_two_frames_each_are_a_clip_at_half_the_rate():
    few = along(eased(40)) + np.random.default_rng(7).normal(0, 4, (40, *SHAPES.shape[1:]))
    twos = fit_smooth(np.repeat(few, 2, axis=0), SHAPES, ROWS, 3.0, drawing=np.repeat(np.arange(40), 2))
    assert np.allclose(mixed(twos[::2]), mixed(fit_smooth(few, SHAPES, ROWS, 1.5)), atol=0.01)  # pixels


def test_one_key_has_weight_one():
    assert np.allclose(fit_smooth(SHAPES[[0, 1, 2]], SHAPES[:1], ROWS[:1], 2.0), np.ones((3, 1)))


def test_four_times_the_clip_takes_about_four_times_as_long():
    noisy = along(eased(800)) + np.random.default_rng(2).normal(0, 4, (800, *SHAPES.shape[1:]))

    def seconds(frames):
        times = []
        for _ in range(3):
            start = process_time()
            fit_smooth(noisy[:frames], SHAPES, ROWS, 2.0)
            times.append(process_time() - start)
        return min(times)

    seconds(10)  # imports
    assert seconds(800) < 8 * seconds(200)
