"""Lottie files by the format's own rules, read with no player: what players of other families stumble over."""

import json
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from capture.errors import InputError
from retarget.characters.drawings.drawing import read_drawing
from retarget.characters.photos.picture import read_picture
from retarget.export.lottie import write_lottie
from retarget.stage.perform import perform


def animated(thing):
    """All properties of a Lottie file that have key frames."""
    if isinstance(thing, dict):
        if thing.get("a") == 1 and isinstance(thing.get("k"), list):
            yield thing["k"]
        for value in thing.values():
            yield from animated(value)
    elif isinstance(thing, list):
        for value in thing:
            yield from animated(value)


def acting(by_hand, worm, frames=9, at=None):
    weights = np.column_stack([1 - np.linspace(0, 1.3, frames), np.linspace(0, 1.3, frames)])
    at = np.arange(frames) if at is None else at
    motion = by_hand.motion(by_hand.tumble(frames)[at], weights[at])
    return perform(motion, [read_drawing("egg", by_hand.names, worm)])


def written(performance, path, **more):
    write_lottie(performance, path, **more)
    return json.loads(path.read_text(encoding="utf-8"))


def test_every_key_frame_has_as_many_vertices_and_the_last_has_no_way_out(tmp_path, by_hand, worm):
    content = written(acting(by_hand, worm), tmp_path / "worm.json")
    curves = list(animated(content))
    assert len(curves) > 5
    for curve in curves:
        times = [key["t"] for key in curve]
        assert times == sorted(set(times)) and times[0] == 0
        assert not {"i", "o", "h"} & set(curve[-1])
        assert all(("i" in key and "o" in key) or key.get("h") == 1 for key in curve[:-1])
        if isinstance(curve[0]["s"][0], dict):
            counts = {(len(key["s"][0]["v"]), len(key["s"][0]["i"]), len(key["s"][0]["o"])) for key in curve}
            assert len(counts) == 1


def test_held_drawings_are_holds_and_cost_one_key_frame(tmp_path, by_hand, worm):
    on_twos = written(acting(by_hand, worm, at=np.arange(9) // 2 * 2), tmp_path / "twos.json")
    for curve in animated(on_twos):
        assert all(key.get("h") == 1 for key in curve[:-1])
        assert {key["t"] for key in curve} <= {0, 2, 4, 6, 8}
    # on ones, a pause in the middle is held too: it may not drift
    paused = written(acting(by_hand, worm, 12, np.array([0, 1, 2, 3, 4, 4, 4, 4, 5, 6, 7, 8])), tmp_path / "ones.json")
    shapes = [curve for curve in animated(paused) if isinstance(curve[0]["s"][0], dict)]
    for curve in shapes:
        assert {key["t"]: key.get("h", 0) for key in curve[:-1]}[4] == 1
        assert {5, 6} & {key["t"] for key in curve} == set()


def test_a_drawing_that_does_not_move_has_no_key_frames_and_times_follow_the_clip(tmp_path, by_hand, worm):
    still = perform(by_hand.motion(by_hand.still(5), [[1.0]] * 5), [read_drawing("egg", by_hand.names, worm)])
    content = written(still, tmp_path / "still.json")
    assert list(animated(content)) == [] and (content["fr"], content["op"]) == (24, 5)
    moving = acting(by_hand, worm, 4)
    uneven = replace(moving, times=np.array([2, 3, 5, 9]) / 24)
    content = written(uneven, tmp_path / "uneven.json")
    assert {key["t"] for curve in animated(content) for key in curve} == {0, 1, 3, 7} and content["op"] == 8


def test_a_width_enlarges_the_page_with_everything_on_it(tmp_path, by_hand, worm):
    small = written(acting(by_hand, worm), tmp_path / "small.json")
    large = written(acting(by_hand, worm), tmp_path / "large.json", width=640, background="#fed")
    assert (small["w"], small["h"], large["w"], large["h"]) == (320, 240, 640, 480)
    assert large["layers"][-1]["sc"] == "#ffeedd"
    for one, two in zip(animated(small), animated(large), strict=True):
        if isinstance(one[0]["s"][0], dict):
            for here, there in zip(one, two, strict=True):
                np.testing.assert_allclose(2 * np.array(here["s"][0]["v"]), there["s"][0]["v"], atol=0.016)


def test_a_picture_or_a_picture_behind_is_refused_and_leaves_nothing(tmp_path, by_hand, worm):
    (tmp_path / "out").mkdir()
    Image.new("RGB", (200, 200)).save(tmp_path / "one.png")
    square = np.array([(20, 20), (180, 20), (180, 180), (20, 180)], float)
    bent = square + [[50, 0], [0, 0], [0, 0], [0, 0]]
    photo = read_picture("egg", by_hand.names, [tmp_path / "one.png"] * 2, [square, bent])
    performance = perform(by_hand.motion(by_hand.still(2), [[1.0, 0], [0, 1.0]]), [photo])
    with pytest.raises(InputError, match=r"part 'egg': a Lottie file can hold vector drawings"):
        write_lottie(performance, tmp_path / "out" / "a.json")
    performance = acting(by_hand, worm)
    for behind in (np.zeros((9, 9, 3), np.uint8), "no colour"):
        with pytest.raises(InputError, match="can have a colour behind it"):
            write_lottie(performance, tmp_path / "out" / "a.json", background=behind)
    with pytest.raises(InputError, match="at least 1 pixel"):
        write_lottie(performance, tmp_path / "out" / "a.json", width=0)
    with pytest.raises(InputError, match="somebody who plays"):
        write_lottie(replace(performance, roles=()), tmp_path / "out" / "a.json")
    assert list((tmp_path / "out").iterdir()) == []
