"""Laws of limbs that are bent to goals."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize

from capture.errors import InputError
from mocap.rubber import constrain, feet

FPS = 60.0


def always(joint, places):
    return constrain.Goal(joint, places, np.ones(len(places)))


moves = st.tuples(*[st.floats(-0.4, 0.4)] * 3).map(np.array)


@settings(max_examples=40, deadline=None)
@given(moves, moves)
def test_goals_are_met_exactly_and_nothing_else_of_the_body_moves(leg, standing, ankle_move, toe_move):
    sub = leg()
    before = standing(sub)
    goals = [always(k, before[:, sub.ends[k]] + move) for k, move in ((3, ankle_move), (4, toe_move))]
    after = constrain.constrained(before, sub, goals)
    for goal in goals:
        np.testing.assert_allclose(after[:, sub.ends[goal.joint]], goal.places, atol=1e-12)
    still = [s for s, joint in enumerate(sub.joint) if joint in (0, 1, 5, 6, 7, 8)]
    np.testing.assert_array_equal(after[:, still], before[:, still])
    spur, ankle = sub.ends[9], sub.ends[3]
    np.testing.assert_allclose(after[:, spur] - after[:, ankle], before[:, spur] - before[:, ankle], atol=1e-12)


def test_a_goal_where_the_joint_is_changes_nothing(leg, standing):
    sub = leg()
    before = standing(sub, 3)
    after = constrain.constrained(before, sub, [always(4, before[:, sub.ends[4]])])
    np.testing.assert_allclose(after, before, atol=1e-12)


def test_a_turned_figure_is_bent_the_same(leg, standing):
    from scipy.spatial.transform import Rotation

    sub = leg()
    before = standing(sub)
    turn = Rotation.from_rotvec([0.3, 1.1, -0.5])

    def turned(points):
        return turn.apply(points.reshape(-1, 3)).reshape(points.shape) + [3.0, -2, 1]

    goal = before[:, sub.ends[4]] + [0.1, 0.3, 0.2]
    one = constrain.constrained(before, sub, [always(4, goal)])
    other = constrain.constrained(turned(before), sub, [always(4, turned(goal))])
    np.testing.assert_allclose(other, turned(one), atol=1e-9)


def test_a_limb_that_only_turns_about_its_start_keeps_its_shape(leg, standing):
    """The one goal that asks for no bending: the whole leg swung from the hip."""
    from scipy.spatial.transform import Rotation

    sub = leg()
    before = standing(sub)
    hip = before[0, sub.ends[1]]
    chain = [s for s, joint in enumerate(sub.joint) if joint in (1, 2, 3, 4)]
    for angle in (0.2, 0.6, 1.0):
        swung = Rotation.from_rotvec([-angle, 0, 0]).apply(before[0, chain] - hip) + hip
        after = constrain.constrained(before, sub, [always(3, swung[None, 6]), always(4, swung[None, 9])])
        lengths = [np.linalg.norm(np.diff(c, axis=0), axis=-1) for c in (before[0, chain], after[0, chain])]
        assert np.abs(lengths[1] / lengths[0] - 1).max() < 0.12
        assert np.abs(after[0, chain] - swung).max() < 0.06


def test_a_bent_limb_is_the_least_squares_of_its_laplacians_turned_with_it(leg, standing):
    """Against scipy's minimiser on the energy, written out point by point."""
    from scipy.spatial.transform import Rotation

    sub = leg(2)
    chain = standing(sub)[:, [s for s, joint in enumerate(sub.joint) if joint in (1, 2, 3, 4)]] * [1, 1, 1.3]
    goal = chain[:, -1:] + [0.05, 0.2, 0.1]
    lengths = np.linalg.norm(np.diff(chain[0], axis=0), axis=-1)
    first, second = ((end - chain[0, 0]) / np.linalg.norm(end - chain[0, 0]) for end in (chain[0, -1], goal[0, 0]))
    axis = np.cross(first, second)
    turn = Rotation.from_rotvec(axis / np.linalg.norm(axis) * np.arccos(first @ second))

    def energy(flat):
        curve = chain[0].copy()
        curve[1:-1], curve[-1] = flat.reshape(-1, 3), goal[0, 0]
        out = 0.25 * ((curve[1] - curve[0] - turn.apply(chain[0, 1] - chain[0, 0])) ** 2).sum()
        for i in range(1, len(curve) - 1):
            share = lengths[i] / (lengths[i - 1] + lengths[i])  # of the point before
            sticks_out = [share * c[i - 1] + (1 - share) * c[i + 1] - c[i] for c in (curve, chain[0])]
            out += ((sticks_out[0] - turn.apply(sticks_out[1])) ** 2).sum()
        return out

    ours = constrain.bent(chain, [chain.shape[1] - 1], goal)
    found = minimize(energy, chain[0, 1:-1].ravel(), tol=1e-14)
    np.testing.assert_allclose(ours[0, 1:-1], found.x.reshape(-1, 3), atol=1e-4)


@pytest.mark.parametrize("lift", [0.0, 0.1, 0.3])
def test_a_foot_that_is_put_down_the_other_way_round_throws_no_loops_into_its_leg(lift):
    """A bent leg whose foot exaggeration had turned over, lifted too: sub-links stay alike and none turns back."""
    angle = np.linspace(-1.1, 1.1, 13)
    leg = np.stack([np.cos(angle), -np.sin(angle), 0.1 * angle], axis=-1) * 0.45
    leg = np.concatenate([leg, leg[-1:] - [0.14, 0, 0]])
    goal = leg[-2] + np.array([[0, lift, 0], [0.14, lift - 0.03, 0]])
    links = np.diff(constrain.bent(leg[None], [12, 13], goal[None])[0, :13], axis=0)
    lengths = np.linalg.norm(links, axis=1)
    assert lengths.max() < 3 * lengths.min()
    assert (np.einsum("nd,nd->n", links[1:], links[:-1]) > 0.5 * lengths[1:] * lengths[:-1]).all()


def test_goals_come_and_go_without_a_jump(leg, standing):
    sub, count = leg(), 120
    before = standing(sub, count)
    frames = np.zeros((2, count), bool)
    frames[0, 40:60], frames[1, 30:80] = True, True  # the toe stays longer than the ankle
    up = np.array([0, 0.2, 0.1])
    goals = [
        constrain.held(k, before[:, sub.ends[k]] + up, held, FPS, 0.1) for k, held in zip((3, 4), frames, strict=True)
    ]
    after = constrain.constrained(before, sub, goals)
    np.testing.assert_allclose(after[30:80, sub.ends[4]], before[30:80, sub.ends[4]] + up, atol=1e-12)
    np.testing.assert_allclose(after[40:60, sub.ends[3]], before[40:60, sub.ends[3]] + up, atol=1e-12)
    assert np.abs(np.diff(after, axis=0)).max() < 0.25 * 0.2 * 1.7  # six frames take it in, at most pi/2 of the mean
    np.testing.assert_array_equal(after[:20], before[:20])


def test_a_hand_hits_its_target_in_its_frame(leg, standing):
    sub = leg()
    before = standing(sub, 60)
    goal = constrain.reach(4, [0.3, 0.6, 0.5], 30, 60, FPS)
    after = constrain.constrained(before, sub, [goal])
    np.testing.assert_allclose(after[30, sub.ends[4]], [0.3, 0.6, 0.5], atol=1e-12)
    assert np.ptp(after[:14], axis=0).max() == 0


def test_a_root_cannot_be_a_goal_and_a_frame_to_reach_in_must_exist(leg, standing):
    sub = leg()
    with pytest.raises(InputError, match="is a root"):
        constrain.constrained(standing(sub), sub, [always(0, np.zeros((1, 3)))])
    with pytest.raises(InputError, match="frame to reach"):
        constrain.reach(3, [0, 0, 0], 9, 5, FPS)


def test_feet_stand_where_they_stood(leg, standing):
    sub, count = leg(), 90
    captured = standing(sub, count)[:, sub.ends]
    drift = np.cumsum(np.full((count, 1, 3), [0.004, 0, 0.002]), axis=0)
    contacts = np.zeros((count, 2), bool)
    contacts[20:50] = True
    after = feet.kept(standing(sub, count) + drift, sub, captured, (3, 4), contacts, FPS)
    for joint in (3, 4):
        np.testing.assert_allclose(after[20:50, sub.ends[joint]], captured[20:50, joint], atol=1e-12)


def test_no_foot_goes_through_the_floor(leg, standing):
    sub, count = leg(), 60
    captured = standing(sub, count)[:, sub.ends]
    dip = 0.1 * np.sin(np.linspace(0, np.pi, count))[:, None, None] * [0, -1, 0]
    after = feet.above(standing(sub, count) + dip, sub, (3, 4, 7, 8), captured, FPS)
    floor = captured[:, [3, 4, 7, 8], 1].min(axis=0)
    assert (after[:, sub.ends[[3, 4, 7, 8]], 1] > floor - 1e-9).all()
    np.testing.assert_allclose(after[:, sub.ends[0]], (standing(sub, count) + dip)[:, sub.ends[0]])
