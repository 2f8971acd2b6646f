"""Real figures, of 24 to 73 joints, with joints in one place and links of no length, are posed as the laws say."""

import numpy as np
import pytest

from mocap.body import find_body
from mocap.bvh import read_bvh
from mocap.posing import limits, poses
from mocap.posing.springs import drag
from mocap.units import upright


@pytest.mark.parametrize("name", ["ad_rokoko_jesse_dance", "bandai1_kick", "cmu21_kick", "cmu_12_01_walk"])
def test_a_real_figure_keeps_its_links_and_its_feet(data, name):
    motion = upright(read_bvh(data / "bvh" / f"{name}.bvh"))
    skeleton = motion.skeleton
    feet = list(find_body(skeleton).feet)
    pose = poses.pose_of(motion, len(motion) // 2)
    child = np.flatnonzero(np.array(skeleton.parents) >= 0)
    above = np.array(skeleton.parents)[child]
    rng = np.random.default_rng(0)
    for joint in rng.choice(np.setdiff1d(np.arange(len(skeleton)), feet), 20):
        target = pose.positions[joint] + 0.3 * rng.normal(size=3)
        posed = drag(skeleton.parents, pose, int(joint), target, feet, limits.usual(skeleton))
        was, now = (np.linalg.norm(p[child] - p[above], axis=1) for p in (pose.positions, posed.positions))
        assert (np.abs(now - was) <= 0.05 * was + 2e-4).all()
        np.testing.assert_array_equal(posed.positions[feet], pose.positions[feet])
        played = poses.motion_of(skeleton, [posed], 30.0)
        np.testing.assert_allclose(played.positions()[0], posed.positions, atol=2e-4)
