"""Parts of bodies by name, and of the same bodies without names; what is what was decided by hand."""

from dataclasses import replace

import numpy as np
import pytest

from fixtures import skeletons
from mocap.bodies.body import find_body
from mocap.bodies.bodynames import kind_of
from mocap.skeletons.skeleton import Skeleton

WALK = skeletons.walk(seconds=2.0, fps=15.0)
PERSON = Skeleton(WALK.names, WALK.parents, WALK.offsets)
PARTS = {
    "spine": "Hips Spine Spine1 Spine2",
    "head": "Neck Head",
    "left arm": "LeftShoulder LeftArm LeftForeArm LeftHand",
    "left leg": "LeftUpLeg LeftLeg LeftFoot LeftToeBase",
    "right arm": "RightShoulder RightArm RightForeArm RightHand",
    "right leg": "RightUpLeg RightLeg RightFoot RightToeBase",
}


def _nameless(skeleton):
    ends = [" end" if name.endswith(" end") else "" for name in skeleton.names]
    return replace(skeleton, names=tuple(f"bone{joint}{end}" for joint, end in enumerate(ends)))


def _said(joints, skeleton):
    return " ".join(skeleton.names[joint] for joint in joints)


@pytest.mark.parametrize("as_named", [PERSON, _nameless(PERSON)])
@pytest.mark.parametrize("places", [WALK.positions, WALK.positions[..., [1, 2, 0]], WALK.positions[7], None])
def test_a_person_has_two_arms_two_legs_a_spine_and_a_head(as_named, places):
    """With names and without, y up or x up, walking or at rest."""
    body = find_body(as_named, places)
    assert {name: _said(joints, PERSON) for name, joints in body.parts.items()} == PARTS
    assert _said(body.feet, PERSON) == "LeftToeBase RightToeBase"
    assert _said(body.hands, PERSON) == "LeftHand RightHand"
    assert body.label[WALK.joint("LeftHandThumb1")] == "left arm" and body.label[WALK.joint("Head end")] == "head"
    assert ("name" in body.told.split(",")[0]) and (("shape" in body.told) == (as_named is not PERSON))


def test_without_names_left_is_where_the_feet_point_to():
    """The same figure seen from behind, or upside down in space, has the same left."""
    for turn in (np.diag([-1.0, 1, -1]), np.diag([1.0, -1, -1])):
        body = find_body(_nameless(PERSON), WALK.positions @ turn)
        assert {name: _said(joints, PERSON) for name, joints in body.parts.items()} == PARTS


def _dog():
    """Hips, a back that goes ahead, four legs, a tail and a head: (name, parent, offset)."""
    rows = [("rump", "", (0, 0.6, 0)), ("loin", "rump", (0, 0.05, 0.3)), ("withers", "loin", (0, 0, 0.3))]
    rows += [("nape", "withers", (0, 0.2, 0.1)), ("muzzle", "nape", (0, 0.0, 0.2))]
    rows += [("brush1", "rump", (0, 0.05, -0.2)), ("brush2", "brush1", (0, 0.1, -0.2))]
    for side, x in (("west", 0.1), ("east", -0.1)):
        for seat, called in (("rump", "h"), ("withers", "f")):
            names = [f"{called} {side} {n}" for n in range(4)]
            ways = [(x, 0, 0), (0, -0.25, -0.03), (0, -0.25, 0.02), (0, -0.08, 0.05)]
            rows += list(zip(names, [seat, *names], ways))
    names, parents, offsets = zip(*rows)
    parents = tuple(names.index(parent) if parent else -1 for parent in parents)
    return Skeleton(names, parents, np.array(offsets))


def test_a_dog_has_four_legs_and_a_tail():
    dog = _dog()
    body = find_body(dog)
    assert _said(body.parts["tail"], dog) == "brush1 brush2" and _said(body.parts["head"], dog) == "nape muzzle"
    assert _said(body.parts["spine"], dog) == "rump loin withers"
    assert _said(body.parts["left hind leg"], dog) == "h west 0 h west 1 h west 2 h west 3"
    assert _said(body.parts["right front leg"], dog) == "f east 0 f east 1 f east 2 f east 3"
    assert _said(body.feet, dog) == "f west 3 h west 3 f east 3 h east 3" and body.hands == ()
    assert len(body.legs()) == 4


def test_legs_are_a_pair_though_a_tail_is_as_long():
    """The left hind leg is measured 4 % longer than the right one; the tail is as long as that one, of fewer joints."""
    dog = _dog()
    offsets = dog.offsets.copy()
    names = list(dog.names)
    for joint in range(4):
        offsets[names.index(f"h west {joint}")] *= 1.04
    length = sum(np.linalg.norm(offsets[names.index(f"h east {joint}")]) for joint in range(4))
    offsets[[names.index("brush1"), names.index("brush2")]] = [0, 0.1, -np.sqrt((length / 2) ** 2 - 0.01)]
    body = find_body(replace(dog, offsets=offsets))
    assert _said(body.parts["tail"], dog) == "brush1 brush2"
    assert _said(body.parts["right hind leg"], dog) == "h east 0 h east 1 h east 2 h east 3"


def test_without_names_left_is_told_where_limbs_part_and_not_where_they_begin_or_end():
    """Both legs begin in the middle, on joints of no length, the right one is listed first, and the feet are crossed."""
    ways = {"hips": ("", (0, 1.0, 0)), "chest": ("hips", (0, 0.5, 0)), "top": ("chest", (0, 0.3, 0))}
    for side, x in (("r", -1.0), ("l", 1.0)):
        ways |= {f"{side}0": ("hips", (0, 0, 0)), f"{side}1": (f"{side}0", (0.1 * x, 0, 0))}
        ways |= {f"{side}2": (f"{side}1", (-0.1 * x, -0.45, 0)), f"{side}3": (f"{side}2", (-0.1 * x, -0.5, 0))}
        ways |= {f"{side}4": (f"{side}3", (0, -0.05, 0.15)), f"{side}5": ("chest", (0.2 * x, 0, 0))}
        ways |= {f"{side}6": (f"{side}5", (-0.25 * x, -0.1, 0.2)), f"{side}7": (f"{side}6", (-0.2 * x, 0, 0.2))}
    names = list(ways)
    parents = tuple(names.index(parent) if parent else -1 for parent, _ in ways.values())
    crossed = Skeleton(tuple(names), parents, np.array([way for _, way in ways.values()], float))
    body = find_body(crossed)
    assert "shape" in body.told
    assert (
        _said(body.parts["left leg"], crossed) == "l1 l2 l3 l4" and _said(body.parts["left arm"], crossed) == "l5 l6 l7"
    )
    assert _said(body.feet, crossed) == "l4 r4"


def test_arms_that_go_along_with_the_legs_are_front_legs_by_any_name():
    dog = _dog()
    called = {"h west": "LeftLeg", "h east": "RightLeg", "f west": "LeftArm", "f east": "RightArm", "rump": "Hips"}
    names = tuple(called.get(name[:6].strip(), name) + name[6:] for name in dog.names)
    body = find_body(replace(dog, names=names))
    assert "names" in body.told
    assert {"left front leg", "right front leg", "left hind leg", "right hind leg"} <= set(body.parts)


def test_a_rope_has_a_spine_and_nothing_else():
    rope = Skeleton(tuple("abcde"), (-1, 0, 1, 2, 3), np.tile([1.0, 0, 0], (5, 1)))
    body = find_body(rope)
    assert body.parts == {"spine": (0, 1, 2, 3, 4)} and body.feet == body.hands == ()


def test_an_upper_body_has_arms_and_no_legs():
    """Legs are often not captured; arms are not taken for them."""
    kept = [joint for joint, name in enumerate(PERSON.names) if not any(leg in name for leg in ("Leg", "Foot", "Toe"))]
    parents = tuple(kept.index(PERSON.parents[joint]) if joint else -1 for joint in kept)
    torso = Skeleton(tuple(PERSON.names[joint] for joint in kept), parents, PERSON.offsets[kept])
    body = find_body(torso, WALK.positions[:, kept])
    assert set(body.parts) == {"spine", "head", "left arm", "right arm"} and body.feet == ()
    assert _said(body.hands, torso) == "LeftHand RightHand"


def test_one_joint_is_no_trouble():
    body = find_body(Skeleton(("ball",), (-1,), np.zeros((1, 3))))
    assert body.feet == () and body.label.shape == (1,)


def test_joints_that_lie_where_their_parents_lie_are_left_out_of_parts():
    """CMU's files hang the hip on a joint of no length; it belongs to the leg, and does not bend."""
    names = ("Hips", "LHipJoint", "LeftUpLeg", "LeftFoot", "RHipJoint", "RightUpLeg", "RightFoot")
    ways = [(0, 0, 0), (0, 0, 0), (0.1, -0.1, 0), (0, -0.9, 0), (0, 0, 0), (-0.1, -0.1, 0), (0, -0.9, 0)]
    body = find_body(Skeleton(names, (-1, 0, 1, 2, 0, 4, 5), np.array(ways, float)))
    assert body.parts["left leg"] == (2, 3) and body.label[1] == "left leg"


KINDS = {
    ("leg", "left"): "LeftUpLeg mixamorig:LeftLeg thigh.L UpperLeg_L Bip01_L_Thigh lThighBend LHipJoint L_Hip KneeLeft",
    ("arm", "right"): "RightForeArm upper_arm.R LowerArm_R Bip01_R_UpperArm rShldrTwist clavicle_r ElbowRight rightarm",
    ("hand", "left"): "LeftHand Hand_L lhand L_Wrist mixamorig:LeftHand b_LeftHand_011",
    ("toe", "right"): "RightToeBase Toes_R ball_r RightFootIndex rToe",
    ("finger", "left"): "LeftHandThumb1 LFingers LeftHandIndex1 LeftInHandMiddle lthumb",
    ("head", ""): "Head Neck1 lowerneck mixamorig:Neck",
    ("spine", ""): "Hips Spine2 Chest lowerback pelvis torso",
    ("", ""): "Armature joint_Root HeadTop_End LeftEye bone17 ball",
}


@pytest.mark.parametrize(("kind", "name"), [(kind, name) for kind, names in KINDS.items() for name in names.split()])
def test_names_are_told_as_many_programs_write_them(kind, name):
    assert kind_of(name)[:2] == kind
