"""Posing a figure, as a user does it."""

import numpy as np
import pytest
from PIL import Image

from fixtures import skeletons
from mocap.skeletons.bvh import read_bvh, write_bvh
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion
from mocap.skeletons.units import upright
from retarget.characters.figures.skin import Pose, read_skin, skinned
from retarget.characters.models.meshfiles import read_model
from retarget.cli import main

KICK = skeletons.kick(seconds=2.0, fps=30.0)


@pytest.fixture
def clip(tmp_path):
    """A kick in metres."""
    skeleton = Skeleton(KICK.names, KICK.parents, KICK.offsets)
    write_bvh(SkeletonMotion(skeleton, KICK.translation, KICK.rotation, KICK.fps), tmp_path / "kick.bvh")
    return tmp_path / "kick.bvh"


def test_a_hand_is_dragged_to_a_place_while_a_foot_stays(clip, tmp_path, capsys):
    out = tmp_path / "pose.bvh"
    asked = ["--drag", "RightHand -0.2 1.5 0.3", "--pin", "LeftFoot", "--pin", "rightfoot", "-o", str(out)]
    assert main(["mocap", "pose", str(clip), "--frame", "40", *asked]) == 0
    assert "pose.bvh: 1 drag, Right" in capsys.readouterr().out
    made = upright(read_bvh(out))
    places = dict(zip(made.skeleton.names, made.positions()[0]))
    np.testing.assert_allclose(places["RightHand"], [-0.2, 1.5, 0.3], atol=5e-3)
    np.testing.assert_allclose(places["LeftFoot"], KICK.positions[40, KICK.joint("LeftFoot")], atol=1e-4)


def test_drags_by_a_way_begin_where_the_joint_is(clip, tmp_path):
    out = tmp_path / "pose.bvh"
    assert main(["mocap", "pose", str(clip), "--by", "Head 0.1 -0.2 0.1", "--pin", "Hips", "-o", str(out)]) == 0
    made = upright(read_bvh(out))
    head = made.positions()[0, made.skeleton.names.index("Head")]
    np.testing.assert_allclose(head, KICK.positions[0, KICK.joint("Head")] + [0.1, -0.2, 0.1], atol=5e-3)


def test_who_is_dragged_out_of_reach_is_told_how_far(clip, tmp_path, capsys):
    asked = ["--drag", "RightHand 0 9 0", "--pin", "LeftFoot", "-o", str(tmp_path / "pose.bvh")]
    assert main(["mocap", "pose", str(clip), *asked]) == 0
    assert "m short of where it was dragged" in capsys.readouterr().out


def test_a_picture_of_the_pose_shows_it(clip, tmp_path):
    pictures = []
    for name, height in (("low", "0.4"), ("high", "1.8")):
        asked = ["--drag", f"RightHand -0.3 {height} 0.3", "--pin", "LeftFoot", "-o", str(tmp_path / f"{name}.png")]
        assert main(["mocap", "pose", str(clip), *asked]) == 0
        pictures.append(np.asarray(Image.open(tmp_path / f"{name}.png"), int))
    assert pictures[0].shape == (480, 480, 3) and np.abs(pictures[0] - pictures[1]).max() > 50


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        (["--drag", "Nose 0 1 0"], "there is no 'Nose'"),
        (["--drag", "Head 0 1"], "must be a joint and three numbers"),
        (["--drag", "Head 0 1 up"], "must be a joint and three numbers"),
        (["--drag", "Head inf 1 0"], "must be dragged to a place"),
        (["--pin", "Head", "--drag", "Head 0 1 0"], "is pinned and cannot be dragged"),
        (["--frame", "999"], "a frame to pose must be 0 to 59"),
        (["-o", "pose.obj"], "is written as .bvh, .glb or .png"),
    ],
)
def test_what_cannot_be_posed_is_refused_and_nothing_is_written(clip, asked, said, capsys):
    assert main(["mocap", "pose", str(clip), *asked]) == 2
    assert said in capsys.readouterr().err
    assert [path.name for path in clip.parent.iterdir()] == ["kick.bvh"]


def test_a_pose_in_a_3d_file_stands_as_it_was_posed(clip, tmp_path):
    asked = ["--drag", "RightHand -0.4 1.8 0.5", "--pin", "LeftFoot"]
    for name in ("pose.glb", "pose.bvh"):
        assert main(["mocap", "pose", str(clip), *asked, "-o", str(tmp_path / name)]) == 0
    skin, model = read_skin(tmp_path / "pose.glb"), read_model(tmp_path / "pose.glb")
    points = skinned(skin, model.points, Pose(*(part[None] for part in vars(skin.rest).values())))[0]
    joints = upright(read_bvh(tmp_path / "pose.bvh")).positions()[0]
    away = np.linalg.norm(points[:, None] - joints[None], axis=-1).min(axis=0)
    assert away.max() < 0.15  # metres: every joint is inside the figure, near its surface
