"""The command that poses a figure by dragging its joints."""

from pathlib import Path
from typing import TYPE_CHECKING

from retarget.commands import flags
from retarget.commands.onward import write_performed
from retarget.console import Out, captured, stem

if TYPE_CHECKING:
    from mocap.posing.session import Session
    from mocap.skeletons.skeleton import Skeleton


def pose(
    clip: Path,
    out: Out = None,
    *,
    frame: int = 0,
    drag: list[str] | None = None,
    by: list[str] | None = None,
    pin: list[str] | None = None,
    free: bool = False,
    turn: float = 30.0,
    fps: float | None = None,
    strict: flags.Strict = False,
) -> str:
    """Pose a figure: drag its joints, and the rest of it follows as if it hung on springs.

    Parameters
    ----------
    clip
        A *.bvh file: whose figure, and the pose to begin with.
    out
        A *.bvh of one frame, a *.glb of the figure made of hoses, or a *.png of it.
    frame
        Which frame of the clip to begin with.
    drag
        A joint and where it is to go, as in "RightHand 0.2 1.5 0.3": metres, x right, y up, z to the viewer.  May be
        given several times, and is done in that order.
    by
        A joint and how far it is to go, as in "RightHand 0 0.4 0.1"; after what is dragged to places.
    pin
        A joint that stays where it is; may be given several times.
    free
        Let knees and elbows bend any way.
    turn
        Degrees that the figure is turned about the vertical in a picture.
    fps
        Frames a second of the clip, where the file does not say so or is wrong.
    """
    import numpy as np

    from capture.errors import InputError
    from mocap.posing import limits, poses, session
    from mocap.skeletons.bvh import write_bvh
    from retarget.characters.figures.dancer import Dancer

    out = out or Path(stem(clip) + ".pose.bvh")
    if out.suffix.lower() not in (".bvh", ".glb", ".png"):
        raise InputError(
            f"{out}: a pose is written as .bvh, .glb or .png, not as {out.suffix or 'a name without an ending'}"
        )
    motion = captured(clip, strict, fps)
    skeleton = motion.skeleton
    posing = session.begun(skeleton, poses.pose_of(motion, frame), () if free else limits.usual(skeleton))
    for name in pin or ():
        _done(posing, {"do": "pin", "joint": name})
    begin, off = posing.pose, (0.0, "")
    moves = [(*_move(move, skeleton), False) for move in drag or ()] + [
        (*_move(move, skeleton), True) for move in by or ()
    ]
    for joint, numbers, relative in moves:
        target = np.array(numbers) + (posing.pose.positions[joint] if relative else 0)
        _done(posing, {"do": "drag", "joint": joint, "to": target.tolist()})
        _done(posing, {"do": "drop"})
        far = float(np.linalg.norm(posing.pose.positions[joint] - target))
        off = max(off, (far, skeleton.names[joint]))
    made = poses.motion_of(skeleton, [posing.pose], motion.fps)
    if out.suffix.lower() == ".png":
        _picture(posing, out, np.radians(turn))
    elif out.suffix.lower() == ".glb":
        write_performed(made, Dancer(skeleton, poses.rest_of(skeleton).turns), out, None, 480, None)
    else:
        write_bvh(made, out)
    moved = np.linalg.norm(posing.pose.positions - begin.positions, axis=1)
    most = int(moved.argmax())
    said = f"{out}: {len(moves)} drag{'s' * (len(moves) != 1)}, {skeleton.names[most]} went {moved[most]:.2f} m"
    if off[0] > 0.01:
        said += f"; {off[1]} is {off[0]:.2f} m short of where it was dragged, pins and links let it no nearer"
    return said


def _done(posing: "Session", message: dict) -> None:
    from capture.errors import InputError

    error = posing.send(message)["error"]
    if error:
        raise InputError(error)


def _move(text: str, skeleton: "Skeleton") -> tuple[int, list[float]]:
    """A joint, whose name may hold spaces, and three numbers."""
    from capture.errors import InputError
    from mocap.posing.session import joint_named

    words = text.replace(",", " ").split()
    try:
        numbers = [float(word) for word in words[-3:]]
    except ValueError:
        numbers = []
    if len(words) < 4 or len(numbers) < 3:
        raise InputError(f"a drag must be a joint and three numbers, as in 'RightHand 0.2 1.5 0.3', not {text!r}")
    return joint_named(skeleton, " ".join(words[:-3])), numbers


def _picture(posing: "Session", out: Path, turn: float) -> None:
    from PIL import Image

    from capture.files import written_beside
    from mocap import sticks

    places = posing.pose.positions[None]
    skeleton = posing.skeleton
    view = sticks.view_of(places, (480, 480), turn)
    size = float(skeleton.lengths().max())
    drawn = sticks.draw(places, skeleton.parents, view, 0.06 * size, sticks.sides(skeleton.names))
    with written_beside(out) as beside:
        Image.fromarray(next(iter(drawn))).save(beside)
