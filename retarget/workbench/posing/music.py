"""Music at the posing desk: its beats found once and kept, corrected by hand, and its sound for the page."""

import io
import math
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from msgspec import Meta

from capture.errors import InputError
from mocap.posing.beats import FASTEST, SLOWEST, Beats, danced, read_beats, steady
from mocap.posing.stance import PACES, Music
from retarget.workbench.desks import Done, Seen, Work
from retarget.workbench.fields import File, Offset, Piece
from retarget.workbench.figure import Figure
from retarget.workbench.folder import listing, upload
from retarget.workbench.folder.listing import MUSIC
from retarget.workbench.posing.posed import figure_in, with_figure
from retarget.workbench.state import State

Bpm = Annotated[float, Meta(ge=SLOWEST, le=FASTEST)]
Seconds = Annotated[float, Meta(ge=0, le=3600)]
LONGEST = 600.0  # seconds of sound that a page gets: 50 MB


def shown(figure: Figure) -> dict[str, Any] | None:
    """The music with the beats that are danced, if there is music."""
    if figure.music is None:
        return None
    beats = figure.music.beats()
    return {
        "file": figure.music.file,
        "bpm": round(beats.bpm, 1),
        "seconds": figure.music.seconds,
        "pace": figure.music.pace,
        "times": np.round(beats.times, 3).tolist(),
    }


def beats_of(figure: Figure) -> Beats:
    """The beats of its music; without any, at the slider's tempo for as long as the dance takes."""
    if figure.music is not None:
        return figure.music.beats()
    bpm = figure.slider("bpm")
    return steady(bpm, figure.dance.beats * 60 / bpm)


def load(state: State, name: File, at: Offset, data: Piece, last: bool = True) -> State:
    """Load music into the folder."""
    if Path(name).suffix.lower() not in MUSIC:
        raise InputError(f"music must be one of {', '.join(MUSIC)}, got {name[:80]!r}: convert it")
    upload.put(state.folder, name, at, data, last)
    return state


def hush(state: State) -> State:
    """Dance without music."""
    return with_figure(state, replace(figure_in(state), music=None))


def pace(state: State, by: Literal["half", "double"]) -> State:
    """Take every second beat, or twice as many."""
    figure = figure_in(state)
    music = _music(figure)
    new = music.pace * (0.5 if by == "half" else 2)
    if new not in PACES:
        raise InputError(f"a pace must be one of {', '.join(f'{one:g}' for one in PACES)}, not {new:g}: tap the tempo")
    return with_figure(state, replace(figure, music=replace(music, pace=new)))


def tap(state: State, bpm: Bpm, first: Seconds = 0.0) -> State:
    """Take the tempo that was tapped."""
    figure = figure_in(state)
    if figure.music is None:
        return with_figure(state, replace(figure, feel={**figure.feel, "bpm": round(bpm, 1)}))
    step = 60 / bpm
    beats = steady(bpm, figure.music.seconds, first % step)
    if len(beats.times) < 2:
        raise InputError(f"music must have two beats or more, at {bpm:g} a minute it has none: tap quicker")
    music = Music(figure.music.file, tuple(np.round(beats.times, 4).tolist()), float(bpm), figure.music.seconds)
    return with_figure(state, replace(figure, music=music))


def songs(state: State) -> Seen:
    """What lies in the folder that is music: a list of names."""
    import msgspec

    return Seen("application/json", msgspec.json.encode(listing.listing(state.folder).of("music")))


def heard(state: State) -> Seen:
    """The sound of the music as a WAV file of 16 bits, as every browser plays it."""
    import wave

    from retarget.export.sound import sound_of

    music = _music(figure_in(state))
    sound, rate = sound_of(_inside(state, music.file), min(music.seconds, LONGEST))
    step = max(1, rate // 40_000)  # 96 kHz are no better to listen to here
    mono = np.clip(sound.mean(axis=1)[::step], -1, 1)
    file = io.BytesIO()
    with wave.open(file, "wb") as written:
        written.setnchannels(1)
        written.setsampwidth(2)
        written.setframerate(rate // step)
        written.writeframes((mono * 32767).astype("<i2").tobytes())
    return Seen("audio/wav", file.getvalue())


def hear(path: str, file: str) -> Done:
    """Find the beats of a piece of music."""
    found = read_beats(path)
    if len(found.times) < 2 or not math.isfinite(found.bpm):
        raise InputError(f"{file} must have two beats or more, it has fewer: give another")
    heeded = danced(found)  # of quick music every second beat, as the command line has it
    music = {"file": file, "times": np.round(found.times, 4).tolist(), "bpm": found.bpm, "seconds": found.seconds}
    said = f"{file}: {len(found.times)} beats, {found.bpm:.0f} a minute"
    ratio = heeded.bpm / found.bpm
    said = f"{said}, every second one is danced" if ratio < 1 else said
    return Done(music | {"pace": max(ratio, PACES[0])}, said)


def _prepare(state: State, file: File) -> dict[str, Any]:
    figure_in(state)
    path = _inside(state, file)
    if path.suffix.lower() not in MUSIC:
        raise InputError(f"music must be one of {', '.join(MUSIC)}, got {file[:80]!r}: convert it")
    return {"path": str(path), "file": file}


def _heard(state: State, file: str, times: list[float], bpm: float, seconds: float, pace: float) -> State:
    figure = figure_in(state)
    return with_figure(state, replace(figure, music=Music(file, tuple(times), bpm, seconds, pace)))


ACTIONS = (hush, pace, tap)
WRITES = (load,)
LOOKS = (songs, heard)
HEAR = Work(_prepare, hear, _heard)


def _music(figure: Figure) -> Music:
    if figure.music is None:
        raise InputError("there must be music first: choose a recording or a MIDI file")
    return figure.music


def _inside(state: State, file: str) -> Path:
    from retarget.workbench.folder.filenames import inside

    return inside(state.folder, file)
