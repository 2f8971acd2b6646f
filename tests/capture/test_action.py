"""Lines that were bent, turned and thrown in known ways are captured and redrawn."""

import numpy as np
import pytest

from capture.errors import InputError
from capture.fit import action
from capture.motion import affine, tracks
from fixtures import maps


def arc(bend, length=120.0, count=40):
    """An arc (count, 2) of `bend` radians that stands on the origin, upwards, and starts at its foot."""
    s = np.linspace(0, 1, count)
    if abs(bend) < 1e-9:
        return np.column_stack([0 * s, -length * s])
    return length / bend * np.column_stack([1 - np.cos(bend * s), -np.sin(bend * s)])


def dance(frames=40):
    """Lines (T, n, 2) that bend from side to side, lean, stretch and travel."""
    t = np.linspace(0, 2 * np.pi, frames)
    bend, lean, long = 1.5 * np.sin(t), 0.4 * np.sin(t + 1), 120 + 25 * np.cos(2 * t)
    return np.stack(
        [arc(b, l) @ maps.turn(a).T + (200 + 60 * np.sin(u), 260) for b, a, l, u in zip(bend, lean, long, t)]
    )


def drawn(motion):
    return action.centre_lines(motion.points("line"))


def off(motion, lines):
    true = np.stack([action.even(line, action.STATIONS) for line in lines])
    return np.linalg.norm(drawn(motion) - true, axis=-1).max(axis=1)


def test_a_bending_line_is_captured_within_a_pixel():
    lines = dance()
    motion = action.capture_line(lines)
    misfit = off(motion, lines)
    assert misfit.max() < 1.0  # pixels, at lines 95 to 145 long
    assert np.allclose(motion.tracks[0].residual, misfit, atol=1e-6)
    assert len(motion.tracks[0].keys) <= 5


def test_key_lines_are_captured_exactly_with_all_weight_on_their_key():
    lines = dance()
    motion = action.capture_line(lines, key_frames=[0, 10, 30])
    assert off(motion, lines)[[0, 10, 30]].max() < 1e-3
    assert np.allclose(motion.tracks[0].key_weights()[[0, 10, 30]], np.eye(3), atol=1e-3)


def test_a_turned_scaled_and_thrown_line_is_one_key_and_its_map():
    rest = arc(0.9)
    turns, sizes = np.linspace(0, 6, 20), np.linspace(1, 2, 20)
    places = [maps.place(s * maps.turn(a), (0, 0), (30 * a, 90)) for a, s in zip(turns, sizes)]
    motion = action.capture_line(maps.move(np.stack(places), rest))
    assert motion.tracks[0].keys == ("frame 0",)
    found = affine.turn(motion.tracks[0].affine)
    assert np.allclose(found, (turns + np.pi) % (2 * np.pi) - np.pi, atol=1e-6)


@pytest.mark.parametrize("bend", [0.0, 1e-7, 0.02])
def test_a_straight_line_is_never_flattened_or_turned_over(bend):
    lines = np.stack([arc(bend) @ maps.turn(a).T for a in np.linspace(0, 3, 8)] + [arc(1.6) + (5, 5), arc(-1.6)])
    motion = action.capture_line(lines, key_frames=[0, 8])
    sigma = np.linalg.svd(motion.tracks[0].affine[..., :2])[1]
    assert np.linalg.det(motion.tracks[0].affine[..., :2]).min() > 0.3 and sigma[:8].min() > 0.95
    assert off(motion, lines)[:9].max() < 1e-2


def test_the_straightest_line_comes_first_and_the_most_bent_ones_follow():
    lines = np.stack([arc(bend) for bend in (0.6, 0.05, -0.3, 1.4, -1.2)])
    assert action.choose_keys(lines, most=3) == [1, 3, 4]
    assert action.choose_keys(lines[[1, 1, 1]], most=3) == [0]


def test_the_middle_of_a_ribbon_is_its_line_and_no_face_is_turned_over():
    lines = np.stack([arc(bend, count=32) for bend in (0.0, 2.5, -6.0)])
    ribbons = action.ribbon(lines, 60.0)
    assert np.allclose(action.centre_lines(ribbons), lines)
    keyset = action.line_keys(("a", "b", "c"), ribbons)
    a, b, c = np.moveaxis(ribbons[:, keyset.faces], 2, 0)
    area = (b - a)[..., 0] * (c - a)[..., 1] - (b - a)[..., 1] * (c - a)[..., 0]
    assert (area > 0).all()


def test_what_is_written_is_read_again(tmp_path):
    motion = action.capture_line(dance(12))
    tracks.save(motion, tmp_path / "line.motion.json")
    assert np.array_equal(drawn(tracks.load(tmp_path / "line.motion.json")), drawn(motion))


@pytest.mark.parametrize(
    "give",
    [
        lambda: action.capture_line(np.zeros((4, 2))),
        lambda: action.capture_line(np.zeros((4, 1, 2))),
        lambda: action.capture_line(np.zeros((4, 9, 2))),
        lambda: action.capture_line(np.full((4, 9, 2), np.nan)),
        lambda: action.capture_line(dance(5), key_frames=[0, 0]),
        lambda: action.capture_line(dance(5), key_frames=[7]),
    ],
)
def test_what_is_no_line_is_refused_in_one_sentence(give):
    with pytest.raises(InputError):
        give()
