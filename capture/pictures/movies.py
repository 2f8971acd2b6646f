"""Video files as clips: a pass over the packets finds the frames, decoding waits until one is asked for."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from threading import Lock

import av
import numpy as np
from av.video.reformatter import Interpolation
from numpy.typing import NDArray

from capture.errors import InputError
from capture.pictures.clip import Clip, remembering
from capture.pictures.stills import told_short

# Left to itself FFmpeg plays text files as terminal art and follows playlists into the network.
CONTAINERS = "mov,mp4,m4a,3gp,3g2,mj2,matroska,webm,avi,mpegts,mpeg,ogg,flv,asf"
DECODERS = {"vp8": "libvpx", "vp9": "libvpx-vp9"}  # FFmpeg's own drop the alpha
SMOOTHLY = Interpolation.BICUBIC | Interpolation.FULL_CHR_H_INT | Interpolation.ACCURATE_RND
PASSED_BYTES = 128 * 2**20  # at 1280 x 720 that is 95 frames: enough to go back over 250 decoding each under twice
ITU709, UNSPECIFIED = 1, 2  # colour spaces, in FFmpeg's numbers

Source = tuple[av.container.InputContainer, av.VideoStream, av.VideoCodecContext]


@dataclass(frozen=True, eq=False)
class Index:
    """The frames of a video in the order they are shown, from its packets."""

    pts: NDArray  # (T,) when each is shown, in ticks, rising
    dts: NDArray  # (T,) where its packet is found, in ticks
    lasts: NDArray  # (T,) how long the packet says it lasts, in ticks, 0 where it does not
    keys: NDArray  # (n,) frames at which decoding can begin, rising; the first is 0
    tick: float  # seconds
    rate: float  # frames a second the container claims, 0 where it does not
    promised: int  # frames there should be, at least T


def read_video(path: Path) -> Clip:
    """Open a video, of any common kind; of a truncated one what decodes is used, and `notes` says so."""
    with _damage_told(path):
        index, source = _index(path), _open(path)
        index = _without_broken_tail(path, source, index)
        frame = next(_decode_from(source, index, 0))[1]
    turns = round(frame.rotation / 90) % 4  # a phone held upright
    size = (frame.width, frame.height) if turns % 2 == 0 else (frame.height, frame.width)
    has_alpha = any(component.is_alpha for component in frame.format.components)
    shape = {"width": frame.width, "height": frame.height, "format": "rgba" if has_alpha else "rgb24"}

    def picture(frame: av.VideoFrame) -> NDArray:
        # Without a tag, high definition is ITU-R 709 and the rest 601: what players assume.
        guess = ITU709 if frame.colorspace == UNSPECIFIED and frame.height >= 720 else None
        array = frame.to_ndarray(src_colorspace=guess, interpolation=SMOOTHLY, **shape)
        return np.ascontiguousarray(np.rot90(array, turns))

    edges, fps = _timing(index)
    notes = ()
    if index.promised > len(index.pts):
        notes = (told_short(path, index.promised, len(index.pts)),)
    fetch = remembering(_fetcher(path, source, index, picture), size)
    return Clip(str(path), size, fps, edges, has_alpha, notes, fetch)


def _index(path: Path) -> Index:
    """Demux the whole file once, without decoding."""
    container, stream, _ = _open(path)
    tick, rate = float(stream.time_base), float(stream.average_rate or stream.guessed_rate or 0)
    vp8 = stream.codec_context.name == "vp8"
    rows, broken, ends = [], 0, 0.0
    try:
        for packet in container.demux():
            if packet.pts is None and packet.dts is None:
                continue
            shown = packet.dts if packet.pts is None else packet.pts
            ends = max(ends, float((shown + (packet.duration or 0)) * packet.time_base))
            if packet.stream.index != stream.index:
                continue
            if packet.is_discard or (vp8 and not bytes(packet)[0] >> 4 & 1):
                continue  # never shown: outside the edit, or a reference only
            if packet.is_corrupt:
                broken += 1
            else:
                rows.append((shown, _found(packet), packet.duration or 0, packet.is_keyframe))
    except av.FFmpegError:
        broken += 1
    if not rows:
        raise InputError(f"{path}: a video must hold frames, this one holds none; make it again")
    pts, dts, lasts, key = np.array(rows, np.int64).T
    promised, begins = len(rows) + broken, min(container.start_time or 0, 0) / av.time_base
    missing = (container.duration or 0) / av.time_base - (ends - begins)
    if broken or missing * rate > 2:  # not otherwise: a count may include frames that an edit list hides
        promised = max(promised, stream.frames or round(promised + missing * rate))
    known = dts.max() if promised > len(rows) else np.inf  # what was lost at the end is shown after this
    pts, order = np.unique(pts[pts <= known], return_index=True)
    keys = np.union1d([0], np.flatnonzero(key[order]))
    return Index(pts, dts[order], lasts[order], keys, tick, rate, promised)


def _without_broken_tail(path: Path, source: Source, index: Index) -> Index:
    """End at the first frame after the last key that does not decode; if that key does not, go back one."""
    for key in index.keys[::-1]:
        whole = [n for n, frame in _decode_from(source, index, key) if n >= key and not frame.is_corrupt]
        if whole != sorted(whole):
            raise InputError(f"{path}: a video's time stamps must follow its pictures, these do not; convert it to mp4")
        if whole and whole[0] == key:
            T = key + int(np.sum(np.array(whole) == key + np.arange(len(whole))))
            pts, dts, lasts = index.pts[:T], index.dts[:T], index.lasts[:T]
            return replace(index, pts=pts, dts=dts, lasts=lasts, keys=index.keys[index.keys < T])
    raise InputError(f"{path}: a video must hold frames that decode, none of its {len(index.pts)} does; make it again")


def _timing(index: Index) -> tuple[NDArray, float]:
    """Edges (T + 1,) in seconds and frames a second: as claimed if that fits, else the mean."""
    T, seconds = len(index.pts), (index.pts - index.pts[0]) * index.tick
    last = index.lasts[-1] * index.tick or (seconds[-1] / (T - 1) if T > 1 else 1 / 24)
    edges = np.append(seconds, seconds[-1] + last)
    even = np.arange(T + 1) / (index.rate or np.inf)
    if index.rate and np.abs(edges - even).max() <= 2 * index.tick:
        return even, index.rate
    return edges, T / float(edges[-1])


def _fetcher(
    path: Path, source: Source, index: Index, picture: Callable[[av.VideoFrame], NDArray]
) -> Callable[[int], NDArray]:
    """Frames by number, cheap in order and backwards too.

    The decoder stays where it is, so going on to the next, or nearly, needs no seek.  After a seek the frames that are
    passed on the way, as they were decoded, are kept for whoever goes backwards.
    """
    lock = Lock()
    coming, at = iter(()), len(index.pts)  # the frames to come, and the number of the latest
    passed: dict[int, av.VideoFrame] = {}  # on the way from the latest seek, the last of them

    def fetch(i: int) -> NDArray:
        nonlocal coming, at
        with lock:
            if i in passed:
                return picture(passed[i])
            key = index.keys[np.searchsorted(index.keys, i, side="right") - 1]
            near = key - 1 <= at < i
            if not near:
                coming, at = _decode_from(source, index, i), -1
            for _ in range(2):
                for at, frame in coming:
                    if not near:
                        _keep(passed, at, frame)
                    if at == i:
                        return picture(frame)
                    if at > i:
                        break
                # Old containers seek past the mark: only their start is sure.
                near, coming, at = False, _decode_from(source, index, 0), -1
            at = len(index.pts)
        raise InputError(f"{path}: every frame must decode, frame {i} does not; end with stop={i} or encode it again")

    return fetch


def _keep(passed: dict[int, av.VideoFrame], n: int, frame: av.VideoFrame) -> None:
    """Put a frame to those passed and let the earliest go, so that they stay within PASSED_BYTES."""
    if n - 1 not in passed:
        passed.clear()
    passed[n] = frame
    if len(passed) * sum(plane.buffer_size for plane in frame.planes) > PASSED_BYTES:
        del passed[next(iter(passed))]


def _open(path: Path) -> Source:
    with _damage_told(path):
        container = av.open(str(path.absolute()), options={"format_whitelist": CONTAINERS})
    streams = [s for s in container.streams.video if not s.disposition & s.disposition.attached_pic]
    if not streams:
        raise InputError(f"{path}: a clip must hold pictures, this file has none; give a video")
    stream = streams[0]
    name = DECODERS.get(stream.codec_context.name)
    decoder = av.CodecContext.create(name, "r") if name else stream.codec_context
    decoder.thread_count = 2
    return container, stream, decoder


def _decode_from(source: Source, index: Index, i: int) -> Iterator[tuple[int, av.VideoFrame]]:
    """Frames and their numbers in the order shown, from the key frame at or before frame i to the end."""
    container, stream, decoder = source
    key = index.keys[np.searchsorted(index.keys, i, side="right") - 1]
    container.seek(int(index.dts[key]), stream=stream)
    if decoder.is_open:
        decoder.flush_buffers()
    for frame in _decode(container.demux(stream), decoder):
        shown = frame.dts if frame.pts is None else frame.pts
        n = int(np.searchsorted(index.pts, shown))
        if n < len(index.pts) and index.pts[n] == shown:
            yield n, frame


def _found(packet: av.Packet) -> int:
    return packet.pts if packet.dts is None else packet.dts


def _decode(packets: Iterator[av.Packet], decoder: av.VideoCodecContext) -> Iterator[av.VideoFrame]:
    """Every frame that decodes: a damaged packet costs only its own, and where the file is cut this ends."""
    packet = True
    while packet:
        try:
            packet = next(packets, None)
        except av.FFmpegError:
            packet = None
        if packet and packet.size == 0:
            packet = None  # then the decoder gives out what it held back
        try:
            frames = decoder.decode(packet)
        except av.FFmpegError:
            frames = []
        yield from frames


@contextmanager
def _damage_told(path: Path) -> Iterator[None]:
    try:
        yield
    except av.FFmpegError as error:
        raise InputError(
            f"{path}: a clip must be a video, an animated picture or a folder of pictures, this is none "
            f"that can be read ({error.strerror}); convert it"
        ) from error
