"""Shares of sub-parts, and drawings captured in parts."""

import numpy as np
import pytest

from capture.errors import InputError
from capture.fit.contour_parts import Joint, capture_parts
from capture.motion import affine, keys, parts, tracks

LEFT = np.array([(-10, -50), (100, -50), (100, 50), (-10, 50)], float)
RIGHT = LEFT + (110, 0)


def arm(bend: float = 0.0) -> np.ndarray:
    """A strip (60, 2), 200 long and 30 wide; `bend` lifts its middle by so many pixels."""
    x = np.linspace(0, 200, 30)
    lift = bend * np.sin(np.pi * x / 200)
    return np.vstack([np.column_stack([x, lift - 15]), np.column_stack([x[::-1], lift[::-1] + 15])])


def test_shares_sum_to_one_and_pass_over_at_the_seam():
    points = np.column_stack([np.linspace(0, 200, 201), np.zeros(201)])
    shares = parts.soft_shares(points, [LEFT, RIGHT], 20)
    assert np.allclose(shares.sum(axis=1), 1)
    assert np.allclose(shares[points[:, 0] < 85], [1, 0])
    assert np.allclose(shares[points[:, 0] > 115], [0, 1])
    assert np.allclose(shares[100], [0.5, 0.5])
    assert (np.diff(shares[:, 0]) <= 1e-12).all()


def test_a_point_outside_all_regions_goes_to_the_nearest():
    shares = parts.soft_shares(np.array([(-80.0, 0.0), (400.0, 0.0)]), [LEFT, RIGHT], 10)
    assert np.allclose(shares, [[1, 0], [0, 1]])


def swung(frames: int = 12) -> tuple[np.ndarray, np.ndarray]:
    """True plain maps of upper and lower arm (2, T, 2, 3): both swing and stretch, joined at (100, 0)."""
    t = np.linspace(0, 2 * np.pi, frames)
    upper = affine.about(_maps(0.4 * np.sin(t), 1 + 0.2 * np.sin(2 * t), (40 * np.sin(t), 10 * t)), np.zeros(2))
    lower = affine.compose(
        upper, affine.about(_maps(0.8 * np.sin(t + 1), 1 + 0.1 * np.cos(t), (0, 0)), np.array([100.0, 0]))
    )
    return upper, lower


def _maps(angle: np.ndarray, length: np.ndarray, shift: tuple) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    dx, dy = (np.broadcast_to(v, angle.shape) for v in shift)
    return np.stack([np.stack([c * length, -s, dx], -1), np.stack([s * length, c, dy], -1)], -2)


JOINTS = [Joint("upper", "", np.zeros(2)), Joint("lower", "upper", np.array([100.0, 0.0]), order=1)]


def test_an_arm_in_two_parts_comes_back_with_its_maps():
    keyset = keys.keyset(("rest",), arm()[None])
    shares = parts.soft_shares(keyset.points[0], [LEFT, RIGHT], 24)
    maps = np.stack(swung())
    truth = parts.blended(shares, np.broadcast_to(keyset.points[0], (2, 12, *keyset.points[0].shape)), maps)
    motion = capture_parts(truth, keyset, shares, JOINTS, rounds=40)
    assert np.abs(parts.body(motion, shares) - truth).max() < 0.2
    for part, true in zip(("upper", "lower"), maps):
        found = tracks.total_affine(motion, part)
        assert np.abs(affine.apply(found, arm()) - affine.apply(true, arm())).max() < 1.0


def test_joints_hold_whatever_the_picture_says():
    keyset = keys.keyset(("rest",), arm()[None])
    shares = parts.soft_shares(keyset.points[0], [LEFT, RIGHT], 24)
    noisy = keyset.points[0] + np.random.default_rng(0).normal(0, 4, (6, *keyset.points[0].shape))
    motion = capture_parts(noisy, keyset, shares, JOINTS)
    elbow = np.array([[100.0, 0.0]])
    places = [affine.apply(tracks.total_affine(motion, part), elbow) for part in ("upper", "lower")]
    assert np.allclose(*places)
    assert np.allclose(motion.track("lower").affine[:, :, 2], 0, atol=1e-9)


def test_parts_have_key_weights_of_their_own():
    keyset = keys.keyset(("rest", "bent"), np.stack([arm(), arm(40)]), inbetweens=3)
    shares = parts.soft_shares(keyset.points[0], [LEFT, RIGHT], 24)
    rows = keys.shapes(keyset)
    true = np.zeros((2, 5, len(rows)))
    for part, amounts in enumerate((np.linspace(0, 1, 5), np.linspace(1, 0, 5))):
        true[part, :, 0], true[part, :, 1] = 1 - amounts, amounts
    still = np.tile(affine.identity(), (2, 5, 1, 1))
    seen = parts.blended(shares, np.einsum("ptr,rnd->ptnd", true, rows), still)
    motion = capture_parts(seen, keyset, shares, JOINTS, rounds=30)
    assert np.abs(parts.body(motion, shares) - seen).max() < 2.0


@pytest.mark.parametrize(
    ("joints", "told"),
    [
        (JOINTS[::-1], "listed before"),
        (JOINTS[:1], "every point and part"),
    ],
)
def test_parts_that_do_not_fit_together_are_refused(joints: list, told: str):
    keyset = keys.keyset(("rest",), arm()[None])
    shares = parts.soft_shares(keyset.points[0], [LEFT, RIGHT], 24)
    with pytest.raises(InputError, match=told):
        capture_parts(keyset.points[:1], keyset, shares, joints)


def test_a_hard_seam_and_a_crossing_region_are_refused():
    with pytest.raises(InputError, match="softness"):
        parts.soft_shares(arm(), [LEFT, RIGHT], 0)
    with pytest.raises(InputError, match="cross itself"):
        parts.soft_shares(arm(), [LEFT, LEFT[[0, 2, 1, 3]]], 10)
