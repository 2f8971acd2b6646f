"""An interrupted capture goes on from its file to the very same motion; a file that does not fit is passed over."""

import signal
import subprocess
import sys
from dataclasses import fields, replace
from pathlib import Path
from time import monotonic, sleep

import numpy as np
import pytest

from capture.fit import checkpoint, video
from capture.fit.checkpoint import keep_of
from capture.fit.pixels.find import Pose, Sighting
from capture.motion.tracks import CartoonMotion
from capture.pictures.clip import Clip, clip_of
from capture.pictures.encode import write_clip
from capture.pictures.matte import ColorModel
from capture.pictures.shot import KeyDrawing, Part, Shot, read_shot, write_shot
from fixtures import ball, hat, write


def same(one: CartoonMotion, other: CartoonMotion) -> bool:
    """Whether two motions are the same to the last bit."""
    pairs = [pair for kind in ("tracks", "keysets") for pair in zip(getattr(one, kind), getattr(other, kind))]
    return all(
        np.array_equal(getattr(a, field.name), getattr(b, field.name)) for a, b in pairs for field in fields(a)
    ) and np.array_equal(one.times, other.times)


def failing(clip: Clip, at: int, after: int = 0) -> Clip:
    """The clip, but frame `at` does not come once `after` has been asked for."""
    asked = []

    def fetch(i: int) -> np.ndarray:
        asked.append(i)
        if i == at and after in asked:
            raise RuntimeError("the disk was unplugged")
        return clip[i]

    return replace(clip, _fetch=fetch)


@pytest.fixture(scope="module")
def toon_and_shot() -> tuple[Clip, Shot]:
    """The hat that bends, 11 frames, from two keys in the middle: there is a way forwards and one backwards."""
    toon = hat.hat(busy=True, noise=3.0)
    truth, frames = toon.parts[0], range(8, 19)
    keys = [
        KeyDrawing(name, frame - 8, tuple(map(tuple, truth.points[frame].tolist())))
        for name, frame in (("leaving", 17), ("bent", 10))
    ]
    return clip_of([toon.frame(t) for t in frames]), Shot("hat", (Part("hat", tuple(keys)),))


def test_a_capture_that_was_interrupted_is_the_same_to_the_last_bit(toon_and_shot, tmp_path: Path, capsys):
    clip, shot = toon_and_shot
    path = tmp_path / "hat.motion.json.part"
    whole = video.capture(shot, clip)
    with pytest.raises(RuntimeError, match="unplugged"):
        video.capture(shot, failing(clip, 6, after=5), keep=path)
    again = video.capture(shot, clip, keep=path)
    assert "goes on from frame 6" in capsys.readouterr().err
    assert same(whole, again)
    assert list(tmp_path.iterdir()) == []


SLOWLY = """
import sys, time
from capture.fit import passes, video
from capture.pictures.shot import read_shot
passes.KEPT_EVERY, find = 0, passes.finding.find
passes.finding.find = lambda *given: time.sleep(0.1) or find(*given)
video.capture(read_shot(sys.argv[1]), keep=sys.argv[2])
"""


def test_a_capture_that_was_killed_goes_on_to_the_same_motion(tmp_path: Path, capsys):
    toon, kept = ball.ball(noise=2.0), tmp_path / "ball.part"
    write_clip(tmp_path / "ball.mp4", [toon.frame(t) for t in range(24)])
    shot_file = tmp_path / "ball.shot.toml"
    write_shot(replace(write.shot_of(toon), clip=str(tmp_path / "ball.mp4")), shot_file)
    running = subprocess.Popen([sys.executable, "-c", SLOWLY, shot_file, kept], cwd=Path(__file__).parents[2])
    until = monotonic() + 60
    while not kept.exists() and monotonic() < until:
        sleep(0.02)
    sleep(0.4)
    running.kill()
    assert running.wait() == (1 if sys.platform == "win32" else -signal.SIGKILL)
    shot = read_shot(shot_file)
    again = video.capture(shot, keep=kept)
    assert "goes on from frame" in capsys.readouterr().err
    assert not kept.exists()
    assert same(video.capture(shot), again)


@pytest.mark.parametrize("how", ["another shot", "another clip", "cut short", "no such thing", "not ours"])
def test_a_file_that_does_not_fit_is_passed_over_with_a_sentence(
    toon_and_shot, tmp_path: Path, capsys, monkeypatch, how: str
):
    clip, shot = toon_and_shot
    path, state = tmp_path / "x.part", Pose(np.eye(2, 3), np.zeros(0))
    keep_of(path, shot, clip).write(state, [])
    if how == "another shot":
        shot = replace(shot, parts=(replace(shot.parts[0], order=1),))
    elif how == "another clip":
        clip = replace(clip, _fetch=lambda i, fetch=clip._fetch: 255 - fetch(i))
    elif how == "cut short":
        path.write_bytes(path.read_bytes()[:-40])
    elif how == "no such thing":
        keep_of(path, shot, clip).write(shot, [])  # what it names must be ours, and be there
        monkeypatch.delattr("capture.pictures.shot.KeyDrawing")
    else:
        path.write_text("a letter")
    assert keep_of(path, shot, clip).read([]) is None
    (line,) = capsys.readouterr().err.splitlines()
    assert "left from another shot, clip or version and is not used" in line


def test_a_file_of_the_clip_that_was_changed_is_another_clip(tmp_path: Path):
    toon = ball.ball()
    shot = replace(write.shot_of(toon), clip=str(tmp_path / "ball.mp4"))
    fits = []
    for noise in (0.0, 4.0):
        write_clip(tmp_path / "ball.mp4", [ball.ball(noise=noise).frame(t) for t in range(3)])
        fits.append(keep_of(tmp_path / "x", shot, video.open_clip(shot)).fits)
    assert fits[0] != fits[1] == keep_of(tmp_path / "x", shot, video.open_clip(shot)).fits


def test_what_is_kept_comes_back_as_it_was(tmp_path: Path):
    rng, model = np.random.default_rng(0), object()
    picture = rng.integers(0, 255, (9, 8, 3)).astype(np.uint8)
    tables = [rng.random((4, 4, 4)).astype(np.float32) for _ in range(2)]
    pose = Pose(rng.random((2, 3)), np.zeros(0), np.float32(0.1), 1 / 3, np.bool_(False), True)
    one = Sighting(model, ColorModel(*tables), pose, (0.1, float("inf")), picture)
    packed: list = []
    tree = checkpoint._packed([one, one, {"a": None}], [model], packed)
    assert sum(array is picture for array in packed) == 1
    back, twin, rest = checkpoint._built(tree, [model], {str(n): array for n, array in enumerate(packed)}, {})
    assert back.model is model and rest == {"a": None} and back.drawn is twin.drawn
    assert back.misfits == one.misfits and back.colors.inside.dtype == np.float32
    for field in fields(Pose):
        given, got = getattr(pose, field.name), getattr(back.pose, field.name)
        assert type(given) is type(got) and np.array_equal(given, got)


def test_nothing_but_our_own_kinds_of_things_is_built():
    for module, name in (("os", "system"), ("capture.pictures.decode", "read_clip"), ("subprocess", "Popen")):
        with pytest.raises(ValueError, match="no kind of thing"):
            checkpoint._built({"of": [module, name], "fields": {}}, [], {}, {})
