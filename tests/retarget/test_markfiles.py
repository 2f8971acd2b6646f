"""Marked joints are read as other programs wrote them."""

import cv2
import numpy as np
import pytest

from capture.errors import InputError
from retarget.characters.markfiles import _yaml, read_marked, write_marks

ANNOTATED = """height: 40
skeleton:
- loc:
  - 10
  - 20
  name: root
  parent: null
- loc:
  - 12
  - 9.5
  name: torso
  parent: root
- loc: [18, 10]
  name: 'left_shoulder'
  parent: torso
width: 30
"""
SVG = """<svg xmlns="http://www.w3.org/2000/svg" width="200" height="100" viewBox="0 0 100 50">
<rect id="coat" x="10" y="10" width="30" height="30" fill="#336699"/>
<g id="joints" visibility="hidden" transform="translate(5 0)">
<circle id="root" cx="20" cy="35" r="2"/><circle id="torso" cx="20" cy="15" r="2"/>
<circle id="left_shoulder" cx="30" cy="16" r="2"/>
<circle id="tail" cx="10" cy="36" r="2" data-parent="root"/></g></svg>"""


def _folder(tmp_path, text=ANNOTATED, mask=None):
    (tmp_path / "char_cfg.yaml").write_text(text, encoding="utf-8")
    texture = np.full((40, 30, 3), 180, np.uint8)
    cv2.imwrite(str(tmp_path / "texture.png"), texture)
    mask = np.pad(np.full((30, 20), 255, np.uint8), 5) if mask is None else mask
    cv2.imwrite(str(tmp_path / "mask.png"), mask)
    return tmp_path


def test_annotations_of_animated_drawings_are_read(tmp_path):
    read = read_marked(_folder(tmp_path))
    assert read.marks.names == ("root", "torso", "left_shoulder")
    assert read.marks.parents == (-1, 0, 1)
    np.testing.assert_array_equal(read.marks.places, [[10, 20], [12, 9.5], [18, 10]])
    assert read.pixels.shape == (40, 30, 4)
    np.testing.assert_array_equal(np.unique(np.argwhere(read.pixels[..., 3] > 0)[:, 1]), np.arange(5, 25))


def test_the_annotations_are_read_as_a_yaml_library_reads_them():
    yaml = pytest.importorskip("yaml", reason="PyYAML is not installed")
    assert _yaml(ANNOTATED) == yaml.safe_load(ANNOTATED)
    indented = (
        ANNOTATED.replace("\n- loc", "\n  - loc").replace("\n  - 1", "\n      - 1").replace("\n  name", "\n    name")
    )
    indented = (
        indented.replace("\n  parent", "\n    parent")
        .replace("\n  - 20", "\n      - 20")
        .replace("\n  - 9", "\n      - 9")
    )
    assert _yaml(indented) == yaml.safe_load(indented)


def test_circles_of_an_svg_are_joints_and_are_not_drawn(tmp_path):
    (tmp_path / "coat.svg").write_text(SVG, encoding="utf-8")
    read = read_marked(tmp_path / "coat.svg")
    assert dict(zip(read.marks.names, read.marks.parents)) == {
        "root": -1,
        "torso": 0,
        "left_shoulder": 1,
        "tail": 0,
    } or (
        {name: read.marks.names[up] if up >= 0 else "" for name, up in zip(read.marks.names, read.marks.parents)}
        == {"root": "", "torso": "root", "left_shoulder": "torso", "tail": "root"}
    )
    places = dict(zip(read.marks.names, read.marks.places.tolist()))
    assert places["root"] == pytest.approx([50, 70]) and places["tail"] == pytest.approx([30, 72])
    assert len(read.paths) == 1


def test_marks_beside_a_photograph_are_read_and_it_is_cut_out(tmp_path):
    photo = np.full((120, 100, 3), (70, 160, 90), np.uint8)
    cv2.ellipse(photo, (50, 60), (25, 45), 0, 0, 360, (40, 60, 210), -1)
    cv2.imwrite(str(tmp_path / "egg.jpg"), photo)
    text = 'drawing = "egg.jpg"\nbox = [15, 5, 70, 110]\n[joints]\nroot = [50, 90]\ntorso = [50, 40]\n'
    (tmp_path / "egg.marks.toml").write_text(text + 'wing = { at = [30, 60.5], parent = "torso" }\n')
    read = read_marked(tmp_path / "egg.marks.toml")
    assert read.marks.names == ("root", "torso", "wing") and read.marks.parents == (-1, 0, 1)
    np.testing.assert_allclose(read.marks.places[2], [30, 60.5])
    assert read.pixels[60, 50, 3] == 255 and read.pixels[5, 5, 3] == 0


def test_marks_written_and_read_are_the_same(tmp_path):
    (tmp_path / "coat.svg").write_text(SVG, encoding="utf-8")
    first = read_marked(tmp_path / "coat.svg")
    write_marks(first.marks, "coat.svg", tmp_path / "coat.marks.toml")
    again = read_marked(tmp_path / "coat.marks.toml")
    assert (again.marks.names, again.marks.parents) == (first.marks.names, first.marks.parents)
    np.testing.assert_array_equal(again.marks.places, first.marks.places)
    assert len(again.paths) == 1


@pytest.mark.parametrize(
    "text",
    [
        'drawing = "egg.jpg"',
        "drawing = 3\n[joints]\nroot = [1, 2]\ntorso = [3, 4]",
        'drawing = "egg.jpg"\n[joints]\nroot = [1]\ntorso = [3, 4]',
        'drawing = "egg.jpg"\nbox = [1, 2]\n[joints]\nroot = [1, 2]\ntorso = [3, 4]',
        "drawing =",
    ],
)
def test_broken_marks_are_refused_in_one_sentence(tmp_path, text):
    (tmp_path / "egg.marks.toml").write_text(text)
    with pytest.raises(InputError, match="must name a drawing and its joints"):
        read_marked(tmp_path / "egg.marks.toml")


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("skeleton:\n- name: root\n  parent: null\n", "cannot be read"),
        ("nonsense", "cannot be read"),
        (ANNOTATED.replace("parent: null", "parent: torso"), "circle"),
        (ANNOTATED.replace("- 9.5", "- 9.5\n  - 3"), "two numbers"),
        (ANNOTATED.replace("parent: root", "parent: null").replace("torso\n  parent", "fin\n  parent"), "hang on"),
    ],
)
def test_broken_annotations_are_refused_in_one_sentence(tmp_path, text, told):
    with pytest.raises(InputError, match=told):
        read_marked(_folder(tmp_path, text))


def test_a_mask_of_another_size_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"as large as texture\.png"):
        read_marked(_folder(tmp_path, mask=np.full((20, 20), 255, np.uint8)))


def test_an_svg_without_marks_and_a_file_that_is_no_drawing_are_refused(tmp_path):
    (tmp_path / "coat.svg").write_text(SVG.replace('id="joints"', 'id="dots"'), encoding="utf-8")
    with pytest.raises(InputError, match="circles with ids"):
        read_marked(tmp_path / "coat.svg")
    with pytest.raises(InputError, match=r"char_cfg\.yaml, it cannot be read|there is no"):
        read_marked(tmp_path)
    with pytest.raises(InputError, match="neither"):
        read_marked(tmp_path / "coat.png")
