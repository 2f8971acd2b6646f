"""Two legs on a pair of hips, cut into sub-links by hand: what several tests bend."""

import numpy as np
import pytest

from mocap.rubber.subjoints import SubJoints
from mocap.skeleton import Skeleton


@pytest.fixture(scope="session")
def leg():
    """Makes the legs, every link in so many pieces."""
    return _leg


@pytest.fixture(scope="session")
def standing():
    """Where the sub-joints (T, S, 3) are while it stands."""
    return _standing


def _leg(cuts=3):
    """A hip with two legs of thigh, shin and foot; every link is cut into `cuts`; a spur hangs on the left ankle."""
    names, parents, offsets = ["hips"], [-1], [[0, 1, 0]]
    for side, x in (("left", 0.1), ("right", -0.1)):
        for name, offset in (
            ("hip", [x, 0, 0]),
            ("knee", [0, -0.45, 0.02]),
            ("ankle", [0, -0.45, -0.02]),
            ("toe", [0, 0, 0.15]),
        ):
            parents.append(0 if name == "hip" else len(names) - 1)
            names.append(f"{side} {name}")
            offsets.append(offset)
    names.append("spur")
    parents.append(3)
    offsets.append([0, 0, -0.05])
    skeleton = Skeleton(tuple(names), tuple(parents), np.array(offsets, float))
    sub_parents, joint, along, ends = [], [], [], []
    for k, parent in enumerate(parents):
        count = 1 if parent < 0 or names[k].endswith("hip") or names[k] == "spur" else cuts
        for cut in range(count):
            sub_parents.append(-1 if parent < 0 else ends[parent] if cut == 0 else len(joint) - 1)
            joint.append(k)
            along.append((cut + 1) / count)
        ends.append(len(joint) - 1)
    groups = (np.arange(1, 5), np.arange(5, 9))
    return SubJoints(skeleton, tuple(sub_parents), np.array(joint), np.array(along), np.array(ends), groups)


def _standing(subjoints, count=1):
    places = np.zeros((len(subjoints.skeleton), 3))
    for k, parent in enumerate(subjoints.skeleton.parents):
        places[k] = subjoints.skeleton.offsets[k] + (places[parent] if parent >= 0 else 0)
    above = np.maximum(np.array(subjoints.skeleton.parents), 0)[subjoints.joint]
    share = subjoints.along[:, None]
    return np.tile((1 - share) * places[above] + share * places[subjoints.joint], (count, 1, 1))
