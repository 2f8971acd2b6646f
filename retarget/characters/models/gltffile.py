"""glTF 2.0 files opened for reading: the JSON, the arrays its accessors name, and its pictures.

By hand, because readers of meshes drop what a character is made of: morph targets, skins, animations.  Nothing is
ever fetched: a file may name others beside it, never an address.
"""

import base64
import binascii
import json
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError

TYPES = {5120: np.int8, 5121: np.uint8, 5122: np.int16, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
COUNTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
UNDERSTOOD = {"KHR_materials_unlit", "KHR_mesh_quantization", "KHR_texture_transform", "KHR_lights_punctual"}
"""Extensions a file may require and still be read; the surface is what is looked at here, not how it shines."""

DAMAGE = (LookupError, TypeError, ValueError, AttributeError, RecursionError, struct.error)
"""What reading runs into where a file is cut short, or holds other things than it should."""

MOST = 20_000_000
"""Numbers of an array that no bytes stand behind: a slip there would fill the memory."""


@dataclass(frozen=True, eq=False)
class GltfFile:
    """A *.gltf or *.glb file: its JSON and the bytes of its buffers."""

    path: Path
    content: dict[str, Any]
    buffers: tuple[bytes, ...]

    def things(self, kind: str) -> list[dict[str, Any]]:
        """One of the file's lists, such as "meshes"; empty where it has none."""
        return self.content.get(kind, [])

    def array(self, accessor: int) -> NDArray:
        """The array (n,) or (n, columns) of an accessor: floats, where it says "normalized", or as stored."""
        told = self.content["accessors"][accessor]
        kind, columns, count = np.dtype(TYPES[told["componentType"]]), COUNTS[told["type"]], told["count"]
        if "bufferView" in told:
            values = self._strided(told["bufferView"], told.get("byteOffset", 0), kind, columns, count)
        elif 0 <= count * columns <= MOST:
            values = np.zeros((count, columns), kind)
        else:
            raise ValueError(f"an array of {count} places without content")
        if "sparse" in told:
            sparse, values = told["sparse"], values.copy()
            at, new = sparse["indices"], sparse["values"]
            number = np.dtype(TYPES[at["componentType"]])
            index = self._strided(at["bufferView"], at.get("byteOffset", 0), number, 1, sparse["count"])[:, 0]
            values[index] = self._strided(new["bufferView"], new.get("byteOffset", 0), kind, columns, sparse["count"])
        if told.get("normalized") and kind.kind in "iu":
            values = np.maximum(values.astype(float) / np.iinfo(kind).max, -1.0)
        if not np.isfinite(values).all():
            raise InputError(f"{self.path}: its numbers must be finite, it holds NaN or infinity: export it again")
        return values[:, 0] if columns == 1 else values

    def picture(self, texture: int) -> NDArray:
        """The picture of a texture, uint8 RGBA (H, W, 4)."""
        from io import BytesIO

        from retarget.characters.photos.photo import read_image

        source = self.things("textures")[texture].get("source")
        if source is None:
            raise InputError(
                f"{self.path}: texture {texture} must be PNG or JPG, it is of another kind: export it with PNG textures"
            )
        told = self.things("images")[source]
        if "bufferView" in told:
            content = self._view(told["bufferView"])
        elif told.get("uri", "").startswith("data:"):
            content = _decoded(told["uri"])
        else:
            return read_image(beside(self.path, unquote(told.get("uri", ""))))
        try:
            return read_image(BytesIO(content))
        except InputError:
            raise InputError(
                f"{self.path}: image {source} in it must be PNG or JPG, it cannot be read: export the model again"
            ) from None

    def _view(self, number: int) -> bytes:
        told = self.content["bufferViews"][number]
        start = told.get("byteOffset", 0)
        return self.buffers[told["buffer"]][start : start + told["byteLength"]]

    def _strided(self, view: int, offset: int, kind: np.dtype, columns: int, count: int) -> NDArray:
        stride = self.content["bufferViews"][view].get("byteStride", kind.itemsize * columns)
        return np.ndarray((count, columns), kind, self._view(view), offset, (stride, kind.itemsize))


def open_gltf(path: str | Path) -> GltfFile:
    """Open a *.gltf or *.glb file with the buffers beside it."""
    path = Path(path)
    try:
        return _opened(path, path.read_bytes())
    except FileNotFoundError:
        raise InputError(f"a model must be a file that exists: there is no {path}") from None
    except InputError:
        raise
    except (OSError, *DAMAGE) as error:
        raise InputError(f"{path} must be a glTF 2.0 file, it cannot be read: {error!r}") from None


def _opened(path: Path, whole: bytes) -> GltfFile:
    content, binary = _chunks(whole) if whole[:4] == b"glTF" else (json.loads(whole), None)
    version = str(content["asset"]["version"])
    if not version.startswith("2"):
        raise InputError(f"{path} must be glTF of version 2, it is of version {version}: export it again")
    unknown = sorted(set(content.get("extensionsRequired", ())) - UNDERSTOOD)
    if unknown:
        raise InputError(f"{path} must be plain glTF, it requires {', '.join(unknown)}: export it without compression")
    buffers = []
    for number, told in enumerate(content.get("buffers", ())):
        uri = told.get("uri")
        if uri is None and number == 0 and binary is not None:
            buffers.append(binary)
        elif uri is not None and uri.startswith("data:"):
            buffers.append(_decoded(uri))
        else:
            buffers.append(beside(path, unquote(uri or "")).read_bytes())
    return GltfFile(path, content, tuple(buffers))


def beside(path: Path, name: str) -> Path:
    """The file a model names, which must lie beside it or below; an address is never fetched."""
    file = path.parent / name
    inside = file.resolve().is_relative_to(path.parent.resolve()) and "://" not in name
    if not (name and inside and file.is_file()):
        raise InputError(
            f"{path}: the file {name!r} it names must lie beside it, there is none: put it there, or export the model "
            "again with everything inside"
        )
    return file


def _chunks(whole: bytes) -> tuple[dict[str, Any], bytes | None]:
    """The JSON and the bytes of a *.glb."""
    content, binary, at = None, None, 12
    while at + 8 <= len(whole):
        length, kind = struct.unpack_from("<I4s", whole, at)
        chunk = whole[at + 8 : at + 8 + length]
        if kind == b"JSON":
            content = json.loads(chunk)
        elif kind == b"BIN\0" and binary is None:
            binary = chunk
        at += 8 + length
    return content, binary


def _decoded(uri: str) -> bytes:
    head, _, data = uri.partition(",")
    try:
        return base64.b64decode(data, validate=True) if head.endswith(";base64") else unquote(data).encode("latin-1")
    except (binascii.Error, UnicodeEncodeError) as error:
        raise InputError(f"data inside a glTF file must be base64, it is not: {error}") from None
