"""The command that gives motion capture anticipation and follow-through."""

from pathlib import Path
from typing import TYPE_CHECKING

from retarget.commands import flags
from retarget.console import Out, captured, stem

if TYPE_CHECKING:
    from mocap.rubber.rubber import RubberMotion
    from mocap.skeletons.skeleton import SkeletonMotion


def anticipate(
    clip: Path,
    out: Out = None,
    *,
    amount: flags.Amount = 1.0,
    seconds: flags.Move = None,
    anticipation: flags.Before = 1.0,
    overshoot: flags.After = 1.0,
    follow: float = 0.05,
    away: float = 1.0,
    places: bool = False,
    ease: flags.Ease = 0.0,
    drawings: flags.Drawings = None,
    slide: bool = False,
    loop: flags.Loop = False,
    fps: flags.Rate = None,
    strict: flags.Strict = False,
) -> str:
    """Give motion capture anticipation and follow-through by the cartoon animation filter; no bone stretches.

    Parameters
    ----------
    clip
        A *.bvh file.
    out
        A .bvh, in metres; or stick figures, captured beside filtered, as .mp4, .webm, .gif or a folder of PNG.
        NAME.anticipated.bvh beside you if not given.
    follow
        Seconds that the tips come later than the body.
    away
        Besides: how many times as far as they are from their average joints turn.
    places
        Filter where joints are, not how they turn: links stretch.
    slide
        Let feet go where the filter takes them.
    """
    from mocap.curves import joint_filters, timing
    from mocap.report import report
    from mocap.rubber import rubber
    from mocap.skeletons.bvh import write_bvh
    from retarget.commands.rubbering import moments, skating, write_figure

    motion = captured(clip, strict, fps)
    how = (amount, seconds, follow, anticipation, overshoot, loop)
    turned = motion if away == 1 else joint_filters.exaggerated_angles(motion, away, loop=loop)
    if places:
        made = _moved(turned, motion, how, slide)
    else:
        turned = joint_filters.cartoon_angles(turned, *how) if amount else turned
        turned = turned if slide else _stood(turned, motion)
        made = rubber.plain(turned)
    card = report(motion, made)
    out = out or Path(stem(clip) + ".anticipated.bvh")
    shown = moments(made.positions[:, made.subjoints.ends], motion.fps, ease, drawings)
    if places or out.suffix.lower() != ".bvh":
        write_figure(out, rubber.plain(motion), timing.played_rubber(made, shown))
    else:
        write_bvh(timing.played_joints(turned, shown), out)
    low, _, high = card.stretch
    links = f"links {low:.2f} to {high:.2f} times as long" if places else "bones as long as they were"
    return f"{out}: {len(made)} frames, {links}, jerk {card.jerk:.2f} times as captured{skating(card)}"


def _moved(turned: "SkeletonMotion", motion: "SkeletonMotion", how: tuple, slide: bool) -> "RubberMotion":
    """The filter on where joints are."""
    import numpy as np

    from mocap.curves import filters, joint_filters
    from mocap.curves.ends import travel_of
    from mocap.rubber import feet, rubber, soles, subjoints

    amount, seconds, follow, anticipation, overshoot, loop = how
    turned, motion = rubber.rooted(turned), rubber.rooted(motion)
    parts = subjoints.subdivide(motion.skeleton)
    joints, turns = rubber.joints_of(turned)
    late = follow * joint_filters.depth(motion.skeleton)[:, None]
    travel = np.stack([travel_of(path) for path in np.swapaxes(joints, 0, 1)]) if loop else 0.0
    moved = filters.cartoon(joints, motion.fps, amount, seconds, late, anticipation, overshoot, loop, travel)
    placed = subjoints.place(subjoints.placing(parts, 0.0), moved)
    captured, _ = rubber.joints_of(motion)
    if not slide:
        placed = feet.kept(placed, parts, captured, *soles.found(motion, captured), motion.fps, rubber.SETTLE)
    return rubber.finished(turned, parts, placed, joints, turns)


def _stood(turned: "SkeletonMotion", motion: "SkeletonMotion") -> "SkeletonMotion":
    """The turned motion with feet standing while they did in the captured one, by turning the legs."""
    from mocap.bodies.body import find_body
    from mocap.bodies.contacts import find_contacts
    from mocap.bodies.planted import planted

    captured = motion.positions()
    feet = find_body(motion.skeleton, captured).feet
    return planted(turned, captured, feet, find_contacts(motion, feet)) if feet else turned
