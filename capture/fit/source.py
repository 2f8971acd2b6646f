"""What a motion was captured from: its shot, kept in the motion's own file, and believed only of what was captured.

So a shot that is changed later can be held against it, and a capture done again only where the two differ.
"""

import hashlib
import json
from dataclasses import asdict, replace
from typing import Any

from capture.motion.tracks import CartoonMotion
from capture.pictures.shot import Shot


def stamped(motion: CartoonMotion, shot: Shot) -> CartoonMotion:
    """The motion with the shot that it was captured from; not with the clip's path, which is its owner's business."""
    return replace(motion, source={"of": digest(motion), "shot": plain(shot)})


def plain(shot: Shot) -> Any:
    """A shot in plain values, as they come back from a file; without the clip's path."""
    return json.loads(json.dumps(asdict(replace(shot, clip="")), default=float))


def shot_of(motion: CartoonMotion) -> Shot | None:
    """The shot that a motion was captured from, without its clip's path.

    None where that is not known, and of a motion that is no longer as it was captured, such as an exaggerated one.
    """
    import msgspec

    if motion.source is None or motion.source.get("of") != digest(motion):
        return None
    try:
        return msgspec.convert(motion.source.get("shot"), Shot)
    except msgspec.ValidationError:
        return None


def digest(motion: CartoonMotion) -> str:
    """What tells a motion from one made of it."""
    digest = hashlib.sha256(repr([(track.part, track.parent, track.keys) for track in motion.tracks]).encode())
    for track in motion.tracks:
        for array in (track.rows, track.affine, track.weights):
            digest.update(array.astype("<f8").tobytes())
    return digest.hexdigest()[:16]
