"""Before a moving clip by time, and edges, tone and shadow by laws that a hand can check."""

from dataclasses import replace

import numpy as np
import pytest

from capture.errors import InputError
from capture.motion import tracks
from capture.pictures.clip import clip_of
from capture.pictures.decode import read_clip
from capture.pictures.encode import write_clip
from retarget.characters.casts import backdrop
from retarget.characters.drawings.drawing import outline_drawing
from retarget.cli import main
from retarget.stage import composite
from retarget.stage.draw2d import draw, draw_frames
from retarget.stage.perform import perform

RED = np.array([1.0, 0, 0, 1])


@pytest.fixture
def performance(by_hand):
    motion = by_hand.motion(by_hand.still(12), np.ones((12, 1)), names=("sit",))
    return perform(motion, [outline_drawing("egg", motion.keyset("egg"), RED)])


def greys(count, fps, size=(320, 240)):
    """A clip whose frame k is of the one grey 10 k."""
    return clip_of(np.stack([np.full((size[1], size[0], 3), 10 * k, np.uint8) for k in range(count)]), fps)


@pytest.mark.parametrize("fps", [12.0, 24.0, 25.0, 60.0])
def test_a_clip_behind_runs_by_its_own_clock_and_holds_its_end(performance, fps):
    seen = [frame[0, 0, 0] // 10 for frame in draw_frames(performance, greys(10, fps))]
    expected = [min(int(t * fps / 24 + 1e-9), 9) for t in range(12)]
    assert seen == expected


def test_uneven_frames_are_shown_when_they_are_due(performance):
    clip = clip_of(greys(3, 1).__iter__(), times=[0.0, 0.1, 0.35, 0.5])
    assert [backdrop.frame_at(clip, s) for s in (0, 0.0999999, 0.11, 0.34, 0.35, 9)] == [0, 1, 1, 1, 2, 2]


def test_a_picture_of_another_shape_fills_the_page_unbent():
    import cv2

    wide = np.zeros((100, 400, 3), np.uint8)
    cv2.circle(wide, (200, 50), 30, (255, 255, 255), -1)
    seen = backdrop.filling(wide, (160, 120))
    assert seen.shape == (120, 160, 3)
    y, x = np.nonzero(seen[..., 0] > 127)
    assert np.ptp(x) == pytest.approx(np.ptp(y), abs=1) and np.ptp(x) == pytest.approx(60 * 1.2, abs=2)
    assert x.mean() == pytest.approx(79.5, abs=1)


def test_without_any_blend_it_is_the_drawing_over_the_picture(performance):
    rng = np.random.default_rng(0)
    photo = rng.integers(0, 256, (240, 320, 3), dtype=np.uint8)
    ours = next(composite.over(performance, photo)).astype(int)
    assert np.abs(ours - draw(performance, 0, photo)).max() <= 2


def test_softened_edges_are_wider_and_keep_their_place_and_colour(performance):
    sharp = draw(performance, 0)
    soft = composite.softened(sharp, 2.0)
    assert soft[..., 3].sum() == pytest.approx(float(sharp[..., 3].sum()), rel=0.01)
    assert ((soft[..., 3] > 8) & (soft[..., 3] < 247)).sum() > 3 * ((sharp[..., 3] > 8) & (sharp[..., 3] < 247)).sum()
    seen = soft[soft[..., 3] > 8]
    assert (seen[:, 0] >= 253).all() and (seen[:, 1:3] <= 2).all()  # no dark and no pale fringe


def test_matching_goes_towards_the_picture_and_is_one_tone_for_the_shot():
    figure = np.zeros((60, 60, 4), np.uint8)
    figure[10:50, 10:50] = (220, 200, 190, 255)
    dark = np.full((60, 60, 3), (30, 40, 60), np.uint8)
    steps = [composite.toned(figure, composite.tone([(figure, dark)], match))[30, 30, :3] for match in (0, 0.5, 1)]
    assert (steps[0] == figure[30, 30, :3]).all()
    away = [np.abs(step.astype(int) - (30, 40, 60)).sum() for step in steps]
    assert away[0] > away[1] > away[2] > 0
    same = np.full((60, 60, 3), (220, 200, 190), np.uint8)
    kept = composite.toned(figure, composite.tone([(figure, same)], 1.0))[30, 30, :3]
    np.testing.assert_allclose(kept, (220, 200, 190), atol=2)


def test_a_shadow_touches_the_feet_and_parts_from_them_in_a_jump(by_hand):
    maps = by_hand.still(9)
    maps[4, 1, 2] = -60  # up
    motion = by_hand.motion(maps, np.ones((9, 1)), names=("sit",))
    jumper = perform(motion, [outline_drawing("egg", motion.keyset("egg"), RED)])
    paper = np.full((240, 320, 3), 200, np.uint8)
    frames = list(composite.over(jumper, paper, blend=composite.Blend(shadow=0.5)))
    dark = [(frame[..., 1] < 180) & (np.ptp(frame.astype(int), axis=-1) == 0) for frame in frames]
    assert dark[0].any() and frames[0].min(axis=(0, 1))[2] == 0
    feet = [np.argwhere(mask)[:, 0].max() for mask in (dark[0], dark[4])]
    assert feet[0] >= 196 and feet[1] < feet[0] - 8  # (160, 200) is where it stands
    shadow = frames[0][np.nonzero(dark[0])]
    assert shadow.min() >= 95  # half as bright, never darker


def test_a_blend_outside_its_range_is_refused():
    for wrong in ({"match": 1.5}, {"shadow": -0.1}, {"soften": float("nan")}):
        with pytest.raises(InputError, match=f"{next(iter(wrong))} must lie in 0 to"):
            composite.Blend(**wrong)


def test_the_command_lays_a_character_over_a_clip_of_another_rate(performance, worm, by_hand, tmp_path, capsys):
    motion = replace(by_hand.motion(by_hand.still(12), np.ones((12, 1)), names=("sit",)))
    tracks.save(motion, tmp_path / "egg.motion.json")
    write_clip(tmp_path / "sky.mp4", greys(6, 12.0), 12.0)
    asked = ["retarget", str(tmp_path / "egg.motion.json"), "--drawing", str(worm[0]), "-o", str(tmp_path / "out.mp4")]
    assert main([*asked, "--background", str(tmp_path / "sky.mp4"), "--soften", "0.7"]) == 0
    made = read_clip(tmp_path / "out.mp4")
    assert [round(int(frame[0, 0, 0]) / 10) for frame in made] == [t // 2 for t in range(12)]
    assert "its last frame stays" not in capsys.readouterr().err
    write_clip(tmp_path / "short.mp4", greys(3, 12.0), 12.0)
    assert main([*asked, "--background", str(tmp_path / "short.mp4")]) == 0
    assert "it ends after 0.25 s, its last frame stays" in capsys.readouterr().err
    assert main([*asked, "--shadow", "0.5"]) == 2
    assert "add --background" in capsys.readouterr().err
    assert main([*asked, "--background", "nosuch.mp4"]) == 2
    assert "a colour such as white" in capsys.readouterr().err
