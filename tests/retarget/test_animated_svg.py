"""Animated SVG and SVG frames, read back as XML and by a reader that is not ours."""

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image
from svgelements import CubicBezier, Path

from capture.errors import InputError
from capture.pictures.encode import over
from retarget.characters.drawings import paths
from retarget.characters.drawings.drawing import read_drawing
from retarget.characters.drawings.svg import read_svg
from retarget.characters.photos.picture import read_picture
from retarget.export.svg import outlines, write_svg, write_svg_frames
from retarget.stage.draw2d import draw, draw_things
from retarget.stage.perform import perform

SVG = "{http://www.w3.org/2000/svg}"


def acting(by_hand, worm, frames=7, at=None, **changes):
    at = np.arange(frames) if at is None else at
    weights = np.column_stack([1 - np.linspace(0, 1.3, frames), np.linspace(0, 1.3, frames)])
    motion = by_hand.motion(by_hand.tumble(frames)[at], weights[at], **changes)
    return perform(motion, [read_drawing("egg", by_hand.names, worm)])


def curves_of(d):
    pieces = [piece for piece in Path(d) if isinstance(piece, CubicBezier)]
    return np.array([[(p.x, p.y) for p in (c.start, c.control1, c.control2, c.end)] for c in pieces])


def test_every_value_of_an_outline_is_ours_with_the_same_commands(tmp_path, by_hand, worm):
    performance = acting(by_hand, worm)
    write_svg(performance, tmp_path / "worm.svg")
    root = ElementTree.parse(tmp_path / "worm.svg").getroot()
    shown = root.findall(f".//{SVG}path")
    first = performance.posed(0)
    assert len(shown) == len(first)
    for number, path in enumerate(shown):
        (animate,) = [one for one in path.findall(f"{SVG}animate") if one.get("attributeName") == "d"]
        values = animate.get("values").split(";")
        assert values[0] == path.get("d") and values[-1] == values[-2]  # the last drawing has its own duration
        assert len({"".join(letter for letter in value if letter.isalpha()) for value in values}) == 1
        for t, value in enumerate(values[:-1]):
            wanted = paths.pieces(performance.posed(t)[number]) + 0.5  # from the page's corner
            assert np.abs(curves_of(value) - wanted).max() <= 0.0051


def test_held_drawings_are_discrete_and_written_once(tmp_path, by_hand, worm):
    write_svg(acting(by_hand, worm, 8, np.arange(8) // 2 * 2), tmp_path / "worm.svg")
    moving = list(ElementTree.parse(tmp_path / "worm.svg").getroot().iter(f"{SVG}animate"))
    assert len(moving) >= 5
    for animate in moving:
        assert animate.get("calcMode") == "discrete" and len(animate.get("values").split(";")) <= 4
        times = np.array([float(time) for time in animate.get("keyTimes").split(";")]) * 8
        assert (times <= np.round(times)).all() and np.abs(times - np.round(times)).max() < 1e-3


def test_numbers_are_short_and_parted_as_the_standard_reads_them():
    path = paths.DrawnPath(
        "p", "MC", np.array([[-0.05, 12.5], [0, -3], [10.004, 0.5], [7, 7.25]]), np.array([0, 4]), np.array([False])
    )
    (text,) = outlines([path])
    assert text == "M-.05 12.5c.05-15.5 10.05-12 7.05-5.25"
    np.testing.assert_allclose(curves_of(text)[0], path.points, atol=0.0051)


@pytest.mark.parametrize("frames", [60])
def test_a_clip_of_two_seconds_takes_little_room(tmp_path, by_hand, worm, frames):
    performance = acting(by_hand, worm, frames)
    write_svg(performance, tmp_path / "worm.svg")
    curves = sum(len(paths.pieces(path)) for path in performance.posed(0))
    assert (tmp_path / "worm.svg").stat().st_size < 32 * curves * frames + 4000  # bytes a curve


def test_each_frame_is_a_drawing_that_we_read_back_as_it_is_shown(tmp_path, by_hand, worm):
    performance = acting(by_hand, worm, 4, visible=np.array([1, 1, 0, 1], bool))
    assert write_svg_frames(performance, tmp_path / "drawings", background="white") == 4
    files = sorted((tmp_path / "drawings").iterdir())
    assert [file.name for file in files] == ["0000.svg", "0001.svg", "0002.svg", "0003.svg"]
    for t, file in enumerate(files):
        read = [replace(path, points=path.points - 0.5) for path in read_svg(file)[0]]
        seen = draw_things([path for path in read if "rect" not in path.name], performance.size, "white")
        if t == 2:
            assert len(read) == 1  # the page alone
        else:
            assert len(read) > 4
            colored = [path for path in read if not isinstance(path.fill, paths.Gradient)]
            assert len(colored) == len(read) - 1
            assert np.abs(seen.astype(int) - draw(performance, t, "white")).mean() < 0.5
    write_svg_frames(acting(by_hand, worm, 2), tmp_path / "drawings")
    assert len(list((tmp_path / "drawings").iterdir())) == 2  # a second run leaves nothing of the first


def test_a_picture_lies_in_a_frame_as_png_and_is_refused_in_an_animated_file(tmp_path, by_hand):
    pixels = np.random.default_rng(3).integers(0, 255, (200, 200, 3), np.uint8)
    Image.fromarray(pixels).save(tmp_path / "one.png")
    square = np.array([(20, 20), (180, 20), (180, 180), (20, 180)], float)
    bent = square + [[50, 0], [0, 0], [0, 0], [0, 0]]
    photo = read_picture("egg", by_hand.names, [tmp_path / "one.png"] * 2, [square, bent])
    performance = perform(by_hand.motion(by_hand.tumble(2), [[1.0, 0], [0, 1.0]]), [photo])
    with pytest.raises(InputError, match=r"part 'egg': an animated SVG can hold vector drawings"):
        write_svg(performance, tmp_path / "photo.svg")
    assert not (tmp_path / "photo.svg").exists()
    write_svg_frames(performance, tmp_path / "drawings")
    for t in range(2):
        shown = over(_shown(tmp_path / "drawings" / f"{t:04d}.svg")).astype(int)
        assert np.abs(shown - over(draw(performance, t))).max() <= 1
        assert np.ptp(shown) > 200


def _shown(file):
    """The one image of an SVG on its page."""
    import base64
    import io

    root = ElementTree.parse(file).getroot()
    (image,) = root.iter(f"{SVG}image")
    png = Image.open(io.BytesIO(base64.b64decode(image.get("href").split(",")[1])))
    page = Image.new("RGBA", (int(root.get("width")), int(root.get("height"))))
    page.paste(png, (int(image.get("x")), int(image.get("y"))))
    assert png.size == (int(image.get("width")), int(image.get("height")))
    return np.array(page)
