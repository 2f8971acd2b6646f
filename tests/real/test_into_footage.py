"""Back into real footage: a top hat in the place of the snowman's, a photographed cup in the place of Willie's stack."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

from capture.fit import video
from capture.motion.tracks import CartoonMotion
from capture.pictures import overlay
from capture.pictures.clip import Clip
from capture.pictures.encode import write_clip, write_picture
from capture.pictures.shot import KeyDrawing, Part, Shot
from retarget.characters.casts import cast as casting
from retarget.characters.casts.castlist import Cast, CastPart
from retarget.stage import composite, plate
from retarget.stage.perform import perform

SKY = (207, 226, 243)  # the flat background of the snowman's clip


@pytest.fixture(scope="module")
def snowman(data: Path, snowman_shot: Shot, snowman_clip: Clip, snowman_hat: CartoonMotion):
    """The clip, the clip without the hat, and the clip with the top hat."""
    shot, clip, motion = snowman_shot, snowman_clip, snowman_hat
    drawing = data / "drawings" / "openclipart" / "tophat_benji_park_01.svg"
    performance = perform(motion, casting.targets(casting.cast_of(drawing, motion), motion))
    clean = list(plate.without(shot, motion, ("hat",), clip))  # each look at it works it out anew
    return clip, clean, list(plate.into(performance, shot, motion, clip))


@pytest.fixture(scope="module")
def hats(data: Path) -> np.ndarray:
    """The polygons of the hat's vertices, a mask a frame (T, 512, 512)."""
    truth = np.load(data / "clips" / "noto_snowman_hat" / "gt.npz")
    paths = [truth[f"path/4:hat/{n}"][:, 0].round().astype(np.int32) for n in (0, 1)]
    masks = np.zeros((len(paths[0]), 512, 512), np.uint8)
    for mask, *drawn in zip(masks, *paths):
        for path in drawn:
            cv2.fillPoly(mask, [path], 1)
    return masks


def test_where_the_hat_was_before_the_sky_there_is_sky(snowman, hats: np.ndarray):
    """The clip's own vertices say where the hat is; away from the snowman's head nothing else was behind it."""
    clip, clean, _ = snowman
    off = []
    for t in range(len(clip)):
        crown = hats[t] > 0
        crown[int(np.median(np.argwhere(crown)[:, 0])) :] = False  # the lower half may have the head behind it
        off.append(np.abs(clean[t][crown].astype(float) - SKY).mean())
    print(
        f"\nsnowman: where the crown was, the clip is off the sky by {np.mean(off):.3f} of 255, worst frame {max(off):.3f}"
    )
    assert max(off) <= 3


def test_pixels_that_are_never_hat_are_the_clips_own(snowman, hats: np.ndarray):
    clip, clean, _ = snowman
    ever = hats.max(axis=0)
    never = cv2.dilate(ever, np.ones((35, 35), np.uint8)) == 0  # vertices are not the curves between them
    assert never.mean() > 0.5
    for t in range(len(clip)):
        np.testing.assert_array_equal(clean[t][never], clip[t][never])


def test_no_dark_pixel_is_left_where_the_old_hat_was(snowman, hats: np.ndarray):
    """What was behind it, sky and snow, is light."""
    clip, clean, _ = snowman
    left = [(clean[t][hats[t] > 0].min(axis=-1) < 150).sum() for t in range(len(clip))]
    assert max(left) == 0


def test_the_snowmans_sheet_is_left_to_look_at(snowman, sheets: Path):
    clip, clean, made = snowman
    pairs = list(overlay.side_by_side((c[:300], b[:300], m[:300]) for c, b, m in zip(clip, clean, made)))
    write_picture(sheets / "snowman_into.png", overlay.contact_sheet(pairs[::6], columns=3, width=700))
    write_clip(sheets / "snowman_into.mp4", pairs, clip.fps)


def test_a_photographed_cup_takes_the_stacks_place(data: Path, sheets: Path, tmp_path: Path):
    from skimage import data as photographs

    Image.fromarray(photographs.coffee()).save(tmp_path / "coffee.png")
    stack = Part("stack", (KeyDrawing("rest", 33),), box=(300, 192, 44, 99))
    shot = Shot(str(data / "clips" / "steamboat_willie" / "steamboat_willie.mp4"), (stack,), 33, 57)
    clip = video.open_clip(shot)
    motion = video.capture(shot, clip)
    part = CastPart("stack", drawing=str(tmp_path / "coffee.png"), box=(70, 10, 420, 380))
    performance = perform(motion, casting.targets(Cast((part,)), motion))
    blend = composite.Blend(soften=0.8, match=0.6)
    clean = plate.without(shot, motion, ("stack",), clip)
    made = list(plate.into(performance, shot, motion, clip, blend=blend))
    before = list(composite.over(performance, photographs.rocket(), blend=composite.Blend(soften=0.7, shadow=0.4)))
    crop = slice(100, 330), slice(200, 470)
    rows = zip(clip, clean, made, before)
    pairs = list(overlay.side_by_side(tuple(picture[crop] for picture in row) for row in rows))
    write_picture(sheets / "steamboat_coffee.png", overlay.contact_sheet(pairs[::3], columns=2, width=900))
    write_clip(sheets / "steamboat_coffee.mp4", pairs, motion.fps)
    assert len(made) == len(before) == len(clip)
    for t, frame in enumerate(made):
        box = np.array([performance.roles[0].points[t].min(axis=0), performance.roles[0].points[t].max(axis=0)])
        assert np.isfinite(box).all() and frame.shape == clip[t].shape
