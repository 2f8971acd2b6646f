"""Vector characters: keys are redrawn exactly, and what moves rigidly stays as it was drawn."""

import numpy as np
import pytest
import shapely

from capture.errors import InputError
from capture.motion import affine, keys
from retarget.characters.drawings import paths
from retarget.characters.drawings.drawing import drawing, outline_drawing, read_drawing
from retarget.characters.drawings.embed import embedding
from retarget.characters.drawings.paths import Gradient
from retarget.characters.drawings.svg import read_svg
from retarget.stage.perform import perform


@pytest.mark.parametrize("between", [keys.rigid, keys.straight])
def test_weight_one_on_a_key_redraws_that_key(worm, by_hand, between):
    character = read_drawing("egg", by_hand.names, worm, between)
    motion = by_hand.motion(by_hand.still(2), np.eye(2))
    performance = perform(motion, [character])
    box = character.box
    scale = 100 / (box[1, 1] - box[0, 1])
    stand = np.array([160, 200]) - scale * np.array([box[:, 0].mean(), box[1, 1]])
    for k, file in enumerate(worm):
        back = affine.invert(character.keys.removed[k])  # eq. 5: what the key turned is not lent to the stage
        place = affine.compose(np.column_stack([scale * np.eye(2), stand]), back)
        drawn = read_svg(file)[0]
        for posed, path in zip(performance.posed(k), drawn, strict=True):
            truth = shapely.MultiLineString(paths.flatten(paths.moved(path, place), 400))
            points = shapely.points(np.vstack(paths.flatten(posed, 2)))
            assert shapely.distance(points, truth).max() < 1e-3  # what the truth's 400 chords a curve cut off
            assert posed.width == pytest.approx(path.width * scale)


def test_the_posed_control_points_of_a_key_are_the_keys_own(worm, by_hand):
    character = read_drawing("egg", by_hand.names, worm)
    shapes = character.shapes(np.array([[0, 0, 0], [1, 1, 0]]))
    start = character.keys.points.shape[1]
    for k in range(2):
        drawn = affine.apply(character.keys.removed[k], shapes[k, start:])
        truth = np.concatenate([versions[k].points for versions in character.paths])
        assert np.abs(drawn - truth).max() < 1e-6


def test_half_a_turn_of_a_rigid_drawing_is_the_half_turn(worm, by_hand):
    character = read_drawing("egg", ("sit",), worm[:1])
    half = np.array([[[1.0, 0, 0], [0, 1, 0]], [[-1.0, 0, 0], [0, -1, 0]]])
    motion = by_hand.motion(half, np.ones((2, 1)), names=("sit",))
    performance = perform(motion, [character])
    before, after = performance.posed(0), performance.posed(1)
    pivot = motion.tracks[0].pivot
    for path, turned in zip(before, after, strict=True):
        assert np.abs(turned.points - (2 * pivot - path.points)).max() < 1e-9


def test_a_key_that_is_an_affine_copy_adds_nothing(worm, by_hand):
    """Its turn, stretch and place are taken out (eq. 5), so any weights draw key 0."""
    first = read_svg(worm[0])[0]
    copy = [paths.moved(path, np.array([[0.0, -1.5, 40], [1, 0.2, 7]])) for path in first]
    character = drawing("egg", by_hand.names, [first, copy])
    shapes = character.shapes(keys.inbetween_rows(2))
    assert np.abs(shapes - shapes[0]).max() < 1e-6


def test_every_pose_keeps_fills_strokes_and_inner_lines(worm, by_hand):
    character = read_drawing("egg", by_hand.names, worm)
    motion = by_hand.motion(by_hand.tumble(3), [[1, 0], [0.5, 0.5], [0, 1]])
    first = read_svg(worm[0])[0]
    for t in range(3):
        posed = perform(motion, [character]).posed(t)
        assert [path.name for path in posed] == [path.name for path in first]
        for path, drawn in zip(posed, first, strict=True):
            assert (path.cap, path.join, list(path.closed)) == (drawn.cap, drawn.join, list(drawn.closed))
            assert (path.stroke is None) == (drawn.stroke is None)
            if not isinstance(drawn.fill, Gradient) and drawn.fill is not None:
                np.testing.assert_allclose(path.fill, drawn.fill, atol=1e-12)


def test_a_squash_leaves_the_strokes_as_wide_as_they_were(worm, by_hand):
    character = read_drawing("egg", ("sit",), worm[:1])
    squash = np.array([[[1.0, 0, 0], [0, 1, 0]], [[2.0, 0, 0], [0, 0.5, 0]]])
    performance = perform(by_hand.motion(squash, np.ones((2, 1)), names=("sit",)), [character])
    widths = [[path.width for path in performance.posed(t)] for t in range(2)]
    assert widths[0] == widths[1]


def test_a_gradient_goes_where_its_shape_goes(worm, by_hand):
    character = read_drawing("egg", ("sit",), worm[:1])
    motion = by_hand.motion(by_hand.tumble(2), np.ones((2, 1)), names=("sit",))
    before, after = (perform(motion, [character]).posed(t)[-1] for t in range(2))
    move = affine.fit(before.points, after.points)
    np.testing.assert_allclose(after.fill.place, affine.compose(move, before.fill.place), atol=1e-6)


def test_colours_of_the_keys_are_mixed(tmp_path, by_hand):
    files = [tmp_path / "a.svg", tmp_path / "b.svg"]
    for file, colour, by in zip(files, ("#000000", "#ffffff"), (0, 60), strict=True):
        file.write_text(by_hand.worm_svg(by, stripe=colour), encoding="utf-8")
    character = read_drawing("egg", by_hand.names, files)
    performance = perform(by_hand.motion(by_hand.still(), [[0.75, 0.25]]), [character])
    np.testing.assert_allclose(performance.posed(0)[1].fill, [0.25, 0.25, 0.25, 1], atol=1e-9)


def test_inbetweens_of_a_bend_stay_smooth(worm, by_hand):
    """Half-way between the keys the body's outline has no corner that the keys do not have."""
    character = read_drawing("egg", by_hand.names, worm)
    rows = np.array([[0, 0, 0], [0, 1, 0.5]])
    start, body = character.keys.points.shape[1], character.paths[0][0]
    key, middle = character.shapes(rows)[:, start : start + len(body.points)]

    def corners(points):
        arriving, leaving = points[3:-1:3] - points[2:-2:3], points[4::3] - points[3:-1:3]
        cross = arriving[:, 0] * leaving[:, 1] - arriving[:, 1] * leaving[:, 0]
        return np.abs(np.arctan2(cross, np.sum(arriving * leaving, axis=1)))

    smooth = corners(key) < np.radians(1)
    assert smooth.sum() > 5
    assert np.degrees(corners(middle)[smooth].max()) < 4


def test_the_embedding_reproduces_affine_maps_and_nearly_a_bend(by_hand):
    source = keys.keyset(("a",), by_hand.egg()[None])
    mesh, faces = source.points[0], source.faces
    points = np.random.default_rng(3).uniform([135, 115], [185, 185], (200, 2))
    carry = embedding(mesh, faces, points)
    move = np.array([[0.5, -2, 30], [1, 0.3, -8]])
    np.testing.assert_allclose(carry @ affine.apply(move, mesh), affine.apply(move, points), atol=1e-9)
    bent = carry @ by_hand.lean(mesh, 40.0)
    assert np.abs(bent - by_hand.lean(points, 40.0)).max() < 0.05  # pixels; a flat face alone is 5 times worse


def test_an_outline_drawing_is_painted_along_the_mesh(by_hand):
    source = keys.keyset(("a",), by_hand.egg()[None])
    character = outline_drawing("egg", source, np.array([1, 0, 0, 1.0]))
    ring = paths.flatten(character.paths[0][0], 1)[0]
    np.testing.assert_allclose(ring[:-1], source.points[0, source.outline], atol=1e-9)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            lambda text: text.replace('<path id="mouth"', '<circle r="9"/><path id="mouth"'),
            "6 painted elements, not 5",
        ),
        (
            lambda text: text.replace(" Q", " L").replace('id="mouth"', 'id="odd"'),
            r"<path> 4 \(odd\) has the path comm",
        ),
        (
            lambda text: text.replace('fill="#203080"', 'fill="url(#warm)"'),
            r"\(ring\) has a linear gradient of 2 stops",
        ),
        (
            lambda text: text.replace('stroke="black" stroke-width="3"', ""),
            r"\(body\) has nothing as its stroke",
        ),
    ],
)
def test_keys_that_are_not_drawn_alike_are_refused_with_the_first_difference(worm, by_hand, change, said):
    worm[1].write_text(change(worm[1].read_text()), encoding="utf-8")
    with pytest.raises(InputError, match=rf"worm_lean\.svg must hold the same elements as .*{said}"):
        read_drawing("egg", by_hand.names, worm)


def test_separate_pieces_are_one_character(tmp_path, by_hand):
    file = tmp_path / "dots.svg"
    circles = '<circle cx="20" cy="20" r="10"/><circle cx="60" cy="20" r="10"/>'
    file.write_text(f'<svg xmlns="http://www.w3.org/2000/svg">{circles}</svg>', encoding="utf-8")
    character = read_drawing("egg", ("sit",), [file])
    motion = by_hand.motion(by_hand.tumble(4), np.ones((4, 1)), names=("sit",))
    role = perform(motion, [character]).roles[0]
    for t in range(4):
        move = affine.fit(role.points[0], role.points[t])
        assert np.abs(affine.apply(move, role.points[0]) - role.points[t]).max() < 1e-9
