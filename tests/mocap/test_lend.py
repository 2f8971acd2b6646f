"""A motion on another skeleton: links point where they pointed, whatever the joints are called and how they rest."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from capture.errors import InputError
from fixtures import skeletons
from mocap.analogy import match
from mocap.analogy.lend import lent
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion

WALK = skeletons.walk(seconds=1.0)
MOTION = SkeletonMotion(Skeleton(WALK.names, WALK.parents, WALK.offsets), WALK.translation, WALK.rotation, WALK.fps)


def resting_otherwise(motion, seed):
    """The same motion, every joint of it told against a rest pose of its own."""
    turns = Rotation.random(len(motion.skeleton), random_state=seed)
    parents = motion.skeleton.parents
    above = [turns[parent] if parent >= 0 else Rotation.identity() for parent in parents]
    back = [turn.inv() for turn in above]
    offsets = np.stack([turn.apply(offset) for turn, offset in zip(back, motion.skeleton.offsets)])
    translation = np.stack([back[k].apply(motion.translation[:, k]) for k in range(len(parents))], axis=1)
    rotation = np.stack(
        [(back[k] * Rotation.from_quat(motion.rotation[:, k]) * turns[k]).as_quat() for k in range(len(parents))],
        axis=1,
    )
    return SkeletonMotion(replace(motion.skeleton, offsets=offsets), translation, rotation, motion.fps)


def called(motion, names):
    return replace(motion, skeleton=replace(motion.skeleton, names=tuple(names)))


def test_on_its_own_skeleton_a_motion_is_the_same():
    after, told = lent(MOTION, MOTION)
    np.testing.assert_allclose(after.positions(), MOTION.positions(), atol=1e-9)
    assert told == "24 of B's 24 joints are matched" and after.skeleton.names == MOTION.skeleton.names


@pytest.mark.parametrize("seed", range(3))
def test_rest_poses_do_not_matter(seed):
    other = resting_otherwise(MOTION, seed)
    np.testing.assert_allclose(other.positions(), MOTION.positions(), atol=1e-9)
    np.testing.assert_allclose(lent(other, MOTION)[0].positions(), MOTION.positions(), atol=1e-9)
    np.testing.assert_allclose(lent(MOTION, other)[0].positions(), MOTION.positions(), atol=1e-9)


def test_a_larger_skeleton_makes_larger_steps():
    large = replace(MOTION, skeleton=replace(MOTION.skeleton, offsets=1.3 * MOTION.skeleton.offsets))
    large = replace(large, translation=1.3 * MOTION.translation)
    np.testing.assert_allclose(lent(MOTION, large)[0].positions(), large.positions(), atol=1e-9)


def test_joints_that_only_the_goal_has_keep_still_and_say_so():
    few = [k for k, name in enumerate(WALK.names) if "Hand" not in name or name.endswith("Hand")]
    parents = tuple(few.index(WALK.parents[k]) if k else -1 for k in few)
    skeleton = Skeleton(tuple(WALK.names[k] for k in few), parents, WALK.offsets[few])
    bare = SkeletonMotion(skeleton, WALK.translation[:, few], WALK.rotation[:, few], WALK.fps)
    after, told = lent(bare, MOTION)
    assert "stay as in B" in told and "LeftHandIndex1" in told
    assert "~LeftHandIndex1" in after.skeleton.names and "LeftForeArm" in after.skeleton.names
    np.testing.assert_allclose(after.positions()[:, few], bare.positions(), atol=1e-9)


def test_limbs_of_other_names_are_matched_by_their_place():
    strange = called(MOTION, [f"q{k}" for k in range(31)])
    answers = match.matched(strange, MOTION)
    limbs = [
        WALK.joint(f"{side}{part}") for side in ("Left", "Right") for part in ("UpLeg", "Leg", "Foot", "Arm", "Hand")
    ]
    assert {k: answers[k] for k in limbs} == {k: k for k in limbs}


def test_names_decide_before_places_and_prefixes_do_not_matter():
    other = called(MOTION, [f"mixamorig:{name}" for name in WALK.names])
    assert match.matched(other, MOTION) == {k: k for k in range(31)}
    other_words = {"UpLeg": "Hip", "Leg": "Knee", "Foot": "Ankle", "ToeBase": "Toe"}
    legs = called(MOTION, [_renamed(name, other_words) for name in WALK.names])
    assert match.matched(legs, MOTION)[WALK.joint("LeftLeg")] == WALK.joint("LeftLeg")


def test_what_has_no_limbs_in_common_is_refused():
    star = Skeleton(
        ("hub", "ray", "beam", "spoke"), (-1, 0, 0, 0), np.array([[0, 1, 0], [1, 0, 0], [-1, 1, 0], [-1, -1, 0.0]])
    )
    still = np.tile([0, 0, 0, 1.0], (60, 4, 1))
    with pytest.raises(InputError, match="same names or limbs"):
        match.matched(SkeletonMotion(star, np.tile(star.offsets, (60, 1, 1)), still, 30.0), MOTION)


def _renamed(name, words):
    for side in ("Left", "Right"):
        if name.startswith(side) and name.removeprefix(side) in words:
            return side + words[name.removeprefix(side)]
    return name
