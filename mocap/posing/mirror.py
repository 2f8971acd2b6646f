"""Left and right swapped: which joint is which other's counterpart, and turns as in a mirror."""

import re

import numpy as np
from numpy.typing import NDArray

from mocap.body import Body
from mocap.skeleton import Skeleton

_SWAPPED = {"left": "right", "right": "left", "l": "r", "r": "l", "lft": "rgt", "rgt": "lft"}
_SIDE = re.compile(
    "(?<![a-zA-Z])(?:left|right|lft|rgt)|Left|Right|LEFT|RIGHT|Lft|Rgt|"  # leftArm, upperRight
    "(?<![a-zA-Z])[lrLR](?![a-zA-Z])|(?<![a-zA-Z])[lr](?=[A-Z])|"  # thigh.L, l_knee, lShin
    "(?<![a-zA-Z])[LR](?=[A-Z][a-z])|(?<=[a-z])[LR](?![a-zA-Z])"  # LHipJoint, HandL
)


def counterparts(skeleton: Skeleton, body: Body) -> NDArray:
    """Of every joint the one on the other side (J,), told by names, else by the limbs of a body; itself in the middle.

    What is paired is paired both ways.
    """
    index = {name: joint for joint, name in enumerate(skeleton.names)}
    pairs = np.arange(len(skeleton))
    for joint, name in enumerate(skeleton.names):
        other = index.get(other_side(name), joint)
        if other_side(skeleton.names[other]) == name:
            pairs[joint] = other
    for name, joints in body.parts.items():
        others = body.parts.get(other_side(name), ())
        for joint, other in zip(joints, others):
            if pairs[joint] == joint and pairs[other] == other:
                pairs[joint], pairs[other] = other, joint
    return pairs


def other_side(name: str) -> str:
    """A name with left and right swapped: "LeftArm" is "RightArm", "l_knee" is "r_knee"; others stay as they are."""
    return _SIDE.sub(lambda found: _alike(_SWAPPED[found[0].lower()], found[0]), name)


def across(places: NDArray, pairs: NDArray) -> NDArray:
    """The way (3,), of length 1, from right to left as joints stand at `places` (J, 3); x where nothing is paired."""
    way = (places[pairs] - places) * np.array([1.0, 0, 1])
    far = np.linalg.norm(way, axis=1)
    if not far.max() > 1e-9:
        return np.array([1.0, 0.0, 0.0])
    way = way * np.sign(way @ way[far.argmax()])[:, None]  # each pair is in it both ways
    return way.sum(axis=0) / np.linalg.norm(way.sum(axis=0))


def mirrored(turns: NDArray, pairs: NDArray, axis: NDArray, world: NDArray) -> NDArray:
    """Turns (..., J, 3) as rotation vectors, seen in a mirror square to `axis` (3,), each on the other side's joint.

    They are in the joints' own axes, which stand in the world as `world` (J, 3, 3), in columns.  A turn about the
    mirror's axis stays, one about another goes round the other way.
    """
    round_world = np.einsum("jab,...jb->...ja", world, turns)
    seen = 2 * (round_world @ axis)[..., None] * axis - round_world
    return np.einsum("jba,...jb->...ja", world, seen[..., pairs, :])


def _alike(word: str, like: str) -> str:
    """A word in capitals as another is."""
    if like.isupper():
        return word.upper()
    return word.capitalize() if like[:1].isupper() else word
