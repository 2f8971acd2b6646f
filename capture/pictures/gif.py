"""Writing GIF: exact timing, one palette for the whole clip, a block for every frame.

Pillow's own writer merges equal frames and chooses a palette for each one; here a held drawing stays as many
frames as it was, and a colour that does not change does not flicker.  Only its LZW coder is used.
"""

import struct
import tempfile
import zlib
from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import GifImagePlugin, Image

from capture.errors import InputError

CLEAR = 255  # the palette entry that is transparent
KEEP, RESTORE = 1, 2  # disposals: leave the frame for the next to draw on, or clear it away
SHORTEST = 2  # hundredths of a second: players slow anything shorter down to ten


def write_gif(file: Path, frames: Iterable[tuple[NDArray, int, int]], tick: Fraction) -> int:
    """Write frames (H, W, 3 or 4), each with start and length in ticks of `tick` seconds; return T.

    Alpha below one half is transparent, above it opaque.  The frames pass twice, for colours and for pixels,
    so they wait, packed, in a temporary file and never all in memory.
    """
    seen, counts = np.zeros(2**24, bool), np.zeros(2**15)
    edges, sizes, has_clear = [], [], False
    with tempfile.TemporaryFile() as waiting:
        for frame, start, length in frames:
            clear = frame[..., 3] < 128 if frame.shape[2] == 4 else np.zeros(frame.shape[:2], bool)
            has_clear |= bool(clear.any())
            colour = np.where(clear, -1, _packed(frame))
            visible = colour[~clear]
            seen[visible] = True
            counts += np.bincount(_cell(visible), minlength=2**15)
            edges[-1:] = [start * tick, (start + length) * tick]
            packed = zlib.compress(colour.astype(np.int32).tobytes(), 1)
            sizes.append(waiting.write(packed))
        waits = delays([float(edge) for edge in edges])
        palette, index = _palette(np.flatnonzero(seen), counts)
        waiting.seek(0)
        H, W = frame.shape[:2]
        with file.open("wb") as out:
            # size, "256 colours, 8 bits each", background, square pixels; then: repeat for ever
            out.write(b"GIF89a" + struct.pack("<HHBBB", W, H, 0xF7, CLEAR, 0) + palette.tobytes())
            out.write(b"!\xff\x0bNETSCAPE2.0\x03\x01\x00\x00\x00")
            before = np.full((H, W), -1)
            for size, wait in zip(sizes, waits):
                colour = np.frombuffer(zlib.decompress(waiting.read(size)), np.int32).reshape(H, W)
                picture = np.where(colour < 0, np.uint8(CLEAR), index[colour])
                change = picture if has_clear else np.where(picture == before, CLEAR, picture)
                out.write(_block(change, int(wait), RESTORE if has_clear else KEEP))
                before = picture
            out.write(b";")
    return len(sizes)


def delays(edges: ArrayLike) -> NDArray:
    """Whole hundredths of a second (T,), at least 2 each, for frames between edges (T + 1,) in seconds.

    Each edge goes to the nearest hundredth, so rounding errors never add up (24 a second: 4, 4, 5, 4, ...);
    where that leaves a frame too short it borrows from its neighbours.
    """
    edges = np.asarray(edges, float)
    T, end = len(edges) - 1, round(100 * (edges[-1] - edges[0]))
    if end < SHORTEST * T:
        raise InputError(
            f"a GIF shows at most 50 frames a second, these are {T / (edges[-1] - edges[0]):.4g}; "
            "leave some out or write a video"
        )
    shortest = SHORTEST * np.arange(T + 1)
    spare = np.maximum.accumulate(np.round(100 * (edges - edges[0])).astype(int) - shortest)
    waits = np.diff(np.minimum(spare, end - SHORTEST * T) + shortest)
    if waits.max() > 65535:
        raise InputError(f"a GIF shows a frame for at most 655 s, one lasts {waits.max() / 100:.0f} s; write a video")
    return waits


def _palette(seen: NDArray, counts: NDArray) -> tuple[NDArray, NDArray]:
    """Colours (256, 3), and for each of the 2^24 colours the entry that shows it, filled in for those seen.

    Up to 255 colours are kept exactly; of more, the median cut and k-means over the whole clip choose 255.
    """
    from scipy.spatial import KDTree

    colours = _unpacked(seen)
    palette, index = np.zeros((256, 3), np.uint8), np.zeros(2**24, np.uint8)
    if len(seen) == 0:
        return palette, index
    chosen = colours if len(seen) <= CLEAR else _chosen(colours, counts)
    palette[: len(chosen)] = chosen
    index[seen] = KDTree(chosen).query(colours.astype(float))[1]
    return palette, index


def _chosen(colours: NDArray, counts: NDArray) -> NDArray:
    """255 colours (n, 3) for many; each has a say by the root of its area, lest small parts lose theirs."""
    cell = _cell(_packed(colours))
    say = np.sqrt(counts[cell]) / np.bincount(cell, minlength=len(counts))[cell]
    repeats = np.ceil(say * 2**17 / say.sum()).astype(int)
    pixels = np.repeat(colours, repeats, axis=0)[None]
    small = Image.fromarray(pixels).quantize(CLEAR, Image.Quantize.MEDIANCUT, kmeans=2)
    return np.array(small.getpalette()[: 3 * CLEAR], np.uint8).reshape(-1, 3)


def _block(picture: NDArray, wait: int, disposal: int) -> bytes:
    """One frame: its delay in hundredths of a second, then the box of pixels (H, W) that are not clear."""
    rows, columns = np.flatnonzero((picture != CLEAR).any(1)), np.flatnonzero((picture != CLEAR).any(0))
    y, x = (rows[0], columns[0]) if len(rows) else (0, 0)
    box = picture[y : rows[-1] + 1, x : columns[-1] + 1] if len(rows) else picture[:1, :1]
    control = b"!\xf9\x04" + struct.pack("<BHBB", disposal << 2 | 1, wait, CLEAR, 0)
    image = Image.fromarray(np.ascontiguousarray(box))
    return control + b"".join(GifImagePlugin.getdata(image, (int(x), int(y))))


def _packed(colours: NDArray) -> NDArray:
    """RGB (..., 3 or more) as one integer (...)."""
    wide = colours[..., :3].astype(np.int32)
    return wide[..., 0] << 16 | wide[..., 1] << 8 | wide[..., 2]


def _unpacked(packed: NDArray) -> NDArray:
    return np.stack([packed >> 16 & 255, packed >> 8 & 255, packed & 255], axis=-1).astype(np.uint8)


def _cell(packed: NDArray) -> NDArray:
    """Which of 32 x 32 x 32 cells of the colour cube."""
    return packed >> 9 & 0x7C00 | packed >> 6 & 0x3E0 | packed >> 3 & 0x1F
