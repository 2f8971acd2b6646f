"""A drawing bent along a line: what does not bend stays, lengths along the line stay, and nothing folds."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from capture.errors import InputError
from capture.fit import action
from capture.motion import keys, tracks
from capture.pictures import contours
from fixtures import broom, maps
from retarget import cli
from retarget.characters.drawings import bend
from retarget.characters.drawings.paths import DrawnPath, Gradient, flatten
from retarget.characters.target import REST
from retarget.stage import draw2d
from retarget.stage.perform import perform

LONG, WIDE = 160.0, 24.0


def bar(stripes=8):
    """A bar (one outline, then stripes across it) that stands on (50, 200), and its middle line."""

    def box(x0, y0, x1, y1, fill, name):
        corners = np.array([(x0, y1), (x0, y0), (x1, y0), (x1, y1)], float)
        ring = np.vstack([corners, corners[:1]])
        thirds = np.array([1, 2, 3])[:, None] / 3
        steps = [a + thirds * (b - a) for a, b in pairwise(ring)]
        points = np.vstack([ring[:1], *steps])
        return DrawnPath(name, "MLLLZ", points, np.array([0, 13]), np.array([True]), fill=np.array([*fill, 1.0]))

    paths = [box(50 - WIDE / 2, 200 - LONG, 50 + WIDE / 2, 200, (0.2, 0.5, 0.3), "bar")]
    for k in range(stripes):
        y = 200 - LONG * (k + 0.5) / stripes
        paths.append(box(50 - WIDE / 3, y - 2, 50 + WIDE / 3, y + 2, (0.9, 0.8, 0.2), "stripe"))
    return paths, np.array([[50.0, 200.0], [50.0, 200.0 - LONG]])


def arc(bend, length=LONG, count=64):
    """An arc (count, 2) of `bend` radians from (150, 220) upwards."""
    s = np.linspace(0, 1, count)
    if abs(bend) < 1e-9:
        return np.column_stack([0 * s, -length * s]) + (150, 220)
    return length / bend * np.column_stack([1 - np.cos(bend * s), -np.sin(bend * s)]) + (150, 220)


def laid(line, **options):
    """The bar laid along a line: the target, its paths bent, and its cut paths at rest."""
    drawn, rest = bar()
    target = bend.bent("line", action.capture_line(arc(0.0)[None]).keysets[0], drawn, rest, **options)
    ribbon = action.ribbon(np.asarray(line)[None], 20.0)[0]
    return target, target.posed(ribbon, np.ones(1), 1.0)


def test_a_straight_drawing_along_a_straight_line_is_the_same():
    target, posed = laid(arc(0.0))
    for before, after in zip(target.paths, posed, strict=True):
        assert np.allclose(after.points, before.points + (100, 20), atol=1e-6)


def test_along_an_arc_each_place_keeps_its_distance_along_and_across():
    target, posed = laid(arc(1.5))
    radius = LONG / 1.5
    centre = np.array([150 + radius, 220])
    rest = np.concatenate([path.points for path in target.paths])
    points = np.concatenate([path.points for path in posed]) - centre
    along = np.arctan2(-points[:, 1], -points[:, 0]) * radius
    across = radius - np.linalg.norm(points, axis=1)
    assert np.abs(along - (200 - rest[:, 1])).max() < 0.3 and np.abs(across - (rest[:, 0] - 50)).max() < 0.3


def test_half_a_turn_of_the_line_is_half_a_turn_of_the_drawing():
    line, half = arc(1.1), maps.place(maps.turn(np.pi), (150, 150), (150, 150))
    _, posed = laid(line)
    _, turned = laid(maps.move(half, line))
    for before, after in zip(posed, turned, strict=True):
        assert np.allclose(maps.move(half, before.points), after.points, atol=1e-6)


def test_a_bent_drawing_along_its_own_line_is_the_same():
    _, bowed = laid(arc(1.2))
    again = bend.bent("line", action.capture_line(arc(1.2)[None]).keysets[0], bowed, arc(1.2))
    ribbon = action.ribbon(arc(1.2)[None], 20.0)[0]
    for before, after in zip(again.paths, again.posed(ribbon, np.ones(1), 1.0), strict=True):
        assert np.allclose(before.points, after.points, atol=0.02)


def test_a_longer_line_makes_it_longer_and_thinner_only_when_asked():
    for thinning, width in ((0.0, WIDE), (0.5, WIDE / np.sqrt(2))):
        _, posed = laid(arc(0.0, 2 * LONG), thinning=thinning)
        assert np.allclose(np.ptp(posed[0].points, axis=0), (width, 2 * LONG), atol=1e-6)


def test_a_tight_bend_folds_nothing():
    """The inner side would cross itself from a radius of 12 pixels on, the line's is 9."""
    line = arc(3.6, 32.0)
    line = np.vstack([line[:1] + [(0, 60), (0, 30)], line, line[-1] + np.outer([30, 60], line[-1] - line[-2]) * 2])
    target, posed = laid(line)
    low = [flatten(path)[0].mean(axis=0) for path in posed[1:]]
    assert np.all(np.isfinite(np.concatenate(low)))
    curve = bend._curve(action.centre_lines(action.ribbon(line[None], 20.0)[0]))
    s = target.along[: len(target.paths[0].points)] * curve.length
    offset = bend._unfolded(target.across[: len(s)], curve.curvature(s))
    assert (1 - offset * curve.curvature(s)).min() > 0


def test_the_stage_bends_the_drawing_as_the_captured_line_bends():
    bends = 1.2 * np.sin(np.linspace(0, 2 * np.pi, 24))
    lines = np.stack([arc(b) + (3 * k, 0) for k, b in enumerate(bends)])
    motion = action.capture_line(lines, size=(400, 260))
    drawn, rest = bar()
    shown = perform(motion, [bend.bent("line", motion.keysets[0], drawn, rest)])
    for t in (0, 6, 11, 17):
        outline = shown.posed(t)[0].points
        for end in (lines[t, 0], lines[t, -1]):  # a corner on either side
            corners = np.abs(np.linalg.norm(outline - end, axis=1) - WIDE / 2) < 2.5
            assert np.count_nonzero(corners) >= 2
    assert draw2d.draw(shown, 6, "white").shape == (260, 400, 3)


def test_a_taller_cast_stands_on_the_same_foot():
    motion = action.capture_line(np.stack([arc(0.0), arc(0.5)]), size=(400, 260))
    drawn, rest = bar()
    target = bend.bent("line", motion.keysets[0], drawn, rest)
    points = [perform(motion, [replace(target, height=h)]).posed(0)[0].points for h in (1.0, 1.5)]
    assert np.allclose(points[0][:, 1].max(), points[1][:, 1].max(), atol=0.5)
    assert np.ptp(points[1], axis=0) == pytest.approx(1.5 * np.ptp(points[0], axis=0), rel=0.01)


def test_gradients_go_along_and_strokes_keep_their_width():
    drawn, rest = bar(0)
    paint = Gradient(np.array([0.0, 1.0]), np.eye(4)[:2] + (0, 0, 0, 1), np.eye(2, 3))
    drawn = [replace(drawn[0], fill=paint, stroke=np.ones(4), width=3.0)]
    target = bend.bent("line", action.capture_line(arc(0.0)[None]).keysets[0], drawn, rest)
    posed = target.posed(action.ribbon(arc(0.0)[None], 20.0)[0], np.ones(1), 1.0)
    assert np.allclose(posed[0].fill.place, [[1, 0, 100], [0, 1, 20]], atol=1e-6) and posed[0].width == 3.0


def test_lines_of_a_drawing_are_found():
    drawn, rest = bar()
    assert np.allclose(bend.upright(drawn), rest)
    found = bend.spine(drawn)
    assert np.abs(found[:, 0] - 50).max() < 0.5 and np.allclose(found[[0, -1]], rest, atol=1.0)


def test_a_mesh_that_is_no_line_or_a_line_of_no_length_is_refused(by_hand):
    drawn, rest = bar()
    ribbons = action.capture_line(arc(0.0)[None]).keysets[0]
    egg = keys.keyset((REST,), by_hand.egg()[None])
    for keyset, line in ((egg, rest), (ribbons, rest[:1]), (ribbons, rest * np.nan)):
        with pytest.raises(InputError):
            bend.bent("line", keyset, drawn, line)


def test_a_line_leaves_its_page_as_wide_after_it_as_before_it_for_who_is_wider(tmp_path):
    lines = broom.broom().line[[0, 30, 71]]
    contours.write_contours(contours.make(list(lines), False, 8.0), tmp_path / "line.json")
    assert cli.main(["contour", str(tmp_path / "line.json"), "-o", str(tmp_path / "a.motion.json")]) == 0
    (low, _), (high, _) = lines.min(axis=(0, 1)), lines.max(axis=(0, 1))
    assert abs(tracks.load(tmp_path / "a.motion.json").size[0] - (high + low)) <= 2
