"""Points that the model can make are explained exactly: map and weights both."""

from functools import lru_cache

import numpy as np
import pytest

from capture.fit.contour import BOUNDS, capture_points, loosened
from capture.fit.shapes.weights import supports
from capture.motion import keys
from fixtures import hat, maps


@lru_cache
def hat_keys():
    """The hat's three keys, bent twice as far as in its cartoon, and their rows redrawn (D, N, 2)."""
    drawn = np.stack([hat.bent(hat.outline(60), *bend) for bend in 2 * hat.BEND])
    made = keys.keyset(("rest", "bent", "lean"), drawn, spacing=14.0)
    return made, keys.shapes(made)


def flights(rng, count):
    """Maps (T, 2, 3) that turn any way round, stretch, shear and travel."""
    return np.stack(
        [
            np.column_stack(
                [maps.turn(rng.uniform(-3, 3)) @ (np.eye(2) + 0.2 * rng.normal(size=(2, 2))), 100 * rng.normal(size=2)]
            )
            for _ in range(count)
        ]
    )


def mixes(rng, count):
    """Weights (T, D), each over one of the supports there are."""
    made, _ = hat_keys()
    allowed = supports(made.rows)
    weights = np.zeros((count, len(made.rows)))
    for frame in weights:
        support = allowed[rng.integers(len(allowed))]
        frame[support] = rng.dirichlet(np.ones(len(support)))
    return weights


@pytest.mark.parametrize("seed", range(5))
def test_map_and_weights_of_model_points_are_found_again(seed):
    rng = np.random.default_rng(seed)
    made, shapes = hat_keys()
    true_maps, true_weights = flights(rng, 20), mixes(rng, 20)
    tracked = maps.move(true_maps, np.tensordot(true_weights, shapes, axes=1))
    placed, weights = capture_points(tracked, made)
    redrawn = maps.move(placed, np.tensordot(weights, shapes, axes=1))
    assert np.linalg.norm(redrawn - tracked, axis=-1).max() < 0.01  # pixels
    assert np.abs(keys.fold(made.rows, weights - true_weights, 3)).max() < 1e-3
    assert np.allclose(placed, true_maps, atol=0.05)
    further, exact = capture_points(tracked, made, rounds=15)
    assert np.allclose(exact, true_weights, atol=1e-6) and np.allclose(further, true_maps, atol=1e-6)


def test_a_good_start_needs_one_round():
    rng = np.random.default_rng(9)
    made, shapes = hat_keys()
    true_maps, true_weights = flights(rng, 5), mixes(rng, 5)
    tracked = maps.move(true_maps, np.tensordot(true_weights, shapes, axes=1))
    placed, weights = capture_points(tracked, made, start=true_maps, rounds=1)
    assert np.allclose(placed, true_maps, atol=1e-6) and np.allclose(weights, true_weights, atol=1e-6)


def test_what_a_key_turned_by_when_it_was_drawn_does_not_stick_to_the_weights():
    """The same cartoon, captured with a key that was drawn lying on its side and elsewhere."""
    made, shapes = hat_keys()
    away = maps.place(maps.turn(2.0), (0, 0), (200, 50))
    drawn = maps.move(made.removed, made.points)[:, made.outline]
    drawn[1] = maps.move(away, drawn[1])
    again = keys.keyset(made.names, drawn, spacing=14.0)
    (before, weights), (after, same) = (capture_points(shapes[[1, 4, 9]], one) for one in (made, again))
    assert np.allclose(weights, same, atol=1e-6) and np.allclose(before, after, atol=1e-4)


def test_noise_moves_the_weights_a_little_and_no_more():
    rng = np.random.default_rng(1)
    made, shapes = hat_keys()
    true_maps, true_weights = flights(rng, 30), mixes(rng, 30)
    tracked = maps.move(true_maps, np.tensordot(true_weights, shapes, axes=1))
    _, weights = capture_points(tracked + 0.25 * rng.normal(size=tracked.shape), made)
    off = np.abs(keys.fold(made.rows, weights - true_weights, 3)).max(axis=1)
    assert np.median(off) < 0.01 and off.max() < 0.1


def test_one_key_leaves_only_the_map():
    rng = np.random.default_rng(2)
    made = keys.keyset(("only",), hat.outline(60)[None], spacing=14.0)
    true_maps = flights(rng, 4)
    placed, weights = capture_points(maps.move(true_maps, made.points[0]), made)
    assert np.allclose(placed, true_maps) and np.array_equal(weights, np.ones((4, 1)))


def test_a_little_of_all_rows_brings_what_three_leave():
    """Shapes pushed about: dear weights change nothing, cheap ones come nearer, all within the bounds."""
    rng = np.random.default_rng(6)
    made, shapes = hat_keys()
    true = np.tensordot(mixes(rng, 12), shapes, axes=1) + 3 * np.sin(shapes[0] / 25 + rng.uniform(0, 6, (12, 1, 2)))
    placed, weights = capture_points(true, made)

    def left(placed, weights):
        return np.linalg.norm(maps.move(placed, np.tensordot(weights, shapes, axes=1)) - true, axis=-1).mean()

    dear, cheap = (loosened(true, made, placed, weights, price) for price in (1e4, 0.2))
    assert np.allclose(dear[1], weights, atol=1e-3)
    assert left(*cheap) < left(placed, weights)
    assert np.allclose(cheap[1].sum(axis=1), 1)
    assert cheap[1].min() > BOUNDS[0] - 1e-9 and cheap[1].max() < BOUNDS[1] + 1e-9
    assert loosened(true, made, placed, weights, 0)[1] is weights
