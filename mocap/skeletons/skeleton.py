"""Joints that hang on each other, and how they move.

A joint's own map (3, 4) goes from its space to its parent's; parents come before their children, a root has parent -1.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError


@dataclass(frozen=True, eq=False)
class Skeleton:
    """J joints at rest.  An end site is a joint without channels, that marks where the last link ends."""

    names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: NDArray  # (J, 3) from the parent joint

    def __post_init__(self) -> None:
        if not len(self.names) == len(self.parents) == len(self.offsets):
            raise InputError(
                f"a skeleton must have a name, a parent and an offset for each joint, it has {len(self.names)}, "
                f"{len(self.parents)} and {len(self.offsets)}"
            )
        for joint, parent in enumerate(self.parents):
            if not -1 <= parent < joint:
                raise InputError(
                    f"a joint's parent must come before it, or be -1 for a root: joint {joint}, {self.names[joint]!r}, "
                    f"hangs on joint {parent}; where joints hang on each other in a circle, cut it"
                )

    def __len__(self) -> int:
        return len(self.names)

    def children(self, joint: int) -> tuple[int, ...]:
        """The joints that hang on a joint."""
        return tuple(child for child, parent in enumerate(self.parents) if parent == joint)

    def path(self, joint: int) -> tuple[int, ...]:
        """The joints from the root to a joint."""
        path = [joint]
        while self.parents[path[-1]] >= 0:
            path.append(self.parents[path[-1]])
        return tuple(reversed(path))

    def lengths(self) -> NDArray:
        """How long the link above each joint is at rest (J,); a root has none: 0."""
        return np.where(np.array(self.parents) < 0, 0.0, np.linalg.norm(self.offsets, axis=1))


@dataclass(frozen=True, eq=False)
class SkeletonMotion:
    """A skeleton over T frames; after `units.upright` in metres, x right, y up, z to the viewer."""

    skeleton: Skeleton
    translation: NDArray  # (T, J, 3) from the parent joint; where it does not move, the skeleton's offset
    rotation: NDArray  # (T, J, 4) quaternions (x, y, z, w), against the parent joint
    fps: float
    notes: tuple[str, ...] = ()  # what a reader had to guess or mend, a sentence each

    def __len__(self) -> int:
        return len(self.translation)

    def world(self) -> NDArray:
        """Joints' maps into the world (T, J, 3, 4)."""
        return world_maps(self.skeleton.parents, own_maps(self.translation, self.rotation))

    def positions(self) -> NDArray:
        """Where the joints are (T, J, 3)."""
        return self.world()[..., 3]

    def part(self, first: int, stop: int) -> "SkeletonMotion":
        """The frames from `first` to before `stop`."""
        return replace(self, translation=self.translation[first:stop], rotation=self.rotation[first:stop])


def own_maps(translations: NDArray, rotations: NDArray, scales: NDArray | float = 1.0) -> NDArray:
    """Joints' maps into their parents' space (..., J, 3, 4): stretched (..., J, 3), turned (..., J, 4), carried."""
    from scipy.spatial.transform import Rotation

    rotations = np.asarray(rotations, float)
    turns = Rotation.from_quat(rotations.reshape(-1, 4)).as_matrix().reshape(*rotations.shape[:-1], 3, 3)
    linear = turns * np.broadcast_to(scales, (*rotations.shape[:-1], 3))[..., None, :]
    return np.concatenate([linear, np.asarray(translations, float)[..., None]], axis=-1)


def world_maps(parents: tuple[int, ...], own: NDArray) -> NDArray:
    """Joints' maps into the figure's space (..., J, 3, 4) from those into their parents'."""
    from capture.motion import affine

    world = np.empty_like(own)
    for joint, parent in enumerate(parents):
        mine = own[..., joint, :, :]
        world[..., joint, :, :] = mine if parent < 0 else affine.compose(world[..., parent, :, :], mine)
    return world
