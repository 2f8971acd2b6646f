"""A glTF 2.0 file as bytes: its JSON lists, the buffer they point into, and the two forms it is written in."""

import base64
import json
import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

FLOAT, SHORT, INT = 5126, 5123, 5125  # component types
VERTICES, FACES = 34962, 34963  # what a piece of the buffer is for
KINDS = {(): "SCALAR", (2,): "VEC2", (3,): "VEC3", (4,): "VEC4", (4, 4): "MAT4"}


class File:
    """A glTF file in the making: its JSON lists, and the bytes that they point into."""

    def __init__(self, times: NDArray, fps: float) -> None:
        times = np.asarray(times, float)
        self.times = np.append(times, times[-1] + 1 / fps) - times[0]  # the last drawing has a duration too
        self.roots: list[int] = []
        self.lists: dict[str, list[dict[str, Any]]] = {}
        self.channels: list[dict[str, Any]] = []
        self.samplers: list[dict[str, Any]] = []
        self.extensions: set[str] = set()
        self.bytes = bytearray()

    def add(self, kind: str, **thing: Any) -> int:
        """Put a thing into one of the JSON lists; returns its number."""
        things = self.lists.setdefault(kind, [])
        things.append({name: value for name, value in thing.items() if value is not None})
        return len(things) - 1

    def piece(self, content: bytes, target: int | None = None) -> int:
        """Bytes as a view of the buffer, on a boundary of 4."""
        self.bytes += b"\0" * (-len(self.bytes) % 4)
        view = self.add("bufferViews", buffer=0, byteOffset=len(self.bytes), byteLength=len(content), target=target)
        self.bytes += content
        return view

    def array(self, values: NDArray, target: int | None = None, bounds: bool = False) -> int:
        """An array (n,), (n, 2), (n, 3), (n, 4) or (n, 4, 4) of float32, or of uint16 or uint32, as an accessor."""
        values = np.ascontiguousarray(values)
        kind = {"f": FLOAT, "u": SHORT if values.itemsize == 2 else INT}[values.dtype.kind]
        return self.add(
            "accessors",
            bufferView=self.piece(values.tobytes(), target),
            componentType=kind,
            count=len(values),
            type=KINDS[values.shape[1:]],
            min=np.atleast_1d(values.min(axis=0)).tolist() if bounds else None,
            max=np.atleast_1d(values.max(axis=0)).tolist() if bounds else None,
        )

    def animate(self, node: int, path: str, values: NDArray, stepped: bool) -> None:
        """Let a node's `path` follow values (T, ...); what never changes is left to the node itself."""
        values = np.round(values, 9).astype(np.float32)
        values = np.concatenate([values, values[-1:]])
        changes = np.append(True, (np.diff(values, axis=0) != 0).reshape(len(values) - 1, -1).any(axis=1))
        if not changes[1:].any():
            return
        if stepped:
            kept = changes
        else:  # both ends of every hold
            kept = changes | np.append(changes[1:], True)
        kept[-1] = True
        at = self.array(np.asarray(self.times[kept], np.float32), bounds=True)
        output = self.array(values[kept].ravel() if path == "weights" else values[kept])
        interpolation = "STEP" if stepped else "LINEAR"
        self.samplers.append({"input": at, "output": output, "interpolation": interpolation})
        self.channels.append({"sampler": len(self.samplers) - 1, "target": {"node": node, "path": path}})

    def finished(self, notes: dict[str, Any]) -> tuple[dict[str, Any], bytes]:
        """The whole JSON but for the place of its buffer, and the buffer."""
        if self.channels:
            self.add("animations", name="performance", channels=self.channels, samplers=self.samplers)
        content = {
            "asset": {"version": "2.0", "generator": "tooncap", "extras": notes},
            "scene": 0,
            "scenes": [{"name": "stage", "nodes": self.roots}],
            **self.lists,
        }
        if self.extensions:
            content["extensionsUsed"] = sorted(self.extensions)
        return content, bytes(self.bytes + b"\0" * (-len(self.bytes) % 4))


def container(content: dict[str, Any], binary: bytes) -> bytes:
    """The *.glb file: a header, the JSON and the bytes, each on a boundary of 4."""
    content["buffers"] = [{"byteLength": len(binary)}]
    text = json.dumps(content, separators=(",", ":"), allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def text(content: dict[str, Any], binary: bytes) -> bytes:
    """The *.gltf file: JSON to read, the bytes in it as text."""
    uri = "data:application/octet-stream;base64," + base64.b64encode(binary).decode()
    content["buffers"] = [{"byteLength": len(binary), "uri": uri}]
    return json.dumps(content, indent=1, allow_nan=False).encode()
