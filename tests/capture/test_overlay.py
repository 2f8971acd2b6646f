"""The proof shows on every frame what was captured, and the plot names the frames where it fits worst."""

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from capture.errors import InputError
from capture.motion.keys import KeySet, inbetween_rows
from capture.motion.tracks import CartoonMotion, Track
from capture.pictures import overlay

SIZE, FRAMES = (200, 120), 5
SQUARE = np.array([(0, 0), (30, 0), (30, 30), (0, 30)], float)
PAPER = 250


def part(name="body", keys=("rest", "tall"), shift=(0.0, 0.0), **changes):
    """A square that goes 20 pixels to the right a frame; two keys, mixed from one to the other."""
    rows = inbetween_rows(len(keys), 1)
    weights = np.zeros((FRAMES, len(rows)))
    weights[:, 0] = 1 if len(keys) == 1 else np.linspace(1, 0, FRAMES)
    if len(keys) > 1:
        weights[:, 1] = 1 - weights[:, 0]
    placed = np.tile(np.eye(2, 3), (FRAMES, 1, 1))
    placed[:, 0, 2] = 20 * np.arange(FRAMES)
    own = {
        "part": name,
        "parent": "",
        "pivot": np.zeros(2),
        "keys": keys,
        "rows": rows,
        "affine": placed,
        "weights": weights,
        "residual": np.array([0.1, 0.9, 0.2, 2.5, 0.3]),
        "visible": np.ones(FRAMES, bool),
        "held": np.zeros(FRAMES, bool),
        "order": np.zeros(FRAMES, int),
    }
    shapes = np.stack([SQUARE * (1, 1 + 0.2 * k) + (20, 40) + shift for k in range(len(keys))])
    removed = np.tile(np.eye(2, 3), (len(keys), 1, 1))
    keyset = KeySet(keys, shapes, np.array([(0, 1, 2), (0, 2, 3)]), np.arange(4), rows, removed)
    return Track(**{**own, **changes}), keyset


def motion_of(*parts):
    own, keysets = zip(*(parts or (part(),)))
    return CartoonMotion(own, keysets, np.arange(FRAMES) / 24, 24.0, SIZE)


def paper(count=FRAMES, channels=3):
    return [np.full((SIZE[1], SIZE[0], channels), PAPER, np.uint8) for _ in range(count)]


def ink(picture, color, near=40):
    """Where (N, 2) a picture shows a colour."""
    rows, columns = np.nonzero(np.abs(picture.astype(int) - color).max(axis=-1) < near)
    return np.column_stack([columns, rows])


@pytest.mark.parametrize("channels", [3, 4])
def test_every_frame_is_drawn_over_where_the_part_is(channels):
    drawn = list(overlay.draw_over(paper(channels=channels), motion_of(part(keys=("rest",)))))
    assert len(drawn) == FRAMES
    for t, picture in enumerate(drawn):
        assert picture.shape == (SIZE[1], SIZE[0], 3) and picture.dtype == np.uint8
        found = ink(picture, overlay.COLORS[0])
        low, high = (20 + 20 * t, 40), (50 + 20 * t, 70)
        assert np.allclose(found.min(axis=0), low, atol=3) and np.allclose(found.max(axis=0), high, atol=3)


def test_the_frames_themselves_are_left_as_they_were():
    frames = paper()
    list(overlay.draw_over(frames, motion_of()))
    assert all((frame == PAPER).all() for frame in frames)


def test_frames_that_may_not_be_written_are_no_hindrance():
    """A clip hands out its frames read-only."""
    frames = paper()
    for frame in frames:
        frame.flags.writeable = False
    assert len(list(overlay.draw_over(frames, motion_of()))) == FRAMES


def bar_length(picture, color, row):
    y = 8 + 3 + row * overlay.ROW + overlay.ROW // 2
    return int((np.abs(picture[y, :180].astype(int) - color).max(axis=-1) < 12).sum())


def test_a_bar_is_as_long_as_its_keys_weight():
    low_down = part(shift=(0, 20))  # clear of the bars
    drawn = list(overlay.draw_over(paper(), motion_of(low_down)))
    for t, picture in enumerate(drawn):
        for row, weight in enumerate((1 - t / 4, t / 4)):
            assert abs(bar_length(picture, overlay.COLORS[0], row) - weight * overlay.BAR) <= 2


def test_one_key_needs_no_bars():
    only = part(keys=("rest",), shift=(0, 20))
    picture = next(iter(overlay.draw_over(paper(), motion_of(only))))
    assert (picture[:30, :180] == PAPER).all()


def test_a_part_that_was_lost_turns_grey_and_says_so():
    track, keyset = part(keys=("rest",))
    lost = replace(track, visible=np.arange(FRAMES) != 2)
    drawn = list(overlay.draw_over(paper(), motion_of((lost, keyset))))
    assert len(ink(drawn[1], overlay.COLORS[0])) > 50 and len(ink(drawn[2], overlay.COLORS[0])) == 0
    label = [np.count_nonzero((picture[105:] < 100).all(axis=-1)) for picture in drawn]
    assert label[2] > 1.2 * label[1]


def test_each_part_has_its_own_colour():
    both = motion_of(part("a", keys=("rest",)), part("b", keys=("rest",), shift=(0, 40)))
    picture = next(iter(overlay.draw_over(paper(), both)))
    assert ink(picture, overlay.COLORS[0])[:, 1].max() < 75 < ink(picture, overlay.COLORS[1])[:, 1].min()


def test_a_part_far_outside_the_picture_is_no_hindrance():
    far = part(affine=np.tile(np.array([(1, 0, 1e7), (0, 1, -1e9)]), (FRAMES, 1, 1)))
    assert len(list(overlay.draw_over(paper(), motion_of(far)))) == FRAMES


@pytest.mark.parametrize("count", [0, 4, 6])
def test_a_clip_of_another_length_is_refused(count):
    with pytest.raises(InputError, match="as many frames as the motion, 5"):
        list(overlay.draw_over(paper(count), motion_of()))


def test_frames_are_drawn_one_at_a_time():
    """A long clip must not be held in memory."""
    asked = []

    def frames():
        for t, frame in enumerate(paper()):
            asked.append(t)
            yield frame

    drawn = overlay.draw_over(frames(), motion_of())
    next(drawn)
    assert asked == [0]


# -- the plot -------------------------------------------------------------------------------------------------


def test_the_plot_names_the_worst_frames_worst_first(tmp_path):
    path = tmp_path / "misfit.png"
    assert overlay.residual_plot(motion_of(), path) == [3, 1]  # the peaks, not the slopes beside them
    assert overlay.residual_plot(motion_of(), path, worst=1) == [3]
    with Image.open(path) as picture:
        assert picture.format == "PNG" and picture.size[0] > 600
        assert np.ptp(np.asarray(picture.convert("L"))) > 100


def test_the_plot_looks_at_the_worst_part_of_every_frame(tmp_path):
    calm = part("calm", residual=np.zeros(FRAMES))
    late = part("late", residual=np.array([0, 0, 0, 0, 9.0]))
    assert overlay.residual_plot(motion_of(calm, late, part("body")), tmp_path / "a.png") == [4, 1]


@pytest.mark.parametrize("residual", [np.zeros(FRAMES), np.full(FRAMES, 0.5)])
def test_an_even_fit_can_be_plotted_too(tmp_path, residual):
    named = overlay.residual_plot(motion_of(part(residual=residual)), tmp_path / "a.png")
    assert set(named) <= set(range(FRAMES)) and (tmp_path / "a.png").stat().st_size > 1000


def test_nothing_is_left_where_the_plot_cannot_be_written(tmp_path):
    with pytest.raises(InputError):
        overlay.residual_plot(motion_of(), tmp_path / "no" / "such" / "folder" / "a.png")
    assert list(tmp_path.iterdir()) == []


# -- side by side ---------------------------------------------------------------------------------------------


def test_pictures_side_by_side_keep_their_shape_at_a_common_height():
    tall, wide = np.full((40, 20, 3), 10, np.uint8), np.full((10, 30, 4), 200, np.uint8)
    rows = list(overlay.side_by_side([(tall, wide)] * 3))
    assert len(rows) == 3 and rows[0].shape == (40, 20 + 120, 3)
    assert (rows[0][:, :20] == 10).all() and (rows[0][:, 20:] == 200).all()
    assert next(iter(overlay.side_by_side([(tall, wide)], height=20))).shape == (20, 10 + 60, 3)


@pytest.mark.parametrize("count, rows", [(1, 1), (4, 1), (5, 2), (8, 2)])
def test_a_contact_sheet_holds_all_its_pictures(count, rows):
    pictures = [np.full((30, 60, 3), 10 * k, np.uint8) for k in range(count)]
    sheet = overlay.contact_sheet(pictures, columns=4, width=120)
    assert sheet.shape == (60 * rows, 480, 3)
    for k in range(4 * rows):
        tile = sheet[60 * (k // 4) : 60 * (k // 4 + 1), 120 * (k % 4) : 120 * (k % 4 + 1)]
        assert (tile == (10 * k if k < count else 255)).all()
