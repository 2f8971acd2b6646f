"""3-D models as files hold them: OBJ, glTF, GLB and PLY, with their materials and morph targets.

glTF and OBJ are read by hand.  Key shapes in several files correspond point by point, and the library tried for OBJ
(trimesh 5.2) splits points at seams in some files and drops the seams in others; of glTF it drops the morph targets.
"""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from retarget.characters.models import objfiles
from retarget.characters.models.gltffile import DAMAGE, GltfFile, open_gltf
from retarget.characters.models.model import Material, Model

MODELS = (".glb", ".gltf", ".obj", ".ply")

FARTHEST = 1e12
"""Units from a model's origin, beyond which a number is a slip, and arithmetic goes wrong."""


def read_model(path: str | Path) -> Model:
    """A model from a *.obj, *.gltf, *.glb or *.ply file; all its meshes as one, where its nodes put them."""
    path = Path(path)
    readers = {".obj": objfiles.read_obj, ".ply": objfiles.read_ply, ".gltf": _read_gltf, ".glb": _read_gltf}
    if path.suffix.lower() not in readers:
        raise InputError(f"{path}: a model must be a file ending in {', '.join(MODELS)}: convert it to glTF")
    if not path.is_file():
        raise InputError(f"a model must be a file that exists: there is no {path}")
    model = readers[path.suffix.lower()](path)
    if not len(model.faces):
        raise InputError(f"{path} must hold triangles, it has none: export the mesh itself, with its faces")
    if model.faces.min() < 0 or model.faces.max() >= len(model.points):
        raise InputError(
            f"{path}: faces must number points that are there, 1 to {len(model.points)}, one names point "
            f"{model.faces.max() + 1}: export it again"
        )
    held = (model.points, model.uv, *(() if model.colors is None else (model.colors,)), *model.morphs.values())
    if not all((np.abs(numbers) < FARTHEST).all() for numbers in held):
        raise InputError(
            f"{path}: points must be finite numbers below {FARTHEST:g}, it holds NaN, infinity or more: export it again"
        )
    return model


def _read_gltf(path: Path) -> Model:
    file = open_gltf(path)
    try:
        return _gltf_model(file)
    except InputError:
        raise
    except DAMAGE as error:
        raise InputError(
            f"{path}: something in the glTF file is missing or wrong ({error!r}): export it again"
        ) from None


def _gltf_model(file: GltfFile) -> Model:
    """All triangles of the file's scene; what hangs on a skin stays as it was bound."""
    pieces = []
    for mesh, place in placed(file):
        names = mesh.get("extras", {}).get("targetNames", [])
        for primitive in mesh["primitives"]:
            if primitive.get("mode", 4) in (4, 5, 6) and "POSITION" in primitive["attributes"]:
                pieces.append(_piece(file, primitive, names, place))
    if not pieces:
        return Model(np.zeros((0, 3)), np.zeros((0, 3), int), (), np.zeros(0, int), np.zeros((0, 2)))
    starts = np.cumsum([0, *(len(piece["points"]) for piece in pieces)])
    counts = [len(piece["faces"]) for piece in pieces]

    def joined(name: str, otherwise: float) -> NDArray | None:
        if all(piece[name] is None for piece in pieces):
            return None
        width = next(piece[name].shape[1] for piece in pieces if piece[name] is not None)
        blank = [np.full((len(piece["points"]), width), otherwise) for piece in pieces]
        return np.concatenate([b if piece[name] is None else piece[name] for piece, b in zip(pieces, blank)])

    morphs = {}
    for name in dict.fromkeys(name for piece in pieces for name in piece["morphs"]):
        still = (np.zeros_like(piece["points"]) for piece in pieces)
        morphs[name] = np.concatenate([piece["morphs"].get(name, none) for piece, none in zip(pieces, still)])
    uv = joined("uv", 0.0)
    numbers = [piece["material"] for piece in pieces]
    known = {number: _material(file, number) for number in dict.fromkeys(numbers)}
    return Model(
        points=np.concatenate([piece["points"] for piece in pieces]),
        faces=np.concatenate([piece["faces"] + start for piece, start in zip(pieces, starts)]),
        materials=tuple(known.values()),
        surface=np.repeat([list(known).index(number) for number in numbers], counts),
        uv=np.zeros((starts[-1], 2)) if uv is None else uv,
        colors=joined("colors", 1.0),
        # one piece without normals, and edges are told by their angle everywhere
        normals=None if any(piece["normals"] is None for piece in pieces) else joined("normals", 0.0),
        morphs=morphs,
    )


def placed(file: GltfFile) -> list[tuple[dict[str, Any], NDArray]]:
    """The meshes of the file's scene with the maps (3, 4) from their own space to the scene's."""
    nodes, meshes = file.things("nodes"), file.things("meshes")
    scenes = file.things("scenes")
    if not scenes:
        return [(mesh, np.eye(3, 4)) for mesh in meshes]
    waiting = [(number, np.eye(4)) for number in scenes[file.content.get("scene", 0)].get("nodes", ())]
    placed, passed = [], 0
    while waiting and passed <= len(nodes):
        number, above = waiting.pop(0)
        passed += 1
        node = nodes[number]
        whole = above @ own_place(node)
        if "mesh" in node:  # a skinned mesh is placed by its joints alone
            placed.append((meshes[node["mesh"]], np.eye(3, 4) if "skin" in node else whole[:3]))
        waiting += [(child, whole) for child in node.get("children", ())]
    return placed


def own_place(node: dict[str, Any]) -> NDArray:
    """A node's map (4, 4) into its parent's space."""
    from scipy.spatial.transform import Rotation

    if "matrix" in node:
        return np.reshape(node["matrix"], (4, 4)).T.astype(float)
    place = np.eye(4)
    place[:3, :3] = Rotation.from_quat(node.get("rotation", (0, 0, 0, 1))).as_matrix() * node.get("scale", (1, 1, 1))
    place[:3, 3] = node.get("translation", (0, 0, 0))
    return place


def _piece(file: GltfFile, primitive: dict[str, Any], names: list[str], place: NDArray) -> dict[str, Any]:
    """One primitive's arrays, in the scene's space."""
    has = primitive["attributes"]
    points = file.array(has["POSITION"]).astype(float)
    indices = file.array(primitive["indices"]).astype(int) if "indices" in primitive else np.arange(len(points))
    material = primitive.get("material")
    texcoord, offset, scale = _texture_place(file, material)
    colors = file.array(has["COLOR_0"]).astype(float) if "COLOR_0" in has else None
    if colors is not None:
        alpha = colors[:, 3:] if colors.shape[1] == 4 else np.ones((len(colors), 1))
        colors = np.hstack([_to_srgb(colors[:, :3]), alpha])
    morphs = {}
    for number, target in enumerate(primitive.get("targets", ())):
        name = names[number] if number < len(names) else f"target {number}"
        moved = file.array(target["POSITION"]).astype(float) if "POSITION" in target else np.zeros_like(points)
        morphs[name] = moved @ place[:, :3].T
    turned = np.linalg.pinv(place[:, :3])  # normals go by the inverse transpose
    return {
        "points": points @ place[:, :3].T + place[:, 3],
        "faces": _triangles(indices, primitive.get("mode", 4)),
        "material": material,
        "uv": file.array(has[texcoord]) * scale + offset if texcoord in has else None,
        "colors": colors,
        "normals": file.array(has["NORMAL"]).astype(float) @ turned if "NORMAL" in has else None,
        "morphs": morphs,
    }


def _texture_place(file: GltfFile, material: int | None) -> tuple[str, NDArray, NDArray]:
    """Which attribute lays the texture, and how it is shifted and stretched there (KHR_texture_transform)."""
    which = {} if material is None else file.things("materials")[material].get("pbrMetallicRoughness", {})
    which = which.get("baseColorTexture", {})
    moved = which.get("extensions", {}).get("KHR_texture_transform", {})
    if moved.get("rotation"):
        raise InputError(
            f"{file.path}: its textures must not be turned on the surface, one is: export it with them baked"
        )
    number = moved.get("texCoord", which.get("texCoord", 0))
    return f"TEXCOORD_{number}", np.array(moved.get("offset", (0.0, 0.0))), np.array(moved.get("scale", (1.0, 1.0)))


def _triangles(indices: NDArray, mode: int) -> NDArray:
    """Faces (F, 3) of a list, strip (5) or fan (6) of triangles."""
    if mode == 4:
        return indices[: len(indices) // 3 * 3].reshape(-1, 3)
    at = np.arange(max(len(indices) - 2, 0))
    if mode == 6:
        return indices[np.stack([np.zeros_like(at), at + 1, at + 2], axis=-1)]
    odd = at % 2
    return indices[np.stack([at + odd, at + 1 - odd, at + 2], axis=-1)]


def _material(file: GltfFile, number: int | None) -> Material:
    if number is None:
        return Material()
    told = file.things("materials")[number]
    surface = told.get("pbrMetallicRoughness", {})
    red, green, blue, alpha = surface.get("baseColorFactor", (1.0, 1.0, 1.0, 1.0))
    mode = told.get("alphaMode", "OPAQUE")
    texture = None
    if "baseColorTexture" in surface:
        texture = file.picture(surface["baseColorTexture"]["index"])
    light = _to_srgb(np.array([red, green, blue]))
    return Material((*light.tolist(), alpha if mode == "BLEND" else 1.0), texture, mode != "OPAQUE")


def _to_srgb(light: NDArray) -> NDArray:
    """Light, 0-1, as a colour channel of a picture."""
    light = np.clip(light, 0, 1)
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
