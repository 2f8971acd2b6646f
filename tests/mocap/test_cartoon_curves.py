"""A captured cartoon's own curves, exaggerated: what is kept, and what an animator wants to see."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from capture.motion import affine, keys, tracks
from capture.motion.tracks import CartoonMotion, track_of
from fixtures import write
from fixtures.cartoons import all_toons
from mocap.curves import cartoon_curves

BOTH = (
    lambda motion: cartoon_curves.cartoon(motion, 1.2),
    lambda motion: cartoon_curves.exaggerated(motion, 2.5),
)


@cache
def truth(name):
    return write.motion_of(all_toons()[name]())


def played(linear, travel=0.0, weights=None, held=None, visible=None, fps=24.0):
    """A square of side 40 that goes by maps (T, 2, 2) and travels (T, 2), of one key or of two."""
    square = np.array([[0, 0], [20, 0], [40, 0], [40, 20], [40, 40], [20, 40], [0, 40], [0, 20]], float)
    names = ("square", "lens")[: 1 if weights is None else 2]
    keyset = keys.keyset(names, np.stack([square, square * [1, 0.5] + [0, 9]])[: len(names)])
    count = len(linear)
    rows = np.zeros((count, len(keyset.rows)))
    rows[:, : len(names)] = 1 if weights is None else weights
    shift = np.broadcast_to(np.asarray(travel, float), (count, 2))
    pivot = np.array([20.0, 20])
    placed = affine.about(np.concatenate([linear, shift[..., None]], axis=-1), pivot)
    track = track_of("square", keyset, placed, rows, np.zeros(count), pivot=pivot, held=held, visible=visible)
    return tracks.check(CartoonMotion((track,), (keyset,), np.arange(count) / fps, fps, (640, 480)))


def still(count):
    return np.tile(np.eye(2), (count, 1, 1))


def hop(count=60, start=20, length=12, far=100.0):
    """A way (T, 2) that rests, goes `far` to the right, and rests."""
    u = np.clip((np.arange(count) - start) / length, 0, 1)
    return np.stack([far * u**3 * (10 - 15 * u + 6 * u**2), 0 * u], axis=-1)


@pytest.mark.parametrize("change", BOTH)
@pytest.mark.parametrize("name", ["ball", "frog", "walker"])
def test_an_exaggerated_cartoon_is_still_a_motion(change, name):
    """Weights sum to 1, all is finite, nobody is turned inside out; it can be saved; and it is not what it was."""
    ours = tracks.check(change(truth(name)))
    moved = 0.0
    for track, source in zip(ours.tracks, truth(name).tracks):
        np.testing.assert_allclose(track.weights.sum(axis=1), 1, atol=1e-9)
        assert (
            np.sign(np.linalg.det(track.affine[..., :2])).tolist()
            == np.sign(np.linalg.det(source.affine[..., :2])).tolist()
        )
        low, high = min(source.key_weights().min(), -0.3), max(source.key_weights().max(), 1.3)
        assert low - 1e-9 <= track.key_weights().min() and track.key_weights().max() <= high + 1e-9
        moved = max(moved, np.abs(ours.points(track.part) - truth(name).points(track.part)).max())
    assert 5 < moved < 150  # pixels


@pytest.mark.parametrize("change", BOTH)
def test_what_goes_straight_and_turns_evenly_is_unchanged(change):
    """A wheel that rolls and is stretched evenly, by a factor a frame, past a whole turn."""
    t = np.arange(50)
    c, s = np.cos(0.2 * t), np.sin(0.2 * t)
    turn = np.moveaxis(np.array([[c, -s], [s, c]]), -1, 0)
    wheel = played(turn * 1.01 ** t[:, None, None], t[:, None] * [4.0, -1])
    ours = change(wheel)
    np.testing.assert_allclose(ours.tracks[0].affine, wheel.tracks[0].affine, atol=1e-6)


@pytest.mark.parametrize("change", BOTH)
def test_an_area_that_is_kept_is_kept(change):
    t = np.arange(48)
    size = np.exp(0.4 * np.sin(t / 4))
    squash = np.zeros((48, 2, 2))
    squash[:, 0, 0], squash[:, 1, 1] = size, 1 / size
    ours = change(played(squash)).tracks[0].affine[..., :2]
    np.testing.assert_allclose(np.linalg.det(ours), 1, atol=1e-9)
    assert ours[:, 0, 0].max() / size.max() > 1.1 and ours[:, 0, 0].max() <= 2.5 + 1e-9


def test_no_part_is_flattened_by_any_amount():
    t = np.arange(48)
    squash = np.eye(2) * np.exp(0.6 * np.sin(t / 3))[:, None, None]
    sizes = np.linalg.svd(cartoon_curves.cartoon(played(squash), 30.0).tracks[0].affine[..., :2])[1]
    assert sizes.min() >= 1 / 2.5 - 1e-9 and sizes.max() <= 2.5 + 1e-9


def test_a_hop_is_announced_before_it_begins_and_overshot_after():
    source = played(still(60), hop())
    x = cartoon_curves.cartoon(source, 1.0).tracks[0].affine[:, 0, 2]
    assert x[:20].min() < -3 and x[33:].max() > 103
    assert np.abs(x[:5]).max() < 0.1 and np.abs(x[49:] - 100).max() < 0.1
    quiet = cartoon_curves.cartoon(source, 1.0, anticipation=0.0).tracks[0].affine[:, 0, 2]
    assert quiet.min() > 0.25 * x.min() and quiet.max() > 102


def test_a_squash_is_deeper_and_begins_before():
    """The bouncing ball: flatter on the ground, longer in the air, higher in between, and the beat is the same."""
    source, ours = truth("ball"), cartoon_curves.cartoon(truth("ball"), 1.0)
    flat = [
        np.ptp(m.outline("ball")[..., 1], axis=1) / np.ptp(m.outline("ball")[..., 0], axis=1) for m in (source, ours)
    ]
    for impact in (11, 33):
        assert flat[1][impact] < 0.9 * flat[0][impact]
        assert flat[1][impact - 4] > 1.05 * flat[0][impact - 4]
        assert np.argmin(flat[1][impact - 5 : impact + 6]) == pytest.approx(
            np.argmin(flat[0][impact - 5 : impact + 6]), abs=1
        )
    high = [m.outline("ball")[12:33, :, 1].mean(axis=1).min() for m in (source, ours)]
    assert high[1] < high[0] - 10


def test_on_twos_stays_on_twos():
    way = hop()[np.arange(60) // 2 * 2]
    held = np.arange(60) % 2 == 1
    source = played(still(60), way, held=held)
    track = cartoon_curves.cartoon(source, 1.0).tracks[0]
    np.testing.assert_array_equal(track.held, held)
    np.testing.assert_array_equal(track.affine[1::2], track.affine[::2])
    ones = cartoon_curves.cartoon(played(still(60), hop()), 1.0, cartoon_curves.pace(source)).tracks[0]
    np.testing.assert_allclose(track.affine[::2, 0, 2], ones.affine[::2, 0, 2], atol=3.0)


def test_a_pause_is_woken_in_the_clips_rhythm_where_something_is_to_come():
    way = hop()[np.arange(60) // 2 * 2]
    held = np.arange(60) % 2 == 1
    held[1:20] = True  # one drawing for 20 frames, then a leap
    track = cartoon_curves.cartoon(played(still(60), way, held=held), 1.0).tracks[0]
    new = np.flatnonzero(~track.held)
    assert 0 in new and (new % 2 == 0).all()
    assert track.held[1:4].all() and not track.held[14:20:2].any()


def test_nobody_announces_that_he_appears():
    visible = np.ones(60, bool)
    visible[20:30] = False
    way = np.zeros((60, 2))
    way[30:] = [200, 50]
    way[20:30] = way[0]
    source = played(still(60), way, visible=visible)
    np.testing.assert_array_equal(cartoon_curves.cartoon(source, 2.0).tracks[0].affine, source.tracks[0].affine)


def test_what_turns_over_is_exaggerated_too():
    """A card that is flipped is flat for a moment: it has no logarithm, and is filtered number by number."""
    card = still(40)
    card[:, 0, 0] = np.cos(np.arange(40) / 39 * np.pi)
    ours = cartoon_curves.cartoon(played(card), 1.0).tracks[0].affine[..., :2]
    assert np.isfinite(ours).all() and ours[-1, 0, 0] == pytest.approx(-1, abs=1e-6)
    mirrored = cartoon_curves.cartoon(played(card[:9] * [-1, 1]), 1.0).tracks[0].affine[..., :2]
    np.testing.assert_allclose(
        mirrored, cartoon_curves.cartoon(played(card[:9]), 1.0).tracks[0].affine[..., :2] * [-1, 1]
    )


def test_what_hangs_on_another_comes_later():
    walker = truth("walker")
    deep = [track for track in walker.tracks if track.parent]
    assert deep
    now, later = (cartoon_curves.cartoon(walker, 1.0, 0.1, follow) for follow in (0.0, 0.08))
    for track in walker.tracks:
        same = np.allclose(now.track(track.part).affine, later.track(track.part).affine, atol=1e-9)
        assert same == (not track.parent)


def test_the_frame_rate_does_not_matter():
    def at(fps):
        t = np.arange(2 * fps + 1) / fps
        way = np.interp(t, np.arange(49) / 24, np.zeros(49))[:, None] * [0, 0] + np.stack(
            [40 * np.sin(6 * t), 9 * np.cos(9 * t)], -1
        )
        return (
            cartoon_curves.cartoon(played(still(len(t)), way, fps=fps), 1.0, 0.1).tracks[0].affine[:: fps // 12, :, 2]
        )

    for fps in (24, 48):
        np.testing.assert_allclose(at(fps), at(240), atol=0.4)


def test_in_three_dimensions_it_is_the_same():
    """A flat motion laid into space, in any direction, is exaggerated as it is in the plane."""
    from scipy.spatial.transform import Rotation

    source = truth("ball").tracks[0]
    flat = np.tile(np.eye(3, 4), (len(source), 1, 1))
    flat[:, :2, :2], flat[:, :2, 3] = source.affine[..., :2], source.affine[..., 2]
    turn = Rotation.from_rotvec([0.3, 1, -0.5]).as_matrix()
    laid = np.concatenate([turn @ flat[..., :3] @ turn.T, turn @ flat[..., 3:]], axis=-1)
    still = replace(truth("ball"), tracks=(replace(source, affine=laid, pivot=np.zeros(3)),))
    ours, plane = (
        cartoon_curves._filtered(track, 1.0, 0.0, still, lambda curves, fps, late: 2 * curves - curves.mean(axis=0))
        for track in (still.tracks[0], source)
    )
    np.testing.assert_allclose((ours.affine[..., 3] @ turn)[:, :2], plane.affine[..., 2], atol=1e-9)
    np.testing.assert_allclose((turn.T @ ours.affine[..., :3] @ turn)[:, :2, :2], plane.affine[..., :2], atol=1e-9)
    np.testing.assert_allclose(turn.T @ ours.affine[..., :3] @ turn @ [0, 0, 1], np.tile([0, 0, 1], (72, 1)), atol=1e-9)
