"""Which joints of a figure stand, and when."""

import numpy as np

from fixtures import skeletons
from mocap.rubber import rubber, soles
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion


def walking():
    figure = skeletons.walk(2.0, 60.0)
    skeleton = Skeleton(figure.names, figure.parents, figure.offsets)
    return figure, SkeletonMotion(skeleton, figure.translation, figure.rotation, figure.fps)


def test_a_foot_stands_as_a_whole_from_ankle_to_the_end_of_its_toe():
    figure, motion = walking()
    joints, contacts = soles.found(motion, figure.positions)
    for foot, side in enumerate(("left", "right")):
        own = [n for n, joint in enumerate(joints) if side in figure.names[joint].lower()]
        names = " ".join(figure.names[joints[n]].lower() for n in own)
        assert "toe" in names and any(not motion.skeleton.children(joints[n]) for n in own), names
        for n in own:
            assert np.mean(contacts[:, n] == figure.stands[:, foot]) > 0.9


def test_of_a_foot_that_stands_no_joint_moves():
    figure, motion = walking()
    made = rubber.make_rubber(motion, omega=5, follow=0.5)
    ends = made.subjoints.ends
    for foot, side in enumerate(("left", "right")):
        feet = [
            j
            for j, name in enumerate(figure.names)
            if side in name.lower() and any(it in name.lower() for it in ("foot", "toe"))
        ]
        sure = np.flatnonzero(figure.stands[:, foot])[6:-6]
        sure = sure[figure.stands[sure - 6, foot] & figure.stands[np.minimum(sure + 6, len(motion) - 1), foot]]
        np.testing.assert_allclose(made.positions[sure][:, ends[feet]], figure.positions[sure][:, feet], atol=1e-4)
