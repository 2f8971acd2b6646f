"""Frames in equals frames out, in any order, from every kind of source."""

import struct
import tracemalloc
from fractions import Fraction

import av
import numpy as np
import pytest
from PIL import Image
from PIL.GifImagePlugin import GifImageFile

from capture.errors import InputError
from capture.pictures.clip import clip_of, trim
from capture.pictures.decode import read_clip
from capture.pictures.encode import write_clip

H, W = 48, 64


def counter(t):
    """A frame (48, 64, 3) that shows t as eight black or white bars under a red band."""
    frame = np.repeat(np.where(t >> np.arange(8) & 1, 255, 0), 8)[None, :, None] * np.ones((H, 1, 3))
    frame[:8] = (200, 30, 30)
    return frame.astype(np.uint8)


def number(frame):
    return sum(1 << b for b in range(8) if frame[24, 8 * b + 4, :3].mean() > 127)


def video(path, codec="libx264", layout="yuv420p", pts=None, count=60, **options):
    """A counting video straight from the encoder: what other programs may hand us."""
    tick = Fraction(1, 25) if pts is None else Fraction(1, 1000)
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=25, options={k.replace("_", "-"): v for k, v in options.items()})
        stream.width, stream.height, stream.pix_fmt = W, H, layout
        stream.codec_context.time_base, stream.codec_context.gop_size = tick, 12
        for t in range(count):
            frame = av.VideoFrame.from_ndarray(counter(t), format="rgb24")
            frame.pts, frame.time_base = (t if pts is None else int(pts[t])), tick
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    return path


VIDEOS = {
    "plain.mp4": {},
    "plain.mkv": {},
    "plain.mov": {},
    "opengop.mp4": {"x264_params": "open-gop=1:keyint=10:bframes=3:b-adapt=0"},
    "tinygop.mp4": {"x264_params": "keyint=3:min-keyint=2:bframes=2"},
    "one_key.mp4": {"x264_params": "keyint=1000:scenecut=0"},
    "vp8.webm": {"codec": "libvpx", "b": "200k"},
    "vp9.webm": {"codec": "libvpx-vp9", "auto_alt_ref": "1", "b": "300k"},
    "mpeg4.avi": {"codec": "mpeg4"},
    "stream.ts": {},
}


@pytest.mark.parametrize("name", VIDEOS)
def test_every_frame_of_a_video_comes_back_in_any_order(tmp_path, name):
    clip = read_clip(video(tmp_path / name, **VIDEOS[name]))
    assert [number(frame) for frame in clip] == list(range(60))
    assert clip.notes == () and clip.size == (W, H) and not clip.has_alpha
    assert clip.fps == pytest.approx(25) and np.allclose(clip.times, np.arange(60) / 25)
    fresh = read_clip(tmp_path / name)
    order = np.random.default_rng(0).permutation(60)
    assert all(np.array_equal(fresh[i], clip[i]) for i in [*order, 0, -1])


@pytest.mark.parametrize("name", ["vary.mp4", "vary.mkv"])
def test_a_variable_rate_keeps_its_frames_and_times(tmp_path, name):
    pts = np.cumsum(np.random.default_rng(1).integers(10, 300, 60))
    clip = read_clip(video(tmp_path / name, pts=pts))
    assert [number(clip[i]) for i in range(59, -1, -1)] == list(range(59, -1, -1))
    assert np.allclose(clip.times, (pts - pts[0]) / 1000, atol=1e-3) and clip.notes == ()
    assert clip.fps == pytest.approx(60 / clip.durations.sum())


def test_reading_on_does_not_seek_and_going_back_lands_on_the_key_before(tmp_path, monkeypatch):
    import capture.pictures.movies as module

    clip, seeks, plain = read_clip(video(tmp_path / "a.mp4")), [], module._decode_from
    monkeypatch.setattr(module, "_decode_from", lambda s, index, i: seeks.append(i) or plain(s, index, i))
    assert [number(frame) for frame in clip] == list(range(60)) and seeks == [0]
    assert number(read_clip(tmp_path / "a.mp4")[41]) == 41


def test_a_kept_frame_is_not_decoded_twice_and_few_are_kept(tmp_path):
    clip = read_clip(video(tmp_path / "a.mp4", count=200))
    assert clip[7] is clip[7] and clip[-1] is clip[199]
    list(clip)
    assert clip._fetch.cache_info().currsize == 64
    with pytest.raises(ValueError, match="read-only"):
        clip[7][0, 0] = 0


def test_memory_does_not_grow_with_length(tmp_path):
    Image.fromarray(np.zeros((1000, 1000, 3), np.uint8)).save(tmp_path / "0.png")
    for i in range(1, 60):
        (tmp_path / f"{i}.png").symlink_to(tmp_path / "0.png")
    clip = read_clip(tmp_path)
    tracemalloc.start()
    for _ in clip:
        pass
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 80 * 2**20 < 60 * 3_000_000  # bytes: the cache and a frame, not the clip


def test_going_backwards_decodes_each_frame_less_than_twice(tmp_path, monkeypatch):
    import capture.pictures.movies as module

    clip = read_clip(video(tmp_path / "a.mp4", count=200, x264_params="keyint=1000:scenecut=0"))
    decoded, plain = [], module._decode
    monkeypatch.setattr(module, "_decode", lambda *given: (decoded.append(1) or frame for frame in plain(*given)))
    with av.open(str(tmp_path / "a.mp4")) as container:
        size = sum(plane.buffer_size for plane in next(container.decode(video=0)).planes)
    monkeypatch.setattr(module, "PASSED_BYTES", 80 * size)
    assert [number(clip[i]) for i in range(199, -1, -1)] == list(range(199, -1, -1))
    assert len(decoded) < 2 * 200


def test_going_backwards_in_a_gif_starts_anew_only_now_and_then(tmp_path, monkeypatch):
    write_clip(tmp_path / "a.gif", [counter(t) for t in range(200)], 25)
    monkeypatch.setattr("capture.pictures.stills.CACHED_BYTES", 50 * 4 * W * H)
    clip, decoded, plain = read_clip(tmp_path / "a.gif"), [], GifImageFile._seek
    monkeypatch.setattr(GifImageFile, "_seek", lambda *given: decoded.append(1) or plain(*given))
    assert [number(clip[i]) for i in range(199, -1, -1)] == list(range(199, -1, -1))
    assert len(decoded) < 3 * 200


def test_a_phone_video_is_turned_upright(tmp_path):
    frame = np.zeros((H, W, 3), np.uint8)
    frame[:24, :32] = 255  # a white top left corner
    write_clip(tmp_path / "a.mp4", [frame] * 3)
    data = bytearray((tmp_path / "a.mp4").read_bytes())
    matrix = data.index(b"tkhd") + 4 + 40
    one, whole = 1 << 16, 1 << 30
    for turn, corner in {
        (0, one, 0, -one, 0, 0, 0, 0, whole): (0, -1),  # a quarter turn clockwise: right goes down
        (0, -one, 0, one, 0, 0, 0, 0, whole): (-1, 0),
        (-one, 0, 0, 0, -one, 0, 0, 0, whole): (-1, -1),
    }.items():
        data[matrix : matrix + 36] = struct.pack(">9i", *turn)
        (tmp_path / "turned.mp4").write_bytes(data)
        clip = read_clip(tmp_path / "turned.mp4")
        bright = [c for c in [(0, 0), (0, -1), (-1, 0), (-1, -1)] if clip[0][c].mean() > 127]
        assert bright == [corner] and clip[0].shape[1::-1] == clip.size


@pytest.mark.parametrize("layout, codec", [("yuva444p10le", "prores_ks"), ("rgba", "png")])
def test_a_mov_with_alpha_has_it(tmp_path, layout, codec):
    clip = read_clip(video(tmp_path / "a.mov", codec, layout, count=3))
    assert clip.has_alpha and clip[2].shape == (H, W, 4) and clip[2][..., 3].min() == 255


# What is broken


def faststart(path, count=60):
    write_clip(path, [counter(t) for t in range(count)], fps=25)
    return path.read_bytes()


@pytest.mark.parametrize("share", [0.4, 0.7, 0.95])
@pytest.mark.parametrize("damage", ["cut", "zeroed"])
def test_of_a_damaged_mp4_what_decodes_is_used_and_told(tmp_path, share, damage):
    data = faststart(tmp_path / "a.mp4", 120)
    begin = data.index(b"mdat")
    keep = begin + int(share * (len(data) - begin))
    rest = b"" if damage == "cut" else bytes(len(data) - keep)
    (tmp_path / "b.mp4").write_bytes(data[:keep] + rest)
    clip = read_clip(tmp_path / "b.mp4")
    seen = [number(frame) for frame in clip]
    assert 10 < len(clip) < 120
    assert seen[:-1] == list(range(len(clip) - 1))  # half a picture may pass for whole
    (note,) = clip.notes
    assert "120 frames" in note and f"the first {len(clip)} are" in note


def test_a_cut_mkv_is_used_as_far_as_it_goes(tmp_path):
    data = video(tmp_path / "a.mkv").read_bytes()
    (tmp_path / "b.mkv").write_bytes(data[: len(data) // 2])
    clip = read_clip(tmp_path / "b.mkv")
    assert [number(frame) for frame in clip] == list(range(len(clip))) and len(clip) < 55
    assert f"the first {len(clip)} are" in clip.notes[0]


def test_a_cut_gif_is_used_as_far_as_it_goes(tmp_path):
    write_clip(tmp_path / "a.gif", [counter(t) for t in range(20)])
    data = (tmp_path / "a.gif").read_bytes()
    (tmp_path / "b.gif").write_bytes(data[: data.rindex(b"\x21\xf9\x04") + 40])
    clip = read_clip(tmp_path / "b.gif")
    assert [number(frame) for frame in clip] == list(range(19)) and "the first 19 are" in clip.notes[0]


def test_a_frame_broken_in_the_middle_is_named_and_the_others_come(tmp_path):
    video(tmp_path / "a.mov", "png", "rgb24", count=20)
    data = bytearray((tmp_path / "a.mov").read_bytes())
    heads = [i for i in range(len(data)) if data[i : i + 4] == b"\x89PNG"]
    data[heads[5] : heads[5] + 8] = bytes(8)
    (tmp_path / "a.mov").write_bytes(data)
    clip = read_clip(tmp_path / "a.mov")
    with pytest.raises(InputError, match="frame 5 does not"):
        clip[5]
    assert number(clip[4]) == 4 and number(clip[6]) == 6


@pytest.mark.parametrize(
    "name, data, match",
    [
        ("empty.mp4", b"", "empty"),
        ("text.mp4", b"hello\n" * 99, "must be a video"),
        ("text.txt", b"hello\n" * 99, "must be a video"),
        ("list.m3u8", b"#EXTM3U\n#EXTINF:1,\nhttp://localhost:9/a.ts\n", "must be a video"),
        ("stub.png", b"\x89PNG\r\n\x1a\n", "must"),
        ("stub.gif", b"GIF89a\x01\x00\x01\x00\x00\x00\x00;", "must"),
    ],
)
def test_what_is_no_clip_is_an_input_error(tmp_path, name, data, match):
    (tmp_path / name).write_bytes(data)
    with pytest.raises(InputError, match=match):
        read_clip(tmp_path / name)


def test_a_missing_file_an_empty_folder_and_sound_alone_are_input_errors(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        read_clip(tmp_path / "none.mp4")
    with pytest.raises(InputError, match="must hold pictures"):
        read_clip(tmp_path)
    with av.open(str(tmp_path / "sound.mp4"), "w") as container:
        stream = container.add_stream("aac", rate=8000, layout="mono")
        sound = av.AudioFrame.from_ndarray(np.zeros((1, 1024), np.float32), format="fltp", layout="mono")
        sound.sample_rate = 8000
        container.mux(stream.encode(sound))
        container.mux(stream.encode(None))
    with pytest.raises(InputError, match="must hold pictures"):
        read_clip(tmp_path / "sound.mp4")


# Pictures


def test_a_folder_is_sorted_by_number_and_other_files_are_left_alone(tmp_path):
    for t in (10, 9, 100, 1):
        Image.fromarray(counter(t)).save(tmp_path / f"frame{t}.png")
    Image.fromarray(counter(2)).save(tmp_path / "frame2.jpg", quality=95)
    (tmp_path / "notes.txt").write_text("a")
    (tmp_path / "._frame1.png").write_text("a")
    clip = read_clip(tmp_path)
    assert [number(frame) for frame in clip] == [1, 2, 9, 10, 100] and clip.fps == 24
    Image.fromarray(counter(3)[:40]).save(tmp_path / "frame3.png")
    with pytest.raises(InputError, match=r"frame3\.png is 64x40"):
        read_clip(tmp_path)


def test_a_folder_where_any_picture_has_alpha_has_alpha(tmp_path):
    Image.fromarray(counter(1)).save(tmp_path / "1.png")
    Image.fromarray(np.dstack([counter(2), np.full((H, W), 99, np.uint8)])).save(tmp_path / "2.png")
    clip = read_clip(tmp_path)
    assert clip.has_alpha and clip[0][0, 0, 3] == 255 and clip[1][0, 0, 3] == 99


def test_grey_deep_and_palette_pictures_become_8_bit_rgb(tmp_path):
    deep = np.linspace(0, 65535, 256).astype(np.uint16).reshape(16, 16)
    Image.fromarray(deep).save(tmp_path / "deep.png")
    assert np.array_equal(read_clip(tmp_path / "deep.png")[0][..., 0], np.arange(256).reshape(16, 16))
    for mode, alpha in {"1": False, "L": False, "P": False, "LA": True}.items():
        Image.fromarray(counter(5)).convert(mode).save(tmp_path / "a.png")
        clip = read_clip(tmp_path / "a.png")
        assert clip[0].shape == (H, W, 3 + alpha) and number(clip[0]) == 5
    Image.fromarray(counter(5)).convert("CMYK").save(tmp_path / "a.jpg")
    assert read_clip(tmp_path / "a.jpg")[0].shape == (H, W, 3)


def test_a_photograph_taken_sideways_stands_upright(tmp_path):
    sideways = Image.Exif()
    sideways[0x0112] = 6
    Image.fromarray(counter(5)).save(tmp_path / "1.jpg", exif=sideways)
    for clip in (read_clip(tmp_path), read_clip(tmp_path / "1.jpg")):
        assert clip.size == (H, W) and clip[0].shape == (W, H, 3) and clip[0][0, -1, 0] > 150


def test_a_sheet_is_read_row_by_row_and_blank_tiles_at_its_end_are_dropped(tmp_path):
    tiles = [counter(t) for t in range(1, 6)] + [np.zeros((H, W, 3), np.uint8)] * 3
    sheet = np.vstack([np.hstack(tiles[:4]), np.hstack(tiles[4:])])
    Image.fromarray(sheet).save(tmp_path / "sheet.png")
    clip = read_clip(tmp_path / "sheet.png", tile=(W, H), fps=12)
    assert [number(frame) for frame in clip] == [1, 2, 3, 4, 5] and clip.fps == 12 and clip.notes == ()
    assert len(read_clip(tmp_path / "sheet.png")) == 1
    assert "leave 6 columns" in read_clip(tmp_path / "sheet.png", tile=(50, H)).notes[0]
    with pytest.raises(InputError, match="fit the 256x96 sheet"):
        read_clip(tmp_path / "sheet.png", tile=(300, 20))
    Image.fromarray(sheet * 0).save(tmp_path / "blank.png")
    with pytest.raises(InputError, match="blank"):
        read_clip(tmp_path / "blank.png", tile=(W, H))


@pytest.mark.parametrize("suffix", [".png", ".webp", ".gif"])
def test_an_animated_picture_keeps_frames_and_durations(tmp_path, suffix):
    frames = [Image.fromarray(counter(t)) for t in range(12)]
    waits = [40, 50, 40, 500, 30, 40, 40, 40, 20, 40, 40, 1000]  # ms
    frames[0].save(
        tmp_path / f"a{suffix}",
        save_all=True,
        append_images=frames[1:],
        duration=waits,
        loop=0,
        lossless=True,
    )
    clip = read_clip(tmp_path / f"a{suffix}")
    assert [number(frame) for frame in clip] == list(range(12))
    assert np.allclose(clip.durations, np.array(waits) / 1000)
    assert [number(clip[i]) for i in (7, 2, 11, 0, 5)] == [7, 2, 11, 0, 5]
    assert clip.fps == pytest.approx(12 / 1.88) and not clip.has_alpha
    with pytest.raises(InputError, match="single picture"):
        read_clip(tmp_path / f"a{suffix}", tile=(8, 8))


@pytest.mark.parametrize("disposal", [1, 2, 3])
def test_gif_disposals_come_out_as_whole_pictures(tmp_path, disposal):
    """Three dots, one a frame: left standing, cleared, or undone."""
    dots = []
    for t in range(3):
        dot = np.zeros((H, W, 4), np.uint8)
        dot[10:20, 20 * t : 20 * t + 10] = (255, 0, 0, 255)
        dots.append(Image.fromarray(dot))
    dots[0].save(tmp_path / "a.gif", save_all=True, append_images=dots[1:], duration=100, disposal=disposal, loop=0)
    clip = read_clip(tmp_path / "a.gif")
    seen = [[bool(frame[15, 20 * t + 5, 3]) for t in range(3)] for frame in clip]
    assert seen == (np.tri(3) if disposal == 1 else np.eye(3)).astype(bool).tolist()


def test_the_stand_in_picture_of_an_apng_is_no_frame(tmp_path):
    frames = [Image.fromarray(counter(t)) for t in range(4)]
    frames[0].save(tmp_path / "a.png", save_all=True, append_images=frames[1:], duration=100, default_image=True)
    assert [number(frame) for frame in read_clip(tmp_path / "a.png")] == [1, 2, 3]


# The clip itself


def test_start_and_stop_trim_and_time_starts_anew(tmp_path):
    path = video(tmp_path / "a.mp4")
    clip = read_clip(path, start=13, stop=50)
    assert [number(frame) for frame in clip] == list(range(13, 50)) and clip.times[0] == 0
    assert clip.fps == 25 and number(trim(clip, 2)[0]) == 15
    for start, stop in [(-1, 5), (5, 5), (9, 3), (0, 61), (60, None)]:
        with pytest.raises(InputError, match="<= 60"):
            read_clip(path, start=start, stop=stop)
    with pytest.raises(IndexError):
        clip[37]


def test_a_given_rate_replaces_the_source_s_own(tmp_path):
    clip = read_clip(video(tmp_path / "a.mp4"), fps=10)
    assert clip.fps == 10 and np.allclose(clip.times, np.arange(60) / 10)
    for fps in (0, -1, float("nan"), float("inf")):
        with pytest.raises(InputError, match="above 0"):
            read_clip(tmp_path / "a.mp4", fps=fps)


def test_frames_in_memory_are_a_clip_too():
    frames = np.stack([counter(t) for t in range(5)])
    clip = clip_of(frames, 12)
    assert len(clip) == 5 and clip.fps == 12 and clip.size == (W, H)
    assert np.array_equal(np.stack(list(clip)), frames) and frames.flags.writeable
    timed = clip_of(iter(frames), times=[1.0, 1.5, 2.0, 4.0, 4.5])
    assert np.allclose(timed.times, [0, 0.5, 1, 3, 3.5]) and np.allclose(timed.durations, [0.5, 0.5, 2, 0.5, 0.5])
    assert np.allclose(clip_of(frames, times=[0, 1, 2, 3, 4, 9]).durations, [1, 1, 1, 1, 5])


@pytest.mark.parametrize(
    "frames, times, match",
    [
        ([], None, "must have frames"),
        ([counter(0), counter(0)[:9]], None, "of one size"),
        ([counter(0).astype(float)], None, "uint8"),
        ([counter(0)[..., 0]], None, "uint8"),
        ([counter(0)] * 3, [0, 1], "a time for each"),
        ([counter(0)] * 3, [0, 2, 1], "rise"),
    ],
)
def test_frames_in_memory_must_be_alike(frames, times, match):
    with pytest.raises(InputError, match=match):
        clip_of(frames, times=times)
