"""Motion capture lent to marks: where marks are the joints' own picture they go where the joints go."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from capture.motion import affine
from capture.motion.tracks import check, total_affine
from fixtures import stickman
from mocap.bones import cast_marks
from mocap.marks import Marks
from mocap.rubber.rubber import RubberMotion
from mocap.rubber.subjoints import SubJoints
from mocap.skeleton import Skeleton, SkeletonMotion
from mocap.to_tracks import to_tracks
from mocap.views import Views

STILL = Views(turning=False)


def _moving(turns, frames, travel=0.0):
    return SkeletonMotion(Skeleton(*stickman.skeleton()), *stickman.moving(turns, frames, travel))


def _marks(places=None):
    return Marks(*stickman.marks(places))


def _ends(motion, marks):
    """Where a motion takes the marked joints (T, J, 2): each as the far end of its last part."""
    places = np.empty((len(motion.times), len(marks), 2))
    corner = motion.tracks[0].pivot - marks.places[0]
    for joint, name in enumerate(marks.names):
        last = [track.part for track in motion.tracks if track.part.rpartition(" ")[0] == name] or [name]
        own = total_affine(motion, last[-1])
        places[:, joint] = affine.apply(own, (marks.places[joint] + corner)[None])[:, 0]
    return places


def _waving(frames=40, seed=3):
    """Arms and legs that turn every way, on a trunk that leans to its sides."""
    rng = np.random.default_rng(seed)
    phase = np.linspace(0, 2 * np.pi, frames)[:, None]
    turns = {}
    for name in stickman.NAMES:
        if name.endswith(("Arm", "Leg")):
            turns[name] = 0.7 * np.sin(phase * rng.integers(1, 3) + rng.uniform(0, 6, 3)) * (0.5, 0.5, 1)
    turns["Hips"] = np.sin(phase) * (0, 0, 0.3)
    turns["Chest"] = np.cos(phase) * (0, 0, 0.2)
    return _moving(turns, frames)


def test_marks_that_are_the_joints_own_picture_go_where_the_joints_go():
    motion, marks = _waving(), _marks()
    tracks = check(to_tracks(motion, marks, cast_marks(motion, marks, STILL), foreshorten=1.0))
    ends = _ends(tracks, marks)
    truth = stickman.seen(motion.positions()[:, [stickman.NAMES.index(name) for name in stickman.MARKED]])
    np.testing.assert_allclose(ends - ends[:, :1], truth - truth[:, :1], atol=1e-6)


def test_a_figure_that_stands_as_it_is_drawn_leaves_the_drawing_as_it_is():
    motion, marks = _moving({}, 5), _marks()
    tracks = to_tracks(motion, marks)
    for track in tracks.tracks:
        np.testing.assert_allclose(track.affine, np.tile(np.eye(2, 3), (5, 1, 1)), atol=1e-9)


def test_a_drawing_with_its_arms_down_points_them_where_the_performer_does():
    hanging = {"left_elbow": (25, -105), "left_hand": (30, -80), "right_elbow": (-20, -110), "right_hand": (-28, -85)}
    marks, motion = _marks(hanging), _moving({"LeftArm": (0, 0, np.pi / 6)}, 3)
    ends = _ends(to_tracks(motion, marks), marks)
    shoulder, elbow = (ends[:, marks.names.index(f"left_{what}")] for what in ("shoulder", "elbow"))
    way = (elbow - shoulder)[0]
    assert np.arctan2(-way[1], way[0]) == pytest.approx(np.pi / 6)
    drawn = marks.places[marks.names.index("left_elbow")] - marks.places[marks.names.index("left_shoulder")]
    assert np.linalg.norm(way) == pytest.approx(np.linalg.norm(drawn))


def test_the_viewer_goes_round_with_a_performer_who_turns():
    motion, marks = _waving(), _marks()
    turned = motion.rotation.copy()
    about = Rotation.from_euler("y", 130, degrees=True)
    turned[:, 0] = (about * Rotation.from_quat(motion.rotation[:, 0])).as_quat()
    translation = motion.translation.copy()
    translation[:, 0] = about.apply(translation[:, 0])
    other = replace(motion, rotation=turned, translation=translation)
    for mine, theirs in zip(to_tracks(motion, marks).tracks, to_tracks(other, marks).tracks, strict=True):
        np.testing.assert_allclose(mine.affine, theirs.affine, atol=1e-6)


def test_legs_that_stride_are_seen_from_the_side_and_go_to_the_right():
    swing = np.sin(np.linspace(0, 4 * np.pi, 60))[:, None] * (-0.8, 0, 0)  # a turn about -x takes a leg forward
    motion, marks = _moving({"LeftUpLeg": swing, "RightUpLeg": -swing}, 60), _marks()
    casting = cast_marks(motion, marks)
    assert (casting.views.legs, casting.views.arms) == (90.0, 0.0)
    assert "legs side" in casting.notes[1] and "left_knee = LeftLeg" in casting.notes[0]
    ends = _ends(to_tracks(motion, marks, casting), marks)
    knee, hip = (ends[:, marks.names.index(f"left_{what}"), 0] for what in ("knee", "hip"))
    assert np.corrcoef(knee - hip, -swing[:, 0])[0, 1] > 0.99


def test_legs_that_crouch_and_spread_are_seen_from_the_front():
    """A jumping jack: knees go far forward, feet only to the sides."""
    phase = np.linspace(0, 4 * np.pi, 60)[:, None]
    crouch, spread = 0.6 * (1 - np.cos(phase)) * (1, 0, 0), 0.35 * (1 - np.cos(phase)) * (0, 0, 1)
    turns = {
        "LeftUpLeg": spread - crouch,
        "RightUpLeg": -spread - crouch,
        "LeftLeg": 2 * crouch,
        "RightLeg": 2 * crouch,
    }
    casting = cast_marks(_moving(turns, 60), _marks())
    assert casting.views.legs == 0.0


def test_a_drawing_of_a_side_is_seen_from_the_side():
    narrow = {name: (x, y) for name, x, y in (("left_shoulder", 3, -143), ("right_shoulder", -3, -143))}
    narrow |= {"left_hip": (2, -90), "right_hip": (-2, -90)}
    casting = cast_marks(_moving({}, 3), _marks(narrow))
    assert casting.views.trunk == casting.views.arms == casting.views.legs == 90.0


def _rubber(motion, longer, thickness):
    """The motion as rubber, one sub-joint a joint, its left forearm as much longer and all links as thick."""
    own = motion.skeleton
    positions = motion.positions().copy()
    elbow, hand = stickman.NAMES.index("LeftForeArm"), stickman.NAMES.index("LeftHand")
    positions[:, hand] = positions[:, elbow] + longer * (positions[:, hand] - positions[:, elbow])
    count = len(own)
    sub = SubJoints(own, own.parents, np.arange(count), np.ones(count), np.arange(count), ())
    shape = positions.shape[:2]
    still = np.tile([0, 0, 0, 1.0], (*shape, 1))
    return RubberMotion(motion, sub, positions, still, np.ones(shape), np.full(shape, thickness))


def test_stretch_and_thickness_of_rubber_are_carried():
    marks = _marks()
    tracks = to_tracks(_rubber(_moving({}, 4), 1.6, 0.8), marks)
    sizes = np.linalg.svd(total_affine(tracks, "left_hand 2")[0, :, :2], compute_uv=False)
    np.testing.assert_allclose(sizes, [1.6, 0.8], atol=1e-9)
    ends = _ends(tracks, marks)
    elbow, hand = (ends[0, marks.names.index(f"left_{what}")] for what in ("elbow", "hand"))
    assert np.linalg.norm(hand - elbow) == pytest.approx(1.6 * 25)


def test_hands_keep_their_size_however_long_the_arm():
    tracks = to_tracks(_rubber(_moving({"LeftArm": (0, 0, 0.5)}, 4), 1.6, 0.8), _marks())
    hand, arm = (total_affine(tracks, f"left_hand {which}")[0, :, :2] for which in ("end", "4"))
    np.testing.assert_allclose(np.linalg.svd(hand, compute_uv=False), 1, atol=1e-9)
    assert affine.turn(hand) == pytest.approx(affine.turn(arm)) == pytest.approx(-0.5)


def test_a_limb_is_drawn_before_the_body_when_it_is_nearer_and_does_not_flicker():
    rng = np.random.default_rng(0)
    swing = np.concatenate([np.full(20, -1.2), np.full(20, 1.2)])  # about y: the left arm goes to the front, then back
    turns = np.stack([np.zeros(40), swing + 0.01 * rng.normal(size=40), np.zeros(40)], axis=-1)
    tracks = to_tracks(_moving({"LeftArm": turns}, 40), _marks())
    order = tracks.track("left_hand 1").order
    assert (order[:20] > 0).all() and (order[20:] < 0).all()
    near = np.stack([np.zeros(40), 0.02 * rng.normal(size=40), np.zeros(40)], axis=-1)
    calm = to_tracks(_moving({"LeftArm": near}, 40), _marks()).track("left_hand 1").order
    assert len(np.unique(calm)) == 1


def test_a_leg_that_kicked_to_the_viewer_goes_behind_the_coat_again():
    kick = np.concatenate([np.zeros(10), np.full(10, 1.4), np.zeros(10)])[:, None] * (-1, 0, 0)
    motion, marks = _moving({"LeftUpLeg": kick}, 30), _marks()
    order = to_tracks(motion, marks, cast_marks(motion, marks, Views())).track("left_knee 1").order
    assert (order[10:20] > 0).all() and (order[:10] < 0).all() and (order[20:] < 0).all()


def test_a_foot_that_stands_does_not_slide_under_legs_of_other_lengths():
    lean = np.linspace(-0.35, 0.35, 60)  # the left leg stands on its foot and the body goes over it
    turns = {"LeftUpLeg": lean[:, None] * (1, 0, 0), "RightUpLeg": (-1.2, 0, 0), "RightLeg": (1.6, 0, 0)}
    motion = _moving(turns, 60)
    foot = motion.positions()[:, stickman.NAMES.index("LeftFoot")]
    motion = _moving(turns, 60, travel=foot[:1] - foot)
    short = {"left_knee": (8, -70), "left_foot": (8, -50), "right_knee": (-8, -70), "right_foot": (-8, -50)}
    marks = _marks(short)
    casting = cast_marks(motion, marks, Views(legs=90.0))
    ends = _ends(to_tracks(motion, marks, casting), marks)
    stood = ends[:, marks.names.index("left_foot")]
    walked = ends[:, 0, 0]
    assert np.ptp(walked) > 15
    assert np.ptp(stood[:, 0]) < 0.03 * np.ptp(walked) and np.ptp(stood[:, 1]) < 1e-6


def test_bones_that_nobody_plays_go_with_what_they_hang_on():
    plain = _marks()
    places = np.vstack([plain.places, [(-30, -95), (-50, -80)]])
    marks = replace(plain, names=(*plain.names, "tail", "tip"), parents=(*plain.parents, 0, len(plain)), places=places)
    motion = _moving({"Hips": (0, 0, 0.4)}, 3)
    tracks = to_tracks(motion, marks, swing=False)
    tail, root = (total_affine(tracks, name)[0, :, :2] for name in ("tip", "root"))
    np.testing.assert_allclose(tail, root, atol=1e-9)
    np.testing.assert_allclose(affine.turn(root), -0.4, atol=1e-6)


def test_a_tail_swings_after_the_body_and_comes_to_rest():
    plain = _marks()
    places = np.vstack([plain.places, [(-30, -95), (-60, -95)]])
    marks = replace(plain, names=(*plain.names, "tail", "tip"), parents=(*plain.parents, 0, len(plain)), places=places)
    lean = np.concatenate([np.zeros(20), np.linspace(0, 0.8, 6), np.full(94, 0.8)])[:, None] * (0, 0, 1)
    motion = _moving({"Hips": lean}, 120)
    swings, stiff = (total_affine(to_tracks(motion, marks, swing=swing), "tip") for swing in (True, False))
    behind = affine.turn(swings) - affine.turn(stiff)
    assert behind[20:26].max() > 0.1  # the body turns by a negative angle, y being down: the tail is late
    assert behind.min() < -0.02  # and swings over
    assert np.abs(behind[-10:]).max() < 0.02
    played = [total_affine(to_tracks(motion, marks, swing=swing), "left_hand 4")[..., :2] for swing in (True, False)]
    np.testing.assert_array_equal(*played)


def test_feet_that_are_drawn_apart_lift_their_own_heels():
    names, parents, offsets = stickman.skeleton()
    toes = {"LeftToe": ("LeftFoot", (0, -0.05, 0.15)), "RightToe": ("RightFoot", (0, -0.05, 0.15))}
    own = Skeleton(
        (*names, *toes),
        (*parents, *(names.index(up) for up, _ in toes.values())),
        np.vstack([offsets, *(offset for _, offset in toes.values())]),
    )
    rotation = np.tile([0, 0, 0, 1.0], (3, len(own), 1))
    for side in ("Left", "Right"):
        rotation[:, own.names.index(f"{side}Foot")] = Rotation.from_rotvec((0.6, 0, 0)).as_quat()  # toes down
    motion = SkeletonMotion(own, np.tile(own.offsets, (3, 1, 1)), rotation, 30.0)
    plain = _marks()
    ankles = {side: plain.names.index(f"{side}_foot") for side in ("left", "right")}
    places = np.vstack([plain.places, plain.places[ankles["left"]] + (16, 5), plain.places[ankles["right"]] + (-16, 5)])
    marks = Marks((*plain.names, "left_toe", "right_toe"), (*plain.parents, *ankles.values()), places)
    tracks = to_tracks(motion, marks, cast_marks(motion, marks, Views(legs=90.0)))
    left, right = (affine.turn(total_affine(tracks, f"{side}_toe")[0]) for side in ("left", "right"))
    assert left == pytest.approx(0.6) and right == pytest.approx(-0.6)  # each toe goes down, y being down


def test_an_arm_that_points_at_the_viewer_keeps_a_direction_and_some_length():
    swing = np.linspace(-0.5, 0.5, 40)[:, None] * (0, 0, 1) + (0, -np.pi / 2, 0)
    motion, marks = _moving({"LeftArm": swing}, 40), _marks()
    ends = _ends(to_tracks(motion, marks), marks)
    forearm = ends[:, marks.names.index("left_hand")] - ends[:, marks.names.index("left_elbow")]
    assert np.linalg.norm(forearm, axis=1).min() > 0.2 * 25
    assert np.isfinite(ends).all()


def test_everything_lies_on_the_page():
    motion, marks = _waving(), _marks()
    tracks = to_tracks(motion, marks)
    ends = _ends(tracks, marks)
    assert (ends > 0).all() and (ends < tracks.size).all()
