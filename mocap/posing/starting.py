"""Pools of postures to start with, for any human, quadruped or plant (Chen et al. 2004, section 4.2).

They are made for a skeleton from what its joints are and how its links lie at rest, not from names or axes: an arm is
raised from a T-pose as it is from one that hangs.  The figure must be upright (`units.upright`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from mocap.bodies.body import Body, find_body
from mocap.posing.postures import Pool, Posture, combined, posed, turned, unturned
from mocap.skeletons.skeleton import Skeleton

SIDES = (("left", 1), ("right", -1))
BENT = np.radians([35, 60, 90, 100])  # a trunk, an ankle or wrist, an elbow, a knee
HANGING = (0.12, -1, 0.03)
"""Which way an arm hangs: out, up and ahead."""


def starting_pool(skeleton: Skeleton, rest: NDArray | None = None) -> Pool:
    """The pool for what a skeleton is, with joints turned as in `rest` (J, 4) or not at all."""
    return {"human": human, "quadruped": quadruped, "plant": plant}[kind_of(skeleton, rest)](skeleton, rest)


def kind_of(skeleton: Skeleton, rest: NDArray | None = None) -> str:
    """ "human" for two legs that go down and arms, "quadruped" for four or more legs, "plant" for anything else.

    Legs and arms of a human have three joints or more: petals and leaves have not.
    """
    frame = _frame(skeleton, rest)
    legs = [leg for leg in frame.body.legs() if len(leg) > 1]
    stands = [frame.places[leg[-1], 1] < frame.places[leg[0], 1] for leg in legs]
    if len(legs) >= 4 and all(stands):
        return "quadruped"
    limbs = [frame.body.parts.get(f"{side} {limb}", ()) for side, _ in SIDES for limb in ("arm", "leg")]
    jointed = all(len(limb) > 2 for limb in limbs)
    return "human" if len(legs) == 2 and all(stands) and len(frame.body.hands) == 2 and jointed else "plant"


def standing(skeleton: Skeleton, rest: NDArray | None = None) -> NDArray:
    """A rest pose (J, 4) to dance from: a human's arms hang, its legs are straight, its feet as flat as in `rest`."""
    if kind_of(skeleton, rest) != "human":
        return unturned(skeleton) if rest is None else rest
    feet = [_limb(_frame(skeleton, rest), f"{side} leg")[2] for side, _ in SIDES]
    flat = _frame(skeleton, rest).world[feet]
    for part, goal in (("arm", HANGING), ("leg", (0.05, -1, 0))):
        for step in range(2):  # first the upper link, and after it the lower
            frame = _frame(skeleton, rest)
            turns = np.zeros((len(skeleton), 3))
            for side, sign in SIDES:
                joint = _limb(frame, f"{side} {part}")[step]
                turns[joint] = _aimed(frame, joint, (sign * goal[0], *goal[1:]))
            rest = turned(frame.rest, turns)
    turns[:] = 0
    turns[feet] = _vector(_frame(skeleton, rest).world[feet].swapaxes(1, 2) @ flat)
    return turned(rest, turns)


def human(skeleton: Skeleton, rest: NDArray | None = None) -> Pool:
    """Postures of whoever has two legs and two arms: bends of each joint, limbs raised, the trunk leaning."""
    frame = _frame(skeleton, rest)
    lacks = [part for part in ("left arm", "right arm", "left leg", "right leg") if part not in frame.body.parts]
    if lacks:
        raise InputError(f"a human must have two arms and two legs, this skeleton has no {lacks[0]}: take its kind")
    trunk, ankle, elbow, knee = BENT
    waist, neck = _waist(frame), frame.body.parts.get("head", ())[:1] or frame.body.parts["spine"][-1:]
    made = _leaning(frame, waist, trunk) + [
        _about(frame, "nod", neck, (1, 0, 0), 0.5),
        _about(frame, "look up", neck, (-1, 0, 0), 0.5),
        _about(frame, "look left", neck, (0, 1, 0), 0.9),
        _about(frame, "look right", neck, (0, -1, 0), 0.9),
        _about(frame, "head to left", neck, (0, 0, -1), 0.4),
        _about(frame, "head to right", neck, (0, 0, 1), 0.4),
    ]
    for side, sign in SIDES:
        arm, fore, hand = _limb(frame, f"{side} arm")
        thigh, shank, foot = _limb(frame, f"{side} leg")
        made += [
            _posture(frame, f"{side} arm raised", {arm: _aimed(frame, arm, (0.35 * sign, 1, 0.1))}),
            _posture(frame, f"{side} arm out", {arm: _aimed(frame, arm, (sign, 0.05, 0.1))}),
            _posture(frame, f"{side} arm ahead", {arm: _aimed(frame, arm, (0.1 * sign, 0.05, 1))}),
            _posture(frame, f"{side} elbow bent", {fore: _toward(frame, fore, (-0.3 * sign, 0.2, 1), elbow)}),
            _posture(frame, f"{side} wrist bent", {hand: _toward(frame, hand, (-0.5 * sign, 0.3, 1), ankle)}),
            _posture(frame, f"{side} leg raised", {thigh: _toward(frame, thigh, (0, 0, 1), elbow)}),
            _posture(frame, f"{side} leg out", {thigh: _toward(frame, thigh, (sign, 0, 0), trunk)}),
            _posture(frame, f"{side} knee bent", {shank: _toward(frame, shank, (0, 0, -1), knee)}),
            _posture(frame, f"{side} ankle bent", {foot: _turn(frame, foot, (1, 0, 0), ankle / 2)}),
        ]
    arms = [_limb(frame, f"{side} arm")[0] for side, _ in SIDES]
    made[0] = combined("bow", [made[0], _hanging(frame, arms, 1.36 * trunk)])
    return Pool((*made, *_of_all_human(frame, {posture.name: posture for posture in made})), "human")


def quadruped(skeleton: Skeleton, rest: NDArray | None = None) -> Pool:
    """Postures of whoever stands on four legs or more: each leg lifted, the back, neck and tail bent."""
    frame = _frame(skeleton, rest)
    if len(frame.body.legs()) < 4:
        raise InputError(f"a quadruped must have four legs, this skeleton has {len(frame.body.legs())}: take its kind")
    parts, (trunk, _, _, _) = frame.body.parts, BENT
    neck, tail, waist = parts.get("head", ()), parts.get("tail", ()), _waist(frame)
    legs = {name: [j for j in path if _has_link(frame, j)] for name, path in parts.items() if name.endswith("leg")}
    fore = [path[0] for name, path in legs.items() if "front" in name]
    made = []
    for name, joints, far in (("head", neck, 0.7), ("tail", tail, 0.9), ("back", waist, trunk)):
        if not joints:
            continue
        down = 1 if name != "tail" else -1  # a tail goes back: what lifts a head lowers it
        for way, axis in (
            ("down", (down, 0, 0)),
            ("up", (-down, 0, 0)),
            ("left", (0, down, 0)),
            ("right", (0, -down, 0)),
        ):
            aside = 0.5 if name == "back" and axis[1] else 1.0  # or else its forelegs would swing far round
            bent = _about(frame, f"{name} {way}", joints, axis, aside * far)
            if name == "back" and axis[0]:  # the legs under it go on standing
                bent = combined(bent.name, [bent, _hanging(frame, fore, axis[0] * far)])
            made.append(bent)
    for name, path in legs.items():
        turns = {path[0]: _turn(frame, path[0], (-1, 0, 0), 0.7)}
        if len(path) > 1:
            turns[path[1]] = _turn(frame, path[1], (1, 0, 0), 1.15)
        made.append(_posture(frame, f"{name} lifted", turns))
        made.append(_posture(frame, f"{name} back", {path[0]: _turn(frame, path[0], (1, 0, 0), 0.5)}))
    lifted = {posture.name: posture for posture in made if posture.name.endswith("lifted")}
    for side, other in (("left", "right"), ("right", "left")):
        two = [lifted.get(f"{one} leg lifted") for one in (f"{side} front", f"{other} hind")]
        if all(two):
            made.append(combined(f"{side} trot", two))
    if fore:
        made.append(_bowing(frame, waist, fore, trunk))
    return Pool(tuple(made), "quadruped")


def plant(skeleton: Skeleton, rest: NDArray | None = None) -> Pool:
    """Postures of anything that stands in one place: its stem leans, twists and curls, its branches open and close."""
    frame = replace(_frame(skeleton, rest), axes=np.eye(3))  # what looks like limbs does not tell its left
    stem = _stem(frame)
    if not stem:
        raise InputError("a plant must have a joint between its root and its tips, this skeleton has none: give it one")
    growing = np.linspace(0.3, 1.7, len(stem)) if len(stem) > 1 else np.ones(1)
    made = _leaning(frame, stem, np.radians(50), even=True)
    for side, sign in SIDES:
        made.append(_about(frame, f"curl {side}", stem, (0, 0, -sign), np.radians(130), growing**2))
    end = _link(frame, stem[-1])
    fall = np.cross([0, 1, 0], end + [0, 0, 0.2 * np.linalg.norm(end)])  # to where it nods already, or else ahead
    made.append(_about(frame, "wilt", stem, fall, np.radians(110), growing**3))
    off = [j for j, above in enumerate(skeleton.parents) if above in stem and j not in stem and _has_link(frame, j)]
    if off:
        way = frame.places[stem[-1]] - frame.places[stem[0]]
        along = tuple(frame.axes @ way)
        made.append(_posture(frame, "open", {joint: _toward(frame, joint, along, -0.5) for joint in off}))
        made.append(_posture(frame, "close", {joint: _toward(frame, joint, along, 0.5) for joint in off}))
    return Pool(tuple(made), "plant")


@dataclass(frozen=True, eq=False)
class _Frame:
    """A skeleton at rest, and which way its left, up and ahead are."""

    skeleton: Skeleton
    body: Body
    rest: NDArray  # (J, 4)
    places: NDArray  # (J, 3)
    world: NDArray  # (J, 3, 3) joints' axes in the world
    axes: NDArray  # (3, 3) rows left, up, ahead


def _frame(skeleton: Skeleton, rest: NDArray | None) -> _Frame:
    rest = unturned(skeleton) if rest is None else np.asarray(rest, float)
    maps = posed(skeleton, np.zeros((1, len(skeleton), 3)), 1.0, rest).world()[0]
    places = maps[..., 3]
    body = find_body(skeleton, places)
    across = np.zeros(3)
    for name, path in body.parts.items():
        other = body.parts.get(name.replace("left", "right", 1)) if name.startswith("left") else None
        if other:
            across += (places[path[0]] - places[other[0]]) * [1, 0, 1]
    far = np.linalg.norm(across)
    left = across / far if far > 1e-9 else np.array([1.0, 0, 0])
    up = np.array([0.0, 1, 0])
    return _Frame(skeleton, body, rest, places, maps[..., :3], np.stack([left, up, np.cross(left, up)]))


def _turn(frame: _Frame, joint: int, axis: Sequence[float], angle: float) -> NDArray:
    """A turn about an axis given as (left, up, ahead), in the joint's own axes; up to ahead is about left."""
    way = np.asarray(axis, float) @ frame.axes
    return angle * frame.world[joint].T @ way / max(np.linalg.norm(way), 1e-12)


def _toward(frame: _Frame, joint: int, goal: Sequence[float], angle: float) -> NDArray:
    """A turn of the joint's link by an angle to where (left, up, ahead) is."""
    across = np.cross(_link(frame, joint), np.asarray(goal, float) @ frame.axes)
    if np.linalg.norm(across) < 1e-6:  # it goes there, or straight away from there
        across = np.cross(_link(frame, joint), frame.axes[1]) + 1e-3 * frame.axes[0]
    return angle * frame.world[joint].T @ across / np.linalg.norm(across)


def _aimed(frame: _Frame, joint: int, goal: Sequence[float]) -> NDArray:
    """The turn of a joint whose link goes (left, up, ahead) after it."""
    link, way = _link(frame, joint), np.asarray(goal, float) @ frame.axes
    angle = np.arctan2(np.linalg.norm(np.cross(link, way)), link @ way)
    return _toward(frame, joint, goal, angle)


def _vector(matrices: NDArray) -> NDArray:
    from scipy.spatial.transform import Rotation

    return Rotation.from_matrix(matrices).as_rotvec()


def _link(frame: _Frame, joint: int) -> NDArray:
    """Where a joint's links go (3,)."""
    path = next((path for path in frame.body.parts.values() if joint in path[:-1]), None)
    if path:
        return frame.places[path[path.index(joint) + 1]] - frame.places[joint]
    ends = [frame.places[child] - frame.places[joint] for child in frame.skeleton.children(joint)]
    way = np.mean(ends, axis=0) if ends else np.zeros(3)
    above = frame.skeleton.parents[joint]
    return way if np.linalg.norm(way) > 1e-9 or above < 0 else frame.places[joint] - frame.places[above]


def _has_link(frame: _Frame, joint: int) -> bool:
    return any(np.linalg.norm(frame.skeleton.offsets[child]) > 0 for child in frame.skeleton.children(joint))


def _limb(frame: _Frame, part: str) -> tuple[int, int, int]:
    """Shoulder, elbow and wrist, or hip, knee and ankle: the middle one has the longest links at both sides."""
    path, lengths = frame.body.parts[part], frame.skeleton.lengths()
    if len(path) < 3:
        raise InputError(f"a limb must have three joints to be posed, the {part} has {len(path)}: pose it yourself")
    at = max(range(1, len(path) - 1), key=lambda i: lengths[path[i]] + lengths[path[i + 1]])
    return path[at - 1], path[at], path[at + 1]


def _waist(frame: _Frame) -> tuple[int, ...]:
    """The joints that bend the trunk: those of the spine above the legs."""
    spine = frame.body.parts.get("spine", ())
    return spine[1:] or spine


def _stem(frame: _Frame) -> tuple[int, ...]:
    """The joints from the root, which stands in the ground, on to where no branch is most of what is beyond."""
    skeleton = frame.skeleton
    beyond = skeleton.lengths().copy()
    for joint in reversed(range(len(skeleton))):
        if skeleton.parents[joint] >= 0:
            beyond[skeleton.parents[joint]] += beyond[joint]
    stem = [max((j for j, parent in enumerate(skeleton.parents) if parent < 0), key=lambda j: beyond[j])]
    while children := skeleton.children(stem[-1]):
        further = max(children, key=lambda j: beyond[j])
        if 2 * beyond[further] <= sum(beyond[child] for child in children):
            break
        stem.append(further)
    return tuple(joint for joint in stem[1:] if _has_link(frame, joint))


def _posture(frame: _Frame, name: str, turns: dict[int, NDArray]) -> Posture:
    return Posture(name, {frame.skeleton.names[j]: tuple(map(float, turn)) for j, turn in turns.items()})


def _about(
    frame: _Frame, name: str, joints: Sequence[int], axis: Sequence[float], angle: float, shares: NDArray | None = None
) -> Posture:
    """Joints that together turn by an angle, each by its share."""
    shares = np.ones(len(joints)) if shares is None else shares
    own = angle * shares / shares.sum()
    return _posture(frame, name, {joint: _turn(frame, joint, axis, own[n]) for n, joint in enumerate(joints)})


def _leaning(frame: _Frame, joints: Sequence[int], angle: float, even: bool = False) -> list[Posture]:
    """Bent and twisted to all sides; a trunk bows further than it bends back, unless all are even."""
    further, less = (1.0, 1.0) if even else (1.7, 0.7)
    return [
        _about(frame, "bow", joints, (1, 0, 0), further * angle),
        _about(frame, "lean back", joints, (-1, 0, 0), less * angle),
        _about(frame, "lean left", joints, (0, 0, -1), angle),
        _about(frame, "lean right", joints, (0, 0, 1), angle),
        _about(frame, "twist left", joints, (0, 1, 0), 1.2 * angle),
        _about(frame, "twist right", joints, (0, -1, 0), 1.2 * angle),
    ]


def _hanging(frame: _Frame, joints: Sequence[int], angle: float) -> Posture:
    """Limbs that go on hanging while what they hang on bows by an angle."""
    return _posture(frame, "hang", {joint: _turn(frame, joint, (-1, 0, 0), angle) for joint in joints})


def _bowing(frame: _Frame, waist: Sequence[int], fore: Sequence[int], angle: float) -> Posture:
    """A dog's bow: the chest goes down between legs that reach ahead, the head stays up."""
    down = _about(frame, "bow", waist, (1, 0, 0), angle)
    neck = frame.body.parts.get("head", ())
    level = [_about(frame, "up", neck, (-1, 0, 0), 0.8 * angle)] if neck else []
    return combined("bow", [down, _hanging(frame, fore, 2.2 * angle), *level])


def _of_all_human(frame: _Frame, made: dict[str, Posture]) -> list[Posture]:
    """Postures of the whole body, combined from those of its joints."""

    def both(what: str) -> list[Posture]:
        return [made[f"{side} {what}"] for side, _ in SIDES]

    found = []
    down: dict[int, NDArray] = {}
    for side, _ in SIDES:
        thigh, shank, foot = _limb(frame, f"{side} leg")
        for joint, angle in ((thigh, -0.6), (shank, 1.2), (foot, -0.6)):  # the foot stays flat, below the hips
            down[joint] = _turn(frame, joint, (1, 0, 0), angle)
    found.append(_posture(frame, "crouch", down))
    for side, sign in SIDES:
        sway = {}
        for other, _ in SIDES:
            thigh, _, foot = _limb(frame, f"{other} leg")
            sway[thigh], sway[foot] = (_turn(frame, j, (0, 0, s), 0.18 * sign) for j, s in ((thigh, -1), (foot, 1)))
        found.append(_posture(frame, f"hips {side}", sway))
    found.append(combined("arms up", both("arm raised")))
    found.append(combined("arms out", both("arm out")))
    found.append(combined("hands in front", both("elbow bent")))
    for side, other in (("left", "right"), ("right", "left")):
        kick = [made[f"{side} leg raised"], made["lean back"], made[f"{other} arm ahead"]]
        found.append(combined(f"{side} kick", kick, [0.9, 0.5, 1]))
        strut = [made[f"{side} leg raised"], made[f"{side} knee bent"], *both("elbow bent")]
        found.append(combined(f"{side} knee up", strut))
        point = [made[f"{side} arm raised"], made[f"{other} elbow bent"], made[f"lean {other}"]]
        found.append(combined(f"point {side}", point, [0.95, 0.8, 0.4]))
    return found
