"""glTF 2.0: a performance as textured meshes with morph targets, for Blender, game engines and web pages.

Every body is a mesh whose morph targets are its shapes, under nodes that travel, turn and stretch it:

    part            nearer to the viewer in drawn order; stretched to nothing where it is not seen
    part.place      travel, turn and stretch of the captured affine map ...
    part.shape      ... and the inner turn that shear needs (`nodes`); the mesh hangs here, or the joints

A mesh with a skin hangs on nothing: readers place it by its joints alone, so the captured map sits above those.

Weights are kept between 0 and 1, because Blender cuts off what lies outside.  With least and greatest weights lo and hi
over the frames, the base is S_0 + sum lo_d (S_d - S_0), a target is (hi_d - lo_d) (S_d - S_0) and its weight is
(w_d - lo_d) / (hi_d - lo_d); a shape whose weight never changes is part of the base.  Nothing is lost: the mesh's
extras hold lo and hi, and the weights folded onto the keys.

What holds its drawings, animated on twos, is played in steps: programs would draw in-betweens that nobody drew.
Anything else is played smoothly from frame to frame; shapes and places are judged apart, for a drawing may be held
while the camera pans.  Either way every frame of the clip is met exactly, and the last drawing stays for its own
duration.

A character with a picture for every key changes from one to the next at the greatest share: glTF has no cross-fade of
textures that programs play.  Our own pictures and videos melt them into each other.

A file takes 12 bytes for every vertex and used shape: a drawing of 40 elements in 20 shapes half a megabyte.
"""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capture.files import written_beside
from retarget.export import glb
from retarget.export.bodies import Body, bodies
from retarget.export.glb import FACES, VERTICES, File
from retarget.export.nodes import Nodes, nodes
from retarget.export.sheets import Look
from retarget.stage.perform import Performance

NEVER = 1e-7
"""A weight that changes less than this over the whole clip does not change."""


def write_glb(performance: Performance, path: str | Path) -> None:
    """A performance as one *.glb file, or as a *.gltf of text with everything in it, as the path ends."""
    width, height = performance.size
    notes = {
        "fps": performance.fps,
        "stage": [width, height],
        "pixels_per_unit": height,
        "origin": "the middle of the canvas's lower edge; x right, y up, z to the viewer",
    }
    write_bodies(bodies(performance), performance.times, performance.fps, path, width / height, notes)


def write_bodies(
    acting: tuple[Body, ...],
    times: NDArray,
    fps: float,
    path: str | Path,
    aspect: float | None = None,
    notes: dict[str, Any] | None = None,
) -> None:
    """Bodies that play over `times` (T,), in seconds, as a *.glb or *.gltf file.

    With an `aspect`, width by height of the stage, a camera is put that shows just the stage.
    """
    file = File(times, fps)
    for body in acting:
        file.roots.append(_add_body(file, body))
    if aspect is not None:
        file.roots.append(_add_camera(file, aspect))
    content, binary = file.finished(notes or {})
    with written_beside(path) as temporary:
        whole = glb.text if Path(path).suffix == ".gltf" else glb.container
        temporary.write_bytes(whole(content, binary))


def _add_body(file: File, body: Body) -> int:
    """A body's meshes, nodes and curves, from the inside out; returns the number of its outermost node."""
    stepped = plays_in_steps(body.place)
    arrays, weights = between_zero_and_one(body)
    meshes = _add_meshes(file, body, arrays, weights)
    way = nodes(body.place)
    if body.skin is not None:
        roots, skin = _add_joints(file, body)
        meshed = [file.add("nodes", name=f"{body.name}.skin", mesh=meshes[0], skin=skin)]
        file.roots += meshed
        inside: dict[str, Any] = {"children": roots}
    elif len(meshes) == 1:
        inside, meshed = {"mesh": meshes[0]}, []
    else:
        meshed = [file.add("nodes", name=f"{body.name}.look {n}", mesh=mesh) for n, mesh in enumerate(meshes)]
        inside = {"children": meshed}
        for number, node in enumerate(meshed):
            _show(file, node, body.worn == number)
    if np.abs(way.inner - [0, 0, 0, 1]).max() > NEVER:
        inner = file.add("nodes", name=f"{body.name}.shape", rotation=way.inner[0].tolist(), **inside)
        file.animate(inner, "rotation", way.inner, stepped)
        inside, meshed = {"children": [inner]}, meshed or [inner]
    place = _add_place(file, f"{body.name}.place", way, stepped, inside)
    for node in meshed or [place]:
        file.animate(node, "weights", weights, plays_in_steps(body.weights))
    return _add_part(file, body, place)


def _add_joints(file: File, body: Body) -> tuple[list[int], int]:
    """A skin's joints as nodes; returns the numbers of the outermost ones and of the skin."""
    skin = body.skin
    stepped = plays_in_steps(skin.translation, skin.rotation)
    made: list[int] = []
    for number, (name, parent) in enumerate(zip(skin.names, skin.parents, strict=True)):
        curves = {"translation": skin.translation[:, number], "rotation": skin.rotation[:, number]}
        if skin.scale is not None:
            curves["scale"] = skin.scale[:, number]
        made.append(file.add("nodes", name=name, **{path: values[0].tolist() for path, values in curves.items()}))
        for path, values in curves.items():
            file.animate(made[-1], path, values, stepped)
        if parent >= 0:
            file.lists["nodes"][made[parent]].setdefault("children", []).append(made[-1])
    bind = np.tile(np.eye(4, dtype=np.float32), (len(made), 1, 1))
    bind[:, :3] = skin.inverse_bind
    columns = file.array(np.swapaxes(bind, 1, 2))  # matrices are stored column by column
    roots = [node for node, parent in zip(made, skin.parents, strict=True) if parent < 0]
    return roots, file.add("skins", name=body.name, joints=made, inverseBindMatrices=columns)


def _add_place(file: File, name: str, way: Nodes, stepped: bool, inside: dict[str, Any]) -> int:
    curves = {"translation": way.translation, "rotation": way.rotation, "scale": way.scale}
    node = file.add("nodes", name=name, **{path: values[0].tolist() for path, values in curves.items()}, **inside)
    for path, values in curves.items():
        file.animate(node, path, values, stepped)
    return node


def _add_part(file: File, body: Body, place: int) -> int:
    depth = np.zeros(len(body.place)) if body.depth is None else body.depth
    nearer = np.column_stack([np.zeros((len(depth), 2)), depth])
    node = file.add("nodes", name=body.name, translation=nearer[0].tolist(), children=[place])
    file.animate(node, "translation", nearer, stepped=True)
    if body.visible is not None:
        _show(file, node, body.visible)
    return node


def _show(file: File, node: int, seen: NDArray) -> None:
    """Stretch a node to nothing in the frames where it is not seen: readers draw no such node."""
    if not seen.all():
        sizes = np.repeat(np.where(seen, 1.0, 0.0)[:, None], 3, axis=1)
        file.lists["nodes"][node]["scale"] = sizes[0].tolist()
        file.animate(node, "scale", sizes, stepped=True)


def plays_in_steps(*curves: NDArray) -> bool:
    """Whether most drawings stay for longer than a frame, as on twos, in curves (T, ...) that change together.

    What stands before the first change and after the last is a pause, not a held drawing, and does not count; nor
    does a pause between two actions, which is but one drawing.
    """
    values = np.concatenate([curve.reshape(len(curve), -1) for curve in curves], axis=1)
    changes = 1 + np.flatnonzero(np.abs(np.diff(values, axis=0)).max(axis=1, initial=0) > NEVER)
    stays = np.diff(changes) if len(changes) > 1 else np.diff([0, *changes, len(values)])
    return bool((stays > 1).mean() > 0.5)


def between_zero_and_one(body: Body) -> tuple[dict[str, Any], NDArray]:
    """Base, targets and weights (T, D') for targets whose weights run from 0 to 1, and what the extras tell of it."""
    low, high = body.weights.min(axis=0), body.weights.max(axis=0)
    low[0], high[0] = 0, 0  # the base's own weight is what the others leave of 1
    away = np.abs(body.shapes - body.shapes[0]).max(axis=(1, 2)) * (high - low)
    used = np.flatnonzero(away > NEVER * np.ptp(body.shapes[0], axis=0).max())
    weights = np.clip((body.weights[:, used] - low[used]) / (high - low)[used], 0, 1)
    arrays = {"names": [body.shape_names[number] for number in used]}
    arrays["ranges"] = np.column_stack([low, high])[used].tolist()
    for which, values in (("POSITION", body.shapes), ("NORMAL", body.normals)):
        if values is not None:
            deltas = values - values[0]
            base = values[0] + np.tensordot(low, deltas, axes=1)
            if which == "NORMAL":  # a file's normals have the length 1
                length = np.linalg.norm(base, axis=-1, keepdims=True)
                base = np.where(length > 1e-9, base / np.maximum(length, 1e-9), values[0])
            arrays[which] = [base, *((high - low)[used, None, None] * deltas[used])]
    return arrays, weights


def _add_meshes(file: File, body: Body, arrays: dict[str, Any], weights: NDArray) -> list[int]:
    """One mesh for every look, or one plain one; all share their points."""
    stored: list[dict[str, int]] = [{} for _ in arrays["POSITION"]]
    for which in ("POSITION", "NORMAL"):
        for attributes, values in zip(stored, arrays.get(which, ()), strict=False):
            attributes[which] = file.array(np.asarray(values, np.float32), VERTICES, bounds=True)
    if body.skin is not None:
        stored[0]["JOINTS_0"] = file.array(body.skin.joints.astype(np.uint16), VERTICES)
        stored[0]["WEIGHTS_0"] = file.array(body.skin.shares.astype(np.float32), VERTICES)
    if body.colors is not None:
        light = np.where(body.colors <= 0.04045, body.colors / 12.92, ((body.colors + 0.055) / 1.055) ** 2.4)
        colors = np.column_stack([light[:, :3], body.colors[:, 3]])
        stored[0]["COLOR_0"] = file.array(np.asarray(colors, np.float32), VERTICES)
    size = np.uint16 if body.shapes.shape[1] < 2**16 - 1 else np.uint32
    faces = file.array(body.faces.ravel().astype(size), FACES)
    extras = {"targetNames": arrays["names"], "targetRanges": arrays["ranges"], **body.notes}
    meshes = []
    for look in body.looks or (None,):
        attributes = dict(stored[0])
        if look is not None:
            attributes["TEXCOORD_0"] = file.array(np.asarray(look.uv, np.float32), VERTICES)
        primitive = {"attributes": attributes, "indices": faces, "material": _add_material(file, body, look)}
        if len(stored) > 1:
            primitive["targets"] = stored[1:]
        meshes.append(
            file.add(
                "meshes",
                name=body.name,
                primitives=[primitive],
                weights=weights[0].tolist() or None,
                extras=extras,
            )
        )
    return meshes


def _add_material(file: File, body: Body, look: Look | None) -> int:
    """A drawing shows its own colours, whatever the light; both sides, for a mirrored one shows its back."""
    red, green, blue, alpha = body.color
    surface: dict[str, Any] = {"metallicFactor": 0.0, "roughnessFactor": 1.0}
    surface["baseColorFactor"] = [*(linear_light(channel) for channel in (red, green, blue)), alpha]
    clear = alpha < 1
    if look is not None:
        surface["baseColorTexture"] = {"index": _add_texture(file, body.name, look)}
        clear |= bool((look.texture[..., 3] < 255).any())
    unlit = body.normals is None
    if unlit:
        file.extensions.add("KHR_materials_unlit")
    return file.add(
        "materials",
        name=body.name,
        pbrMetallicRoughness=surface,
        alphaMode="BLEND" if clear else None,
        doubleSided=True,
        extensions={"KHR_materials_unlit": {}} if unlit else None,
    )


def _add_texture(file: File, name: str, look: Look) -> int:
    kind, content = _encoded(look.texture)
    image = file.add("images", name=name, mimeType=kind, bufferView=file.piece(content))
    wrap = 10497 if look.repeats else 33071
    smooth = {"magFilter": 9729, "minFilter": 9987, "wrapS": wrap, "wrapT": wrap}
    known = file.lists.setdefault("samplers", [])
    sampler = known.index(smooth) if smooth in known else file.add("samplers", **smooth)
    return file.add("textures", sampler=sampler, source=image)


def _encoded(texture: NDArray) -> tuple[str, bytes]:
    """A texture as PNG, or as JPEG where it has no alpha and that halves it, as with a photograph."""
    import cv2

    pixels = cv2.cvtColor(texture, cv2.COLOR_RGBA2BGRA)
    png = cv2.imencode(".png", pixels)[1].tobytes()
    if (texture[..., 3] < 255).any():
        return "image/png", png
    jpeg = cv2.imencode(".jpg", pixels[..., :3], [cv2.IMWRITE_JPEG_QUALITY, 95])[1].tobytes()
    return ("image/jpeg", jpeg) if 2 * len(jpeg) < len(png) else ("image/png", png)


def _add_camera(file: File, aspect: float) -> int:
    """A camera in front of the stage that sees it without perspective, from edge to edge."""
    lens = {"xmag": 0.5 * aspect, "ymag": 0.5, "znear": 0.01, "zfar": 20.0}
    camera = file.add("cameras", name="stage", type="orthographic", orthographic=lens)
    return file.add("nodes", name="stage", camera=camera, translation=[0.0, 0.5, 10.0])


def linear_light(channel: float) -> float:
    """A colour channel of a picture (sRGB) as light."""
    return channel / 12.92 if channel <= 0.04045 else ((channel + 0.055) / 1.055) ** 2.4
