"""When the beats of a piece of music are: from its tempo, from a MIDI file, or heard in a recording."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from capture.errors import InputError
from mocap.posing.sounds import SOUNDS, read_sound

SLOWEST, FASTEST = 40.0, 240.0
QUICKEST = 135.0
"""Beats a minute of which every one is danced."""

USUAL = 110.0
"""Beats a minute that a listener expects; twice and half of it are about half as likely."""

WIDE = 1.0  # octaves
FLUX_RATE = 100.0
"""Onsets are looked for so many times a second."""

BANDS = 40
QUICK = 190.0
"""No tempo is doubled beyond this."""

MOST = 20_000
"""Beats of a MIDI file, at most: hours."""

EVEN, WEAK = 0.75, 0.6


@dataclass(frozen=True, eq=False)
class Beats:
    """The beats of a piece of music."""

    times: NDArray  # (n,) seconds, rising
    bpm: float  # beats a minute: the median
    seconds: float  # how long the music lasts

    def at(self, beats: NDArray | float) -> NDArray:
        """Seconds of beats, counted from 0 and between beats too; before the first and after the last at its tempo."""
        count = len(self.times)
        beats = np.asarray(beats, float)
        step = 60 / self.bpm
        inside = np.interp(beats, np.arange(count), self.times)
        return inside + np.minimum(beats, 0) * step + np.maximum(beats - (count - 1), 0) * step


def steady(bpm: float, seconds: float, first: float = 0.0) -> Beats:
    """Beats at one tempo."""
    _check_tempo(bpm)
    if not 0 < seconds < np.inf:
        raise InputError(f"music must last longer than 0 s, it lasts {seconds:g}: give its length in seconds")
    return Beats(np.arange(first, seconds + 1e-9, 60 / bpm), float(bpm), float(seconds))


def halved(beats: Beats) -> Beats:
    """Every second beat: half-time, for music too quick to dance every beat of."""
    return Beats(beats.times[::2], beats.bpm / 2, beats.seconds)


def doubled(beats: Beats) -> Beats:
    """Beats half-way between as well: double time, for music of which only every second beat was found."""
    between = 0.5 * (beats.times[1:] + beats.times[:-1])
    return Beats(np.sort(np.concatenate([beats.times, between])), beats.bpm * 2, beats.seconds)


def danced(beats: Beats) -> Beats:
    """The beats to dance: every one, or above QUICKEST every second, or fourth."""
    while beats.bpm > QUICKEST and len(beats.times) > 1:
        beats = halved(beats)
    return beats


def read_beats(path: str | Path) -> Beats:
    """The beats of a *.mid file, or those heard in a recording: *.wav, *.mp3, *.ogg, *.flac, *.m4a, ..."""
    path = Path(path)
    if not path.is_file():
        raise InputError(f"music must be a file that exists: there is no {path}")
    kind = path.suffix.lower()
    if kind in (".mid", ".midi"):
        return _of_midi(path)
    if kind in SOUNDS:
        sound, rate = read_sound(path)
        return heard(sound.mean(axis=1), rate)
    raise InputError(
        f"music must be a .mid file or a recording ({', '.join(SOUNDS)}), {path.name} is neither: convert it, or give "
        "its tempo"
    )


def heard(sound: NDArray, rate: float) -> Beats:
    """The beats heard in a recording (n,) of `rate` samples a second.

    The strength of onsets is autocorrelated; the tempo is where that is strongest, weighed by what a listener expects;
    the beats are the row of onsets that is strongest and most even (Ellis 2007, by dynamic programming).
    """
    onsets = _onsets(sound, rate)
    period = _period(onsets)
    times = _track(onsets, period) / FLUX_RATE
    if len(times) < 2:
        raise InputError("a recording must have beats, none are heard in this one: give its tempo instead")
    step = np.polyfit(np.arange(len(times)), times, 1)[0] if len(times) > 3 else np.diff(times).mean()
    return Beats(times, float(60 / step), len(sound) / rate)


def _of_midi(path: Path) -> Beats:
    """Quarter notes, through every change of tempo."""
    import mido

    try:
        file = mido.MidiFile(path)
        ticks, tempos, last = file.ticks_per_beat, [(0, 500_000)], 0
        for track in file.tracks:
            now = 0
            for message in track:
                now += message.time
                if message.type == "set_tempo":
                    tempos.append((now, message.tempo))
                last = max(last, now)
    except (OSError, EOFError, ValueError, IndexError, KeyError) as error:
        raise InputError(f"{path} must be a MIDI file, it cannot be read: {str(error) or 'it is cut off'}") from None
    if ticks <= 0 or last <= 0:
        raise InputError(f"{path} must be a MIDI file with notes in time, it has none: export it again")
    if last / ticks > MOST or any(tempo <= 0 for _, tempo in tempos):
        raise InputError(f"{path} must be music of at most {MOST} beats with a tempo, it is not: export it again")
    changes = dict(sorted(tempos, key=lambda change: change[0]))  # of two at one tick the later counts
    at = np.array(list(changes), float)
    pace = np.array(list(changes.values()), float) / ticks / 1e6  # seconds a tick
    when = np.concatenate([[0], np.cumsum(np.diff(at) * pace[:-1])])

    def seconds(tick: NDArray) -> NDArray:
        segment = np.searchsorted(at, tick, side="right") - 1
        return when[segment] + (tick - at[segment]) * pace[segment]

    times = seconds(np.arange(0, last + 1, ticks, dtype=float))
    if len(times) < 2:
        times = np.array([0.0, 60 / _tempo(pace[0] * ticks)])
    return Beats(times, _tempo(float(np.median(np.diff(times)))), float(seconds(np.array([float(last)]))[0]))


def _tempo(step: float) -> float:
    return 60 / step


def _onsets(sound: NDArray, rate: float) -> NDArray:
    """How strongly something begins (T,), FLUX_RATE times a second: what grows in the loudness of frequency bands."""
    if not np.isfinite(sound).all() or not np.abs(sound).max() > 0:
        raise InputError("a recording must be heard, this one is silent: give its tempo instead")
    hop = rate / FLUX_RATE
    size = 1 << int(np.ceil(np.log2(4 * hop)))
    if len(sound) < 2 * rate:
        raise InputError(
            f"a recording must last two seconds to have a tempo, this one lasts {len(sound) / rate:.2f} s: "
            "give its tempo instead"
        )
    sound = np.pad(sound / np.abs(sound).max(), size)
    starts = (np.arange(int((len(sound) - 2 * size) / hop)) * hop + size / 2).astype(int)
    edges = np.unique(np.geomspace(2, size // 2, BANDS).astype(int))
    loud = np.empty((len(starts), len(edges) - 1))
    window = np.hanning(size)
    for first in range(0, len(starts), 1024):  # a long song does not lie in memory at once
        frames = sound[starts[first : first + 1024, None] + np.arange(size)] * window
        power = np.abs(np.fft.rfft(frames, axis=1)) ** 2
        loud[first : first + 1024] = np.add.reduceat(power, edges[:-1], axis=1)
    loud = np.log1p(100 * loud / loud.max())
    grows = np.maximum(np.diff(loud, axis=0, prepend=loud[:1]), 0).sum(axis=1)
    from scipy.ndimage import gaussian_filter1d, uniform_filter1d

    grows = np.maximum(grows - uniform_filter1d(grows, int(FLUX_RATE)), 0)
    spread = grows.std()
    return gaussian_filter1d(grows / spread, 1.5) if spread > 0 else grows


def _period(onsets: NDArray) -> float:
    """Frames between beats: the strongest lag of the autocorrelation and its multiples, as listeners hear tempo."""
    count = len(onsets)
    spectrum = np.fft.rfft(onsets - onsets.mean(), 2 * count)
    match = np.fft.irfft(np.abs(spectrum) ** 2)[:count] / np.arange(count, 0, -1)  # unbiased
    least, most = 60 / FASTEST * FLUX_RATE, min(60 / SLOWEST * FLUX_RATE, (count - 1) / 2)
    lags = np.arange(least, most, 0.05)
    if not len(lags) or match[0] <= 0:
        raise InputError("a recording must have beats, none are heard in this one: give its tempo instead")
    score = np.zeros(len(lags))
    for multiple in (1, 2, 4):  # a beat comes again two and four beats later: that also makes the lag exact
        inside = lags * multiple < count * 0.75
        score += np.where(inside, np.interp(lags * multiple, np.arange(count), match), 0)
    expected = np.exp(-0.5 * (np.log2(60 * FLUX_RATE / lags / USUAL) / WIDE) ** 2)
    best = float(lags[np.argmax(score * expected)])

    def again(lag: float) -> float:
        return float(np.interp(lag, np.arange(count), match))

    # as strong half a step later: each of those is a beat; weaker than two steps later: every second one is
    while 120 * FLUX_RATE / best <= QUICK and again(best / 2) > EVEN * again(best):
        best /= 2
    while 2 * best < most and 30 * FLUX_RATE / best >= SLOWEST and again(best) < WEAK * again(2 * best):
        best *= 2
    return best


def _track(onsets: NDArray, period: float, tight: float = 100.0) -> NDArray:
    """Frames (n,) of beats: the row with most onset strength whose steps stray least from the period."""
    count = len(onsets)
    steps = np.arange(-round(2 * period), -round(period / 2) + 1)
    cost = -tight * np.log(-steps / period) ** 2
    total, came = np.array(onsets, float), np.full(count, -1)
    for t in range(count):
        before = t + steps
        known = before >= 0
        if known.any():
            best = np.argmax(total[before[known]] + cost[known])
            gain = total[before[known]][best] + cost[known][best]
            if gain > 0:
                total[t] += gain
                came[t] = before[known][best]
    end = count - round(period) + int(np.argmax(total[count - round(period) :]))
    beats = [end]
    while came[beats[-1]] >= 0:
        beats.append(came[beats[-1]])
    beats = np.array(beats[::-1])
    strong = onsets[beats] > 0.3 * np.median(onsets[beats])
    if not strong.any():
        return np.zeros(0)
    first, last = np.flatnonzero(strong)[[0, -1]]  # before and after the music there is none
    return _between(onsets, beats[first : last + 1])


def _between(onsets: NDArray, beats: NDArray) -> NDArray:
    """Beats between frames: the top of the parabola through each and its neighbours."""
    inner = np.clip(beats, 1, len(onsets) - 2)
    before, here, after = onsets[inner - 1], onsets[inner], onsets[inner + 1]
    bend = before - 2 * here + after
    shift = np.divide(0.5 * (before - after), bend, out=np.zeros(len(beats)), where=bend < -1e-9)
    return beats + np.clip(shift, -0.5, 0.5)


def _check_tempo(bpm: float) -> None:
    if not SLOWEST <= bpm <= FASTEST:
        raise InputError(f"a tempo must be {SLOWEST:g} to {FASTEST:g} beats a minute, it is {bpm:g}")
