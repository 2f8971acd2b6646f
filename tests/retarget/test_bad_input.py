"""Bad input, through the command as users meet it: one sentence that names the file, nothing fetched, nothing left."""

import base64
import json
import struct
from time import thread_time

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from capture.errors import InputError
from retarget.characters.casts import castfile
from retarget.characters.drawings import paths, svg, svgfile
from retarget.characters.models import meshfiles

NOWHERE = "http://127.0.0.1:9/"
HEAD = '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" width="100" height="100">'
SQUARE = '<path d="M20 20H80V80H20Z" fill="#cc2222"/>'
TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


def written(path, content):
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


@pytest.mark.parametrize(
    ("inside", "note"),
    [
        ("<script>alert(1)</script>", "scripts are left out"),
        ('<rect width="9" height="9" onclick="steal()"/>', "scripts are left out"),
        (f'<image href="{NOWHERE}a.png" width="9" height="9"/>', "<image> is not drawn"),
        (f'<use href="{NOWHERE}a.svg#b"/>', f"{NOWHERE}a.svg#b is left out: nothing outside"),
        ('<use xlink:href="beside.svg#b"/>', "beside.svg#b is left out: nothing outside"),
        (f'<style>@import url("{NOWHERE}a.css"); path {{ stroke: red }}</style>', "a.css"),
        (f'<rect width="9" height="9" fill="url({NOWHERE}a.svg#g) green"/>', "a.svg#g is left out: nothing outside"),
        (f'<linearGradient id="g" href="{NOWHERE}a.svg#g"/>', "a.svg#g is left out: nothing outside"),
        (f'<foreignObject><iframe src="{NOWHERE}"/></foreignObject>', "<foreignObject> is not drawn"),
    ],
)
def test_scripts_and_what_lies_outside_are_left_out_of_an_svg_and_that_is_said(lent, tmp_path, inside, note):
    file = written(tmp_path / "odd.svg", f"{HEAD}{inside}{SQUARE}</svg>")
    code, said = lent("--drawing", file)
    assert code == 0 and "odd.svg" in said and note in said
    drawn = (tmp_path / "made" / "new.svg").read_text()
    assert "#cc2222" in drawn
    assert not any(word in drawn for word in ("script", "onclick", "127.0.0.1", "beside.svg"))


ENTITIES = "".join(f'<!ENTITY {b} "{f"&{a};" * 10}">' for a, b in zip("abcdefgh", "bcdefghi"))
USES = "".join(f'<g id="g{n + 1}">' + f'<use href="#g{n}"/>' * 10 + "</g>" for n in range(7))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "not well-formed"),
        (f"{HEAD}</svg>", "at least one shape"),
        (f"{HEAD}{SQUARE}", "not well-formed"),
        (f'<!DOCTYPE svg [<!ENTITY a "aaaaaaaaaa">{ENTITIES}]>{HEAD}<desc>&i;</desc>{SQUARE}</svg>', "amplification"),
        (f'<!DOCTYPE svg [<!ENTITY x SYSTEM "file:///etc/hostname">]>{HEAD}<desc>&x;</desc></svg>', "undefined entity"),
        ('<?xml version="1.0" encoding="martian"?><svg/>', "unknown encoding"),
        (f'{HEAD}<g id="a"><use href="#a"/></g>{SQUARE}</svg>', "no <use> of what that <use> is in"),
        (f'{HEAD}<g id="a"><use href="#b"/></g><g id="b"><use href="#a"/></g></svg>', "no <use> of what"),
        (f'{HEAD}<g id="g0">{SQUARE}</g>{USES}</svg>', "at most 20000 curves"),
        (f"{HEAD}{'<g>' * 30_000}{SQUARE}{'</g>' * 30_000}</svg>", "groups at most 200 deep"),
        (f'{HEAD}<path d="M0 0L1e40 0V9Z"/></svg>', "must lie within"),
        (f'{HEAD}<rect x="1e308" y="1e308" width="1e308" height="1e308"/></svg>', "must lie within"),
        (f'{HEAD}<path d="M0 0L9 0Z"/></svg>', "must paint an area"),
    ],
    ids=range(13),
)
def test_an_svg_that_cannot_be_played_is_refused(lent, tmp_path, text, said):
    code, told = lent("--drawing", written(tmp_path / "odd.svg", text))
    assert code == 2 and said in told


def test_a_path_of_a_million_commands_is_refused_before_it_is_looked_at(lent, tmp_path):
    lines = "L20 20L80 20L80 80L20 80" * 250_000
    file = written(tmp_path / "odd.svg", f'{HEAD}<path d="M0 0{lines}Z"/></svg>')
    start = thread_time()
    code, said = lent("--drawing", file)
    assert code == 2 and "at most 20000 curves" in said and "1000002" in said
    assert thread_time() - start < 10


def test_a_scribble_that_crosses_itself_ten_thousand_times_is_learnt_quickly(tmp_path):
    corners = np.random.default_rng(0).uniform(0, 100, (200, 2))
    lines = "".join(f"L{x:.1f} {y:.1f}" for x, y in corners)
    (path,), _ = svg.read_svg(written(tmp_path / "odd.svg", f'{HEAD}<path d="M50 50{lines}Z"/></svg>'))
    start = thread_time()
    assert paths.painted(path).area > 5000
    assert thread_time() - start < 3


def test_as_many_curves_as_are_counted_are_there(tmp_path):
    inside = '<g id="a"><path d="M0 0L9 0 9 9H2V3C1 2 3 4 5 6S7 8 9 9Q1 2 3 4T5 6Z"/></g>' + '<use href="#a"/>' * 3
    file = written(tmp_path / "few.svg", f"{HEAD}{inside}</svg>")
    drawn, _ = svg.read_svg(file)
    there = sum((len(path.points) - len(path.closed)) // 3 for path in drawn)
    assert there == 4 * 9
    root, _ = svgfile.open_svg(file)
    assert sum(svgfile._curves(element) for element in root.iter()) == 9 + 1  # the move too


def test_keys_of_different_point_counts_are_refused(lent, tmp_path):
    written(tmp_path / "a_sit.obj", TRIANGLE)
    written(tmp_path / "a_lean.obj", "v 1 1 0\n" + TRIANGLE + "f 2 3 4\n")
    code, said = lent("--drawing", tmp_path / "a_sit.obj", "--drawing", tmp_path / "a_lean.obj", keys=2, out="new.glb")
    assert code == 2 and "a_lean.obj must be the same mesh as" in said
    written(tmp_path / "b_sit.svg", f"{HEAD}{SQUARE}</svg>")
    written(tmp_path / "b_lean.svg", f'{HEAD}<path d="M20 20H80V80Z" fill="#cc2222"/></svg>')
    code, said = lent("--drawing", tmp_path / "b_sit.svg", "--drawing", tmp_path / "b_lean.svg", keys=2)
    assert code == 2 and "b_lean.svg must hold the same elements as" in said


def test_a_mesh_that_is_no_surface_is_played_all_the_same(lent, tmp_path):
    text = "v 0 0 1\nv 0 0 -1\n" + TRIANGLE + "f 3 4 1\nf 3 4 2\nf 4 3 5\nf 3 3 4\n"  # four faces on one edge
    assert lent("--drawing", written(tmp_path / "a.obj", text), out="new.glb")[0] == 0
    assert lent("--drawing", tmp_path / "a.obj", out="frames")[0] == 0


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("v nan 0 0\n" + TRIANGLE + "f 1 2 3\n", "must be finite"),
        ("v 1e200 0 0\n" + TRIANGLE, "must be finite"),
        ("vt nan 0\n" + TRIANGLE + "f 1/1 2/1 3/1\n", "must be finite"),
        (TRIANGLE + "f 1 2 99999999999999999999\n", "there is no number 99999999999999999999"),
        (TRIANGLE + "f 0 1 2\n", "there is no number 0"),
        ("v 1 2\n" + TRIANGLE, "line 1 must be OBJ"),
        ("mtllib\n" + TRIANGLE, "it names must lie beside it"),
        ("mtllib bad.mtl\n" + TRIANGLE, "bad.mtl: line 2 must be MTL"),
        ("mtllib far.mtl\nusemtl a\n" + TRIANGLE, "must lie beside it"),
        ("v 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2 3\n", "no width or height"),
        (bytes(range(256)).decode("latin-1"), "must hold triangles"),
    ],
    ids=range(11),
)
def test_an_obj_that_cannot_be_played_is_refused(lent, tmp_path, text, said):
    written(tmp_path / "bad.mtl", "newmtl a\nKd red green blue\n")
    written(tmp_path / "far.mtl", f"newmtl a\nmap_Kd {NOWHERE}a.png\n")
    code, told = lent("--drawing", written(tmp_path / "a.obj", text), out="new.glb")
    assert code == 2 and said in told


def test_a_ply_of_points_only_is_refused(lent, tmp_path):
    pytest.importorskip("trimesh")
    head = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
    code, said = lent("--drawing", written(tmp_path / "a.ply", head + "0 0 0\n1 0 0\n0 1 0\n"), out="new.glb")
    assert code == 2 and "a.ply must hold triangles, it has none" in said


def gltf(**changes):
    """The JSON of a textured triangle, with changes."""
    data = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4").tobytes()
    uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    content = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {}}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": len(data)}],
        "buffers": [{"byteLength": len(data), "uri": uri}],
    }
    return json.dumps(content | changes)


def textured(image, **texture):
    look = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
    return {"materials": [look], "textures": [texture or {"source": 0}], "images": [image]}


def required(name):
    return {"extensionsUsed": [name], "extensionsRequired": [name]}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (required("KHR_draco_mesh_compression"), "requires KHR_draco_mesh_compression"),
        (required("EXT_meshopt_compression"), "requires EXT_meshopt_compression"),
        (required("KHR_texture_basisu"), "requires KHR_texture_basisu"),
        (textured({"uri": "a.ktx2"}, extensions={"KHR_texture_basisu": {"source": 0}}), "must be PNG or JPG"),
        (textured({"uri": "gone.png"}), "a.gltf: the file 'gone.png' it names must lie beside it"),
        (textured({"uri": NOWHERE + "a.png"}), "must lie beside it"),
        (textured({"uri": "../2.motion.json"}), "must lie beside it"),
        ({"buffers": [{"byteLength": 36, "uri": NOWHERE}]}, "must lie beside it"),
        ({"buffers": "many"}, "must be a glTF 2.0 file"),
        ({"buffers": [{"uri": 5}]}, "must be a glTF 2.0 file"),
        ({"extensionsRequired": 5}, "must be a glTF 2.0 file"),
        ({"nodes": "many"}, "missing or wrong"),
        ({"accessors": [{"componentType": 5126, "count": 10**12, "type": "VEC3"}]}, "without content"),
        (
            {"accessors": [{"bufferView": 0, "componentType": 5126, "count": 10**12, "type": "VEC3"}]},
            "missing or wrong",
        ),
        ({"nodes": [{"mesh": 0, "scale": [0, 0, 0]}]}, "no width or height"),
    ],
    ids=range(15),
)
def test_a_gltf_that_cannot_be_played_is_refused(lent, tmp_path, changes, said):
    code, told = lent("--drawing", written(tmp_path / "a.gltf", gltf(**changes)), out="new.glb")
    assert code == 2 and said in told and told.count("tooncap:") == 1 and "InputError" not in told


def test_a_gltf_of_endless_brackets_is_refused(lent, tmp_path):
    code, said = lent("--drawing", written(tmp_path / "a.gltf", "[" * 100_000), out="new.glb")
    assert code == 2 and "must be a glTF 2.0 file" in said


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ("pivot = [nan, 1.0]", "pivot must be finite"),
        ("box = [0, 0, 5, 5]", "box cuts out photographs"),
        ("height = 1e300", "height must be above 0 and at most 1000"),
        ("height = nan", "height must be above 0"),
        ("drawing = 5", "cast.toml"),
        ("name = 'egg'", "cast.toml"),
    ],
)
def test_a_cast_of_impossible_numbers_is_refused(lent, tmp_path, worm, fields, said):
    text = f'[[parts]]\nname = "egg"\ndrawing = "{worm[0].name}"\n{fields}\n'
    code, told = lent("--cast", written(tmp_path / "a.cast.toml", text))
    assert code == 2 and "a.cast.toml" in told and said in told


@pytest.mark.parametrize("flag", ["--soften", "--match", "--shadow"])
@pytest.mark.parametrize("value", ["nan", "-1", "inf"])
def test_flags_of_impossible_numbers_are_refused(lent, worm, flag, value):
    code, said = lent("--drawing", worm[0], "--background", "white", f"{flag}={value}", out="frames")
    assert code == 2 and f"{flag[2:]} must lie in 0 to" in said


def readable(kind, reader, content, folder):
    """Whether a file is read; whatever is not is refused, and anything but that fails the test."""
    try:
        reader(written(folder / f"a{kind}", content))
    except InputError as error:
        assert "\n" not in str(error)
        return False
    return True


def samples(by_hand):
    """A sound file of each kind, and who reads it."""
    binary = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4").tobytes()
    content = json.loads(gltf(buffers=[{"byteLength": len(binary)}]))
    text = json.dumps(content).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    cast = (
        '[[parts]]\nname = "egg"\nheight = 1.5\npivot = [1.0, 2.0]\n\n[[parts.keys]]\nname = "sit"\ndrawing = "a.svg"\n'
    )
    return {
        ".glb": (struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks, meshfiles.read_model),
        ".gltf": (gltf().encode(), meshfiles.read_model),
        ".obj": (("vt 0 1\n" + TRIANGLE + "usemtl a\nf 1/1 3//2 2/1/1\n").encode(), meshfiles.read_model),
        ".svg": (by_hand.worm_svg().encode(), svg.read_svg),
        ".cast.toml": (cast.encode(), castfile.read_cast),
    }


@pytest.mark.parametrize("kind", [".glb", ".gltf", ".obj", ".svg", ".cast.toml"])
def test_a_file_cut_short_or_with_a_wrong_byte_is_read_or_refused(kind, by_hand, tmp_path_factory):
    whole, reader = samples(by_hand)[kind]
    folder = tmp_path_factory.mktemp("cut")
    assert readable(kind, reader, whole, folder)

    @settings(max_examples=60, deadline=None, derandomize=True)
    @given(st.integers(0, len(whole) - 1), st.integers(0, 255))
    @example(0, 0)
    def cut(at, byte):
        readable(kind, reader, whole[:at], folder)
        readable(kind, reader, whole[:at] + bytes([byte]) + whole[at + 1 :], folder)

    cut()
