"""Small bodies by formula: two legs cut into sub-links, which tests bend, and a figure that walks."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mocap.rubber.subjoints import SubJoints
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion


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


@pytest.fixture(scope="session")
def stroll():
    """Makes a walk by formula, for the laws of analogies."""
    return _stroll


def _stroll(seconds=4.0, fps=60.0, pace=1.0, swing=0.5, lean=0.1, bob=0.03, turning=0.2, phase=0.0, wave=0.0):
    """A figure that walks: `pace` cycles a second, arms and legs that swing so many radians, a back that leans.

    `wave` radians is something else that the right arm does, once, which a walk does not.
    """
    names = ["hips", "spine", "head", "head end"]
    parents, offsets = [-1, 0, 1, 2], [[0, 1, 0], [0, 0.3, 0], [0, 0.3, 0], [0, 0.2, 0]]
    for side, x in (("left", 0.1), ("right", -0.1)):
        for limb, base, links in (("leg", 0, ("hip", "knee", "foot")), ("arm", 1, ("shoulder", "elbow", "hand"))):
            for k, link in enumerate(links):
                first = [x, 0, 0] if limb == "leg" else [2 * x, 0.2, 0]
                parents.append(base if k == 0 else len(names) - 1)
                names.append(f"{side} {link}")
                offsets.append(first if k == 0 else [0, -0.45 if limb == "leg" else -0.28, 0])
    t = np.arange(round(seconds * fps) + 1) / fps
    beat = 2 * np.pi * pace * t + phase
    turns = np.zeros((len(t), len(names), 3))
    turns[:, 1, 0] = lean + 0.02 * np.sin(2 * beat)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        hip, knee = names.index(f"{side} hip"), names.index(f"{side} knee")
        shoulder, elbow = names.index(f"{side} shoulder"), names.index(f"{side} elbow")
        turns[:, hip, 0] = -sign * swing * np.sin(beat)
        turns[:, knee, 0] = swing * (1 + sign * np.cos(beat)) / 2
        turns[:, shoulder, 0] = sign * swing * np.sin(beat)
        turns[:, elbow, 0] = -0.3 * swing * (2 + sign * np.sin(beat))
    turns[:, names.index("right shoulder"), 2] -= wave * np.sin(np.pi * t / t[-1]) ** 2
    heading = turning * t
    speed = 1.2 * pace * swing
    place = np.cumsum(speed / fps * np.stack([np.sin(heading), 0 * t, np.cos(heading)], axis=-1), axis=0)
    place[:, 1] = 0.9 + bob * np.cos(2 * beat)
    turns[:, 0, 1] = heading
    translation = np.tile(np.array(offsets, float), (len(t), 1, 1))
    translation[:, 0] = place
    rotation = Rotation.from_rotvec(turns.reshape(-1, 3)).as_quat().reshape(len(t), len(names), 4)
    return SkeletonMotion(Skeleton(tuple(names), tuple(parents), np.array(offsets, float)), translation, rotation, fps)
