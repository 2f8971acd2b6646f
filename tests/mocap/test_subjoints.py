"""Sub-joints: where they lie on limbs that are straight, bent, long, and have hands."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mocap.rubber import subjoints
from mocap.skeletons.skeleton import Skeleton


def test_sub_joints_of_a_straight_limb_are_evenly_spaced():
    """However the limb lies and however long it is made, as long as it stays in proportion."""
    arm = _chain(0.3, 0.25, 0.35)
    cut = subjoints.subdivide(arm)
    way = np.array([0.6, -0.5, 0.2])
    positions = np.cumsum(arm.lengths())[:, None] * way
    placed = subjoints.place(subjoints.placing(cut), positions[None])[0]
    ways = np.array([placed[s] - placed[parent] for s, parent in enumerate(cut.parents) if parent >= 0])
    np.testing.assert_allclose(ways, cut.lengths()[1:, None] * way, atol=1e-12)
    for joint in range(1, 4):
        of_link = cut.lengths()[cut.joint == joint]
        assert len(of_link) >= 2 and np.ptp(of_link) < 1e-15
        assert of_link.sum() == pytest.approx(arm.lengths()[joint])


@settings(max_examples=40, deadline=None)
@given(st.integers(2, 9), st.integers(0, 9999))
def test_the_curve_passes_through_the_joints(links, seed):
    rng = np.random.default_rng(seed)
    limb = _chain(*rng.uniform(0.2, 0.4, links))
    cut = subjoints.subdivide(limb)
    bent = rng.normal(size=(3, len(limb), 3))
    matrix = subjoints.placing(cut)
    np.testing.assert_allclose(subjoints.place(matrix, bent)[:, cut.ends], bent, atol=1e-9)
    np.testing.assert_allclose(matrix.sum(axis=1), 1, atol=1e-9)


def test_up_to_5_joints_lie_on_one_bezier_curve():
    """Sub-joints and joints of a limb are then places of one polynomial, of a degree one less than its joints."""
    limb = _chain(0.3, 0.3, 0.2, 0.25)
    cut = subjoints.subdivide(limb, fine=4)
    placed = subjoints.place(subjoints.placing(cut), np.random.default_rng(2).normal(size=(1, 5, 3)))[0]
    way = np.concatenate([[0], np.cumsum(cut.lengths()[1:])])
    fit = np.polynomial.Polynomial.fit(way, placed[:, 1], 4)
    np.testing.assert_allclose(fit(way), placed[:, 1], atol=1e-9)


def test_more_joints_lie_on_a_spline_that_does_not_swing_out():
    tail = _chain(*[0.2] * 14)
    cut = subjoints.subdivide(tail)
    matrix = subjoints.placing(cut)
    assert np.abs(matrix).sum(axis=1).max() < 2  # Lebesgue's constant; a polynomial of degree 14 has 283
    way = np.concatenate([[0], np.cumsum(cut.lengths()[1:])])
    jump = np.zeros(15)
    jump[7] = 1
    heights = matrix @ jump
    fine = subjoints.interpolation(np.arange(15.0), np.linspace(0, 14, 14001)) @ jump
    curvature = np.diff(fine, 2) / 0.001**2
    assert np.abs(np.diff(curvature)).max() < 0.02  # C2: the curvature has no jumps
    np.testing.assert_allclose(heights, np.interp(way / 0.2, np.linspace(0, 14, 14001), fine), atol=1e-6)


def test_without_hose_links_are_straight():
    cut = subjoints.subdivide(_chain(0.3, 0.3))
    bent = np.array([[0, 0, 0], [0.3, 0, 0], [0.3, 0.3, 0]])
    straight = subjoints.place(subjoints.placing(cut, hose=0), bent[None])[0]
    np.testing.assert_allclose(straight[cut.joint == 2], [[0.3, 0.1, 0], [0.3, 0.2, 0], [0.3, 0.3, 0]], atol=1e-12)
    curved, half = (subjoints.place(subjoints.placing(cut, hose=h), bent[None])[0] for h in (1, 0.5))
    np.testing.assert_allclose(half, 0.5 * (straight + curved))
    assert np.abs(curved - straight).max() > 0.02


def test_placing_commutes_with_turning_and_carrying_the_whole():
    figure = _figure()
    matrix = subjoints.placing(subjoints.subdivide(figure))
    positions = np.random.default_rng(5).normal(size=(4, len(figure), 3))
    turn = Rotation.from_euler("xyz", [0.4, 1, -2])
    moved = turn.apply(positions.reshape(-1, 3)).reshape(positions.shape) + [3, -1, 2]
    placed = subjoints.place(matrix, positions)
    expected = turn.apply(placed.reshape(-1, 3)).reshape(placed.shape) + [3, -1, 2]
    np.testing.assert_allclose(subjoints.place(matrix, moved), expected, atol=1e-12)


def test_fingers_and_toes_are_not_grouped_and_wrists_and_ankles_are_tips():
    figure = _figure()
    groups = [[figure.names[j] for j in group] for group in subjoints.rubber_groups(figure)]
    assert ["upper arm", "forearm", "wrist place"] in groups  # the collar is short
    assert ["thigh", "shin", "ankle place"] in groups  # the pelvis turns off, and the foot is short beside the shin
    assert not any({"finger 1", "finger 2", "thumb", "toe"} & set(group) for group in groups)


def test_a_hand_is_a_tip_by_its_name_however_long_it_is():
    names = ("Root", "Claw1", "Claw2", "LeftHand", "Nail")
    long = Skeleton(names, (-1, 0, 1, 2, 3), np.array([[0, 0, 0], *[[0.3, 0, 0]] * 4], float))
    (group,) = subjoints.rubber_groups(long)
    assert [names[j] for j in group] == ["Root", "Claw1", "Claw2", "LeftHand"]


def test_parents_come_first_and_sub_joints_know_where_they_are():
    figure = _figure()
    cut = subjoints.subdivide(figure)
    assert all(parent < s for s, parent in enumerate(cut.parents))
    np.testing.assert_array_equal(cut.joint[cut.ends], np.arange(len(figure)))
    assert (cut.along[cut.ends] == 1).all()
    for s, parent in enumerate(cut.parents):
        if figure.parents[cut.joint[s]] < 0:
            assert parent == -1
        elif cut.joint[parent] == cut.joint[s]:
            assert cut.along[parent] < cut.along[s]
        else:
            assert parent == cut.ends[figure.parents[cut.joint[s]]]
    assert len(set(cut.names())) == len(cut) and set(figure.names) < set(cut.names())
    assert len(figure) < len(cut) < 4 * len(figure)


def test_joints_in_one_place_and_single_joints_are_no_error():
    point = Skeleton(("root",), (-1,), np.zeros((1, 3)))
    assert len(subjoints.subdivide(point)) == 1
    heap = Skeleton(("a", "b", "c", "d"), (-1, 0, 1, 2), np.zeros((4, 3)))
    cut = subjoints.subdivide(heap)
    np.testing.assert_array_equal(subjoints.placing(cut), np.eye(4))
    doubled = Skeleton(("a", "b", "c", "d"), (-1, 0, 1, 2), np.array([[0, 0, 0], [1.0, 0, 0], [0, 0, 0], [1, 0, 0]]))
    cut = subjoints.subdivide(doubled)
    assert np.isfinite(subjoints.placing(cut)).all() and [g.tolist() for g in cut.groups] == [[0, 1, 3]]


def _chain(*links):
    """A limb of links along x."""
    names = tuple(f"joint {k}" for k in range(len(links) + 1))
    return Skeleton(
        names, tuple(range(-1, len(links))), np.array([[0, 0, 0], *[[link, 0, 0] for link in links]], float)
    )


def _figure():
    """Half a body: a leg with a foot, a spine, a head, an arm with two fingers and a thumb; names that tell nothing."""
    joints = {
        "root": (None, (0, 0, 0)),
        "pelvis": ("root", (0, 0, 0)),
        "thigh": ("pelvis", (0.12, 0, 0)),
        "shin": ("thigh", (0, -0.42, 0)),
        "ankle place": ("shin", (0, -0.4, 0)),
        "toe": ("ankle place", (0, -0.05, 0.14)),
        "back": ("root", (0, 0.2, 0)),
        "chest": ("back", (0, 0.25, 0)),
        "nape": ("chest", (0, 0.1, 0)),
        "crown": ("nape", (0, 0.2, 0)),
        "collar": ("chest", (0.02, 0, 0)),
        "upper arm": ("collar", (0.12, 0, 0)),
        "forearm": ("upper arm", (0.28, 0, 0)),
        "wrist place": ("forearm", (0.25, 0, 0)),
        "thumb": ("wrist place", (0.03, 0.03, 0)),
        "finger 1": ("wrist place", (0.09, 0, 0)),
        "finger 2": ("finger 1", (0.04, 0, 0)),
    }
    names = tuple(joints)
    parents = tuple(-1 if above is None else names.index(above) for above, _ in joints.values())
    return Skeleton(names, parents, np.array([offset for _, offset in joints.values()], float))
