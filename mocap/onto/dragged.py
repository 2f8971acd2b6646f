"""A marked drawing whose own joints are moved: a bone goes from where its parent's mark is to where its own is.

Unlike a performer's (`to_tracks`), its joints are the drawing's: nothing has to be matched, and a joint that is dragged
over the page is drawn where it was dragged to.  What turns to the viewer is shown shorter.
"""

import numpy as np
from numpy.typing import NDArray

from mocap.onto.bones import Bone, cast_marks
from mocap.onto.hung import Hung, Lie, hung
from mocap.onto.marks import Marks
from mocap.onto.to_tracks import BEFORE, LEAST
from mocap.posing.postures import posed


def own_bones(marks: Marks) -> tuple[Bone, ...]:
    """The bones of a drawing, cut as those that a performer moves are."""
    skeleton = marks.skeleton()
    return cast_marks(posed(skeleton, np.zeros((1, len(marks), 3)), 24.0), marks).bones


def lies_at(marks: Marks, bones: tuple[Bone, ...], places: NDArray) -> Hung:
    """How the drawing lies with its joints at places (T, J, 3), in pixels, y down, the third towards the viewer."""
    up = np.array([max(parent, joint * (parent < 0)) for joint, parent in enumerate(marks.parents)])
    ways = places - places[:, up]
    flat = ways[..., 0] + 1j * ways[..., 1]
    drawn = (marks.places - marks.places[up]) @ [1, 1j]
    lies = {}
    for bone in bones:
        own, length = flat[:, bone.mark] / drawn[bone.mark], np.linalg.norm(ways[:, bone.mark], axis=1)
        shown = np.maximum(np.abs(own), LEAST * length / np.abs(drawn[bone.mark]))
        turn, shown = (np.repeat(one[:, None], bone.pieces, axis=1) for one in (np.angle(own), shown))
        lies[bone.mark] = Lie(turn, shown, np.ones_like(turn), np.zeros(len(places)))
    return hung(marks, bones, lies, _pelvis(marks, flat, drawn))


def orders_at(marks: Marks, bones: tuple[Bone, ...], places: NDArray) -> dict[str, NDArray]:
    """The drawn order (T,) of each limb: the trunk's is 0; arms are before it and legs behind it, as they are drawn,
    but where they reach clearly to the other side."""
    tall = float(np.ptp(marks.places, axis=0).max())
    trunk = [bone.mark for bone in bones if bone.limb == "trunk"] or [0]
    orders = {"trunk": np.zeros(len(places), int)}
    for limb in dict.fromkeys(bone.limb for bone in bones if bone.limb != "trunk"):
        arm = limb.endswith("arm")
        near = places[:, [bone.mark for bone in bones if bone.limb == limb], 2].mean(axis=1)
        near = (near - places[:, trunk, 2].mean(axis=1)) / tall
        before = near > -BEFORE if arm else near > BEFORE
        orders[limb] = np.where(before, 1, -1) * (2 if arm else 1)
    return orders


def _pelvis(marks: Marks, flat: NDArray, drawn: NDArray) -> NDArray:
    """How far the root's own part is turned (T,): as what hangs on it is, on the whole."""
    roots = {joint for joint, parent in enumerate(marks.parents) if parent < 0}
    for joint, parent in enumerate(marks.parents):
        if parent in roots and drawn[joint] == 0:
            roots.add(joint)
    hang = [joint for joint, parent in enumerate(marks.parents) if parent in roots and drawn[joint] != 0]
    return np.angle((flat[:, hang] * drawn[hang].conj()).sum(axis=1))
