"""A posing session: what messages do, that all of it can be undone, and that bad ones change nothing."""

import json

import numpy as np
import pytest

from capture.errors import InputError
from fixtures import skeletons
from mocap.posing import limits, poses, session
from mocap.skeletons.bvh import read_bvh, write_bvh
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion

HAND = {"do": "drag", "joint": "RightHand", "to": [-0.3, 1.5, 0.3]}


def test_a_drag_moves_the_joint_and_pins_hold():
    posing = begun()
    foot = posing.skeleton.names.index("LeftFoot")
    before = np.array(posing.send({"do": "pin", "joint": "LeftFoot"})["positions"])
    seen = posing.send(HAND)
    places = np.array(seen["positions"])
    assert seen["error"] == "" and seen["pinned"] == ["LeftFoot"]
    np.testing.assert_allclose(places[posing.skeleton.names.index("RightHand")], HAND["to"], atol=2e-3)
    np.testing.assert_array_equal(places[foot], before[foot])


def test_dragged_about_and_back_a_figure_is_as_it_was():
    posing = begun()
    for foot in ("LeftFoot", "RightFoot"):
        posing.send({"do": "pin", "joint": foot})
    start = np.array(posing.send({"do": "look"})["positions"])
    hand = start[posing.skeleton.names.index("RightHand")]
    for to in ([-0.3, 1.5, 0.3], [-0.6, 0.5, 0], [0, 1.2, 0.5]):
        there = np.array(posing.send(HAND | {"to": to})["positions"])
        assert np.abs(there - start).max() > 0.1
    for share in np.linspace(0, 1, 20):
        back = posing.send(HAND | {"to": ((1 - share) * np.array([0, 1.2, 0.5]) + share * hand).tolist()})
    np.testing.assert_allclose(back["positions"], start, atol=2e-3)


@pytest.mark.parametrize("seed", range(6))
def test_as_the_pointer_moves_on_a_figure_with_two_pins_does_not_jump_though_it_is_out_of_reach(seed):
    """In 97 of 100 moves no joint goes six times as far as the pointer; a straight elbow gives way by its root."""
    posing = begun()
    for foot in ("LeftFoot", "RightFoot"):
        posing.send({"do": "pin", "joint": foot})
    places = np.array(posing.send({"do": "look"})["positions"])
    joint = ("RightHand", "Head", "Hips")[seed % 3]
    start, rng = places[posing.skeleton.names.index(joint)], np.random.default_rng(seed)
    time = np.linspace(0, 1, 100)[:, None]
    way = sum(rng.normal(size=3) * np.sin(np.pi * k * time) for k in (1, 2, 3))
    far, short = [], []
    for move, before in zip(way[1:], way):
        seen = posing.send({"do": "drag", "joint": joint, "to": (start + move).tolist()})
        now = np.array(seen["positions"])
        far.append(np.linalg.norm(now - places, axis=1).max() / np.linalg.norm(move - before))
        short.append(np.linalg.norm(now[posing.skeleton.names.index(joint)] - start - move))
        places = now
    assert max(short) > 0.05  # metres: there is nothing to prove within reach
    assert np.quantile(far, 0.97) < 6


def test_one_drag_is_one_undo_however_often_the_pointer_moved():
    posing = begun()
    start = posing.send({"do": "look"})
    for height in (1.2, 1.3, 1.4):
        posing.send(HAND | {"to": [-0.3, height, 0.3]})
    end = posing.send({"do": "drop"})
    assert end["undo"] == 1 and end["redo"] == 0
    back = posing.send({"do": "undo"})
    assert back["positions"] == start["positions"] and (back["undo"], back["redo"]) == (0, 1)
    assert posing.send({"do": "redo"})["positions"] == end["positions"]


def test_undo_in_the_middle_of_a_drag_goes_back_to_where_it_began():
    posing = begun()
    start = posing.send({"do": "look"})["positions"]
    posing.send(HAND)
    assert posing.send({"do": "undo"})["positions"] == start
    assert posing.send({"do": "drop"})["positions"] == start


def test_everything_can_be_undone_and_done_again():
    """Twelve messages of all kinds: undone one by one the session looks as it did before each, and so it does again."""
    posing = begun()
    looks = [posing.send({"do": "look"})]
    for message in (
        {"do": "pin", "joint": "LeftFoot"},
        HAND,
        {"do": "keep", "name": "up"},
        {"do": "pin", "joint": "righthand"},
        {"do": "drag", "joint": "Head", "to": [0.3, 1.2, 0.4]},
        {"do": "keep", "name": "down"},
        {"do": "unpin", "joint": "LeftFoot"},
        {"do": "unpin"},
        {"do": "take", "name": "up"},
        {"do": "keep", "name": "down"},
        {"do": "forget", "name": "up"},
    ):
        posing.send(message)
        looks.append(posing.send({"do": "drop"}))
    assert [look["undo"] for look in looks] == list(range(12))
    for look in reversed(looks[:-1]):
        assert plain(posing.send({"do": "undo"})) == plain(look)
    for look in looks[1:]:
        assert plain(posing.send({"do": "redo"})) == plain(look)


def test_a_new_deed_after_an_undo_ends_what_could_be_done_again():
    posing = begun()
    posing.send({"do": "pin", "joint": "LeftFoot"})
    posing.send({"do": "undo"})
    assert posing.send({"do": "pin", "joint": "RightFoot"})["redo"] == 0


def test_messages_and_answers_are_plain_enough_for_json():
    posing = begun()
    for message in (HAND, {"do": "keep", "name": "a"}, {"do": "play", "seconds": 0.1, "fps": 12}):
        answer = posing.send(json.loads(json.dumps(message)))
        assert json.loads(json.dumps(answer)) == answer


def test_play_goes_from_posture_to_posture_and_keeps_links():
    posing = begun()
    names = posing.skeleton.names
    kept = []
    for name, height in (("low", 0.7), ("high", 1.6), ("middle", 1.1)):
        posing.send(HAND | {"to": [-0.3, height, 0.3]})
        kept.append(posing.send({"do": "keep", "name": name})["positions"])
    played = posing.send({"do": "play", "seconds": 0.5, "fps": 24})
    frames = np.array(played["frames"])
    assert played["fps"] == 24 and len(frames) == 25
    np.testing.assert_allclose(frames[[0, 12, 24]], kept, atol=1e-4)
    parents = np.array(posing.skeleton.parents[1:])
    lengths = np.linalg.norm(frames[:, 1:] - frames[:, parents], axis=-1)
    np.testing.assert_allclose(lengths, np.broadcast_to(posing.skeleton.lengths()[1:], lengths.shape), atol=1e-4)
    hand = frames[:13, names.index("RightHand"), 1]
    assert (np.diff(hand) > -1e-3).all() and np.diff(hand)[0] < 0.5 * np.diff(hand).max()  # it slows in and out


def test_what_is_played_live_swings_on_and_feels_as_it_is_told_at_once():
    """A damped oscillator by hand: from the second message on the springs are others, place and speed are not."""
    from scipy.integrate import solve_ivp

    posing = begun()
    two_kept(posing)
    posing.send({"do": "feel", "quick": 1.0, "damping": 0.2})
    posing.send({"do": "next", "seconds": 0.1, "each": 1.0})
    before = posing.live.state
    posing.send({"do": "feel", "quick": 3.0, "damping": 0.9})
    posing.send({"do": "next", "seconds": 0.15, "each": 1.0})
    w = 6 * np.pi
    goal, start = posing.live.goals[1].ravel(), np.concatenate([before.turns.ravel(), before.speed.ravel()])
    n = len(goal)
    truth = solve_ivp(
        lambda t, y: np.concatenate([y[n:], -1.8 * w * y[n:] - w * w * (y[:n] - goal)]),
        (0, 0.15), start, rtol=1e-9, atol=1e-10,
    ).y[:n, -1]  # fmt: skip
    np.testing.assert_allclose(posing.live.state.turns.ravel(), truth, atol=1e-7)
    assert np.abs(truth - start[:n]).max() > 0.05


def test_played_live_it_goes_round_the_postures_and_does_not_depend_on_the_frame_rate():
    fine, coarse = begun(), begun()
    (low, high), _ = two_kept(fine), two_kept(coarse)
    for posing in (fine, coarse):
        posing.send({"do": "feel", "quick": 4, "damping": 1})
    for _ in range(240):
        one = fine.send({"do": "next", "seconds": 1 / 240, "each": 1.0})
    for _ in range(12):
        other = coarse.send({"do": "next", "seconds": 1 / 12, "each": 1.0})
    np.testing.assert_allclose(one["frames"], other["frames"], atol=1e-9)
    np.testing.assert_allclose(other["frames"][0], high, atol=0.01)
    back = coarse.send({"do": "next", "seconds": 1.0, "each": 1.0})
    np.testing.assert_allclose(back["frames"][0], low, atol=0.01)


def test_wobbly_joints_swing_over_and_damped_ones_do_not():
    reach = {}
    for damping in (0.2, 1.0):
        posing = begun()
        two_kept(posing)
        posing.send({"do": "feel", "quick": 3, "damping": damping})
        turns = []
        for _ in range(24):
            posing.send({"do": "next", "seconds": 1 / 24, "each": 1.0})
            turns.append(posing.live.state.turns)
        big = np.abs(posing.live.goals[1]).argmax()
        reach[damping] = max(np.array(turns).reshape(24, -1)[:, big] / posing.live.goals[1].flat[big])
    assert reach[0.2] > 1.3 and reach[1.0] <= 1 + 1e-12


def test_other_postures_end_what_is_played_live():
    posing = begun()
    two_kept(posing)
    posing.send({"do": "next"})
    assert posing.live is not None
    posing.send({"do": "forget", "name": "low"})
    assert posing.live is None
    posing.send({"do": "next"})
    posing.send({"do": "stop"})
    assert posing.live is None


def test_a_kept_pose_comes_back_from_a_motion_file(tmp_path):
    posing = begun()
    posing.send({"do": "pin", "joint": "LeftFoot"})
    posing.send(HAND)
    write_bvh(poses.motion_of(posing.skeleton, [posing.pose], 24), tmp_path / "pose.bvh")
    read = read_bvh(tmp_path / "pose.bvh")
    order = [read.skeleton.names.index(name) for name in posing.skeleton.names]
    np.testing.assert_allclose(read.positions()[0, order], posing.pose.positions, atol=1e-4)


def test_a_pose_and_its_motion_are_each_others_inverse():
    figure = skeletons.kick()
    skeleton = Skeleton(figure.names, figure.parents, figure.offsets)
    motion = SkeletonMotion(skeleton, figure.translation, figure.rotation, figure.fps)
    frames = [poses.pose_of(motion, t) for t in (0, 70, 90)]
    np.testing.assert_allclose([pose.positions for pose in frames], figure.positions[[0, 70, 90]], atol=1e-9)
    back = poses.motion_of(skeleton, frames, figure.fps)
    np.testing.assert_allclose(back.positions(), figure.positions[[0, 70, 90]], atol=1e-9)
    np.testing.assert_allclose(np.abs((back.rotation * figure.rotation[[0, 70, 90]]).sum(axis=-1)), 1, atol=1e-9)


@pytest.mark.parametrize(
    ("message", "said"),
    [
        ({}, "must say what to do"),
        ({"do": "dance"}, "must say what to do"),
        ({"do": ["pin"]}, "must say what to do"),
        ("pin", "must say what to do"),
        (None, "must say what to do"),
        ({"do": "pin"}, "a joint must be one of"),
        ({"do": "pin", "joint": "Nose"}, "there is no 'Nose'"),
        ({"do": "pin", "joint": 31}, "there is no 31"),
        ({"do": "pin", "joint": True}, "there is no True"),
        ({"do": "drag", "joint": "Head"}, "'to' must be 3 numbers"),
        ({"do": "drag", "joint": "Head", "to": "up"}, "'to' must be 3 numbers"),
        ({"do": "drag", "joint": "Head", "to": [0, 1]}, "'to' must be 3 numbers"),
        ({"do": "drag", "joint": "Head", "to": [0, 1, float("nan")]}, "must be dragged to a place"),
        ({"do": "drag", "joint": "Head", "to": [0, 1, float("inf")]}, "must be dragged to a place"),
        ({"do": "drag", "joint": "Hips", "to": [0, 1, 1]}, "is pinned and cannot be dragged"),
        ({"do": "keep"}, "must have a name"),
        ({"do": "keep", "name": "  "}, "must have a name"),
        ({"do": "take", "name": "jump"}, "there is no 'jump': kept are none yet"),
        ({"do": "forget", "name": "jump"}, "there is no 'jump'"),
        ({"do": "play", "seconds": 0}, "must take 0 to 60 seconds"),
        ({"do": "play", "seconds": float("nan")}, "must take 0 to 60 seconds"),
        ({"do": "play", "fps": "many"}, "'fps' must be 1 number"),
        ({"do": "feel"}, "say some of quick, damping"),
        ({"do": "feel", "bounce": 1}, "not bounce"),
        ({"do": "feel", "quick": 0}, "frequency of an elastic joint must be above 0"),
        ({"do": "feel", "quick": float("nan")}, "are numbers"),
        ({"do": "feel", "damping": -0.1}, "damping of an elastic joint must be 0 or more"),
        ({"do": "feel", "wild": 9}, "must be -4 to 4"),
        ({"do": "next", "seconds": -1}, "must be 0 to 60 seconds later"),
        ({"do": "next", "each": 0}, "postures last 0.01 to 60"),
    ],
)
def test_a_message_that_cannot_be_followed_is_told_so_and_changes_nothing(message, said):
    posing = begun()
    posing.send({"do": "pin", "joint": "Hips"})
    before = posing.send({"do": "look"})
    answer = posing.send(message)
    assert said in answer["error"]
    assert posing.send({"do": "look"}) == before == answer | {"error": ""}


def test_a_skeleton_in_pieces_is_refused_before_anybody_drags_it():
    with pytest.raises(InputError, match="must hang together"):
        session.begun(Skeleton(("a", "b", "c"), (-1, -1, 1), np.ones((3, 3))))


def begun():
    figure = skeletons.kick()
    skeleton = Skeleton(figure.names, figure.parents, figure.offsets)
    motion = SkeletonMotion(skeleton, figure.translation, figure.rotation, figure.fps)
    return session.begun(skeleton, poses.pose_of(motion, 0), limits.usual(skeleton))


def two_kept(posing):
    places = []
    for name, height in (("low", 0.7), ("high", 1.6)):
        posing.send(HAND | {"to": [-0.3, height, 0.3]})
        places.append(posing.send({"do": "keep", "name": name})["positions"])
    return places


def plain(answer):
    return {name: answer[name] for name in ("positions", "pinned", "kept")}
