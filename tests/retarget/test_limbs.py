"""A limb that swings in front of a body moves on its own mesh, and stays on its joint."""

import numpy as np
import pytest

from capture.motion import arap
from retarget.characters.drawings.drawing import read_drawing
from retarget.characters.drawings.limbs import gaps_at, hang, joined, limbs
from retarget.characters.drawings.paths import pieces, split
from retarget.characters.drawings.svg import read_svg

SHOULDER = np.array([125.0, 100.0])


@pytest.fixture
def waver(tmp_path):
    """A body that stands still, a face on it, and a bar that turns by 100 degrees about its shoulder."""
    files = []
    for name, degrees in (("sit", -20), ("lean", 80)):
        files.append(tmp_path / f"waver_{name}.svg")
        files[-1].write_text(
            '<svg xmlns="http://www.w3.org/2000/svg" width="200" height="200">'
            '<ellipse cx="100" cy="120" rx="40" ry="60" fill="#8ac" stroke="black" stroke-width="4"/>'
            '<circle cx="90" cy="90" r="6"/>'
            f'<g transform="rotate({degrees} 125 100)"><circle cx="185" cy="100" r="5"/>'
            '<path fill="#c86" d="M125 92h60v16h-60c-11 0 -11 -16 0 -16z"/></g></svg>',
            encoding="utf-8",
        )
    return files


@pytest.fixture
def elements(waver):
    return cut(waver)


def cut(files):
    """The elements of drawings in their keys, every curve cut in four."""
    versions = [[split(path, np.full(len(pieces(path)), 4)) for path in read_svg(file)[0]] for file in files]
    return [list(of_keys) for of_keys in zip(*versions, strict=True)]


def test_the_limb_and_what_rides_on_it_get_a_mesh_of_their_own(elements):
    found = limbs(elements, 5.0)
    assert [sorted(limb.elements) for limb in found] == [[0, 1], [2, 3]]


def test_half_way_the_body_stands_still_and_the_limb_has_turned_half_way_about_its_joint(elements):
    points, faces, _, joints = joined(limbs(elements, 5.0))
    rows = np.array([[0, 1, 0.5]])
    gaps = arap.straight_inbetweens(gaps_at(points, joints), faces, rows)
    (middle,) = hang(arap.inbetweens(points, faces, rows), joints, gaps)
    limb = joints[0].limb
    body = np.ones(len(middle), bool)
    body[limb] = False
    assert np.abs(middle[body] - points[0, body]).max() < 0.5
    c, s = np.cos(np.radians(50)), np.sin(np.radians(50))
    truth = SHOULDER + (points[0, limb] - SHOULDER) @ np.array([[c, s], [-s, c]])
    assert np.abs(middle[limb] - truth).max() < 2  # pixels; on a mesh of its own alone the shoulder slips 12


def test_a_drawing_that_one_mesh_can_carry_gets_one(worm):
    assert len(limbs(cut(worm), 5.0)) == 1


def test_keys_of_a_drawing_with_limbs_are_redrawn_exactly(waver, by_hand):
    character = read_drawing("egg", by_hand.names, waver)
    assert len(character.joints) == 1
    shapes = character.shapes(np.array([[0, 0, 0], [1, 1, 0]]))
    start = character.keys.points.shape[1]
    for k in range(2):
        truth = np.concatenate([versions[k].points for versions in character.paths])
        removed = character.keys.removed[k]
        drawn = shapes[k, start:] @ removed[:, :2].T + removed[:, 2]
        assert np.abs(drawn - truth).max() < 1e-6


def test_what_lies_beside_a_limb_does_not_ride_on_it(waver):
    """A long stem under the body stands as still as that, but the body's own mesh ends above it."""
    for file in waver:
        stem = '<path fill="#5a5" d="M94 175h12v120h-12z"/></svg>'
        file.write_text(file.read_text(encoding="utf-8").replace("</svg>", stem), encoding="utf-8")
    found = limbs(cut(waver), 5.0)
    assert len(found) == 2
    (limb,) = [limb for limb in found if 4 in limb.elements]
    assert limb.points[0, :, 1].max() > 294
