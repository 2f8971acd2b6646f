"""The commands for motion capture, as a user runs them."""

import numpy as np
import pytest

from fixtures import skeletons
from mocap.skeletons.bvh import write_bvh
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion
from retarget.cli import main

WALK = skeletons.walk(seconds=2.0, fps=30.0)


@pytest.fixture
def clip(tmp_path):
    """A walk in centimetres."""
    skeleton = Skeleton(WALK.names, WALK.parents, 100 * WALK.offsets)
    write_bvh(SkeletonMotion(skeleton, 100 * WALK.translation, WALK.rotation, WALK.fps), tmp_path / "walk.bvh")
    return tmp_path / "walk.bvh"


def test_a_report_says_what_is_what_and_how_clean_it_is(clip, capsys):
    assert main(["mocap", "report", str(clip)]) == 0
    said = capsys.readouterr()
    assert "left leg   LeftUpLeg, LeftLeg, LeftFoot, LeftToeBase" in said.out
    assert "60 frames at 30 a second, 31 joints and ends, 1.71 m tall" in said.out and "skating 0.0 cm/s" in said.out
    assert "in centimetres: the figure is 1.71 m tall" in said.err


def test_what_was_made_is_held_against_what_it_was_made_of(clip, tmp_path, capsys):
    """The same walk in metres, twice as wide apart at the hips: longer links, feet where they were."""
    wide = WALK.translation.copy()
    wide[:, [WALK.joint("LeftUpLeg"), WALK.joint("RightUpLeg")]] *= 2
    skeleton = Skeleton(WALK.names, WALK.parents, WALK.offsets)
    write_bvh(SkeletonMotion(skeleton, wide, WALK.rotation, WALK.fps), tmp_path / "made.bvh")
    assert main(["mocap", "report", str(clip), str(tmp_path / "made.bvh")]) == 0
    said = capsys.readouterr().out
    assert "1.00 to 2.00 times as long as at rest" in said and "contacts  100 % kept" in said


def test_another_motion_is_refused(clip, tmp_path, capsys):
    still = np.tile([0, 0, 0, 1.0], (60, 1, 1))
    short = SkeletonMotion(Skeleton(("hip",), (-1,), np.zeros((1, 3))), np.ones((60, 1, 3)), still, 30.0)
    write_bvh(short, tmp_path / "other.bvh")
    assert main(["mocap", "report", str(clip), str(tmp_path / "other.bvh")]) == 2
    assert "must have the joints and as many frames" in capsys.readouterr().err


def test_a_clip_without_a_rate_is_given_one(clip, capsys):
    text = clip.read_text().replace("Frame Time: 0.0333333333333", "Frame Time: 0")
    clip.write_text(text)
    assert main(["mocap", "report", str(clip), "--strict"]) == 2
    assert "Frame Time is 0" in capsys.readouterr().err
    assert main(["mocap", "report", str(clip), "--fps", "30", "--strict"]) == 0
    assert "60 frames at 30 a second" in capsys.readouterr().out
