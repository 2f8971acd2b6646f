"""Model files: written by hand here, so that what is read is known; and what cannot be read is refused in a sentence."""

import base64
import json
import struct

import numpy as np
import pytest
from PIL import Image

from capture.errors import InputError
from retarget.characters.models.meshfiles import read_model

TENT = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0.5, 1)])


def written(path, text):
    path.write_text(text, encoding="utf-8")
    return path


def gltf(path, arrays, **content):
    """A *.gltf of views and accessors, one for each (array, accessor's further fields), and further content."""
    binary, views, accessors = b"", [], []
    kinds = {"f": 5126, "u": {1: 5121, 2: 5123, 4: 5125}, "i": {1: 5120, 2: 5122}}
    shapes = {(): "SCALAR", (2,): "VEC2", (3,): "VEC3", (4,): "VEC4"}
    for values, more in arrays:
        binary += b"\0" * (-len(binary) % 4)
        values = np.ascontiguousarray(values)
        kind = kinds[values.dtype.kind]
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": values.nbytes})
        told = {"bufferView": len(views) - 1, "count": len(values), "type": shapes[values.shape[1:]]}
        told["componentType"] = kind if isinstance(kind, int) else kind[values.itemsize]
        accessors.append({**told, **more})
        binary += values.tobytes()
    uri = "data:application/octet-stream;base64," + base64.b64encode(binary).decode()
    whole = {"asset": {"version": "2.0"}, "buffers": [{"byteLength": len(binary), "uri": uri}]}
    whole |= {"bufferViews": views, "accessors": accessors, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}]}
    whole |= content
    if path.suffix == ".glb":
        del whole["buffers"][0]["uri"]
        text = json.dumps(whole).encode()
        text += b" " * (-len(text) % 4)
        chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
        path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)
    else:
        path.write_text(json.dumps(whole))
    return path


FACES = np.array([(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)])
PLAIN = [(TENT.astype(np.float32), {}), (FACES.astype(np.uint8).ravel(), {})]
MESH = {"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}


def test_an_obj_has_a_point_for_each_place_with_its_texture_place(tmp_path):
    Image.fromarray(np.full((2, 3, 3), 9, np.uint8)).save(tmp_path / "my skin-1.png")
    written(
        tmp_path / "a.mtl",
        "newmtl red\nKd 1 0.5 0\nd 0.5\nnewmtl photo # of a cow\nKd 0.1 0.1 0.1\nmap_Kd my skin-1.png\n",
    )
    text = "# a quad and a triangle\nmtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 2 2\n"
    text += "vt 0 0\nvt 1 0\nvt 1 1\nvt 0.25 1\nvt 0 0.75\nvn 0 0 1\nusemtl photo\nf 1/1/1 2/2/1 3/3/1 4/4/1\n"
    text += "usemtl red\nf -5/5/1 -3//1 \\\n -1//1\n"
    model = read_model(written(tmp_path / "a.obj", text))
    assert model.points.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 0], [1, 1, 0], [2, 2, 2]]
    assert model.faces.tolist() == [[0, 1, 2], [0, 2, 3], [4, 5, 6]]
    np.testing.assert_allclose(model.uv[:5], [(0, 1), (1, 1), (1, 0), (0.25, 0), (0, 0.25)])  # from the top
    looks = [model.materials[n] for n in model.surface]
    assert looks[0].texture.shape == (2, 3, 4) and looks[0].color == (1, 1, 1, 1)
    assert looks[2].texture is None and looks[2].color == (1, 0.5, 0, 0.5)


def test_obj_files_that_differ_in_their_normals_alone_correspond(tmp_path):
    head = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nvn 0 1 0\n"
    one = read_model(written(tmp_path / "one.obj", head + "f 1//1 2//1 3//1\nf 1//1 3//1 4//1\n"))
    two = read_model(written(tmp_path / "two.obj", head + "f 1//1 2//2 3//1\nf 1//2 3//2 4//1\n"))
    assert len(one.points) == 4
    np.testing.assert_array_equal(one.points, two.points)
    np.testing.assert_array_equal(one.faces, two.faces)


def test_an_obj_may_have_a_colour_at_each_place(tmp_path):
    model = read_model(written(tmp_path / "a.obj", "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 0.5\nf 1 2 3\n"))
    assert model.colors.tolist() == [[1, 0, 0, 1], [0, 1, 0, 1], [0, 0, 0.5, 1]]
    assert model.materials[0].color == (1, 1, 1, 1)


@pytest.mark.parametrize("suffix", [".gltf", ".glb"])
def test_a_gltf_file_is_read_in_both_its_forms(tmp_path, suffix):
    model = read_model(gltf(tmp_path / f"a{suffix}", PLAIN, meshes=[MESH]))
    np.testing.assert_array_equal(model.points, TENT)
    np.testing.assert_array_equal(model.faces, FACES)
    assert model.morphs == {}


def test_morph_targets_are_read_by_name_also_where_they_are_sparse(tmp_path):
    moved = np.zeros((5, 3), np.float32)
    moved[4] = [0, 0, 2]
    sparse = {"count": 2, "indices": {"bufferView": 3, "componentType": 5121}, "values": {"bufferView": 4}}
    arrays = [*PLAIN, (moved, {}), (np.array([1, 3], np.uint8), {}), (np.array([(1, 2, 3), (4, 5, 6)], np.float32), {})]
    mesh = {"primitives": [{**MESH["primitives"][0], "targets": [{"POSITION": 2}, {"POSITION": 5}, {"NORMAL": 2}]}]}
    mesh["extras"] = {"targetNames": ["taller", "aside"]}
    path = gltf(tmp_path / "a.gltf", arrays, meshes=[mesh])
    content = json.loads(path.read_text())
    content["accessors"].append({"componentType": 5126, "count": 5, "type": "VEC3", "sparse": sparse})
    path.write_text(json.dumps(content))
    model = read_model(path)
    assert list(model.morphs) == ["taller", "aside", "target 2"]
    np.testing.assert_array_equal(model.morphs["taller"], moved)
    np.testing.assert_array_equal(model.morphs["aside"], [(0, 0, 0), (1, 2, 3), (0, 0, 0), (4, 5, 6), (0, 0, 0)])
    assert not model.morphs["target 2"].any()


def test_nodes_place_meshes_and_their_morph_targets(tmp_path):
    """A quarter turn about z, twice as large, then carried by the node above."""
    moved = np.tile(np.array([[1, 0, 0]], np.float32), (5, 1))
    mesh = {"primitives": [{**MESH["primitives"][0], "targets": [{"POSITION": 2}]}]}
    half = np.sqrt(0.5)
    nodes = [
        {"children": [1], "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 10, 20, 30, 1]},
        {"mesh": 0, "rotation": [0, 0, half, half], "scale": [2, 2, 2], "translation": [1, 0, 0]},
    ]
    model = read_model(gltf(tmp_path / "a.gltf", [*PLAIN, (moved, {})], meshes=[mesh], nodes=nodes))
    x, y, z = TENT.T
    np.testing.assert_allclose(model.points, np.stack([11 - 2 * y, 20 + 2 * x, 30 + 2 * z], axis=-1), atol=1e-12)
    np.testing.assert_allclose(model.morphs["target 0"], np.tile([0, 2, 0], (5, 1)), atol=1e-12)


def test_a_mesh_with_a_skin_stays_where_it_was_bound(tmp_path):
    nodes = [{"mesh": 0, "skin": 0, "translation": [5, 5, 5]}]
    model = read_model(gltf(tmp_path / "a.gltf", PLAIN, meshes=[MESH], nodes=nodes, skins=[{"joints": [0]}]))
    np.testing.assert_array_equal(model.points, TENT)


def test_small_whole_numbers_stand_for_shares_of_one(tmp_path):
    uv = np.array([(0, 0), (255, 0), (255, 255), (0, 255), (51, 102)], np.uint8)
    colors = np.array([(65535, 0, 0)] * 4 + [(0, 65535, 13107)], np.uint16)
    arrays = [*PLAIN, (uv, {"normalized": True}), (colors, {"normalized": True})]
    mesh = {"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 2, "COLOR_0": 3}, "indices": 1}]}
    model = read_model(gltf(tmp_path / "a.gltf", arrays, meshes=[mesh]))
    np.testing.assert_allclose(model.uv[4], [0.2, 0.4])
    assert model.colors[4] == pytest.approx([0, 1, 0.4845, 1], abs=1e-3)  # 0.2 of the light, as sRGB


def test_strips_and_fans_become_triangles_that_all_face_one_way(tmp_path):
    flat = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0), (0, 2, 0), (1, 2, 0)], np.float32)
    for mode, order in ((5, [0, 1, 2, 3, 4, 5]), (6, [0, 1, 3, 5, 4, 2])):
        arrays = [(flat, {}), (np.array(order, np.uint16), {})]
        mesh = {"primitives": [{**MESH["primitives"][0], "mode": mode}]}
        model = read_model(gltf(tmp_path / "a.gltf", arrays, meshes=[mesh]))
        a, b, c = np.moveaxis(model.points[model.faces], 1, 0)
        areas = np.cross(b - a, c - a)[:, 2] / 2
        assert len(areas) == 4 and areas.min() >= 0 and areas.sum() == pytest.approx(2)


def test_each_primitive_keeps_its_own_material_and_picture(tmp_path):
    Image.fromarray(np.full((4, 4, 4), 77, np.uint8)).save(tmp_path / "skin.png")
    primitive = MESH["primitives"][0]
    mesh = {"primitives": [{**primitive, "material": 1}, {**primitive, "material": 0}, primitive]}
    materials = [
        {"pbrMetallicRoughness": {"baseColorFactor": [0.2140411, 0, 0, 0.5]}, "alphaMode": "BLEND"},
        {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}, "alphaMode": "MASK"},
    ]
    more = {"materials": materials, "textures": [{"source": 0}], "images": [{"uri": "skin.png"}]}
    model = read_model(gltf(tmp_path / "a.gltf", PLAIN, meshes=[mesh], **more))
    looks = [model.materials[model.surface[face]] for face in (0, 4, 8)]
    assert looks[0].texture[0, 0, 0] == 77 and looks[0].cut_out
    assert looks[1].color == pytest.approx((0.5, 0, 0, 0.5), abs=1e-4)
    assert looks[2].texture is None
    assert len(model.points) == 15 and model.faces.max() == 14


def test_a_texture_may_be_shifted_and_stretched_but_not_turned(tmp_path):
    Image.fromarray(np.full((4, 4, 4), 77, np.uint8)).save(tmp_path / "skin.png")
    uv = np.array([(0, 0), (1, 0), (1, 1), (0, 1), (0.5, 0.25)], np.float32)
    mesh = {"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_1": 2}, "indices": 1, "material": 0}]}

    def path(name, **moved):
        which = {"index": 0, "extensions": {"KHR_texture_transform": {"texCoord": 1, **moved}}}
        more = {"materials": [{"pbrMetallicRoughness": {"baseColorTexture": which}}], "textures": [{"source": 0}]}
        more["extensionsRequired"] = ["KHR_texture_transform"]
        return gltf(tmp_path / name, [*PLAIN, (uv, {})], meshes=[mesh], images=[{"uri": "skin.png"}], **more)

    model = read_model(path("a.gltf", offset=[0.1, 0.2], scale=[2, 4]))
    np.testing.assert_allclose(model.uv[4], [1.1, 1.2])
    with pytest.raises(InputError, match="must not be turned"):
        read_model(path("b.gltf", rotation=1.0))


PLY = """ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
property uchar red
property uchar green
property uchar blue
element face 1
property list uchar int vertex_indices
end_header
0 0 0 255 0 0
1 0 0 0 255 0
0 1 0 0 0 255
3 0 1 2
"""


def test_a_ply_has_the_colours_of_its_points(tmp_path):
    pytest.importorskip("trimesh", reason="trimesh, of the extra mesh, is not installed")
    model = read_model(written(tmp_path / "a.ply", PLY))
    np.testing.assert_allclose(model.points, [(0, 0, 0), (1, 0, 0), (0, 1, 0)])
    np.testing.assert_allclose(model.colors[:, :3], np.eye(3))
    assert model.faces.tolist() == [[0, 1, 2]]


def test_a_ply_without_the_library_is_refused_with_the_way_to_get_it(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "trimesh", None)
    with pytest.raises(InputError, match=r"need trimesh.*pip install tooncap\[mesh\]"):
        read_model(written(tmp_path / "a.ply", PLY))


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("a.obj", "", r"a\.obj must hold triangles, it has none"),
        ("a.obj", "v 0 0 0\nv 1 1 1\n", "must hold triangles"),
        ("a.obj", "v 0 0 0\nf 1 2 3\n", r"line 2 must be OBJ, 'f 1 2 3' is not"),
        ("a.obj", "v 0 zero 0\n", "line 1 must be OBJ"),
        ("a.obj", "v 0 0 nan\nv 0 0 1\nv 0 1 0\nf 1 2 3\n", "must be finite"),
        ("a.obj", "mtllib gone.mtl\n", r"'gone\.mtl' it names must lie beside it"),
        ("a.obj", "mtllib ../../secret.mtl\n", "must lie beside it"),
        ("a.gltf", "", "must be a glTF 2.0 file"),
        ("a.gltf", "{}", "must be a glTF 2.0 file"),
        ("a.gltf", '{"asset": {"version": "1.0"}}', "of version 1.0"),
        ("a.gltf", '{"asset": {"version": "2.0"}}', "must hold triangles"),
        (
            "a.gltf",
            '{"asset": {"version": "2.0"}, "extensionsRequired": ["KHR_draco_mesh_compression"]}',
            "requires KHR_draco",
        ),
        (
            "a.gltf",
            '{"asset": {"version": "2.0"}, "buffers": [{"uri": "http://example.org/a.bin"}]}',
            "must lie beside it",
        ),
        ("a.gltf", '{"asset": {"version": "2.0"}, "scenes": [{"nodes": [7]}]}', "missing or wrong"),
        ("a.glb", "glTF", "must be a glTF 2.0 file"),
        ("a.stl", "solid", r"must be a file ending in \.glb"),
    ],
)
def test_what_is_no_model_is_refused_in_a_sentence(tmp_path, name, text, said):
    with pytest.raises(InputError, match=said) as caught:
        read_model(written(tmp_path / name, text))
    assert name in str(caught.value) and "\n" not in str(caught.value)


def test_a_missing_picture_is_named(tmp_path):
    written(tmp_path / "a.mtl", "newmtl skin\nmap_Kd gone.png\n")
    with pytest.raises(InputError, match=r"a\.mtl: the file 'gone\.png' it names must lie beside it"):
        read_model(written(tmp_path / "a.obj", "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl skin\nf 1 2 3\n"))
    mesh = {"primitives": [{**MESH["primitives"][0], "material": 0}]}
    looks = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
    more = {"materials": looks, "textures": [{"source": 0}], "images": [{"uri": "gone.png"}]}
    with pytest.raises(InputError, match=r"a\.gltf: the file 'gone\.png'"):
        read_model(gltf(tmp_path / "a.gltf", PLAIN, meshes=[mesh], **more))
    more["images"] = [{"uri": "data:image/png;base64,AAAA"}]
    with pytest.raises(InputError, match=r"image 0 in it must be PNG or JPG"):
        read_model(gltf(tmp_path / "b.gltf", PLAIN, meshes=[mesh], **more))


def test_a_missing_file_and_faces_of_points_that_are_not_there_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"there is no .*gone\.glb"):
        read_model(tmp_path / "gone.glb")
    wrong = [PLAIN[0], (np.array([0, 1, 9], np.uint8), {})]
    with pytest.raises(InputError, match="one names point 10"):
        read_model(gltf(tmp_path / "a.glb", wrong, meshes=[MESH]))
