"""The command that makes motion capture rubber."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from retarget.commands import flags
from retarget.console import Out, stem, tell

SPARSE = 50.0
"""Of fewer frames a second it is said that quick movements are left alone: films have 24 or 30."""

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from mocap.report import Report
    from mocap.rubber.rubber import RubberMotion
    from mocap.skeletons.skeleton import SkeletonMotion


def exaggerate(
    clip: Path,
    out: Out = None,
    *,
    omega: float | None = None,
    part: tuple[str, ...] = (),
    sigma: float = 0.15,
    stretch: flags.Stretch = 1.6,
    squash: flags.Squash = 0.5,
    hose: float = 1.0,
    follow: flags.Swing = 0.5,
    slide: flags.Slide = False,
    through: bool = False,
    hits: bool = False,
    hit: tuple[str, ...] = (),
    ease: flags.Ease = 0.0,
    drawings: flags.Drawings = None,
    loop: flags.Loop = False,
    fps: flags.Rate = None,
    strict: flags.Strict = False,
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
    hose
        0 to 1: how round limbs bend; 0 leaves their links straight.
    through
        Let limbs go through each other.
    hits
        Punches and kicks still hit: they are found, and in those frames hands and feet are where they were.
    hit
        A hit of your own: "right arm=145", a part of the body and a frame.
    """
    import numpy as np

    from mocap.curves import timing
    from mocap.report import report
    from mocap.rubber import exaggerate as pushing
    from mocap.rubber import rubber
    from mocap.skeletons.bvh import read_bvh
    from mocap.skeletons.units import upright

    motion = upright(read_bvh(clip, strict, fps))
    wanted = _omegas(motion, omega, part)
    feet = () if slide else None
    blows = _hits(motion, hits, hit)
    made = rubber.make_rubber(
        *(motion, wanted, sigma, stretch, squash, hose, follow, feet), apart=not through, loop=loop, hits=blows
    )
    tell(f"{clip}: {note}" for note in made.source.notes)
    calm = float(pushing.calm_of(motion.fps, sigma))
    if motion.fps < SPARSE:
        tell([f"{clip}: at {motion.fps:.4g} frames a second what is quicker than {calm:.2g} s is not exaggerated"])
    for joint in dict.fromkeys(joint for joint, _ in blows):
        frames = ", ".join(str(frame) for other, frame in blows if other == joint)
        tell([f"{clip}: {motion.skeleton.names[joint]} hits in frame {frames}"])
    out = out or Path(stem(clip) + ".rubber.bvh")
    card = report(motion, made)
    shown = moments(made.positions[:, made.subjoints.ends], motion.fps, ease, drawings, [frame for _, frame in blows])
    write_figure(out, rubber.plain(made.source), timing.played_rubber(made, shown))
    joints, low, high = made.subjoints, *np.quantile(made.stretch, [0.01, 0.99])
    told = f", {len(blows)} hit" + "s" * (len(blows) > 1) if blows else ""
    return (
        f"{out}: {len(made)} frames, {len(joints)} sub-joints of {len(joints.skeleton)} joints, sub-links {low:.2f} to "
        f"{high:.2f} times as long, jerk {card.jerk:.2f} times as captured{skating(card)}{told}"
    )


def skating(card: "Report") -> str:
    """How far feet skate, to go on a closing line; nothing where they never stand."""
    if card.skate != card.skate:  # NaN
        return ""
    return f", feet skate {card.skate:.1f} cm/s (captured {card.skate_before:.1f})"


def moments(places: "NDArray", fps: float, ease: float, drawings: float | None, keep: Sequence[int] = ()) -> "NDArray":
    """Which moments (T,) of joints' places (T, J, 3) to show: eased around poses, and so many drawings a second."""
    from mocap.curves import timing

    shown = timing.eased(places, fps, ease, keep)
    return shown if drawings is None else shown[timing.on_twos(len(shown), fps, drawings).astype(int)]


def write_figure(out: Path, before: "RubberMotion", made: "RubberMotion") -> None:
    """Write what was made as a .bvh with its sub-joints; or stick figures, `before` on the left, as a clip."""
    from capture.pictures.encode import write_clip
    from capture.progress import progress
    from mocap.rubber import rubber
    from mocap.skeletons.bvh import write_bvh

    if out.suffix.lower() == ".bvh":
        write_bvh(rubber.on_skeleton(made), out)
        return
    step = max(round(made.source.fps / 60), 1)  # no screen shows more
    frames = range(0, len(made), step)
    pictures = progress(_before_and_after(before, made, frames), "drawing", len(frames))
    write_clip(out, pictures, made.source.fps / step)


def _hits(motion: "SkeletonMotion", find: bool, said: tuple[str, ...]) -> list[tuple[int, int]]:
    """The joints and frames that hit: those found, and those `said`, such as "right arm=145"."""
    from capture.errors import InputError
    from mocap.bodies.body import find_body
    from mocap.rubber.hits import find_hits, tip
    from mocap.skeletons.units import STATURE, stature

    if not (find or said):
        return []
    places = motion.positions()
    body = find_body(motion.skeleton, places)
    blows = list(find_hits(places, body, motion.fps, stature(motion, body) / STATURE or 1.0)) if find else []
    limbs = [name for name in body.parts if name.endswith(("arm", "leg"))]
    for text in said:
        name, _, frame = text.rpartition("=")
        if name not in limbs or not frame.isdigit() or int(frame) >= len(motion):
            first, last = next(iter(limbs), "right arm"), len(motion) - 1
            raise InputError(
                f'--hit must be an arm or a leg and a frame, such as "{first}=41", got {text!r}; '
                f"this body has {', '.join(limbs) or 'none that could be told'}, the clip frames 0 to {last}"
            )
        blows.append((tip(name, body), int(frame)))
    return blows


def _omegas(motion: "SkeletonMotion", omega: float | None, parts: tuple[str, ...]) -> "NDArray | float | None":
    """Each joint's omega, nan where it is to be found."""
    import numpy as np

    from capture.errors import InputError
    from mocap.bodies.body import find_body

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


def _before_and_after(before: "RubberMotion", made: "RubberMotion", frames: range) -> Iterator["NDArray"]:
    """Pictures of stick figures, as captured on the left, as made on the right."""
    import numpy as np

    from mocap import sticks

    view = sticks.view_of(np.concatenate([before.positions, made.positions], axis=1), (480, 480))
    ground = float(np.quantile(before.positions[..., 1].min(axis=1), 0.05))
    shown = list(frames)
    view = replace(view, middle=view.middle[shown])
    figures = []
    for it in (before, made):
        joints = it.subjoints
        colors = sticks.sides(tuple(joints.skeleton.names[joint] for joint in joints.joint))
        thick = np.clip(0.13 * joints.skeleton.lengths()[joints.joint], 0.012, 0.055) * it.thickness[shown]
        figures.append(sticks.draw(it.positions[shown], joints.parents, view, thick, colors, ground))
    yield from (np.concatenate(pair, axis=1) for pair in zip(*figures))
