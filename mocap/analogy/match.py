"""Whose joint is whose: skeletons matched by names, and where those differ, limb by limb."""

import re

from capture.errors import InputError
from mocap.analogy.curves import hips
from mocap.bodies.body import Body, find_body
from mocap.skeletons.skeleton import SkeletonMotion


def matched(motion: SkeletonMotion, goal: SkeletonMotion) -> dict[int, int]:
    """Which joint of `goal` each joint answers.

    By plain name; a limb whose joints have other names by its place in the body: arms from the hand upwards, the rest
    from the body outwards; then, from there on, by the one place a joint can have.
    """
    one, two = motion.skeleton, goal.skeleton
    plain: dict[str, int] = {}
    for k, name in enumerate(two.names):
        plain.setdefault(plainly(name), k)
    answers = {k: plain[plainly(name)] for k, name in enumerate(one.names) if plainly(name) in plain}
    bodies = find_body(one, motion.positions()), find_body(two, goal.positions())
    for part in bodies[0].parts.keys() & bodies[1].parts.keys():
        _by_place(answers, part, *bodies)
    above = set(one.path(hips(motion))[:-1]) | {k for k in answers if answers[k] in two.path(hips(goal))}
    answers = {k: answer for k, answer in answers.items() if k not in above} | {hips(motion): hips(goal)}
    for k, parent in enumerate(one.parents):  # an only child answers an only child
        if k in answers or parent not in answers:
            continue
        mine, theirs = one.children(parent), two.children(answers[parent])
        free = [child for child in theirs if child not in answers.values()]
        if len(mine) == len(theirs) == 1 and free:
            answers[k] = free[0]
    turning = [k for k, answer in answers.items() if one.children(k) and two.children(answer) and k != hips(motion)]
    if not turning and max(len(set(skeleton.parents)) for skeleton in (one, two)) > 2:
        raise InputError(
            f"skeletons must have joints of the same names or limbs, {', '.join(one.names[:4])} ... and "
            f"{', '.join(two.names[:4])} ... have none in common: rename them alike"
        )
    return answers


def called(names: tuple[str, ...], motion: SkeletonMotion) -> tuple[str, ...]:
    """The joints that names mean: joints, parts of the body such as "left arm" or "spine", or both sides' "arms"."""
    skeleton, found = motion.skeleton, []
    label = find_body(skeleton, motion.positions()).label if names else ()
    for name in names:
        plain = name.lower().strip()
        own = [joint for joint in skeleton.names if plainly(joint) == plainly(name)]
        part = [joint for joint, of in zip(skeleton.names, label) if plain in (of, *_plurals(of))]
        found += own or part
        if not own and not part:
            parts = ", ".join(dict.fromkeys(label))
            raise InputError(f"parts must be joints of B or {parts}, {name} is none: rename it")
    return tuple(dict.fromkeys(found))


def _plurals(part: str) -> tuple[str, ...]:
    words = part.split()[1:]
    return tuple(" ".join(words[k:]) + "s" for k in range(len(words)))


def told(answers: dict[int, int], goal: SkeletonMotion) -> str:
    """A sentence on what was matched; what stands still above the hips need not be."""
    inner = sorted(set(goal.skeleton.parents) - {-1} - set(goal.skeleton.path(hips(goal))[:-1]))
    left = [goal.skeleton.names[k] for k in inner if k not in answers.values()]
    said = f"{len(inner) - len(left)} of B's {len(inner)} joints are matched"
    if left:
        said += f", {', '.join(left[:6])}{' and others' if len(left) > 6 else ''} stay as in B"
    return said


def plainly(name: str) -> str:
    """A joint's name without prefix, case, blanks and signs: mixamorig:LeftUpLeg and joint_left_up_leg are the same."""
    name = re.split(r"[:|]", name)[-1]
    name = re.sub(r"(?i)^(joint|bip\d*|mixamorig\d*|def|org)[ _.-]+", "", name)
    return re.sub(r"[^a-z0-9]", "", name.lower())


def _by_place(answers: dict[int, int], part: str, one: Body, two: Body) -> None:
    """Match the joints of a part by their order, unless at least half of them are by name."""
    mine, theirs = one.parts[part], two.parts[part]
    named = [k for k in mine if answers.get(k) in theirs]
    if 2 * len(named) >= min(len(mine), len(theirs)):
        return
    for k in [k for k, answer in answers.items() if k in mine or answer in theirs]:
        del answers[k]
    if part.endswith("arm"):
        mine, theirs = mine[::-1], theirs[::-1]
    answers |= dict(zip(mine, theirs))
