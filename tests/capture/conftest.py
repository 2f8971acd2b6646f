"""A bar that bends, painted face by face from its own mesh; tests get it through the fixture `bendy`."""

from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from capture.fit.pixels import keyimages, layer
from capture.fit.shapes import keyspace
from capture.motion import keys
from fixtures import maps, render
from fixtures.render import Fill

SIZE = (230, 190)  # width, height
GROUND = np.array([128.0, 128.0, 128.0], np.float32)
LEVELS, FINER = 4, 6
NAMES = ("straight", "up", "down")
CURLS = (1e-3, -1.7, 1.4)  # radians along the whole bar, key by key


def bar(curl, count=64):
    """The outline (count, 2) of a bar 104 pixels long that tapers, wound along a circle by `curl` radians."""
    x = np.concatenate([np.linspace(-52, 52, 60), np.linspace(52, -52, 60)])
    y = np.where(np.arange(120) < 60, -1, 1) * np.interp(np.abs(x + 8), (0, 44, 60), (22, 15, 8))
    return bent(maps.even(np.column_stack([x, y]), count), curl) + (115, 95)


def bent(points, curl):
    angle, radius = curl * points[:, 0] / 104, 104 / curl
    r = radius - points[:, 1]
    return np.column_stack([r * np.sin(angle), radius - r * np.cos(angle)])


def paint(points, keyset):
    """The mesh at `points` (N, 2), each face in its own colour: a picture (H, W, 3) uint8 and its true matte (H, W)."""
    x, y = keyset.points[0, keyset.faces].mean(axis=1).T
    color = [128 + 100 * np.sin(x / 9), 128 + 100 * np.sin(y / 6 + x / 17), 128 + 100 * np.cos(x / 13 - y / 8)]
    fine = np.full((SIZE[1] * FINER, SIZE[0] * FINER, 3), 235, np.uint8)
    corners = np.rint(((points[keyset.faces] + 0.5) * FINER - 0.5) * 16).astype(np.int32)
    for face, shade in zip(corners, np.rint(color).T.tolist()):
        cv2.fillConvexPoly(fine, face, shade, shift=4)
    picture = cv2.resize(fine, SIZE, interpolation=cv2.INTER_AREA)
    return picture, render.matte([Fill(points[keyset.outline], (0, 0, 0))], SIZE).astype(np.float32)


def composite(points, keyset):
    return layer.composite(*paint(points, keyset), GROUND)


def as_layer(composed, origin=(0, 0)):
    return layer.layer(composed, np.asarray(origin), GROUND, LEVELS, 0.0)


@pytest.fixture(scope="session")
def bendy():
    """The bar's keys, rows and key frames, all that a tracker learns from, and ways to draw it anew."""
    keyset = keys.keyset(NAMES, np.stack([bar(curl) for curl in CURLS]), spacing=9.0)
    shapes = keys.shapes(keyset)
    drawn = maps.move(keyset.removed, keyset.points)  # as they stand in their key frames
    return SimpleNamespace(
        keyset=keyset,
        shapes=shapes,
        space=keyspace.extended_space(shapes),
        grid=keyimages.grid_round(shapes),
        pictures=[composite(points, keyset) for points in drawn],  # key frames, cut out
        ground=GROUND,
        paint=lambda points: paint(points, keyset),
        composite=lambda points: composite(points, keyset),
        layer=lambda points: as_layer(composite(points, keyset)),
        as_layer=as_layer,
        row=lambda i, j, s: keys.shapes(keys.with_rows(keyset, [(i, j, s)]))[0],
        wound=lambda curl: bent(keyset.points[0] - (115, 95), curl) + (115, 95),
    )
