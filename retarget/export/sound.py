"""The music to a dance, as the sound track of its video.

A recording is played as it is.  A MIDI file holds no sound: its notes are played plainly, so that one hears whether a
dance is in time.  Beats without music are clicks.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from capture.files import written_beside
from mocap.posing.sounds import SOUNDS, read_sound

RATE = 44_100
CODECS = {".mp4": "aac", ".mov": "aac", ".webm": "libopus"}
FRAME = 1024  # samples handed to the encoder at once
DRUMS, KICKS, SNARES = 9, (35, 36), (37, 38, 39, 40)


def add_sound(video: str | Path, sound: NDArray, rate: int) -> None:
    """Put a sound (n, channels), -1 to 1, under a video file, whose pictures stay as they are; both begin together."""
    import av

    video = Path(video)
    sound = np.clip(np.atleast_2d(sound.T).astype(np.float32), -1, 1)[:2]
    codec = CODECS[video.suffix.lower()]
    with written_beside(video) as beside, av.open(str(video)) as read, av.open(str(beside), "w") as write:
        pictures = write.add_stream_from_template(read.streams.video[0])
        target = 48_000 if codec == "libopus" else rate
        track = write.add_stream(codec, rate=target, layout="stereo" if len(sound) == 2 else "mono")
        resampler = av.AudioResampler(format=track.format, layout=track.layout, rate=target, frame_size=FRAME)
        for packet in read.demux(read.streams.video[0]):
            if packet.dts is not None:
                packet.stream = pictures
                write.mux(packet)
        for first in range(0, sound.shape[1], FRAME):
            piece = np.ascontiguousarray(sound[:, first : first + FRAME])
            frame = av.AudioFrame.from_ndarray(piece, format="fltp", layout=track.layout.name)
            frame.sample_rate, frame.pts = rate, first
            for ready in resampler.resample(frame):
                write.mux(track.encode(ready))
        for ready in resampler.resample(None):
            write.mux(track.encode(ready))
        write.mux(track.encode(None))


def sound_of(music: str | Path, seconds: float) -> tuple[NDArray, int]:
    """The sound (n, channels) of a recording or a *.mid file, so many seconds of it, and its rate."""
    music = Path(music)
    if music.suffix.lower() in SOUNDS:
        sound, rate = read_sound(music, seconds)
        return sound, int(rate)
    return _played(_notes(music), seconds), RATE


def clicks(times: NDArray, seconds: float) -> tuple[NDArray, int]:
    """A click at each time (n,), every fourth higher, and its rate."""
    return _played(
        [(float(time), 0.03, 84 if n % 4 == 0 else 79, 1.0, 0) for n, time in enumerate(times)], seconds
    ), RATE


def _notes(path: Path) -> list[tuple[float, float, int, float, int]]:
    """When each note of a MIDI file starts, how long it lasts, its pitch, loudness and channel."""
    import mido

    try:
        messages = list(mido.MidiFile(path))
    except (OSError, EOFError, ValueError, IndexError, KeyError) as error:
        raise InputError(f"{path} must be a MIDI file, it cannot be read: {error}") from None
    now, sounding, notes = 0.0, {}, []
    for message in messages:
        now += message.time
        if message.type in ("note_on", "note_off"):
            key = (message.channel, message.note)
            if key in sounding:
                start, loud = sounding.pop(key)
                notes.append((start, now - start, message.note, loud, message.channel))
            if message.type == "note_on" and message.velocity > 0:
                sounding[key] = (now, message.velocity / 127)
    return notes + [(start, now - start, note, loud, channel) for (channel, note), (start, loud) in sounding.items()]


def _played(notes: list[tuple[float, float, int, float, int]], seconds: float) -> NDArray:
    """Notes as sound (n, 1): dying tones of three partials, and noise for drums."""
    sound = np.zeros(max(round(seconds * RATE), 1))
    rng = np.random.default_rng(0)
    for start, length, pitch, loud, channel in notes:
        first = round(start * RATE)
        t = np.arange(max(min(round((min(length, 8) + 0.08) * RATE), len(sound) - first), 0)) / RATE
        if channel == DRUMS:
            fade = 0.1 if pitch in KICKS else 0.06 if pitch in SNARES else 0.02
            tone = np.sin(2 * np.pi * 55 * t) if pitch in KICKS else 0.5 * rng.normal(size=len(t))
        else:
            fade, hertz = 0.5, 440 * 2 ** ((pitch - 69) / 12)
            tone = sum(np.sin(2 * np.pi * hertz * n * t) / n**1.5 for n in (1, 2, 3))
        sound[first : first + len(t)] += loud * tone * np.exp(-t / fade) * np.clip((length + 0.08 - t) / 0.08, 0, 1)
    return (0.8 * sound / max(np.abs(sound).max(), 1e-9))[:, None]
