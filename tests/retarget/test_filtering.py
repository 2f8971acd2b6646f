"""The command that gives motion capture anticipation and follow-through."""

import numpy as np
import pytest

from fixtures import skeletons
from mocap.skeletons.bvh import read_bvh, write_bvh
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion
from retarget import cli


@pytest.fixture(scope="module")
def kick(tmp_path_factory):
    path = tmp_path_factory.mktemp("mocap") / "kick.bvh"
    figure = skeletons.kick(3.0, 30.0)
    skeleton = Skeleton(figure.names, figure.parents, figure.offsets)
    write_bvh(SkeletonMotion(skeleton, figure.translation, figure.rotation, figure.fps), path)
    return path


def played(kick, out, *options):
    assert cli.main(["mocap", "anticipate", str(kick), "-o", str(out), *options]) == 0
    return read_bvh(kick), read_bvh(out)


def test_a_kick_goes_higher_and_no_bone_stretches(kick, tmp_path, capsys):
    plain, made = played(kick, tmp_path / "out.bvh", "--follow", "0", "--amount", "0.7")
    assert "bones as long" in capsys.readouterr().out and made.skeleton.names == plain.skeleton.names
    foot = plain.skeleton.names.index("RightFoot")
    assert made.positions()[:, foot, 1].max() > plain.positions()[:, foot, 1].max() + 0.05
    np.testing.assert_allclose(
        np.linalg.norm(made.translation[:, 1:], axis=-1), np.linalg.norm(plain.translation[:, 1:], axis=-1), atol=1e-6
    )


def test_the_foot_that_stands_stays_unless_it_may_slide(kick, tmp_path):
    plain, made = played(kick, tmp_path / "out.bvh")
    toes = [plain.skeleton.names.index(f"{side}ToeBase") for side in ("Left", "Right")]
    before = slice(0, round((skeletons.KICK[0] - 0.05) * 30))  # both feet stand
    there = plain.positions()[before, toes]
    np.testing.assert_allclose(made.positions()[before, toes], there, atol=2e-3)
    _, slid = played(kick, tmp_path / "slid.bvh", "--slide")
    assert np.abs(slid.positions()[before, toes] - there).max() > 0.02


def test_filtered_places_stretch_links(kick, tmp_path, capsys):
    _, made = played(kick, tmp_path / "out.bvh", "--places", "--amount", "2")
    assert "times as long" in capsys.readouterr().out
    names = [made.skeleton.names.index(name) for name in ("RightLeg", "RightFoot")]
    long = np.linalg.norm(np.diff(made.positions()[:, names], axis=1), axis=-1)
    assert long.max() > 1.05 * skeletons.SHANK and np.isfinite(long).all()


def test_nothing_asked_for_changes_nothing(kick, tmp_path):
    for options in ((), ("--places",)):
        plain, made = played(kick, tmp_path / "out.bvh", "--amount", "0", "--slide", *options)
        order = [made.skeleton.names.index(name) for name in plain.skeleton.names]
        np.testing.assert_allclose(made.positions()[:, order], plain.positions(), atol=1e-4)


def test_on_twos_every_drawing_is_shown_as_long(kick, tmp_path):
    """30 frames a second at ten drawings a second: three of each."""
    _, made = played(kick, tmp_path / "out.bvh", "--drawings", "10", "--ease", "0.5")
    places = made.positions()
    changes = np.flatnonzero(np.abs(np.diff(places, axis=0)).max(axis=(1, 2)) > 1e-9) + 1
    assert len(changes) > 5 and (changes % 3 == 0).all()


@pytest.mark.parametrize("wrong", [("--amount", "inf"), ("--seconds", "0"), ("--overshoot", "nan"), ("--ease", "9")])
def test_what_no_filter_can_do_is_refused(kick, tmp_path, capsys, wrong):
    assert cli.main(["mocap", "anticipate", str(kick), "-o", str(tmp_path / "x.bvh"), *wrong]) == 2
    assert capsys.readouterr().err.startswith("tooncap: ") and not (tmp_path / "x.bvh").exists()
