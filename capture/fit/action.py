"""Line of action: a motion captured from one open curve a frame (Bregler et al. 2002, section 4, Porky Pig).

A curve has no area, and maps of a straight one are free to flatten it or to turn it over.  So every line
becomes a thin ribbon: a mesh like any other, with key shapes, in-betweens as rigid as possible, an
affine part and weights.  `centre_lines` gives the curve back.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.fit.curves.medial import even
from capture.fit.shapes import weights as key_weights
from capture.motion import affine, keys
from capture.motion.keys import KeySet
from capture.motion.tracks import CartoonMotion, check, track_of

STATIONS = 32
"""A ribbon has so many points along each of its two sides."""


def capture_line(
    lines: NDArray,
    fps: float = 24.0,
    key_frames: Sequence[int] | None = None,
    most_keys: int = 5,
    within: float = 2.0,
    part: str = "line",
    size: tuple[int, int] | None = None,
    thickness: float = 0.15,
    rounds: int = 8,
) -> CartoonMotion:
    """The motion of open curves (T, n, 2) in pixels, each from its foot to its top, as one part.

    Keys are lines of the clip: `key_frames`, or as many as leave no line bent more than `within` pixels from all keys,
    at most `most_keys`.  The first key should be the straightest, it is where the pivot, its foot, lies.
    `thickness` is the ribbon's, as a share of the line's length; the residual is that of the curve alone.
    """
    lines = _checked(lines)
    frames = choose_keys(lines, most_keys, within) if key_frames is None else _frames(key_frames, len(lines))
    lines = np.stack([even(line, STATIONS) for line in lines])
    width = thickness * np.median(np.linalg.norm(np.diff(lines, axis=1), axis=-1).sum(axis=1))
    ribbons = ribbon(lines, width)
    keyset = line_keys(tuple(f"frame {t}" for t in frames), ribbons[frames])
    placed, weights = _fit(ribbons, keyset, rounds)
    drawn = affine.apply(placed, np.tensordot(weights, keys.shapes(keyset), axes=1))
    off = np.linalg.norm(centre_lines(drawn) - lines, axis=-1).max(axis=1)
    held = np.append(False, np.abs(np.diff(lines, axis=0)).max(axis=(1, 2)) < 1e-3)
    track = track_of(part, keyset, placed, weights, off, pivot=centre_lines(keyset.points[0])[0], held=held)
    count = len(lines)
    size = tuple(int(v) for v in np.ceil(lines.max(axis=(0, 1)) + 1)) if size is None else size
    return check(
        CartoonMotion((track,), (keyset,), np.arange(count) / fps, float(fps), (max(size[0], 1), max(size[1], 1)))
    )


def choose_keys(lines: NDArray, most: int = 5, within: float = 2.0) -> list[int]:
    """Frames of lines (T, n, 2) that span how they bend: the straightest, then ever the one farthest from all before.

    Lines are compared by shape: turned, scaled and shifted onto the straightest first.  A line within `within` pixels
    (rms) of the way between two chosen ones needs no key of its own.
    """
    lines = np.stack([even(line, STATIONS) for line in np.asarray(lines, float)])
    chord = np.linalg.norm(lines[:, -1] - lines[:, 0], axis=1)
    straight = chord / np.linalg.norm(np.diff(lines, axis=1), axis=-1).sum(axis=1)
    chosen = [int(np.argmax(np.round(straight, 6)))]
    level = affine.apply(affine.fit_similarity(lines, lines[chosen[0]]), lines).reshape(len(lines), -1)
    apart = np.linalg.norm(level - level[chosen[0]], axis=1)
    while len(chosen) < most and apart.max() > within * np.sqrt(STATIONS):
        new = int(apart.argmax())
        for old in chosen:
            way = level[new] - level[old]
            share = np.clip((level - level[old]) @ way / (way @ way), 0, 1)
            apart = np.minimum(apart, np.linalg.norm(level - level[old] - share[:, None] * way, axis=1))
        chosen.append(new)
    return chosen


def ribbon(lines: NDArray, width: float) -> NDArray:
    """Ribbons (T, 2 n, 2) of a width in pixels about lines (T, n, 2): one side from foot to top, the other back.

    Where a line bends tightly its inner side keeps to 0.7 of the radius, and the outer side likewise: the
    middle of the two sides is the line.
    """
    way = np.gradient(lines, axis=1, edge_order=2 if lines.shape[1] > 2 else 1)
    long = np.linalg.norm(way, axis=-1, keepdims=True)
    way = way / np.maximum(long, 1e-12)
    across = np.stack([-way[..., 1], way[..., 0]], axis=-1)
    curvature = np.linalg.norm(np.gradient(way, axis=1), axis=-1, keepdims=True) / np.maximum(long, 1e-12)
    curvature[:, [0, -1]] = curvature[:, [1, -2]]
    half = np.minimum(0.5 * width, 0.7 / np.maximum(curvature, 1e-12)) * across
    return np.concatenate([lines - half, (lines + half)[:, ::-1]], axis=1)


def centre_lines(ribbons: NDArray) -> NDArray:
    """The curves (..., n, 2) in the middle of ribbons (..., 2 n, 2)."""
    count = ribbons.shape[-2] // 2
    return 0.5 * (ribbons[..., :count, :] + ribbons[..., ::-1, :][..., :count, :])


def line_keys(names: tuple[str, ...], ribbons: NDArray, inbetweens: int = 5) -> KeySet:
    """A key set of K ribbons (K, 2 n, 2), aligned to the first like any other; every point is on the outline."""
    count = ribbons.shape[1]
    left = np.arange(count // 2 - 1)
    right = count - 1 - left
    faces = np.concatenate([np.stack([left, left + 1, right], 1), np.stack([left + 1, right - 1, right], 1)])
    outline = np.arange(count)
    aligned, removed = keys.align(ribbons, outline)
    return KeySet(tuple(names), aligned, faces, outline, keys.inbetween_rows(len(names), inbetweens), removed)


def _fit(ribbons: NDArray, keyset: KeySet, rounds: int) -> tuple[NDArray, NDArray]:
    """Plain maps (T, 2, 3) and weights (T, D): the best single row of each frame first, then both in turn (eqs. 6-7).

    A bent line turned over looks much like one bent the other way.  Only rows that fit without that are tried.
    """
    shapes = keys.shapes(keyset)
    placed = affine.fit(shapes[:, None], ribbons[None])  # (D, T, 2, 3)
    gap = ((affine.apply(placed, shapes[:, None]) - ribbons) ** 2).sum(axis=(-1, -2))
    gap[np.linalg.det(placed[..., :2]) <= 0] = np.inf
    best = gap.argmin(axis=0)
    count = np.arange(len(ribbons))
    weights = np.eye(len(shapes))[best]
    placed, gap = placed[best, count], gap[best, count]
    for _ in range(rounds if len(shapes) > 1 else 0):
        found = key_weights.fit_weights(affine.apply(affine.invert(placed), ribbons), shapes, keyset.rows)
        mixed = np.tensordot(found, shapes, axes=1)
        onto = affine.fit(mixed, ribbons)
        left = ((affine.apply(onto, mixed) - ribbons) ** 2).sum(axis=(-1, -2))
        better = (left < gap) & (np.linalg.det(onto[..., :2]) > 0)
        weights[better], placed[better], gap[better] = found[better], onto[better], left[better]
    return placed, weights


def _checked(lines: NDArray) -> NDArray:
    lines = np.asarray(lines, float)
    if lines.ndim != 3 or lines.shape[1] < 2 or lines.shape[2] != 2 or not len(lines):
        raise InputError(
            f"a line of action needs one curve a frame, an array (frames, 2 or more points, 2), got shape {lines.shape}"
        )
    bad = np.flatnonzero(~np.isfinite(lines).all(axis=(1, 2)))
    if len(bad):
        raise InputError(
            f"the points of a line must be finite numbers, frame {bad[0]} holds NaN or infinity: draw it again"
        )
    short = np.flatnonzero(np.linalg.norm(np.diff(lines, axis=1), axis=-1).sum(axis=1) < 1e-6)
    if len(short):
        raise InputError(
            f"a line of action must have a length, that of frame {short[0]} is a single point: draw it again"
        )
    return lines


def _frames(key_frames: Sequence[int], count: int) -> list[int]:
    frames = [int(t) for t in key_frames]
    if not frames or len(set(frames)) < len(frames) or min(frames) < 0 or max(frames) >= count:
        raise InputError(
            f"key frames must be different frames from 0 to {count - 1}, they came as {frames}: choose others"
        )
    return frames
