"""What a performance hands to a vector file: its painted elements back to front, each over all frames.

Formats stack their layers once and for all, a performance may change who stands in front.  So a part has a layer for
every place in the stack it ever takes, seen only while it takes it: a part that keeps its place has one.

Vector formats count from the corner of the page, where everything here counts from the middle of its first pixel:
points come out half a pixel larger.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from retarget.characters.models.mesh import DrawnMesh
from retarget.export.gltf import plays_in_steps
from retarget.stage.perform import Performance, Role

GRAIN = 100
"""Lengths are kept to this part of a pixel: a hundredth is a tenth of what can be seen."""


@dataclass(frozen=True, eq=False)
class Element:
    """One painted thing in T frames, on the page: paths of the same curves and kinds of paint, or pictures."""

    name: str
    drawn: tuple[Any, ...]  # T DrawnPaths, or T DrawnPictures

    def curve(self, field: str) -> list[Any]:
        """One of its fields in every frame."""
        return [getattr(drawn, field) for drawn in self.drawn]


@dataclass(frozen=True, eq=False)
class Layer:
    """A part at one place in the stack."""

    name: str
    elements: tuple[Element, ...]  # back to front
    visible: NDArray  # (T,) bool
    stepped: bool  # held drawings, such as on twos: players must not draw in-betweens


@dataclass(frozen=True, eq=False)
class Page:
    """All layers, back to front, on a page of `size` (width, height), and when its frames are shown."""

    layers: tuple[Layer, ...]
    size: tuple[int, int]
    starts: NDArray  # (T,) seconds from the first frame
    duration: float  # seconds; the last frame has its share
    fps: float
    background: str  # a colour such as #ffeedd behind all layers, or ""


def page_of(performance: Performance, width: int | None = None, background: Any = None) -> Page:
    """The performance's elements on a page as large as its stage, or `width` pixels wide, over a colour or nothing."""
    if not performance.roles:
        raise InputError("a vector file needs somebody who plays, this performance has no roles: name one in the cast")
    if width is not None and width < 1:
        raise InputError(f"the picture's width must be at least 1 pixel, it came as {width}: give a larger --size")
    zoom = 1.0 if width is None else width / performance.size[0]
    order = np.stack([role.order for role in performance.roles])  # (R, T)
    ranks = order.argsort(axis=0, kind="stable").argsort(axis=0, kind="stable")
    made = [_elements(role, zoom) for role in performance.roles]
    layers = []
    for rank in range(len(performance.roles)):
        for number, role in enumerate(performance.roles):
            seen = role.visible & (ranks[number] == rank)
            if seen.any():
                layers.append(Layer(role.target.part, made[number], seen, plays_in_steps(role.points)))
    starts = np.asarray(performance.times, float) - performance.times[0]
    size = (max(1, round(zoom * performance.size[0])), max(1, round(zoom * performance.size[1])))
    duration = float(starts[-1] + 1 / performance.fps)
    return Page(tuple(layers), size, starts, duration, performance.fps, _color(background))


def one_frame(performance: Performance, t: int) -> Performance:
    """Frame t as a performance of its own."""
    one = slice(t, t + 1)
    roles = tuple(
        replace(
            role,
            points=role.points[one],
            weights=role.weights[one],
            visible=role.visible[one],
            order=role.order[one],
            mixed=role.mixed[one],
            joint=role.joint[one],
            limbs=None,
        )
        for role in performance.roles
    )
    return replace(performance, roles=roles, times=performance.times[one])


def refused(layer: Layer, kind: str, holds: str = "vector drawings and pictures that keep their shape") -> InputError:
    """What to say of a part that a format, such as "a Lottie file", cannot show."""
    solid = any(isinstance(element.drawn[0], DrawnMesh) for element in layer.elements)
    still = holds.endswith("drawings")
    played = "a 3-D model" if solid else "a picture" if still else "a picture that bends or changes into another"
    return InputError(
        f"part {layer.name!r}: {kind} can hold {holds}, this part is played by {played}: make a .webm, a .mov, "
        "a folder of pictures or a .glb instead"
    )


def kept(values: Sequence[Any], stepped: bool) -> list[int]:
    """Which of T values a curve needs: where they change, and where a hold ends unless it plays in steps."""
    changes = [True] + [one != other for one, other in pairwise(values)]
    if not stepped:
        changes = [here or after for here, after in zip(changes, [*changes[1:], False], strict=True)]
    return [t for t, keep in enumerate(changes) if keep]


def grains(values: Any) -> NDArray:
    """Lengths in whole hundredths of a pixel."""
    return np.round(GRAIN * np.asarray(values, float)).astype(int)


def _color(background: Any) -> str:
    from matplotlib.colors import is_color_like, to_hex

    if background is None or (isinstance(background, str) and not background):
        return ""
    if not isinstance(background, str) or not is_color_like(background):
        given = repr(background) if isinstance(background, str) else "a picture"
        raise InputError(
            f"a vector file can have a colour behind it, such as white or #ffeedd, it got {given}: give one"
        )
    return to_hex(background)


def _elements(role: Role, zoom: float) -> tuple[Element, ...]:
    frames = []
    for t in range(len(role.points)):
        points = (role.points[t] + 0.5) * zoom  # from the corner, unlike the stage's own
        frames.append(role.target.posed(points, role.weights[t], role.scale * zoom))
    return tuple(Element(getattr(drawn[0], "name", "picture"), drawn) for drawn in zip(*frames, strict=True))
