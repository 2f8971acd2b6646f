"""A drawing outside the keys' span: the fit comes nearer to the best the keys can say than the keys alone do."""

import numpy as np
import pytest

from capture.fit.pixels import keyimages, outside, track_shape
from capture.fit.shapes import keyspace
from fixtures import maps

EVEN = np.full(3, 1 / 3)  # a third of every key's texture


@pytest.fixture(scope="module")
def loose(bendy):
    place = keyimages.mesh_map(bendy.space.mean, bendy.keyset.faces, bendy.grid)
    drawn = zip([bendy.as_layer(picture) for picture in bendy.pictures], bendy.keyset.points, bendy.keyset.removed)
    textures = [keyimages.pulled_layer(*key, place, bendy.grid.origin) for key in drawn]
    template = track_shape.shape_template(textures, place, bendy.space)
    return template, outside.loose_template(textures, place, bendy.space, bendy.keyset.outline)


def pushed(points, amount):
    """Points (N, 2) in a smooth field of waves that no mix of keys follows, and no map."""
    x, y = (points - points.mean(axis=0)).T
    return points + amount * np.column_stack([np.sin(y / 14 + 1) * np.cos(x / 17), np.sin(x / 15)])


def off(bendy, placed, alpha, true):
    outline = maps.move(placed, keyspace.mix(bendy.space, alpha))[bendy.keyset.outline]
    return np.sqrt(((outline - true[bendy.keyset.outline]) ** 2).sum(axis=-1).mean())


@pytest.mark.parametrize("row", [(0, 1, 0.4), (0, 2, 0.6), (1, 2, 0.5)])
def test_what_the_keys_cannot_say_pulls_less_at_what_they_say(bendy, loose, row):
    template, free = loose
    true = pushed(bendy.row(*row), 2.5)
    frame = bendy.layer(true)
    placed, alpha = track_shape.refine(template, frame, np.eye(2, 3), np.zeros(3), EVEN)
    misfit = track_shape.judged(template, frame, placed, alpha, EVEN).misfit
    found = outside.by_way_of_the_drawing(free, frame, placed, alpha, EVEN, misfit)
    best = keyspace.nearest(bendy.space, true[bendy.keyset.outline], bendy.keyset.outline, placed, alpha)
    alone, ours, least = (off(bendy, *pose, true) for pose in ((placed, alpha), found, best))
    print(f"\n{row}: keys alone {alone:.2f}, ours {ours:.2f}, the best there is {least:.2f} px")
    assert least <= ours < alone
    assert ours < 1.05 * least


def test_where_the_keys_say_enough_nothing_is_touched(bendy, loose):
    placed, alpha = np.eye(2, 3), np.zeros(3)
    found = outside.by_way_of_the_drawing(loose[1], bendy.layer(bendy.row(0, 1, 0.4)), placed, alpha, EVEN, 0.1)
    assert found[0] is placed and found[1] is alpha


def test_where_nothing_is_seen_the_pose_stays(bendy, loose):
    nothing = bendy.layer(bendy.row(0, 1, 0.4) + 1000)
    placed, alpha = np.eye(2, 3), np.zeros(3)
    found = outside.by_way_of_the_drawing(loose[1], nothing, placed, alpha, EVEN, 5.0)
    assert (found[0] == placed).all() and (found[1] == alpha).all()
