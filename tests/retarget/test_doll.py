"""The walk lent to six 3-D bodies that hang on each other: seen from the side they cover what the drawing covers."""

import numpy as np
import pytest

from capture.motion import keys
from capture.motion.tracks import CartoonMotion, Track
from fixtures import doll, render, walker
from retarget.characters.models import lift
from retarget.characters.models.mesh import read_mesh
from retarget.stage import draw2d
from retarget.stage.perform import perform


@pytest.fixture(scope="module")
def toon():
    return walker.walker()


@pytest.fixture(scope="module")
def motion(toon):
    """The walker's true motion."""
    count = len(toon)
    known = {"residual": np.zeros(count), "visible": np.ones(count, bool), "held": np.zeros(count, bool)}
    tracks, keysets = [], []
    for part in toon.parts:
        keysets.append(keys.keyset(part.key_names, part.points[part.key_frames], spacing=20.0))
        rows, order = keysets[-1].rows, np.full(count, part.order)
        tracks.append(
            Track(
                *(part.name, part.parent, part.pivot, part.key_names, rows, part.affine, np.ones((count, 1))),
                **known,
                order=order,
            )
        )
    return CartoonMotion(tuple(tracks), tuple(keysets), np.arange(count) / 24, 24.0, toon.size)


@pytest.fixture(scope="module")
def bodies(tmp_path_factory):
    folder = tmp_path_factory.mktemp("doll")
    for name, text in doll.models().items():
        (folder / f"{name}.obj").write_text(text)
    return folder


def playing(motion, bodies, plane="zy", depth=lift.keeping_volume):
    cast = [read_mesh(t.part, ("rest",), [bodies / f"{t.part}.obj"], plane=plane, depth=depth) for t in motion.tracks]
    return perform(motion, cast)


def test_the_doll_covers_what_the_walker_covers_in_every_step(toon, motion, bodies):
    performance = playing(motion, bodies)
    for t in range(0, len(toon), 9):
        drawn = draw2d.draw(performance, t)[..., 3] > 127
        shapes = [shape for part in toon.parts for shape in part.shapes(t)]
        truth = render.matte(shapes, toon.size) > 0.5
        assert (drawn & truth).sum() / (drawn | truth).sum() > 0.75
        feet = [np.flatnonzero(cover.any(axis=1)).max() for cover in (drawn, truth)]
        assert abs(feet[0] - feet[1]) < 6


def test_limbs_stay_at_their_joints_in_depth_too(motion, bodies):
    """A limb is moved by maps of the plane: no part leaves the depth in which it hangs, but for its thickness."""
    roles = playing(motion, bodies).roles
    for role in roles:
        middle = role.points[..., 2].mean(axis=1)
        assert np.ptp(middle) < 1e-6 + 0.05 * np.ptp(role.points[0, :, 2])


def test_the_doll_can_be_seen_from_a_little_in_front(motion, bodies):
    performance = playing(motion, bodies, plane=(-1.0, 0.15, 0.6))
    side = playing(motion, bodies)
    both = [draw2d.draw(played, 20)[..., 3] > 127 for played in (performance, side)]
    assert 0.6 < (both[0] & both[1]).sum() / (both[0] | both[1]).sum() < 0.97
