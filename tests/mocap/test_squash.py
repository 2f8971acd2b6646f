"""Squash and stretch: volumes, and ratios that alternate."""

import numpy as np
import pytest

from mocap.rubber import squash


def test_a_link_keeps_its_volume():
    stretch = np.random.default_rng(0).uniform(0.5, 2, (10, 6))
    rest = np.array([0, 0.1, 0.2, 0.2, 0.3, 0.3])
    thick = squash.thickness_of(stretch)
    np.testing.assert_allclose(thick**2 * stretch, 1)
    np.testing.assert_allclose(squash.volume(stretch, thick, rest), 1)


def test_nothing_gets_thinner_or_thicker_than_can_be_drawn():
    thick = squash.thickness_of(np.array([0, 0.01, 1, 100.0]))
    np.testing.assert_allclose(thick, [squash.FAT, squash.FAT, 1, squash.SLIM])


def test_a_stretch_that_comes_and_goes_becomes_stretch_and_squash():
    """Ratios of 1 to 1.5, as eq. 1 makes them, go as far below 1 as above, in the middle of the clip."""
    seconds = np.arange(600) / 60
    ratio = 1.25 + 0.25 * np.sin(2 * np.pi * 2 * seconds)[:, None]
    told = squash.alternating(ratio, 60)[120:480]
    assert told.min() < 0.85 and told.max() > 1.18
    assert np.log(told).mean() == pytest.approx(0, abs=1e-3)
    half = np.log(squash.alternating(ratio, 60, amount=0.5)[120:480]).mean()
    assert half == pytest.approx(0.5 * np.log(ratio[120:480]).mean(), rel=0.01)


def test_links_that_keep_their_length_keep_it():
    np.testing.assert_allclose(squash.alternating(np.ones((50, 3)), 30), 1)
    ratio = np.random.default_rng(1).uniform(1, 2, (50, 3))
    np.testing.assert_allclose(squash.alternating(ratio, 30, amount=0), ratio)


def test_a_lasting_stretch_is_none():
    """A link that is long throughout was measured wrongly, or is another's: it does not alternate."""
    np.testing.assert_allclose(squash.alternating(np.full((200, 1), 1.4), 60), 1)
