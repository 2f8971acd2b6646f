"""A motion that was changed stands where its source stood."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from fixtures import write
from fixtures.frog import frog
from fixtures.walker import walker
from mocap.curves import cartoon_curves
from retarget.stage import footing, staging


@cache
def three(toon):
    """A cartoon as it was drawn, exaggerated, and put on its feet."""
    source = write.motion_of(toon())
    changed = cartoon_curves.cartoon(source, 1.1)
    return source, changed, footing.footed(changed, source)


@pytest.fixture(scope="module")
def source():
    return three(frog)[0]


@pytest.fixture(scope="module")
def changed():
    return three(frog)[1]


def low(motion):
    return motion.outline("frog")[..., 1].max(axis=1)


def test_feet_touch_the_ground_when_they_did_and_never_sink(source, changed):
    level, ours = staging.ground(source), three(frog)[2]
    ours = footing.footed(changed, source)
    first = ~source.track("frog").held
    touched = first & (np.abs(low(source) - level) < 1.0)
    assert touched.sum() > 8 and np.abs(low(changed) - low(source))[touched].max() > 3  # there is something to mend
    np.testing.assert_allclose(low(ours)[touched], low(source)[touched], atol=1e-3)
    assert (low(ours) <= np.maximum(level, low(source)) + 1e-3).all()


@pytest.mark.parametrize("toon", [frog, walker])
def test_a_foot_that_stays_does_not_slide(toon):
    source, changed, ours = three(toon)
    steps = {motion: [] for motion in (changed, ours)}  # how far the foot that slides least slides, frame by frame
    for motion, found in steps.items():
        slides = np.full((len(source.times), 9), np.inf)
        for number, contact in enumerate(staging.contacts(source)):
            foot = motion.points(contact.part)[contact.start : contact.stop, :, 0] @ contact.foot
            slides[contact.start + 1 : contact.stop, number % 9] = np.abs(np.diff(foot - contact.way))
        found += slides.min(axis=1)[np.isfinite(slides.min(axis=1))].tolist()
    assert max(steps[changed]) > 3
    # where the lead goes over from one foot to the other both may slide, a little
    assert np.mean(np.array(steps[ours]) < 1e-6) > 0.9 and max(steps[ours]) < 0.5 * max(steps[changed])


def test_longer_strides_go_farther():
    """Feet that were put back where the source's stood would jerk a walker to and fro at every step."""
    source, _, ours = three(walker)
    torso = [motion.points(motion.tracks[0].part)[..., 0].mean(axis=1) for motion in (source, ours)]
    assert torso[1][-1] - torso[1][0] > 1.1 * (torso[0][-1] - torso[0][0])
    assert np.diff(torso[1])[~source.tracks[0].held[1:]].min() > -2.0


def test_in_the_air_it_is_moved_calmly(source, changed):
    ours = three(frog)[2]
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
