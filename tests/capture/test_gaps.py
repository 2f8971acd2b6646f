"""A part that is hidden for a while goes on as what it did before and after says."""

from dataclasses import replace

import numpy as np

from capture.motion import gaps, keys
from capture.motion.tracks import CartoonMotion, Track
from fixtures import maps

SQUARE = np.array([(0, 0), (40, 0), (40, 40), (0, 40)], float)


def swinging(frames=13, hidden=slice(4, 9), held=()):
    """A square that turns by 10 degrees a frame, grows and travels, its pose lost in the hidden frames."""
    count = np.arange(frames)
    linear = np.stack([(1 + 0.02 * t) * maps.turn(np.radians(100 + 10 * t)) for t in count])  # past half a turn
    affine = np.concatenate([linear, np.stack([3.0 * count, -2.0 * count], axis=-1)[..., None]], axis=-1)
    seen = np.ones(frames, bool)
    seen[hidden] = False
    kept = affine[np.maximum.accumulate(np.where(seen, count, 0))]
    source = keys.keyset(("one",), SQUARE[None], spacing=20.0)
    known = np.isin(count, held)
    still = (np.zeros(frames), seen, known, np.zeros(frames, int))
    track = Track("arm", "", np.array([20.0, 20.0]), ("one",), source.rows, kept, np.ones((frames, 1)), *still)
    return affine, CartoonMotion((track,), (source,), count / 24, 24.0, (640, 480))


def test_an_even_swing_goes_on_evenly_where_it_is_not_seen():
    truth, motion = swinging()
    track = gaps.bridged(motion).tracks[0]
    assert np.abs(motion.tracks[0].affine - truth).max() > 5
    np.testing.assert_allclose(track.affine, truth, atol=1e-9)
    assert track.visible.all()


def test_what_is_hidden_at_the_ends_keeps_its_pose():
    for hidden, kept in ((slice(0, 3), 3), (slice(10, 13), 9)):
        truth, motion = swinging(hidden=hidden)
        found = gaps.bridged(motion).tracks[0].affine
        np.testing.assert_allclose(found[hidden], np.broadcast_to(truth[kept], (3, 2, 3)))
        assert np.array_equal(np.delete(found, hidden, 0), np.delete(truth, hidden, 0))


def test_a_held_drawing_stays_held():
    _, motion = swinging(held=(5, 7))
    found = gaps.bridged(motion).tracks[0].affine
    assert np.array_equal(found[5], found[4]) and np.array_equal(found[7], found[6])
    assert not np.array_equal(found[6], found[4])


def test_a_part_that_is_always_or_never_seen_is_left_alone():
    _, motion = swinging(hidden=slice(0, 0))
    never = replace(motion, tracks=(replace(motion.tracks[0], visible=np.zeros(13, bool)),))
    for one in (motion, never):
        assert gaps.bridged(one).tracks[0] is one.tracks[0]


def test_a_limb_goes_on_behind_its_body_and_a_body_that_went_away_takes_it_along():
    _, motion = swinging(frames=16, hidden=slice(3, 6))
    arm = motion.tracks[0]
    away, end = arm.visible.copy(), np.arange(16) < 14
    away[:] = True
    away[8:11] = False
    body = replace(arm, part="body", visible=away)
    arm = replace(arm, parent="body", visible=arm.visible & away & end)
    made = gaps.limbs_bridged(replace(motion, tracks=(arm, body), keysets=motion.keysets * 2))
    assert np.array_equal(made.track("body").visible, away)
    assert np.array_equal(
        made.track("arm").visible, away & end
    )  # what comes after the last time it is seen is not known
    whole = gaps.bridged(replace(motion, tracks=(replace(arm, parent=""),))).tracks[0]
    assert np.array_equal(made.track("arm").affine, whole.affine)
