"""A motion's report card: do the feet skate, does it jitter, how far do links stretch, is the volume kept?"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mocap.bodies.body import find_body
from mocap.bodies.contacts import LOW, SLOW, find_contacts, floors, speeds
from mocap.rubber.collide import overlaps
from mocap.rubber.rubber import RubberMotion, rooted
from mocap.skeletons.skeleton import SkeletonMotion
from mocap.skeletons.units import STATURE, link_lengths, stature


@dataclass(frozen=True, eq=False)
class Report:
    """Figures of a motion, upright and in metres, and of what was made of it; NaN where there is nothing to measure."""

    frames: int
    fps: float
    joints: int  # end sites among them
    tall: float  # metres a person with such legs is tall; 0 for what is no person
    stands: float  # share of frames and feet in contact on the input
    skate_before: float  # cm/s along the floor while in contact, as captured
    skate: float  # the same feet and frames in what was made
    kept: float  # share of the contacts in which the foot is still on the floor and slow
    jerk: float  # root mean square of the third derivative, times the input's
    stretch: tuple[float, float, float]  # percentiles 1, 50 and 99 of links' lengths, times at rest
    volume: tuple[float, float]  # least and most over time of the sum of length x thickness^2, times at rest
    penetration: float = 0.0  # cm that limbs go into each other at most, beyond what was captured
    ms_per_frame: float | None = None  # what making it took, if it was measured

    def lines(self, captured: bool = False) -> list[str]:
        """The card, a line a figure; without those that compare, where it is of what was `captured`."""
        low, middle, high = self.stretch
        tall = f", {self.tall:.2f} m tall" if self.tall else ""
        said = {"motion": f"{self.frames} frames at {self.fps:.4g} a second, {self.joints} joints and ends{tall}"}
        if np.isfinite(self.skate):
            before = "" if captured else f", as captured {self.skate_before:.1f}"
            said["feet"] = f"on the floor {100 * self.stands:.0f} % of the time, skating {self.skate:.1f} cm/s{before}"
        elif np.isfinite(self.stands):
            said["feet"] = "never on the floor"
        if np.isfinite(low):
            said["links"] = f"{low:.2f} to {high:.2f} times as long as at rest (percentiles 1, 99), median {middle:.2f}"
        if not captured:
            said["contacts"] = f"{100 * self.kept:.0f} % kept" if np.isfinite(self.kept) else "none"
            said["jerk"] = f"{self.jerk:.2f} times as captured"
            said["volume"] = f"{self.volume[0]:.2f} to {self.volume[1]:.2f} of that at rest"
            said["inside"] = f"limbs go up to {self.penetration:.1f} cm further into each other than captured"
        if self.ms_per_frame is not None:
            said["time"] = f"{self.ms_per_frame:.3f} ms a frame"
        return [f"{name:<8}  {line}" for name, line in said.items()]


def report(
    source: SkeletonMotion,
    made: RubberMotion | NDArray | None = None,
    contacts: NDArray | None = None,
    seconds: float | None = None,
) -> Report:
    """The card of `made`, rubber or positions (T, J, 3), of an upright `source`; of the source itself without it.

    `contacts` (T, F) of the feet that `find_body` finds in the source, where they are known; `seconds` are what making
    it took.
    """
    places = source.positions()
    body = find_body(source.skeleton, places)
    tall = stature(source, body)
    contacts = find_contacts(places, body.feet, source.fps, tall) if contacts is None else contacts
    joints, stretch, volume = _links(source, made, places)
    feet, now = places[:, list(body.feet)], joints[:, list(body.feet)]
    links = made is not None and source.skeleton.lengths().any()
    inside = float(overlaps(joints, places, rooted(source).skeleton).max()) if links else 0.0
    return Report(
        frames=len(places),
        fps=source.fps,
        joints=len(made.subjoints.parents) if isinstance(made, RubberMotion) else len(source.skeleton),
        tall=tall,
        stands=float(contacts.mean()) if contacts.size else np.nan,
        skate_before=skate(feet, contacts, source.fps),
        skate=skate(now, contacts, source.fps),
        kept=_kept(feet, now, contacts, source.fps, (tall or STATURE) / STATURE),
        jerk=_ratio(jerk(joints, source.fps), jerk(places, source.fps)),
        stretch=stretch,
        volume=volume,
        penetration=100 * inside,
        ms_per_frame=None if seconds is None else 1e3 * seconds / len(places),
    )


def skate(feet: NDArray, contacts: NDArray, fps: float) -> float:
    """Mean speed along the floor, cm/s, of feet (T, F, 3) in metres from frame to frame while in contact (T, F)."""
    both = contacts[1:] & contacts[:-1]
    speed = 100 * fps * np.linalg.norm(np.diff(feet, axis=0)[..., [0, 2]], axis=-1)
    return float(speed[both].mean()) if both.any() else np.nan


def jerk(places: NDArray, fps: float) -> float:
    """Root mean square of the third derivative of positions (T, J, 3), metres a second cubed."""
    third = np.diff(places, n=3, axis=0) * fps**3
    return float(np.sqrt((third**2).sum(axis=-1).mean())) if third.size else np.nan


def _kept(feet: NDArray, now: NDArray, contacts: NDArray, fps: float, scale: float) -> float:
    """The share of contacts (T, F) in which feet (T, F, 3) that were there are now as near to the floor, and slow."""
    height = now[..., 1] - floors(feet, fps, scale)
    stands = (np.abs(height) < LOW * scale) & (speeds(now, fps) < SLOW * scale)
    return float(stands[contacts].mean()) if contacts.any() else np.nan


def _links(
    source: SkeletonMotion, made: RubberMotion | NDArray | None, places: NDArray
) -> tuple[NDArray, tuple[float, float, float], tuple[float, float]]:
    """The joints' places (T, J, 3), percentiles of stretch, and the extremes of volume."""
    parents, rest, owner = np.array(source.skeleton.parents), link_lengths(source), np.arange(len(source.skeleton))
    points = joints = places
    if isinstance(made, RubberMotion):
        parents, rest, owner = np.array(made.subjoints.parents), _rest(made), made.subjoints.joint
        points, joints = made.positions, made.positions[:, made.subjoints.ends]
    elif made is not None:
        points = joints = np.asarray(made, float)
    thick = made.thickness if isinstance(made, RubberMotion) else np.ones(points.shape[:2])
    links = (parents >= 0) & (rest > 1e-6 * max(rest.sum(), 1e-12)) & ~_free(source)[owner]
    if not links.any():
        return joints, (np.nan, np.nan, np.nan), (np.nan, np.nan)
    length = np.linalg.norm(points - points[:, parents], axis=-1)[:, links]
    low, middle, high = np.percentile(length / rest[links], [1, 50, 99])
    volume = (length * thick[:, links] ** 2).sum(axis=1) / rest[links].sum()
    return joints, (float(low), float(middle), float(high)), (float(volume.min()), float(volume.max()))


def _rest(made: RubberMotion) -> NDArray:
    """How long the sub-link above each sub-joint is at rest (S,), metres; roots 0."""
    parts = made.subjoints
    above = np.array(parts.parents)
    same = (above >= 0) & (parts.joint[above] == parts.joint)
    share = parts.along - np.where(same, parts.along[above], 0.0)
    return np.where(above < 0, 0.0, share * link_lengths(made.source)[parts.joint])


def _free(source: SkeletonMotion) -> NDArray:
    """The joints (J,) that move freely against their parents, as hips do on a root that stays: they are no links."""
    away = np.abs(source.translation - np.median(source.translation, axis=0)).max(axis=(0, 2))
    return away > 0.05 * link_lengths(source).sum()


def _ratio(one: float, other: float) -> float:
    return one / other if other > 0 else (1.0 if one == 0 else np.nan)
