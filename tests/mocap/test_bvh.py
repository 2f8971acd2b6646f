"""A BVH written by hand, with the habits of real ones; where its joints are is worked out by hand."""

import numpy as np
import pytest

from capture.errors import InputError
from mocap.bvh import read_bvh

LEG = """HIERARCHY
ROOT Hip
{
  OFFSET 1 2 3
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Left Knee
  {
    OFFSET 0 -4 0
    CHANNELS 3 Xrotation Yrotation Zrotation
    End Site
    {
      OFFSET 0 -3 0
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.04
0 10 0 0 0 0
0 0 0
0 10 5 90 90 0 -90 0 0
"""


def test_joints_go_where_their_channels_say(tmp_path):
    (tmp_path / "leg.bvh").write_text(LEG)
    motion = read_bvh(tmp_path / "leg.bvh")
    assert motion.skeleton.names == ("Hip", "Left Knee", "Left Knee end") and motion.skeleton.parents == (-1, 0, 1)
    assert motion.fps == pytest.approx(25)
    # a position replaces the offset; in frame 1 the hip turns about z, then about its own x, which the knee undoes
    np.testing.assert_allclose(motion.positions()[0], [[0, 10, 0], [0, 6, 0], [0, 3, 0]], atol=1e-12)
    np.testing.assert_allclose(motion.positions()[1], [[0, 10, 5], [0, 10, 1], [3, 10, 1]], atol=1e-12)


def test_what_is_not_a_bvh_is_refused(tmp_path):
    for text in ("", "HIERARCHY", LEG.replace("Frames: 2", "Frames: 3"), LEG.replace("}\nMOTION", "MOTION"), LEG[:-9]):
        (tmp_path / "bad.bvh").write_text(text)
        with pytest.raises(InputError, match="must be a BVH file of joints and frames"):
            read_bvh(tmp_path / "bad.bvh")
    with pytest.raises(InputError, match="there is no"):
        read_bvh(tmp_path / "none.bvh")
