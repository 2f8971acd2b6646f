"""Beats of music that was made here, so that its beats are known."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from capture.errors import InputError
from mocap.posing import beats

RATE = 22050


def clicks(bpm, seconds=12.0, first=0.3, noise=0.0, off=0.0, accent=1.0, seed=0):
    """A click on every beat, a bar's first louder by `accent`, and between beats one of strength `off`."""
    rng = np.random.default_rng(seed)
    sound = rng.normal(0, noise, int(seconds * RATE)) if noise else np.zeros(int(seconds * RATE))
    t = np.arange(int(0.04 * RATE)) / RATE
    click = np.exp(-t / 0.01) * np.sin(2 * np.pi * 1200 * t)
    step = 60 / bpm
    for k, when in enumerate(np.arange(first, seconds - 0.05, step)):
        for shift, strength in ((0, accent if k % 4 == 0 else 1.0), (step / 2, off)):
            start = int((when + shift) * RATE)
            if strength and start + len(click) < len(sound):
                sound[start : start + len(click)] += strength * click
    return sound


@pytest.mark.parametrize("bpm", [60, 72, 85, 96, 108, 120, 133, 147, 160, 174, 180])
@pytest.mark.parametrize("kind", ["plain", "noisy", "accented"])
def test_the_tempo_of_clicks_is_heard(bpm, kind):
    more = {"plain": {}, "noisy": {"noise": 0.05}, "accented": {"accent": 1.6, "noise": 0.01}}[kind]
    found = beats.heard(clicks(bpm, **more), RATE)
    assert found.bpm == pytest.approx(bpm, rel=0.02)
    truth = np.arange(0.3, 11.9, 60 / bpm)
    near = np.abs(found.times[:, None] - truth).min(axis=1)
    assert np.median(near) < 0.02 and (near < 0.05).mean() > 0.9
    assert len(found.times) >= 0.9 * len(truth)


@pytest.mark.parametrize("bpm", [64, 90, 118])
def test_weak_clicks_between_beats_do_not_double_the_tempo(bpm):
    assert beats.heard(clicks(bpm, off=0.25, noise=0.01), RATE).bpm == pytest.approx(bpm, rel=0.02)


PATTERNS = {  # beats of a bar of four on which kick, snare and hat are played
    "rock": ([0, 2], [1, 3], np.arange(0, 4, 0.5)),
    "funk": ([0, 1.5, 2.5], [1, 3], np.arange(0, 4, 0.25)),
    "four on the floor": ([0, 1, 2, 3], [1, 3], np.arange(0.5, 4)),
    "half-time": ([0], [2], np.arange(0, 4, 0.5)),
}


def drums(bpm, pattern, bass=True, seconds=14.0, first=0.3):
    """A drum kit, and a bass note on every beat: what music has besides clicks, loud and soft, high and low."""
    rng = np.random.default_rng(3)
    sound, t = rng.normal(0, 0.002, int(seconds * RATE)), np.arange(int(0.25 * RATE)) / RATE
    kick = np.exp(-t / 0.06) * np.sin(2 * np.pi * (50 * t + 1.8 * (1 - np.exp(-t / 0.03))))
    snare = np.exp(-t / 0.05) * (0.42 * rng.normal(size=len(t)) + 0.35 * np.sin(2 * np.pi * 190 * t))
    hat = 0.15 * np.diff(np.exp(-t / 0.015) * rng.normal(size=len(t)), prepend=0)
    held = np.arange(int(54 / bpm * RATE)) / RATE
    notes = [0.25 * np.exp(-held / 0.4) * np.sin(2 * np.pi * pitch * held) for pitch in (55, 55, 65.4, 73.4)]
    played = [(beat, what) for what, beats in zip((kick, snare, hat), PATTERNS[pattern]) for beat in beats]
    for bar in np.arange(first, seconds, 240 / bpm):
        for beat, what in played + list(enumerate(notes)) * bass:
            start = round((bar + beat * 60 / bpm) * RATE)
            if start + len(what) < len(sound):
                sound[start : start + len(what)] += what
    return sound


def off_beat(found, bpm, first=0.3):
    """Seconds between each beat found and the nearest that was played."""
    return np.abs((found.times - first + 30 / bpm) % (60 / bpm) - 30 / bpm)


@pytest.mark.parametrize("bpm", [72, 90, 107, 120, 133, 150, 168, 180])
@pytest.mark.parametrize("pattern", ["rock", "funk"])
def test_the_tempo_of_a_drum_kit_is_heard(bpm, pattern):
    found = beats.heard(drums(bpm, pattern), RATE)
    assert found.bpm == pytest.approx(bpm, rel=0.02)
    assert np.median(off_beat(found, bpm)) < 0.02 and off_beat(found, bpm).max() < 0.06


@pytest.mark.parametrize("bpm", [66, 90, 118, 140, 176])
@pytest.mark.parametrize(
    "pattern, bass", [("four on the floor", True), ("four on the floor", False), ("half-time", True)]
)
def test_drums_that_are_counted_in_two_ways_are_heard_in_one_of_them(bpm, pattern, bass):
    """With a snare on the third beat alone, who counts half as fast is right as well; what is heard is on beats."""
    found = beats.heard(drums(bpm, pattern, bass), RATE)
    assert min(abs(found.bpm / bpm - 1), abs(found.bpm / bpm - 0.5)) < 0.02
    assert np.median(off_beat(found, bpm)) < 0.02


@pytest.mark.parametrize(("bpm", "step"), [(60, 1), (135, 1), (136, 2), (240, 2)])
def test_of_quick_music_every_second_beat_is_danced(bpm, step):
    music = beats.steady(bpm, 20)
    np.testing.assert_allclose(beats.danced(music).times, music.times[::step])
    assert beats.danced(music).bpm == bpm / step


def midi(path, tempos, length, ticks=480):
    """A MIDI file with tempo changes [(beat, bpm)], written message by message."""
    import mido

    file = mido.MidiFile(ticks_per_beat=ticks)
    track = mido.MidiTrack()
    file.tracks.append(track)
    now = 0
    for beat, bpm in tempos:
        tick = round(beat * ticks)
        track.append(mido.MetaMessage("set_tempo", tempo=mido.bpm2tempo(bpm), time=tick - now))
        now = tick
    track.append(mido.Message("note_on", note=60, time=round(length * ticks) - now))
    file.save(path)


def test_midi_beats_follow_every_change_of_tempo(tmp_path):
    """60 bpm for four beats, then 120, then from the middle of a beat 90."""
    midi(tmp_path / "a.mid", [(0, 60), (4, 120), (8.5, 90)], 12)
    found = beats.read_beats(tmp_path / "a.mid")
    after = 4 + 4.5 / 2
    truth = [0, 1, 2, 3, 4, 4.5, 5, 5.5, 6] + [after + (beat - 8.5) / 1.5 for beat in (9, 10, 11, 12)]
    np.testing.assert_allclose(found.times, truth, atol=1e-5)
    assert found.seconds == pytest.approx(truth[-1])


@pytest.mark.parametrize("bpm", [50, 120, 121, 150, 200])
def test_a_tempo_from_the_beginning_is_the_tempo_whether_slow_or_quick(tmp_path, bpm):
    midi(tmp_path / "a.mid", [(0, bpm)], 8)
    assert beats.read_beats(tmp_path / "a.mid").bpm == pytest.approx(bpm, rel=1e-4)


def test_a_wav_file_is_heard_in_stereo_and_whole_numbers(tmp_path):
    from scipy.io import wavfile

    sound = clicks(100)
    stereo = np.stack([sound, 0.5 * sound], axis=-1)
    wavfile.write(tmp_path / "a.wav", RATE, (20000 * stereo).astype(np.int16))
    assert beats.read_beats(tmp_path / "a.wav").bpm == pytest.approx(100, rel=0.01)


@settings(max_examples=50, deadline=None)
@given(st.floats(40, 240), st.floats(0, 30), st.floats(0.5, 20))
def test_counted_beats_have_times(bpm, beat, seconds):
    music = beats.steady(bpm, seconds)
    assert music.at(beat) == pytest.approx(beat * 60 / bpm)
    assert beats.halved(beats.steady(bpm, 30)).at(beat) == pytest.approx(2 * beat * 60 / bpm)


def test_a_piece_written_in_very_short_beats_is_danced_every_fourth(tmp_path):
    midi(tmp_path / "a.mid", [(0, 400)], 40)
    music = beats.danced(beats.read_beats(tmp_path / "a.mid"))
    assert music.bpm == pytest.approx(100, rel=1e-4) and np.diff(music.times) == pytest.approx(0.6)


@pytest.mark.parametrize("tempos", [[(0, 120), (100_000, 100)], [(0, 120), (1, 1e9)]])
def test_a_midi_file_of_days_or_without_time_is_refused(tmp_path, tempos):
    midi(tmp_path / "a.mid", tempos, 100_001)
    with pytest.raises(InputError, match="at most"):
        beats.read_beats(tmp_path / "a.mid")


def test_what_is_no_music_is_refused(tmp_path):
    for name, content in (("a.mid", b"MThd but not really"), ("b.mid", b""), ("a.wav", b"RIFF"), ("a.mp3", b"x")):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(InputError, match="must be a"):
            beats.read_beats(tmp_path / name)
    with pytest.raises(InputError, match="there is no"):
        beats.read_beats(tmp_path / "none.mid")
    with pytest.raises(InputError, match="silent"):
        beats.heard(np.zeros(5 * RATE), RATE)
    with pytest.raises(InputError, match="two seconds"):
        beats.heard(np.ones(RATE), RATE)
    with pytest.raises(InputError, match="40 to 240"):
        beats.steady(1000, 3)


def test_twice_as_many_beats_are_half_as_far_apart():
    music = beats.steady(60, 5.0)
    twice = beats.doubled(music)
    assert twice.bpm == 120 and np.allclose(np.diff(twice.times), 0.5)
    assert beats.halved(twice).times.tolist() == music.times.tolist()


@pytest.mark.parametrize("suffix", [".flac", ".mp3", ".m4a"])
def test_beats_are_heard_in_other_recordings_than_wav_files(tmp_path, suffix):
    import av

    sound = clicks(100, 8.0).astype(np.float32)
    with av.open(str(tmp_path / f"a{suffix}"), "w") as file:
        codec = {".flac": "flac", ".mp3": "libmp3lame", ".m4a": "aac"}[suffix]
        track = file.add_stream(codec, rate=RATE, layout="mono")
        resampler = av.AudioResampler(format=track.format, layout=track.layout, rate=RATE, frame_size=1024)
        frame = av.AudioFrame.from_ndarray(sound[None], format="fltp", layout="mono")
        frame.sample_rate, frame.pts = RATE, 0
        for ready in [*resampler.resample(frame), *resampler.resample(None)]:
            file.mux(track.encode(ready))
        file.mux(track.encode(None))
    found = beats.read_beats(tmp_path / f"a{suffix}")
    assert found.bpm == pytest.approx(100, rel=0.02)
    assert found.seconds == pytest.approx(8.0, abs=0.2)
