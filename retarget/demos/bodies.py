"""Motions lent to bodies in space: a walk in six parts to a clay doll, a jump in key poses to a jointed lamp."""

from pathlib import Path

import numpy as np

from capture.motion import gaps
from fixtures import backdrop, doll, frog, lamp, walker
from retarget.characters.casts.castlist import Cast, CastKey, CastPart
from retarget.demos.shown import Shown, captured, drawn, leave, played, point_errors, write_text


def walk_to_model(folder: Path, zoom: float = 1.0) -> Shown:
    """A patchwork doll walks, six parts hung on each other; six 3-D bodies walk like it (figure 14)."""
    toon, _, clip, motion = captured(walker.walker(), folder, zoom, lossless=True)
    hidden = int(sum((~track.visible).sum() for track in motion.tracks))
    motion = gaps.bridged(motion)  # the far arm is hidden by the body now and then, but the new body is thinner
    parts = []
    for name, text in doll.models().items():
        file = folder / f"{name}.obj"
        write_text(file, text)
        parts.append(CastPart(name, drawing=str(file), plane=(-1.0, 0.16, 0.4), depth="volume"))
    performance = played(Cast(tuple(parts)), motion, folder / "doll.cast.toml")
    made = drawn(performance, backdrop.plain(walker.GROUND, (214, 226, 222)))
    also = f"for {hidden} frames that the far arm is hidden in, it goes on between"
    shown = Shown(clip, made, motion, performance, float(np.median(point_errors(motion, toon))), also)
    leave(shown, folder)
    return shown


def jump_to_lamp(folder: Path, zoom: float = 1.0) -> Shown:
    """A frog jumps; a desk lamp takes its key poses with the angles of its joints (section 3.4)."""
    toon, _, clip, motion = captured(frog.frog(), folder, zoom)
    write_text(folder / "lamp.gltf", lamp.gltf())
    turns = {key: {joint: (0, 0, angle) for joint, angle in lamp.POSES[key].items()} for key in frog.KEYS}
    keys = tuple(CastKey(key, joints=turns[key]) for key in frog.KEYS)
    part = CastPart("frog", keys, str(folder / "lamp.gltf"), height=1.0, plane=(0.4, 0.14, 1.0))
    performance = played(Cast((part,)), motion, folder / "lamp.cast.toml")
    made = drawn(performance, backdrop.plain(frog.GROUND, (244, 226, 204)))
    shown = Shown(clip, made, motion, performance, float(np.median(point_errors(motion, toon))))
    leave(shown, folder)
    return shown
