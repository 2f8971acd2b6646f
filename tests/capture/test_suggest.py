"""Key frames chosen by the program: as few as the truth has, each of them needed, each frame within the bound."""

from functools import lru_cache

import numpy as np
import pytest

from capture.errors import InputError
from capture.fit import outlines
from capture.fit.contour import capture_points, outline_keys
from capture.fit.suggest import held_outlines, reasons, suggest, with_keys
from capture.motion import affine, keys
from capture.pictures.clip import clip_of
from capture.pictures.shot import KeyDrawing, Part, Shot, check
from fixtures import ball, frog, hat, maps


@lru_cache
def toon(name):
    return {"ball": ball.ball, "hat": hat.hat, "frog": frog.frog}[name]()


def points(name):
    return toon(name).parts[0].points


def off_true_keys(name):
    """Pixels (T,) by which the frames are off the mixes of the keys that the cartoon was drawn from."""
    keyset, seen = outline_keys(points(name), toon(name).parts[0].key_frames)
    placed, weights = capture_points(seen, keyset)
    redrawn = affine.apply(placed, np.tensordot(weights, keys.shapes(keyset), axes=1))
    return np.sqrt(((redrawn - seen) ** 2).sum(axis=-1).mean(axis=-1))


@pytest.mark.parametrize("name, at_least", [("ball", 0.05), ("hat", 0.5)])
def test_no_more_keys_are_suggested_than_the_cartoon_was_drawn_from(name, at_least):
    bound = max(1.05 * off_true_keys(name).max(), at_least)
    found = suggest(points(name), bound)
    assert found.met() and found.residual.max() <= bound
    assert len(found.key_frames) <= len(toon(name).parts[0].key_names)


def test_the_frog_needs_its_four_poses_and_no_more():
    drawn = points("frog")[np.union1d(np.arange(0, len(points("frog")), 5), toon("frog").parts[0].key_frames)]
    bound = 1.05 * off_true_keys("frog").max()
    found = suggest(drawn, bound)
    assert found.residual.max() <= bound
    assert len(found.key_frames) == len(frog.KEYS) == 4


def test_without_any_suggested_key_the_bound_is_exceeded():
    found = suggest(points("hat"), 1.0)
    assert len(found.key_frames) > 1
    assert (found.residual_without.max(axis=1) > 1.0).all()
    assert (found.residual_without >= found.residual - 0.05).all()  # nor does a key ever do harm
    assert found.residual_without.shape == (len(found.key_frames), len(points("hat")))


def test_keys_are_where_the_residual_vanishes():
    found = suggest(points("hat"), 1.0)
    assert found.residual[found.key_frames].max() < 1e-6


def test_a_held_drawing_is_never_chosen_twice():
    part = toon("hat").parts[0]
    drawing = part.drawing[:16]
    found = suggest(part.points[:16], 0.02)
    assert np.array_equal(found.held, np.diff(drawing, prepend=-1) == 0)
    assert found.held.any() and not found.held[found.key_frames].any()
    assert len(np.unique(drawing[found.key_frames])) == len(found.key_frames) > 1
    assert np.array_equal(found.residual[1:][found.held[1:]], found.residual[:-1][found.held[1:]])


def test_turning_squashing_and_shearing_the_clip_changes_nothing():
    rng = np.random.default_rng(0)
    drawn = points("hat")[::3]
    turned = np.stack([maps.turn(angle) for angle in rng.uniform(-3, 3, len(drawn))])
    flung = maps.move(np.concatenate([turned, rng.normal(0, 80, (len(drawn), 2, 1))], axis=2), drawn)
    assert len(suggest(flung, 1.0).key_frames) == len(suggest(drawn, 1.0).key_frames)


def test_room_for_too_few_keys_is_used_up_and_what_is_left_is_told():
    found = suggest(points("hat"), 0.5, most_keys=2)
    assert len(found.key_frames) == 2 and not found.met()
    assert len(found.residual_by_count) == 2 and found.residual_by_count[-1] > 0.5


def test_frames_that_are_not_whole_are_neither_chosen_nor_counted():
    drawn = points("hat")[::4].copy()
    drawn[5] += np.random.default_rng(1).normal(0, 30, drawn[5].shape)  # a trace gone wrong
    whole = np.arange(len(drawn)) != 5
    found = suggest(drawn, 1.0, whole=whole)
    assert found.met() and 5 not in found.key_frames
    assert np.array_equal(found.key_frames, np.array([t + (t >= 5) for t in suggest(drawn[whole], 1.0).key_frames]))


def test_an_outline_that_crosses_itself_may_be_a_key_but_not_the_first():
    drawn = points("hat")[::4].copy()
    drawn[0, [10, 60]] = drawn[0, [60, 10]]
    found = suggest(drawn, 1.0)
    assert 0 in found.key_frames and found.key_frames[0] != 0
    assert found.met()


def test_the_keys_make_a_part_that_can_be_captured():
    drawn = points("hat")
    found = suggest(drawn, 1.0)
    part = with_keys(Part("hat", box=(1, 2, 30, 40)), drawn, found, first=100)
    assert [key.frame for key in part.keys] == [100 + t for t in found.key_frames]
    assert np.allclose(part.outlines(), drawn[found.key_frames], atol=1e-3)
    check(Shot("hat.mp4", (part,)))
    assert part.box is None
    assert [told.split(":")[0] for told in reasons(found, 100)] == [key.name for key in part.keys]


def test_held_outlines_are_those_of_the_frame_before():
    still = np.repeat(points("ball")[:4], [1, 3, 1, 2], axis=0)
    assert held_outlines(still).tolist() == [False, False, True, True, False, False, True]


@pytest.mark.parametrize(
    "bad, said",
    [
        (np.zeros((4, 2, 2)), "3 points or more"),
        (np.zeros((0, 9, 2)), "3 points or more"),
        (np.full((4, 9, 2), np.nan), "finite numbers, those of frame 0"),
        (np.tile([[0, 0], [9, 9], [9, 0], [0, 9]], (4, 1, 1)), "does not cross itself"),
        (np.ones((4, 9, 2)), "does not cross itself"),
    ],
)
def test_outlines_that_cannot_be_used_are_refused_in_a_sentence(bad, said):
    with pytest.raises(InputError, match=said):
        suggest(bad)


def box_round(outline):
    return tuple(float(v) for v in np.round([*(outline.min(axis=0) - 6), *(np.ptp(outline, axis=0) + 12)]))


@pytest.mark.parametrize("name, first", [("hat", 0), ("ball", 5)])
def test_outlines_are_found_in_every_frame_whichever_shows_the_box(name, first):
    part = toon(name).parts[0]
    told = Part(name, (KeyDrawing("rest", first),), box=box_round(part.points[first]))
    found = outlines.follow(told, clip_of(np.stack([toon(name).frame(t) for t in range(12)])))
    assert found.whole.all()
    assert np.array_equal(found.held, np.diff(part.drawing[:12], prepend=-1) == 0)
    for traced, true in zip(found.points, part.points):  # the truth is the middle of the ink, the trace its rim
        gap = np.linalg.norm(traced[:, None] - maps.even(true, 1000), axis=-1).min(axis=1)
        assert 1.0 < np.median(gap) < 2.2 and gap.max() < 3.2


def test_points_of_a_squashed_drawing_stay_on_the_same_places():
    rng = np.random.default_rng(3)
    rim = hat.outline(400)
    flung = np.array([[[1.3, 0.2], [0, 0.7]], [[0.8, -0.3], [0.1, 1.2]], [[1, 0.4], [0, 1]]])
    seen = [rim, *(np.roll(rim, rng.integers(400), axis=0) @ linear.T + 50 for linear in flung)]
    same = outlines.corresponding(seen, 60)
    for linear, squashed in zip(flung, same[1:]):
        assert np.linalg.norm(squashed - (same[0] @ linear.T + 50), axis=1).max() < 2.0


def test_a_part_that_disappears_for_a_while_is_told():
    shown = [toon("hat").frame(t) for t in range(0, 12, 2)]
    shown[3] = np.full_like(shown[3], shown[3][5, 5])
    told = Part("hat", box=box_round(points("hat")[0]))
    found = outlines.follow(told, clip_of(np.stack(shown)))
    assert found.whole.tolist() == [True, True, True, False, True, True]
    assert np.array_equal(found.points[3], found.points[2])
