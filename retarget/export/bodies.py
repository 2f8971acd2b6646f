"""What a performance hands to a 3-D file: every role as a mesh in a few shapes, mixed and placed in every frame.

    v(t) = A(t) . (S_0 + sum_d w_d(t) (S_d - S_0))        morph targets, then a node: the equation of a motion

The stage becomes a space whose unit is the height of the canvas: x to the right from its middle, y up from its lower
edge, z to the viewer.  A body stands on its own origin, at the foot of its key 0, so that its node turns about there.

The shapes are the rows of the motion, in-betweens included, not the keys alone: a mixture of keys would cut the
corners that as-rigid-as-possible in-betweens go round.  Rows that are never used cost nothing, an exporter drops
them.  The weights folded onto keys are handed on beside them for whoever wants to edit the motion.
"""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.fit.action import centre_lines
from capture.motion import affine
from retarget.characters.bodies.body import Body as Several
from retarget.characters.drawings.bend import Bent
from retarget.characters.drawings.drawing import Drawing
from retarget.characters.figures.puppet import Puppet
from retarget.characters.figures.skin import skinned
from retarget.characters.models import lift
from retarget.characters.models.mesh import Mesh
from retarget.characters.photos.picture import Picture
from retarget.export import baked, jointed, sheets, solids
from retarget.export.jointed import Skin
from retarget.export.nodes import lifted
from retarget.export.sheets import Look, Sheets
from retarget.stage.perform import Performance, Role

BETWEEN_LAYERS = 0.01
"""A part that is drawn later lies this much nearer to the viewer, in canvas heights; its elements share the room.

Programs that trace rays do not know a drawn order, they only know depth.
"""

EXACT = 1e-5
"""Points of a body are within this share of its size of the role's."""


@dataclass(frozen=True, eq=False)
class Body:
    """One role as a mesh of V vertices for a 3-D file, in canvas heights, y up."""

    name: str
    shape_names: tuple[str, ...]  # D
    shapes: NDArray  # (D, V, 3) about the body's own origin; the first is the base
    weights: NDArray  # (T, D), rows sum to 1; they may lie outside 0 to 1
    place: NDArray  # (T, 3, 4), from the body's own space to the stage
    faces: NDArray  # (F, 3)
    looks: tuple[Look, ...] = ()  # pictures it wears, one at a time
    worn: NDArray | None = None  # (T,) the number of the look; None where there is one at most
    visible: NDArray | None = None  # (T,) bool; None is always
    depth: NDArray | None = None  # (T,) how much nearer to the viewer it is drawn; None is 0
    color: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)  # times the look, where there is one; sRGB
    normals: NDArray | None = None  # (D, V, 3) of a lit body; None is a drawing, shown in its own colours
    colors: NDArray | None = None  # (V, 4) at the vertices, times the colour; sRGB
    skin: Skin | None = None  # with one look at most
    notes: dict[str, Any] = field(default_factory=dict)  # plain data for the file's extras


def bodies(performance: Performance) -> tuple[Body, ...]:
    """Every role of a performance as a body, in the order of the roles; a model has one for each of its materials.

    A role whose pictures melt into each other wears the one of the greatest share: what all 3-D programs can
    show is a drawing changed for another, as in cut-out animation.
    """
    if not performance.roles:
        raise InputError("a 3-D file needs somebody who plays, this performance has no roles: name a part in the cast")
    depths = _depths(performance)
    found: list[Body] = []
    for role, depth in zip(performance.roles, depths, strict=True):
        if isinstance(role.target, Several):  # its seams are in its points: what bends it becomes shapes
            role = replace(role, target=replace(role.target.inner, part=role.target.part))
        if isinstance(role.target, Puppet):
            found += _jointed(role, performance.size, depth)
        elif isinstance(role.target, Mesh):
            found += _solid(role, performance.size, depth)
        else:
            found.append(_body(role, performance.size, depth))
    return tuple(found)


def _depths(performance: Performance) -> NDArray:
    """How much nearer each role is drawn (R, T): what is drawn later lies before all of what is drawn earlier."""
    order = np.stack([role.order for role in performance.roles])  # (R, T)
    pile = order.argsort(axis=0, kind="stable")
    solid = [role.points.shape[-1] == 3 for role in performance.roles]
    reach = [
        np.abs(role.points[..., 2]).max() / performance.size[1] if s else 0.0
        for role, s in zip(performance.roles, solid)
    ]
    room = BETWEEN_LAYERS + 2 * np.array(reach)
    before = np.cumsum(room[pile], axis=0) - room[pile]
    return np.take_along_axis(before, pile.argsort(axis=0), axis=0) + np.array(reach)[:, None]


def stage_to_space(size: tuple[int, int]) -> NDArray:
    """The map (2, 3) from stage pixels, y down, to canvas heights, y up, from the middle of the lower edge."""
    width, height = size
    return np.array([[1 / height, 0, -(width - 1) / (2 * height)], [0, -1 / height, (height - 0.5) / height]])


def _body(role: Role, size: tuple[int, int], depth: NDArray) -> Body:
    shown = {"visible": role.visible, "depth": depth, "notes": _notes(role)}
    if isinstance(role.target, Bent):
        dress = sheets.of_bent(role.target, role.scale * role.target.unit)
        return _baked(role.target.part, _bent(role, dress.shapes[0]), size, dress, **shown)
    dress = _sheets(role)
    shown["worn"] = role.weights.argmax(axis=1) if len(dress.looks) > 1 else None
    mixed = np.tensordot(role.mixed, role.target.shapes(role.rows), axes=1)  # (T, M, 2)
    placed = affine.fit(mixed, role.points)
    left = role.points - affine.apply(placed, mixed)
    if np.abs(left).max() > EXACT * np.ptp(role.points, axis=1).max():  # staged point by point
        vertices = affine.apply(placed, np.tensordot(role.mixed, dress.shapes, axes=1))
        mesh = left[:, : role.target.keys.points.shape[1]]
        vertices += np.stack([dress.carry @ moved for moved in mesh])
        return _baked(role.target.part, vertices, size, dress, **shown)
    low, high = role.target.box
    foot, unit = np.array([0.5 * (low[0] + high[0]), high[1]]), role.scale / size[1]
    own = np.array([[unit, 0, -unit * foot[0]], [0, -unit, unit * foot[1]]])
    place = affine.compose(affine.compose(stage_to_space(size), placed), affine.invert(own))
    names = tuple(_row_name(row, role.target.keys.names) for row in role.rows)
    shapes = _layered(affine.apply(own, dress.shapes), dress)
    return Body(role.target.part, names, shapes, role.mixed, lifted(place), dress.faces, looks=dress.looks, **shown)


def _solid(role: Role, size: tuple[int, int], depth: NDArray) -> list[Body]:
    """A model's bodies: its keys are the shapes, and what is left of its way is the place."""
    target = role.target
    (low, high), unit = target.box, role.scale / size[1]
    flat = np.array([[unit, 0, -unit * 0.5 * (low[0] + high[0])], [0, -unit, unit * high[1]]])
    own = affine.compose(lift.lifted(flat, unit), target.view)
    mixed = np.tensordot(role.weights, target.keys.points, axes=1)
    placed = affine.fit(mixed, role.points)
    if not _moves_as_one(role, placed, mixed):
        return _baked_solid(role, size, depth)
    stage = lift.lifted(stage_to_space(size), 1 / size[1])
    place = affine.compose(stage, affine.compose(placed, affine.invert(own)))
    shapes = affine.apply(own, target.keys.points)
    parts = solids.pieces(target, own)
    return [
        _piece(
            role,
            part,
            _numbered(target.part, number, parts),
            depth,
            shape_names=target.keys.names,
            shapes=shapes[:, part.points],
            weights=role.weights,
            place=place,
        )
        for number, part in enumerate(parts)
    ]


def _jointed(role: Role, size: tuple[int, int], depth: NDArray) -> list[Body]:
    """A figure's bodies: its joints turn in the units of its file, and its place does all the rest."""
    target = role.target
    pose = target.posture(role.weights)
    unplaced = skinned(target.skin, target.rest, pose)
    placed = affine.fit(unplaced, role.points)
    if jointed.stretched(pose) or not _moves_as_one(role, placed, unplaced):
        return _baked_solid(role, size, depth)
    stage = lift.lifted(stage_to_space(size), 1 / size[1])
    skin = jointed.skin_of(target, role.weights)
    bound = replace(target.body, keys=replace(target.keys, points=target.rest[None]))
    parts = solids.pieces(bound, affine.identity(3))
    return [
        _piece(
            role,
            part,
            _numbered(target.part, number, parts),
            depth,
            shape_names=("bound",),
            shapes=target.rest[None, part.points],
            weights=np.ones((len(role.points), 1)),
            place=affine.compose(stage, placed),
            skin=replace(skin, joints=skin.joints[part.points], shares=skin.shares[part.points]),
        )
        for number, part in enumerate(parts)
    ]


def _moves_as_one(role: Role, placed: NDArray, mixed: NDArray) -> bool:
    """Whether maps (T, d, d + 1) bring what was mixed (T, M, d) to where the role is."""
    return np.abs(role.points - affine.apply(placed, mixed)).max() <= EXACT * np.ptp(role.points, axis=1).max()


def _sheets(role: Role) -> Sheets:
    if isinstance(role.target, Picture):
        return sheets.of_picture(role.target, role.rows)
    if isinstance(role.target, Drawing):
        return sheets.of_drawing(role.target, role.rows, role.scale)
    raise InputError(
        f"part {role.target.part!r}: a 3-D file can hold drawings and pictures, this part is played by a "
        f"{type(role.target).__name__.lower()}: make a video of it instead"
    )


def _bent(role: Role, vertices: NDArray) -> NDArray:
    """Where vertices (V, 2) of a bent drawing are on the stage in every frame (T, V, 2)."""
    riding = role.target.carrying(vertices)
    return np.stack([riding.along_line(line, role.scale * riding.unit) for line in centre_lines(role.mesh())])


def _baked(name: str, points: NDArray, size: tuple[int, int], dress: Sheets, **shown: Any) -> Body:
    """A body from its vertices on the stage (T, V, 2) alone: the affine part of the way, and shapes for the rest."""
    found = baked.fewest(affine.apply(stage_to_space(size), points), EXACT)
    shapes = _layered(found.shapes, dress)
    return Body(name, found.names, shapes, found.weights, lifted(found.place), dress.faces, looks=dress.looks, **shown)


def _baked_solid(role: Role, size: tuple[int, int], depth: NDArray) -> list[Body]:
    """A model's or a figure's bodies from its points on the stage alone, where neither keys nor joints tell them."""
    stage = lift.lifted(stage_to_space(size), 1 / size[1])
    found = baked.fewest(affine.apply(stage, role.points), EXACT)
    target = role.target.body if isinstance(role.target, Puppet) else role.target
    near = baked.nearby(found.shapes)  # shapes of a decomposition are far from any that is seen, and so their normals
    parts = solids.pieces(replace(target, keys=replace(target.keys, points=near)), affine.identity(3))
    return [
        _piece(
            role,
            part,
            _numbered(target.part, number, parts),
            depth,
            shape_names=found.names,
            shapes=found.shapes[:, part.points],
            weights=found.weights,
            place=found.place,
            normals=baked.far(part.normals),
        )
        for number, part in enumerate(parts)
    ]


def _piece(role: Role, part: solids.Piece, name: str, depth: NDArray, **more: Any) -> Body:
    """A piece of a model as a body, with what it looks like."""
    looks = () if part.look is None else (part.look,)
    shown = {"visible": role.visible, "depth": depth, "notes": _notes(role), "normals": part.normals}
    return Body(name, **{**shown, **more}, faces=part.faces, looks=looks, color=part.color, colors=part.colors)


def _numbered(name: str, number: int, parts: list[solids.Piece]) -> str:
    return name if len(parts) == 1 else f"{name} {number}"


def _layered(points: NDArray, dress: Sheets) -> NDArray:
    """Points of the plane (D, V, 2) as points of space (D, V, 3), each element a little before the one behind it."""
    depth = np.broadcast_to(0.9 * BETWEEN_LAYERS * dress.level, points.shape[:-1])
    return np.concatenate([points, depth[..., None]], axis=-1)


def _row_name(row: NDArray, names: tuple[str, ...]) -> str:
    i, j, s = int(row[0]), int(row[1]), float(row[2])
    return names[i] if s == 0 else f"{names[i]} to {names[j]} {s:.0%}"


def _notes(role: Role) -> dict[str, Any]:
    return {"keys": list(role.target.keys.names), "key_weights": np.round(role.weights, 6).tolist()}
