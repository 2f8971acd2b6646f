"""Drawings written as SVG: read back the same, also by another reader."""

from dataclasses import replace

import numpy as np
import pytest
from svgelements import SVG, Path, Shape

from retarget.characters.drawings.paths import DrawnPath, Gradient
from retarget.characters.drawings.svg import read_page, read_svg
from retarget.characters.drawings.svgout import write_keys

SIZE = (320.0, 240.5)


@pytest.fixture
def drawn() -> list[DrawnPath]:
    """A closed shape with a hole, an open line, and a disc of a gradient."""
    rng = np.random.default_rng(3)
    points = rng.uniform(10, 200, (17, 2))
    fade = Gradient(np.array([0, 0.4, 1]), rng.uniform(0, 1, (3, 4)).round(2), rng.uniform(-9, 90, (2, 3)))
    glow = replace(fade, focus=np.array([0.3, -0.2]), spread="reflect")
    ring = DrawnPath(
        "<path> 1 (ring)", "MCCZMCCZ", points[:14], np.array([0, 7, 14]), np.array([True, True]),
        np.array([0.2, 0.4, 0.6, 0.5]), fade, 2.5, join="bevel", evenodd=True, opacity=0.75,
    )  # fmt: skip
    line = replace(
        ring, name="<path> 2", commands="MC", points=points[:4], starts=np.array([0, 4]), closed=np.array([False]),
        fill=None, stroke=np.array([1.0, 0, 0.2, 1]), cap="round", dashes=(3.0, 1.5), evenodd=False, opacity=1.0,
    )  # fmt: skip
    return [ring, line, replace(line, name="<path> 3", fill=glow, stroke=None)]


def test_what_is_written_is_read_back(tmp_path, drawn):
    file = tmp_path / "one.svg"
    write_keys([file], [drawn], SIZE)
    for path, there in zip(drawn, read_svg(file)[0], strict=True):
        for a, b, start in zip(path.starts[:-1], path.starts[1:], there.starts, strict=False):
            np.testing.assert_allclose(there.points[start : start + b - a], path.points[a:b], atol=1e-6)
        assert there.name == path.name and there.closed.tolist() == path.closed.tolist()
        assert (there.cap, there.join, there.evenodd, there.opacity) == (
            path.cap if path.stroke is not None else "butt", path.join if path.stroke is not None else "miter",
            path.evenodd, path.opacity,
        )  # fmt: skip
        for which in ("fill", "stroke"):
            _same_paint(getattr(path, which), getattr(there, which))
        if path.stroke is not None:
            assert there.width == pytest.approx(path.width) and there.dashes == path.dashes
    assert read_page(file) == (SIZE, [])


def test_another_reader_finds_the_same_curves(tmp_path, drawn):
    file = tmp_path / "one.svg"
    write_keys([file], [drawn], SIZE)
    shapes = [one for one in SVG.parse(str(file)).elements() if isinstance(one, Shape)]
    assert [one.id for one in shapes] == ["ring", None, None]
    found = [(point.x, point.y) for point in Path(shapes[1]).as_points()]
    np.testing.assert_allclose(found[-4:], drawn[1].points, atol=1e-6)


def test_a_side_that_bends_in_one_key_is_a_curve_in_all_of_them(tmp_path):
    corners = np.array([[0, 0], [30, 0], [30, 30], [0, 0]], float)
    thirds = corners[:-1, None] + np.arange(1, 4)[:, None] / 3 * (corners[1:] - corners[:-1])[:, None]
    points = np.vstack([corners[:1], thirds.reshape(-1, 2)])
    flat = DrawnPath("<path> 1", "MLLZ", points, np.array([0, 10]), np.array([True]), np.array([0, 0, 0, 1.0]))
    bent = replace(flat, points=points + np.where(np.arange(10) == 8, 5.0, 0.0)[:, None])
    for keys, count in (([flat, flat], 10), ([flat, bent], 13)):  # a Z of no length comes after the bent side
        files = [tmp_path / "a.svg", tmp_path / "b.svg"]
        write_keys(files, [[key] for key in keys], SIZE)
        read = [read_svg(file)[0][0] for file in files]
        assert [len(path.points) for path in read] == [count, count]
        assert read[0].commands == read[1].commands
        np.testing.assert_allclose(read[1].points[:10], keys[1].points, atol=1e-6)


def test_a_key_that_is_kept_is_not_written(tmp_path, drawn):
    write_keys([None, tmp_path / "b.svg"], [drawn, drawn], SIZE)
    assert [file.name for file in tmp_path.iterdir()] == ["b.svg"]


def _same_paint(one, other):
    if not isinstance(one, Gradient):
        assert (one is None) == (other is None)
        assert one is None or np.abs(one - other).max() < 0.5 / 255
        return
    assert other.spread == one.spread and (one.focus is None) == (other.focus is None)
    np.testing.assert_allclose(other.offsets, one.offsets, atol=1e-6)
    np.testing.assert_allclose(other.colors, one.colors, atol=0.5 / 255)
    np.testing.assert_allclose(other.place, one.place, rtol=1e-6)
    assert one.focus is None or np.abs(one.focus - other.focus).max() < 1e-6
