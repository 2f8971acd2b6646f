"""The laws that decide: B = A gives B' = A', A' = A gives B' = B; known styles come out on another motion."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from capture.errors import InputError
from mocap.analogy import analogy as making
from mocap.analogy import curves as curving
from mocap.analogy import cycles, match
from mocap.analogy.analogy import Knobs, analogy
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion


def apart(one, other):
    """Rms angle in degrees between the joints of two motions."""
    count = min(len(one), len(other))
    turns = [Rotation.from_quat(motion.rotation[:count, 1:].reshape(-1, 4)) for motion in (one, other)]
    return np.degrees(np.sqrt(np.mean((turns[0].inv() * turns[1]).magnitude() ** 2)))


def test_curves_tell_the_motion_and_not_where_it_is(stroll):
    motion = stroll(turning=0.7)
    told, start = curving.of_skeleton(motion)
    back = curving.to_skeleton(told, start, motion)
    np.testing.assert_allclose(back.positions(), motion.positions(), atol=1e-9)
    turn = Rotation.from_rotvec([0, 2.0, 0])
    moved = motion.translation.copy()
    moved[:, 0] = turn.apply(moved[:, 0]) + [5, 0, -3]
    turned = motion.rotation.copy()
    turned[:, 0] = (turn * Rotation.from_quat(turned[:, 0])).as_quat()
    other, _ = curving.of_skeleton(replace(motion, translation=moved, rotation=turned))
    np.testing.assert_allclose(other.values, told.values, atol=1e-9)


def test_a_spin_of_several_turns_is_one_curve():
    """Unwrapped: a joint that turns three times round has no jump in its curves."""
    angle = np.linspace(0, 6 * np.pi, 120)
    rotation = np.tile([0, 0, 0, 1.0], (120, 3, 1))
    rotation[:, 1] = Rotation.from_rotvec(angle[:, None] * [0, 0, 1]).as_quat()
    skeleton = Skeleton(("root", "wheel", "rim"), (-1, 0, 1), np.array([[0, 1, 0], [0, 1, 0], [0, 1, 0.0]]))
    told, _ = curving.of_skeleton(SkeletonMotion(skeleton, np.tile(skeleton.offsets, (120, 1, 1)), rotation, 30.0))
    wheel = told.values[:, told.named().index(("wheel", "turn z"))]
    np.testing.assert_allclose(wheel, angle, atol=1e-9)


QUADRUPLES = [
    ({}, {"swing": 0.8, "pace": 1.3}),
    ({}, {"lean": 0.5, "seconds": 5.0}),
    ({"swing": 0.3}, {"swing": 0.6, "bob": 0.06, "seconds": 3.0}),
    ({"turning": 0.0}, {"turning": 0.8}),
    ({"pace": 1.4}, {"wave": 1.5}),
    ({"fps": 30.0}, {"fps": 120.0, "swing": 0.8}),
]


@pytest.mark.parametrize(("plain", "styled"), QUADRUPLES)
def test_b_that_is_a_becomes_a2(stroll, plain, styled):
    one, two = stroll(**plain), stroll(**{**plain, **styled})
    made = analogy(one, two, one)
    at_rate = curving.at_rate(curving.of_skeleton(two)[0], one.fps)
    goal = curving.to_skeleton(at_rate, curving.of_skeleton(two)[1], two)
    assert abs(len(made) - len(goal)) <= 1
    assert apart(made, goal) <= 2.0


@pytest.mark.parametrize(("plain", "styled"), QUADRUPLES)
def test_what_was_not_changed_changes_nothing(stroll, plain, styled):
    one, three = stroll(**plain), stroll(**{**plain, **styled})
    made = analogy(one, one, three)
    assert len(made) == len(three)
    assert apart(made, three) <= 0.5
    np.testing.assert_allclose(made.positions(), three.positions(), atol=0.01)


def test_a_known_amplitude_comes_out_on_another_motion(stroll):
    one = stroll()
    two, three = stroll(swing=0.75), stroll(swing=0.3, pace=0.8, seconds=5.0, lean=0.3)
    made = analogy(one, two, three, Knobs(time=False, feet=False))
    joint = three.skeleton.names.index("left hip")
    swings = [np.ptp(Rotation.from_quat(m.rotation[60:-60, joint]).as_rotvec()[:, 0]) for m in (three, made)]
    assert swings[1] / swings[0] == pytest.approx(1.5, rel=0.05)


def test_a_known_offset_comes_out_on_another_motion(stroll):
    made = analogy(stroll(), stroll(lean=0.4), stroll(swing=0.3, pace=0.8, lean=-0.1), Knobs(time=False, feet=False))
    three = stroll(swing=0.3, pace=0.8, lean=-0.1)
    lean = [Rotation.from_quat(m.rotation[:, 1]).as_rotvec()[:, 0] for m in (three, made)]
    np.testing.assert_allclose(lean[1] - lean[0], 0.3, rtol=0.05, atol=0.015)


def test_a_known_tempo_comes_out_on_another_motion(stroll):
    slow, quick = stroll(seconds=5.0, pace=0.8), stroll(seconds=3.0, pace=0.8 * 5 / 3)
    three = stroll(seconds=4.0, pace=1.0, swing=0.3, wave=1.0)
    made = analogy(slow, quick, three, Knobs(space=False))
    assert len(made) == pytest.approx(len(three) * 0.6, rel=0.02)


def test_style_goes_from_none_to_more(stroll):
    one, two, three = stroll(), stroll(lean=0.4), stroll(swing=0.3)
    lean = [
        Rotation.from_quat(analogy(one, two, three, Knobs(style=style)).rotation[:, 1]).as_rotvec()[:, 0].mean()
        for style in (0.0, 0.5, 1.0, 2.0)
    ]
    np.testing.assert_allclose(lean, [0.1, 0.25, 0.4, 0.7], atol=0.01)


def test_only_the_parts_that_are_named_change(stroll):
    one, two, three = stroll(), stroll(lean=0.4, swing=0.8), stroll(swing=0.3)
    made = analogy(one, two, three, Knobs(only=("spine",), time=False, feet=False))
    np.testing.assert_allclose(np.abs(made.rotation[:, 4:]), np.abs(three.rotation[:, 4:]), atol=1e-9)
    assert apart(made, three) > 2
    legs = analogy(one, two, three, Knobs(only=("legs", "spine"), time=False, feet=False))
    np.testing.assert_allclose(legs.rotation[:, 1], made.rotation[:, 1], atol=1e-9)
    arm, hip = (three.skeleton.names.index(name) for name in ("left shoulder", "left hip"))
    np.testing.assert_allclose(np.abs(legs.rotation[:, arm]), np.abs(three.rotation[:, arm]), atol=1e-9)
    assert np.abs(legs.rotation[:, hip] - three.rotation[:, hip]).max() > 0.05
    with pytest.raises(InputError, match=r"parts must be joints of B or .*left arm.*tail is none"):
        analogy(one, two, three, Knobs(only=("tail",)))


def test_two_styles_one_after_the_other(stroll):
    """Layers: a lean, then a swing."""
    one, three = stroll(), stroll(swing=0.3, lean=0.0)
    bent = analogy(one, stroll(lean=0.4), three, Knobs(time=False, feet=False))
    both = analogy(one, stroll(swing=0.75), bent, Knobs(time=False, feet=False))
    assert Rotation.from_quat(both.rotation[:, 1]).as_rotvec()[:, 0].mean() == pytest.approx(0.3, abs=0.02)
    joint = three.skeleton.names.index("left hip")
    swings = [np.ptp(Rotation.from_quat(m.rotation[60:-60, joint]).as_rotvec()[:, 0]) for m in (three, both)]
    assert swings[1] / swings[0] == pytest.approx(1.5, rel=0.06)


def test_one_cycle_is_cut_out_and_repeated(stroll):
    """Two seconds of a walk, and one cycle of a quick one, for eight seconds of B."""
    one, two, three = stroll(seconds=2.2), stroll(seconds=0.8, pace=1.4, swing=0.7), stroll(seconds=8.0, pace=0.9)
    made = analogy(one, two, three)
    assert any("one cycle of each was repeated 7.2 times" in note for note in made.notes)
    pace = 0.9 * 1.4 / 1.0  # B goes as much quicker as A' than A
    assert len(made) == pytest.approx(7.2 / pace * 60, rel=0.03)
    joint = three.skeleton.names.index("left hip")
    swing = Rotation.from_quat(made.rotation[:, joint]).as_rotvec()[:, 0]
    assert cycles.period(swing[:, None], 60.0) == pytest.approx(60 / pace, abs=2)


def test_cycles_are_found_and_closed():
    t = np.arange(300) / 60
    values = np.stack([np.sin(2 * np.pi * t * 1.2), np.cos(4 * np.pi * t * 1.2) + 0.02 * t], axis=-1)
    assert cycles.period(values, 60.0) == 50
    _, cycle = cycles.cut(values, 50)
    again = cycles.repeated(cycle, 175)
    assert np.abs(np.diff(again, axis=0)).max() < 1.2 * np.abs(np.diff(values, axis=0)).max()
    assert cycles.period(np.cumsum(np.ones((300, 1)), axis=0), 60.0) == 0


def test_joints_are_matched_by_their_plain_names(stroll):
    motion = stroll()
    names = tuple(f"mixamorig:{name.title().replace(' ', '_')}" for name in motion.skeleton.names)
    other = replace(motion, skeleton=replace(motion.skeleton, names=names))
    assert match.matched(other, motion) == {k: k for k in range(len(names))}
    made = analogy(other, other, motion)
    assert apart(made, motion) < 1e-6 and "14 of B's" not in made.notes[0]


def test_bad_input_is_named(stroll):
    motion = stroll()
    with pytest.raises(InputError, match="A' must have two frames or more, it has 1"):
        analogy(motion, motion.part(0, 1), motion)
    broken = motion.rotation.copy()
    broken[3, 5] = np.nan
    with pytest.raises(InputError, match="finite numbers"):
        analogy(replace(motion, rotation=broken), motion, motion)
    with pytest.raises(InputError, match="at most 3 times as long"):
        analogy(stroll(seconds=8.0), motion, stroll(seconds=1.0), Knobs(turn=False))


def test_any_curves_can_be_a_b_or_a2():
    """Make this bounce like that bounce: heights of balls."""
    t = np.arange(121) / 60

    def bounce(height, count):
        return curving.Curves((height * np.abs(np.sin(np.pi * count * t)))[:, None], ("ball",), ("y",), 60.0)

    made = making.curve_analogy(bounce(1.0, 2), bounce(2.0, 2), bounce(0.5, 3), Knobs(time=False, feet=False))
    assert made.curves.values.max() == pytest.approx(1.0, rel=0.1)
