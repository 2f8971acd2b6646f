"""Writing clips: mp4, webm and ProRes with alpha, gif, or a folder of PNG.  Frames in equals frames out."""

import os
from collections.abc import Callable, Iterable, Iterator
from fractions import Fraction
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image

from capture.errors import InputError
from capture.files import folder_written_beside, written_beside
from capture.pictures.clip import rising
from capture.pictures.gif import write_gif

TICK = Fraction(1, 90_000)  # seconds, where the frame rate varies
ITU709 = 1  # FFmpeg's number for the colours of high definition; as a range, 16 to 235
# Without B-frames an mp4 keeps the length of the last frame, and one cut short loses nothing before the cut.
H264 = {"crf": "16", "preset": "medium", "tune": "animation", "bf": "0"}
VP9 = {"crf": "10", "b": "0", "deadline": "good", "cpu-used": "5", "row-mt": "1", "auto-alt-ref": "0"}
# ProRes 4444: full chroma, 10 bits of colour and an alpha that loses nothing, for editors and compositors.
PRORES = {"profile": "4444", "vendor": "apl0", "alpha_bits": "16", "qscale": "4"}

Timed = Iterator[tuple[NDArray, int, int]]  # a frame, its start and its length in ticks
Writer = Callable[[Timed, Fraction], int]  # also takes the length of a tick in seconds; returns T


def write_clip(
    path: str | os.PathLike,
    frames: Iterable[NDArray],
    fps: float = 24.0,
    times: ArrayLike | None = None,
    background: tuple[int, int, int] = (255, 255, 255),
) -> int:
    """Write uint8 frames (H, W, 3 or 4) as .mp4, .webm, .mov, .gif or, without a suffix, a folder of PNG; return T.

    `times`, when each frame starts in seconds (T,), maybe with the end of the last (T + 1,), replaces `fps`.
    An mp4 has no alpha, so frames with alpha are put over `background`; its sides are even, so the last row
    or column is doubled where need be.  A webm keeps alpha; so does a mov, ProRes 4444 for editors, nearly without
    loss.  A gif keeps it as on or off, and has at most 50 frames a second and 255 colours.  A folder holds 0000.png,
    0001.png, ...; it keeps no times.
    """
    if not 0 < fps <= 1000:
        raise InputError(f"{path}: the frame rate must be above 0 and at most 1000, it is {fps}; give one such as 24")
    write = _writer(path, background)
    alike = _alike(path, frames)
    if times is None:
        return write(((frame, i, 1) for i, frame in enumerate(alike)), 1 / exact_rate(fps))
    return write(_at_times(path, alike, rising(times), fps), TICK)


def exact_rate(fps: float) -> Fraction:
    """Frames a second as the fraction that is meant: 29.97 is 30000/1001, 23.976 is 24000/1001."""
    television = Fraction(1000 * round(fps * 1.001), 1001)
    if abs(float(television) - fps) < 2e-6 * fps:
        return television
    return Fraction(fps).limit_denominator(1001)


def over(frame: NDArray, background: tuple[int, int, int] = (255, 255, 255)) -> NDArray:
    """An RGBA frame (H, W, 4) put over one colour, as RGB (H, W, 3); an RGB frame comes back as it is."""
    if frame.shape[2] == 3:
        return frame
    alpha = frame[..., 3:].astype(np.uint16)
    mixed = frame[..., :3] * alpha + np.asarray(background, np.uint16) * (255 - alpha) + 127  # below 65536
    return (mixed // 255).astype(np.uint8)


def _writer(path: str | os.PathLike, background: tuple[int, int, int]) -> Writer:
    suffix = Path(path).suffix.lower()
    if suffix == "" or os.fspath(path).endswith(("/", os.sep)) or Path(path).is_dir():
        return partial(_write_folder, path)
    if suffix == ".mp4":
        return partial(_write_mp4, path, background)
    if suffix == ".webm":
        return partial(_write_webm, path)
    if suffix == ".mov":
        return partial(_write_prores, path)
    if suffix == ".gif":
        return partial(_write_gif, path)
    raise InputError(
        f"{path}: the output must end in .mp4, .webm, .mov or .gif, or in nothing for a folder of PNG, "
        f"it ends in {suffix}; rename it"
    )


def _write_folder(path: str | os.PathLike, frames: Timed, tick: Fraction) -> int:
    with folder_written_beside(path) as folder:
        for i, (frame, _, _) in enumerate(frames):
            Image.fromarray(frame).save(folder / f"{i:04d}.png", compress_level=4)
    return i + 1


def _write_gif(path: str | os.PathLike, frames: Timed, tick: Fraction) -> int:
    with written_beside(path) as file:
        return write_gif(file, frames, tick)


def _write_mp4(path: str | os.PathLike, background: tuple[int, int, int], frames: Timed, tick: Fraction) -> int:
    """H.264 in yuv420p, the one form every player opens; its index stands in front, so it can be streamed."""
    opaque = ((_even(over(frame, background)), start, length) for frame, start, length in frames)
    with written_beside(path) as file:
        return _write_video(file, opaque, tick, "libx264", H264)


def _write_webm(path: str | os.PathLike, frames: Timed, tick: Fraction) -> int:
    bled = ((_bled(frame), start, length) for frame, start, length in frames)
    with written_beside(path) as file:
        return _write_video(file, bled, tick, "libvpx-vp9", VP9)


def _write_prores(path: str | os.PathLike, frames: Timed, tick: Fraction) -> int:
    bled = ((_bled(frame), start, length) for frame, start, length in frames)
    with written_beside(path) as file:
        return _write_video(file, bled, tick, "prores_ks", PRORES, ("yuv444p10le", "yuva444p10le"))


def _write_video(
    file: Path,
    frames: Timed,
    tick: Fraction,
    codec: str,
    options: dict[str, str],
    planes: tuple[str, str] = ("yuv420p", "yuva420p"),
) -> int:
    """Encode with 4:2:0 chroma or other `planes`, the second with alpha, for frames that have one."""
    import av
    from av.video.reformatter import Interpolation

    smoothly = Interpolation.BICUBIC | Interpolation.FULL_CHR_H_INP | Interpolation.ACCURATE_RND
    faststart = {"movflags": "faststart"} if file.suffix.lower() in (".mp4", ".mov") else {}
    count, lengths = 0, {}

    def mux(packets: Iterable[av.Packet]) -> None:
        for packet in packets:
            packet.duration = lengths.pop(packet.pts)  # no encoder passes it on, and the last frame needs it
            container.mux(packet)

    with av.open(str(file), "w", options=faststart) as container:
        for count, (frame, start, length) in enumerate(frames, 1):
            rgb, yuv = ("rgb24", planes[0]) if frame.shape[2] == 3 else ("rgba", planes[1])
            if count == 1:
                stream = container.add_stream(codec, rate=1 / (tick * length), options=options)
                encoder = stream.codec_context
                encoder.height, encoder.width = frame.shape[:2]
                encoder.pix_fmt, encoder.time_base = yuv, tick
                encoder.thread_count, encoder.gop_size = 2, 48  # a key frame now and then: quick to seek
                encoder.colorspace = encoder.color_range = ITU709
                encoder.color_primaries = encoder.color_trc = ITU709
                if yuv == "yuva420p":
                    stream.metadata["alpha_mode"] = "1"
            picture = av.VideoFrame.from_ndarray(np.ascontiguousarray(frame), format=rgb).reformat(
                format=yuv, dst_colorspace=ITU709, dst_color_range=ITU709, interpolation=smoothly
            )
            picture.pts, picture.time_base, lengths[start] = start, tick, length
            mux(stream.encode(picture))
        mux(stream.encode(None))
    return count


def _alike(path: str | os.PathLike, frames: Iterable[NDArray]) -> Iterator[NDArray]:
    """The frames, with a word where one is unlike the first or where none come."""
    shape = None
    for i, frame in enumerate(frames):
        shape = shape or frame.shape
        if frame.dtype != np.uint8 or frame.ndim != 3 or frame.shape[2] not in (3, 4) or frame.shape != shape:
            raise InputError(
                f"{path}: frames must be uint8 (H, W, 3 or 4) of one size, frame {i} is {frame.dtype} "
                f"{frame.shape} and frame 0 is {shape}; convert them"
            )
        yield frame
    if shape is None:
        raise InputError(f"{path}: a clip must have frames, none came; give at least one")


def _at_times(path: str | os.PathLike, frames: Iterator[NDArray], times: NDArray, fps: float) -> Timed:
    """Frames with starts and lengths from `times`; without an end the last is as long as the one before."""
    starts = [round((t - times[0]) / TICK) for t in times]
    lengths = [b - a for a, b in pairwise(starts)]
    if lengths and min(lengths) * TICK < Fraction(1, 1000):
        raise InputError(f"{path}: frames must be at least 1 ms apart, some are nearer; leave some out")
    lengths.append(lengths[-1] if lengths else round(1 / fps / TICK))
    count = 0
    for count, frame in enumerate(frames, 1):
        if count <= len(times):
            yield frame, starts[count - 1], lengths[count - 1]
    if count not in (len(times), len(times) - 1):
        raise InputError(
            f"{path}: there must be a time for each frame, and perhaps one for the end, {len(times)} came "
            f"for {count} frames; give one a frame"
        )


def _even(frame: NDArray) -> NDArray:
    """Sides made even by doubling the last row or column, for chroma has half the resolution."""
    H, W = frame.shape[:2]
    return np.pad(frame, ((0, H % 2), (0, W % 2), (0, 0)), mode="edge")


def _bled(frame: NDArray) -> NDArray:
    """Hidden pixels take the colour of the nearest visible one, or coarse chroma would fringe the outline."""
    import cv2

    if frame.shape[2] == 3:
        return frame
    hidden = (frame[..., 3] == 0).astype(np.uint8)
    if hidden.all() or not hidden.any():
        return frame
    _, nearest = cv2.distanceTransformWithLabels(hidden, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    colours = np.zeros((nearest.max() + 1, 3), np.uint8)
    visible = hidden == 0
    colours[nearest[visible]] = frame[visible, :3]
    return np.dstack([colours[nearest], frame[..., 3]])


def write_picture(path: str | os.PathLike, picture: NDArray) -> None:
    """Write one uint8 RGB or RGBA picture (H, W, 3 or 4) as PNG."""
    with written_beside(path) as temporary:
        Image.fromarray(picture).save(temporary, format="PNG")
