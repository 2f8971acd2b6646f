"""How much is right: omegas against a search for them, and against what they are to achieve."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mocap.rubber import amounts, exaggerate, lengths, subjoints
from mocap.skeletons.skeleton import Skeleton

FPS = 60


def test_the_longest_links_are_as_long_as_asked_for():
    positions, cut = _boxing()
    deviations = exaggerate.deviation(positions, FPS, 0.15, 0.04)
    for most in (1.2, 1.6):
        omega = amounts.omega_of(positions, deviations, cut, most, most=1e6)
        ratio = _ratio(positions, deviations, omega, cut)
        for number in range(2):
            links = ratio[:, _links(cut, number)]
            assert links.max() > most and (links <= most * (1 + 1e-9)).mean() >= 0.99
            assert np.quantile(links, 0.99) == pytest.approx(most, rel=0.02)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 9999), st.floats(1.01, 2), st.floats(0, 1))
def test_a_larger_bound_never_gives_a_smaller_omega(seed, most, more):
    positions, cut = _boxing(seed)
    deviations = exaggerate.deviation(positions, FPS, 0.15, 0.04)
    less = amounts.omega_of(positions, deviations, cut, most)
    assert (amounts.omega_of(positions, deviations, cut, most + more) >= less - 1e-12).all()
    assert less.min() >= 1 and less.max() <= amounts.MOST


def test_omega_is_what_a_search_finds():
    positions, cut = _boxing(5)
    deviations = exaggerate.deviation(positions, FPS, 0.15, 0.04)
    omega = amounts.omega_of(positions, deviations, cut, 1.4, most=1e6)[cut.groups[0][-1]]

    def kept(w):
        ratio = _ratio(positions, deviations, np.full(len(cut.skeleton), w), cut)[:, _links(cut, 0)]
        return (ratio <= 1.4).mean()

    assert kept(omega * 0.999) >= 0.99 > kept(omega * 1.02)


def test_a_body_that_stands_still_is_given_no_more_than_the_most():
    positions, cut = _boxing()
    still = np.repeat(positions[:1], 50, axis=0)
    omega = amounts.omega_of(still, exaggerate.deviation(still, FPS), cut)
    np.testing.assert_allclose(omega, amounts.MOST)


def test_parts_that_move_quicker_are_exaggerated_less():
    positions, cut = _boxing()
    omega = amounts.omega_of(positions, exaggerate.deviation(positions, FPS, 0.15, 0.04), cut, most=1e6)
    slow, quick = (omega[group[-1]] for group in cut.groups)
    assert 1 < quick < slow


def test_a_root_goes_no_further_than_its_legs_could_follow():
    positions, cut = _boxing()
    jumping = positions + 2 * np.sin(6 * np.arange(len(positions)) / FPS)[:, None, None] * [0, 1.0, 0]
    deviations = exaggerate.deviation(jumping, FPS, 0.15, 0.04)
    omega = amounts.omega_of(jumping, deviations, cut, 1.5, most=1e6)
    far = (omega[0] - 1) * np.quantile(np.linalg.norm(deviations[:, 0], axis=1), 0.99)
    assert far == pytest.approx(0.5 * 0.7)  # both limbs are 0.7 m


def test_a_displacement_is_met():
    positions, _ = _boxing()
    deviations = exaggerate.deviation(positions, FPS, 0.15, 0.04)
    omega = amounts.omega_for(deviations, height=1.7, share=0.1)
    most = np.linalg.norm(exaggerate.pushed(positions, deviations, omega) - positions, axis=-1).max(axis=1)
    assert np.quantile(most, 0.9) == pytest.approx(0.17)


def test_a_hand_is_of_its_arms_part_and_the_chest_of_the_trunk():
    _, cut = _boxing()
    parts = amounts.body_parts(cut)
    assert parts[0] == -1 and parts.tolist() == [-1, 0, 0, 0, 0, 1, 1, 1, 1]


def _links(cut, part):
    return (amounts.body_parts(cut) == part) & (cut.skeleton.lengths() > 0)


def _ratio(positions, deviations, omega, cut):
    pushed = exaggerate.pushed(positions, deviations, omega, cut.skeleton.parents)
    return lengths.ratios(pushed, cut.skeleton.parents, cut.skeleton.lengths())


def _boxing(seed=0):
    """Two limbs of 0.7 m and a hand on a chest, the second three times as quick (T, 9, 3)."""
    names = ("chest", "l collar", "l elbow", "l hand", "l tip", "r collar", "r elbow", "r hand", "r tip")
    parents = (-1, 0, 1, 2, 3, 0, 5, 6, 7)
    offsets = np.array([[0, 0, 0], *[[0, 0, 0], [0.35, 0, 0], [0.35, 0, 0], [0.05, 0, 0]] * 2], float)
    cut = subjoints.subdivide(Skeleton(names, parents, offsets))
    rng = np.random.default_rng(seed)
    seconds = np.arange(400) / FPS
    positions = np.zeros((len(seconds), 9, 3))
    for first, speed in ((1, 3.0), (5, 9.0)):
        angle = 0
        for joint in range(first, first + 4):
            angle = angle + rng.uniform(0.5, 0.9) * np.sin(speed * seconds + rng.uniform(0, 6))
            way = np.linalg.norm(offsets[joint]) * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
            positions[:, joint] = positions[:, parents[joint]] + way
    return positions, cut
