"""Contours come in from files and mattes, and what is no contour is refused at the door in a sentence."""

import json

import numpy as np
import pytest

from capture.errors import InputError
from capture.pictures import contours
from capture.pictures.contours import contours_of_mattes, make, read_contours, write_contours
from fixtures import ball, maps

BLOB = maps.smooth([(60, 30), (88, 34), (98, 62), (84, 92), (56, 94), (40, 66)], pieces=4)
SQUARE = np.array([(10, 10), (50, 10), (50, 40), (10, 40)], float)
COLUMNS = {"x": SQUARE[:, 0].tolist(), "y": SQUARE[:, 1].tolist()}
LINES = [SQUARE[:3] + t for t in range(3)]


def write(path, text):
    path.write_text(text, encoding="utf-8")
    return path


def svg(*inside, size=(120, 100)):
    return f'<svg xmlns="http://www.w3.org/2000/svg" width="{size[0]}" height="{size[1]}">{"".join(inside)}</svg>'


def same(found, curves):
    return len(found) == len(curves) and all(np.array_equal(a, b) for a, b in zip(found.curves, curves))


@pytest.mark.parametrize("closed", [True, False])
def test_what_is_written_is_read_back_exactly(tmp_path, closed):
    before = make([BLOB + 0.1 * t for t in range(4)] + [BLOB[::2]], closed, fps=23.976)
    write_contours(before, tmp_path / "blob.json")
    after = read_contours(tmp_path / "blob.json")
    assert same(after, before.curves) and after.closed == closed and after.fps == 23.976


@pytest.mark.parametrize(
    "values",
    [
        {"frames": [SQUARE.tolist(), (SQUARE + 1).tolist()]},
        {"contours": [{"points": SQUARE.tolist()}, {"points": (SQUARE + 1).tolist()}], "closed": True, "fps": 24},
        {"outlines": [[{"x": x, "y": y} for x, y in (SQUARE + t).tolist()] for t in (0, 1)]},
        {"frames": [{"frame": 7, **COLUMNS}, {"frame": 8, "outline": (SQUARE + 1).tolist()}]},
        {"12": SQUARE.tolist(), "13": (SQUARE + 1).tolist()},
        [SQUARE.tolist(), [*(SQUARE + 1).tolist(), (SQUARE[0] + 1).tolist()]],
    ],
    ids=["plain", "named", "x and y", "columns", "numbered", "bare"],
)  # fmt: skip
def test_json_is_read_as_other_hands_write_it(tmp_path, values):
    found = read_contours(write(tmp_path / "a.json", json.dumps(values)))
    assert same(found, [SQUARE, SQUARE + 1]) and found.closed and found.fps == 24


def test_a_csv_is_read_in_the_order_of_its_points(tmp_path):
    rows = [(t, k, *(SQUARE[k] + t)) for t in (1, 0) for k in (2, 0, 3, 1)]
    text = "\ufeffFrame, Point, X, Y\n" + "\n".join(",".join(map(str, row)) for row in rows) + "\n\n"
    assert same(read_contours(write(tmp_path / "a.csv", text)), [SQUARE, SQUARE + 1])
    plain = "frame,x,y\n" + "\n".join(f"{t},{x},{y}" for t, line in enumerate(LINES) for x, y in line)
    found = read_contours(write(tmp_path / "b.csv", plain), closed=False)
    assert same(found, LINES) and not found.closed


def test_a_frame_left_out_holds_the_drawing_before_it(tmp_path):
    values = {"frames": [{"frame": t, "points": (SQUARE + t).tolist()} for t in (1, 3, 6)]}
    found = read_contours(write(tmp_path / "twos.json", json.dumps(values)))
    assert same(found, [SQUARE + t for t in (1, 1, 3, 3, 3, 6)])


def test_a_folder_of_svgs_gives_a_path_for_each_frame(tmp_path):
    for t in (2, 10, 1):
        small = f'<path id="eye" d="M 5 5 h 4 v 4 h -4 z"/><g transform="translate({t} 0)">'
        body = '<path id="body" fill="none" stroke="black" d="M10.5 10.5 H50.5 V40.5 H10.5 Z"/></g>'
        write(tmp_path / f"walk{t}.svg", svg(small, body))
    found = read_contours(tmp_path)
    assert found.closed and same(found, [SQUARE + (t, 0) for t in (1, 2, 10)])
    assert same(read_contours(tmp_path, name="eye"), 3 * [np.array([(4.5, 4.5), (8.5, 4.5), (8.5, 8.5), (4.5, 8.5)])])
    with pytest.raises(InputError, match="id 'tail', its ids are eye, body"):
        read_contours(tmp_path, name="tail")


def test_svg_curves_are_followed_and_open_paths_stay_open(tmp_path):
    circles = [f'<circle cx="{60 + t}.5" cy="50.5" r="30" fill="red"/>' for t in range(2)]
    found = read_contours(write(tmp_path / "circles.svg", svg(*circles)))
    assert len(found) == 2 and found.closed
    for t, curve in enumerate(found.curves):
        assert np.abs(np.linalg.norm(curve - (60 + t, 50), axis=1) - 30).max() < 0.01
        assert 60 < len(curve) < 150
    line = read_contours(
        write(tmp_path / "line.svg", svg('<path fill="none" stroke="red" d="M0 0 C 30 0 60 30 60 60"/>'))
    )
    assert not line.closed and np.allclose(line.curves[0][[0, -1]], [(-0.5, -0.5), (59.5, 59.5)])


def test_the_balls_mattes_give_its_rim():
    toon = ball.ball()
    frames = (0, 9, 11, 40)
    found = contours_of_mattes(toon.matte(t) for t in frames)
    for t, curve in zip(frames, found.curves):
        rim = maps.even(toon.parts[0].points[t], 2000)
        distance = np.sqrt(((curve[:, None] - rim) ** 2).sum(axis=2).min(axis=1))
        assert np.abs(distance - 1.6).max() < 0.3  # half the ink lies outside
    hard = contours_of_mattes([(255 * (toon.matte(9) > 0.5)).astype(np.uint8)])
    assert abs(contours.signed_area(hard.curves[0])) == pytest.approx(
        abs(contours.signed_area(found.curves[1])), rel=0.01
    )


def test_points_that_come_twice_in_a_row_are_taken_once():
    twice = np.repeat(np.vstack([SQUARE, SQUARE[:1]]), 2, axis=0)
    assert same(make([twice]), [SQUARE])


EIGHT = np.array([(0, 0), (10, 10), (10, 0), (0, 10)], float)
BAD = [
    (EIGHT, True, r"must not cross itself, this one does near \(5, 5\)"),
    (SQUARE[:2], True, "needs at least 3 different points, got 2"),
    ([(4, 4)] * 5, True, "all its 5 points are equal"),
    ([(4, 4)] * 5, False, "all its 5 points are equal"),
    ([(0, 0), (1, np.nan), (3, 0)], True, "point 1 holds NaN"),
    ([(0, 0), (5, 5), (9, 9)], True, "lie on one line"),
    ([], True, "got an array of shape"),
    ([(0, 0, 0)] * 4, True, "got an array of shape"),
    ([[0, 0], [1]], True, "list of points"),
    ("nonsense", True, "list of points"),
]


@pytest.mark.parametrize("curve, closed, sentence", BAD)
def test_what_is_no_contour_is_refused_and_its_frame_named(curve, closed, sentence):
    with pytest.raises(InputError, match=f"frame 1: .*{sentence}") as caught:
        make([SQUARE, curve], closed)
    assert "\n" not in str(caught.value)


def test_an_outline_may_cross_itself_if_told_so():
    assert same(make([EIGHT], crossing=True), [EIGHT])


@pytest.mark.parametrize(
    "name, text, sentence",
    [
        ("a.json", "{", "must be JSON"),
        ("a.json", "{}", "must hold a list of frames"),
        ("a.json", '{"frames": []}', "must hold a list of frames"),
        ("a.json", '{"frames": [5]}', "list of points"),
        ("a.json", '{"frames": [null]}', "list of points"),
        ("a.json", '{"frames": [[[0, 0], [9, 0], [0, 9]]], "closed": "yes"}', '"closed" must be true or false'),
        ("a.json", '{"frames": [[[0, 0], [9, 0], [0, 9]]], "fps": 0}', "positive number"),
        ("a.json", '{"frames": [{"frame": "x", "points": []}]}', "numbered by whole numbers"),
        ("a.json", '{"frames": [{"frame": 1, "points": []}, {"frame": 1, "points": []}]}', "comes twice"),
        ("a.json", '{"frames": [{"frame": 1, "points": []}, {"frame": 99999999, "points": []}]}', "follow each other"),
        ("a.csv", "", "must name the columns"),
        ("a.csv", "frame,x\n1,2", "must name the columns"),
        ("a.csv", "frame,x,y\n", "at least one frame"),
        ("a.csv", "frame,x,y\n0,1,two", "line 2 is '0,1,two'"),
        ("a.svg", "<svg", "must be an SVG drawing"),
        ("a.svg", svg(), "at least one path"),
        ("a.svg", svg('<path fill="none" d="M0 0 L9 9"/>', '<rect width="9" height="9"/>'), "closed or all open"),
        ("a.txt", "", "must be a .json, .csv or .svg file"),
    ],
)  # fmt: skip
def test_a_file_that_holds_no_contours_is_refused_in_a_sentence(tmp_path, name, text, sentence):
    with pytest.raises(InputError, match=sentence) as caught:
        read_contours(write(tmp_path / name, text))
    assert "\n" not in str(caught.value)


def test_a_missing_file_an_empty_folder_and_an_empty_matte_are_refused(tmp_path):
    for name in ("a.json", "a.csv", "a.svg", "none"):
        with pytest.raises(InputError):
            read_contours(tmp_path / name)
    with pytest.raises(InputError, match="this has none"):
        read_contours(tmp_path)
    with pytest.raises(InputError, match="of frame 1 is empty"):
        contours_of_mattes([np.pad(np.ones((9, 9)), 3), np.zeros((15, 15))])
    with pytest.raises(InputError, match="one channel"):
        contours_of_mattes([np.zeros((5, 5, 3))])


def test_a_soft_matte_that_a_filter_pushed_past_one_is_still_a_matte():
    soft = 1.0000002 * ball.ball().matte(9)
    assert np.allclose(
        contours_of_mattes([soft]).curves[0], contours_of_mattes([ball.ball().matte(9)]).curves[0], atol=1e-3
    )
