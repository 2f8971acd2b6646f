"""The commands for motion capture as it is."""

from pathlib import Path
from typing import TYPE_CHECKING

from retarget.commands import flags
from retarget.console import captured

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from mocap.skeletons.skeleton import SkeletonMotion


def report(clip: Path, made: Path | None = None, *, fps: flags.Rate = None, strict: flags.Strict = False) -> str:
    """Say what a motion file holds, how its joints were understood, and how clean its motion is.

    Parameters
    ----------
    clip
        A *.bvh file.
    made
        Another, made of it: it is measured against the first, by the joints of the same names.
    """
    from mocap.bodies.body import find_body
    from mocap.report import report as card
    from mocap.skeletons.bvh import read_bvh
    from mocap.skeletons.units import upright

    motion = captured(clip, strict, fps)
    places = None if made is None else _same_joints(motion, clip, upright(read_bvh(made, strict, fps)), made)
    body = find_body(motion.skeleton, motion.positions())
    width = max(map(len, body.parts), default=0)
    parts = [
        f"  {name:<{width}}  {', '.join(motion.skeleton.names[joint] for joint in joints)}"
        for name, joints in body.parts.items()
    ]
    lines = card(motion, places).lines(captured=made is None)
    return "\n".join([f"{clip}: {body.told}", *parts, *lines])


def _same_joints(motion: "SkeletonMotion", clip: Path, other: "SkeletonMotion", made: Path) -> "NDArray":
    """Where the other motion has the joints of this one (T, J, 3)."""
    from capture.errors import InputError

    lacks = [name for name in motion.skeleton.names if name not in other.skeleton.names]
    if lacks or len(motion) != len(other):
        what = f"it has no {lacks[0]}" if lacks else f"it has {len(other)} frames, not {len(motion)}"
        raise InputError(f"{made} must have the joints and as many frames as {clip}, {what}: give what was made of it")
    return other.positions()[:, [other.skeleton.names.index(name) for name in motion.skeleton.names]]
