"""Stick figures are where an orthographic camera sees them, and nearer links cover further ones."""

import numpy as np
import pytest

from mocap import sticks

RED, BLUE = (200, 0, 0), (0, 0, 200)


def dark(picture):
    """Middle and size (x, y) of what is drawn, in pixels."""
    rows, columns = np.nonzero(np.abs(picture.astype(int) - sticks.PAPER).sum(axis=-1) > 200)
    return np.array([columns.mean(), rows.mean()]), np.array([np.ptp(columns), np.ptp(rows)]) + 1


def test_a_link_is_as_long_and_as_thick_as_the_scale_says():
    view = sticks.View((200, 120), 50.0, np.zeros((1, 3)), 0.0)
    link = np.array([[[-1, 0.5, 0], [1, 0.5, 0]]])
    (picture,) = sticks.draw(link, (-1, 0), view, radius=0.1, ground=None)
    middle, size = dark(picture)
    np.testing.assert_allclose(middle, [99.5, 59.5 - 25], atol=0.5)  # y up becomes y down
    np.testing.assert_allclose(size, [110, 10], atol=1.5)


def test_what_is_turned_to_the_viewer_is_foreshortened():
    view = sticks.View((200, 120), 50.0, np.zeros((1, 3)), np.pi / 3)
    link = np.array([[[-1, 0, 0], [1, 0, 0.0]]])
    (picture,) = sticks.draw(link, (-1, 0), view, radius=0.02, ground=None)
    assert dark(picture)[1][0] == pytest.approx(50 + 2, abs=2)


@pytest.mark.parametrize("near", [-1, 1])
def test_the_nearer_link_covers_the_further(near):
    view = sticks.View((100, 100), 40.0, np.zeros((1, 3)), 0.0)
    cross = np.array([[[0, 0, 0], [-1, 0, near], [1, 0, near], [0, -1, -near], [0, 1, -near]]], float)
    (picture,) = sticks.draw(cross, (-1, -1, 1, -1, 3), view, 0.1, np.array([RED, RED, RED, BLUE, BLUE]), None)
    red, blue = picture[50, 50, 0] > 150, picture[50, 50, 2] > 150
    assert (red, blue) == ((True, False) if near > 0 else (False, True))


def test_the_view_holds_all_frames_and_goes_along():
    walk = np.random.default_rng(2).normal(0, 1, (30, 9, 3)) + np.linspace(0, 40, 30)[:, None, None] * [1, 0, 0.5]
    for follow in (True, False):
        seen = sticks.project(walk, sticks.view_of(walk, (200, 300), follow=follow))[..., :2]
        assert (seen > 0).all() and (seen < [200, 300]).all()
        low, high = seen.min(axis=(0, 1)), seen.max(axis=(0, 1))
        assert (high - low > 0.4 * np.array([200, 300])).any()


def test_the_ground_is_drawn_at_its_height():
    view = sticks.View((60, 100), 20.0, np.array([[0, 1.0, 0]]), 0.0)
    (picture,) = sticks.draw(np.array([[[0, 1.0, 0]]]), (-1,), view)
    rows = np.flatnonzero((picture == sticks.GROUND).all(axis=(1, 2)))
    assert rows[0] == pytest.approx(49.5 + 20, abs=1) and rows[-1] == 99


def test_left_and_right_are_told_apart_by_name():
    names = ("Hips", "mixamorig:LeftArm", "RightLeg", "rShldr", "lCollar", "root", "LowerBack", "Arm_L", "Toes_R end")
    colors = [tuple(int(c) for c in color) for color in sticks.sides(names)]
    middle, left, right = sticks.MIDDLE, sticks.LEFT, sticks.RIGHT
    assert colors == [middle, left, right, right, left, middle, middle, left, right]
