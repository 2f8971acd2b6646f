"""What a 3-D model is, whatever file it comes from."""

from dataclasses import dataclass, field

from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Material:
    """How a surface looks."""

    color: tuple[float, float, float, float] = (0.8, 0.8, 0.8, 1.0)  # sRGB; times the texture, where there is one
    texture: NDArray | None = None  # (h, w, 4) uint8 straight alpha
    cut_out: bool = False  # the texture's clear places are holes


@dataclass(frozen=True, eq=False)
class Model:
    """A triangle mesh of N points and F faces, as it lies in its file: x right, y up, z to the viewer."""

    points: NDArray  # (N, 3)
    faces: NDArray  # (F, 3)
    materials: tuple[Material, ...]
    surface: NDArray  # (F,) the number of each face's material
    uv: NDArray  # (N, 2), from the texture's top-left corner, which repeats; 0 where there is no texture
    colors: NDArray | None = None  # (N, 4) sRGB, times the material's
    normals: NDArray | None = None  # (N, 3) as the file gives them: only where edges are hard is read off them
    morphs: dict[str, NDArray] = field(default_factory=dict)  # name: (N, 3) to be added in full
