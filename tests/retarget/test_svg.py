"""Reading SVG: every shape becomes cubic curves where a formula says it must be."""

import numpy as np
import pytest

from capture.errors import InputError
from retarget.characters.drawings import paths
from retarget.characters.drawings.paths import Gradient
from retarget.characters.drawings.svg import read_svg


@pytest.fixture
def read(tmp_path):
    def reading(inside, head='width="100" height="100"'):
        file = tmp_path / "drawing.svg"
        text = f'<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" {head}>'
        file.write_text(f"{text}{inside}</svg>", encoding="utf-8")
        return read_svg(file)

    return reading


def points_along(path, steps=16):
    return np.vstack(paths.flatten(path, steps))


def test_a_circle_keeps_its_radius_to_three_in_ten_thousand(read):
    (circle,), _ = read('<circle cx="40" cy="50" r="20"/>')
    radius = np.linalg.norm(points_along(circle) - [40, 50], axis=1)
    assert np.abs(radius - 20).max() < 3e-4 * 20


def test_arcs_of_a_path_lie_on_their_ellipse(read):
    (arc,), _ = read('<path d="M10 50 A40 20 0 1 1 90 50" fill="none" stroke="red"/>')
    x, y = ((points_along(arc) - [50, 50]) / [40, 20]).T
    assert np.abs(x**2 + y**2 - 1).max() < 1e-3


def test_relative_and_short_commands_draw_the_same_square_as_a_rect(read):
    long, _ = read('<path d="M10 20 L40 20 L40 50 L10 50 Z"/>')
    for other in ('<path d="m10 20h30v30h-30z"/>', '<rect x="10" y="20" width="30" height="30"/>'):
        (found,), _ = read(other)
        np.testing.assert_allclose(found.points, long[0].points, atol=1e-9)
        assert found.commands == long[0].commands


def test_a_quadratic_curve_is_the_same_curve_as_a_cubic(read):
    (path,), _ = read('<path d="M0 0 Q50 100 100 0" stroke="red"/>')
    t = np.arange(17)[:, None] / 16
    truth = 2 * t * (1 - t) * np.array([50, 100]) + t**2 * np.array([100, 0])
    np.testing.assert_allclose(points_along(path), truth, atol=1e-9)


def test_groups_use_and_viewbox_place_a_shape_as_the_standard_says(read):
    inside = (
        '<defs><rect id="r" width="10" height="10"/></defs>'
        '<g transform="translate(5 0) scale(2)"><use href="#r" x="10" y="20"/></g>'
    )
    (square,), _ = read(inside, 'width="200" height="200" viewBox="0 0 100 100"')
    low, high = square.points.min(axis=0), square.points.max(axis=0)
    np.testing.assert_allclose([low, high], [[50, 80], [90, 120]], atol=1e-9)


def test_strokes_scale_with_the_transform_and_opacities_multiply_down_the_groups(read):
    inside = (
        '<g opacity="0.5" transform="scale(4 1)"><g opacity="0.5">'
        '<path d="M0 0L9 9" stroke="#fff" stroke-width="3"/></g></g>'
    )
    (line,), _ = read(inside)
    assert line.width == pytest.approx(6)  # the square root of the area's scale
    assert line.opacity == pytest.approx(0.25)


def test_style_sheets_classes_and_inheritance_paint_a_shape(read):
    inside = (
        "<style>.red{fill:#ff0000}</style>"
        '<g style="stroke:blue;stroke-width:2;stroke-linecap:round;fill-opacity:.5">'
        '<path class="red" d="M0 0H9V9Z"/></g>'
    )
    (path,), _ = read(inside)
    np.testing.assert_allclose(path.fill, [1, 0, 0, 0.5], atol=1 / 255)
    np.testing.assert_allclose(path.stroke, [0, 0, 1, 1], atol=1e-9)
    assert (path.width, path.cap, path.join) == (2, "round", "miter")


def test_a_gradient_takes_its_stops_from_another_and_lies_on_the_shape(read):
    inside = (
        '<defs><linearGradient id="a"><stop offset="10%" stop-color="red"/>'
        '<stop offset="1" style="stop-color:#00f;stop-opacity:.5"/></linearGradient>'
        '<linearGradient id="b" xlink:href="#a" x1="0" x2="0" y1="0" y2="1"/>'
        '<radialGradient id="c" xlink:href="#a" gradientUnits="userSpaceOnUse" cx="30" cy="40" r="10"'
        ' gradientTransform="translate(1 2)"/></defs>'
        '<rect x="10" y="20" width="30" height="40" fill="url(#b)"/>'
        '<rect width="9" height="9" fill="url(#c)"/>'
    )
    (first, second), _ = read(inside)
    assert isinstance(first.fill, Gradient)
    np.testing.assert_allclose(first.fill.offsets, [0.1, 1])
    np.testing.assert_allclose(first.fill.colors, [[1, 0, 0, 1], [0, 0, 1, 0.5]])
    np.testing.assert_allclose(first.fill.place[:, 2], [10, 20])  # t = 0 at the top
    np.testing.assert_allclose(first.fill.place[:, :2] @ [1, 0], [0, 40])  # t = 1 at the foot
    np.testing.assert_allclose(second.fill.place, [[10, 0, 31], [0, 10, 42]])
    np.testing.assert_allclose(second.fill.focus, [0, 0])


def test_what_cannot_be_seen_is_skipped_and_what_cannot_be_drawn_is_noted(read):
    inside = (
        '<path d="M0 0H9V9Z" display="none"/><path d="M0 0H9V9Z" visibility="hidden"/>'
        '<path d="M0 0H9V9Z" fill="none"/><path d="M0 0H9V9Z" opacity="0"/><text x="3">words</text>'
        '<g display="none"><path d="M0 0H9V9Z"/></g><defs><path d="M0 0H9V9Z"/></defs>'
        '<clipPath id="k"><path d="M0 0H9V9Z"/></clipPath>'
        '<rect id="seen" width="9" height="9" clip-path="url(#k)"/>'
    )
    drawn, notes = read(inside)
    assert [path.name for path in drawn] == ["<rect> 1 (seen)"]
    assert notes == ["<text> is not drawn", "clip-path is left out"]


@pytest.mark.parametrize("text", ["", "not xml", "<html/>", '<svg xmlns="http://www.w3.org/2000/svg"/>'])
def test_a_file_that_is_no_drawing_is_refused_by_name(tmp_path, text):
    file = tmp_path / "odd.svg"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=r"odd\.svg must"):
        read_svg(file)


def test_a_missing_drawing_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"none\.svg"):
        read_svg(tmp_path / "none.svg")


def test_a_split_path_is_the_same_curve(read):
    (path,), _ = read('<path d="M0 0 C40 0 0 90 80 50 L10 90 Z M20 20 h9 v9 z"/>')
    counts = np.arange(1, len(paths.pieces(path)) + 1)
    cut = paths.split(path, counts)
    for whole, number, first in zip(paths.pieces(path), counts, np.cumsum(counts) - counts, strict=True):
        t = np.linspace(0, 1, 7)
        parts = paths.pieces(cut)[first : first + number]
        for k, part in enumerate(parts):
            np.testing.assert_allclose(
                paths.along(part[None], t), paths.along(whole[None], (k + t) / number), atol=1e-9
            )
    assert list(cut.closed) == [True, True]


def test_a_hole_and_an_island_in_it_are_wound_in_turns(read):
    rings = "".join(f"M{k} {k}H{90 - k}V{90 - k}H{k}Z" for k in (10, 0, 20))
    (path,), _ = read(f'<path fill-rule="evenodd" d="{rings}"/>')
    turned = paths.wound(path, paths.windings(path))
    x = [line[:, 0] @ np.roll(line[:, 1], -1) - line[:, 1] @ np.roll(line[:, 0], -1) for line in paths.flatten(turned)]
    assert np.sign(x[1]) == np.sign(x[2]) == -np.sign(x[0])
