"""The whole chain: what it must leave alone, and what it must make."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from capture.errors import InputError
from mocap.bvh import read_bvh, write_bvh
from mocap.rubber import collide, lengths, rubber, squash
from mocap.skeleton import Skeleton, SkeletonMotion


def test_omega_1_changes_nothing_but_that_limbs_bend_smoothly():
    motion = _kicking()
    for hose in (0.0, 1.0):
        made = rubber.make_rubber(motion, omega=1, hose=hose)
        np.testing.assert_allclose(made.positions[:, made.subjoints.ends], motion.positions(), atol=1e-9)
        np.testing.assert_allclose(made.positions, rubber.plain(motion, hose).positions, atol=1e-9)
    np.testing.assert_allclose(rubber.plain(motion).stretch, 1, atol=1e-9)


def test_a_figure_that_glides_along_is_left_as_it_is():
    motion = _kicking()
    still = replace(motion, rotation=np.repeat(motion.rotation[7:8], 80, axis=0))
    glide = still.skeleton.offsets + np.zeros((80, 1, 1))
    glide[:, 0] += np.arange(80)[:, None] / 60 * [1.2, 0, 0.3]
    still = replace(still, translation=glide)
    np.testing.assert_allclose(
        rubber.make_rubber(still, omega=9).positions, rubber.plain(still, hose=1).positions, atol=1e-9
    )


def test_links_stay_within_what_they_may_be_stretched():
    motion = _kicking()
    made = rubber.make_rubber(motion, omega=20, most_stretch=1.5, feet=[])
    skeleton = made.source.skeleton
    ratio = lengths.ratios(made.positions[:, made.subjoints.ends], skeleton.parents, skeleton.lengths())
    assert ratio.max() <= 1.5 and ratio.min() >= 1 / 1.5 and ratio.max() > 1.4 and ratio.min() < 0.95


def test_what_it_says_of_stretch_and_thickness_is_so():
    made = rubber.make_rubber(_kicking(), omega=6)
    for s, parent in enumerate(made.subjoints.parents):
        if parent >= 0:
            long = np.linalg.norm(made.positions[:, s] - made.positions[:, parent], axis=1)
            np.testing.assert_allclose(long, made.stretch[:, s] * made.subjoints.lengths()[s], atol=1e-12)
    assert (made.stretch[:, np.array(made.subjoints.parents) < 0] == 1).all()
    kept = squash.volume(made.stretch, made.thickness, made.subjoints.lengths())
    np.testing.assert_allclose(kept, 1, atol=0.02)


@pytest.mark.parametrize(("turn", "feet"), [((0.3, 1.2, -0.5), ()), ((0, 1.2, 0), None)])
def test_it_commutes_with_turning_and_carrying_the_whole_motion(turn, feet):
    """With feet that stand on a floor, turned about the vertical."""
    motion = _kicking()
    whole = Rotation.from_euler("xyz", turn)
    translation, rotation = motion.translation.copy(), motion.rotation.copy()
    translation[:, 0] = whole.apply(translation[:, 0]) + [2, -1, 3]
    rotation[:, 0] = (whole * Rotation.from_quat(rotation[:, 0])).as_quat()
    here = rubber.make_rubber(motion, feet=feet)
    there = rubber.make_rubber(replace(motion, translation=translation, rotation=rotation), feet=feet)
    moved = whole.apply(here.positions.reshape(-1, 3)).reshape(here.positions.shape) + [2, -1, 3]
    np.testing.assert_allclose(there.positions, moved, atol=1e-6)
    turned = (whole * Rotation.from_quat(here.rotation.reshape(-1, 4))).as_quat().reshape(here.rotation.shape)
    np.testing.assert_allclose(np.abs((there.rotation * turned).sum(axis=-1)), 1, atol=1e-6)
    np.testing.assert_allclose(there.stretch, here.stretch, atol=1e-6)


def test_a_size_of_the_figure_is_nothing_to_it():
    motion = _kicking()
    twice = replace(
        motion,
        skeleton=replace(motion.skeleton, offsets=2 * motion.skeleton.offsets),
        translation=2 * motion.translation,
    )
    np.testing.assert_allclose(rubber.make_rubber(twice).positions, 2 * rubber.make_rubber(motion).positions, atol=1e-9)


def test_a_kick_reaches_further_and_is_wound_up_further():
    motion = _kicking()
    foot = motion.skeleton.names.index("ankle")
    captured = motion.positions()[:, foot, 2]
    made = rubber.make_rubber(motion)
    pushed = made.positions[:, made.subjoints.ends[foot], 2]
    assert pushed.max() > captured.max() + 0.08 and pushed.min() < captured.min() - 0.05


def test_hips_that_hang_on_a_root_on_the_floor_are_a_root_themselves():
    """As in Bandai Namco's files: what lies between the floor and the hips is no link, and does not stretch."""
    motion = _kicking()
    floor = SkeletonMotion(
        Skeleton(
            ("floor", *motion.skeleton.names),
            (-1, *(parent + 1 for parent in motion.skeleton.parents)),
            np.concatenate([np.zeros((1, 3)), motion.skeleton.offsets]),
        ),
        np.pad(motion.translation, ((0, 0), (1, 0), (0, 0))),
        np.concatenate([np.tile([0, 0, 0, 1.0], (len(motion), 1, 1)), motion.rotation], axis=1),
        motion.fps,
    )
    on_floor, free = rubber.make_rubber(floor), rubber.make_rubber(motion)
    np.testing.assert_allclose(on_floor.positions[:, 1:], free.positions, atol=1e-9)
    np.testing.assert_allclose(on_floor.positions[:, 0], 0, atol=1e-12)
    np.testing.assert_allclose(np.abs((on_floor.rotation[:, 1:] * free.rotation).sum(axis=-1)), 1, atol=1e-9)


def test_links_are_as_long_as_they_are_in_the_motion_not_as_the_skeleton_says():
    """A position channel replaces an offset: some files give all joints one, and wrong offsets."""
    motion = _kicking()
    wrong = replace(motion, skeleton=replace(motion.skeleton, offsets=motion.skeleton.offsets * 3))
    np.testing.assert_allclose(rubber.make_rubber(wrong).positions, rubber.make_rubber(motion).positions, atol=1e-9)


def test_a_pose_set_before_the_motion_is_kept_and_pushes_nothing():
    motion = _kicking()
    posed = replace(
        motion,
        rotation=np.concatenate([_turned_off(motion.rotation[:1]), motion.rotation]),
        translation=np.concatenate([motion.translation[:1], motion.translation]),
    )
    made = rubber.make_rubber(posed)
    np.testing.assert_allclose(made.positions[1:], rubber.make_rubber(motion).positions, atol=1e-12)
    np.testing.assert_allclose(made.positions[0, made.subjoints.ends], posed.positions()[0], atol=1e-12)
    assert "first frame" in made.source.notes[-1] and len(made) == len(posed)


def test_a_standing_foot_stays_where_it_stood():
    motion = _kicking()
    other = motion.skeleton.names.index("other ankle")
    contacts = np.ones((len(motion), 1), bool)
    made = rubber.make_rubber(motion, feet=[other], contacts=contacts)
    np.testing.assert_allclose(made.positions[:, made.subjoints.ends[other]], motion.positions()[:, other], atol=1e-4)


def test_nothing_goes_through_the_floor():
    """A figure that squats a little and is exaggerated much: neither a foot nor a bent shin goes lower than captured."""
    motion = _kicking()
    low = motion.positions()[..., 1].min()
    assert rubber.make_rubber(motion, omega=8, most_stretch=2.5, feet=()).positions[..., 1].min() < low - 0.03
    assert rubber.make_rubber(motion, omega=8, most_stretch=2.5).positions[..., 1].min() >= low - 1e-9


def test_springs_let_tips_swing_and_leave_the_root():
    motion = _kicking()
    stiff, swinging = rubber.make_rubber(motion), rubber.make_rubber(motion, follow=1)
    away = np.linalg.norm(swinging.positions - stiff.positions, axis=-1).max(axis=0)
    foot = stiff.subjoints.ends[motion.skeleton.names.index("ankle")]
    assert away[0] == pytest.approx(0, abs=1e-12) and away[foot] > 0.02


def test_as_an_ordinary_skeleton_it_has_the_same_places_and_turns():
    made = rubber.make_rubber(_kicking(), omega=6)
    motion = rubber.on_skeleton(made)
    np.testing.assert_allclose(motion.positions(), made.positions, atol=1e-9)
    turns = Rotation.from_matrix(motion.world()[..., :3].reshape(-1, 3, 3)).as_quat().reshape(made.rotation.shape)
    np.testing.assert_allclose(np.abs((turns * made.rotation).sum(axis=-1)), 1, atol=1e-9)
    np.testing.assert_allclose(motion.skeleton.lengths(), made.subjoints.lengths(), atol=1e-12)


def test_written_as_bvh_it_reads_the_same(tmp_path):
    made = rubber.make_rubber(_kicking(), omega=6)
    write_bvh(rubber.on_skeleton(made), tmp_path / "kick.bvh")
    back = read_bvh(tmp_path / "kick.bvh")
    order = [made.subjoints.names().index(name) for name in back.skeleton.names]
    np.testing.assert_allclose(back.positions(), made.positions[:, order], atol=1e-5)


def test_amounts_over_time_leave_out_the_pose_set_before():
    motion = _kicking()
    posed = replace(
        motion,
        rotation=np.concatenate([_turned_off(motion.rotation[:1]), motion.rotation]),
        translation=np.concatenate([motion.translation[:1], motion.translation]),
    )
    omega = np.linspace(1, 5, len(posed))[:, None]
    made = rubber.make_rubber(posed, omega)
    np.testing.assert_allclose(made.positions[1:], rubber.make_rubber(motion, omega[1:]).positions, atol=1e-12)


def test_nan_is_as_much_as_is_right_and_numbers_are_kept():
    motion = _kicking()
    arm = motion.skeleton.names.index("arm")
    omega = np.full(len(motion.skeleton), np.nan)
    omega[[arm, arm + 1, arm + 2]] = 1
    made = rubber.make_rubber(motion, omega, hose=0, squash=0, feet=())
    captured, joints = motion.positions(), made.positions[:, made.subjoints.ends]
    np.testing.assert_allclose(np.diff(joints[:, arm:], axis=1), np.diff(captured[:, arm:], axis=1), atol=1e-9)
    np.testing.assert_allclose(joints[:, :4], _ends(rubber.make_rubber(motion, hose=0, squash=0, feet=()))[:, :4])


def test_limbs_are_kept_from_going_through_each_other():
    """A leg that swings across the other, exaggerated: with `apart` it goes less deep into it."""
    motion = _kicking()
    across = Rotation.from_rotvec(0.25 * np.sin(np.arange(len(motion)) / 12)[:, None] * [0, 0, -1.0])
    rotation = motion.rotation.copy()
    rotation[:, 1] = (Rotation.from_quat(rotation[:, 1]) * across).as_quat()
    motion = replace(motion, rotation=rotation)
    through, apart = (rubber.make_rubber(motion, omega=5, feet=(), apart=it) for it in (False, True))
    deep = [collide.overlaps(_ends(it), motion.positions(), motion.skeleton).max() for it in (through, apart)]
    assert deep[0] > 0.02 and deep[1] < 0.5 * deep[0]


def test_a_stretch_that_is_none_is_refused():
    with pytest.raises(InputError, match="1 or more"):
        rubber.make_rubber(_kicking(), most_stretch=0.5)


@pytest.mark.parametrize("follow", [0.0, 1.0])
def test_a_walk_of_one_round_stays_a_loop(follow):
    """Against the middle one of seven rounds that go on: what is made of one round is what is made of it there."""
    once, many = (_striding(rounds) for rounds in (1, 7))
    count = len(once)
    made = rubber.make_rubber(once, loop=True, omega=4, feet=(), follow=follow).positions
    middle = rubber.make_rubber(many, omega=4, feet=(), follow=follow).positions[3 * count : 4 * count]
    away = 3 * many.translation[count, 0] * [0, 0, 1]
    np.testing.assert_allclose(made + away, middle, atol=1e-3)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_clips_of_a_few_frames_are_no_error(count):
    made = rubber.make_rubber(_kicking().part(0, count))
    assert len(made) == count and np.isfinite(made.positions).all() and np.isfinite(made.rotation).all()


def _ends(made):
    """Where the joints are (T, J, 3)."""
    return made.positions[:, made.subjoints.ends]


def _turned_off(rotation):
    """All joints turned by a radian."""
    away = Rotation.from_rotvec([0, 0, 1.0])
    return (Rotation.from_quat(rotation.reshape(-1, 4)) * away).as_quat().reshape(rotation.shape)


def _striding(rounds, count=72, fps=60):
    """Rounds of 72 frames in which the hips go 1.2 m, up and down, and limbs swing."""
    body = _kicking(count).skeleton
    angle = 2 * np.pi * np.arange(rounds * count) / count
    translation = np.tile(body.offsets, (len(angle), 1, 1))
    translation[:, 0, 2] = 1.2 / count * np.arange(len(angle))
    translation[:, 0, 1] += 0.03 * np.cos(2 * angle)
    rotation = np.tile([0, 0, 0, 1.0], (len(angle), len(body), 1))
    for name, size, late in (("thigh", 0.6, 0), ("shin", 0.4, 1), ("other thigh", 0.6, np.pi), ("arm", 0.5, 2)):
        turn = size * np.sin(angle + late)
        rotation[:, body.names.index(name)] = Rotation.from_rotvec(turn[:, None] * [1.0, 0, 0]).as_quat()
    return SkeletonMotion(body, translation, rotation, fps)


def _kicking(count=150, fps=60):
    """Two legs, a spine and an arm; one leg swings back and kicks forward, metres, z to the front."""
    joints = {
        "hips": (None, (0, 0.9, 0)),
        "thigh": ("hips", (0.1, -0.03, 0)),
        "shin": ("thigh", (0, -0.42, 0)),
        "ankle": ("shin", (0, -0.41, 0)),
        "toes": ("ankle", (0, -0.04, 0.13)),
        "other thigh": ("hips", (-0.1, -0.03, 0)),
        "other shin": ("other thigh", (0, -0.42, 0)),
        "other ankle": ("other shin", (0, -0.41, 0)),
        "chest": ("hips", (0, 0.45, 0)),
        "head": ("chest", (0, 0.25, 0)),
        "arm": ("chest", (0.17, 0.02, 0)),
        "forearm": ("arm", (0.28, 0, 0)),
        "hand": ("forearm", (0.25, 0, 0)),
    }
    names = tuple(joints)
    parents = tuple(-1 if above is None else names.index(above) for above, _ in joints.values())
    skeleton = Skeleton(names, parents, np.array([offset for _, offset in joints.values()], float))
    seconds = np.arange(count) / fps
    kick = np.exp(-(((seconds - 1.3) / 0.14) ** 2))
    back = np.exp(-(((seconds - 1.0) / 0.16) ** 2))
    rotation = np.tile([0, 0, 0, 1.0], (count, len(names), 1))
    swings = {
        "thigh": (-1.4 * kick + 0.7 * back, [1, 0, 0]),
        "shin": (1.5 * back + 0.2 * kick, [1, 0, 0]),
        "other shin": (0.3 * kick, [1, 0, 0]),
        "chest": (0.3 * kick - 0.2 * back, [1, 0.3, 0]),
        "arm": (0.8 * kick - 0.5, [0, 0.5, 1]),
        "forearm": (0.6 * back, [0, 1, 0]),
    }
    for name, (angle, axis) in swings.items():
        rotation[:, names.index(name)] = Rotation.from_rotvec(angle[:, None] * np.array(axis, float)).as_quat()
    translation = np.tile(skeleton.offsets, (count, 1, 1))
    translation[:, 0, 2] += 0.1 * np.tanh((seconds - 1.2) / 0.2)
    return SkeletonMotion(skeleton, translation, rotation, fps)
