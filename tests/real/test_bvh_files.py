"""Real BVH files read like bvhio reads them: slow, and right on all of them."""

import warnings

import numpy as np
import pytest

from mocap.skeletons.bvh import read_bvh, write_bvh

NAMES = [
    *(
        "ad_cmu1_jumping_jacks",
        "ad_fair1_dab",
        "ad_fair1_jumping",
        "ad_fair1_wave_hello",
        "ad_fair1_zombie",
        "ad_rokoko_jesse_dance",
    ),
    *(
        "bandai1_kick",
        "bandai1_run_normal",
        "bandai1_walk_normal",
        "bandai1_walk_tired",
        "bvhpython_freebvh",
        "bvhpython_mocapbank",
        "cmu21_box-2",
    ),
    *("cmu21_dance", "cmu21_kick", "cmu21_swim", "cmu21_walk", "cmu_01_01_fairmotion", "cmu_12_01_walk"),
]


@pytest.mark.parametrize("name", NAMES)
def test_joints_are_where_bvhio_has_them(name, data, tmp_path):
    """On the first 40 frames, cut out by hand, since bvhio takes milliseconds a frame; then on what we write again."""
    head, frames = (data / "bvh" / f"{name}.bvh").read_text().split("Frames:")
    heading, *rows = frames.strip().split("\n")[1:42]
    cut = tmp_path / "cut.bvh"
    cut.write_text(f"{head}Frames: {len(rows)}\n{heading}\n" + "\n".join(rows) + "\n")
    motion = read_bvh(cut, strict=True)
    names, truth = _by_bvhio(cut)
    joints = [motion.skeleton.names.index(name) for name in names]
    size = motion.skeleton.lengths().sum()
    np.testing.assert_allclose(motion.positions()[:, joints], truth, atol=1e-5 * size)
    write_bvh(motion, cut)
    _, again = _by_bvhio(cut)
    np.testing.assert_allclose(again, truth, atol=1e-5 * size)


@pytest.mark.parametrize("name", NAMES)
def test_a_whole_file_is_read_without_a_guess_and_written_again(name, data, tmp_path):
    motion = read_bvh(data / "bvh" / f"{name}.bvh", strict=True)
    write_bvh(motion, tmp_path / "again.bvh")
    again = read_bvh(tmp_path / "again.bvh", strict=True)
    assert again.skeleton.names == motion.skeleton.names and again.skeleton.parents == motion.skeleton.parents
    assert again.fps == pytest.approx(motion.fps, rel=1e-9)
    np.testing.assert_allclose(again.positions(), motion.positions(), atol=1e-5 * motion.skeleton.lengths().sum())


def _by_bvhio(path):
    """Names and places (T, J, 3) of the joints; bvhio keeps no end sites."""
    with warnings.catch_warnings():  # it imports its geometry by a name that is going to change
        warnings.simplefilter("ignore")
        bvhio = pytest.importorskip("bvhio", reason="bvhio, the oracle, is not installed")
    root = bvhio.readAsHierarchy(str(path))
    joints = [joint for joint, _, _ in root.layout()]
    places = []
    for frame in range(root.getKeyframeRange()[1] + 1):
        root.loadPose(frame)
        places.append([tuple(joint.PositionWorld) for joint in joints])
    return [joint.Name for joint in joints], np.array(places)
