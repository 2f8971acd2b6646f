"""A GLB read back by a small reader of its own, written from the glTF specification, plays the role's own points."""

import base64
import io
import json
import struct
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image
from scipy import sparse
from scipy.spatial.transform import Rotation

from capture.errors import InputError
from capture.motion import affine
from capture.motion.triangulate import locate
from retarget.characters.drawings.drawing import read_drawing
from retarget.characters.photos.picture import read_picture
from retarget.export import gltf
from retarget.export.bodies import Body, bodies, stage_to_space
from retarget.stage.perform import Performance, perform

TYPES = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


class Read:
    """A glTF file, evaluated by the specification's sections on morph targets, nodes and animations."""

    def __init__(self, path):
        whole = path.read_bytes()
        if path.suffix == ".gltf":
            self.json = json.loads(whole)
            self.binary = base64.b64decode(self.json["buffers"][0]["uri"].split(",")[1])
            return
        magic, version, length = struct.unpack("<4sII", whole[:12])
        assert (magic, version, length) == (b"glTF", 2, len(whole))
        size, kind = struct.unpack("<I4s", whole[12:20])
        assert kind == b"JSON"
        self.json = json.loads(whole[20 : 20 + size])
        self.binary = whole[28 + size :]
        assert struct.unpack("<I4s", whole[20 + size : 28 + size]) == (len(self.binary), b"BIN\0")

    def array(self, number):
        accessor = self.json["accessors"][number]
        view = self.json["bufferViews"][accessor["bufferView"]]
        dtype = {5126: "<f4", 5123: "<u2", 5125: "<u4"}[accessor["componentType"]]
        count = accessor["count"] * TYPES[accessor["type"]]
        values = np.frombuffer(self.binary, dtype, count, view["byteOffset"])
        return values.reshape(accessor["count"], -1).astype(float)

    def channel(self, node, path):
        """Times, values and interpolation of what animates a node's path, or None."""
        for animation in self.json.get("animations", ()):
            for channel in animation["channels"]:
                if channel["target"] == {"node": node, "path": path}:
                    sampler = animation["samplers"][channel["sampler"]]
                    return self.array(sampler["input"])[:, 0], self.array(sampler["output"]), sampler["interpolation"]
        return None

    def value(self, node, path, rest, time):
        channel = self.channel(node, path)
        if channel is None:
            return np.array(rest, float)
        times, values, interpolation = channel
        values = values.reshape(len(times), -1)
        if interpolation == "STEP":
            return values[max(np.searchsorted(times, time, side="right") - 1, 0)]
        return np.array([np.interp(time, times, column) for column in values.T])  # at key times a turn needs no slerp

    def world(self, number, time):
        """Meshes below a node at a time: (node number, points), by T R S from the inside out."""
        node = self.json["nodes"][number]
        inner = [self.world(child, time) for child in node.get("children", ())]
        found = [pair for pairs in inner for pair in pairs]
        if "mesh" in node:
            found.append((number, self.shape(number, time)))
        move = self.value(number, "translation", node.get("translation", [0, 0, 0]), time)
        turn = self.value(number, "rotation", node.get("rotation", [0, 0, 0, 1]), time)
        size = self.value(number, "scale", node.get("scale", [1, 1, 1]), time)
        return [(name, Rotation.from_quat(turn).apply(points * size) + move) for name, points in found]

    def shape(self, number, time):
        mesh = self.json["meshes"][self.json["nodes"][number]["mesh"]]
        primitive = mesh["primitives"][0]
        points = self.array(primitive["attributes"]["POSITION"])
        weights = self.value(number, "weights", mesh.get("weights", []), time)
        for weight, target in zip(weights, primitive.get("targets", ()), strict=True):
            points = points + weight * self.array(target["POSITION"])
        return points

    def points(self, time):
        """Where the vertices of every mesh are at a time, part by part."""
        parts = self.json["scenes"][0]["nodes"]
        return [points for part in parts for _, points in self.world(part, time)]


def frame_times(performance):
    return np.float32(performance.times - performance.times[0]).tolist()


def on_stage(performance, points):
    """Vertices of a file (V, 3) back in stage pixels (V, 2)."""
    return affine.apply(affine.invert(stage_to_space(performance.size)), points[:, :2])


@pytest.fixture
def picture(tmp_path, by_hand):
    """A picture with a bent outline for the egg's second key, so that weights bend it."""
    file = tmp_path / "plain.png"
    Image.new("RGB", (200, 200), (40, 90, 200)).save(file)
    side = np.linspace(20, 180, 9)[:-1]
    edge = np.full(8, 20.0)
    ring = [(side, edge), (edge + 160, side), (200 - side, edge + 160), (edge, 200 - side)]
    square = np.concatenate([np.column_stack(pair) for pair in ring])

    def of(names, by=40.0):
        return read_picture("egg", names, [file] * 2, [square, by_hand.lean(square, by)])

    return of


def wild(by_hand, frames=8):
    """A motion with weights below 0 and above 1, with in-betweens, with shear, and mirrored at its end."""
    rng = np.random.default_rng(4)
    weights = rng.uniform(-0.4, 1.3, (frames, 7))
    weights[:, 0] += 1 - weights.sum(axis=1)
    maps = by_hand.tumble(frames)
    maps[:, 0, 1] += np.linspace(0, 0.7, frames)
    maps[-2:, :, 0] *= -1
    return by_hand.motion(maps, weights)


@pytest.mark.parametrize("suffix", [".glb", ".gltf"])
def test_a_picture_read_back_is_the_roles_own_mesh(tmp_path, by_hand, picture, suffix):
    performance = perform(wild(by_hand), [picture(by_hand.names)])
    gltf.write_glb(performance, tmp_path / f"egg{suffix}")
    read = Read(tmp_path / f"egg{suffix}")
    mesh = performance.roles[0].mesh()
    for t, time in enumerate(frame_times(performance)):
        (points,) = read.points(time)
        assert np.abs(on_stage(performance, points) - mesh[t]).max() < 1e-4 * np.ptp(mesh[t], axis=0).max()
        np.testing.assert_allclose(points[:, 2], 0, atol=1e-7)


def test_stored_weights_stay_between_0_and_1_and_the_raw_ones_are_told(tmp_path, by_hand, picture):
    motion = wild(by_hand)
    gltf.write_glb(perform(motion, [picture(by_hand.names)]), tmp_path / "egg.glb")
    read = Read(tmp_path / "egg.glb")
    mesh = read.json["meshes"][0]
    stored = np.concatenate([read.channel(n, "weights")[1] for n in range(3) if read.channel(n, "weights")])
    stored = stored.reshape(-1, len(mesh["weights"]))
    assert stored.min() >= 0 and stored.max() <= 1
    assert mesh["weights"] == pytest.approx(stored[0])
    low, high = np.array(mesh["extras"]["targetRanges"]).T
    names = mesh["extras"]["targetNames"]
    assert names == ["lean", *(f"sit to lean {percent}%" for percent in (17, 33, 50, 67, 83))]
    np.testing.assert_allclose(low + stored[:-1] * (high - low), motion.tracks[0].weights[:, 1:], atol=1e-6)
    np.testing.assert_allclose(mesh["extras"]["key_weights"], motion.tracks[0].key_weights(), atol=1e-6)


def test_shapes_that_no_frame_uses_are_left_out(tmp_path, by_hand, picture):
    motion = by_hand.motion(by_hand.tumble(3), [[1, 0, 0, 0], [0.6, 0, 0, 0.4], [0.5, 0, 0, 0.5]])
    gltf.write_glb(perform(motion, [picture(by_hand.names)]), tmp_path / "egg.glb")
    assert Read(tmp_path / "egg.glb").json["meshes"][0]["extras"]["targetNames"] == ["sit to lean 33%"]
    still = by_hand.motion(by_hand.tumble(3), [[0.25, 0.75]] * 3)
    gltf.write_glb(perform(still, [picture(by_hand.names)]), tmp_path / "still.glb")
    assert "targets" not in Read(tmp_path / "still.glb").json["meshes"][0]["primitives"][0]


def test_a_drawing_with_all_weight_on_a_key_lies_where_that_key_was_drawn(tmp_path, by_hand, worm):
    """Each element is a piece of the mesh, in order: its curves' ends go with it from the first key to the second."""
    motion = by_hand.motion(by_hand.still(2), [[1, 0], [0, 1]])
    drawing = read_drawing("egg", by_hand.names, worm)
    performance = perform(motion, [drawing])
    gltf.write_glb(performance, tmp_path / "worm.glb")
    read = Read(tmp_path / "worm.glb")
    before, after = (on_stage(performance, read.points(time)[0]) for time in frame_times(performance))
    faces = read.array(read.json["meshes"][0]["primitives"][0]["indices"]).astype(int).reshape(-1, 3)
    joined = sparse.coo_matrix((np.ones(len(faces)), (faces[:, 0], faces[:, 1])), (len(before),) * 2)
    joined += sparse.coo_matrix((np.ones(len(faces)), (faces[:, 1], faces[:, 2])), (len(before),) * 2)
    _, piece = sparse.csgraph.connected_components(joined, directed=False)
    role = performance.roles[0]
    start = drawing.keys.points.shape[1]
    assert piece.max() + 1 == len(drawing.paths)
    for number, versions in enumerate(drawing.paths):
        ends = start + np.arange(0, len(versions[0].points), 3)
        start += len(versions[0].points)
        if len(versions[0].starts) > 2:
            continue  # a ring's second subpath has its ends elsewhere
        own = faces[piece[faces[:, 0]] == number]
        face, shares = locate(role.points[0, ends], before, own)
        found = np.einsum("pc,pcx->px", shares, after[own[face]])
        assert np.abs(found - role.points[1, ends]).max() < 0.3  # pixels


def test_a_speck_far_from_the_rest_of_its_element_is_meshed_and_an_empty_element_is_none(tmp_path, by_hand):
    """One path of a large square and a speck; after it a path that paints nothing."""
    paths = "M100 100 L200 100 L200 200 L100 200 Z M40 40 L41 40 L41 41 L40 41 Z"
    (tmp_path / "dot.svg").write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" width="320" height="240"><path d="{paths}" fill="red"/>'
        '<path d="M100 100 L150 100 Z" fill="blue"/></svg>',
        encoding="utf-8",
    )
    target = read_drawing("egg", ("sit",), [tmp_path / "dot.svg"])
    performance = perform(by_hand.motion(by_hand.still(), [[1.0]], names=("sit",)), [target])
    (body,) = bodies(performance)
    (look,) = body.looks
    used = body.shapes[0][np.unique(body.faces), :2] * 240
    assert np.ptp(used, axis=0).min() > 100  # the character is as tall as the egg, from the speck to the square's foot
    red = (look.texture[..., 3] > 200) & (look.texture[..., 0] == 255)
    assert red.any() and not (look.texture[..., 2] > 0).any()


def test_parts_lie_in_drawn_order_and_hide_when_they_are_not_seen(tmp_path, by_hand, picture):
    egg = by_hand.motion(by_hand.still(4), [[1.0, 0]] * 4, order=np.array([0, 0, 2, 2]))
    lid = by_hand.motion(
        by_hand.still(4), [[1.0, 0]] * 4, part="lid", order=np.ones(4, int), visible=np.array([1, 0, 0, 1], bool)
    )
    motion = replace(egg, tracks=egg.tracks + lid.tracks, keysets=egg.keysets + lid.keysets)
    target = picture(by_hand.names)
    performance = perform(motion, [target, replace(target, part="lid")])
    gltf.write_glb(performance, tmp_path / "two.glb")
    read = Read(tmp_path / "two.glb")
    for t, time in enumerate(frame_times(performance)):
        below, above = read.points(time)
        assert (below[0, 2] < above[0, 2]) == (t < 2)
        assert np.ptp(below, axis=0).max() > 0.1
        assert (np.ptp(above, axis=0).max() > 0.1) == (t in (0, 3))


def test_a_part_on_twos_is_played_in_steps_and_one_on_ones_smoothly(tmp_path, by_hand, picture):
    ones, twos = by_hand.tumble(9), np.repeat(by_hand.tumble(5), 2, axis=0)[:9]
    paused = np.concatenate([np.repeat(ones[:1], 20, axis=0), ones, np.repeat(ones[-1:], 20, axis=0), ones[::-1]])
    for maps, way in ((ones, "LINEAR"), (twos, "STEP"), (paused, "LINEAR")):
        motion = by_hand.motion(maps, [[1.0, 0]] * len(maps))
        performance = perform(motion, [picture(by_hand.names)])
        gltf.write_glb(performance, tmp_path / "egg.glb")
        read = Read(tmp_path / "egg.glb")
        samplers = read.json["animations"][0]["samplers"]
        assert {sampler["interpolation"] for sampler in samplers} == {way}
        mesh = performance.roles[0].mesh()
        for t, time in enumerate(frame_times(performance)):
            assert np.abs(on_stage(performance, read.points(time)[0]) - mesh[t]).max() < 0.01
        if way == "STEP":
            drawings = {len(read.array(sampler["input"])) for sampler in samplers}
            assert max(drawings) <= 6  # a key for each of the 5, and the end
            # half a frame later the drawing is still the same
            (later,) = read.points(frame_times(performance)[3] + 0.5 / 24)
            assert np.abs(on_stage(performance, later) - mesh[3]).max() < 0.01


def test_a_drawing_held_on_twos_may_travel_smoothly(tmp_path, by_hand, picture):
    weights = np.repeat([[1, 0], [0.6, 0.4], [0.1, 0.9], [0.5, 0.5]], 2, axis=0)
    gltf.write_glb(perform(by_hand.motion(by_hand.tumble(8), weights), [picture(by_hand.names)]), tmp_path / "egg.glb")
    read = Read(tmp_path / "egg.glb")
    (animation,) = read.json["animations"]
    ways = {
        (channel["target"]["path"], animation["samplers"][channel["sampler"]]["interpolation"])
        for channel in animation["channels"]
    }
    assert ways >= {("weights", "STEP"), ("translation", "LINEAR")} and len(ways) == len(dict(ways))


def test_a_photograph_without_alpha_is_kept_as_jpeg(tmp_path, by_hand):
    noise = np.random.default_rng(1).normal(0, 6, (200, 200, 1))
    y, x = np.mgrid[:200, :200]
    pixels = np.stack([x, y, 200 - x], axis=-1) + noise
    Image.fromarray(pixels.clip(0, 255).astype(np.uint8)).save(tmp_path / "photo.png")
    square = np.array([(20, 20), (180, 20), (180, 180), (20, 180)], float)
    target = read_picture("egg", ("sit",), [tmp_path / "photo.png"], [square])
    gltf.write_glb(perform(by_hand.motion(by_hand.still(), [[1.0]], names=("sit",)), [target]), tmp_path / "egg.glb")
    read = Read(tmp_path / "egg.glb")
    (image,) = read.json["images"]
    view = read.json["bufferViews"][image["bufferView"]]
    stored = Image.open(io.BytesIO(read.binary[view["byteOffset"] :][: view["byteLength"]]))
    assert (image["mimeType"], stored.format) == ("image/jpeg", "JPEG")
    assert "alphaMode" not in read.json["materials"][0]
    assert np.abs(np.array(stored, float) - pixels.clip(0, 255)[18:183, 18:183]).mean() < 4


def test_the_last_drawing_stays_for_a_frame_so_that_a_loop_keeps_its_beat(tmp_path, by_hand, picture):
    motion = by_hand.motion(by_hand.tumble(6), [[1.0, 0]] * 6)
    later = replace(motion, times=motion.times + 2)  # a clip may start at any time, a file starts at 0
    gltf.write_glb(perform(later, [picture(by_hand.names)]), tmp_path / "egg.glb")
    read = Read(tmp_path / "egg.glb")
    for sampler in read.json["animations"][0]["samplers"]:
        times = read.array(sampler["input"])[:, 0]
        assert times[0] == 0 and times[-1] == pytest.approx(6 / 24)


def test_points_staged_one_by_one_come_back_too(tmp_path, by_hand, picture):
    """Where the stage has bent a role after it was mixed, no map and no key says how; its points do."""
    performance = perform(wild(by_hand), [picture(by_hand.names)])
    role = performance.roles[0]
    swing = np.linspace(0, 1, len(role.points))[:, None] * np.sin(role.points[..., 1] / 20)
    bent = role.points + np.stack([9 * swing, 0 * swing], axis=-1)
    performance = replace(performance, roles=(replace(role, points=bent),))
    gltf.write_glb(performance, tmp_path / "egg.glb")
    read = Read(tmp_path / "egg.glb")
    for t, time in enumerate(frame_times(performance)):
        off = np.abs(on_stage(performance, read.points(time)[0]) - bent[t]).max()
        assert off < 1e-4 * np.ptp(bent[t], axis=0).max()


def test_a_picture_is_the_right_way_up_and_its_own_colours(tmp_path, by_hand):
    """A flag, red above blue: the texture at a vertex's place in it is the picture there."""
    flag = np.zeros((60, 40, 4), np.uint8)
    flag[10:50, 5:35] = (0, 0, 200, 255)
    flag[10:25, 5:35] = (200, 0, 0, 255)
    Image.fromarray(flag).save(tmp_path / "flag.png")
    target = read_picture("egg", ("sit",), [tmp_path / "flag.png"], [None])
    (body,) = bodies(perform(by_hand.motion(by_hand.still(), [[1.0]], names=("sit",)), [target]))
    (look,) = body.looks
    inside = np.abs(target.keys.points[0] - (20, 30)).max(axis=1) < 14
    x, y = (look.uv[inside] * look.texture.shape[1::-1]).astype(int).T
    above = body.shapes[0, inside, 1] > body.shapes[0, :, 1].max() * 0.7
    assert above.any()
    assert (look.texture[y, x][above] == (200, 0, 0, 255)).all()
    clear = look.texture[look.texture[..., 3] == 0]
    assert len(clear) and (clear[:, :3].max(axis=1) == 200).all()  # no dark fringe


def test_a_picture_for_every_key_is_changed_at_the_greatest_share(tmp_path, by_hand):
    square = np.array([(20, 20), (180, 20), (180, 180), (20, 180)], float)
    files = [tmp_path / f"{name}.png" for name in ("one", "two")]
    for file, color in zip(files, ((200, 0, 0), (0, 200, 0)), strict=True):
        Image.new("RGB", (200, 200), color).save(file)
    target = read_picture("egg", by_hand.names, files, [square, square + [[0, 0], [9, 0], [0, 0], [0, 0]]])
    weights = [[1, 0], [0.7, 0.3], [0.3, 0.7], [0, 1]]
    performance = perform(by_hand.motion(by_hand.tumble(4), weights), [target])
    gltf.write_glb(performance, tmp_path / "egg.glb")
    read = Read(tmp_path / "egg.glb")
    for t, time in enumerate(frame_times(performance)):
        seen = [np.ptp(points, axis=0).max() > 0.1 for points in read.points(time)]
        assert seen == [t < 2, t >= 2]


def test_a_lit_body_of_space_keeps_its_normals_and_its_plain_colour(tmp_path):
    rng = np.random.default_rng(0)
    shapes = rng.normal(size=(2, 4, 3))
    place = np.concatenate(
        [Rotation.from_rotvec([[0.3, 0.2, 0.1 * t] for t in range(5)]).as_matrix(), np.zeros((5, 3, 1))], -1
    )
    faces = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
    normals = shapes / np.linalg.norm(shapes, axis=-1, keepdims=True)
    weights = np.column_stack([1 - np.linspace(0, 2, 5), np.linspace(0, 2, 5)])
    body = Body("rock", ("a", "b"), shapes, weights, place, faces, color=(1, 0.5, 0, 1), normals=normals)
    gltf.write_bodies((body,), np.arange(5) / 12, 12, tmp_path / "rock.glb")
    read = Read(tmp_path / "rock.glb")
    for t in range(5):
        (points,) = read.points(float(np.float32(t / 12)))
        np.testing.assert_allclose(points, affine.apply(place[t], np.tensordot(weights[t], shapes, 1)), atol=1e-6)
    material = read.json["materials"][0]
    assert "extensions" not in material and "alphaMode" not in material
    assert material["pbrMetallicRoughness"]["baseColorFactor"] == pytest.approx([1, 0.214, 0, 1], abs=1e-3)
    assert "NORMAL" in read.json["meshes"][0]["primitives"][0]["targets"][0]


def test_what_cannot_be_written_is_refused_and_leaves_nothing(tmp_path, by_hand, picture):
    performance = perform(wild(by_hand), [picture(by_hand.names)])
    (tmp_path / "out").mkdir()
    with pytest.raises(InputError, match="must be a file"):
        gltf.write_glb(performance, tmp_path / "out")
    with pytest.raises(InputError, match="somebody who plays"):
        gltf.write_glb(Performance((), performance.times, 24.0, (320, 240)), tmp_path / "out" / "none.glb")
    strange = replace(performance.roles[0], target=SimpleNamespace(part="egg", keys=performance.roles[0].target.keys))
    with pytest.raises(InputError, match="drawings and pictures"):
        gltf.write_glb(replace(performance, roles=(strange,)), tmp_path / "out" / "none.glb")
    assert list((tmp_path / "out").iterdir()) == []
