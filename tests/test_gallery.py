"""The README's gallery: its pictures are those that `make gallery` makes, small, true in time, and whole."""

import re
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from notebooks.gallery import desks, make, pictures, small

ROOT = Path(__file__).parents[1]
MOVING = pytest.mark.parametrize("shown", pictures.MOVING, ids=lambda shown: shown.name)
LARGEST, ALL = 330_000, 6_000_000  # bytes


def test_the_pictures_that_the_readme_names_are_those_that_are_made_and_kept():
    told = re.findall(r"!\[[^]]*\]\(([^)]+)\)", (ROOT / "README.md").read_text(encoding="utf-8"))
    made = [one.file.relative_to(ROOT).as_posix() for one in pictures.everything()]
    assert sorted(told) == sorted(made) and len(set(made)) == len(made)
    kept = sorted(path.name for path in pictures.HERE.iterdir() if path.suffix in (".gif", ".png"))
    assert kept == sorted(one.file.name for one in pictures.everything())


def test_the_readme_tells_of_them_as_the_table_does(tmp_path):
    copy = tmp_path / "README.md"
    copy.write_bytes((ROOT / "README.md").read_bytes())
    pictures.write_section(copy)
    assert copy.read_text(encoding="utf-8") == (ROOT / "README.md").read_text(encoding="utf-8")


def test_all_of_it_is_small():
    sizes = {one.name: one.file.stat().st_size for one in pictures.everything()}
    assert {name: size for name, size in sizes.items() if size > LARGEST} == {}
    assert sum(sizes.values()) < ALL


@MOVING
def test_it_moves_in_true_time_for_ever(shown):
    waits, loop, _ = _read(shown.file, every=1000)
    edges = np.append(0, np.cumsum(waits))
    wanted = 100 * np.arange(len(waits) + 1) / shown.fps
    wanted[-1] += 100 * shown.hold
    assert len(waits) > 20 and np.abs(edges - wanted).max() <= 0.5 + 1e-9
    assert loop == 0


@MOVING
def test_it_is_as_wide_as_a_thumbnail_may_be_and_keeps_its_palette(shown):
    _, _, frames = _read(shown.file, every=12)
    assert 240 <= frames[0].shape[1] <= 480
    seen = {colour for frame in frames for colour in np.unique(frame.astype(int) @ (1, 256, 65536)).tolist()}
    assert 4 < len(seen) <= shown.colours


def test_what_is_drawn_again_is_the_same(tmp_path):
    """The cheapest that has a command: it is made twice, as `make gallery` makes it, and once it was kept."""
    shown = next(one for one in pictures.MOVING if one.name == "analogy")
    files = [tmp_path / room / shown.file.name for room in ("one", "two")]
    for file in files:
        file.parent.mkdir()
        assert make.make([shown], file.parent, file.parent) == 1
    assert files[0].read_bytes() == files[1].read_bytes()
    (kept_waits, _, kept), (waits, _, drawn) = _read(shown.file), _read(files[0])
    assert kept_waits == waits and np.abs(np.stack(kept).astype(int) - np.stack(drawn)).mean() < 1


def test_a_name_that_nothing_has_is_refused_and_told_in_one_sentence(capsys):
    assert make.main(["sunset"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "sunset" in said and "analogy" in said


def test_without_a_browser_the_desks_stay_as_they_are_and_it_is_said(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(desks, "BROWSERS", ())
    still = tmp_path / "desk_stage.png"
    still.write_bytes(b"as it was")
    assert desks.photograph({"desk_stage": still}, tmp_path) == 0
    assert still.read_bytes() == b"as it was" and "no Chromium" in capsys.readouterr().out


def test_noise_settles_and_what_moves_does_not():
    rng = np.random.default_rng(3)
    true = np.full((30, 40, 60, 3), 200, np.uint8)
    for t in range(30):
        true[t, 10:20, t : t + 12] = (40, 60, 160)
    seen = [(frame + rng.integers(-4, 5, frame.shape)).clip(0, 255).astype(np.uint8) for frame in true]
    made = np.stack(small.few(seen, 8))
    still = made[:, 25:]
    assert (still == still[0]).all()
    assert np.abs(made.astype(int) - true).max() <= 16
    assert all((one != other).any() for one, other in pairwise(made))


def test_a_clip_is_cut_to_what_moves_with_room_around_it():
    frames = [np.full((60, 100, 3), 250, np.uint8) for _ in range(5)]
    for t, frame in enumerate(frames):
        frame[20:30, 30 + 5 * t : 40 + 5 * t] = 0
    assert small.moving(frames) == (30, 20, 60, 30)
    (cut,) = small.cut([frames])
    assert cut[0].shape == (18, 38, 3) and (cut[0][[0, -1]] == 250).all() and (cut[4][:, [0, -1]] == 250).all()


def _read(file, every=1):
    """How long each frame of a GIF is shown, in hundredths of a second; how often it plays; and every so many frames."""
    waits, frames = [], []
    with Image.open(file) as image:
        loop = image.info["loop"]
        for t in range(image.n_frames):
            image.seek(t)
            waits.append(round(image.info["duration"] / 10))
            if t % every == 0:
                frames.append(np.asarray(image.convert("RGB")))
    return waits, loop, frames
