"""USD: a performance as textured meshes with blend shapes, for Blender, Houdini, Maya, Omniverse and Quick Look.

    /stage/PART                 nearer to the viewer in drawn order; stretched to nothing where it is not seen
    /stage/PART/place           the captured affine map as it is: USD's matrices know shear
    /stage/PART/place/figure    a skeleton's root: the mesh, its blend shapes, their weights over time, and the joints

Time codes are frames, from 0.  USD draws straight ways between samples; a held drawing has one at each end of the hold,
so at whole frames, where programs of animation stop, every drawing is exact and holds are holds.

Pictures of several keys take turns, as in glTF: there is no cross-fade.

Weights are kept between 0 and 1, as in glTF, because Blender cuts off what lies outside.  A *.usdz holds its textures;
beside a *.usda or *.usdc they lie in a folder NAME.textures.  Needs the extra `usd`.
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.files import folder_written_beside, written_beside
from retarget.export.bodies import Body, Skin, bodies
from retarget.export.gltf import between_zero_and_one, linear_light
from retarget.stage.perform import Performance

Convert = Callable[[Any], Any]  # a frame's value, as USD holds it


def write_usd(performance: Performance, path: str | Path) -> None:
    """A performance as a *.usda, *.usdc or *.usdz file."""
    width, height = performance.size
    write_usd_bodies(bodies(performance), performance.times, performance.fps, path, width / height)


def write_usd_bodies(
    acting: tuple[Body, ...], times: NDArray, fps: float, path: str | Path, aspect: float | None = None
) -> None:
    """Bodies that play over `times` (T,), in seconds; with an `aspect` a camera shows just the stage."""
    try:
        from pxr import Usd, UsdGeom, UsdUtils
    except ImportError:
        raise InputError("a USD file needs the extra usd, which is not there: pip install 'tooncap[usd]'") from None
    path = Path(path)
    codes = np.round((np.asarray(times, float) - times[0]) * fps, 6).tolist()
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.SetTimeCodesPerSecond(fps)
    stage.SetFramesPerSecond(fps)
    stage.SetStartTimeCode(0)
    stage.SetEndTimeCode(codes[-1])
    root = UsdGeom.Xform.Define(stage, "/stage")
    stage.SetDefaultPrim(root.GetPrim())
    textures: list[NDArray] = []
    folder = f"{path.stem}.textures"
    for body in acting:
        _add_body(stage, body, codes, textures, folder)
    if aspect is not None:
        _add_camera(stage, aspect)
    if path.suffix == ".usdz":
        with TemporaryDirectory() as inside:
            _write_textures(Path(inside) / folder, textures)
            whole = str(Path(inside) / f"{path.stem}.usdc")
            stage.Export(whole)
            with written_beside(path) as temporary:
                UsdUtils.CreateNewUsdzPackage(whole, str(temporary))
        return
    with written_beside(path) as temporary:
        stage.Export(str(temporary))
        if textures:
            with folder_written_beside(path.with_name(folder)) as inside:
                _write_textures(inside, textures)


def _add_body(stage: Any, body: Body, codes: list[float], textures: list[NDArray], folder: str) -> None:
    from pxr import Gf, Sdf, UsdGeom, UsdSkel, Vt

    part = UsdGeom.Xform.Define(stage, _unused(stage, body.name))
    part.GetPrim().SetDisplayName(body.name)
    at = part.GetPath()
    depth = np.zeros(len(codes)) if body.depth is None else body.depth
    _follow(part.AddTranslateOp().GetAttr(), [(0.0, 0.0, float(z)) for z in depth], codes, lambda z: Gf.Vec3d(*z))
    if body.visible is not None and not body.visible.all():
        _show(part, body.visible, codes)
    place = UsdGeom.Xform.Define(stage, at.AppendChild("place"))
    square = np.tile(np.eye(4), (len(codes), 1, 1))
    square[:, :3] = body.place
    matrices = np.swapaxes(square, 1, 2).tolist()  # USD's points are rows
    _follow(place.AddTransformOp().GetAttr(), matrices, codes, lambda matrix: Gf.Matrix4d(matrix))

    figure = UsdSkel.Root.Define(stage, at.AppendPath("place/figure"))
    arrays, weights = between_zero_and_one(body)
    skeleton, motion = _add_skeleton(stage, figure.GetPath(), body.skin, codes)
    names = _identifiers(arrays["names"])
    if names:
        motion.CreateBlendShapesAttr(names)
        values = np.round(weights, 7).tolist()
        _follow(motion.CreateBlendShapeWeightsAttr(), values, codes, lambda frame: Vt.FloatArray(frame))
    for number, look in enumerate(body.looks or (None,)):
        mesh = UsdGeom.Mesh.Define(stage, figure.GetPath().AppendChild(f"mesh_{number}"))
        _fill_mesh(mesh, body, arrays)
        binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
        binding.CreateSkeletonRel().SetTargets([skeleton.GetPath()])
        if names:
            binding.CreateBlendShapesAttr(names)
            binding.CreateBlendShapeTargetsRel().SetTargets(_add_shapes(stage, mesh, names, arrays))
        if body.skin is not None:
            binding.CreateJointIndicesPrimvar(False, 4).Set(Vt.IntArray(body.skin.joints.ravel().tolist()))
            binding.CreateJointWeightsPrimvar(False, 4).Set(Vt.FloatArray(body.skin.shares.ravel().tolist()))
            binding.CreateGeomBindTransformAttr(Gf.Matrix4d(1))
        if look is not None:
            st = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, "vertex")
            st.Set(Vt.Vec2fArray.FromNumpy((look.uv * [1, -1] + [0, 1]).astype(np.float32)))  # upwards
            textures.append(look.texture)
        if len(body.looks) > 1:
            _show(mesh, body.worn == number, codes)
        file = f"./{folder}/{len(textures) - 1:04d}.png" if look is not None else ""
        _add_paint(stage, mesh, body, file)


def _fill_mesh(mesh: Any, body: Body, arrays: dict[str, Any]) -> None:
    from pxr import UsdGeom, Vt

    base, *targets = (np.asarray(values, np.float32) for values in arrays["POSITION"])
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(base))
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray([3] * len(body.faces)))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray(body.faces.ravel().tolist()))
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mesh.CreateDoubleSidedAttr(True)  # a mirrored drawing shows its back
    low = base + sum((np.minimum(target, 0) for target in targets), np.zeros_like(base))
    high = base + sum((np.maximum(target, 0) for target in targets), np.zeros_like(base))
    mesh.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(np.stack([low.min(axis=0), high.max(axis=0)])))
    if "NORMAL" in arrays:
        mesh.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(np.asarray(arrays["NORMAL"][0], np.float32)))
        mesh.SetNormalsInterpolation(UsdGeom.Tokens.vertex)


def _add_shapes(stage: Any, mesh: Any, names: Sequence[str], arrays: dict[str, Any]) -> list[Any]:
    """A mesh's blend shapes, each with the name that the motion's row has."""
    from pxr import UsdSkel, Vt

    paths = []
    for number, name in enumerate(names, 1):
        shape = UsdSkel.BlendShape.Define(stage, mesh.GetPath().AppendChild(name))
        shape.GetPrim().SetDisplayName(arrays["names"][number - 1])
        shape.CreateOffsetsAttr(Vt.Vec3fArray.FromNumpy(np.asarray(arrays["POSITION"][number], np.float32)))
        if "NORMAL" in arrays:
            normals = np.asarray(arrays["NORMAL"][number], np.float32)
            shape.CreateNormalOffsetsAttr(Vt.Vec3fArray.FromNumpy(normals))
        paths.append(shape.GetPath())
    return paths


def _add_skeleton(stage: Any, root: Any, skin: Skin | None, codes: list[float]) -> tuple[Any, Any]:
    """The skeleton of a figure and what moves it; readers of blend shapes ask for one, if but a single joint."""
    from pxr import Gf, UsdSkel, Vt

    skeleton = UsdSkel.Skeleton.Define(stage, root.AppendChild("skeleton"))
    motion = UsdSkel.Animation.Define(stage, skeleton.GetPath().AppendChild("motion"))
    binding = UsdSkel.BindingAPI.Apply(skeleton.GetPrim())
    binding.CreateAnimationSourceRel().SetTargets([motion.GetPath()])
    if skin is None:
        still = Vt.Matrix4dArray([Gf.Matrix4d(1)])
        skeleton.CreateJointsAttr(["root"])
        skeleton.CreateBindTransformsAttr(still)
        skeleton.CreateRestTransformsAttr(still)
        return skeleton, motion
    from scipy.spatial.transform import Rotation

    joints: list[str] = []
    for own, parent in zip(_identifiers(skin.names), skin.parents, strict=True):
        joints.append(own if parent < 0 else f"{joints[parent]}/{own}")
    binds, rests = np.tile(np.eye(4), (2, len(joints), 1, 1))
    binds[:, :3] = skin.inverse_bind
    binds = np.linalg.inv(binds)
    rests[:, :3, :3], rests[:, :3, 3] = Rotation.from_quat(skin.rotation[0]).as_matrix(), skin.translation[0]
    for one in (skeleton, motion):
        one.CreateJointsAttr(joints)
    skeleton.CreateBindTransformsAttr(Vt.Matrix4dArray([Gf.Matrix4d(m.T.tolist()) for m in binds]))
    skeleton.CreateRestTransformsAttr(Vt.Matrix4dArray([Gf.Matrix4d(m.T.tolist()) for m in rests]))
    travel = skin.translation.astype(np.float32).tolist()
    turns = skin.rotation[..., [3, 0, 1, 2]].astype(np.float32).tolist()
    _follow(motion.CreateTranslationsAttr(), travel, codes, lambda frame: Vt.Vec3fArray([Gf.Vec3f(p) for p in frame]))
    _follow(motion.CreateRotationsAttr(), turns, codes, lambda frame: Vt.QuatfArray([Gf.Quatf(*q) for q in frame]))
    motion.CreateScalesAttr(Vt.Vec3hArray([Gf.Vec3h(1)] * len(joints)))
    return skeleton, motion


def _add_paint(stage: Any, mesh: Any, body: Body, file: str) -> None:
    """A drawing glows in its own colours, whatever the light; a lit body takes the light."""
    from pxr import Gf, Sdf, UsdShade

    kinds = Sdf.ValueTypeNames
    paint = UsdShade.Material.Define(stage, mesh.GetPath().AppendChild("paint"))
    surface = UsdShade.Shader.Define(stage, paint.GetPath().AppendChild("surface"))
    surface.CreateIdAttr("UsdPreviewSurface")
    surface.CreateInput("roughness", kinds.Float).Set(1.0)
    red, green, blue, alpha = body.color
    color = tuple(linear_light(channel) for channel in (red, green, blue))
    shown = surface.CreateInput("diffuseColor" if body.normals is not None else "emissiveColor", kinds.Color3f)
    clear = surface.CreateInput("opacity", kinds.Float)
    surface.CreateInput("opacityMode", kinds.Token).Set("presence")
    if body.normals is None:
        surface.CreateInput("diffuseColor", kinds.Color3f).Set(Gf.Vec3f(0))
        surface.CreateInput("useSpecularWorkflow", kinds.Int).Set(1)
        surface.CreateInput("specularColor", kinds.Color3f).Set(Gf.Vec3f(0))
    if file:
        where = UsdShade.Shader.Define(stage, paint.GetPath().AppendChild("where"))
        where.CreateIdAttr("UsdPrimvarReader_float2")
        where.CreateInput("varname", kinds.String).Set("st")
        texture = UsdShade.Shader.Define(stage, paint.GetPath().AppendChild("texture"))
        texture.CreateIdAttr("UsdUVTexture")
        texture.CreateInput("file", kinds.Asset).Set(file)
        texture.CreateInput("sourceColorSpace", kinds.Token).Set("sRGB")
        texture.CreateInput("scale", kinds.Float4).Set(Gf.Vec4f(*color, alpha))
        for edge in ("wrapS", "wrapT"):
            texture.CreateInput(edge, kinds.Token).Set("clamp")
        texture.CreateInput("st", kinds.Float2).ConnectToSource(where.CreateOutput("result", kinds.Float2))
        shown.ConnectToSource(texture.CreateOutput("rgb", kinds.Float3))
        clear.ConnectToSource(texture.CreateOutput("a", kinds.Float))
    else:
        shown.Set(Gf.Vec3f(*color))
        clear.Set(float(alpha))
    paint.CreateSurfaceOutput().ConnectToSource(surface.CreateOutput("surface", kinds.Token))
    UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(paint)


def _add_camera(stage: Any, aspect: float) -> None:
    """A camera in front of the stage that sees it without perspective; apertures are tenths of a unit."""
    from pxr import Gf, UsdGeom

    camera = UsdGeom.Camera.Define(stage, "/stage/camera")
    camera.CreateProjectionAttr(UsdGeom.Tokens.orthographic)
    camera.CreateHorizontalApertureAttr(10 * aspect)
    camera.CreateVerticalApertureAttr(10.0)
    camera.CreateClippingRangeAttr(Gf.Vec2f(0.01, 20))
    camera.AddTranslateOp().Set(Gf.Vec3d(0, 0.5, 10))


def _show(prim: Any, seen: NDArray, codes: list[float]) -> None:
    """Stretch to nothing what is not seen: of `visibility` some importers read the first frame only."""
    from pxr import Gf

    _follow(prim.AddScaleOp().GetAttr(), [float(one) for one in seen], codes, lambda size: Gf.Vec3f(size))


def _follow(attribute: Any, values: Sequence[Any], codes: list[float], convert: Convert) -> None:
    """Let an attribute take T values; what never changes is its default, a hold has a sample at each end."""
    from retarget.export.elements import kept

    keys = kept(values, stepped=False)
    if len(keys) == 1:
        attribute.Set(convert(values[0]))
        return
    for t in keys:
        attribute.Set(convert(values[t]), codes[t])


def _unused(stage: Any, name: str) -> str:
    from pxr import Tf

    path = wanted = f"/stage/{Tf.MakeValidIdentifier(name)}"
    number = 2
    while stage.GetPrimAtPath(path):
        path, number = f"{wanted}_{number}", number + 1
    return path


def _identifiers(names: Sequence[str]) -> list[str]:
    """Names as USD allows them, each once: what Blender shows as the name of a shape key."""
    from pxr import Tf

    made: list[str] = []
    for name in names:
        plain = Tf.MakeValidIdentifier(name)
        made.append(plain if plain not in made else f"{plain}_{len(made)}")
    return made


def _write_textures(folder: Path, textures: Sequence[NDArray]) -> None:
    from PIL import Image

    folder.mkdir(exist_ok=True)
    for number, texture in enumerate(textures):
        Image.fromarray(texture).save(folder / f"{number:04d}.png")
