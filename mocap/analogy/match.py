"""Whose joint is whose: skeletons matched by names, and where those differ by how they are built."""

import re

from capture.errors import InputError
from mocap.analogy.curves import hips
from mocap.skeleton import Skeleton, SkeletonMotion


def renamed(motion: SkeletonMotion, goal: SkeletonMotion) -> tuple[SkeletonMotion, str]:
    """The motion with its joints called as those of `goal` that they answer, and a sentence on what was matched."""
    from dataclasses import replace

    answers = matched(motion, goal)
    names = tuple(
        goal.skeleton.names[answers[k]] if k in answers else f"~{name}" for k, name in enumerate(motion.skeleton.names)
    )
    inner = set(goal.skeleton.parents) - {-1}
    left = [goal.skeleton.names[k] for k in sorted(inner - set(answers.values()))]
    said = f"{len(inner) - len(left)} of B's {len(inner)} joints are matched"
    if left:
        said += f", {', '.join(left[:6])}{' and others' if len(left) > 6 else ''} stay as in B"
    return replace(motion, skeleton=Skeleton(names, motion.skeleton.parents, motion.skeleton.offsets)), said


def matched(motion: SkeletonMotion, goal: SkeletonMotion) -> dict[int, int]:
    """Which joint of `goal` each joint answers: by plain name, then, from there on, by the one place it can have."""
    one, two = motion.skeleton, goal.skeleton
    plain = {}
    for k, name in enumerate(two.names):
        plain.setdefault(plainly(name), k)
    answers = {k: plain[plainly(name)] for k, name in enumerate(one.names) if plainly(name) in plain}
    answers[hips(motion)] = hips(goal)
    for k, parent in enumerate(one.parents):  # an only child answers an only child
        if k in answers or parent not in answers:
            continue
        mine, theirs = one.children(parent), two.children(answers[parent])
        free = [child for child in theirs if child not in answers.values()]
        if len(mine) == len(theirs) == 1 and free:
            answers[k] = free[0]
    inner = set(two.parents) - {-1}
    if sum(answer in inner for answer in answers.values()) < 2:
        raise InputError(
            f"skeletons must have joints of the same names, {', '.join(one.names[:4])} ... and "
            f"{', '.join(two.names[:4])} ... have none in common: rename them alike"
        )
    return answers


def plainly(name: str) -> str:
    """A joint's name without prefix, case, blanks and signs: mixamorig:LeftUpLeg and joint_left_up_leg are the same."""
    name = re.split(r"[:|]", name)[-1]
    name = re.sub(r"(?i)^(joint|bip\d*|mixamorig\d*|def|org)[ _.-]+", "", name)
    return re.sub(r"[^a-z0-9]", "", name.lower())
