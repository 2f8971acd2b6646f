"""Models in OBJ and PLY files.  A corner of an OBJ's face is a place and a texture place: each such pair is a point."""

from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from retarget.characters.models.gltffile import beside
from retarget.characters.models.model import Material, Model
from retarget.characters.photos.photo import read_image


def read_obj(path: Path) -> Model:
    """A Wavefront OBJ with its *.mtl; faces of many corners become fans, normals are made anew.

    The points come in the order in which faces name them, whatever normals they have: so files exported from one
    mesh in several shapes correspond.
    """
    places: list[list[float]] = []
    texture_places: list[list[float]] = []
    numbers: dict[tuple[int, int], int] = {}
    faces: list[tuple[int, int, int]] = []
    surface: list[int] = []
    materials: dict[str, Material] = {}
    used: list[str] = [""]
    for count, line in enumerate(_lines(path), 1):
        word, *rest = line.split() or [""]
        try:
            if word == "v":
                x, y, z, *more = map(float, rest)
                places.append([x, y, z, *more[:3]] if len(more) >= 3 else [x, y, z])
            elif word == "vt":
                u, v = (*map(float, rest), 0.0)[:2]
                texture_places.append([u, v])
            elif word == "f":
                corners = [_corner(text, len(places), len(texture_places)) for text in rest]
                ring = [numbers.setdefault(corner, len(numbers)) for corner in corners]
                faces += [(ring[0], b, c) for b, c in pairwise(ring[1:])]
                surface += [len(used) - 1] * max(len(ring) - 2, 0)
        except (ValueError, IndexError) as error:
            raise _no_line(path, count, "OBJ", line, error) from None
        if word == "mtllib":
            materials |= _read_mtl(beside(path, line.removeprefix(word).strip()))
        elif word == "usemtl":
            used.append(" ".join(rest))
    if not faces:
        return Model(np.zeros((0, 3)), np.zeros((0, 3), int), (), np.zeros(0, int), np.zeros((0, 2)))
    at, at_texture = np.array(list(numbers)).T
    listed = np.array([place[:3] for place in places])
    colored = all(len(place) == 6 for place in places)
    textures = np.array([*texture_places, [0.0, 0.0]])  # the last is for corners without one, number -1
    return Model(
        points=listed[at],
        faces=np.array(faces),
        materials=tuple(
            materials.get(name, Material((1.0, 1.0, 1.0, 1.0)) if colored else Material()) for name in used
        ),
        surface=np.array(surface),
        uv=np.where(at_texture[:, None] < 0, 0.0, textures[at_texture] * [1, -1] + [0, 1]),
        colors=np.hstack([np.array([place[3:] for place in places])[at], np.ones((len(at), 1))]) if colored else None,
    )


def read_ply(path: Path) -> Model:
    """A PLY, ascii or binary, with the colours of its points; read by trimesh, of the extra `mesh`."""
    try:
        import trimesh
    except ImportError:
        raise InputError(f"{path}: PLY files need trimesh, it is not installed: pip install tooncap[mesh]") from None
    try:
        with path.open("rb") as opened:
            read = trimesh.load(opened, file_type="ply", process=False, maintain_order=True, force="mesh")
    except Exception as error:  # the reader raises whatever its parts raise
        raise InputError(f"{path} must be a PLY file, it cannot be read: {error!r}") from None
    points, faces = np.array(read.vertices, float), np.array(getattr(read, "faces", np.zeros((0, 3))), int)
    colored = getattr(read, "visual", None) is not None and read.visual.kind == "vertex"
    colors = np.array(read.visual.vertex_colors, float) / 255 if colored else None
    plain = Material((1.0, 1.0, 1.0, 1.0)) if colored else Material()
    return Model(points, faces.reshape(-1, 3), (plain,), np.zeros(len(faces), int), np.zeros((len(points), 2)), colors)


def _lines(path: Path) -> list[str]:
    """The lines of a text file, those that end in a backslash joined with the next."""
    text = path.read_text(encoding="utf-8", errors="replace").replace("\\\n", " ")
    return [line.partition("#")[0].strip() for line in text.splitlines()]


def _corner(text: str, places: int, texture_places: int) -> tuple[int, int]:
    """A corner such as 7, 7/3, 7//2, 7/3/2 or -1/-1 as numbers from 0 on; -1 for no texture place."""
    place, texture, *_ = (*text.split("/"), "", "")
    return _counted(place, places), _counted(texture, texture_places) if texture else -1


def _counted(text: str, count: int) -> int:
    number = int(text)
    found = number - 1 if number > 0 else count + number
    if not 0 <= found < count:
        raise IndexError(f"there is no number {number} among {count} so far")
    return found


def _no_line(path: Path, count: int, kind: str, line: str, error: Exception) -> InputError:
    return InputError(f"{path}: line {count} must be {kind}, {line!r:.80} is not: {error}; export it again")


def _read_mtl(path: Path) -> dict[str, Material]:
    """The materials of a *.mtl: colour, opacity, and a picture that must lie beside it."""
    materials: dict[str, Material] = {}
    name, color, alpha, texture = "", [0.8, 0.8, 0.8], 1.0, None
    for count, line in enumerate([*_lines(path), "newmtl"], 1):
        word, *rest = line.split() or [""]
        try:
            if word == "Kd" and len(rest) >= 3:
                color = [float(number) for number in rest[:3]]
            elif word in ("d", "Tr") and rest:
                alpha = float(rest[-1]) if word == "d" else 1 - float(rest[-1])
        except ValueError as error:
            raise _no_line(path, count, "MTL", line, error) from None
        if word == "newmtl":
            if name:
                materials[name] = _look(color, alpha, texture)
            name, color, alpha, texture = " ".join(rest), [0.8, 0.8, 0.8], 1.0, None
        elif word == "map_Kd" and rest:
            named = (
                rest[-1] if rest[0].startswith("-") else line.split(None, 1)[1]
            )  # after options, or with spaces in it
            texture = read_image(beside(path, named.strip()))
    return materials


def _look(color: list[float], alpha: float, texture: NDArray | None) -> Material:
    """A picture shows its own colours; programs write any grey beside it."""
    if texture is None:
        return Material((*color, alpha))
    return Material((1.0, 1.0, 1.0, alpha), texture, bool((texture[..., 3] < 255).any()))
