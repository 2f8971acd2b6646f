"""Whole clips of contours: the frog under noise, preservation of volume, the convex start."""

import numpy as np
import pytest

from capture.errors import InputError
from capture.fit import contour
from capture.fit.shapes.convex_start import convex_start
from capture.fit.shapes.weights import supports
from capture.motion import affine, keys
from fixtures import frog, maps


@pytest.fixture(scope="module")
def part():
    return frog.frog().parts[0]


@pytest.fixture(scope="module")
def seen(part):
    """The frog's key set without an inside, and its outlines on the key set's points."""
    return contour.outline_keys(part.points, part.key_frames, part.key_names)


def off(part, keyset, weights) -> np.ndarray:
    return keys.fold(keyset.rows, weights, len(keyset.names)) - part.weights


def jitter(error: np.ndarray) -> float:
    return float(np.sqrt((np.diff(error, 2, axis=0) ** 2).mean()))


def test_the_frogs_weights_come_back_from_noisy_contours(part, seen):
    keyset, truth = seen
    found = []
    for seed in range(8):
        noisy = truth + np.random.default_rng(seed).normal(size=truth.shape)
        _, weights = contour.capture_points(noisy, keyset)
        found.append(np.percentile(np.abs(off(part, keyset, weights)).max(axis=1), 95))
    print(f"\nfrog, contours with 1 px of noise: weights off by p95 {np.round(found, 3)}, by seed")
    assert max(found) < 0.05


def test_smoothness_halves_the_jitter_of_the_frogs_weights_and_does_not_lag(part, seen):
    keyset, truth = seen
    ratios, lags = [], []
    for seed in range(8):
        noisy = truth + np.random.default_rng(seed).normal(size=truth.shape)
        _, rough = contour.capture_points(noisy, keyset, drawing=part.drawing)
        _, smooth = contour.capture_points(noisy, keyset, smoothness=0.7, drawing=part.drawing)
        ratios.append(jitter(off(part, keyset, smooth)) / jitter(off(part, keyset, rough)))
        lags.append(_lag(keys.fold(keyset.rows, smooth, len(keyset.names)), part.weights))
    print(f"\nfrog: smoothing leaves {np.mean(ratios):.2f} of the weights' jitter, by seed {np.round(ratios, 2)}")
    assert np.mean(ratios) <= 0.5
    assert lags == [0] * 8


def test_smoothness_halves_the_jitter_of_a_motion_that_the_keys_can_redraw(seen):
    keyset, _ = seen
    shapes = keys.shapes(keyset)
    pairs, along = keyset.rows[:, :2], keyset.rows[:, 2]
    chain = [0, *np.flatnonzero((pairs == (0, 1)).all(axis=1) & (along > 0)), 1]
    swing = (len(chain) - 1) * (0.5 - 0.5 * np.cos(np.linspace(0, 4 * np.pi, 72)))
    true = np.zeros((72, len(shapes)))
    for t, s in enumerate(swing):
        low = min(int(s), len(chain) - 2)
        true[t, chain[low]], true[t, chain[low + 1]] = 1 - (s - low), s - low
    tracked = np.tensordot(true, shapes, axes=1)
    folded = keys.fold(keyset.rows, true, 4)
    noisy = tracked + np.random.default_rng(0).normal(0, 2, tracked.shape)
    _, rough = contour.capture_points(noisy, keyset)
    _, smooth = contour.capture_points(noisy, keyset, smoothness=2.0)
    before, after = (jitter(keys.fold(keyset.rows, found, 4) - folded) for found in (rough, smooth))
    assert after <= 0.5 * before
    assert _lag(keys.fold(keyset.rows, smooth, 4), folded) == 0


def _lag(found: np.ndarray, true: np.ndarray) -> int:
    """By how many frames the found weights (T, K) trail the true ones: where they correlate best."""
    found, true = found - found.mean(axis=0), true - true.mean(axis=0)
    alike = [(found[3 + lag : len(true) - 3 + lag] * true[3:-3]).sum() for lag in (-2, -1, 0, 1, 2)]
    return int(np.argmax(alike)) - 2


def test_a_model_point_comes_back_with_its_parameters(seen):
    keyset, _ = seen
    shapes, rng = keys.shapes(keyset), np.random.default_rng(0)
    allowed = supports(keyset.rows)
    true = np.zeros((40, len(shapes)))
    for t in range(40):
        support = allowed[rng.integers(len(allowed))]
        true[t, support] = rng.dirichlet(np.ones(len(support)))
    linear = np.eye(2) + rng.normal(0, 0.3, (40, 2, 2))
    placed = np.concatenate([linear, rng.normal(0, 100, (40, 2, 1))], axis=-1)
    tracked = affine.apply(placed, np.tensordot(true, shapes, axes=1))
    found_maps, found = contour.capture_points(tracked, keyset)
    assert np.abs(affine.apply(found_maps, np.tensordot(found, shapes, axes=1)) - tracked).max() < 1e-3
    assert np.abs(keys.fold(keyset.rows, found - true, len(keyset.names))).max() < 1e-4


def test_the_convex_start_alone_is_exact_for_model_points(seen):
    keyset, _ = seen
    shapes = keys.shapes(keyset)
    flat = affine.apply(np.array([[0.5, 0.8, 9], [-0.3, 0.4, -7.0]]), shapes)
    found = convex_start(flat, shapes, keyset.rows)
    want = keys.fold(keyset.rows, np.eye(len(shapes)), len(keyset.names))
    assert np.abs(keys.fold(keyset.rows, found, len(keyset.names)) - want).max() < 1e-6


def test_with_volume_preserved_a_part_only_turns_and_moves():
    ball = maps.ellipse((0, 0), 50, 50, 60)
    flat = maps.ellipse((0, 0), 65, 50 * 50 / 65, 60)
    turns = np.linspace(0, 2, 9)
    amounts = np.abs(np.sin(3 * turns))
    outlines = []
    for angle, amount in zip(turns, amounts):
        drawn = (1 - amount) * ball + amount * flat
        outlines.append(drawn @ maps.turn(angle).T + (20 * angle, 5))
    tracked = np.stack(outlines)
    keyset = keys.keyset(("round", "flat"), np.stack([ball, flat]), inbetweens=7, keeps_stretch=True)
    points = np.concatenate([tracked, np.zeros((9, keyset.points.shape[1] - 60, 2))], axis=1)
    edge = keyset.points.shape[1] - 60  # carry the inside along: it is not looked at by this test
    mixed = np.einsum("t,nd->tnd", 1 - amounts, keyset.points[0]) + np.einsum("t,nd->tnd", amounts, keyset.points[1])
    placed = np.stack([np.column_stack([maps.turn(a), (20 * a, 5)]) for a in turns])
    points[:, 60:] = affine.apply(placed, mixed)[:, 60:]
    assert edge > 0
    found, weights = contour.capture_points(points, keyset)
    assert np.allclose(found[:, :, :2] @ found[:, :, :2].swapaxes(1, 2), np.eye(2))
    assert np.allclose(np.linalg.det(found[:, :, :2]), 1)
    assert np.abs(keys.fold(keyset.rows, weights, 2)[:, 1] - amounts).max() < 0.05


def test_a_clip_of_outlines_becomes_a_motion(part):
    motion = contour.capture_outlines(part.points, part.key_frames)
    assert motion.tracks[0].held.sum() == (np.diff(part.drawing) == 0).sum()
    assert np.median(motion.tracks[0].residual) < 0.3
    assert np.abs(motion.points("character")[:, : part.points.shape[1]] - part.points).max() < 3


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda outlines: np.where(np.arange(len(outlines))[:, None, None] == 3, np.nan, outlines), "frame 3"),
        (lambda outlines: outlines[:, :7], "like the key set's"),
    ],
)
def test_points_that_cannot_be_captured_are_refused(part, seen, change, told: str):
    with pytest.raises(InputError, match=told):
        contour.capture_points(change(seen[1].copy()), seen[0])


def test_keys_of_different_topology_are_refused(part):
    with pytest.raises(InputError, match="sit 110, crouch 50"):
        keys.keyset(("sit", "crouch"), [part.points[0], part.points[12][:50]])


def test_more_rows_at_a_time_than_there_are_keys_are_refused(seen):
    keyset, truth = seen
    with pytest.raises(InputError, match="between 1 and the 4 that can be mixed, 9 came"):
        contour.capture_points(truth[:2], keyset, most=9)


def test_bounds_that_exclude_a_sum_of_one_are_refused(seen):
    keyset, truth = seen
    with pytest.raises(InputError, match="sum to 1"):
        contour.capture_points(truth[:2], keyset, bounds=(-0.5, 0.2))
