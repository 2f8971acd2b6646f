"""Footage without a captured layer: what was behind it is found in other frames, and made up where it never shows.

    cover   ->   camera   ->   still   ->   filled

Where the camera moved, all frames are laid onto the middle one.  A pixel that the layer leaves free in other frames
takes their median; where those differ among themselves, or the frame at hand shows something else next to it, its
surroundings are carried on instead.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.fit.pixels import model as models
from capture.motion.tracks import CartoonMotion
from capture.pictures import matte
from capture.pictures.clip import Clip, remembering
from capture.pictures.colors import ColorModel
from capture.pictures.shot import Shot
from retarget.characters.target import parts_of
from retarget.stage import camera, composite
from retarget.stage.carry import carried_on
from retarget.stage.composite import Blend
from retarget.stage.perform import Performance

RIM = 3, 0.005  # pixels, and times the picture's height: what the layer's ink, soft edge and halo have coloured
AGREES = 0.6  # overlap of the cut-out with the captured outline from which on the cut-out alone is believed
LOOKED_AT = 48  # frames that the background is found in
ROOM = 256 * 2**20  # bytes that these may take
FEW = 0.1  # of the frames, in which something may pass before a still pixel
OTHER = 8.0, 2.5  # grey levels, and times the grain, from which on a pixel shows something else
NEAR = 40  # pixels round the layer that tell how bright a frame is, and what moves there


@dataclass(frozen=True, eq=False)
class Still:
    """The background of a shot as far as the frames tell."""

    pixels: NDArray  # (H, W, 3) float32
    sure: NDArray  # (H, W) bool: seen, and always the same
    grain: float  # grey levels that a still pixel is off, in all but few frames

    @property
    def other(self) -> float:
        """Grey levels from which on a pixel shows something else than before."""
        return OTHER[0] + OTHER[1] * self.grain


def into(
    performance: Performance,
    shot: Shot,
    motion: CartoonMotion,
    clip: Clip,
    size: int | None = None,
    blend: Blend | None = None,
) -> Iterator[NDArray]:
    """All frames uint8 (H, W, 3) of the shot's clip with the performers in the place of those they play.

    Other captured parts of the shot that are drawn in front of all who are played stay in front.
    """
    played = tuple(part for role in performance.roles for part in parts_of(role.target))
    clean = without(shot, motion, played, clip)
    foremost = np.max([motion.track(part).order for part in played], axis=0)
    others = [track for track in motion.tracks if track.part not in played and (track.order > foremost).any()]
    mattes = {track.part: look(shot, motion, track.part, clip) for track in others}

    def front(t: int) -> NDArray:
        alpha = np.zeros(clip.size[::-1], np.float32)
        for track in others:
            if track.order[t] > foremost[t]:
                alpha = np.maximum(alpha, mattes[track.part](t))
        return np.dstack([clip[t][..., :3], np.round(255 * alpha).astype(np.uint8)])

    return composite.over(performance, clean, size, blend, front if others else None)


def without(shot: Shot, motion: CartoonMotion, parts: tuple[str, ...], clip: Clip) -> Clip:
    """The shot's clip with the captured `parts` taken out; frames are made when they are asked for."""
    if len(clip) != len(motion.times) or clip.size != motion.size:
        raise InputError(
            f"the shot must be the one that was captured: it has {len(clip)} frames of {clip.size[0]} x "
            f"{clip.size[1]}, the motion {len(motion.times)} of {motion.size[0]} x {motion.size[1]}; give that one"
        )
    rim = rim_of(clip.size)
    brush = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * rim + 1, 2 * rim + 1))
    looks = {part: look(shot, motion, part, clip) for part in parts}

    @lru_cache(maxsize=64)
    def cover(t: int) -> NDArray:
        hidden = np.zeros(clip.size[::-1], np.uint8)
        for part in parts:
            hidden |= cv2.dilate((looks[part](t) > 0.05).astype(np.uint8), brush)
        return hidden

    maps, size = camera.onto_one(clip, cover)
    still = recover(clip, cover, maps, size)
    fetch = remembering(lambda t: filled(clip[t][..., :3], cover(t), _seen_by(still, maps[t], clip.size)), clip.size)
    return replace(clip, has_alpha=False, _fetch=fetch)


def rim_of(size: tuple[int, int]) -> int:
    """Pixels round a layer that are taken out with it, in a picture of `size` (width, height)."""
    return round(RIM[0] + RIM[1] * size[1])


def look(shot: Shot, motion: CartoonMotion, part: str, clip: Clip) -> Callable[[int], NDArray]:
    """A function from a frame's number to a captured part's soft matte (H, W) float32 there, 0 where it is not seen."""
    known = {one.name: one for one in shot.parts}
    if part not in known:
        raise InputError(f"the shot must hold the part that is replaced: it has {', '.join(known)}, not {part!r}")
    colors = models.learn(known[part], clip, shot.start, shot.parts).colors
    outline, visible = motion.outline(part), motion.track(part).visible

    def alpha(t: int) -> NDArray:
        if not visible[t]:
            return np.zeros(clip.size[::-1], np.float32)
        return _cut(colors, clip[t], matte.fill(clip.size, outline[t]))

    return alpha


def _cut(colors: ColorModel, frame: NDArray, posed: NDArray) -> NDArray:
    """The layer's matte in a frame; where its colours lead elsewhere, the captured outline counts too."""
    alpha = matte.cut(colors, frame, posed)
    both, either = ((alpha > 0.5) & (posed > 0)).sum(), ((alpha > 0.5) | (posed > 0)).sum()
    return alpha if both > AGREES * either else np.maximum(alpha, posed.astype(np.float32))


def recover(clip: Clip, cover: Callable[[int], NDArray], maps: NDArray, size: tuple[int, int]) -> Still:
    """The still background, pixel by pixel the median of the frames (at most 48) that do not cover it.

    `maps` (T, 3, 3) lead from a frame's pixels to those of the background, which has `size` (width, height).
    """
    width, height = size
    count = max(3, min(LOOKED_AT, len(clip), ROOM // (3 * width * height)))
    chosen = np.unique(np.linspace(0, len(clip) - 1, count).round().astype(int))
    frames = np.stack([_warped(clip[t][..., :3], maps[t], size) for t in chosen])
    free = np.stack([_warped((cover(t) == 0).astype(np.uint8) * 255, maps[t], size) > 250 for t in chosen])
    pixels, spread = np.zeros((height, width, 3), np.float32), np.zeros((height, width), np.float32)
    strip = max(1, 2**21 // (width * len(chosen)))
    for top in range(0, height, strip):
        rows = slice(top, top + strip)
        pixels[rows], spread[rows] = _median(frames[:, rows], free[:, rows])
    found = Still(pixels, free.sum(axis=0) >= max(2, len(chosen) // 20), float(np.percentile(spread, 25)))
    return replace(found, sure=found.sure & (spread <= found.other))


def _seen_by(still: Still, onto: NDArray, size: tuple[int, int]) -> Still:
    """The background as a frame sees it whose map onto it is (3, 3)."""
    back = np.linalg.inv(onto)
    sure = _warped(still.sure.astype(np.uint8) * 255, back, size) > 250
    return replace(still, pixels=_warped(still.pixels, back, size), sure=sure)


def _warped(picture: NDArray, onto: NDArray, size: tuple[int, int]) -> NDArray:
    if picture.shape[1::-1] == size and np.array_equal(onto, np.eye(3)):
        return picture
    return cv2.warpPerspective(picture, onto, size, flags=cv2.INTER_LINEAR)


def _median(frames: NDArray, free: NDArray) -> tuple[NDArray, NDArray]:
    """The median (h, w, 3) of frames (n, h, w, 3) where they are free (n, h, w), and how far all but few are off."""
    seen = free.sum(axis=0)

    def rank(values: NDArray, share: float) -> NDArray:
        ordered = np.sort(np.where(free[..., None], values, np.int16(999)), axis=0)
        return np.take_along_axis(ordered, (share * np.maximum(seen - 1, 0)).astype(int)[None, ..., None], axis=0)[0]

    found = rank(frames.astype(np.int16), 0.5)
    spread = rank(np.abs(frames - found), 1 - FEW).max(axis=-1)
    return found.astype(np.float32), np.where(seen > 0, spread, 999)


def filled(frame: NDArray, cover: NDArray, still: Still) -> NDArray:
    """A frame (H, W, 3) uint8 with its covered pixels (H, W) filled; no other pixel changes."""
    x, y, w, h = cv2.boundingRect(cover)
    if w == 0:
        return frame
    spot = slice(max(y - NEAR, 0), y + h + NEAR), slice(max(x - NEAR, 0), x + w + NEAR)
    seen, hidden = frame[spot].astype(np.float32), cover[spot] > 0
    behind, sure = still.pixels[spot], still.sure[spot]
    off = seen - behind
    other = cv2.blur(np.abs(off).max(axis=-1), (3, 3)) > still.other
    told = ~hidden & sure & ~other
    believed = hidden & sure & ~_beside(other & ~hidden, hidden, rim_of(frame.shape[1::-1]))
    guess = np.where(believed[..., None], behind + _smooth_offset(off, told), seen)
    guess = np.round(np.clip(guess, 0, 255)).astype(np.uint8)
    unknown = hidden & ~believed
    if unknown.any():
        guess = carried_on(guess, unknown)
    inwards = cv2.distanceTransform(hidden.astype(np.uint8), cv2.DIST_L2, 3)
    share = np.clip(inwards / 2, 0, 1)[..., None]  # the rim's outer pixels show the background themselves
    made = frame.copy()
    made[spot] = np.where(hidden[..., None], np.round(seen + share * (guess - seen)), seen).astype(np.uint8)
    return made


def _beside(flags: NDArray, hidden: NDArray, reach: float) -> NDArray:
    """Hidden pixels (h, w) within twice the rim's reach whose nearest pixel in sight has the flag."""
    if hidden.all():
        return np.zeros_like(flags)
    away, labels = cv2.distanceTransformWithLabels(
        hidden.astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
    )
    flag_of = np.zeros(labels.max() + 1, bool)
    flag_of[labels[~hidden]] = flags[~hidden]
    return flag_of[labels] & (away <= 2 * reach)


def _smooth_offset(off: NDArray, told: NDArray) -> NDArray:
    """How much brighter (h, w, 3) the frame is than the background, carried from where it is told into the layer."""
    weight = cv2.GaussianBlur(told.astype(np.float32), (0, 0), NEAR / 2)
    total = cv2.GaussianBlur(np.where(told[..., None], off, 0).astype(np.float32), (0, 0), NEAR / 2)
    return total / np.maximum(weight, 1e-3)[..., None]
