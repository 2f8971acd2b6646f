"""Dragging joints: laws that hold for any figure, and a second way to the same turns."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from capture.errors import InputError
from fixtures import skeletons
from mocap.posing import limits, sweeps, ties
from mocap.posing import stars as turning
from mocap.posing.poses import Pose
from mocap.posing.springs import drag
from mocap.skeleton import Skeleton, own_maps, world_maps


def test_a_drag_to_where_the_joint_is_changes_nothing():
    for parents, places in FIGURES.values():
        pose = still(places)
        for pinned in ((), (0,)):
            assert drag(parents, pose, len(places) - 1, places[-1], pinned) is pose


@pytest.mark.parametrize("figure", ["chain", "straight", "human", "flower", "lamp", "insect"])
def test_links_keep_their_lengths_and_pins_stay_whatever_is_dragged_where(figure):
    """170 random drags each, a thousand in all, up to three pins, from a nudge to a hundred times the figure's size."""
    parents, places = FIGURES[figure]
    rng = np.random.default_rng(7)
    size = np.ptp(places, axis=0).max()
    for _ in range(170):
        joint = int(rng.integers(len(places)))
        pinned = [int(p) for p in rng.choice(len(places), rng.integers(4), replace=False) if p != joint]
        target = places[joint] + rng.normal(size=3) * size * np.exp(rng.uniform(-5, 4))
        posed = drag(parents, still(places), joint, target, pinned)
        assert np.isfinite(posed.positions).all() and np.isfinite(posed.turns).all()
        assert stretch(parents, places, posed.positions) <= 0.05
        np.testing.assert_array_equal(posed.positions[pinned], places[pinned])
        if not pinned:
            np.testing.assert_allclose(posed.positions[joint], target, atol=1e-9 * (1 + np.abs(target).max()))


@pytest.mark.parametrize("figure", ["chain", "human", "flower", "lamp", "insect"])
@pytest.mark.parametrize("count", [1, 2])
def test_a_joint_ends_at_its_target_where_another_pose_with_the_same_pins_has_it(figure, count):
    """Such a pose is made by drags of other joints: so the target is in reach."""
    parents, places = FIGURES[figure]
    rng = np.random.default_rng(5)
    size = np.ptp(places, axis=0).max()
    off = []
    for _ in range(40):
        pinned = [0, len(places) - 1][:count]
        joint, other = (int(j) for j in rng.choice(np.arange(1, len(places) - 1), 2, replace=False))
        there = drag(parents, still(places), other, places[other] + 0.3 * size * rng.normal(size=3), pinned).positions
        posed = drag(parents, still(places), joint, there[joint], pinned)
        off.append(np.linalg.norm(posed.positions[joint] - there[joint]) / size)
    assert max(off) < 1e-3


def test_who_drags_out_of_reach_gets_as_near_as_links_allow():
    """A chain of 0.1 m links pinned at one end reaches 1.1 m, towards the target."""
    parents, places = FIGURES["straight"]
    posed = drag(parents, still(places), 11, [0, 40, 30], [0])
    np.testing.assert_allclose(posed.positions[11], [0, 1.1 * 0.8, 1.1 * 0.6], atol=5e-3)


def test_a_straight_limb_pushed_along_itself_gives_way_to_one_side():
    """Two links of 1 m, ends 1 m apart: the joint between them is sqrt(3)/2 m off the line, in the plane of a flat
    figure."""
    places = np.array([[0, 0, 0], [0, 1, 0], [0, 2, 0]], float)
    posed = drag((-1, 0, 1), still(places), 2, [0, 1, 0], [0])
    np.testing.assert_allclose(posed.positions[2], [0, 1, 0], atol=2e-3)
    assert abs(np.linalg.norm(posed.positions[1, [0, 2]]) - np.sqrt(0.75)) < 2e-3
    flat = np.array([[0, 0, 0], [0, 1, 0], [0, 2, 0], [0.3, 0, 0]], float)
    posed = drag((-1, 0, 1, 0), still(flat), 2, [0, 1, 0], [0, 3])
    assert np.abs(posed.positions[:, 2]).max() < 1e-9


@pytest.mark.parametrize("figure", ["chain", "human", "flower", "insect"])
def test_the_outcome_does_not_depend_on_how_joints_are_numbered(figure):
    parents, places = FIGURES[figure]
    rng = np.random.default_rng(2)
    for _ in range(20):
        joint, *pinned = (int(j) for j in rng.choice(len(places), 3, replace=False))
        target = places[joint] + rng.normal(size=3)
        posed = drag(parents, still(places), joint, target, pinned).positions
        new = rng.permutation(len(places))  # new[n] is the old number
        old = np.argsort(new)
        renamed = [-1 if parents[j] < 0 else int(old[parents[j]]) for j in new]
        other = drag(renamed, still(places[new]), int(old[joint]), target, [int(old[p]) for p in pinned]).positions
        np.testing.assert_allclose(other, posed[new], atol=1e-9)


@pytest.mark.parametrize("figure", ["chain", "human", "flower", "insect"])
def test_turning_and_carrying_all_turns_and_carries_the_outcome(figure):
    parents, places = FIGURES[figure]
    whole, shift = Rotation.from_rotvec([0.4, -1.1, 2.0]), np.array([3.0, -1, 2])
    rng = np.random.default_rng(6)
    for _ in range(8):
        joint = int(rng.integers(len(places)))
        target = places[joint] + 0.2 * rng.normal(size=3)
        posed = drag(parents, still(places), joint, target)
        other = drag(parents, still(whole.apply(places) + shift), joint, whole.apply(target) + shift)
        np.testing.assert_allclose(other.positions, whole.apply(posed.positions) + shift, atol=1e-9)


def test_a_pose_is_what_its_turns_make_of_the_skeleton():
    """The joints' turns and the skeleton's offsets lead to the joints' places: what a motion file can hold."""
    figure = skeletons.kick()
    skeleton = Skeleton(figure.names, figure.parents, figure.offsets)
    pose = pose_of(figure, 80)
    feet = [figure.joint("LeftFoot"), figure.joint("RightFoot")]
    hand = figure.joint("RightHand")
    posed = drag(skeleton.parents, pose, hand, pose.positions[hand] + [-0.2, 0.5, 0.4], feet)
    turns = Rotation.from_quat(posed.turns)
    for child, parent in enumerate(skeleton.parents):
        if parent >= 0:
            way = posed.positions[child] - posed.positions[parent]
            np.testing.assert_allclose(turns[parent].apply(skeleton.offsets[child]), way, atol=1e-5)


def test_a_joint_keeps_its_twist():
    """Of all turns that bring a forearm to where it is, it has the smallest against the arm above."""
    parents, places = FIGURES["chain"]
    posed = drag(parents, still(places), 11, places[11] + [0.2, 0.3, -0.1], [0])
    turns = Rotation.from_quat(posed.turns)
    for joint in range(1, 11):
        above = turns[parents[joint]]
        was = above.apply(places[joint + 1] - places[joint])
        more = (turns[joint] * above.inv()).as_rotvec()
        assert abs(more @ was) < 1e-6 * np.linalg.norm(was)
        np.testing.assert_allclose(
            np.cross(
                turns[joint].apply(places[joint + 1] - places[joint]),
                posed.positions[joint + 1] - posed.positions[joint],
            ),
            0,
            atol=1e-6,
        )


def test_more_of_a_figure_comes_along_the_further_it_is_dragged():
    parents, places = FIGURES["human"]
    moved = [
        np.linalg.norm(drag(parents, still(places), 38, places[38] + [0, far, 0]).positions[0] - places[0])
        for far in (0.05, 0.5, 2.0, 8.0)
    ]
    assert moved == sorted(moved) and moved[0] < 0.03 and moved[-1] > 5


def test_a_pinned_foot_stays_flat_while_its_knee_bends():
    """Only the ankle is pinned; no spring goes across it.  Hips 0.3 m down: the sole keeps to the floor by 3 degrees."""
    figure = skeletons.kick()
    pose = pose_of(figure, 0)
    feet = [figure.joint("LeftFoot"), figure.joint("RightFoot")]
    posed = drag(figure.parents, pose, 0, pose.positions[0] - [0, 0.3, 0], feet)
    for foot, toe in zip(feet, (figure.joint("LeftToeBase"), figure.joint("RightToeBase"))):
        was, now = (p[toe] - p[foot] for p in (pose.positions, posed.positions))
        assert was @ now > np.cos(np.radians(3)) * (was @ was)


def test_the_two_sweeps_turn_stars_as_one_dense_system_does():
    rng = np.random.default_rng(3)
    for figure in ("chain", "human", "flower", "insect"):
        parents, places = FIGURES[figure]
        tree = ties.tree_of(parents, places)
        place, count = places[tree.order], len(places)
        for holder in (0, 5, count - 1):
            stars, by, before, *_ = sweeps.outward(holder, tree.ways(place), tree.parents, tree.first, tree.count)
            firm, bend = (
                0.1 + rng.random(len(stars)),
                np.where(before >= 0, rng.random(len(stars)), 0)[:, None, None] * symmetric(rng, len(stars)),
            )
            given = place, rng.normal(size=(count, 3)), rng.random(count), firm, stars, by, before, bend
            ours = turning.turns(*given, tree.first, tree.count)
            np.testing.assert_allclose(ours, dense(*given, tree.first, tree.count), atol=1e-9)


def test_machine_code_does_what_the_plain_code_does():
    parents, places = FIGURES["flower"]
    for pinned in ((), (0,), (0, 12)):
        given = parents, still(places), 20, places[20] + [0.1, -0.2, 0.1], pinned
        quick, plain = drag(*given), drag(*given, compiled=False)
        np.testing.assert_allclose(quick.positions, plain.positions, atol=1e-6)
        np.testing.assert_allclose(quick.turns, plain.turns, atol=1e-6)


def test_knees_and_elbows_of_a_figure_with_toes_are_hinges():
    figure = skeletons.kick()
    found = limits.usual(Skeleton(figure.names, figure.parents, figure.offsets))
    axes = {figure.names[limit.joint]: limit.axis.tolist() for limit in found}
    assert axes == {
        "LeftLeg": [1, 0, 0],
        "RightLeg": [1, 0, 0],
        "LeftForeArm": [-1, 0, 0],
        "RightForeArm": [-1, 0, 0],
    }


def test_a_knee_does_not_bend_forward_and_an_elbow_not_back():
    """Feet and hands dragged anywhere: hinges stay within their limits, and links within their 5 %."""
    figure = skeletons.kick()
    pose = pose_of(figure, 0)
    hinges = limits.usual(Skeleton(figure.names, figure.parents, figure.offsets))
    rng = np.random.default_rng(4)
    free = []
    for _ in range(60):
        joint = figure.joint(str(rng.choice(["RightFoot", "LeftFoot", "RightHand", "LeftHand", "Head"])))
        pinned = [figure.joint("Hips")] if rng.random() < 0.5 else []
        target = pose.positions[joint] + 0.5 * rng.normal(size=3)
        posed = drag(figure.parents, pose, joint, target, pinned, hinges)
        assert stretch(figure.parents, pose.positions, posed.positions) <= 0.05
        bends = [limits.bend_of(limit, figure.parents, posed.turns) for limit in hinges]
        assert min(bends) > np.radians(-3.5) and max(bends) < np.radians(155.5)
        off = drag(figure.parents, pose, joint, target, pinned)
        free.append(max(abs(across(limit, figure.parents, off.turns)) for limit in hinges))
    assert np.mean(np.array(free) > np.radians(20)) > 0.2  # which it otherwise would


def test_a_hinge_turns_about_its_axis_only():
    figure = skeletons.kick()
    pose = pose_of(figure, 0)
    hinges = limits.usual(Skeleton(figure.names, figure.parents, figure.offsets))
    foot = figure.joint("RightFoot")
    posed = drag(figure.parents, pose, foot, pose.positions[foot] + [-0.3, 0.5, 0.2], [0], hinges)
    assert max(abs(across(limit, figure.parents, posed.turns)) for limit in hinges) < np.radians(1)
    assert np.linalg.norm(posed.positions[foot] - pose.positions[foot] - [-0.3, 0.5, 0.2]) < 2e-3


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"parents": (-1, 0, 3, 4, 2)}, "must be a tree"),
        ({"parents": (1, 0, 1, 2, 3)}, "must be a tree"),
        ({"parents": (-1, 0, -1, 2, 3)}, "must hang together"),
        ({"parents": (-1, 0, 9, 2, 3)}, "parents must be joints"),
        ({"pinned": (0, 1, 2, 3, 4)}, "all joints pinned"),
        ({"pinned": (4,)}, "is pinned and cannot be dragged"),
        ({"pinned": (7,)}, "must be one of 0 to 4"),
        ({"joint": 5}, "must be one of 0 to 4"),
        ({"target": (np.inf, 0, 0)}, "must be dragged to a place"),
        ({"target": (np.nan, 0, 0)}, "must be dragged to a place"),
        ({"target": (1e300, 0, 0)}, "must be dragged to a place"),
        ({"target": (0, 0)}, "must be dragged to a place"),
        ({"pose": Pose(np.full((5, 3), np.nan), np.zeros((5, 4)))}, "finite positions"),
        ({"pose": Pose(np.zeros((4, 3)), np.zeros((4, 4)))}, "finite positions"),
        ({"limits": [limits.JointLimits(9, np.array([1.0, 0, 0]), 0, 1)]}, "must be on one of 5 joints"),
        ({"limits": [limits.JointLimits(2, np.array([1.0, 0, 0]), 1, 0)]}, "least bend must be below its most"),
    ],
)
def test_what_cannot_be_posed_is_refused_in_a_sentence(change, said):
    places = np.cumsum(np.full((5, 3), 0.1), axis=0)
    given = {"parents": (-1, 0, 1, 2, 3), "pose": still(places), "joint": 4, "target": (1, 1, 1)} | change
    with pytest.raises(InputError, match=said):
        drag(**given)


def test_the_figures_have_as_many_joints_as_they_say():
    assert {name: len(places) for name, (_, places) in FIGURES.items()} == {
        "chain": 12,
        "straight": 12,
        "human": 39,
        "flower": 29,
        "lamp": 7,
        "insect": 22,
    }


def still(places):
    return Pose(places, np.tile([0, 0, 0, 1.0], (len(places), 1)))


def pose_of(figure, frame):
    maps = world_maps(figure.parents, own_maps(figure.translation[frame], figure.rotation[frame]))
    return Pose(figure.positions[frame], Rotation.from_matrix(maps[..., :3]).as_quat())


def stretch(parents, before, after):
    """How much a link is longer or shorter at most."""
    child = np.flatnonzero(np.array(parents) >= 0)
    above = np.array(parents)[child]
    was, now = (np.linalg.norm(p[child] - p[above], axis=1) for p in (before, after))
    return np.abs(now / was - 1).max()


def across(limit, parents, turns):
    """How far a joint is turned about anything but its hinge's axis, in radians."""
    own = Rotation.from_quat(turns[parents[limit.joint]]).inv() * Rotation.from_quat(turns[limit.joint])
    about = Rotation.from_rotvec(limits.bend_of(limit, parents, turns) * limit.axis)
    return (about.inv() * own).magnitude()


def symmetric(rng, count):
    """Matrices (n, 3, 3) of springs that are stiffer one way than another."""
    some = rng.normal(size=(count, 3, 3))
    return some @ some.swapaxes(1, 2)


def dense(place, pull, strength, firm, stars, held, before, bend, first, count):
    """One system of all stars' turns: a joint moves by those of all stars between it and the holder."""
    arms = np.zeros((len(place), len(stars), 3))
    for n, (star, joint) in enumerate(zip(stars, held)):
        for q in (star, *range(first[star], first[star] + count[star])):
            if q != joint:
                arms[q] = arms[joint]
                arms[q, n] = place[q] - place[joint]
    jacobian = np.cross(np.eye(3)[None, None], arms[:, :, None])  # (J, n, axis, d): of w x arm
    jacobian = jacobian.transpose(0, 3, 1, 2).reshape(3 * len(place), -1)
    gram = jacobian.T @ (np.repeat(strength, 3)[:, None] * jacobian) + np.diag(np.repeat(firm, 3))
    for n, other in enumerate(before):
        if other >= 0:
            against = np.zeros((3, 3 * len(stars)))
            against[:, 3 * n : 3 * n + 3], against[:, 3 * other : 3 * other + 3] = np.eye(3), -np.eye(3)
            gram += against.T @ bend[n] @ against
    return np.linalg.solve(gram, jacobian.T @ pull.ravel()).reshape(-1, 3)


def _grown(limbs):
    """A figure of limbs: (the joint each grows on, its links' ways)."""
    parents, places = [-1], [np.zeros(3)]
    for on, ways in limbs:
        at = on
        for way in ways:
            parents.append(at)
            places.append(places[at] + np.asarray(way, float))
            at = len(places) - 1
    return tuple(parents), np.array(places)


def _human():
    """39 joints: a back of 4, a head of 3, arms of 4 with two fingers of 3, legs of 5, a nose."""
    limbs = [(0, [(0, 0.12, 0.01)] * 4), (4, [(0, 0.08, 0.0), (0, 0.08, 0.02), (0, 0.15, 0)])]
    for side in (1, -1):
        at = 1 + sum(len(ways) for _, ways in limbs)
        limbs += [(4, [(side * 0.06, 0.03, 0), (side * 0.13, 0, 0), (side * 0.28, 0, -0.01), (side * 0.26, 0, 0.02)])]
        limbs += [(at + 3, [(side * 0.05, 0, 0.03 * turn)] * 3) for turn in (1, -1)]
        limbs += [(0, [(side * 0.1, -0.03, 0), (0, -0.42, 0.02), (0, -0.4, -0.03), (0, -0.05, 0.14), (0, 0, 0.07)])]
    return _grown([*limbs, (6, [(0, 0.02, 0.1)])])


def _flower():
    """29 joints: a stem of 8, two leaves of 3, seven petals of 2."""
    petals = [np.array([np.cos(a), np.sin(a), 0.2]) * 0.1 for a in 2 * np.pi * np.arange(7) / 7]
    leaves = [
        (3, [(0.1, 0.06, 0.02), (0.1, 0.02, 0), (0.1, -0.04, 0)]),
        (5, [(-0.1, 0.05, 0), (-0.1, 0, 0), (-0.1, -0.05, 0)]),
    ]
    return _grown([(0, [(0.02, 0.12, 0.01 * n) for n in range(8)]), *leaves, *((8, [p, p]) for p in petals)])


FIGURES = {
    "chain": _grown([(0, np.random.default_rng(1).normal(size=(11, 3)) * 0.1)]),
    "straight": _grown([(0, [(0.1, 0, 0)] * 11)]),
    "human": _human(),
    "flower": _flower(),
    "lamp": _grown(
        [
            (0, [(0, 0.05, 0), (-0.25, 0.4, 0), (0.45, 0.35, 0), (0.1, -0.1, 0)]),
            (0, [(0.15, 0, 0)]),
            (0, [(-0.1, 0, 0.1)]),
        ]
    ),
    "insect": _grown(
        [
            (0, [(0.2, 0, 0)] * 3),
            *((n, [(0.05, 0.1, s * 0.1), (0, 0.05, s * 0.2), (0, -0.3, s * 0.1)]) for n in range(3) for s in (1, -1)),
        ]
    ),
}
