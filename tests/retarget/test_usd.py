"""USD files read back by usd-core itself: its own skinning, blend shapes and matrices give our points."""

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

from capture.errors import InputError
from capture.motion import affine
from retarget.characters.drawings.drawing import read_drawing
from retarget.characters.photos.picture import read_picture
from retarget.export.bodies import Body, Skin, stage_to_space
from retarget.export.nodes import lifted
from retarget.export.usd import write_usd, write_usd_bodies
from retarget.stage.perform import perform

pxr = pytest.importorskip("pxr", reason="usd-core, of the extra usd, is not installed")


def wild(by_hand, frames=8, **changes):
    """Weights below 0 and above 1, shear, a mirrored end."""
    lean = np.linspace(-0.4, 1.4, frames)
    maps = by_hand.tumble(frames)
    maps[..., :2] = maps[..., :2] @ [[1, 0.5], [0, 1]]
    maps[-1, :, 0] *= -1
    return by_hand.motion(maps, np.column_stack([1 - lean, lean]), **changes)


def photo(tmp_path, names):
    pixels = np.zeros((200, 200, 4), np.uint8)
    pixels[20:180, 20:180] = (200, 60, 0, 255)
    Image.fromarray(pixels).save(tmp_path / "photo.png")
    square = np.array([(20, 20), (180, 20), (180, 180), (20, 180)], float)
    bent = square + [[50, 0], [0, 0], [0, 0], [0, 30]]  # which no affine map does
    return read_picture("egg", names, [tmp_path / "photo.png"] * len(names), [square, bent][: len(names)])


def points_of(path, frames):
    """Each mesh (T, V, 3) in the world, after usd-core has baked shapes and joints into points."""
    from pxr import Usd, UsdGeom, UsdSkel

    stage = Usd.Stage.Open(str(path))
    assert UsdSkel.BakeSkinning(stage.Traverse())
    found = []
    for prim in stage.Traverse():
        if prim.IsA(UsdGeom.Mesh):
            here = []
            for t in frames:
                points = np.array(UsdGeom.Mesh(prim).GetPointsAttr().Get(t), float)
                world = np.array(UsdGeom.XformCache(t).GetLocalToWorldTransform(prim))
                here.append(points @ world[:3, :3] + world[3, :3])
            found.append(np.array(here))
    return found


@pytest.mark.parametrize("suffix", [".usda", ".usdc", ".usdz"])
def test_usd_gives_the_points_of_a_picture_back(tmp_path, by_hand, suffix):
    performance = perform(wild(by_hand), [photo(tmp_path, by_hand.names)])
    write_usd(performance, tmp_path / f"egg{suffix}")
    (points,) = points_of(tmp_path / f"egg{suffix}", range(8))
    truth = affine.apply(stage_to_space(performance.size), performance.roles[0].mesh())
    assert np.abs(points[..., :2] - truth).max() < 1e-5  # canvas heights
    assert np.ptp(truth, axis=1).max() > 0.3


def test_weights_stay_between_0_and_1_and_time_codes_are_frames(tmp_path, by_hand, worm):
    from pxr import Usd, UsdSkel

    performance = perform(wild(by_hand), [read_drawing("egg", by_hand.names, worm)])
    write_usd(performance, tmp_path / "worm.usda")
    stage = Usd.Stage.Open(str(tmp_path / "worm.usda"))
    (motion,) = [UsdSkel.Animation(prim) for prim in stage.Traverse() if prim.IsA(UsdSkel.Animation)]
    weights = np.array([motion.GetBlendShapeWeightsAttr().Get(t) for t in range(8)])
    assert weights.min() == 0 and weights.max() == 1
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode(), stage.GetTimeCodesPerSecond()) == (0, 7, 24)
    assert stage.GetDefaultPrim().GetName() == "stage"


def test_a_drawing_held_on_twos_is_held_at_whole_frames_and_costs_no_more_than_its_ends(tmp_path, by_hand):
    from pxr import Usd, UsdGeom

    at = np.array([0, 0, 0, 0, 1, 1, 1, 1, 2])
    motion = by_hand.motion(by_hand.tumble(9)[at], [[1.0, 0]] * 9)
    write_usd(perform(motion, [photo(tmp_path, by_hand.names)]), tmp_path / "egg.usda")
    (points,) = points_of(tmp_path / "egg.usda", range(9))
    np.testing.assert_allclose(points, points[[0, 0, 0, 0, 4, 4, 4, 4, 8]], atol=1e-12)
    assert np.abs(points[3] - points[4]).max() > 1e-3
    stage = Usd.Stage.Open(str(tmp_path / "egg.usda"))
    place = UsdGeom.Xformable(stage.GetPrimAtPath("/stage/egg/place"))
    assert place.GetOrderedXformOps()[0].GetAttr().GetTimeSamples() == [0, 3, 4, 7, 8]


def test_what_is_not_seen_is_stretched_to_nothing_and_pictures_take_turns(tmp_path, by_hand):
    files = [tmp_path / f"{name}.png" for name in ("one", "two")]
    for file, color in zip(files, ((200, 0, 0), (0, 200, 0)), strict=True):
        Image.new("RGB", (200, 200), color).save(file)
    square = np.array([(20, 20), (180, 20), (180, 180), (20, 180)], float)
    target = read_picture("egg", by_hand.names, files, [square, square + [[0, 0], [9, 0], [0, 0], [0, 0]]])
    weights = [[1, 0], [0.7, 0.3], [0.3, 0.7], [0, 1]]
    seen = np.array([1, 1, 1, 0], bool)
    write_usd(perform(by_hand.motion(by_hand.tumble(4), weights, visible=seen), [target]), tmp_path / "egg.usdc")
    shown = [
        [np.ptp(points[t], axis=0).max() > 0.1 for t in range(4)]
        for points in points_of(tmp_path / "egg.usdc", range(4))
    ]
    assert shown == [[True, True, False, False], [False, False, True, False]]


def test_textures_lie_beside_the_file_or_in_it_and_are_the_right_way_up(tmp_path, by_hand):
    from pxr import Usd, UsdGeom, UsdShade

    performance = perform(by_hand.motion(by_hand.still(2), [[1.0, 0]] * 2), [photo(tmp_path, by_hand.names)])
    for suffix in (".usda", ".usdz"):
        path = tmp_path / f"egg{suffix}"
        write_usd(performance, path)
        stage = Usd.Stage.Open(str(path))
        (mesh,) = [UsdGeom.Mesh(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
        paint = UsdShade.MaterialBindingAPI(mesh).ComputeBoundMaterial()[0]
        surface = paint.ComputeSurfaceSource()[0]
        (source,), _ = surface.GetInput("emissiveColor").GetConnectedSources()
        file = UsdShade.Shader(source.source.GetPrim()).GetInput("file").Get()
        assert file.resolvedPath and (suffix == ".usda") == ("egg.textures" in file.resolvedPath.split("[")[0])
        st = np.array(UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st").Get())
        height = np.array(mesh.GetPointsAttr().Get())[:, 1]
        assert np.corrcoef(st[:, 1], height)[0, 1] > 0.99  # both grow upwards
    assert np.array(Image.open(tmp_path / "egg.textures" / "0000.png")).max() == 255


def test_usd_plays_a_skin_under_shapes_and_a_sheared_map(tmp_path):
    """The equation written out here: shape first, then the joints' shares, then the map of the whole figure."""
    rng = np.random.default_rng(5)
    frames, count = 5, 30
    shapes = rng.uniform(-1, 1, (3, count, 3))
    weights = rng.uniform(-0.5, 1.5, (frames, 3))
    weights[:, 0] += 1 - weights.sum(axis=1)
    place = lifted(rng.normal(0, 1, (frames, 2, 3)))
    parents = (-1, 0, 1, 0)
    turns = Rotation.from_rotvec(rng.normal(0, 1, (frames * 4, 3)))
    bones = rng.normal(0, 0.5, (frames, 4, 3))
    local = np.zeros((frames, 4, 3, 4))
    local[..., :3], local[..., 3] = turns.as_matrix().reshape(frames, 4, 3, 3), bones
    world = local.copy()
    for joint, parent in enumerate(parents):
        if parent >= 0:
            world[:, joint] = affine.compose(world[:, parent], local[:, joint])
    bind = affine.invert(rng.normal(0, 1, (4, 3, 4)) + np.eye(3, 4))
    shares = rng.dirichlet(np.ones(4), count)
    joints = np.tile(np.arange(4), (count, 1))
    skin = Skin(
        ("hip", "knee", "left foot", "tail"),
        parents,
        bones,
        turns.as_quat().reshape(frames, 4, 4),
        bind,
        joints,
        shares,
    )
    body = Body("a fox", ("a", "b", "c"), shapes, weights, place, np.arange(30).reshape(-1, 3), skin=skin)
    write_usd_bodies((body, replace(body, skin=None)), np.arange(frames) / 24, 24.0, tmp_path / "fox.usdc")
    skinned, plain = points_of(tmp_path / "fox.usdc", range(frames))
    for t in range(frames):
        shape = np.tensordot(weights[t], shapes, axes=1)
        moved = affine.apply(affine.compose(world[t], bind), shape)  # (J, V, 3)
        truth = affine.apply(place[t], np.einsum("vj,jvx->vx", shares, moved))
        assert np.abs(skinned[t] - truth).max() < 1e-5 * np.ptp(truth, axis=0).max()
        truth = affine.apply(place[t], shape)
        assert np.abs(plain[t] - truth).max() < 1e-5 * np.ptp(truth, axis=0).max()


def test_what_cannot_be_written_leaves_nothing(tmp_path, by_hand, worm):
    performance = perform(wild(by_hand), [read_drawing("egg", by_hand.names, worm)])
    (tmp_path / "out" / "egg.textures").mkdir(parents=True)
    (tmp_path / "out" / "egg.textures" / "notes.txt").write_text("mine", encoding="utf-8")
    with pytest.raises(InputError, match=r"notes\.txt"):
        write_usd(performance, tmp_path / "out" / "egg.usda")
    assert [file.name for file in (tmp_path / "out").iterdir()] == ["egg.textures"]
