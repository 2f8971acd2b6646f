"""The command that makes motion capture rubber, on a figure written to a BVH file."""

import numpy as np
import pytest

from fixtures import skeletons
from mocap.bvh import read_bvh, write_bvh
from mocap.skeleton import Skeleton, SkeletonMotion
from retarget import cli


@pytest.fixture(scope="module")
def kick(tmp_path_factory):
    path = tmp_path_factory.mktemp("mocap") / "kick.bvh"
    figure = skeletons.kick(2.0, 30.0)
    skeleton = Skeleton(figure.names, figure.parents, figure.offsets)
    write_bvh(SkeletonMotion(skeleton, figure.translation, figure.rotation, figure.fps), path)
    return path


def test_a_bvh_goes_in_and_one_with_sub_joints_comes_out(kick, tmp_path, capsys):
    out = tmp_path / "rubber.bvh"
    assert cli.main(["mocap", "exaggerate", str(kick), "-o", str(out)]) == 0
    said = capsys.readouterr().out
    plain, made = read_bvh(kick), read_bvh(out)
    assert str(out) in said and f"{len(plain)} frames" in said and "cm/s" in said
    assert set(plain.skeleton.names) <= set(made.skeleton.names) and len(made) == len(plain)
    order = [made.skeleton.names.index(name) for name in plain.skeleton.names]
    away = np.linalg.norm(made.positions()[:, order] - plain.positions(), axis=-1)
    assert 0.04 < away.max() < 2


def test_omega_1_without_springs_gives_the_captured_joints_back(kick, tmp_path):
    out = tmp_path / "same.bvh"
    assert cli.main(["mocap", "exaggerate", str(kick), "-o", str(out), "--omega", "1", "--follow", "0"]) == 0
    plain, made = read_bvh(kick), read_bvh(out)
    order = [made.skeleton.names.index(name) for name in plain.skeleton.names]
    np.testing.assert_allclose(made.positions()[:, order], plain.positions(), atol=1e-4)


def test_stick_figures_before_and_after_are_drawn(kick, tmp_path):
    assert cli.main(["mocap", "exaggerate", str(kick), "-o", str(tmp_path / "sticks"), "--slide"]) == 0
    assert (tmp_path / "sticks" / "0000.png").exists()


def test_a_part_has_an_amount_of_its_own(kick, tmp_path, capsys):
    out = tmp_path / "part.bvh"
    arm = ["--part", "left arm=1", "--part", "right arm=1", "--omega", "4", "--follow", "0", "--slide", "--squash", "0"]
    assert cli.main(["mocap", "exaggerate", str(kick), "-o", str(out), *arm, "--hose", "0"]) == 0
    plain, made = read_bvh(kick), read_bvh(out)
    ends = [name for name in plain.skeleton.names if "hand" in name.lower() or "forearm" in name.lower()]
    assert ends
    for name in ends:
        here, there = plain.skeleton.names.index(name), made.skeleton.names.index(name)
        above = plain.skeleton.names[plain.skeleton.parents[here]]
        was = np.diff(plain.positions()[:, [plain.skeleton.names.index(above), here]], axis=1)
        now = np.diff(made.positions()[:, [made.skeleton.names.index(above), there]], axis=1)
        np.testing.assert_allclose(now, was, atol=1e-4)


@pytest.mark.parametrize("said", ["left paw=2", "left arm", "left arm=much"])
def test_a_part_that_is_none_is_refused_with_those_there_are(kick, said, capsys):
    assert cli.main(["mocap", "exaggerate", str(kick), "--part", said]) == 2
    assert "spine" in capsys.readouterr().err
