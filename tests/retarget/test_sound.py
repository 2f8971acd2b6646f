"""Sound tracks, held against what a player reads."""

import av
import numpy as np
import pytest
from scipy.io import wavfile

from capture.errors import InputError
from capture.pictures.encode import write_clip
from retarget.export.sound import add_sound, clicks, sound_of


def heard(file):
    """The sound (n,) of a video file, one channel, and its rate."""
    with av.open(str(file)) as read:
        frames = [frame.to_ndarray().mean(axis=0) for frame in read.decode(audio=0)]
        return np.concatenate(frames), read.streams.audio[0].rate


def pitch(sound, rate):
    return np.argmax(np.abs(np.fft.rfft(sound * np.hanning(len(sound))))) * rate / len(sound)


@pytest.fixture
def film():
    """Twenty-four grey pictures, the middle one white."""
    pictures = np.full((24, 32, 48, 3), 90, np.uint8)
    pictures[12] = 255
    return pictures


@pytest.mark.parametrize("suffix", [".mp4", ".webm", ".mov"])
def test_a_film_keeps_its_pictures_and_gets_a_sound_that_begins_with_them(tmp_path, film, suffix):
    file = tmp_path / f"a{suffix}"
    write_clip(file, film, 24)
    t = np.arange(44_100) / 44_100
    add_sound(file, (0.5 * np.sin(2 * np.pi * 440 * t) * (t > 0.5))[:, None], 44_100)
    with av.open(str(file)) as read:
        light = [frame.to_ndarray(format="rgb24").mean() for frame in read.decode(video=0)]
    assert len(light) == 24 and int(np.argmax(light)) == 12
    sound, rate = heard(file)
    assert len(sound) / rate == pytest.approx(1.0, abs=0.05)
    begins = np.argmax(np.abs(sound) > 0.1) / rate
    assert begins == pytest.approx(0.5, abs=0.03)
    assert pitch(sound[round(0.6 * rate) : round(0.9 * rate)], rate) == pytest.approx(440, abs=5)


@pytest.mark.parametrize(("kind", "full"), [(np.int16, 2**15), (np.int32, 2**31), (np.float32, 1.0), (np.uint8, 128)])
def test_a_wav_file_is_played_as_it_is(tmp_path, kind, full):
    wave = 0.5 * np.sin(np.arange(8000) / 20)
    stored = wave * full + (128 if kind is np.uint8 else 0)
    wavfile.write(tmp_path / "a.wav", 8000, np.stack([stored, stored], axis=1).astype(kind))
    sound, rate = sound_of(tmp_path / "a.wav", 0.5)
    assert rate == 8000 and sound.shape == (4000, 2)
    np.testing.assert_allclose(sound[:, 1], wave[:4000], atol=0.01)


def test_the_notes_of_a_midi_file_are_played_when_and_as_high_as_they_say(tmp_path):
    import mido

    file = mido.MidiFile(ticks_per_beat=480)
    track = mido.MidiTrack()
    file.tracks.append(track)
    track.append(mido.MetaMessage("set_tempo", tempo=mido.bpm2tempo(60), time=0))
    for note, wait in ((69, 480), (81, 0)):  # a second of silence, then a' for a second, then a'' at once
        track.append(mido.Message("note_on", note=note, time=wait))
        track.append(mido.Message("note_off", note=note, time=480))
    file.save(tmp_path / "a.mid")
    sound, rate = sound_of(tmp_path / "a.mid", 3.0)
    assert len(sound) == 3 * rate and np.abs(sound[:rate]).max() == 0 and np.abs(sound[rate : rate + 800]).max() > 0.1
    assert pitch(sound[rate : 2 * rate, 0], rate) == pytest.approx(440, abs=1)
    assert pitch(sound[round(2.2 * rate) :, 0], rate) == pytest.approx(880, abs=2)


def test_clicks_are_on_their_beats():
    times = np.array([0.25, 0.75, 1.5])
    sound, rate = clicks(times, 2.0)
    loud = np.flatnonzero(np.abs(sound[:, 0]) > 0.05)
    begins = loud[np.diff(loud, prepend=-rate) > 0.2 * rate] / rate
    np.testing.assert_allclose(begins, times, atol=0.002)


def test_what_holds_no_sound_is_refused(tmp_path):
    (tmp_path / "a.mid").write_bytes(b"MThd nothing")
    with pytest.raises(InputError, match="must be a MIDI file"):
        sound_of(tmp_path / "a.mid", 1.0)
