"""A layer taken out of its footage: the painted background is the truth, pixel by pixel."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from capture.errors import InputError
from capture.fit.contour import capture_outlines
from capture.motion import tracks
from capture.motion.tracks import CartoonMotion
from capture.pictures.clip import clip_of
from capture.pictures.encode import write_clip
from capture.pictures.shot import KeyDrawing, Part, Shot, write_shot
from fixtures import ball, variants, write
from retarget.characters.drawings.drawing import outline_drawing
from retarget.cli import main
from retarget.stage import camera, plate
from retarget.stage.carry import carried_on
from retarget.stage.perform import perform

RED, SIZE = np.array([1.0, 0, 0, 1]), (160, 120)


@pytest.fixture(scope="module")
def footage():
    """The ball before a painted background, its clip, shot and true motion."""
    toon = variants.zoomed(ball.ball(busy=True), 0.5)
    clip = clip_of(np.stack([toon.frame(t) for t in range(0, len(toon), 3)]), toon.fps / 3)
    part = toon.parts[0]
    motion = capture_outlines(part.points[::3], [0], toon.fps / 3, clip.size, part.name)
    return toon, clip, write.shot_of(toon), motion


def test_the_ball_is_gone_and_the_painted_background_is_there(footage):
    toon, clip, shot, motion = footage
    clean = plate.without(shot, motion, ("ball",), clip)
    truth = toon.background.astype(int)
    for t in range(0, len(clip), 4):
        off = np.abs(clean[t].astype(int) - truth).max(axis=-1)
        was = np.abs(clip[t].astype(int) - truth).max(axis=-1) > 3
        assert was.sum() > 1000  # the ball
        assert off[was].mean() <= 3
        assert (off > 24).sum() < 0.005 * was.sum()


def test_pixels_the_layer_never_nears_are_the_clips_own(footage):
    _, clip, shot, motion = footage
    clean = plate.without(shot, motion, ("ball",), clip)
    brush = np.ones((13, 13), np.uint8)
    for t in (0, 7, 19):
        posed = np.zeros(clip.size[::-1], np.uint8)
        cv2.fillPoly(posed, [motion.outline("ball")[t].round().astype(np.int32)], 1)
        away = cv2.dilate(posed, brush) == 0
        np.testing.assert_array_equal(clean[t][away], clip[t][away])


def test_a_flickering_film_keeps_its_brightness_where_the_layer_was(footage):
    toon, clip, shot, motion = footage
    flicker = 1 + 0.06 * np.sin(2.1 * np.arange(len(clip)))
    frames = [np.clip(frame * gain, 0, 255).astype(np.uint8) for frame, gain in zip(clip, flicker, strict=True)]
    clean = plate.without(shot, motion, ("ball",), clip_of(np.stack(frames), clip.fps))
    dark = int(flicker.argmin())
    was = np.abs(clip[dark].astype(int) - toon.background).max(axis=-1) > 3
    off = clean[dark][was] - np.minimum(toon.background[was] * flicker[dark], 255)
    assert abs(off.mean()) < 3


def test_a_camera_that_pans_and_zooms_is_followed():
    """A red disc crosses a picture that the camera travels over; what it hid is the picture itself."""
    rng = np.random.default_rng(5)
    world = np.clip(120 + 400 * cv2.GaussianBlur(rng.normal(0, 1, (420, 640, 3)), (0, 0), 4), 0, 255).astype(np.uint8)
    angle = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    frames, truths, outlines = [], [], []
    for t in range(16):
        zoom = 1.25 + 0.012 * t
        look_at = np.array([[zoom, 0.01 * t, -60.0 - 9 * t], [-0.01 * t, zoom, -40.0 - 3 * t]])
        truth = cv2.warpAffine(world, look_at, (320, 240), flags=cv2.INTER_AREA)
        outline = [60 + 13 * t, 130] + 26 * np.stack([np.cos(angle), np.sin(angle)], -1)
        frame = truth.copy()
        cv2.fillPoly(frame, [np.round(outline * 16).astype(np.int32)], (20, 220, 60), cv2.LINE_AA, 4)
        frames.append(frame)
        truths.append(truth.astype(int))
        outlines.append(outline)
    clip = clip_of(np.stack(frames), 12.0)
    motion = capture_outlines(np.array(outlines), [0], 12.0, clip.size, "disc")
    shot = Shot("memory", (Part("disc", (KeyDrawing("rest", 0, tuple(map(tuple, outlines[0].tolist()))),)),))
    maps = camera.homographies(clip, lambda t: (np.abs(frames[t].astype(int) - truths[t]).max(-1) > 0).astype(np.uint8))
    assert maps is not None
    clean = plate.without(shot, motion, ("disc",), clip)
    still = np.median(np.stack(frames), axis=0)  # what taking the camera for still would give
    for t in range(16):
        was = np.abs(frames[t].astype(int) - truths[t]).max(axis=-1) > 0
        off = np.abs(clean[t].astype(int) - truths[t])[was].mean()
        assert off < 4 and off < 0.2 * np.abs(still - truths[t])[was].mean()


def test_a_large_figure_before_an_empty_wall_is_not_taken_for_the_camera():
    rng = np.random.default_rng(3)
    coat = rng.integers(0, 255, (90, 90, 3)).astype(np.uint8)
    frames = np.full((8, 240, 320, 3), 180, np.uint8)
    for t in range(8):
        frames[t, 60:150, 60 + 8 * t : 150 + 8 * t] = coat
    assert camera.homographies(clip_of(frames, 12.0), lambda t: np.zeros((240, 320), np.uint8)) is None


def test_a_part_in_front_stays_in_front():
    """A blue disc passes behind a yellow post; a red one takes its place."""
    frames, outlines = [], []
    angle = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    for t in range(12):
        picture = np.full((SIZE[1], SIZE[0], 3), (200, 215, 200), np.uint8)
        centre = np.array([30.0 + 9 * t, 60])
        cv2.circle(picture, tuple(int(c) for c in centre), 20, (30, 60, 220), -1, cv2.LINE_AA)
        cv2.rectangle(picture, (76, 20), (86, 110), (240, 210, 40), -1)
        frames.append(picture)
        outlines.append(centre + 20 * np.stack([np.cos(angle), np.sin(angle)], -1))
    post = np.array([(75.5, 19.5), (86.5, 19.5), (86.5, 60), (86.5, 110.5), (75.5, 110.5), (75.5, 60)])
    pieces = [("disc", np.array(outlines), 0), ("post", np.tile(post, (12, 1, 1)), 1)]
    alone = [capture_outlines(points, [0], 12.0, SIZE, name) for name, points, _ in pieces]
    ordered = [
        replace(one.tracks[0], order=np.full(12, order)) for one, (_, _, order) in zip(alone, pieces, strict=True)
    ]
    motion = CartoonMotion(tuple(ordered), tuple(one.keysets[0] for one in alone), alone[0].times, 12.0, SIZE)
    parts = [
        Part(name, (KeyDrawing("rest", 0, tuple(map(tuple, points[0].tolist()))),), order=order)
        for name, points, order in pieces
    ]
    shot, clip = Shot("memory", tuple(parts)), clip_of(np.stack(frames), 12.0)
    actor = perform(motion, [replace(outline_drawing("disc", motion.keyset("disc"), RED), height=0.9)])
    made = list(plate.into(actor, shot, motion, clip))
    assert len(made) == 12
    assert tuple(made[5][60, 81]) == (240, 210, 40)  # the post, though the disc is there
    assert tuple(made[5][60, 65]) == (255, 0, 0)
    for frame in made:
        red, blue, green = (frame[..., k].astype(int) for k in (0, 2, 1))
        assert (blue > red + 60).sum() == 0  # nothing of the old disc
        assert ((red > 200) & (green < 60)).sum() > 400
    alone = [plate.filled(frame, np.zeros(SIZE[::-1], np.uint8), None) for frame in frames]
    np.testing.assert_array_equal(alone, frames)  # nothing hidden, nothing changed


def test_an_edge_that_runs_into_a_hole_comes_out_of_it_again():
    """A disc of one colour before another, a part of its rim cut out: the colours stay two, the rim stays round."""
    y, x = np.mgrid[:100, :100]
    share = np.clip(30.5 - np.hypot(x - 50, y - 50), 0, 1)[..., None]
    picture = np.round(share * (223, 223, 223) + (1 - share) * (207, 226, 243)).astype(np.uint8)
    hole = np.hypot(x - 50, y - 20) < 9
    cut = picture.copy()
    cut[hole] = 0
    made = carried_on(cut, hole)
    np.testing.assert_array_equal(made[~hole], cut[~hole])
    off = np.abs(made[hole].astype(int) - picture[hole]).max(axis=-1)
    assert (off > 3).mean() < 0.2 and off.max() <= 21  # the two are 20 apart; only near the rim is a choice made


def test_a_large_hole_is_filled_as_a_small_one():
    y, x = np.mgrid[:300, :300]
    picture = np.where((x < 150)[..., None], (200, 30, 30), (30, 30, 200)).astype(np.uint8)
    hole = (np.abs(x - 150) < 110) & (np.abs(y - 150) < 110)
    made = carried_on(np.where(hole[..., None], 0, picture).astype(np.uint8), hole)
    wrong = np.abs(made.astype(int) - picture).max(axis=-1) > 40
    assert wrong[:, :140].sum() == wrong[:, 160:].sum() == 0


def test_a_shot_that_was_not_the_captured_one_is_refused(footage):
    _, clip, shot, motion = footage
    with pytest.raises(InputError, match="the shot must be the one that was captured"):
        plate.without(shot, tracks.trim(motion, 0, 5), ("ball",), clip)
    with pytest.raises(InputError, match="it has ball, not 'nose'"):
        plate.without(shot, motion, ("nose",), clip)


def test_the_command_puts_a_drawing_into_the_clip_it_was_captured_from(footage, worm, tmp_path, capsys):
    _, clip, shot, motion = footage
    write_clip(tmp_path / "frames", clip, clip.fps)
    write_shot(replace(shot, clip=str(tmp_path / "frames"), fps=clip.fps), tmp_path / "ball.shot.toml")
    tracks.save(motion, tmp_path / "ball.motion.json")
    asked = ["retarget", str(tmp_path / "ball.motion.json"), "--drawing", str(worm[0])]
    asked += ["--into", str(tmp_path / "ball.shot.toml"), "-o", str(tmp_path / "out")]
    assert main(asked) == 0
    assert len(list((tmp_path / "out").glob("*.png"))) == len(clip)
    assert main([*asked, "--background", "white"]) == 2
    assert "leave --background out" in capsys.readouterr().err
