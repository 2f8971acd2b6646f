"""How sub-joints are turned: held against what is known of unbent, bent, twisted and wholly turned limbs."""

import numpy as np
from scipy.spatial.transform import Rotation

from mocap.rubber import orient, rubber, subjoints
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion


def test_a_limb_that_is_not_pushed_or_bent_is_turned_as_it_was():
    """A straight limb that swings as a whole: all of its sub-joints have its turn."""
    limb = _limb()
    swing = Rotation.from_rotvec(np.linspace(0, 3, 20)[:, None] * [0.1, -0.5, 0.8])
    motion = _played(limb, {0: swing})
    made = rubber.plain(motion, hose=1)
    _same(made.rotation, np.repeat(swing.as_quat()[:, None], len(made.subjoints), axis=1))


def test_at_rest_none_is_turned():
    made = rubber.plain(_played(_body(), {}), hose=0)
    _same(made.rotation, np.tile([0, 0, 0, 1.0], (*made.rotation.shape[:2], 1)))


def test_original_joints_of_a_motion_that_is_not_pushed_keep_their_turns():
    body = _body()
    turns = {j: Rotation.from_rotvec(0.5 * np.random.default_rng(j).normal(size=(9, 3))) for j in range(len(body))}
    motion = _played(body, turns)
    made = rubber.plain(motion, hose=0)
    _, world = rubber.joints_of(motion)
    _same(made.rotation[:, made.subjoints.ends], world)


def test_a_sub_joint_goes_where_its_sub_link_goes():
    """What the sub-link's direction is at rest is turned into what it is now, on a limb bent at will."""
    limb = _limb()
    motion = _played(limb, {1: Rotation.from_rotvec(np.linspace(0, 2, 15)[:, None] * [0, 0.3, 0.9])})
    made = rubber.plain(motion, hose=1)
    for s, parent in enumerate(made.subjoints.parents):
        if parent >= 0:
            way = made.positions[:, s] - made.positions[:, parent]
            turned = Rotation.from_quat(made.rotation[:, parent]).apply(limb.offsets[1])
            assert (np.einsum("ti,ti->t", way, turned) >= 0.999999 * np.linalg.norm(way, axis=1) * 0.3).all()


def test_a_twist_is_shared_out_along_the_link():
    """The tip is twisted by 120 degrees about a straight limb: each sub-joint of its link by its part of that."""
    limb = _limb()
    motion = _played(limb, {2: Rotation.from_rotvec([[0, 0, 0], [np.radians(120), 0, 0]])})
    made = rubber.plain(motion, hose=1)
    last = made.subjoints.joint == 2
    about = Rotation.from_quat(made.rotation[1, last]).as_rotvec()
    np.testing.assert_allclose(about[:, 0], np.radians(120) * made.subjoints.along[last], atol=1e-9)
    np.testing.assert_allclose(about[:, 1:], 0, atol=1e-9)


def test_a_twist_that_goes_on_does_not_flip():
    """Three whole turns of the tip, 10 degrees a frame: no sub-joint of the link ever turns further in a frame."""
    limb = _limb()
    motion = _played(limb, {2: Rotation.from_rotvec(np.radians(np.arange(0, 1080, 10))[:, None] * [1, 0, 0])})
    rotation = rubber.plain(motion, hose=1).rotation
    step = Rotation.from_quat(rotation[:-1].reshape(-1, 4)).inv() * Rotation.from_quat(rotation[1:].reshape(-1, 4))
    assert np.degrees(step.magnitude().max()) < 10.001
    assert (np.einsum("tsi,tsi->ts", rotation[1:], rotation[:-1]) > 0.99).all()


def test_a_bend_to_and_fro_through_straight_does_not_flip():
    limb = _limb()
    angle = 2.4 * np.sin(np.linspace(0, 6, 200))
    made = rubber.plain(_played(limb, {1: Rotation.from_rotvec(angle[:, None] * [0, 0, 1.0])}), hose=1)
    ways = np.stack(
        [made.positions[:, s] - made.positions[:, p] for s, p in enumerate(made.subjoints.parents) if p >= 0]
    )
    ways /= np.linalg.norm(ways, axis=-1, keepdims=True)
    bends = np.arccos(np.clip((ways[:, 1:] * ways[:, :-1]).sum(axis=-1), -1, 1))
    step = 2 * np.arccos(np.clip(np.abs((made.rotation[1:] * made.rotation[:-1]).sum(axis=-1)), 0, 1))
    assert step.max() <= bends.max() + 1e-6


def test_turning_and_carrying_the_whole_turns_all_sub_joints():
    body = _body()
    turns = {j: Rotation.from_rotvec(0.7 * np.random.default_rng(j).normal(size=(9, 3))) for j in range(len(body))}
    motion = _played(body, turns)
    made = rubber.plain(motion, hose=1)
    pushed = made.positions + 0.1 * np.random.default_rng(9).normal(size=made.positions.shape)
    captured, world = rubber.joints_of(motion)
    whole = Rotation.from_euler("xyz", [1, -0.4, 2.2])
    apply = lambda points: whole.apply(points.reshape(-1, 3)).reshape(points.shape) + [1, 2, 3]  # noqa: E731
    turn = lambda q: (whole * Rotation.from_quat(q.reshape(-1, 4))).as_quat().reshape(q.shape)  # noqa: E731
    before = orient.orientations(pushed, made.subjoints, captured, world)
    after = orient.orientations(apply(pushed), made.subjoints, apply(captured), turn(world))
    _same(after, turn(before), atol=1e-6)


def test_a_joint_with_several_children_is_turned_as_they_all_are():
    """The chest of a body whose links are all turned alike takes its neck and arms to within 2 degrees."""
    body = _body()
    motion = _played(body, {})
    captured, world = rubber.joints_of(motion)
    whole = Rotation.from_rotvec([0.5, -0.9, 0.3])
    cut = subjoints.subdivide(body)
    placed = subjoints.place(subjoints.placing(cut), whole.apply(captured.reshape(-1, 3)).reshape(captured.shape))
    turned = orient.orientations(placed, cut, captured, world)
    off = Rotation.from_quat(turned[:, cut.ends[1]]) * whole.inv()
    assert np.degrees(off.magnitude().max()) < 2


def test_joints_in_one_place_and_sub_links_without_length_are_no_error():
    heap = Skeleton(("a", "b", "c"), (-1, 0, 1), np.zeros((3, 3)))
    assert np.isfinite(rubber.plain(_played(heap, {})).rotation).all()
    made = rubber.plain(_played(_body(), {}))
    captured, world = rubber.joints_of(made.source)
    assert np.isfinite(orient.orientations(np.zeros_like(made.positions), made.subjoints, captured, world)).all()


def _same(ours, theirs, atol=1e-9):
    np.testing.assert_allclose(np.abs((ours * theirs).sum(axis=-1)), 1, atol=atol)


def _limb():
    return Skeleton(("a", "b", "c"), (-1, 0, 1), np.array([[0, 0, 0], [0.3, 0, 0], [0.3, 0, 0]]))


def _body():
    """A spine that branches into a neck and two arms of three links, the first of no length."""
    names = ("root", "chest", "head", *(f"{side} {n}" for side in "lr" for n in range(4)))
    parents = (-1, 0, 1, 1, 3, 4, 5, 1, 7, 8, 9)
    arm = np.array([[0, 0, 0], [0.2, 0.02, 0], [0.3, 0, 0], [0.3, 0, 0]])
    offsets = np.concatenate([[[0, 1, 0], [0, 0.4, 0], [0, 0.25, 0]], arm, arm * [-1, 1, 1]])
    return Skeleton(names, parents, offsets)


def _played(skeleton, turns):
    """The skeleton with some joints turned by rotations (T,); the others keep still."""
    count = max([len(turn) for turn in turns.values()], default=3)
    rotation = np.tile([0, 0, 0, 1.0], (count, len(skeleton), 1))
    for joint, turn in turns.items():
        rotation[:, joint] = turn.as_quat()
    return SkeletonMotion(skeleton, np.tile(skeleton.offsets, (count, 1, 1)), rotation, 30)
