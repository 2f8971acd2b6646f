"""Links brought back to their lengths: the paper's way and the one pass, held against each other and against rest."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from capture.errors import InputError
from mocap.rubber import lengths

BODY = (-1, 0, 1, 2, 1, 4, 0, 6)  # a hip, two arms on a chest, a leg
REST = np.array([0, 0.5, 0.3, 0.3, 0.3, 0.3, 0.45, 0.4])


def test_ratios_are_lengths_by_those_at_rest():
    links = lengths.ratios(_arm(1.5), (-1, 0, 1), np.array([0, 1.0, 0]))
    np.testing.assert_allclose(links, [[1, 1.5, 1]])


def test_fig_4_converges_to_the_lengths_at_rest():
    body = _thrown()
    back = lengths.corrected(body, BODY, REST, threshold=1e-9)
    np.testing.assert_allclose(lengths.ratios(back, BODY, REST), 1, atol=1e-6)
    np.testing.assert_array_equal(back[:, 0], body[:, 0])


def test_fig_4_stops_in_each_frame_where_its_links_are_near_enough():
    body = _thrown()
    body[3] = lengths.clamped(body, BODY, REST)[3]
    near = lengths.corrected(body, BODY, REST, threshold=0.01, delta=0.1)
    np.testing.assert_array_equal(near[3], body[3])
    off = np.abs(lengths.ratios(near, BODY, REST) - 1)[:, 1:] @ REST[1:] / len(REST[1:])
    assert off.max() <= 0.01 / 0.9 and np.delete(off, 3).min() > 0.005


def test_one_pass_gives_the_lengths_that_fig_4_nears():
    body = _thrown()
    slow, quick = lengths.corrected(body, BODY, REST, threshold=1e-9), lengths.clamped(body, BODY, REST)
    np.testing.assert_allclose(lengths.ratios(quick, BODY, REST), lengths.ratios(slow, BODY, REST), atol=1e-6)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 9999), st.floats(0.2, 1), st.floats(1, 3), st.floats(0, 1))
def test_the_one_pass_keeps_directions_and_bounds(seed, least, most, soft):
    body = _thrown(seed)
    back = lengths.clamped(body, BODY, REST, least, most, soft)
    ratio = lengths.ratios(back, BODY, REST)
    assert ratio.min() >= least - 1e-9 and ratio.max() <= most + 1e-9
    for joint, parent in enumerate(BODY):
        if parent >= 0:
            was, now = body[:, joint] - body[:, parent], back[:, joint] - back[:, parent]
            np.testing.assert_allclose(np.cross(was, now), 0, atol=1e-9)
            assert (np.einsum("ti,ti->t", was, now) > 0).all()


def test_what_is_within_bounds_stays():
    body = _thrown()
    np.testing.assert_allclose(lengths.clamped(body, BODY, REST, 1e-3, 1e3), body, atol=1e-12)


def test_a_soft_bound_is_neared_without_a_jolt():
    """A link that grows steadily: a hard bound stops it within a frame, a soft one within many."""
    growing = np.concatenate([_arm(long) for long in np.linspace(1, 3, 201)])
    rest = np.array([0, 1.0, 0])
    soft, hard = (
        lengths.ratios(lengths.clamped(growing, (-1, 0, 1), rest, 1, 1.6, s), (-1, 0, 1), rest)[:, 1] for s in (0.6, 0)
    )
    assert soft.max() < 1.6 and hard.max() == pytest.approx(1.6)
    assert np.abs(np.diff(soft, 2)).max() < 0.1 * np.abs(np.diff(hard, 2)).max()
    assert (np.diff(soft) > 0).all()


@pytest.mark.parametrize("way", [lengths.clamped, lengths.corrected])
def test_links_of_no_length_are_carried_along(way):
    """The tip lies on no link with a length: it stays beside its parent, and so does what hangs on it by a link."""
    body = np.array([[[0, 0, 0], [2.0, 0, 0], [2, 0.1, 0], [2, 0.1, 3]]])
    back = way(body, (-1, 0, 1, 2), np.array([0, 1.0, 0, 1]))
    np.testing.assert_allclose(back[:, :3], [[[0, 0, 0], [1, 0, 0], [1, 0.1, 0]]], atol=1e-9)
    assert np.linalg.norm(back[0, 3] - back[0, 2]) == pytest.approx(1)


@pytest.mark.parametrize("way", [lengths.clamped, lengths.corrected])
def test_a_link_that_shrank_to_a_point_is_no_error(way):
    assert np.isfinite(way(np.zeros((2, 8, 3)), BODY, REST)).all()


@pytest.mark.parametrize("bounds", [(0, 1), (1.1, 2), (0.5, 0.9), (0.5, np.inf)])
def test_bounds_that_do_not_hold_1_are_refused(bounds):
    with pytest.raises(InputError, match="least"):
        lengths.clamped(_thrown(), BODY, REST, *bounds)


def _arm(long):
    return np.array([[[0, 0, 0], [long, 0, 0], [long, 0, 0]]], float)


def _thrown(seed=0):
    """A body whose joints were pushed about at will (T, J, 3)."""
    rng = np.random.default_rng(seed)
    ways = rng.normal(size=(6, 8, 3))
    for joint, parent in enumerate(BODY):
        if parent >= 0:
            ways[:, joint] *= REST[joint] * rng.uniform(0.3, 3) / np.linalg.norm(ways[:, joint], axis=-1)[:, None]
            ways[:, joint] += ways[:, parent]
    return ways
