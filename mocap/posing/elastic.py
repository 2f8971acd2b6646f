"""Elastic joints, that swing from posture to posture (Chen et al. 2004, section 5).

    m phi'' + c phi' + k phi = k phi_target(t) + torque      eq. 14, with the target of the errata

phi (J, 3) is how joints are turned against rest, as rotation vectors in radians; each is a spring of its own.  Steps
are exact for targets that stay or go evenly and for torques that stay, so that a motion is the same at 12 and at 240
frames a second, and no spring is too stiff.

An animator says how quick a joint swings (Hz) and how soon that dies away (damping: 0 never, 1 without a swing back),
or makes it clumsier, stiffer or wilder: `felt` and `styled` turn that into m, c and k.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capture.errors import InputError

PIECES = 6
"""Pieces, each going evenly, of a target that brings springs from one posture to the next in time."""


@dataclass(frozen=True, eq=False)
class Elastic:
    """The springs of J joints, or one for all."""

    inertia: NDArray  # m (J,) or (); kg m^2 where torques are in N m, but for targets only ratios count
    damping: NDArray  # c
    stiffness: NDArray  # k

    def __post_init__(self) -> None:
        for name, must in (("inertia", "above 0"), ("damping", "0 or more"), ("stiffness", "above 0")):
            values = np.asarray(getattr(self, name), float)
            object.__setattr__(self, name, values)
            bad = ~np.isfinite(values) | (values < 0) | ((values == 0) & (must == "above 0"))
            if bad.any():
                raise InputError(
                    f"the {name} of an elastic joint must be {must}, got {values[bad].flat[0]:g}: "
                    "give a joint that should not swing a high damping instead"
                )


@dataclass(frozen=True, eq=False)
class State:
    """How joints are turned (..., J, 3), radians, and how quickly that changes (..., J, 3), radians a second."""

    turns: NDArray
    speed: NDArray

    def at(self, frame: int) -> "State":
        """One moment of it."""
        return State(self.turns[frame], self.speed[frame])


def felt(frequency: ArrayLike = 2.0, damping: ArrayLike = 0.5, inertia: ArrayLike = 1.0) -> Elastic:
    """Springs that swing so many times a second (Hz, without damping), and with such a damping ratio."""
    inertia, omega = np.asarray(inertia, float), 2 * np.pi * np.asarray(frequency, float)
    if not np.all(omega > 0):
        raise InputError(f"the frequency of an elastic joint must be above 0 Hz, got {frequency}: give another one")
    if not np.all(np.asarray(damping, float) >= 0):
        raise InputError(f"the damping of an elastic joint must be 0 or more, got {damping}: 1 does not swing over")
    return Elastic(inertia, 2 * np.asarray(damping, float) * omega * inertia, inertia * omega**2)


def frequency_of(elastic: Elastic) -> NDArray:
    """How many times a second it would swing without damping (Hz)."""
    return np.sqrt(elastic.stiffness / elastic.inertia) / (2 * np.pi)


def damping_of(elastic: Elastic) -> NDArray:
    """The damping ratio: below 1 it swings over."""
    return elastic.damping / (2 * np.sqrt(elastic.stiffness * elastic.inertia))


def styled(elastic: Elastic, clumsy: ArrayLike = 0.0, stiff: ArrayLike = 0.0, wild: ArrayLike = 0.0) -> Elastic:
    """Clumsier, stiffer or wilder by so much, each -1 (brisk, soft, calm) to 1, all or for each joint (J,) (sec. 5.2).

    By 1 inertia and stiffness are four times as large, so that it swings half or twice as quick; damping a quarter.
    """
    return Elastic(
        elastic.inertia * 4.0 ** np.asarray(clumsy, float),
        elastic.damping * 4.0 ** -np.asarray(wild, float),
        elastic.stiffness * 4.0 ** np.asarray(stiff, float),
    )


def still(turns: NDArray) -> State:
    """Joints turned so, at rest."""
    turns = np.asarray(turns, float)
    return State(turns, np.zeros_like(turns))


def step(
    elastic: Elastic,
    state: State,
    seconds: ArrayLike,
    target: ArrayLike,
    slope: ArrayLike = 0.0,
    torque: ArrayLike = 0.0,
) -> State:
    """The state so many seconds later, exactly, for a target (J, 3) that goes evenly by `slope` radians a second.

    With several `seconds` (T,) the states of all these moments (T, J, 3).
    """
    seconds = np.asarray(seconds, float)
    t = seconds.reshape(*seconds.shape, 1, 1)
    m, c, k = (values[..., None] for values in (elastic.inertia, elastic.damping, elastic.stiffness))
    slope = np.asarray(slope, float)
    swing, cosine, sine = _free(c / (2 * m), k / m, t)
    middle = np.asarray(target, float) + np.asarray(torque, float) / k - c / k * slope  # it lags behind what moves
    away, faster = state.turns - middle, state.speed - slope
    return State(
        middle + slope * t + cosine * away + sine * (faster + swing * away),
        slope + cosine * faster - sine * (swing * faster + k / m * away),
    )


def towards(
    elastic: Elastic,
    at: NDArray,
    times: NDArray,
    targets: NDArray,
    state: State | None = None,
    torque: NDArray | None = None,
) -> State:
    """The states (T, J, 3) at moments `at` (T,) of joints that make for each of n postures from its time on.

    `targets` (n, J, 3) are held from `times` (n,) until the next; how near they are passed is up to the springs.  It
    begins at the first moment in `state`, without one at rest in the first posture.  `torque` (T, J, 3) is the external
    one, held from each moment until the next.
    """
    at, times, targets = _checked(at, times, targets)
    return _played(elastic, at, times, targets, np.zeros_like(targets), state, torque)


def along(
    elastic: Elastic,
    at: NDArray,
    times: NDArray,
    targets: NDArray,
    state: State | None = None,
    torque: NDArray | None = None,
) -> State:
    """As `towards`, with targets (n, J, 3) that go evenly from one to the next, where they are at `times` (n,)."""
    at, times, targets = _checked(at, times, targets)
    slopes = np.zeros_like(targets)
    slopes[:-1] = np.diff(targets, axis=0) / np.diff(times)[:, None, None]
    return _played(elastic, at, times, targets, slopes, state, torque)


def through(elastic: Elastic, at: NDArray, times: NDArray, targets: NDArray, speeds: NDArray | None = None) -> State:
    """The states (T, J, 3) at moments `at` (T,) of joints that are exactly in n postures (n, J, 3) at their times (n,).

    The target is the next posture, and as little more as makes the springs arrive in time, at the speeds (n, J, 3) that
    they are to have there.  Without `speeds` they come to rest at the first, the last and where they turn back, and
    those in between are such that a curve without springs would not swing over (Fritsch and Carlson).
    """
    at, times, targets = _checked(at, times, targets)
    speeds = _speeds(times, targets) if speeds is None else np.asarray(speeds, float)
    pieces, starts, slopes = [times[-1:]], [targets[-1:]], [np.zeros_like(targets[-1:])]
    for n, seconds in enumerate(np.diff(times)):
        ends = State(targets[n], speeds[n]), State(targets[n + 1], speeds[n + 1])
        knots = targets[n + 1] + _corrections(elastic, *ends, seconds)
        pieces.insert(-1, times[n] + seconds * np.arange(PIECES) / PIECES)
        starts.insert(-1, knots[:-1])
        slopes.insert(-1, np.diff(knots, axis=0) * PIECES / seconds)
    begun = at > times[0]
    steps = (np.append(times[0], at[begun]), np.concatenate(pieces), np.concatenate(starts), np.concatenate(slopes))
    found = _played(elastic, *steps, State(targets[0], speeds[0]), None)
    out = np.stack([np.tile(targets[0], (len(at), 1, 1)), np.zeros((len(at), *targets.shape[1:]))])
    out[:, begun] = found.turns[1:], found.speed[1:]
    return State(out[0], out[1])


def arrival(elastic: Elastic, share: float = 0.05) -> NDArray:
    """Seconds after which joints, from rest, stay within a share of the way from a new target (J,) or ().

    Give a posture its target so much before the beat that it is to be seen on.
    """
    if not 0 < share < 1:
        raise InputError(f"the share of a move that may be lacking must be between 0 and 1, got {share}")
    zeta, omega = damping_of(elastic), 2 * np.pi * frequency_of(elastic)
    slowest = np.where(zeta > 1, zeta - np.sqrt(np.maximum(zeta**2 - 1, 0)), zeta)
    if np.any(slowest * 1e4 < 1):
        raise InputError("a joint without damping never arrives: give it some, or pass `through` its postures")
    turns = np.linspace(0, 1, 4001) * (-2 * np.log(share) + 2) / slowest.min()  # radians of the swing
    plain = Elastic(1 + 0 * omega, 2 * zeta * (1 + 0 * omega), 1 + 0 * omega)
    left = np.abs(step(plain, still(np.ones((*omega.shape, 1))), turns, 0.0).turns)
    left = left.reshape(len(turns), *omega.shape)
    late = len(turns) - 1 - (left[::-1] > share).argmax(axis=0)  # the last moment outside
    return turns[np.minimum(late + 1, len(turns) - 1)] / omega


def energy(elastic: Elastic, state: State, target: ArrayLike = 0.0) -> NDArray:
    """What is in the springs and in the swing about a target (..., J)."""
    away = state.turns - np.asarray(target, float)
    return 0.5 * (elastic.inertia * (state.speed**2).sum(axis=-1) + elastic.stiffness * (away**2).sum(axis=-1))


def _free(swing: NDArray, square: NDArray, t: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Of x'' + 2 s x' + w^2 x = 0: s, and e^(-st) times cos(dt) and sin(dt) / d; d^2 = w^2 - s^2, or its hyperbolic."""
    swing, square, t = np.broadcast_arrays(swing, square, t)
    apart = square - swing**2
    d = np.sqrt(np.abs(apart))
    fade = np.exp(-swing * t)
    sine, cosine = fade * t * np.sinc(d * t / np.pi), fade * np.cos(d * t)
    creeps = apart < 0
    if creeps.any():
        safe = np.where(creeps, d, 1.0)
        slow = np.exp(-square / (swing + safe) * t)  # the difference of two large numbers, as a quotient
        fast = np.exp(-(swing + safe) * t)
        sine = np.where(creeps, slow * -np.expm1(-2 * safe * t) / (2 * safe), sine)
        cosine = np.where(creeps, 0.5 * (slow + fast), cosine)
    return swing, cosine, sine


def _played(
    elastic: Elastic,
    at: NDArray,
    times: NDArray,
    targets: NDArray,
    slopes: NDArray,
    state: State | None,
    torque: NDArray | None,
) -> State:
    """All frames between two changes of target, or of torque, at once."""
    state = still(targets[0]) if state is None else state
    shape = np.broadcast_shapes(targets.shape[1:], state.turns.shape)
    changes = np.union1d(times[(times > at[0]) & (times < at[-1])], at if torque is not None else at[:1])
    out = np.empty((2, len(at), *shape))
    for n, begins in enumerate(changes):
        ends = changes[n + 1] if n + 1 < len(changes) else at[-1]
        which = np.searchsorted(times, begins, side="right") - 1
        target, slope = (targets[which], slopes[which]) if which >= 0 else (targets[0], 0.0)
        target = target + slope * (begins - times[which]) if which >= 0 else target
        pull = 0.0 if torque is None else torque[np.searchsorted(at, begins, side="right") - 1]
        inside = np.flatnonzero((at >= begins) & (at <= ends))
        found = step(elastic, state, np.append(at[inside], ends) - begins, target, slope, pull)
        out[0, inside], out[1, inside] = found.turns[:-1], found.speed[:-1]
        state = found.at(-1)
    return State(out[0], out[1])


def _corrections(elastic: Elastic, first: State, last: State, seconds: float) -> NDArray:
    """What is added to a target that stays at `last`, at the ends of its pieces (P + 1, J, 3), to be in `last` in time.

    The least in the mean of squares.  Of springs without damping a whole swing cannot be steered by a few pieces only.
    """
    rest = step(elastic, first, seconds, last.turns)
    lacks = np.stack([last.turns - rest.turns, seconds * (last.speed - rest.speed)], axis=-2)  # (J, 2, 3)
    piece, none = seconds / PIECES, still(np.zeros((1, 1)))
    rising, falling = (step(elastic, none, piece, *ramp) for ramp in ((0.0, 1 / piece), (1.0, -1 / piece)))
    effects = []
    for knot in range(PIECES + 1):  # how a target that is 1 there, and 0 at the others, moves the joints until the end
        state = none
        if knot > 0:
            state = rising
        if knot < PIECES:
            begun = step(elastic, state, piece, 0.0) if knot > 0 else none
            state = State(begun.turns + falling.turns, begun.speed + falling.speed)
            state = step(elastic, state, seconds - (knot + 1) * piece, 0.0)
        effects.append(np.stack([state.turns[..., 0], seconds * state.speed[..., 0]], axis=-1))
    squares = np.diag(np.r_[2.0, np.full(PIECES - 1, 4.0), 2.0]) + np.eye(PIECES + 1, k=1) + np.eye(PIECES + 1, k=-1)
    even = np.linalg.inv(np.linalg.cholesky(squares)).T  # the square over time of what goes evenly between knots
    found = even @ np.linalg.pinv(np.stack(effects, axis=-1) @ even, rcond=1e-9) @ lacks
    return np.moveaxis(found, -2, 0)


def _speeds(times: NDArray, targets: NDArray) -> NDArray:
    """Speeds (n, J, 3) in postures: none at the ends and at turning points, else what makes for no swing over."""
    from scipy.interpolate import PchipInterpolator

    if len(times) < 3:
        return np.zeros_like(targets)
    speeds = PchipInterpolator(times, targets, axis=0).derivative()(times)
    speeds[[0, -1]] = 0
    return speeds


def _checked(at: NDArray, times: NDArray, targets: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    at, times, targets = (np.asarray(values, float) for values in (at, times, targets))
    if targets.ndim != 3 or targets.shape[-1] != 3 or len(targets) != len(times) or not len(times):
        raise InputError(
            f"postures must be one or more, turns (x, y, z) for each joint and a time for each, they came with shape "
            f"{targets.shape} and {len(times)} times"
        )
    for what, values in (("postures", times), ("frames", at)):
        if values.ndim != 1 or not len(values) or not np.isfinite(values).all() or (np.diff(values) <= 0).any():
            raise InputError(f"the times of {what} must be finite and rise, got {values.tolist()[:6]}: sort them")
    if not np.isfinite(targets).all():
        raise InputError("the turns of postures must be finite numbers, they hold NaN or infinity: check the postures")
    return at, times, targets
