"""Laws of joints: children go with their parents."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from capture.errors import InputError
from mocap.skeletons import skeleton


def test_a_childs_place_is_its_parents_map_of_its_own():
    """An arm of two links of length 1, each turned by a quarter: the hand is back beside the shoulder."""
    quarter = Rotation.from_euler("z", 90, degrees=True).as_quat()
    own = skeleton.own_maps(np.array([[0, 0, 0], [1, 0, 0], [1, 0, 0.0]]), np.stack([quarter] * 3))
    world = skeleton.world_maps((-1, 0, 1), own)
    np.testing.assert_allclose(world[:, :, 3], [[0, 0, 0], [0, 1, 0], [-1, 1, 0]], atol=1e-12)
    np.testing.assert_allclose(world[2, :, :3], Rotation.from_euler("z", 270, degrees=True).as_matrix(), atol=1e-12)


def test_a_scaled_joint_scales_what_hangs_on_it():
    still = np.tile([0, 0, 0, 1.0], (2, 1))
    own = skeleton.own_maps(np.array([[0, 0, 0], [0, 2.0, 0]]), still, np.array([[1, 3.0, 1], [1, 1, 1]]))
    assert skeleton.world_maps((-1, 0), own)[1, :, 3] == pytest.approx([0, 6, 0])


@pytest.mark.parametrize(
    ("parents", "said"),
    [
        ((-1, 2, 1), "hangs on joint 2"),
        ((0, 0, 1), "hangs on joint 0"),
        ((-1, 0, 5), "joint 5"),
        ((-1, 0), "3, 2 and 3"),
    ],
)
def test_joints_that_hang_on_each_other_in_a_circle_are_refused(parents, said):
    with pytest.raises(InputError, match=said):
        skeleton.Skeleton(("a", "b", "c"), parents, np.ones((3, 3)))
