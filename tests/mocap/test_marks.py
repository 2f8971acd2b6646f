"""Which joint is what: the same roles whatever a file calls them."""

import numpy as np
import pytest

from capture.errors import InputError
from fixtures import plants, stickman
from mocap.marks import Marks, check, matched, roles
from mocap.skeleton import Skeleton

LIMBS = {
    "shoulder": {
        "mixamo": "mixamorig:{Side}Arm",
        "cmu": "{Side}Arm",
        "bandai": "UpperArm_{S}",
        "old": "{Side}Shoulder",
    },
    "elbow": {
        "mixamo": "mixamorig:{Side}ForeArm",
        "cmu": "{Side}ForeArm",
        "bandai": "LowerArm_{S}",
        "old": "{Side}Elbow",
    },
    "wrist": {"mixamo": "mixamorig:{Side}Hand", "cmu": "{Side}Hand", "bandai": "Hand_{S}", "old": "{Side}Wrist"},
    "hip": {"mixamo": "mixamorig:{Side}UpLeg", "cmu": "{Side}UpLeg", "bandai": "UpperLeg_{S}", "old": "{Side}Hip"},
    "knee": {"mixamo": "mixamorig:{Side}Leg", "cmu": "{Side}Leg", "bandai": "LowerLeg_{S}", "old": "{Side}Knee"},
    "ankle": {"mixamo": "mixamorig:{Side}Foot", "cmu": "{Side}Foot", "bandai": "Foot_{S}", "old": "{Side}Ankle"},
}
CLAVICLE = {
    "mixamo": "mixamorig:{Side}Shoulder",
    "cmu": "{Side}Shoulder",
    "bandai": "Shoulder_{S}",
    "old": "{Side}Collar",
}
EXTRA = {"mixamo": "", "cmu": "{S}HipJoint", "bandai": "", "old": "{S}HipJoint"}
TRUNK = {
    "mixamo": ("mixamorig:Hips", "mixamorig:Spine2", "mixamorig:Head"),
    "cmu": ("Hips", "Spine1", "Head"),
    "bandai": ("Hips", "Chest", "Head"),
    "old": ("Hips", "Chest2", "Head"),
}


def _figure(style):
    """Names and parents in a file's manner: a collar above each arm, maybe a joint above each thigh."""
    hips, chest, head = TRUNK[style]
    names, parents, truth = [hips, chest, head], [-1, 0, 1], {"hips": hips, "chest": chest, "head": head}
    for side, letter in (("left", "L"), ("right", "R")):
        for start, above, whats in (
            (1, CLAVICLE[style], ("shoulder", "elbow", "wrist")),
            (0, EXTRA[style], ("hip", "knee", "ankle")),
        ):
            up = start
            for what, pattern in ((None, above), *((what, LIMBS[what][style]) for what in whats)):
                if pattern:
                    names.append(pattern.format(Side=side.title(), S=letter))
                    parents.append(up)
                    up = len(names) - 1
                    if what:
                        truth[f"{side} {what}"] = names[-1]
    return tuple(names), tuple(parents), truth


@pytest.mark.parametrize("style", TRUNK)
def test_joints_are_found_by_the_names_that_files_use(style):
    names, parents, truth = _figure(style)
    found = roles(Skeleton(names, parents, np.ones((len(names), 3))))
    assert {role: names[joint] for role, joint in found.items()} == truth


def test_annotations_of_animated_drawings_match_a_skeleton():
    own, marks = Skeleton(*stickman.skeleton()), Marks(*stickman.marks())
    pairs, told = matched(marks, own)
    assert {marks.names[mark]: own.names[joint] for mark, joint in pairs.values()} == {
        mark: joint for joint, mark in stickman.MARKED.items()
    }
    assert "left_elbow = LeftForeArm" in told


def test_joints_without_names_are_told_by_their_shape():
    names, parents, offsets = stickman.skeleton()
    nameless = Skeleton(tuple(f"joint {n}" for n in range(len(names))), parents, offsets)
    told, truth = roles(nameless, stickman.at_rest()), roles(Skeleton(names, parents, offsets))
    for what in ("elbow", "wrist", "knee", "ankle"):
        assert {told[f"left {what}"], told[f"right {what}"]} == {truth[f"left {what}"], truth[f"right {what}"]}


def test_marks_that_are_no_figure_are_refused():
    lamp = Marks(("foot", "stem", "shade"), (-1, 0, 1), np.array([[0, 0], [0, -5], [0, -9.0]]))
    with pytest.raises(InputError, match="left_elbow, right_knee"):
        matched(lamp, Skeleton(*stickman.skeleton()))


@pytest.mark.parametrize(
    ("marks", "told"),
    [
        (Marks(("a",), (-1,), np.zeros((1, 2))), "two marked joints"),
        (Marks(("a", "a"), (-1, 0), np.zeros((2, 2))), "'a' comes twice"),
        (Marks(("a", "b"), (-1, 1), np.zeros((2, 2))), "before the joint"),
        (Marks(("a", "b"), (-1, 0), np.full((2, 2), np.nan)), "finite"),
    ],
)
def test_marks_must_be_a_tree_of_named_places(marks, told):
    with pytest.raises(InputError, match=told):
        check(marks)


def test_a_plant_is_matched_by_what_its_joints_are_called():
    made = plants.flower()
    skeleton = Skeleton(made.names, made.parents, made.offsets)
    marks = Marks(
        ("Stem_1", "stem-2", "stem 3", "leaf a 1"), (-1, 0, 1, 2), np.array([[9.0, 90], [9, 60], [9, 30], [30, 20]])
    )
    pairs, told = matched(marks, skeleton)
    assert {marks.names[mark]: skeleton.names[joint] for mark, joint in pairs.values()} == {
        "Stem_1": "stem 1",
        "stem-2": "stem 2",
        "stem 3": "stem 3",
        "leaf a 1": "leaf a 1",
    }
    assert "called alike" in told
    strange = Marks(("stem 1", "stem 2", "thorn"), (-1, 0, 1), marks.places[:3])
    with pytest.raises(InputError, match="must be a figure's"):
        matched(strange, skeleton)


def test_a_figure_is_matched_by_its_limbs_though_all_is_called_alike():
    skeleton = Skeleton(*stickman.skeleton())
    flat = Marks(skeleton.names, skeleton.parents, np.cumsum(skeleton.offsets, axis=0)[:, :2] * (100, -100))
    pairs, told = matched(flat, skeleton)
    assert "left elbow" in pairs and "called alike" not in told
