"""What is written is what was drawn: frames, times, colours, alpha."""

from fractions import Fraction

import av
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from capture.errors import InputError
from capture.pictures.clip import clip_of
from capture.pictures.decode import read_clip
from capture.pictures.encode import exact_rate, over, write_clip
from capture.pictures.gif import delays

H, W = 48, 64
RED, BLUE = (220, 40, 30), (30, 60, 220)


def ball(t, alpha=False):
    """A soft-edged red ball that moves 2 pixels a frame, held for two frames: on white, or on nothing."""
    y, x = np.mgrid[:H, :W]
    cover = np.clip(12.5 - np.hypot(x - 16 - 4 * (t // 2), y - 24), 0, 1)
    frame = np.zeros((H, W, 4), np.uint8)
    frame[cover > 0, :3] = RED
    frame[..., 3] = np.round(255 * cover)
    return frame if alpha else over(frame)


def written(path, frames, **options):
    assert write_clip(path, frames, **options) == len(frames)
    return read_clip(path)


@pytest.mark.parametrize("name", ["a.mp4", "a.webm", "a.mov", "a.gif", "a"])
def test_frames_in_are_frames_out_with_their_colours_also_where_drawings_are_held(tmp_path, name):
    frames = [ball(t) for t in range(17)]
    clip = written(tmp_path / name, frames)
    assert (len(clip), clip.size, clip.has_alpha, clip.notes) == (17, (W, H), False, ())
    off = np.abs(np.stack(list(clip)).astype(int) - np.stack(frames))
    assert off.mean() < 1.2 and np.percentile(off, 90) <= 3  # coarse chroma shows on the outline only
    assert off[:, 1:6, -6:-1].max() <= 2  # the white
    if name == "a":
        assert off.max() == 0


@pytest.mark.parametrize("name", ["a.webm", "a.mov", "a.gif", "a"])
def test_alpha_comes_back(tmp_path, name):
    frames = np.stack([ball(t, alpha=True) for t in range(9)])
    clip = written(tmp_path / name, frames)
    seen = np.stack(list(clip)).astype(int)
    assert clip.has_alpha and seen.shape == frames.shape
    wanted = np.where(frames[..., 3] < 128, 0, 255) if name == "a.gif" else frames[..., 3]
    assert np.abs(seen[..., 3] - wanted).max() <= {"a.webm": 20, "a.mov": 1}.get(name, 0)
    solid = frames[..., 3] == 255
    assert np.abs(seen[solid][:, :3] - RED).max() <= 6  # to the very edge: no fringe of hidden black


def test_hidden_colour_leaves_no_fringe_on_any_background(tmp_path):
    frames = [ball(t, alpha=True) for t in range(3)]
    clip = written(tmp_path / "a.webm", frames)
    for colour in ((255, 255, 255), (0, 0, 0), (0, 255, 0)):
        off = [np.abs(over(a, colour).astype(int) - over(b, colour)) for a, b in zip(clip, frames)]
        assert np.max(off) <= 16


def test_an_mp4_lies_over_the_background_and_every_player_opens_it(tmp_path):
    clip = written(tmp_path / "a.mp4", [ball(t, alpha=True) for t in range(3)], background=(0, 255, 0))
    assert np.abs(clip[0][0, 0].astype(int) - (0, 255, 0)).max() <= 3
    assert np.abs(clip[0][24, 16].astype(int) - RED).max() <= 3
    with av.open(str(tmp_path / "a.mp4")) as container:
        codec = container.streams.video[0].codec_context
        assert (codec.name, codec.pix_fmt, codec.colorspace) == ("h264", "yuv420p", 1)
    data = (tmp_path / "a.mp4").read_bytes()
    assert data.index(b"moov") < data.index(b"mdat")


@pytest.mark.parametrize("suffix", [".mp4", ".webm", ".mov"])
@pytest.mark.parametrize("colour", [RED, BLUE, (0, 0, 0), (255, 255, 255), (128, 128, 128), (255, 220, 0)])
def test_flat_colours_come_back(tmp_path, suffix, colour):
    clip = written(tmp_path / f"a{suffix}", [np.full((H, W, 3), colour, np.uint8)] * 2)
    assert np.abs(clip[1].astype(int) - colour).max() <= 3


def test_prores_4444_keeps_every_level_of_alpha_and_the_colour_under_it(tmp_path):
    """All 256 levels beside each other, as an editor reads them: straight alpha, in the tag that editors know."""
    levels = np.tile(np.arange(256, dtype=np.uint8), (32, 1))
    y, x = np.mgrid[:1:32j, :1:256j]
    colours = np.stack([200 * x, 90 + 60 * y, 255 - 200 * x], axis=-1).astype(np.uint8)
    frames = [np.dstack([colours, np.roll(levels, t, axis=1)]) for t in range(3)]
    write_clip(tmp_path / "a.mov", frames)
    with av.open(str(tmp_path / "a.mov")) as container:
        codec = container.streams.video[0].codec_context
        assert (codec.name, codec.codec_tag, codec.pix_fmt[:7]) == ("prores", "ap4h", "yuva444")
        seen = np.stack([frame.to_ndarray(format="rgba") for frame in container.decode(video=0)]).astype(int)
    off = np.abs(seen - np.stack(frames))
    assert off[..., 3].max() <= 1
    assert off[..., :3][np.stack(frames)[..., 3] > 0].max() <= 3


def test_an_odd_mp4_doubles_its_last_row_and_column_and_the_others_keep_their_size(tmp_path):
    frames = [ball(t)[:33, :47] for t in range(3)]
    assert written(tmp_path / "a.mp4", frames).size == (48, 34)
    assert written(tmp_path / "a.webm", frames).size == written(tmp_path / "a.mov", frames).size == (47, 33)
    assert written(tmp_path / "a.gif", frames).size == (47, 33)
    for size in ((1, 1), (1, 16), (16, 1)):
        assert len(written(tmp_path / "a.mp4", [np.zeros((*size, 3), np.uint8)] * 2)) == 2
        assert len(written(tmp_path / "a.webm", [np.zeros((*size, 4), np.uint8)] * 2)) == 2


# Time


@pytest.mark.parametrize("fps, exact", [(23.976, "24000/1001"), (29.97, "30000/1001"), (59.94, "60000/1001")])
def test_television_rates_are_exact_fractions(tmp_path, fps, exact):
    assert exact_rate(fps) == exact_rate(float(Fraction(exact))) == Fraction(exact)
    write_clip(tmp_path / "a.mp4", [ball(t) for t in range(5)], fps=fps)
    with av.open(str(tmp_path / "a.mp4")) as container:
        assert container.streams.video[0].average_rate == Fraction(exact)


@given(st.fractions(min_value=Fraction(1, 2), max_value=1000, max_denominator=100))
def test_a_rate_that_is_a_short_fraction_stays_itself(fps):
    if abs(fps - Fraction(1000 * round(float(fps) * 1.001), 1001)) > 1e-5 * fps:
        assert exact_rate(float(fps)) == fps


@pytest.mark.parametrize("suffix, within", [(".mp4", 1e-4), (".mov", 1e-4), (".webm", 1e-3), (".gif", 0.01)])
def test_variable_times_and_the_last_hold_come_back(tmp_path, suffix, within):
    edges = np.cumsum([0, 0.04, 0.5, 0.12, 0.0417, 1.3, 0.08, 3.0])
    frames = [ball(t) for t in range(7)]
    clip = written(tmp_path / f"a{suffix}", frames, times=edges)
    assert np.abs(clip.edges - edges).max() <= within
    again = written(tmp_path / f"b{suffix}", frames, times=clip.times + 5)
    assert np.abs(again.edges[:-1] - clip.times).max() <= within / 2


@given(
    waits=st.lists(st.floats(0.0005, 3), min_size=1, max_size=60).map(np.array),
    shortest=st.sampled_from([0.0, 0.02, 0.0208]),
)
def test_gif_delays_add_up_and_are_long_enough(waits, shortest):
    edges = np.concatenate([[0], np.cumsum(np.maximum(waits, shortest))])
    if round(100 * edges[-1]) < 2 * len(waits):
        with pytest.raises(InputError, match="50 frames a second"):
            delays(edges)
        return
    ticks = delays(edges)
    assert len(ticks) == len(waits) and ticks.min() >= 2
    assert abs(ticks.sum() / 100 - edges[-1]) < 0.01
    if shortest:  # then no frame has to borrow, and each edge is as near as hundredths allow
        assert np.abs(np.cumsum(ticks) / 100 - edges[1:]).max() < 0.02


@given(st.integers(1, 300), st.floats(1, 50))
def test_an_even_rate_is_never_a_hundredth_of_a_second_off(count, fps):
    edges = np.arange(count + 1) / fps
    assert np.abs(np.cumsum(delays(edges)) / 100 - edges[1:]).max() < 0.01


def test_24_a_second_is_fours_with_a_five_for_every_six():
    ticks = delays(np.arange(25) / 24)
    assert set(ticks) == {4, 5} and ticks.sum() == 100 and (ticks == 5).sum() == 4


# The palette of a GIF


@given(count=st.integers(1, 255), seed=st.integers(0, 9))
@settings(max_examples=8, deadline=None)
def test_a_gif_of_up_to_255_colours_is_exact(tmp_path_factory, count, seed):
    rng = np.random.default_rng(seed)
    colours = rng.integers(0, 256, (count, 3), np.uint8)
    frames = colours[rng.integers(0, count, (4, H, W))]
    clip = written(tmp_path_factory.mktemp("gif") / "a.gif", frames)
    assert np.array_equal(np.stack(list(clip)), frames)


def test_what_does_not_change_does_not_flicker_in_a_gif_of_many_colours(tmp_path):
    y, x = np.mgrid[:H, :W]
    paint = np.stack([4 * x, 5 * y, 2 * x + 2 * y], axis=-1).astype(np.uint8)  # thousands of colours
    frames = [paint.copy() for _ in range(8)]
    for t, frame in enumerate(frames):
        frame[10:20, 5 * t : 5 * t + 10] = RED
    clip = written(tmp_path / "a.gif", frames)
    seen = np.stack(list(clip)).astype(int)
    assert (seen[:, 25:] == seen[0, 25:]).all()
    assert np.abs(seen - frames).mean() < 6


@pytest.mark.parametrize("alpha", [False, True])
def test_another_decoder_sees_the_same_gif(tmp_path, alpha):
    frames = [ball(t, alpha) for t in range(8)]
    clip = written(tmp_path / "a.gif", frames)
    with av.open(str(tmp_path / "a.gif")) as container:
        second = [frame.to_ndarray(format="rgba") for frame in container.decode(video=0)]
    assert len(second) == 8
    for mine, other in zip(clip, second):
        white = over(other)
        assert np.array_equal(over(mine), white)


def test_a_fully_transparent_gif_has_its_frames(tmp_path):
    clip = written(tmp_path / "a.gif", np.zeros((3, H, W, 4), np.uint8))
    assert len(clip) == 3 and clip.has_alpha and clip[2].max() == 0


# The door


def test_a_folder_holds_numbered_pictures_that_anything_opens(tmp_path):
    for name in ("plain", "slash/"):
        assert write_clip(f"{tmp_path}/{name}", (ball(t, alpha=True) for t in range(3))) == 3
        folder = tmp_path / name
        assert sorted(p.name for p in folder.iterdir()) == ["0000.png", "0001.png", "0002.png"]
        with Image.open(folder / "0001.png") as image:
            assert np.array_equal(np.asarray(image), ball(1, alpha=True))


def test_a_clip_can_be_written_over_the_file_it_is_read_from(tmp_path):
    for name in ("a.mp4", "a.gif", "a"):
        write_clip(tmp_path / name, [ball(t) for t in range(6)])
        assert len(written(tmp_path / name, read_clip(tmp_path / name))) == 6
    clip = clip_of([ball(t) for t in range(4)], fps=12)
    assert len(written(tmp_path / "b.mp4", clip, fps=clip.fps)) == 4


@pytest.mark.parametrize("name", ["a.mp4", "a.webm", "a.mov", "a.gif", "a"])
@pytest.mark.parametrize(
    "frames, options, match",
    [
        ([], {}, "must have frames"),
        ([ball(0), ball(0)[:9]], {}, "of one size"),
        ([ball(0), ball(0, alpha=True)], {}, "of one size"),
        ([ball(0).astype(float)], {}, "uint8"),
        ([ball(0)] * 3, {"times": [0, 1]}, "a time for each frame"),
        ([ball(0)] * 3, {"times": [0, 1, 2, 3, 4]}, "a time for each frame"),
        ([ball(0)] * 3, {"times": [0, 1, 1]}, "rise"),
        ([ball(0)] * 3, {"times": [0, 1, 1.0001]}, "1 ms apart"),
        ([ball(0)], {"fps": 0}, "above 0"),
    ],
)
def test_what_cannot_be_written_is_said_and_leaves_nothing(tmp_path, name, frames, options, match):
    with pytest.raises(InputError, match=match):
        write_clip(tmp_path / name, iter(frames), **options)
    assert list(tmp_path.iterdir()) == []


def test_a_failure_in_the_middle_leaves_nothing(tmp_path):
    def failing():
        yield ball(0)
        yield ball(1)
        raise KeyboardInterrupt

    for name in ("a.mp4", "a.webm", "a.gif", "a"):
        with pytest.raises(KeyboardInterrupt):
            write_clip(tmp_path / name, failing())
    assert list(tmp_path.iterdir()) == []


def test_an_unknown_suffix_names_the_ones_that_work(tmp_path):
    for name in ("a.xyz", "a.png", "a.mp3"):
        with pytest.raises(InputError, match=r"\.mp4, \.webm, \.mov or \.gif"):
            write_clip(tmp_path / name, [ball(0)])


def test_a_gif_faster_than_players_go_is_refused(tmp_path):
    with pytest.raises(InputError, match="50 frames a second"):
        write_clip(tmp_path / "a.gif", [ball(t) for t in range(12)], fps=60)
    assert list(tmp_path.iterdir()) == []


def test_over_mixes_straight_alpha():
    frame = np.array([[[200, 100, 0, 255], [200, 100, 0, 0], [200, 100, 0, 51]]], np.uint8)
    assert over(frame, (0, 0, 250)).tolist() == [[[200, 100, 0], [0, 0, 250], [40, 20, 200]]]
