"""Analogies as a user makes them: files in, a file out, a line that says what came of it."""

import inspect
import re
from dataclasses import replace

import numpy as np
import pytest

from capture.motion import keys, tracks
from capture.motion.tracks import CartoonMotion, Track
from capture.pictures.decode import read_clip
from fixtures import skeletons
from mocap.skeletons.bvh import read_bvh, write_bvh
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion
from retarget.cli import main
from retarget.commands import analogies


def figure(made, unit=100.0):
    skeleton = Skeleton(made.names, made.parents, unit * made.offsets)
    return SkeletonMotion(skeleton, unit * made.translation, made.rotation, made.fps)


def bent(motion, angle):
    """The motion with its back bent by so much."""
    from scipy.spatial.transform import Rotation

    spine = motion.skeleton.names.index("Spine1")
    rotation = motion.rotation.copy()
    rotation[:, spine] = (Rotation.from_rotvec([angle, 0, 0]) * Rotation.from_quat(rotation[:, spine])).as_quat()
    return replace(motion, rotation=rotation)


@pytest.fixture
def files(tmp_path):
    """A walk, the walk bent forward, and a kick, in centimetres."""
    walk, kick = figure(skeletons.walk(seconds=2.0, fps=30.0)), figure(skeletons.kick(seconds=2.5, fps=30.0))
    for name, motion in (("walk", walk), ("bent", bent(walk, 0.5)), ("kick", kick)):
        write_bvh(motion, tmp_path / f"{name}.bvh")
    return tmp_path


def run(*words):
    return main(["mocap", "analogy", *map(str, words)])


def spine(path):
    motion = read_bvh(path)
    return 2 * np.arcsin(motion.rotation[:, motion.skeleton.names.index("Spine1"), 0])


def test_what_bends_a_walk_bends_a_kick(files, capsys):
    assert run(files / "walk.bvh", files / "bent.bvh", files / "kick.bvh", "-o", files / "made.bvh") == 0
    said = capsys.readouterr()
    assert "75 frames, 2.50 s (B: 75 frames, 2.50 s)" in said.out and "24 of B's 24 joints are matched" in said.out
    assert "feet slide" in said.out
    np.testing.assert_allclose(spine(files / "made.bvh") - spine(files / "kick.bvh"), 0.5, atol=0.02)
    before, after = (read_bvh(files / name) for name in ("kick.bvh", "made.bvh"))
    np.testing.assert_allclose(after.skeleton.offsets, before.skeleton.offsets, atol=1e-6)  # in B's unit


def test_half_the_style_and_one_part_of_the_body(files):
    run(files / "walk.bvh", files / "bent.bvh", files / "kick.bvh", "-o", files / "half.bvh", "--style", "0.5")
    np.testing.assert_allclose(spine(files / "half.bvh") - spine(files / "kick.bvh"), 0.25, atol=0.02)
    only = ("--only", "arms", "--only", "left leg")
    run(files / "walk.bvh", files / "bent.bvh", files / "kick.bvh", "-o", files / "legs.bvh", *only)
    np.testing.assert_allclose(spine(files / "legs.bvh"), spine(files / "kick.bvh"), atol=1e-6)


def test_pairs_are_done_one_after_the_other(files):
    pair = (files / "walk.bvh", files / "bent.bvh")
    assert run(*pair, *pair, files / "kick.bvh", "-o", files / "twice.bvh") == 0
    np.testing.assert_allclose(spine(files / "twice.bvh") - spine(files / "kick.bvh"), 1.0, atol=0.04)


def test_a_folder_is_done_file_by_file_and_one_that_fails_is_told(files, capsys):
    folder = files / "many"
    folder.mkdir()
    for name in ("kick", "walk"):
        (folder / f"{name}.bvh").write_bytes((files / f"{name}.bvh").read_bytes())
    (folder / "broken.bvh").write_text("no motion")
    assert run(files / "walk.bvh", files / "bent.bvh", folder, "-o", files / "out") == 1
    said = capsys.readouterr()
    assert len(said.out.splitlines()) == 3 and "broken.bvh: failed" in said.out
    assert "2 of 3 motions made, 1 failed: broken.bvh" in said.err
    np.testing.assert_allclose(spine(files / "out" / "kick.bvh") - spine(files / "kick.bvh"), 0.5, atol=0.02)


def test_a_film_of_a_stick_figure(files):
    assert run(files / "walk.bvh", files / "bent.bvh", files / "kick.bvh", "-o", files / "made.gif") == 0
    clip = read_clip(files / "made.gif")
    assert len(clip) == 75 and np.ptp(np.asarray(clip[40])[..., :3]) > 100


def test_this_bounces_like_that(tmp_path, capsys):
    for name, motion in (("a", _ball(100)), ("a2", _ball(180)), ("b", _ball(60, "sack"))):
        tracks.save(motion, tmp_path / f"{name}.motion.json")
    words = [tmp_path / f"{name}.motion.json" for name in ("a", "a2", "b")]
    assert run(*words, "-o", tmp_path / "made.motion.json") == 0
    assert "1 of B's 1 parts are matched" in capsys.readouterr().out
    made = tracks.load(tmp_path / "made.motion.json")
    assert -made.track("sack").affine[:, 1, 2].min() == pytest.approx(108, rel=0.05)
    assert run(*words) == 0 and (tmp_path / "b.analogy.motion.json").exists()


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("walk.bvh", "bent.bvh"), "needs A, A' and B"),
        (("walk.bvh", "bent.bvh", "kick.bvh", "walk.bvh"), "given 4 motions"),
        (("walk.bvh", "bent.bvh", "none.bvh"), "there is no"),
        (("walk.bvh", "bent.bvh", "kick.txt"), "is neither"),
        (("walk.bvh", "bent.bvh", "ball.motion.json"), "of one kind"),
        (("walk.bvh", "bent.bvh", "kick.bvh", "-o", "made.txt"), "must be written as .bvh or .mp4"),
        (("walk.bvh", "bent.bvh", "kick.bvh", "-o", "kick.bvh"), "must not replace"),
        (("walk.bvh", "bent.bvh", "kick.bvh", "--only", "wings"), "wings is none"),
        (("walk.bvh", "bent.bvh", "kick.bvh", "--style", "-1"), "style, keep and free must be 0 or more"),
        (("walk.bvh", "one.bvh", "kick.bvh"), "A' must have two frames or more, it has 1"),
        (("long.bvh", "long.bvh", "kick.bvh", "--once"), "3 times as long .* 600 and 75 frames"),
        (("walk.bvh", "star.bvh", "kick.bvh"), "same names or limbs"),
        (("walk.bvh", "bent.bvh", "empty"), "has none"),
    ],
)
def test_bad_input_is_said_in_a_sentence(files, capsys, monkeypatch, words, told):

    monkeypatch.chdir(files)
    write_bvh(figure(skeletons.walk(seconds=2.0, fps=30.0)).part(0, 1), files / "one.bvh")
    write_bvh(figure(skeletons.walk(seconds=20.0, fps=30.0)), files / "long.bvh")
    star = Skeleton(("hub", "ray", "beam", "spoke"), (-1, 0, 0, 0), 100 * np.eye(4, 3))
    still = np.tile([0, 0, 0, 1.0], (60, 4, 1))
    write_bvh(SkeletonMotion(star, np.tile(star.offsets, (60, 1, 1)), still, 30.0), files / "star.bvh")
    tracks.save(_ball(50), files / "ball.motion.json")
    (files / "empty").mkdir()
    there = {path: path.read_bytes() for path in files.iterdir() if path.is_file()}
    assert run(*words) == 2
    said = capsys.readouterr().err.splitlines()[-1]
    assert re.search(told, said), said
    assert {path: path.read_bytes() for path in files.iterdir() if path.is_file()} == there


def _ball(height, name="ball"):
    """A ball that bounces three times."""
    circle = 20 * np.stack([[np.cos(a), np.sin(a)] for a in np.linspace(0, 2 * np.pi, 24, endpoint=False)])
    keyset = keys.keyset(("round",), circle[None] + 100, spacing=12.0)
    t = np.linspace(0, 1, 97)
    maps = np.tile([[1.0, 0, 0], [0, 1, 0]], (97, 1, 1))
    maps[:, 0, 2], maps[:, 1, 2] = 200 * t, -height * np.abs(np.sin(3 * np.pi * t))
    still = {"residual": np.zeros(97), "visible": np.ones(97, bool), "held": np.zeros(97, bool)}
    pivot, order = np.array([100.0, 100.0]), np.zeros(97, int)
    track = Track(name, "", pivot, keyset.names, keyset.rows, maps, np.ones((97, 1)), **still, order=order)
    return CartoonMotion((track,), (replace(keyset),), np.arange(97) / 24, 24.0, (640, 480))


def test_the_commands_defaults_are_the_functions():
    from mocap.analogy.analogy import ALL

    told = inspect.signature(analogies.analogy).parameters
    assert all(told[name].default == getattr(ALL, name) for name in ("style", "keep", "only", "on", "free", "slope"))
