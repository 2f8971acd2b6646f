"""When feet stand: low over the floor and slow, both with hysteresis, and not for an instant only."""

import numpy as np
from numpy.typing import NDArray

from mocap.bodies.body import find_body
from mocap.skeletons.skeleton import SkeletonMotion
from mocap.skeletons.units import STATURE, stature

LOW, SLOW = 0.035, 0.5
"""Metres over the floor and metres a second: a foot that stands stays below both."""
SURE = 0.7
"""And at some time of its stand below this share of both."""
SHORTEST, GAP = 0.1, 0.06
"""Seconds: a shorter stand is none, a shorter lift between two stands is none."""
STEP = 0.05
"""Metres: by as much may one foot's joint be higher over the floor than another's, since shoes and sensors differ."""
LASTS = 1.0
"""Seconds that a floor lasts: longer than a jump."""


def find_contacts(
    motion: SkeletonMotion | NDArray,
    joints: tuple[int, ...] | list[int] | NDArray | None = None,
    fps: float | None = None,
    tall: float | None = None,
) -> NDArray:
    """When F joints of a motion in metres, y up, stand on the floor (T, F) bool; the feet if no joints are named.

    For positions (T, J, 3) of a motion, `joints` and `fps` must be given.  Lengths and speeds above are a person's;
    who is `tall` otherwise, metres, is measured in proportion (what a motion itself tells, if it has legs).
    """
    if isinstance(motion, SkeletonMotion):
        places, fps = motion.positions(), motion.fps
        body = find_body(motion.skeleton, places)
        joints = body.feet if joints is None else joints
        tall = tall or stature(motion, body)
    else:
        places = np.asarray(motion, float)
        if joints is None or fps is None:
            raise TypeError("positions alone need joints and fps")
    feet = places[:, list(joints)]
    scale = (tall or STATURE) / STATURE
    height, speed = feet[..., 1] - floors(feet, fps, scale), speeds(feet, fps)
    stays = (height < LOW * scale) & (speed < SLOW * scale)
    sure = (height < SURE * LOW * scale) & (speed < SURE * SLOW * scale)
    found = np.zeros(stays.shape, bool)
    for foot in range(stays.shape[1]):
        stands = [(start, stop) for start, stop in runs(stays[:, foot]) if sure[start:stop, foot].any()]
        stands = _joined(stands, GAP * fps, height[:, foot] < LOW * scale)
        for start, stop in stands:
            found[start:stop, foot] = stop - start >= min(SHORTEST * fps, len(places))
    return found


def speeds(points: NDArray, fps: float) -> NDArray:
    """Speeds (T, F) of points (T, F, 3) in their unit a second, each over a 30th of a second around its frame."""
    count = len(points)
    half = max(round(fps / 60), 1)
    later = np.minimum(np.arange(count) + half, count - 1)
    sooner = np.maximum(np.arange(count) - half, 0)
    way = np.linalg.norm(points[later] - points[sooner], axis=-1)
    return way * fps / np.maximum(later - sooner, 1)[:, None]


def floors(feet: NDArray, fps: float, scale: float = 1.0) -> NDArray:
    """How high the floor under each of the feet (T, F, 3) is (T, F), in their unit.

    The lowest foot that is slow tells it, and the floor keeps a height for some time: so a stair and a stand on tiptoe
    are floors, as is the drift of inertial sensors, and the height of a jump is none.  A foot whose joint is higher in
    its shoe than the other's has a floor that is as much higher, up to STEP.
    """
    height, slow = feet[..., 1], speeds(feet, fps) < SLOW * scale
    level = _level(height, slow, fps)[:, None]
    higher = [
        np.percentile((height - level)[still, foot], 10) if still.any() else 0.0 for foot, still in enumerate(slow.T)
    ]
    higher = np.clip(higher, 0, STEP * scale)
    return _level(height - higher, slow, fps)[:, None] + higher


def _level(height: NDArray, slow: NDArray, fps: float) -> NDArray:
    """One floor (T,) for all feet: heights that last, an opening of the lowest slow foot's."""
    from scipy.ndimage import grey_opening

    lowest = np.where(slow, height, np.inf).min(axis=1, initial=np.inf)
    known = np.flatnonzero(np.isfinite(lowest))
    if not len(known):
        return np.full(len(height), np.percentile(height, 5) if height.size else 0.0)
    lowest = np.interp(np.arange(len(height)), known, lowest[known])
    return grey_opening(lowest, size=min(round(LASTS * fps) | 1, 2 * len(height) - 1), mode="nearest")


def runs(mask: NDArray) -> list[tuple[int, int]]:
    """Where a mask (T,) is true: from a frame to before another."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(int)))
    return [(int(start), int(stop)) for start, stop in edges.reshape(-1, 2)]


def _joined(stands: list[tuple[int, int]], gap: float, low: NDArray) -> list[tuple[int, int]]:
    found: list[tuple[int, int]] = []
    for start, stop in stands:
        if found and start - found[-1][1] < gap and low[found[-1][1] : start].all():
            found[-1] = (found[-1][0], stop)
        else:
            found.append((start, stop))
    return found
