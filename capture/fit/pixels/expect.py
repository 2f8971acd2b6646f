"""Where parts are looked for in the next picture: carried by their parents, which are roughly found first."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from capture.fit.pixels import cover, descend
from capture.fit.pixels.belief import CLEAR, IN_SIGHT
from capture.fit.pixels.cover import Placed
from capture.fit.pixels.held import is_unchanged
from capture.fit.pixels.sighting import Pose, Sighting, is_sane, margin
from capture.motion import affine

CHANGE = 1.3  # times: what a rough fit may stretch or squash a part between drawings
STIR = 8  # pixels by which a part in front may have moved that is not found yet


def expected(image: NDArray, parts: tuple[Sighting, ...]) -> list[Pose]:
    """Every part's pose if it does nothing but go with its parent.

    A parent's fine fit may have to wait for children in front of it, so a rough one is made of it first.
    """
    parents = parents_of(parts)
    poses: dict[int, Pose] = {}
    while len(poses) < len(parts):
        for number, (part, parent) in enumerate(zip(parts, parents)):
            if number in poses or (parent is not None and parent not in poses):
                continue
            pose = part.pose if parent is None else carried(part, parts[parent].pose, poses[parent])
            waits = any(above == number and order(parts[child]) > order(part) for child, above in enumerate(parents))
            if waits and pose.visible and not is_unchanged(image, part):
                pose = _roughly(image, parts, number, pose)
            poses[number] = pose
    return [poses[number] for number in range(len(parts))]


def parents_of(parts: tuple[Sighting, ...]) -> list[int | None]:
    """The number of every part's parent."""
    numbers = {part.model.part.name: number for number, part in enumerate(parts)}
    return [numbers.get(part.model.part.parent) for part in parts]


def carried(part: Sighting, before: Pose, now: Pose) -> Pose:
    """A part's pose as its parent takes it along, from where that was to where it is now."""
    moved = affine.compose(now.placed, affine.invert(before.placed))
    pose = replace(part.pose, placed=affine.compose(moved, part.pose.placed))
    return pose if is_sane(part.model, pose) else part.pose


def joint(part: Sighting, expected: Pose, parent: Pose) -> NDArray | None:
    """Where (2,) a parent that is seen holds a part's pivot; None where there is no pivot or no parent in sight."""
    if part.model.part.pivot is None or not parent.visible:
        return None
    return affine.apply(expected.placed, np.array([part.model.part.pivot], float))[0]


def order(part: Sighting) -> int:
    """The part's place in the pile: higher is in front."""
    return part.model.part.order


def placed(part: Sighting) -> Placed:
    """A part where it was last."""
    return Placed(part.model, part.colors, part.pose)


def _roughly(image: NDArray, parts: tuple[Sighting, ...], number: int, start: Pose) -> Pose:
    """A part's pose from small pictures; the start where they show too little."""
    part, model = parts[number], parts[number].model
    front = [placed(other) for other in parts if order(other) > order(part) and other.pose.visible]
    others = [placed(other) for other in parts if other is not part]
    cut = cover.cutout(image, cover.mask(front, image.shape, STIR), others, part.colors, model, start, margin(model))
    frame = cover.as_layer(model.view, cut)
    pose = replace(descend.rough(model, frame, start.placed), visible=True)
    if not is_sane(model, pose) or _changed(start, pose) > CHANGE:
        return start  # small pictures of a covered part leave much open
    before, seen = (descend.evidence(model, frame, one, 2) for one in (start, pose))
    believed = seen.shown >= CLEAR and seen.known >= IN_SIGHT * before.known
    return pose if believed else start


def _changed(one: Pose, other: Pose) -> float:
    """How many times longer or shorter the part has become, along the direction in which that is most."""
    scales = np.linalg.svd(other.placed[:, :2] @ np.linalg.inv(one.placed[:, :2]), compute_uv=False)
    return float(max(scales[0], 1 / max(scales[1], 1e-9)))
