"""What a part that others hide can still prove: a splinter of it is its own, what nobody has seen must be out of sight."""

import cv2
import numpy as np
import pytest

from capture.fit.pixels import cover, descend
from capture.fit.pixels import model as models
from capture.fit.pixels.sighting import Pose
from capture.motion import affine
from capture.pictures.clip import clip_of
from capture.pictures.shot import KeyDrawing, Part

PAPER, TEAL, PINK, ORANGE = (238, 232, 222), (46, 160, 158), (222, 92, 150), (240, 128, 48)
SIZE = (260, 320)  # width, height


def rim(left: float, top: float, right: float, bottom: float) -> tuple[tuple[float, float], ...]:
    """A rectangle's outline."""
    along = [
        (1 - s) * np.array(a) + s * np.array(b)
        for a, b in _sides(left, top, right, bottom)
        for s in (0, 0.25, 0.5, 0.75)
    ]
    return tuple(map(tuple, np.array(along).tolist()))


def _sides(left: float, top: float, right: float, bottom: float) -> list:
    corners = [(left, top), (right, top), (right, bottom), (left, bottom)]
    return list(zip(corners, corners[1:] + corners[:1], strict=True))


def painted(*rectangles: tuple) -> np.ndarray:
    """A picture of rectangles (left, top, right, bottom, colour), the last in front."""
    picture = np.full((SIZE[1], SIZE[0], 3), PAPER, np.uint8)
    for left, top, right, bottom, colour in rectangles:
        cv2.rectangle(picture, (left, top), (right, bottom), colour, -1)
    return picture


def part(name: str, order: int, box: tuple[int, ...]) -> Part:
    return Part(name, (KeyDrawing("rest", 0, rim(*box)),), order=order)


@pytest.mark.parametrize("gone", [0, 9])
def test_a_splinter_that_something_cut_off_is_the_part_s_wherever_it_has_gone_in_between(gone):
    """A body goes on by a few pixels, and an arm in front leaves only its farthest edge in sight beyond it."""
    body = (60, 60, 180, 220)
    model = models.learn(part("body", 0, body), clip_of(painted((*body, TEAL))[None]))
    moved = body[0] + gone, body[1], body[2] + gone, body[3]
    arm = 120, 40, moved[2] - 13, 240
    hidden = np.zeros((SIZE[1], SIZE[0]), np.uint8)
    cv2.rectangle(hidden, arm[:2], arm[2:], 1, -1)
    picture, rest = painted((*moved, TEAL), (*arm, ORANGE)), Pose(affine.identity(), np.zeros(0))
    found = cover.cutout(picture, hidden, [], model.colors, model, rest, 60.0)
    x, y = (np.array([moved[2] - 6, 140]) - found.origin).astype(int)
    assert found.soft[y, x] > 0.9


def test_what_was_hidden_in_the_key_and_would_be_in_sight_speaks_against_a_pose():
    """Of an arm behind a body only the hand is seen, which looks the same upside down; the sleeve would not be hidden."""
    body, arm, hand = (60, 40, 180, 160), (100, 60, 140, 200), (100, 160, 140, 200)
    picture = painted((*hand, PINK), (*body, TEAL))
    parts = part("arm", 0, arm), part("body", 1, body)
    model = models.learn(parts[0], clip_of(picture[None]), others=parts)
    hidden = cv2.rectangle(np.zeros((SIZE[1], SIZE[0]), np.uint8), body[:2], body[2:], 1, -1)
    hand_at = np.array([120.0, 180.0])
    upside_down = np.column_stack([-np.eye(2), 2 * hand_at])
    shown = []
    for placed in (affine.identity(), upside_down):
        pose = Pose(placed, np.zeros(0))
        found = cover.cutout(picture, hidden, [], model.colors, model, pose, 60.0)
        shown.append(descend.evidence(model, cover.as_layer(model.view, found), pose).shown)
    assert shown[0] > 0.8
    assert shown[1] < 0.4
