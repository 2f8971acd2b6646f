"""The one protocol: whatever can play a part, be it a drawing, a picture or, later, a model."""

from typing import Any, Protocol

from numpy.typing import NDArray

from capture.motion.keys import KeySet

REST = "rest"
"""The key of a target that keeps its shape: only the captured affine map is lent to it."""


class Target(Protocol):
    """A character that plays one part, in its own units, y down; the stage asks no more of it than this.

    `perform` mixes `shapes` by the captured weights, places them, and hands each frame's points to `posed`.

    A target in space, with points of three columns, y up, has two fields more (`lift`): `view` (3, 4), from its own
    space to what is seen of it, and `depth`, what becomes of its depth.  Its pivot is a point of its own space.
    """

    part: str
    keys: KeySet  # its own keys, aligned to its own key 0
    box: NDArray  # (2, 2) least and greatest corner of key 0 as it is seen
    height: float  # how tall it stands, times the source's height
    pivot: NDArray | None  # (2 or 3,) in key 0; None takes the source's

    def shapes(self, rows: NDArray) -> NDArray:
        """All its points (D, M, 2 or 3) for rows (D, 3), drawn by its own rule; the mesh's N come first."""
        ...

    def posed(self, points: NDArray, weights: NDArray, scale: float) -> list[Any]:
        """Drawn things, back to front, for one frame's points (M, 2 or 3) on the stage.

        `weights` (K,) are folded onto keys; `scale` is stage pixels for one of its own units.
        """
        ...


def parts_of(target: Target) -> tuple[str, ...]:
    """The parts a target plays: its own, or several where it is one body (`body`)."""
    return getattr(target, "parts", (target.part,))
