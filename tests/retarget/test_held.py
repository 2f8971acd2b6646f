"""A marked drawing held by its joints: the ink goes where the joints go."""

import numpy as np
import pytest

from fixtures.write import CHARACTERS
from retarget.characters.figures.dancer import read_dancer
from retarget.stage import draw2d, held


@pytest.fixture(scope="module")
def cat():
    return held.hold(CHARACTERS / "tomcat.svg"), read_dancer(str(CHARACTERS / "tomcat.svg"))


def as_drawn(dancer):
    places = np.cumsum(np.zeros((1, len(dancer.skeleton), 3)), axis=0)
    for joint, parent in enumerate(dancer.skeleton.parents):
        places[0, joint] = dancer.skeleton.offsets[joint] + (places[0, parent] if parent >= 0 else 0)
    return places


def test_as_it_is_drawn_nothing_moves_and_the_plane_of_the_pose_is_the_page_in_metres(cat):
    drawing, dancer = cat
    maps = held.maps_at(drawing, as_drawn(dancer))
    assert np.abs(maps - [[1, 0, 0], [0, 1, 0]]).max() < 1e-9
    marks = drawing.character.marks
    there = marks.places @ held.metres(drawing)[:, :2].T + held.metres(drawing)[:, 2]
    assert np.abs(there - as_drawn(dancer)[0, :, :2]).max() < 1e-9


def test_a_raised_hand_is_ink_higher_on_the_page(cat):
    drawing, dancer = cat
    places = np.repeat(as_drawn(dancer), 2, axis=0)
    hand = dancer.skeleton.names.index("left_hand")
    elbow = dancer.skeleton.names.index("left_elbow")
    length = np.linalg.norm(places[0, hand] - places[0, elbow])
    places[1, hand] = places[1, elbow] + [0, length, 0]
    shown = held.performed(drawing, places)
    first, second = (draw2d.draw(shown, t)[..., 3] > 0 for t in (0, 1))
    assert first.sum() == pytest.approx(second.sum(), rel=0.1)
    up = int(drawing.unit * (places[1, hand, 1] - places[0, hand, 1]))
    rows = [np.flatnonzero((one & ~other).any(axis=1)) for one, other in ((first, second), (second, first))]
    assert rows[0].mean() - rows[1].mean() > 0.5 * up > 10
    low, high = np.flatnonzero(first.any(axis=0))[[0, -1]]
    assert low > 2 and high < shown.size[0] - 3  # with room round it, and not more than is needed
    assert shown.size[0] < 1.5 * np.ptp(drawing.character.marks.places[:, 0]) + 150
