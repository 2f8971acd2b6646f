"""Drawings with marked joints: they stay whole, stay as they are at rest, and their limbs pass before and behind."""

from dataclasses import replace
from itertools import pairwise

import cv2
import numpy as np
import pytest

from capture.errors import InputError
from capture.motion import triangulate
from fixtures import stickman
from mocap.bones import cast_marks
from mocap.marks import Marks
from mocap.skeleton import Skeleton, SkeletonMotion
from mocap.to_tracks import to_tracks
from mocap.views import Views
from retarget.characters.heat import heat_shares
from retarget.characters.marked import MarkedDrawing, MarkedPicture, segments
from retarget.characters.paths import DrawnPath
from retarget.stage import draw2d
from retarget.stage.play import play

SHIFT = np.array([140.0, 200.0])  # from the stickman's page to the picture's
SIZE = (280, 240)
RED, BLUE, GREEN = (220, 40, 40), (40, 60, 200), (40, 160, 60)
LIMBS = {"arm": (RED, ("shoulder", "elbow", "hand")), "leg": (GREEN, ("hip", "knee", "foot"))}


def _motion(turns, frames=6):
    return SkeletonMotion(Skeleton(*stickman.skeleton()), *stickman.moving(turns, frames))


def _marks():
    names, parents, places = stickman.marks()
    return Marks(names, parents, places + SHIFT)


@pytest.fixture(scope="module")
def figure():
    """A figure of thick, flat colours: red arms, green legs, a blue body with a head."""
    marks = _marks()
    at = {name: np.round(place).astype(int).tolist() for name, place in zip(marks.names, marks.places)}
    pixels = np.zeros((*SIZE[::-1], 4), np.uint8)
    for side in ("left", "right"):
        for limb, (color, joints) in LIMBS.items():
            line = np.array([at[f"{side}_{joint}"] for joint in joints])
            cv2.polylines(pixels, [line], False, (*color, 255), 15 if limb == "arm" else 18)
    cv2.rectangle(
        pixels,
        (at["right_shoulder"][0], at["torso"][1] - 8),
        (at["left_shoulder"][0], at["root"][1] + 8),
        (*BLUE, 255),
        -1,
    )
    cv2.circle(pixels, at["neck"], 18, (*BLUE, 255), -1)
    cv2.line(pixels, at["torso"], at["neck"], (*BLUE, 255), 14)
    return MarkedPicture(marks, pixels)


def _played(figure, turns, frames=6, views=None):
    motion = _motion(turns, frames)
    return play(to_tracks(motion, figure.marks, cast_marks(motion, figure.marks, views)), figure)


def _root(figure):
    """Where the page of a motion that rests has the figure's root."""
    return to_tracks(_motion({}), figure.marks).tracks[0].pivot


def test_shares_are_a_whole_and_each_bone_has_its_own_middle():
    ring = np.array([(0, 0), (120, 0), (120, 30), (0, 30.0)])
    outlines, _, inside, faces = triangulate.triangulate(triangulate.resample(ring, 80)[None], 4.0)
    points = np.vstack([outlines[0], inside])
    starts, stops = np.array([(0, 15), (40, 15), (80, 15.0)]), np.array([(40, 15), (80, 15), (120, 15.0)])
    shares = heat_shares(points, faces, starts, stops)
    assert shares.min() >= 0
    np.testing.assert_allclose(shares.sum(axis=1), 1)
    for bone, middle in enumerate((starts + stops) / 2):
        nearest = np.linalg.norm(points - middle, axis=1).argmin()
        assert shares[nearest].argmax() == bone and shares[nearest, bone] > 0.9


def test_a_hand_beside_a_hip_does_not_follow_the_hip():
    """Two columns, 6 pixels apart, joined at the top: the foot of one is nearer to the other's bone than to its own."""
    import shapely

    shape = shapely.union_all([shapely.box(0, 0, 30, 120), shapely.box(36, 0, 50, 120), shapely.box(0, 0, 50, 20)])
    ring = np.array(shape.exterior.coords)[:-1]
    outlines, _, inside, faces = triangulate.triangulate(triangulate.resample(ring, 240)[None], 3.0)
    points = np.vstack([outlines[0], inside])
    starts, stops = np.array([(15, 10), (28, 10), (43, 10.0)]), np.array([(15, 30), (28, 118), (43, 60.0)])
    shares = heat_shares(points, faces, starts, stops, shape)
    hand = (points[:, 0] > 36) & (points[:, 1] > 80)
    assert shares[hand, 2].min() > 0.8


def test_a_drawing_at_rest_is_the_drawing(figure):
    played = _played(figure, {})
    page = draw2d.draw(played, 0, "white").astype(float)
    pixels = np.pad(figure.pixels, ((100, 100), (100, 100), (0, 0)))
    alpha = pixels[..., 3:] / 255
    wanted = pixels[..., :3] * alpha + 255 * (1 - alpha)
    x, y = (
        np.round(figure.marks.places[0] - _root(figure)).astype(int) + 100
    )  # where the page's corner is in the picture
    height, width = page.shape[:2]
    away = np.abs(page - wanted[y : y + height, x : x + width]).max(axis=-1)
    rim = cv2.dilate(pixels[..., 3], np.ones((3, 3))) != cv2.erode(pixels[..., 3], np.ones((3, 3)))
    rim = rim[y : y + height, x : x + width]
    assert away[~rim].max() <= 8  # no seam shows anywhere inside
    assert (away > 8).mean() < 0.002


@pytest.mark.parametrize("turn", [(0, 0, 0.9), (0, 0, -1.2), (0, 0.7, 0.3)])
def test_limbs_swing_without_a_crack(figure, turn):
    mirrored = np.array(turn) * (1, -1, -1)
    played = _played(figure, {"LeftArm": turn, "RightArm": mirrored, "LeftUpLeg": (0, 0, 0.5)})
    page = draw2d.draw(played, 3)
    inside = cv2.erode(figure.pixels[..., 3], np.ones((5, 5))) > 0
    solid = np.zeros(page.shape[:2], np.uint8)
    for role in played.roles:  # all faces that lie well inside the picture
        there = np.round(role.target.layers[0].points).astype(int).clip(0, np.array(SIZE) - 1)
        deep = inside[there[:, 1], there[:, 0]][role.target.keys.faces].all(axis=1)
        for corners in role.points[3][role.target.keys.faces[deep]]:
            cv2.fillPoly(solid, [np.round(corners * 16).astype(np.int32)], 255, shift=4)
    core = cv2.erode(solid, np.ones((3, 3)))
    assert (core > 0).mean() > 0.05 and (page[core > 0, 3] > 250).all()


def test_all_of_a_drawing_is_on_its_page(figure):
    motion = _motion({"Hips": (0, 0, 0.8), "LeftArm": (0, 0, 1.0)})
    played = play(to_tracks(motion, figure.marks, margin=0.0), figure)
    every = np.concatenate([role.points.reshape(-1, 2) for role in played.roles])
    assert (every > 0).all() and (every < played.size).all()


def test_an_arm_passes_before_the_body_or_behind_it(figure):
    across = {"LeftArm": (0, 0, -1.0), "LeftForeArm": (0, 0, -1.9)}
    motion = _motion(across)
    tracks = to_tracks(motion, figure.marks, cast_marks(motion, figure.marks, Views()))
    reds = []
    for order in (2, -2):
        told = tuple(
            replace(track, order=np.full(6, order if track.part.startswith(("left_elbow", "left_hand")) else 0))
            for track in tracks.tracks
        )
        page = draw2d.draw(play(replace(tracks, tracks=told), figure), 0, "white").astype(int)
        reds.append(((page[..., 0] > 150) & (page[..., 2] < 100)).sum())
    assert reds[0] > reds[1] + 150


def test_a_drawing_of_elements_follows_limb_by_limb():
    marks = _marks()
    motion = _motion({"LeftArm": (0, 0, 0.8)})
    names = list(marks.names)

    def line(name, *joints):
        places = np.stack([marks.places[names.index(joint)] for joint in joints])
        thirds = [places[0]]
        for a, b in pairwise(places):
            thirds += [a + (b - a) * s for s in (1 / 3, 2 / 3, 1)]
        count = len(thirds)
        closed = np.array([False])
        return DrawnPath(
            name,
            "M" + "C" * (len(joints) - 1),
            np.array(thirds),
            np.array([0, count]),
            closed,
            stroke=np.array([0, 0, 0, 1.0]),
            width=8.0,
        )

    figure = MarkedDrawing(
        marks, (line("arm", "left_shoulder", "left_elbow", "left_hand"), line("body", "root", "torso", "neck"))
    )
    played = play(to_tracks(motion, marks), figure)
    arm = next(role for role in played.roles if role.target.part == "left arm")
    tip = arm.points[0][-1] - played.roles[-1].points[0][-1]
    assert sorted(role.target.part for role in played.roles) == ["left arm", "trunk"]
    shoulder = arm.points[0][arm.target.keys.points.shape[1]]
    away = arm.points[0][-1] - shoulder
    assert np.arctan2(-away[1], away[0]) == pytest.approx(0.8, abs=0.02)
    assert np.linalg.norm(away) == pytest.approx(55, rel=0.03) and np.isfinite(tip).all()


def test_a_figure_drawn_in_one_piece_bends_as_a_whole():
    import shapely

    marks = _marks()
    at = dict(zip(marks.names, marks.places, strict=True))
    lines = [[at[f"{side}_{joint}"] for joint in joints] for side in ("left", "right") for _, joints in LIMBS.values()]
    body = shapely.union_all([shapely.LineString(line).buffer(7) for line in [*lines, [at["root"], at["neck"]]]])
    body = body.union(shapely.box(*at["right_shoulder"] - 5, *at["left_hip"] + 5))
    ring = np.array(shapely.Polygon(body.exterior).exterior.coords)
    thirds = [ring[:1]] + [[a + (b - a) * s for s in (1 / 3, 2 / 3, 1)] for a, b in pairwise(ring)]
    points = np.vstack(thirds)
    whole = DrawnPath(
        "figure",
        "M" + "L" * (len(ring) - 1) + "Z",
        points,
        np.array([0, len(points)]),
        np.array([True]),
        fill=np.array([0.1, 0.2, 0.6, 1.0]),
    )
    motion = _motion({"LeftArm": (0, 0, 0.8)})
    played = play(to_tracks(motion, marks), MarkedDrawing(marks, (whole,)))
    (role,) = played.roles
    rest, moved = (
        play(to_tracks(one, marks, margin=1.0), MarkedDrawing(marks, (whole,))) for one in (_motion({}), motion)
    )
    up = [each.roles[0].points[0][:, 1] - each.roles[0].joint[0, 1] for each in (rest, moved)]
    shape = role.target.shapes(np.zeros((1, 3)))[0]
    hand, foot = (np.linalg.norm(shape - at[joint], axis=1).argmin() for joint in ("left_hand", "left_foot"))
    assert up[1][hand] < up[0][hand] - 30 and abs(up[1][foot] - up[0][foot]) < 2


def test_a_motion_for_other_marks_is_refused(figure):
    tracks = to_tracks(_motion({}), figure.marks)
    names = tuple(track.part.replace("left_knee", "left_wing") for track in tracks.tracks)
    with pytest.raises(InputError, match="left_wing"):
        segments(figure.marks, names)


def test_a_drawing_of_another_size_plays_the_same_motion_as_large_as_it_was_meant(figure):
    tracks = to_tracks(_motion({"LeftArm": (0, 0, 0.5)}), figure.marks)
    twice = MarkedPicture(
        replace(figure.marks, places=2 * figure.marks.places + 0.5),
        cv2.resize(figure.pixels, None, fx=2, fy=2, interpolation=cv2.INTER_NEAREST),
    )
    one, other = play(tracks, figure), play(tracks, twice)
    assert other.roles[0].scale == pytest.approx(0.5)
    boxes = [np.concatenate([role.points[0] for role in played.roles]) for played in (one, other)]
    np.testing.assert_allclose(boxes[0].min(axis=0), boxes[1].min(axis=0), atol=2)
    np.testing.assert_allclose(boxes[0].max(axis=0), boxes[1].max(axis=0), atol=2)
