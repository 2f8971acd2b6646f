"""The bodies of real files: what their joints are called, and what the same joints are told to be without names."""

from dataclasses import replace

import pytest

from mocap.bodies.body import find_body
from mocap.skeletons import skeleton
from mocap.skeletons.bvh import read_bvh
from mocap.skeletons.skeleton import Skeleton
from retarget.characters.figures.skin import read_skin

FILES = """ad_cmu1_jumping_jacks ad_fair1_dab ad_fair1_jumping ad_fair1_wave_hello ad_fair1_zombie ad_rokoko_jesse_dance
bandai1_kick bandai1_run_normal bandai1_walk_normal bandai1_walk_tired bvhpython_freebvh bvhpython_mocapbank cmu21_box-2
cmu21_dance cmu21_kick cmu21_swim cmu21_walk cmu_01_01_fairmotion cmu_12_01_walk"""
PERSON = {"spine", "head", "left arm", "right arm", "left leg", "right leg"}


@pytest.mark.parametrize("name", FILES.split())
def test_a_person_is_told_by_names_and_by_shape_alike(name, data):
    motion = read_bvh(data / "bvh" / f"{name}.bvh")
    joints, places = motion.skeleton, motion.positions()[::20]
    body = find_body(joints, places)
    assert set(body.parts) == PERSON and "names" in body.told
    for part, own in body.parts.items():
        assert 2 <= len(own) <= 5
        for side, other in (("left", "_L"), ("right", "_R")):
            if part.startswith(side):
                assert all(side in joints.names[j].lower() or joints.names[j].endswith(other) for j in own)
    assert all("toe" in joints.names[j].lower() or joints.names[j].endswith("Ankle end") for j in body.feet)
    assert all("hand" in joints.names[j].lower() or "wrist" in joints.names[j].lower() for j in body.hands)
    ends = [" end" if called.endswith(" end") else "" for called in joints.names]
    nameless = find_body(replace(joints, names=tuple(f"{j}{end}" for j, end in enumerate(ends))), places)
    assert "shape" in nameless.told and nameless.parts == body.parts and nameless.feet == body.feet


@pytest.mark.parametrize("named", [True, False])
def test_a_fox_has_four_legs_and_a_tail(named, data):
    skin = read_skin(data / "meshes" / "Fox.glb")
    rest = skin.rest
    places = skeleton.world_maps(skin.parents, skeleton.own_maps(rest.translation, rest.rotation, rest.scale))[..., 3]
    names = skin.names if named else tuple(map(str, range(len(skin.names))))
    body = find_body(Skeleton(names, skin.parents, rest.translation), places)
    held = {part: [skin.names[joint] for joint in own] for part, own in body.parts.items()}
    assert held["tail"] == ["b_Tail01_012", "b_Tail02_013", "b_Tail03_014"]
    assert held["left front leg"] == ["b_LeftUpperArm_09", "b_LeftForeArm_010", "b_LeftHand_011"]
    assert held["right hind leg"][0] == "b_RightLeg01_019" and held["head"][-1] == "b_Head_05"
    assert len(body.feet) == 4 and body.hands == ()
