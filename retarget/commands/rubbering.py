"""The command that makes motion capture rubber."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from retarget.console import Out, stem, tell

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from mocap.rubber.rubber import RubberMotion
    from mocap.skeleton import SkeletonMotion


def exaggerate(
    clip: Path,
    out: Out = None,
    *,
    omega: float | None = None,
    part: tuple[str, ...] = (),
    sigma: float = 0.15,
    stretch: float = 1.6,
    squash: float = 0.5,
    hose: float = 1.0,
    follow: float = 0.5,
    slide: bool = False,
    through: bool = False,
    loop: bool = False,
    fps: float | None = None,
    strict: bool = False,
) -> str:
    """Exaggerate motion capture and bend its limbs like rubber.

    Parameters
    ----------
    clip
        A *.bvh file.
    out
        A .bvh with the sub-joints as joints, in metres; or stick figures, captured beside exaggerated, as .mp4, .webm,
        .gif or a folder of PNG.  NAME.rubber.bvh beside you if not given.
    omega
        How many times; 1 nothing, 5 what the paper used.  Without it, as much as `stretch` allows in each limb.
    part
        How many times a part of the body of its own: "left arm=2"; `tooncap mocap report` names the parts.
    sigma
        Seconds of the average that the motion is pushed away from.
    stretch
        How many times as long as it is a link may become.
    squash
        0 to 1: how far stretch takes turns with squash.
    hose
        0 to 1: how round limbs bend; 0 leaves their links straight.
    follow
        0 to 1: how far limbs swing after on springs.
    slide
        Let feet go where the exaggeration takes them.
    through
        Let limbs go through each other.
    loop
        The clip is one round of a loop, and stays one.
    fps
        Frames a second, where the file does not say so or is wrong.
    strict
        Refuse a file that breaks the format's rules, rather than mend what can be mended.
    """
    import numpy as np

    from capture.pictures.encode import write_clip
    from capture.progress import progress
    from mocap.bvh import read_bvh, write_bvh
    from mocap.report import report
    from mocap.rubber import rubber
    from mocap.units import upright

    motion = upright(read_bvh(clip, strict, fps))
    wanted = _omegas(motion, omega, part)
    feet = () if slide else None
    made = rubber.make_rubber(
        *(motion, wanted, sigma, stretch, squash, hose, follow, feet), apart=not through, loop=loop
    )
    tell(f"{clip}: {note}" for note in made.source.notes)
    out = out or Path(stem(clip) + ".rubber.bvh")
    if out.suffix.lower() == ".bvh":
        write_bvh(rubber.on_skeleton(made), out)
    else:
        step = max(round(motion.fps / 60), 1)  # no screen shows more
        frames = range(0, len(made), step)
        write_clip(out, progress(_before_and_after(made, frames), "drawing", len(frames)), motion.fps / step)
    card = report(motion, made)
    joints, low, high = made.subjoints, *np.quantile(made.stretch, [0.01, 0.99])
    skate = f", feet skate {card.skate:.1f} cm/s (captured {card.skate_before:.1f})" if np.isfinite(card.skate) else ""
    return (
        f"{out}: {len(made)} frames, {len(joints)} sub-joints of {len(joints.skeleton)} joints, sub-links {low:.2f} to "
        f"{high:.2f} times as long, jerk {card.jerk:.2f} times as captured{skate}"
    )


def _omegas(motion: "SkeletonMotion", omega: float | None, parts: tuple[str, ...]) -> "NDArray | float | None":
    """Each joint's omega, nan where it is to be found."""
    import numpy as np

    from capture.errors import InputError
    from mocap.body import find_body

    if not parts:
        return omega
    body = find_body(motion.skeleton, motion.positions())
    omegas = np.full(len(motion.skeleton), np.nan if omega is None else omega)
    for said in parts:
        name, _, amount = said.rpartition("=")
        try:
            of_part = float(amount)
        except ValueError:
            of_part = np.nan
        if name not in body.parts or not np.isfinite(of_part):
            raise InputError(
                f'--part must be a part of the body and a number, such as "{next(iter(body.parts), "spine")}=2", got '
                f"{said!r}; this body has {', '.join(body.parts) or 'no parts that could be told'}"
            )
        omegas[body.label == name] = of_part
    return omegas


def _before_and_after(made: "RubberMotion", frames: range) -> Iterator["NDArray"]:
    """Pictures of stick figures, as captured on the left, as made on the right."""
    import numpy as np

    from mocap import sticks
    from mocap.rubber import rubber

    before = rubber.plain(made.source)
    view = sticks.view_of(np.concatenate([before.positions, made.positions], axis=1), (480, 480))
    joints = made.subjoints
    colors = sticks.sides(tuple(joints.skeleton.names[joint] for joint in joints.joint))
    thick = np.clip(0.13 * joints.skeleton.lengths()[joints.joint], 0.012, 0.055)
    ground = float(np.quantile(before.positions[..., 1].min(axis=1), 0.05))
    shown = list(frames)
    view = replace(view, middle=view.middle[shown])
    figures = (
        sticks.draw(it.positions[shown], joints.parents, view, thick * it.thickness[shown], colors, ground)
        for it in (before, made)
    )
    yield from (np.concatenate(pair, axis=1) for pair in zip(*figures))
