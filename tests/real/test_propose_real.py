"""Keys proposed for drawings nobody here made: the frog's for four animals, the hopping rabbit's for a frog."""

from pathlib import Path

import numpy as np
import pytest

from capture.motion import keys
from capture.motion.keys import KeySet
from capture.motion.tracks import CartoonMotion
from capture.pictures import overlay
from capture.pictures.clip import Clip
from capture.pictures.encode import write_clip, write_picture
from fixtures import frog
from retarget.characters.drawings import drawing, paths
from retarget.characters.drawings.paths import DrawnPath
from retarget.characters.drawings.svg import read_svg
from retarget.characters.proposed.propose import Proposal, propose
from retarget.stage import draw2d
from retarget.stage.keysheet import key_sheet
from retarget.stage.perform import perform

MIRROR = np.array([[-1.0, 0, 0], [0, 1, 0]])
ANIMALS = {  # and whether it looks to the left
    "twemoji/1f407.svg": True,
    "twemoji/1f998.svg": True,
    "twemoji/1f438.svg": False,
    "openclipart/cartoon_cat_gerald_g._01.svg": False,
    "openclipart/red-eye_frog_mirko_maisc_01.svg": True,
}


@pytest.mark.parametrize("name", ANIMALS)
def test_the_frogs_keys_are_proposed_for_other_animals(data: Path, sheets: Path, name: str):
    drawn = _animal(data / "drawings" / name, ANIMALS[name])
    part = frog.frog().parts[0]
    source = keys.keyset(part.key_names, part.points[part.key_frames])
    found = propose(drawn, source)
    write_picture(sheets / f"propose_{Path(name).stem}.png", key_sheet(found, source))
    print(f"\n{name}: {_said(found)}")
    _holds(found, drawn)


def test_the_rabbits_keys_are_proposed_for_a_frog_that_hops_with_them(
    data: Path, rabbit: CartoonMotion, rabbit_clip: Clip, sheets: Path
):
    motion = rabbit
    drawn = _animal(data / "drawings" / "openclipart" / "red-eye_frog_mirko_maisc_01.svg", False)
    source: KeySet = motion.keyset("body")
    found = propose(drawn, source)
    write_picture(sheets / "propose_rabbit_frog.png", key_sheet(found, source, 240))
    print(f"\nrabbit to frog: {_said(found)}")
    _holds(found, drawn)
    hopping = drawing.drawing("body", source.names, [list(version) for version in found.versions])
    frames = list(draw2d.draw_frames(perform(motion, [hopping]), "#cfe2f3"))
    pairs = list(overlay.side_by_side(zip(overlay.draw_over(rabbit_clip, motion), frames)))
    write_picture(sheets / "propose_rabbit_frog_hops.png", overlay.contact_sheet(pairs[::2], columns=4, width=480))
    write_clip(sheets / "propose_rabbit_frog.mp4", pairs, motion.fps)


def _holds(found: Proposal, drawn: list[DrawnPath]) -> None:
    """The first key is the drawing; no key is torn: each keeps most of its area, and hardly any triangle folds."""
    for path, first in zip(drawn, found.versions[0], strict=True):
        assert np.abs(path.points - first.points).max() < 1e-6
    assert found.strain.max() < 4
    assert found.folded.max() <= 3
    area = [sum(paths.painted(path).area for path in version) for version in found.versions]
    assert min(area) > 0.6 * area[0] and max(area) < 1.7 * area[0]


def _said(found: Proposal) -> str:
    return (
        f"outlines {found.misfit:.1%} of the height apart, stretch kept within "
        f"{', '.join(f'{factor:.2f}' for factor in found.strain)}, folded triangles {found.folded.tolist()}"
    )


def _animal(file: Path, looks_left: bool) -> list[DrawnPath]:
    drawn = read_svg(file)[0]
    return [paths.moved(path, MIRROR) for path in drawn] if looks_left else drawn
