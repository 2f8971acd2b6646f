"""The gallery's skeletons: motion made of rubber, analogies, posing, dance and wind, drawn small."""

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from capture.pictures.decode import read_clip
from capture.pictures.encode import over
from mocap import sticks
from mocap.posing import beats, limits, poses, session
from mocap.skeletons.bvh import read_bvh
from mocap.skeletons.skeleton import Skeleton
from notebooks.gallery import small

AHEAD, ASIDE = 1.1, 0.45  # radians a figure is turned: it goes to the right; it is seen from half its front
PAPER, SKY = (250, 249, 246), (207, 227, 238)
THICK = {"head": 0.085, "spine": 0.07, "hips": 0.07, "neck": 0.045, "hand": 0.028, "toe": 0.035}  # metres, half
LIMB = 0.045


def kick_of_rubber() -> list[NDArray]:
    """A kick as captured, and made of rubber."""
    return _compared({"captured": Path("f/kick.bvh"), "of rubber": Path("kick.rubber.bvh")}, (190, 210), 20, (0.4, 2.4))


def analogy() -> list[NDArray]:
    """A and A', and below them B and what was found for B'."""
    files = {"A": Path("f/walk.bvh"), "A'": Path("f/sneak.bvh"), "B": Path("f/kick.bvh"), "B'": Path("made.bvh")}
    frames = _compared(files, (170, 180), 15, (0.0, 3.0))
    wide = frames[0].shape[1] // 2
    return [np.concatenate([frame[:, :wide], frame[:, wide:]]) for frame in frames]


def spring_posing() -> list[NDArray]:
    """The right hand is dragged, and then the hips; feet are pinned."""
    motion = read_bvh("f/kick.bvh")
    posing = session.begun(motion.skeleton, poses.pose_of(motion, 0), limits.usual(motion.skeleton))
    for foot in ("LeftFoot", "RightFoot"):
        posing.send({"do": "pin", "joint": foot})
    places, pulled = [np.array(posing.send({"do": "look"})["positions"])] * 8, [(-1, None)] * 8
    for name, by in (("RightHand", (-0.35, 0.8, 0.2)), ("Hips", (0.12, -0.28, 0.05))):
        joint, begin = motion.skeleton.names.index(name), places[-1]
        for share in _eased(28):
            to = begin[joint] + share * np.array(by)
            told = posing.send({"do": "drag", "joint": name, "to": to.tolist()})
            places.append(np.array(told["positions"]))
            pulled.append((joint, to))
        posing.send({"do": "drop"})
        places, pulled = places + [places[-1]] * 8, pulled + [(-1, None)] * 8
    return _dragged(motion.skeleton, np.array(places), pulled)


def rubber_on_a_drawing() -> list[NDArray]:
    """A walk on a drawing, stiff above and of rubber below; both go as far."""
    clips = [[over(frame, PAPER) for frame in read_clip(name)] for name in ("stiff", "rubber")]
    size = np.max([clip[0].shape[:2] for clip in clips], axis=0)
    stiff, rubber = (small.scaled(clip, 240) for clip in small.cut([_padded(clip, *size) for clip in clips]))
    return small.above(small.named(stiff, "stiff"), small.named(rubber, "of rubber"))


def dance_on_the_beat() -> list[NDArray]:
    """The dance, and below it the beats, each lit when it is reached."""
    (danced,) = small.cut([[over(frame, PAPER) for frame in read_clip("dance")]], shape=1.1)
    frames = small.scaled(danced, 270)
    times = beats.steady(110, 9 * 60 / 110 - 1e-6).times
    return [_with_beats(frame, times - t / 12) for t, frame in enumerate(frames)]


def flower_in_the_wind() -> list[NDArray]:
    """The flower on a pale sky; the part of the clip that comes back to where it began."""
    frames = small.scaled([over(frame, SKY) for frame in read_clip("wind")], 250)
    first, last = _loop(frames, least=42)
    return frames[first:last]


def _compared(files: dict[str, Path], size: tuple[int, int], fps: int, seconds: tuple[float, float]) -> list[NDArray]:
    """Stretches of motions of 60 frames a second, in seconds, side by side at one size and on one floor."""
    motions = {name: read_bvh(file) for name, file in files.items()}
    places = {
        name: motion.positions()[round(60 * seconds[0]) : round(60 * seconds[1]) : 60 // fps]
        for name, motion in motions.items()
    }
    still = {name: _in_place(motions[name].skeleton, it) for name, it in places.items()}
    view = sticks.view_of(np.concatenate(list(still.values()), axis=1), size, AHEAD, follow=False, margin=0.07)
    clips = []
    for name, it in still.items():
        skeleton = motions[name].skeleton
        pictures = sticks.draw(it, skeleton.parents, view, _thickness(skeleton), sticks.sides(skeleton.names))
        clips.append(small.named(list(pictures), name))
    return small.beside(*clips)


def _in_place(skeleton: Skeleton, places: NDArray) -> NDArray:
    """Positions (T, J, 3) of who goes as if on a treadmill: hips are where they are on an even way."""
    hips = places[:, 0]
    way = np.linspace(0, 1, len(hips))[:, None] * (hips[-1] - hips[0]) + hips[0]
    return places - (way * (1, 0, 1))[:, None]


def _thickness(skeleton: Skeleton) -> NDArray:
    """Half a link's thickness (J,), in metres, by what joints are called: sticks that look like somebody."""
    plain = [name.lower() for name in skeleton.names]
    return np.array([next((thick for part, thick in THICK.items() if part in name), LIMB) for name in plain])


def _dragged(skeleton: Skeleton, places: NDArray, pulled: Sequence[tuple[int, NDArray | None]]) -> list[NDArray]:
    view = sticks.view_of(places, (320, 340), ASIDE, follow=False, margin=0.08)
    seen = sticks.project(places, view)
    feet = [skeleton.names.index(name) for name in ("LeftFoot", "RightFoot")]
    made = []
    for t, picture in enumerate(
        sticks.draw(places, skeleton.parents, view, _thickness(skeleton), sticks.sides(skeleton.names))
    ):
        picture = np.ascontiguousarray(picture)
        for foot in feet:
            _dot(picture, seen[t, foot, :2], 5, small.INK)
        joint, _ = pulled[t]
        if joint >= 0:
            _dot(picture, seen[t, joint, :2], 9, (240, 190, 40))
            _dot(picture, seen[t, joint, :2], 4, small.INK)
        made.append(picture)
    return made


def _with_beats(frame: NDArray, ahead: NDArray) -> NDArray:
    """A frame over a row of beats (N,), which are so many seconds ahead: one that is reached lights up, and fades."""
    strip = np.empty((30, frame.shape[1], 3), np.uint8)
    strip[:] = PAPER
    for n, seconds in enumerate(ahead):
        lit = float(np.exp(min(seconds, 0) / 0.18)) if seconds <= 1e-6 else 0.0
        color = (1 - lit) * np.array((214, 210, 202)) + lit * np.array((214, 92, 58))
        _dot(strip, ((n + 0.5) * frame.shape[1] / len(ahead), 14.5), 5 + 3 * lit, tuple(int(c) for c in color))
    return np.concatenate([frame, strip])


def _dot(picture: NDArray, at: Sequence[float], radius: float, color: tuple[int, int, int]) -> None:
    middle = [round(float(v) * 16) for v in at]
    cv2.circle(picture, middle, round(radius * 16), color, -1, cv2.LINE_AA, 4)


def _padded(frames: Sequence[NDArray], height: int, width: int) -> list[NDArray]:
    """Frames with paper above and to the right, so that they have that size."""
    made = np.empty((len(frames), height, width, 3), np.uint8)
    made[:] = PAPER
    made[:, height - frames[0].shape[0] :, : frames[0].shape[1]] = frames
    return list(made)


def _eased(count: int) -> NDArray:
    share = np.linspace(0, 1, count + 1)[1:]
    return share * share * (3 - 2 * share)


def _loop(frames: Sequence[NDArray], least: int) -> tuple[int, int]:
    """The frames [first, last) of at least so many that end most like they begin, in place and in movement."""
    tiny = np.stack([cv2.resize(frame, (64, 64), interpolation=cv2.INTER_AREA).astype(float) for frame in frames])
    best = (np.inf, 0, len(frames) - 1)
    for first in range(1, len(frames) - least):
        for last in range(first + least, len(frames)):
            off = np.abs(tiny[first] - tiny[last]).mean() + np.abs(tiny[first - 1] - tiny[last - 1]).mean()
            best = min(best, (off, first, last))
    return best[1], best[2]
