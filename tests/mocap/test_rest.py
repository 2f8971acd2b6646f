"""A pose to start from is found in any file's frames, however its joints' axes are turned."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fixtures import plants
from fixtures.skeletons import SHANK, THIGH, walk
from mocap.posing import postures, starting
from mocap.posing.rest import rested
from mocap.skeleton import Skeleton, SkeletonMotion


def strolling(axes=None, heading=0.0, fps=30):
    """A walk of three seconds; with a seed `axes` each joint's axes are turned at random, as some programs write them."""
    made = walk(3.0, fps)
    joints = len(made.names)
    turned = Rotation.identity(joints) if axes is None else Rotation.random(joints, np.random.default_rng(axes))
    way = Rotation.from_rotvec([0, heading, 0])
    offsets, translation, rotation = made.offsets.copy(), made.translation.copy(), made.rotation.copy()
    for joint, parent in enumerate(made.parents):
        above = turned[parent].inv() if parent >= 0 else way
        rotation[:, joint] = (above * Rotation.from_quat(made.rotation[:, joint]) * turned[joint]).as_quat()
        translation[:, joint] = above.apply(made.translation[:, joint])
        offsets[joint] = above.apply(made.offsets[joint])
    return SkeletonMotion(Skeleton(made.names, made.parents, offsets), translation, rotation, fps)


def shown(skeleton, turns, rest):
    return dict(zip(skeleton.names, postures.posed(skeleton, turns[None], 30, rest).positions()[0]))


@pytest.mark.parametrize(("axes", "heading"), [(None, 0.0), (None, 2.2), (1, 0.0), (2, -1.3)])
def test_it_stands_on_the_floor_with_arms_that_hang_and_looks_along_z(axes, heading):
    skeleton, rest = rested(strolling(axes, heading))
    places = shown(skeleton, np.zeros((len(skeleton), 3)), rest)
    assert starting.kind_of(skeleton, rest) == "human"
    assert min(place[1] for place in places.values()) == pytest.approx(0, abs=1e-9)
    assert places["LeftUpLeg"][[0, 2]] == pytest.approx([0.1, 0], abs=1e-9)
    assert places["LeftToeBase"][2] > places["LeftFoot"][2] + 0.05
    assert places["LeftUpLeg"][0] > 0.09 and places["RightUpLeg"][0] < -0.09
    for side in ("Left", "Right"):
        for first, second in (("Arm", "ForeArm"), ("ForeArm", "Hand"), ("UpLeg", "Leg"), ("Leg", "Foot")):
            link = places[side + second] - places[side + first]
            assert link[1] < -0.98 * np.linalg.norm(link), (side, first)


def test_postures_do_the_same_whatever_the_joints_axes_are():
    plain, strange = (rested(strolling(axes)) for axes in (None, 4))
    for name in ("bow", "left arm raised", "right knee up", "crouch"):
        seen = []
        for skeleton, rest in (plain, strange):
            pool = starting.starting_pool(skeleton, rest)
            seen.append(np.array(list(shown(skeleton, postures.turns_of(pool[name], skeleton), rest).values())))
        assert seen[0] == pytest.approx(seen[1], abs=1e-6)


def test_a_plant_rests_as_it_stood_first():
    made = plants.flower()
    skeleton = Skeleton(made.names, made.parents, made.offsets)
    turns = np.zeros((5, len(skeleton), 3))
    turns[1:, 3] = [0.5, 0, 0]
    _, rest = rested(postures.posed(skeleton, turns, 24))
    assert rest == pytest.approx(postures.unturned(skeleton))


def test_hips_that_move_free_of_a_root_on_the_floor_are_no_link():
    made = walk(2.0, 30)
    joints = len(made.names)
    offsets = np.concatenate([np.zeros((1, 3)), made.offsets])
    translation = np.concatenate([np.zeros((60, 1, 3)), made.translation], axis=1)
    rotation = np.concatenate([np.tile([0.0, 0, 0, 1], (60, 1, 1)), made.rotation], axis=1)
    parents = (-1, *(parent + 1 for parent in made.parents))
    motion = SkeletonMotion(Skeleton(("floor", *made.names), parents, offsets), translation, rotation, 30)
    skeleton, rest = rested(motion)
    places = shown(skeleton, np.zeros((joints + 1, 3)), rest)
    assert skeleton.parents[1] == -1
    assert places["Hips"][1] == pytest.approx(THIGH + SHANK + 0.055, abs=0.005)  # on straight legs, and flat feet


def test_feet_are_as_flat_as_in_the_frame():
    """In its most upright frame a foot of the walk is flat; after its leg is straightened it still is."""
    skeleton, rest = rested(strolling(3))
    places = shown(skeleton, np.zeros((len(skeleton), 3)), rest)
    for side in ("Left", "Right"):
        toe = places[f"{side}ToeBase end"] - places[f"{side}ToeBase"]
        assert abs(toe[1]) < 1e-6
