"""A clip: numbered pictures and when each is shown, decoded when asked for.

Frame i is the i-th picture the source holds, also where the frame rate varies or a drawing is held; it is on
screen from `edges[i]` to `edges[i + 1]`.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capture.errors import InputError

CACHED_BYTES = 64 * 2**20
DEFAULT_FPS = 24.0  # of stills and sheets, which carry no time


@dataclass(frozen=True, eq=False)
class Clip:
    """T frames of one size; `clip[i]` is uint8 RGB (H, W, 3), or RGBA (H, W, 4) with straight alpha.

    Frames are read-only, for a few of them are kept; copy one to draw into it.
    """

    path: str
    size: tuple[int, int]  # (width, height)
    fps: float  # frames a second, the mean where the rate varies
    edges: NDArray = field(repr=False)  # (T + 1,) seconds, from 0: frame starts, then the last one's end
    has_alpha: bool
    notes: tuple[str, ...]  # what a user should be told, a sentence each
    _fetch: Callable[[int], NDArray] = field(repr=False)

    def __len__(self) -> int:
        return len(self.edges) - 1

    def __getitem__(self, i: int) -> NDArray:
        if not -len(self) <= i < len(self):
            raise IndexError(f"{self.path}: frame {i} must lie in 0..{len(self) - 1}")
        return self._fetch(int(i) % len(self))

    def __iter__(self) -> Iterator[NDArray]:
        return (self[i] for i in range(len(self)))

    @property
    def times(self) -> NDArray:
        """When each frame starts (T,), in seconds."""
        return self.edges[:-1]

    @property
    def durations(self) -> NDArray:
        """How long each frame is shown (T,), in seconds."""
        return np.diff(self.edges)


def clip_of(
    frames: ArrayLike | Iterable[ArrayLike],
    fps: float = DEFAULT_FPS,
    times: ArrayLike | None = None,
    path: str = "frames in memory",
) -> Clip:
    """Wrap frames in memory, uint8 (T, H, W, 3 or 4) or a sequence of them, as a clip.

    `times` (T,) are the starts in seconds, or (T + 1,) with the end of the last frame.
    """
    stack = frames if isinstance(frames, np.ndarray) else [np.asarray(frame) for frame in frames]
    if len(stack) == 0:
        raise InputError(f"{path}: a clip must have frames, this one has none; give at least one")
    shape = stack[0].shape
    for i, frame in enumerate(stack):
        if frame.dtype != np.uint8 or frame.ndim != 3 or frame.shape[2] not in (3, 4) or frame.shape != shape:
            raise InputError(
                f"{path}: frames must be uint8 (H, W, 3 or 4) of one size, frame {i} is {frame.dtype} "
                f"{frame.shape} and frame 0 is {shape}; convert them"
            )
    edges = np.arange(len(stack) + 1) / fps if times is None else _edges(rising(times), len(stack), fps)
    rate = fps if times is None else len(stack) / edges[-1]
    size, has_alpha = (shape[1], shape[0]), shape[2] == 4
    return Clip(path, size, float(rate), edges, has_alpha, (), remembering(lambda i: stack[i], size))


def trim(clip: Clip, start: int = 0, stop: int | None = None) -> Clip:
    """The frames start..stop (stop exclusive) of a clip, with time counted from the first of them."""
    end = len(clip) if stop is None else stop
    if not 0 <= start < end <= len(clip):
        raise InputError(
            f"{clip.path}: start and stop must satisfy 0 <= start < stop <= {len(clip)}, "
            f"they are {start} and {end}; choose frames the clip has"
        )
    if (start, end) == (0, len(clip)):
        return clip
    edges = clip.edges[start : end + 1] - clip.edges[start]
    even = np.allclose(clip.edges, np.arange(len(clip.edges)) / clip.fps)
    fps = clip.fps if even else (end - start) / float(edges[-1])
    fetch = clip._fetch
    return replace(clip, fps=fps, edges=edges, _fetch=lambda i: fetch(start + i))


def rising(times: ArrayLike) -> NDArray:
    """The times (n,) in seconds, if they are finite and rise."""
    times = np.asarray(times, float)
    if times.ndim != 1 or not (np.isfinite(times).all() and (np.diff(times) > 0).all()):
        raise InputError("the times of frames must be finite and rise, these do not; sort them")
    return times


def remembering(fetch: Callable[[int], NDArray], size: tuple[int, int]) -> Callable[[int], NDArray]:
    """`fetch` with its latest frames kept, read-only: at most 64 MiB or 64 of them, at least 2."""

    def fixed(i: int) -> NDArray:
        frame = fetch(i).view()
        frame.flags.writeable = False
        return frame

    room = CACHED_BYTES // (4 * size[0] * size[1])
    return lru_cache(maxsize=min(max(room, 2), 64))(fixed)


def _edges(times: NDArray, count: int, fps: float) -> NDArray:
    """Edges (count + 1,) from starts; without an end the last frame is as long as the one before."""
    if len(times) not in (count, count + 1):
        raise InputError(
            f"there must be a time for each of the {count} frames, and perhaps one for the end, "
            f"{len(times)} came; give one a frame"
        )
    if len(times) == count:
        times = np.append(times, times[-1] + (times[-1] - times[-2] if count > 1 else 1 / fps))
    return times - times[0]
