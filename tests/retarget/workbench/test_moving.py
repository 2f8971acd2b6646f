"""A box round what moves, against drawings whose place is known."""

import json

import numpy as np
import pytest

from fixtures import frog, hat
from retarget.workbench.capturing import moving


@pytest.mark.parametrize("toon", [frog.frog(), hat.hat()], ids=["frog", "hat"])
@pytest.mark.parametrize("t", [0, 12, 30])
def test_the_box_holds_the_cartoon_and_little_else(toon, t):
    others = [toon.frame(int(n)) for n in np.linspace(0, len(toon) - 1, moving.LOOKED_AT) if round(n) != t]
    x, y, w, h = moving.box(others, toon.frame(t))
    points = np.concatenate([part.points[t] for part in toon.parts])
    low, high = points.min(axis=0), points.max(axis=0)
    across = max(high - low)
    assert (np.array([x, y]) <= low + 0.06 * across).all() and (np.array([x + w, y + h]) >= high - 0.06 * across).all()
    assert w * h < 2.5 * np.prod(high - low)


def test_where_it_is_going_to_stand_is_not_where_it_is():
    toon = hat.hat()
    x, y, w, h = moving.box([toon.frame(t) for t in (2, 4, 6, 8, 10, 14, 18)], toon.frame(0))
    low, high = toon.parts[0].points[0].min(axis=0), toon.parts[0].points[0].max(axis=0)
    assert w * h < 2 * np.prod(high - low) and (np.array([x, y]) < low + 5).all()


def test_a_session_is_asked_for_the_box(hop, session):
    (seen,) = session.act({"look": "capture.moving", "frame": 9})
    x, y, w, h = json.loads(seen["data"])
    points = hop.drawn_at(9)
    assert (np.array([x, y]) < points.min(axis=0) + 2).all() and (
        np.array([x + w, y + h]) > points.max(axis=0) - 2
    ).all()
    assert w * h < 2 * np.prod(np.ptp(points, axis=0))


def test_where_nothing_moves_there_is_no_box():
    still = np.full((90, 120, 3), 200, np.uint8)
    assert moving.box([still] * 5, still) is None and moving.box([], still) is None
    flicker = [np.full((90, 120, 3), 200 + n, np.uint8) for n in range(9)]
    assert moving.box(flicker, still) is None
    cut = np.arange(90 * 120 * 3, dtype=np.uint8).reshape(90, 120, 3)
    assert moving.box([still] * 5, cut) is None
