"""Recordings as numbers: WAV files, and whatever else FFmpeg can decode."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError

SOUNDS = (".wav", ".mp3", ".ogg", ".oga", ".opus", ".flac", ".m4a", ".aac")
LONGEST = 3600.0
"""Seconds of a recording, at most: music is shorter, and more would not fit into memory."""


def read_sound(path: str | Path, seconds: float | None = None) -> tuple[NDArray, float]:
    """The sound (n, channels) of a recording, -1 to 1, its first seconds or all of it, and its rate."""
    path = Path(path)
    if not path.is_file():
        raise InputError(f"music must be a file that exists: there is no {path}")
    sound, rate = _wav(path) if path.suffix.lower() == ".wav" else _decoded(path, seconds)
    if sound.size == 0 or rate <= 0:
        raise InputError(f"{path} must hold sound, it is empty: export it again")
    return sound if seconds is None else sound[: round(seconds * rate)], rate


def _wav(path: Path) -> tuple[NDArray, float]:
    import struct
    import warnings

    from scipy.io import wavfile

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # chunks it does not know
            rate, sound = wavfile.read(path)
    except (OSError, EOFError, ValueError, IndexError, TypeError, struct.error) as error:
        raise InputError(f"{path} must be a WAV file, it cannot be read: {str(error) or 'it is cut off'}") from None
    kind = sound.dtype
    sound = sound.reshape(len(sound), -1).astype(float)
    if kind.kind == "u":  # of 8 bits, around 128
        return (sound - 128) / 128, float(rate)
    return sound / (-float(np.iinfo(kind).min) if kind.kind == "i" else 1.0), float(rate)


def _decoded(path: Path, seconds: float | None) -> tuple[NDArray, float]:
    import av

    most = LONGEST if seconds is None else min(seconds, LONGEST)
    pieces, count = [], 0
    try:
        with av.open(str(path)) as read:
            if not read.streams.audio:
                raise InputError(f"{path} must hold sound, it has none: give a recording")
            stream = read.streams.audio[0]
            rate, channels = stream.rate, min(stream.channels, 2)
            resampler = av.AudioResampler("fltp", "stereo" if channels == 2 else "mono", rate)
            for frame in read.decode(stream):
                for ready in resampler.resample(frame):
                    pieces.append(ready.to_ndarray())
                    count += pieces[-1].shape[1]
                if count >= most * rate:
                    break
    except (OSError, ValueError) as error:  # av's own errors are these too
        raise InputError(f"{path} must be a recording, it cannot be read: {error}") from None
    return np.concatenate([np.zeros((channels, 0)), *pieces], axis=1).T.astype(float), float(rate)
