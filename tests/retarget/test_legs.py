"""A leg of two bones bends for its foot: the foot is where it is told to be, bones keep their lengths, knees never flip."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from capture.errors import InputError
from capture.motion import affine, keys
from capture.motion.tracks import CartoonMotion, track_of
from retarget.characters.drawings.drawing import outline_drawing
from retarget.characters.models.mesh import read_mesh
from retarget.stage import legs, staging
from retarget.stage.perform import perform

RED = np.array([1.0, 0, 0, 1])
FRAMES = 24
HIP, KNEE, ANKLE = np.array([100.0, 100]), np.array([100.0, 150]), np.array([100.0, 200])
BODY = {  # what it hangs on, where, and the corners of its box
    "torso": ("", HIP, (85, 40, 115, 100)),
    "thigh": ("torso", HIP, (94, 95, 106, 155)),
    "shin": ("thigh", KNEE, (95, 145, 105, 204)),
    "foot": ("shin", ANKLE, (95, 196, 125, 206)),
    "patch": ("thigh", np.array([100.0, 120]), (97, 117, 103, 123)),
}


def box(x0, y0, x1, y1):
    return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]], float)


def turns(angles):
    c, s = np.cos(angles), np.sin(angles)
    linear = np.stack([np.stack([c, -s], -1), np.stack([s, c], -1)], -2)
    return np.concatenate([linear, np.zeros((len(angles), 2, 1))], axis=-1)


def walking(held=None):
    """A figure that goes right and swings a leg of thigh, shin and foot; its knee bends to one side only."""
    t = np.arange(FRAMES)
    angles = {"thigh": 0.5 * np.cos(t / 4), "shin": 0.5 + 0.3 * np.sin(t / 4), "foot": -0.4 * np.sin(t / 4)}
    tracks, sets = [], []
    for name, (parent, pivot, corners) in BODY.items():
        source = keys.keyset(("rest",), box(*corners)[None], spacing=8)
        maps = turns(angles.get(name, np.zeros(FRAMES)))
        if name == "torso":
            maps[:, 0, 2] = 3.0 * t
        weights, none = np.ones((FRAMES, 1)), np.zeros(FRAMES)
        track = track_of(name, source, affine.about(maps, pivot), weights, none, pivot=pivot, parent=parent, held=held)
        tracks.append(track)
        sets.append(source)
    return CartoonMotion(tuple(tracks), tuple(sets), t / 24, 24.0, (320, 240))


def played(motion):
    return perform(motion, [outline_drawing(name, motion.keyset(name), RED) for name in BODY])


def role(performance, part):
    return staging.role_of(performance, part)


def edges(mesh):
    return np.linalg.norm(np.diff(mesh[..., :2], axis=1), axis=-1)


@given(
    angles=st.lists(st.tuples(st.floats(-3, 3), st.floats(0.05, 3)), min_size=3, max_size=3),
    share=st.floats(0.001, 0.999),
    about=st.floats(-3, 3),
    a=st.floats(5, 80),
    b=st.floats(5, 80),
)
def test_any_goal_within_reach_is_met_and_bones_keep_their_lengths(angles, share, about, a, b):
    first, bent = np.array(angles).T
    hip = np.stack([np.arange(3.0), 2 * np.arange(3.0)], axis=-1)
    knee = hip + a * np.stack([np.cos(first), np.sin(first)], axis=-1)
    foot = knee + b * np.stack([np.cos(first + bent), np.sin(first + bent)], axis=-1)
    far = abs(a - b) + share * (a + b - abs(a - b))
    goal = hip + far * np.array([np.cos(about), np.sin(about)])
    upper, lower, there = legs.two_bones(hip, knee, foot, goal)
    np.testing.assert_allclose(there, goal, atol=1e-9)
    np.testing.assert_allclose(affine.apply(lower, foot[:, None])[:, 0], goal, atol=1e-9)
    np.testing.assert_allclose(affine.apply(upper, hip[:, None])[:, 0], hip, atol=1e-9)
    joints = [affine.apply(maps, knee[:, None])[:, 0] for maps in (upper, lower)]
    np.testing.assert_allclose(*joints, atol=1e-9)  # the knee holds together
    np.testing.assert_allclose(np.linalg.norm(joints[0] - hip, axis=-1), a, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(joints[0] - goal, axis=-1), b, atol=1e-9)
    turned = np.cross(np.pad(joints[0] - hip, [(0, 0), (0, 1)]), np.pad(goal - joints[0], [(0, 0), (0, 1)]))[:, 2]
    assert (turned > -1e-6).all()  # bent to the side it was bent to


def test_a_goal_out_of_reach_is_come_as_near_to_as_the_leg_is_long_and_as_told_it_may_stretch():
    hip, knee, foot = np.zeros((1, 2)), np.array([[10.0, 40]]), np.array([[0.0, 80]])
    a = np.hypot(10, 40)
    for goal in (np.array([[0.0, 200]]), np.array([[300.0, 10]])):
        direction = goal / np.linalg.norm(goal)
        for stretch in (0.0, 0.25):
            there = legs.two_bones(hip, knee, foot, goal, stretch)[2]
            np.testing.assert_allclose(there, 2 * a * (1 + stretch) * direction, atol=1e-9)
    near = legs.two_bones(hip, knee, np.array([[10.0, 60]]), np.array([[0.0, 5.0]]))[2]
    np.testing.assert_allclose(near, [[0, a - 20]], atol=1e-9)  # the bones' difference is as near as it comes


def test_a_knee_moves_on_evenly_and_does_not_flip_as_the_leg_goes_straight_and_bends_again():
    hip, knee, foot = (np.tile(point, (201, 1)) for point in (np.zeros(2), np.array([3.0, 40]), np.array([0.0, 80])))
    goal = np.stack([np.linspace(-60, 60, 201), np.full(201, 50.0)], axis=-1)  # in reach, straight at both ends nearly
    upper, _, _ = legs.two_bones(hip, knee, foot, goal)
    way = np.linalg.norm(np.diff(affine.apply(upper, knee[:, None])[:, 0], axis=0), axis=-1)
    assert way.max() < 4 * np.linalg.norm(goal[1] - goal[0])


def test_a_leg_that_is_a_stick_bends_forward():
    t = np.linspace(0, 1, 5)[:, None]
    for going in (1, -1):
        hip = going * t * [40.0, 0]
        knee, foot = hip + [0, 40], hip + [0, 80]
        upper, _, _ = legs.two_bones(hip, knee, foot, foot - [0, 20])
        assert (going * (affine.apply(upper, knee[:, None])[:, 0] - knee)[:, 0] > 1).all()


def test_a_foot_stays_while_the_body_goes_on_and_the_rest_of_the_figure_does_not_move():
    motion = walking()
    before = played(motion)
    stay = staging.Stay("foot", 8, 14, np.array([0, 1, 2]))
    slid = np.ptp(staging.foot_of(before, stay)[8:14], axis=0).max()
    after = legs.bend(before, legs.leg_of(motion, "foot", ("thigh", "shin")), [stay])
    kept = staging.foot_of(after, stay)
    turned = np.ptp(kept[8:14] - role(after, "foot").joint[8:14], axis=0).max()
    assert slid > 10 and np.ptp(kept[8:14], axis=0).max() < 1e-9 and turned > 1  # it still rolls
    np.testing.assert_array_equal(role(after, "torso").points, role(before, "torso").points)
    for part in ("thigh", "shin", "foot", "patch"):
        np.testing.assert_allclose(edges(role(after, part).mesh()), edges(role(before, part).mesh()), atol=1e-9)
    for part, parent in (("shin", "thigh"), ("foot", "shin"), ("patch", "thigh")):  # joints stay joints
        gaps = [np.linalg.norm(role(p, part).joint[:, None] - role(p, parent).mesh(), axis=-1) for p in (before, after)]
        np.testing.assert_allclose(*gaps, atol=1e-9)
    moved = np.linalg.norm(role(after, "foot").joint - role(before, "foot").joint, axis=-1)
    assert moved[0] < 0.2 * moved.max() and moved[-1] < 0.1 * moved.max()


def test_without_a_foot_of_its_own_the_shins_end_stays_in_the_place_it_is_told():
    motion = walking()
    before = played(motion)
    place = np.array([112.0, 196.0])
    end = np.array([2])  # a corner of the shin
    stays = [staging.Stay("shin", 3, 7, end, place), staging.Stay("shin", 12, 18, np.array([3]))]
    after = legs.bend(before, legs.leg_of(motion, "shin"), stays)
    first, second = (staging.foot_of(after, stay)[stay.start : stay.stop] for stay in stays)
    np.testing.assert_allclose(first, np.tile(place, (4, 1)), atol=1e-9)
    assert np.ptp(second, axis=0).max() < 1e-9
    steps = [np.linalg.norm(np.diff(role(p, "shin").points, axis=0), axis=-1).max() for p in (before, after)]
    assert steps[1] < 3 * steps[0]


def test_a_foot_that_stays_already_changes_nothing():
    motion = walking()
    before = played(motion)
    stay = staging.Stay("foot", 5, 6, np.array([0]))
    assert legs.bend(before, legs.leg_of(motion, "foot", ("thigh", "shin")), [stay]) is before
    assert legs.bend(before, legs.leg_of(motion, "shin"), []) is before
    hip, knee = role(before, "thigh").joint, role(before, "shin").joint
    foot = role(before, "foot").joint
    for maps in legs.two_bones(hip, knee, foot, foot)[:2]:
        np.testing.assert_allclose(maps, np.tile(np.eye(2, 3), (FRAMES, 1, 1)), atol=1e-9)


def test_legs_of_models_bend_in_the_plane_they_are_seen_in(tmp_path):
    motion = walking()
    actors = [outline_drawing(name, motion.keyset(name), RED) for name in BODY if name not in ("thigh", "shin")]
    for name in ("thigh", "shin"):  # boards that are as wide and tall as the part, and lean to the viewer
        width, height = np.ptp(motion.keyset(name).points[0], axis=0)
        corners = [(0, 0, 0), (width, 0, 0), (width, height, 7), (0, height, 7)]
        (tmp_path / f"{name}.obj").write_text("".join(f"v {x} {y} {z}\n" for x, y, z in corners) + "f 1 2 3\nf 1 3 4\n")
        actors.append(read_mesh(name, ("rest",), [tmp_path / f"{name}.obj"]))
    before = perform(motion, actors)
    stay = staging.Stay("shin", 8, 14, np.array([0]))
    after = legs.bend(before, legs.leg_of(motion, "shin"), [stay])
    assert np.ptp(staging.foot_of(before, stay)[8:14], axis=0).max() > 10
    assert np.ptp(staging.foot_of(after, stay)[8:14], axis=0).max() < 1e-9
    for part in ("thigh", "shin"):
        one, other = role(before, part).points, role(after, part).points
        np.testing.assert_array_equal(one[..., 2], other[..., 2])
        np.testing.assert_allclose(edges(one), edges(other), atol=1e-9)


def test_a_held_drawing_stays_held():
    held = np.arange(FRAMES) % 2 == 1
    motion = walking()
    tracks = [replace(track, held=held, affine=track.affine[np.arange(FRAMES) // 2 * 2]) for track in motion.tracks]
    motion = replace(motion, tracks=tuple(tracks))
    drawing = staging.drawings(motion)
    stay = staging.Stay("shin", 7, 13, np.array([2]))
    after = legs.bend(played(motion), legs.leg_of(motion, "shin"), [stay], drawing=drawing)
    points = role(after, "shin").points
    np.testing.assert_array_equal(points[1::2], points[::2])


def test_a_leg_is_the_part_and_what_it_hangs_on_unless_it_is_told():
    motion = walking()
    assert legs.leg_of(motion, "thigh") is None and legs.leg_of(motion, "torso") is None
    assert legs.leg_of(motion, "shin") == legs.Leg(("thigh", "patch"), ("shin", "foot"), ())
    assert legs.leg_of(motion, "foot", ("thigh", "shin")) == legs.Leg(("thigh", "patch"), ("shin",), ("foot",))
    for part, bones, said in (
        ("tail", None, "one of the motion's parts, 'tail' is none"),
        ("shin", ("torso", "shin"), "must hang on each other"),
        ("patch", ("thigh", "shin"), "and 'patch' on the second"),
    ):
        with pytest.raises(InputError, match=said):
            legs.leg_of(motion, part, bones)
