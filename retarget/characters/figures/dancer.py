"""Who dances: a skeleton that came with motion capture, a model's own, or one that is built in."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion
from retarget.characters.figures.hoses import hoses, rods
from retarget.characters.figures.skin import Skin
from retarget.characters.models.model import Model

BUILT_IN = ("human", "flower", "lamp")

TALL = 1.0
"""Metres: a drawing does not tell how tall what it shows is."""


@dataclass(frozen=True, eq=False)
class Dancer:
    """A skeleton in metres, y up, how it stands at rest, and its body where it has one."""

    skeleton: Skeleton
    rest: NDArray  # (J, 4)
    model: Model | None = None
    skin: Skin | None = None
    unit: float = 1.0  # metres that a unit of the model is
    notes: tuple[str, ...] = ()
    drawing: Path | None = None  # that it is drawn as

    def places(self) -> NDArray:
        """Where its joints are at rest (J, 3)."""
        from mocap.posing.postures import posed

        return posed(self.skeleton, np.zeros((1, len(self.skeleton), 3)), 1.0, self.rest).positions()[0]

    def body(self, motion: SkeletonMotion) -> tuple[Model, Skin, SkeletonMotion]:
        """The dancer's own model and skin, or one of hoses or rods, and a dance in their unit."""
        from mocap.posing.starting import kind_of

        if self.model is not None and self.skin is not None:
            skeleton = replace(motion.skeleton, offsets=motion.skeleton.offsets / self.unit)
            return self.model, self.skin, replace(motion, skeleton=skeleton, translation=motion.translation / self.unit)
        made = rods(self.skeleton) if kind_of(self.skeleton, self.rest) == "plant" else hoses(self.skeleton, motion)
        return *made, motion


def read_dancer(name: str) -> Dancer:
    """The dancer of a *.bvh, *.glb or *.gltf file, a drawing with marked joints, or a built-in one by its name."""
    suffix = Path(name).suffix.lower()
    if name in BUILT_IN:
        return _built_in(name)
    if suffix == ".bvh":
        return _of_bvh(name)
    if suffix in (".glb", ".gltf"):
        return _of_model(name)
    if suffix in (".svg", ".toml", ".yaml", ".yml") or Path(name).is_dir():
        return _of_drawing(name)
    raise InputError(
        f"a dancer must be a .bvh, .glb or .gltf file, a drawing with marked joints, or one of {', '.join(BUILT_IN)}; "
        f"got {name!r}"
    )


def _built_in(name: str) -> Dancer:
    from fixtures import plants, skeletons
    from mocap.posing.starting import standing

    figure = skeletons.walk(0.1) if name == "human" else getattr(plants, name)()
    skeleton = Skeleton(figure.names, figure.parents, np.array(figure.offsets, float))
    return Dancer(skeleton, standing(skeleton))


def _of_bvh(name: str) -> Dancer:
    """Its rest pose is that of its joints unturned; where nobody can stand so, the best of its frames."""
    from mocap.posing.rest import rested
    from mocap.posing.starting import kind_of, standing
    from mocap.skeletons.bvh import read_bvh
    from mocap.skeletons.units import upright

    read = read_bvh(name)
    motion = upright(read)
    if kind_of(motion.skeleton) != "plant":
        return Dancer(motion.skeleton, standing(motion.skeleton), notes=motion.notes)
    skeleton, rest = rested(motion)
    if kind_of(skeleton, rest) == "plant":  # which way is up is told of bodies only, and how large they are
        skeleton, rest = rested(read)
        size = float(np.ptp(read.positions()[0], axis=0).max())
        skeleton = replace(skeleton, offsets=skeleton.offsets * (TALL / size if size > 0 else 1.0))
    return Dancer(skeleton, rest, notes=motion.notes if kind_of(skeleton, rest) != "plant" else read.notes)


def _of_model(name: str) -> Dancer:
    """Its rest pose is the one its mesh was bound in, or its file's own where nobody can stand as bound."""
    from mocap.posing.starting import kind_of, standing
    from mocap.skeletons.units import upright
    from retarget.characters.figures.rubber_skin import motion_of_poses
    from retarget.characters.figures.skin import Pose, read_skin
    from retarget.characters.models.meshfiles import read_model

    skin = read_skin(name)
    if skin is None:
        raise InputError(f"{name} must have a skin to dance, it has none: give a model with joints, or a skeleton")
    at_rest = motion_of_poses(skin, Pose(*(part[None] for part in vars(skin.rest).values())), 24.0)
    size = float(at_rest.skeleton.lengths().sum())
    unit = float(upright(at_rest).skeleton.lengths().sum()) / size if size > 0 else 1.0
    skeleton = replace(at_rest.skeleton, offsets=unit * at_rest.skeleton.offsets)
    lies = kind_of(skeleton) == "plant" and kind_of(skeleton, at_rest.rotation[0]) != "plant"
    rest = standing(skeleton, at_rest.rotation[0] if lies else None)
    return Dancer(skeleton, rest, read_model(name), skin, unit)


def _of_drawing(name: str) -> Dancer:
    """Its joints as they are marked, flat, its root on the floor at the origin and all of it a metre tall."""
    from mocap.posing.starting import standing
    from retarget.characters.bodies.markfiles import read_marked

    marks = read_marked(name).marks
    tall = float(np.ptp(marks.places, axis=0).max())
    if not tall > 0:
        raise InputError(f"{name} must have its joints marked at different places, all are at one: move them apart")
    flat = marks.skeleton()
    offsets = flat.offsets * TALL / tall
    offsets[0] = 0
    skeleton = replace(flat, offsets=offsets)
    return Dancer(skeleton, standing(skeleton), drawing=Path(name))
