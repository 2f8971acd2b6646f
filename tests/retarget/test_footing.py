"""A motion that was changed stands where its source stood."""

from dataclasses import replace

import numpy as np
import pytest

from fixtures import write
from fixtures.frog import frog
from mocap import cartoon_curves
from retarget.stage import footing, staging


@pytest.fixture(scope="module")
def source():
    return write.motion_of(frog())


@pytest.fixture(scope="module")
def changed(source):
    return cartoon_curves.cartoon(source, 1.2)


def low(motion):
    return motion.outline("frog")[..., 1].max(axis=1)


def test_feet_touch_the_ground_when_they_did_and_never_sink(source, changed):
    level = staging.ground(source)
    ours = footing.footed(changed, source)
    first = ~source.track("frog").held
    touched = first & (np.abs(low(source) - level) < 1.0)
    assert touched.sum() > 8 and np.abs(low(changed) - low(source))[touched].max() > 3  # there is something to mend
    np.testing.assert_allclose(low(ours)[touched], low(source)[touched], atol=1e-3)
    assert (low(ours) <= np.maximum(level, low(source)) + 1e-3).all()


def test_a_foot_that_stays_does_not_slide(source, changed):
    ours = footing.footed(changed, source)
    contacts = staging.contacts(source)
    assert contacts
    for contact in contacts:
        stays = slice(contact.start, contact.stop)
        foot = ours.points("frog")[stays, :, 0] @ contact.foot
        np.testing.assert_allclose(foot, contact.way, atol=1e-6)


def test_in_the_air_it_is_moved_calmly(source, changed):
    ours = footing.footed(changed, source)
    moved = (ours.track("frog").affine - changed.track("frog").affine)[..., 2]
    drawn = moved[~source.track("frog").held]
    assert np.abs(np.diff(drawn, 2, axis=0)).max() < 0.6 * np.abs(drawn).max()
    np.testing.assert_array_equal(ours.track("frog").held, changed.track("frog").held)


def test_what_was_not_changed_is_not_moved(source):
    assert footing.footed(source, source) is source


def test_without_a_ground_nothing_is_moved(source, changed):
    floating = source.track("frog").affine.copy()
    floating[..., 1, 2] -= 7.0 * np.arange(len(floating))
    aloft = replace(source, tracks=(replace(source.track("frog"), affine=floating),))
    assert footing.footed(changed, aloft) is changed
