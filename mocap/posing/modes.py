"""How a whole figure swings about its rest pose: the global model that Chen et al. 2004 wish for (section 7).

Elastic joints as the paper has them do not know of each other.  Here each link has its mass, so that who swings a joint
swings all that hangs on it; the joints' springs are the same.  For small turns phi (J, 3) about rest

    M phi'' + K phi = Q        M_ab = sum_i m_i dx_i/dphi_a . dx_i/dphi_b,    Q_a = sum_i (x_i - p_a) x f_i

and shapes that are orthogonal in K and in M, the slowest first, make of it one oscillator each, stepped exactly.  A
link's mass sits in the two points that turn as heavily as a rod does.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from mocap.curves.ends import extended, travel_of
from mocap.posing import elastic
from mocap.posing.postures import posed, turned
from mocap.rubber.subjoints import SubJoints
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion

POINTS = (0.5 - 12**-0.5, 0.5 + 12**-0.5)
"""Where along a link its mass sits, half of it in each."""

THICK = 0.1
"""Times its length a link is thick, that is, resists being turned about itself."""

TINY = 1e-4
"""What hangs on a joint and reaches no further, as a share of all links, does not swing."""

OWN = 1e-3
"""Of two joints in one place the lower resists a turn by itself, besides what hangs on it, by so much of that."""

MOST = np.radians(60)
"""Joints are hardly turned further: shapes are those of small swings."""


@dataclass(frozen=True, eq=False)
class Modes:
    """L ways in which J joints, or sub-joints, swing together."""

    parents: tuple[int, ...]
    mass: NDArray  # (J,) of the link above each joint; 1 a metre
    inertia: NDArray  # (J, 3, 3) how heavily each joint turns with all that hangs on it, in its own axes
    stiffness: NDArray  # (J,) of each joint's spring; 0 of those that do not turn
    shapes: NDArray  # (L, J, 3) turns in the joints' own axes; the energy of any of them at speed 1 is 1 / 2
    frequency: NDArray  # (L,) Hz, rising

    def __len__(self) -> int:
        return len(self.frequency)


def of_skeleton(
    skeleton: Skeleton,
    rest: NDArray | None = None,
    frequency: float = 1.5,
    count: int | None = 12,
    held: Sequence[int] | None = None,
) -> Modes:
    """The modes of a skeleton with joints turned as in `rest` (J, 4), or not at all; see `modes_of`."""
    maps = posed(skeleton, np.zeros((1, len(skeleton), 3)), 1.0, rest).world()[0]
    return modes_of(skeleton.parents, maps[..., 3], maps[..., :3], frequency, count, held)


def of_subjoints(subjoints: SubJoints, frequency: float = 1.5, count: int | None = 12) -> Modes:
    """The modes of a skeleton whose links can bend."""
    places = np.zeros((len(subjoints), 3))
    pieces = np.bincount(subjoints.joint, minlength=len(subjoints.skeleton))[subjoints.joint]
    for s, above in enumerate(subjoints.parents):
        offset = subjoints.skeleton.offsets[subjoints.joint[s]]
        places[s] = offset if above < 0 else places[above] + offset / pieces[s]
    return modes_of(subjoints.parents, places, None, frequency, count)


def modes_of(
    parents: tuple[int, ...],
    places: NDArray,
    axes: NDArray | None = None,
    frequency: float = 1.5,
    count: int | None = 12,
    held: Sequence[int] | None = None,
    stiffness: NDArray | None = None,
    thick: float = THICK,
) -> Modes:
    """The `count` slowest modes, or all, of joints at places (J, 3) at rest, with axes (J, 3, 3).

    The slowest swings `frequency` times a second: springs are the stiffer, the more hangs on a joint, and the longer
    what hangs on it, the slower it would swing alone, as pendulums do.  Or they are as given, `stiffness` (J,), for a
    mass of 1 a metre.  Joints that are `held` do not turn; without it the roots.
    """
    from scipy.linalg import eigh

    places = np.asarray(places, float)
    lengths = _lengths(parents, places)
    roots = [joint for joint, parent in enumerate(parents) if parent < 0]
    reach = _reach(parents, lengths)
    free = np.setdiff1d(np.flatnonzero(reach > TINY * lengths.sum()), roots if held is None else held)
    if not len(free) or not np.isfinite(places).all():
        raise InputError("what swings must have a joint that is not held and a link beyond it, this has none: add one")
    if not frequency > 0 or not np.isfinite(frequency):
        raise InputError(f"the frequency of a swing must be above 0 Hz, got {frequency}: give another one")
    axes = np.tile(np.eye(3), (len(places), 1, 1)) if axes is None else axes
    heavy = _mass_matrix(parents, places, axes, lengths, free, thick)
    own = np.stack([heavy[3 * n : 3 * n + 3, 3 * n : 3 * n + 3] for n in range(len(free))])
    doubled = [n for n, joint in enumerate(free) if lengths[joint] <= TINY * reach[joint] and parents[joint] in free]
    for n in doubled:  # it moves all that the joint above it moves: else nobody knows whose turn it is
        heavy[3 * n : 3 * n + 3, 3 * n : 3 * n + 3] += OWN * np.trace(own[n]) * np.eye(3)
    springs = np.linalg.eigvalsh(own)[:, -1] / reach[free] if stiffness is None else np.asarray(stiffness)[free]
    last = 3 * len(free) if count is None else min(count, 3 * len(free))
    squares, vectors = eigh(np.diag(np.repeat(springs, 3)), heavy, subset_by_index=[0, last - 1])
    if stiffness is None:
        scale = (2 * np.pi * frequency) ** 2 / squares[0]
        springs, squares = scale * springs, scale * squares
    shapes = np.zeros((last, len(places), 3))
    shapes[:, free] = vectors.T.reshape(last, len(free), 3)
    inertia, stiff = np.zeros((len(places), 3, 3)), np.zeros(len(places))
    inertia[free], stiff[free] = own, springs
    return Modes(parents, lengths, inertia, stiff, shapes, np.sqrt(squares) / (2 * np.pi))


def swing(
    modes: Modes, torques: NDArray, fps: float, damping: float = 0.15, state: elastic.State | None = None
) -> NDArray:
    """How torques (T, J, 3) in the joints' own axes, which go evenly between frames, turn them (T, J, 3).

    It begins as if the first torque had always been there, or in `state`, whose joints are the modes.
    """
    amounts = np.einsum("tjd,ljd->tl", torques, modes.shapes)[..., None]
    own = elastic.felt(modes.frequency, damping)
    wanted = np.broadcast_to(amounts / own.stiffness[:, None], (*amounts.shape[:2], 3))
    at = np.arange(len(torques)) / fps
    found = elastic.along(own, at, at, wanted, state).turns[..., 0]
    return np.einsum("tl,ljd->tjd", found, modes.shapes)


def follow(
    motion: SkeletonMotion, modes: Modes, damping: float = 0.25, share: float = 1.0, loop: bool = False
) -> SkeletonMotion:
    """The motion, and its whole body swinging after it: each link would rather go on as it went.

    `share` is how much of that is taken, 0 none.  What goes at one speed swings nothing.
    """
    if not 0 <= share <= 10:
        raise InputError(f"the share of the swing must be between 0 and 10, got {share}: leave it out for the usual")
    maps = motion.world()
    places = maps[..., 3]
    travel = travel_of(places[:, 0]) if loop else 0.0
    quicker = motion.fps**2 * np.diff(extended(places, 1, 1, loop, travel), 2, axis=0)
    quicker = quicker if loop or len(motion) > 2 else 0 * places
    pulls = [-0.5 * modes.mass[:, None] * on_links(quicker, modes.parents, at) for at in POINTS]
    points = [on_links(places, modes.parents, at) for at in POINTS]
    torques = in_own(maps[..., :3], torques_of(modes.parents, places, points, pulls))
    turns = swing(modes, torques if not loop else np.concatenate([torques] * 3), motion.fps, damping)
    turns = turns[-len(motion) :]
    return replace(motion, rotation=turned(motion.rotation, softly(share * turns)))


def torques_of(
    parents: tuple[int, ...], places: NDArray, points: Sequence[NDArray], forces: Sequence[NDArray]
) -> NDArray:
    """How forces in points of the links above J joints, each (..., J, 3), turn the joints (..., J, 3), in the world."""
    beyond = _beyond(tuple(parents))
    force = np.einsum("ji,...id->...jd", beyond, np.sum(forces, axis=0))
    moment = np.sum([_cross(x, f) for x, f in zip(points, forces)], axis=0)
    return np.einsum("ji,...id->...jd", beyond, moment) - _cross(places, force)


def on_links(values: NDArray, parents: tuple[int, ...], at: float) -> NDArray:
    """What joints have (..., J, 3), taken so far along the link above each; roots keep theirs."""
    above = np.array([parent if parent >= 0 else joint for joint, parent in enumerate(parents)])
    return (1 - at) * values[..., above, :] + at * values


def in_own(axes: NDArray, torques: NDArray) -> NDArray:
    """Torques (..., J, 3) of the world in joints' axes (..., J, 3, 3)."""
    return np.einsum("...ji,...j->...i", axes, torques)


def softly(turns: NDArray, most: float = MOST) -> NDArray:
    """Turns (..., 3) of which large ones are made smaller, so that none is beyond `most` radians."""
    angle = np.linalg.norm(turns, axis=-1, keepdims=True) / most
    return turns * np.where(angle > 1e-6, np.tanh(angle) / np.maximum(angle, 1e-6), 1.0)


@lru_cache(maxsize=8)
def _beyond(parents: tuple[int, ...]) -> NDArray:
    """Which links hang on which joints (J, J), 1 or 0; a link is called as the joint at its end."""
    beyond = np.zeros((len(parents), len(parents)))
    for link, parent in enumerate(parents):
        if parent >= 0:
            beyond[:, link] = beyond[:, parent]
            beyond[parent, link] = 1
    return beyond


def _cross(a: NDArray, b: NDArray) -> NDArray:
    """What np.cross does to vectors (..., 3), at a fifth of its price for a few."""
    return a[..., [1, 2, 0]] * b[..., [2, 0, 1]] - a[..., [2, 0, 1]] * b[..., [1, 2, 0]]


def _mass_matrix(
    parents: tuple[int, ...], places: NDArray, axes: NDArray, lengths: NDArray, free: NDArray, thick: float
) -> NDArray:
    """M (3F, 3F) of F joints that turn about their own axes."""
    row = {joint: n for n, joint in enumerate(free.tolist())}
    heavy = np.zeros((len(free), 3, len(free), 3))
    for link, parent in enumerate(parents):
        if parent < 0 or lengths[link] == 0:
            continue
        above, at = [], parent
        while at >= 0:
            above += [at] if at in row else []
            at = parents[at]
        if not above:
            continue
        rows = [row[joint] for joint in above]
        spins = axes[above]  # (n, 3, 3) columns are the axes
        parts = [(thick * lengths[link], spins.swapaxes(1, 2))]
        for along in POINTS:
            arms = (1 - along) * places[parent] + along * places[link] - places[above]
            moves = np.cross(spins.swapaxes(1, 2), arms[:, None])  # (n, 3, 3) of each axis, how the point goes
            parts.append((0.5**0.5, moves))
        for size, moves in parts:
            moved = size * moves
            heavy[np.ix_(rows, range(3), rows, range(3))] += lengths[link] * np.einsum("aid,bjd->aibj", moved, moved)
    return heavy.reshape(3 * len(free), 3 * len(free))


def _lengths(parents: tuple[int, ...], places: NDArray) -> NDArray:
    above = np.array([parent if parent >= 0 else joint for joint, parent in enumerate(parents)])
    return np.linalg.norm(places - places[above], axis=1)


def _reach(parents: tuple[int, ...], lengths: NDArray) -> NDArray:
    """How far it is along the links from each joint to the farthest tip (J,)."""
    reach = np.zeros(len(parents))
    for joint in reversed(range(len(parents))):
        if parents[joint] >= 0:
            reach[parents[joint]] = max(reach[parents[joint]], reach[joint] + lengths[joint])
    return reach
