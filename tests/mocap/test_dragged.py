"""A drawing whose own joints are moved: joints are drawn where they are, and what does not move stays as it is drawn."""

import numpy as np
import pytest

from capture.motion import affine
from fixtures import stickman
from mocap.onto.dragged import lies_at, orders_at, own_bones
from mocap.onto.marks import Marks

MARKS = Marks(*stickman.marks())
BONES = own_bones(MARKS)


def flat(places):
    return np.concatenate([places, np.zeros((*places.shape[:-1], 1))], axis=-1)


def ends(body, joint):
    """Where the last piece of the bone to a joint ends (T, 2), by its map."""
    name = MARKS.names[joint]
    own = [part for part in body.parts if part.name == name or part.name.rpartition(" ")[0] == name]
    own = [part for part in own if not part.name.endswith("end")]
    return affine.apply(own[-1].maps, own[-1].stop[None])[:, 0]


def test_joints_where_they_are_marked_leave_the_drawing_as_it_is():
    body = lies_at(MARKS, BONES, flat(MARKS.places)[None])
    assert max(np.abs(part.maps - affine.identity()).max() for part in body.parts) < 1e-9


def test_each_joint_is_drawn_where_it_was_moved_to():
    moved = np.random.default_rng(1).normal(0, 12, (4, *MARKS.places.shape)) + MARKS.places
    for joint, parent in enumerate(MARKS.parents):
        if parent >= 0 and MARKS.lengths()[joint] == 0:  # marked in its parent's place: it stays there
            moved[:, joint] = moved[:, parent]
    body = lies_at(MARKS, BONES, flat(moved))
    way = moved[:, 0] - MARKS.places[0]
    for bone in BONES:
        assert np.abs(ends(body, bone.mark) + way - moved[:, bone.mark]).max() < 1e-9


def test_a_drawing_turned_as_a_whole_is_turned_as_a_whole():
    c, s = np.cos(0.7), np.sin(0.7)
    turn = np.array([[c, -s], [s, c]])
    body = lies_at(MARKS, BONES, flat((MARKS.places - MARKS.places[0]) @ turn.T + MARKS.places[0])[None])
    assert max(np.abs(part.maps[0, :, :2] - turn).max() for part in body.parts) < 1e-9


def test_an_arm_that_reaches_behind_the_body_is_drawn_behind_it():
    places = np.repeat(flat(MARKS.places)[None], 2, axis=0)
    arm = [bone.mark for bone in BONES if bone.limb == "left arm"]
    places[1, arm, 2] = -0.4 * np.ptp(MARKS.places)
    orders = orders_at(MARKS, BONES, places)
    assert orders["left arm"][0] > 0 > orders["left arm"][1]
    assert orders["left leg"][0] < 0 and orders["right arm"][0] == pytest.approx(orders["right arm"][1])
