"""Wind over plants, with gusts (Chen et al. 2004, section 6 and figure 10): both spring models at once.

The wind pushes each link as drag does, by the square of its speed past the link.  What these forces have in common
sways the whole plant in its slowest modes; what is left over flutters each joint on its own elastic spring.  Both are
stepped exactly, a few times a frame, each time with the wind on the plant as it is bent then.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from mocap.posing import elastic, modes
from mocap.posing.modes import Modes
from mocap.posing.postures import posed, unturned
from mocap.skeleton import Skeleton, SkeletonMotion, own_maps

STEPS = 120
"""Steps a second, or a few more: the usual frame rates divide it, so a motion is the same at all of them."""

CATCH = 0.04
"""How much wind a link of the usual plant catches: by 10 m/s it is pushed as by 4 m/s^2."""

WAVES = 32
FLOOR = 6.0
"""Hz: how hard the ground is, as a swing of what stands on it."""


@dataclass(frozen=True)
class Wind:
    """A wind with a mean speed in metres a second, that comes in gusts."""

    speed: float = 6.0
    toward: tuple[float, float, float] = (1.0, 0.0, 0.0)  # where it blows to
    gusts: float = 0.5  # how much its speed goes up and down; 0 is even, 1 a storm of squalls
    between: float = 2.5  # seconds from gust to gust
    aside: float = 0.3  # how much it turns to the sides and up, times its speed
    seed: int = 0

    def __post_init__(self) -> None:
        numbers = (self.speed, self.gusts, self.between, self.aside, *self.toward)
        if not np.isfinite(numbers).all() or min(self.speed, self.gusts, self.aside) < 0 or self.between <= 0:
            raise InputError(
                "a wind must have a speed, gusts and turns aside of 0 or more and time between gusts above 0, got "
                f"{self.speed:g}, {self.gusts:g}, {self.aside:g} and {self.between:g}: give its direction in `toward`"
            )
        if len(self.toward) != 3 or not any(self.toward):
            raise InputError(f"a wind must blow to somewhere, it came with {self.toward}: give it x, y and z")


def blowing(wind: Wind, places: NDArray, seconds: NDArray | float) -> NDArray:
    """The wind (..., 3), metres a second, at places (..., 3) and moments (...) or one moment.

    Smooth noise by formula: waves of random phase, weaker the quicker they are as in the open air (Kolmogorov's
    f^-5/3), that travel with the wind.  Its mean over time is the wind's speed, and it never blows backwards.
    """
    places, seconds = np.asarray(places, float), np.asarray(seconds, float)
    along, across, up = _ways(tuple(wind.toward))
    if wind.speed == 0:
        return np.zeros(np.broadcast_shapes(places.shape, (*seconds.shape, 3)))
    strength, pitch, phase, lean = _waves(wind.seed, wind.between)
    fronts = (along + 0.6 * lean @ np.stack([across, up])) / max(wind.speed, 1.0)  # (3, W, 3)
    late = (places @ fronts.reshape(-1, 3).T).reshape(*places.shape[:-1], *pitch.shape)
    noise = (strength * np.sin(2 * np.pi * pitch * (seconds[..., None, None] - late) + phase)).sum(axis=-1)  # (..., 3)
    spread = wind.gusts * 0.6
    push = np.exp(spread * noise[..., :1] - spread**2 / 2)
    aside = wind.aside * (noise[..., 1:2] * across + 0.5 * noise[..., 2:] * up)
    return wind.speed * push * (along + aside)


def sway(
    skeleton: Skeleton,
    wind: Wind,
    seconds: float,
    fps: float,
    rest: NDArray | None = None,
    frequency: float = 1.2,
    damping: float = 0.12,
    catch: float = CATCH,
    count: int = 4,
    gravity: float = 0.0,
    ground: float | None = None,
    settle: float = 3.0,
) -> SkeletonMotion:
    """A plant in the wind for so many seconds, metres, y up, its roots held; at rest as in `rest` (J, 4).

    Its slowest sway is `frequency` times a second, and its `count` slowest ones are those of the whole plant.  With
    `gravity` (m/s^2) what is bent down falls further: at rest its springs hold it.  With a `ground` at a height it lies
    on that.  The wind has blown for `settle` seconds when the motion begins.
    """
    for name, value, least in (("seconds", seconds, 0), ("frame rate", fps, 0), ("catch", catch, -1e-300)):
        if not (np.isfinite(value) and value > least):
            raise InputError(f"the {name} of a plant in the wind must be above 0, got {value}: give another one")
    rest = unturned(skeleton) if rest is None else np.asarray(rest, float)
    own = modes.of_skeleton(skeleton, rest, frequency, count)
    still = posed(skeleton, np.zeros((1, len(skeleton), 3)), fps, rest)
    local, maps = own_maps(still.translation, still.rotation)[0], still.world()[0]
    plant = _Plant(own, local, catch, gravity, ground, _weights(own, maps, gravity))
    springs = _springs(own, damping)
    steps = int(np.ceil(STEPS / fps - 1e-9))
    step = 1 / (fps * steps)
    early, frames = int(np.ceil(settle * fps)), max(round(seconds * fps), 1)
    whole, each = elastic.still(np.zeros((len(own), 1))), elastic.still(np.zeros((len(skeleton), 3)))
    turns, points = [], None
    for at in range((early + frames - 1) * steps + 1):
        now = modes.softly(np.einsum("lj...,l->j...", own.shapes, whole.turns[:, 0]) + each.turns)
        if at >= early * steps and at % steps == 0:
            turns.append(now)
        torque, points = _torque(plant, wind, now, points, step, at * step - early / fps)
        amounts = np.einsum("jd,ljd->l", torque, own.shapes)
        left = torque - np.einsum("l,ljd->jd", amounts / springs[0].stiffness, own.shapes) * own.stiffness[:, None]
        whole = elastic.step(springs[0], whole, step, 0.0, torque=amounts[:, None])
        each = elastic.step(springs[1], each, step, 0.0, torque=left)
    return posed(skeleton, np.array(turns), fps, rest)


@dataclass(frozen=True, eq=False)
class _Plant:
    """What the forces on it depend on."""

    own: Modes
    local: NDArray  # (J, 3, 4) joints' maps to their parents at rest
    catch: float
    gravity: float
    ground: float | None
    held: NDArray  # (J, 3) the torques of gravity at rest


def _springs(own: Modes, damping: float) -> tuple[elastic.Elastic, elastic.Elastic]:
    """Those of the modes (L,), and of each joint by itself (J,); a joint that does not turn gets any, and no torque."""
    turns = own.stiffness > 0
    heavy = np.where(turns, np.linalg.eigvalsh(own.inertia)[:, -1], 1.0)
    stiff = np.where(turns, own.stiffness, 1.0)
    alone = elastic.felt(np.sqrt(stiff / heavy) / (2 * np.pi), 2 * damping, heavy)  # what is small is soon at rest
    return elastic.felt(own.frequency, damping), alone


def _torque(
    plant: _Plant, wind: Wind, turns: NDArray, before: NDArray | None, step: float, seconds: float
) -> tuple[NDArray, NDArray]:
    """What turns the joints (J, 3), in their own axes, as they are bent now; and where the links' points are."""
    parents, mass = plant.own.parents, plant.own.mass[:, None]
    places, axes = _bent(plant, turns)
    points = np.stack([modes.on_links(places, parents, at) for at in modes.POINTS])  # (2, J, 3)
    link = points[1] - points[0]
    link = link / np.maximum(np.linalg.norm(link, axis=1, keepdims=True), 1e-12)
    speed = np.zeros_like(points) if before is None else (points - before) / step
    past = blowing(wind, points, seconds) - speed
    past = past - 0.9 * (past * link).sum(axis=-1, keepdims=True) * link  # along a link it hardly catches
    force = plant.catch * np.linalg.norm(past, axis=-1, keepdims=True) * past
    force[..., 1] -= plant.gravity
    if plant.ground is not None:
        depth, hard = np.maximum(plant.ground - points[..., 1], 0), 2 * np.pi * FLOOR
        force[..., 1] += np.where(depth > 0, hard**2 * depth - hard * speed[..., 1], 0.0).clip(min=0)
    forces = 0.5 * mass * force
    torque = modes.in_own(axes, modes.torques_of(parents, places, points, forces)) - plant.held
    return np.where(plant.own.stiffness[:, None] > 0, torque, 0.0), points


def _bent(plant: _Plant, turns: NDArray) -> tuple[NDArray, NDArray]:
    """Joints' places (J, 3) and axes (J, 3, 3) in the world, after turns (J, 3)."""
    from scipy.spatial.transform import Rotation

    local = plant.local.copy()
    local[..., :3] @= Rotation.from_rotvec(turns).as_matrix()
    world = local.copy()
    for joint, parent in enumerate(plant.own.parents):
        if parent >= 0:
            np.matmul(world[parent, :, :3], local[joint], out=world[joint])
            world[joint, :, 3] += world[parent, :, 3]
    return world[..., 3], world[..., :3]


def _weights(own: Modes, maps: NDArray, gravity: float) -> NDArray:
    """How gravity turns the joints (J, 3) at rest, in their own axes: their springs hold against it."""
    places = maps[..., 3]
    points = [modes.on_links(places, own.parents, at) for at in modes.POINTS]
    pull = 0.5 * own.mass[:, None] * np.array([0, -gravity, 0])
    return modes.in_own(maps[..., :3], modes.torques_of(own.parents, places, points, [pull, pull]))


@lru_cache(maxsize=8)
def _ways(toward: tuple[float, float, float]) -> tuple[NDArray, NDArray, NDArray]:
    """Along the wind, to its side, and across both, up where it can be."""
    along = np.array(toward, float)
    along /= np.linalg.norm(along)
    across = np.cross([0.0, 1, 0], along)
    across = across / np.linalg.norm(across) if np.linalg.norm(across) > 1e-9 else np.array([0.0, 0, 1])
    return along, across, np.cross(along, across)


@lru_cache(maxsize=8)
def _waves(seed: int, between: float) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """Strengths, pitches in Hz, phases (3, W) and how far waves lean aside (3, W, 2), of speed and two ways across."""
    rng = np.random.default_rng(seed)
    pitch = np.geomspace(0.25, 8, WAVES) * rng.uniform(0.9, 1.1, (3, WAVES)) / between
    strength = (pitch * between) ** (-1 / 3) * np.minimum(pitch * between, 1.0)  # f^-5/3 over octaves
    strength *= np.sqrt(2 / (strength**2).sum(axis=1, keepdims=True))
    return strength, pitch, rng.uniform(0, 2 * np.pi, (3, WAVES)), rng.uniform(-1, 1, (3, WAVES, 2))
