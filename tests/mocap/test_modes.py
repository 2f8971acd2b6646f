"""Modes against beams and pendulums, whose swings mechanics books give, and against single elastic joints."""

from time import thread_time

import numpy as np
import pytest

from capture.errors import InputError
from fixtures import plants
from fixtures.skeletons import walk
from mocap.posing import elastic, modes, postures
from mocap.rubber.subjoints import subdivide
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion


def skeleton_of(made):
    return Skeleton(made.names, made.parents, made.offsets)


def rod(length=0.8):
    """One link on a root that is no joint of its own."""
    return Skeleton(("ground", "rod", "tip"), (-1, 0, 1), np.array([[0, 0, 0], [0, 0.0, 0], [0, length, 0]]))


def shaken(skeleton, path, fps):
    """The skeleton carried along a path (T, 3)."""
    still = postures.posed(skeleton, np.zeros((len(path), len(skeleton), 3)), fps)
    translation = still.translation.copy()
    translation[:, 0] += path
    return SkeletonMotion(skeleton, translation, still.rotation, fps)


def test_a_rod_swings_as_the_book_says():
    """I = m l^2 / 3 about its end, so f = sqrt(k / I) / 2 pi."""
    own = rod()
    found = modes.modes_of(
        own.parents,
        np.cumsum(own.offsets, axis=0),
        stiffness=np.full(3, 7.0),
        thick=1e-6,
    )
    assert found.frequency[:2] == pytest.approx(np.sqrt(7.0 / (0.8 * 0.8**2 / 3)) / (2 * np.pi), rel=1e-9)


def test_a_chain_of_many_links_swings_as_a_clamped_beam():
    """Euler and Bernoulli: w = (b l)^2 sqrt(EI / mu l^4), b l = 1.8751, 4.6941, 7.8548; springs EI / h, twice at the clamp."""
    links, length, bending = 60, 1.3, 2.0
    made = plants.reed(links, length)
    springs = np.full(links + 1, bending * links / length)
    springs[0] *= 2
    found = modes.modes_of(
        made.parents, np.cumsum(made.offsets, axis=0), held=(), stiffness=springs, thick=1e-4, count=6
    )
    truth = np.array([1.8751, 4.6941, 7.8548]) ** 2 * np.sqrt(bending / length**4) / (2 * np.pi)
    assert found.frequency[::2] == pytest.approx(truth, rel=0.02)  # each twice: in two directions
    assert found.frequency[1::2] == pytest.approx(truth, rel=0.02)


def test_two_links_swing_as_the_double_pendulum():
    """Its two equations for small angles written out, with the same springs in place of gravity."""
    a, b, k1, k2 = 0.5, 0.9, 3.0, 1.2
    own = Skeleton(
        ("g", "one", "two", "tip"), (-1, 0, 1, 2), np.array([[0, 0, 0], [0, 0, 0], [0, a, 0], [0, b, 0]], float)
    )
    found = modes.modes_of(own.parents, np.cumsum(own.offsets, axis=0), stiffness=np.array([0, k1, k2, 0]), thick=1e-6)
    mass = np.array([[a**3 / 3 + b * a * a, b * a * b / 2], [b * a * b / 2, b**3 / 3]])  # in absolute angles
    stiff = np.array([[k1 + k2, -k2], [-k2, k2]])
    truth = np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(mass, stiff)).real)) / (2 * np.pi)
    assert found.frequency[[0, 2]] == pytest.approx(truth, rel=1e-6)


def test_for_one_joint_modes_are_the_elastic_joint():
    own = modes.of_skeleton(rod(), frequency=1.7, count=None)
    torques = np.zeros((60, 3, 3))
    torques[:, 1] = np.random.default_rng(0).normal(size=(60, 3)).cumsum(axis=0)
    torques[:, 1, 1] = 0  # the rod does not twist alike
    heavy = own.inertia[1, 0, 0]
    joint = elastic.Elastic(heavy, 2 * 0.2 * np.sqrt(heavy * own.stiffness[1]), own.stiffness[1])
    at = np.arange(60) / 30
    truth = elastic.along(joint, at, at, torques[:, 1:2] / own.stiffness[1]).turns
    found = modes.swing(own, torques, 30, damping=0.2)
    assert np.abs(truth).max() > 0.1
    assert np.abs(found[:, 1] - truth[:, 0]).max() < 1e-9 * np.abs(truth).max()


def test_the_slowest_mode_is_as_quick_as_asked_and_shapes_are_orthogonal():
    for made in (plants.flower(), plants.lamp(), walk(0.1)):
        found = modes.of_skeleton(skeleton_of(made), frequency=0.9, count=None)
        assert found.frequency[0] == pytest.approx(0.9)
        assert (np.diff(found.frequency) >= -1e-9).all()
        energy = np.einsum("ajd,j,bjd->ab", found.shapes, found.stiffness, found.shapes)
        assert energy == pytest.approx(np.diag((2 * np.pi * found.frequency) ** 2), rel=1e-6, abs=1e-6 * energy.max())


def test_modes_do_not_depend_on_which_way_a_joints_axes_are():
    from scipy.spatial.transform import Rotation

    skeleton = skeleton_of(plants.flower())
    rest = Rotation.random(len(skeleton), np.random.default_rng(1)).as_quat()
    maps = postures.posed(skeleton, np.zeros((1, len(skeleton), 3)), 1.0, rest).world()[0]
    turned, plain = (modes.modes_of(skeleton.parents, maps[..., 3], axes) for axes in (maps[..., :3], None))
    assert turned.frequency == pytest.approx(plain.frequency)
    assert turned.stiffness == pytest.approx(plain.stiffness)


def test_the_base_shaken_at_one_pitch_swings_a_rod_as_far_as_the_book_says():
    """x'' + 2 z w x' + w^2 x = -(3 / 2 l) a cos(W t): amplitude and lag after it has settled."""
    own, fps, pitch, damping = rod(), 120, 1.1, 0.3
    found = modes.of_skeleton(own, frequency=1.7)
    t = np.arange(8 * fps) / fps
    base = 0.02 * np.sin(2 * np.pi * pitch * t)
    motion = modes.follow(shaken(own, base[:, None] * [1.0, 0, 0], fps), found, damping)
    link = motion.positions()[:, 2] - motion.positions()[:, 1]
    angle = np.arctan2(link[:, 0], link[:, 1])
    w, drive = 2 * np.pi * 1.7, 2 * np.pi * pitch
    truth = (1.5 / 0.8 * 0.02 * drive**2 / (w**2 - drive**2 + 2j * damping * w * drive) * np.exp(1j * drive * t)).imag
    late = t > 4
    assert np.abs(angle - truth)[late].max() < 0.04 * np.abs(truth).max()  # the rod is a little thick


def test_what_goes_at_one_speed_or_stands_swings_nothing():
    skeleton = skeleton_of(plants.flower())
    found = modes.of_skeleton(skeleton)
    for speed in ([0, 0, 0], [2.0, 0.5, -1]):
        motion = shaken(skeleton, np.arange(40)[:, None] / 30 * np.array(speed, float), 30)
        assert np.abs(modes.follow(motion, found).rotation - motion.rotation).max() < 1e-9


def test_no_share_is_the_motion_itself_and_frames_more_or_fewer_swing_alike():
    made = walk(2.0, 60)
    skeleton = skeleton_of(made)
    motion = SkeletonMotion(skeleton, made.translation, made.rotation, 60)
    found = modes.of_skeleton(skeleton, frequency=1.5)
    assert modes.follow(motion, found, share=0.0).positions() == pytest.approx(motion.positions())
    half = SkeletonMotion(skeleton, made.translation[::2], made.rotation[::2], 30)
    fine, coarse = (modes.follow(one, found).positions() for one in (motion, half))
    moved = np.abs(fine - motion.positions()).max()
    assert 0.01 < moved < 0.6
    assert np.abs(fine[::2] - coarse).max() < 0.2 * moved


def test_a_loop_comes_back_to_where_it_began():
    made = walk(1.0, 30)
    skeleton = skeleton_of(made)
    path = 0.05 * np.sin(2 * np.pi * np.arange(30) / 30)[:, None] * [1.0, 0, 0]
    found = modes.of_skeleton(skeleton, frequency=2.0)
    once = modes.follow(shaken(skeleton, path, 30), found, 0.5, loop=True).positions()
    twice = modes.follow(shaken(skeleton, np.tile(path, (2, 1)), 30), found, 0.5, loop=True).positions()
    assert np.abs(once - shaken(skeleton, path, 30).positions()).max() > 0.01
    assert np.abs(twice[30:] - once).max() < 1e-3


def test_links_that_bend_have_modes_too():
    made = walk(0.1)
    parts = subdivide(skeleton_of(made))
    found = modes.of_subjoints(parts, frequency=1.0, count=8)
    assert found.shapes.shape == (8, len(parts), 3) and found.frequency[0] == pytest.approx(1.0)


def test_joints_in_one_place_and_tiny_links_do_no_harm():
    made = plants.reed(4, 1.0)
    offsets = np.concatenate([made.offsets, [[0, 0, 0], [0, 1e-7, 0], [1e-9, 0, 0]]])
    skeleton = Skeleton((*made.names, "helper", "nub", "hair"), (*made.parents, 2, 5, 4), offsets)
    plain, more = modes.of_skeleton(skeleton_of(made), count=6), modes.of_skeleton(skeleton, count=6)
    assert more.frequency == pytest.approx(plain.frequency, rel=1e-4)
    assert np.abs(more.shapes[:, 5:]).max() == 0


def test_large_swings_are_softened_and_small_ones_are_not():
    turns = np.array([[1e-4, 0, 0], [0, 40.0, 0], [0, 0, 0]])
    soft = modes.softly(turns)
    assert soft[0] == pytest.approx(turns[0], rel=1e-6) and soft[2] == pytest.approx([0, 0, 0])
    assert np.linalg.norm(soft[1]) <= modes.MOST + 1e-12


def test_a_body_is_quick_to_follow():
    """Of sixty joints, twelve modes: less time than it lasts, by far."""
    made = plants.reed(60, 1.0)
    skeleton = skeleton_of(made)
    motion = shaken(skeleton, np.sin(np.arange(240) / 9)[:, None] * [0.05, 0, 0], 24)
    found = modes.of_skeleton(skeleton)
    began = thread_time()
    modes.follow(motion, found)
    assert thread_time() - began < 5.0


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda own: modes.of_skeleton(own, held=(0, 1)), "a joint that is not held"),
        (lambda own: modes.of_skeleton(own, frequency=0.0), "must be above 0 Hz"),
        (lambda own: modes.swing(modes.of_skeleton(own), np.zeros((3, 3, 3)), 24, damping=-1.0), "must be 0 or more"),
        (
            lambda own: modes.follow(shaken(own, np.zeros((3, 3)), 24), modes.of_skeleton(own), share=-1),
            "between 0 and 10",
        ),
    ],
)
def test_bad_input_is_refused(make, said):
    with pytest.raises(InputError, match=said):
        make(rod())


def test_two_joints_in_one_place_swing_at_all():
    offsets = np.array([[0, 0, 0], [0, 0.1, 0], [0, 0, 0], [0, 0.5, 0], [0.1, 0.4, 0]])
    two = Skeleton(("a", "b", "b2", "c", "d"), (-1, 0, 1, 2, 3), offsets)
    own = modes.of_skeleton(two, frequency=1.5, count=4)
    assert np.isfinite(own.shapes).all() and own.frequency[0] == pytest.approx(1.5)
