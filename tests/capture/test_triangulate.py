"""A mesh covers its outline exactly, keeps every edge of it, and has no slivers where the outline is even."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from capture.errors import InputError
from capture.motion.triangulate import locate, resample, triangulate
from fixtures import hat, maps

relaxed = settings(deadline=None, max_examples=60, derandomize=True)


def area_by_hand(outline):
    """The shoelace formula (positive counter-clockwise on paper, where y points up)."""
    x, y = np.asarray(outline, float).T
    return 0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)


def corners(outlines, inside, faces):
    return np.vstack([outlines[0], inside])[faces]


def areas(triangles):
    return np.array([area_by_hand(triangle) for triangle in triangles])


def angles(triangles):
    """The angles (F, 3) of triangles (F, 3, 2) in degrees."""
    sides = np.roll(triangles, -1, axis=1) - triangles
    back = -np.roll(sides, 1, axis=1)
    cosine = (sides * back).sum(-1) / np.linalg.norm(sides, axis=-1) / np.linalg.norm(back, axis=-1)
    return np.degrees(np.arccos(cosine))


def edges(faces):
    return {frozenset(pair) for a, b, c in faces.tolist() for pair in ((a, b), (b, c), (c, a))}


def star(spikes, inner, outer=60.0):
    angle = np.linspace(0, 2 * np.pi, 2 * spikes, endpoint=False)
    radius = np.where(np.arange(2 * spikes) % 2, inner, outer)[:, None]
    return 100 + radius * np.column_stack([np.cos(angle), np.sin(angle)])


def comb(teeth):
    outline = [(0, 0), (3.0 * teeth, 0)]
    for right in 3.0 * np.arange(teeth, 0, -1):
        outline += [(right, 50), (right - 1.5, 50), (right - 1.5, 5), (right - 3, 5)]
    return np.array(outline[:-1], float)


SHAPES = {
    "an ellipse": maps.ellipse((100, 80), 40, 30, 60),
    "an ellipse drawn the other way round": maps.ellipse((100, 80), 40, 30, 60)[::-1],
    "a strip": np.array([(0, 0), (200, 0), (200, 1), (0, 1)], float),
    "a strip with more points on one side": np.array([(0, 0), (200, 0), (200, 0.5), (170, 0.5), (9, 0.5), (0, 0.5)]),
    "a needle": np.array([(0, 0), (100, 0.1), (60, -0.1)]),
    "a blunt star": star(12, 40),
    "a sharp star": star(12, 3),
    "a comb": comb(30),
    "a hat": hat.outline(100),
    "a triangle": np.array([(0, 0), (10, 0), (0, 10)], float),
}


def assert_covers(outline, outlines, loop, inside, faces):
    triangles = corners(outlines, inside, faces)
    assert (areas(triangles) > 0).all()
    assert areas(triangles).sum() == pytest.approx(abs(area_by_hand(outline)), rel=1e-9)
    assert {frozenset(step) for step in zip(loop.tolist(), np.roll(loop, -1).tolist())} <= edges(faces)
    assert np.array_equal(np.unique(faces), np.arange(len(outlines[0]) + len(inside)))  # no point is left out
    assert np.array_equal(outlines[0][: len(outline)], outline)  # the given points come first ...
    assert np.array_equal(loop[loop < len(outline)], np.arange(len(outline)))  # ... and in their order
    assert area_by_hand(outlines[0][loop]) == pytest.approx(area_by_hand(outline))


@pytest.mark.parametrize("name", SHAPES)
def test_a_mesh_covers_its_outline_and_keeps_all_its_edges(name):
    assert_covers(SHAPES[name], *triangulate(SHAPES[name][None]))


def spiky(seed):
    """A point in each of up to 24 sectors: the loop never crosses itself, however near the centre some points come."""
    rng = np.random.default_rng(seed)
    count, depth = rng.integers(5, 25), rng.uniform(0, 6)
    angle = (np.arange(count) + rng.uniform(0.1, 0.9, count)) * 2 * np.pi / count
    radius = 100 * np.exp(rng.uniform(-depth, 0, count))[:, None]
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


@given(st.integers(0, 10**6))
@example(1847)  # whose longest sides must be halved eleven times over
@relaxed
def test_spiky_outlines_of_any_kind_are_covered_too(seed):
    assert_covers(spiky(seed), *triangulate(spiky(seed)[None]))


@pytest.mark.parametrize("name", ["an ellipse", "a hat", "a wave"])
def test_an_even_outline_gives_no_angle_below_25_degrees(name):
    angle = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    wave = (50 + 10 * np.sin(5 * angle))[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    outline = maps.even({**SHAPES, "a wave": wave}[name], 70)
    step = np.linalg.norm(np.diff(outline, axis=0), axis=1).mean()
    outlines, _, inside, faces = triangulate(outline[None], spacing=step)
    assert angles(corners(outlines, inside, faces)).min() > 25
    assert len(inside) > 30


def test_all_outlines_are_halved_at_the_same_place():
    thin = spiky(1847)
    other = thin @ [[0.5, 0.2], [1.0, 3.0]] + (7, 8)
    outlines, loop, _, _ = triangulate(np.stack([thin, other]))
    assert outlines.shape[1] > 2 * len(thin)
    assert np.allclose(outlines[0] @ [[0.5, 0.2], [1.0, 3.0]] + (7, 8), outlines[1])
    assert np.array_equal(outlines[1][: len(thin)], other) and len(loop) == outlines.shape[1]


def test_a_finer_spacing_gives_smaller_triangles():
    outline = SHAPES["an ellipse"]
    counts = [len(triangulate(outline[None], spacing)[3]) for spacing in (12, 8, 4)]
    assert counts == sorted(counts) and counts[-1] > 2 * counts[0]


@pytest.mark.parametrize(
    "outline, words",
    [
        ([(0, 0), (10, 10), (10, 0), (0, 12)], "crosses itself"),
        ([(0, 0), (10, 0), (20, 0)], "no area"),
        ([(0, 0), (10, np.nan), (20, 0)], "finite"),
        ([(0, 0), (10, 0), (10, 10), (0, 0)], "twice in a row"),
        ([(0, 0), (10, 0), (10, 0), (10, 10)], "twice in a row"),
    ],
)
def test_an_outline_that_bounds_nothing_is_refused(outline, words):
    with pytest.raises(InputError, match=words):
        triangulate(np.array([outline], float))


@given(st.integers(3, 60), st.integers(3, 40))
@relaxed
def test_a_resampled_outline_is_even_and_starts_where_it_did(count, corners_of_it):
    outline = 10 + star(corners_of_it, 30)
    even = resample(outline, count)
    assert even.shape == (count, 2) and np.allclose(even[0], outline[0])
    fine = resample(outline, 20 * 2 * corners_of_it)  # the corners are among these: lengths along it are exact
    total = np.linalg.norm(fine - np.roll(fine, -1, axis=0), axis=1).sum()
    length = np.linalg.norm(outline - np.roll(outline, -1, axis=0), axis=1)
    assert total == pytest.approx(length.sum())
    along = np.concatenate([[0], np.cumsum(length)])
    for k, point in enumerate(even):
        at = k / count * along[-1]
        edge = np.searchsorted(along, at, side="right") - 1
        share = (at - along[edge]) / length[edge]
        assert np.allclose(point, (1 - share) * outline[edge] + share * outline[(edge + 1) % len(outline)])


def test_locate_finds_points_again():
    outlines, _, inside, faces = triangulate(SHAPES["a hat"][None])
    mesh = np.vstack([outlines[0], inside])
    rng = np.random.default_rng(0)
    true_face = rng.integers(0, len(faces), 700)  # more than one block of 512
    true_shares = rng.dirichlet((1, 1, 1), 700)
    points = np.einsum("pk,pkd->pd", true_shares, mesh[faces[true_face]])
    face, shares = locate(points, mesh, faces)
    assert np.allclose(np.einsum("pk,pkd->pd", shares, mesh[faces[face]]), points)
    assert np.array_equal(face, true_face) and np.allclose(shares, true_shares)


def test_a_point_outside_belongs_to_the_triangle_beside_it():
    mesh = np.array([(0, 0), (10, 0), (10, 10), (0, 10)], float)
    faces = np.array([(0, 1, 2), (0, 2, 3)])
    points = np.array([(12.0, 3.0), (-2.0, 6.0), (4.0, -5.0), (14.0, 6.0)])
    face, shares = locate(points, mesh, faces)
    assert face.tolist() == [0, 1, 0, 0]
    assert np.allclose(shares.sum(axis=1), 1) and (shares.min(axis=1) < 0).all()
    assert np.allclose(np.einsum("pk,pkd->pd", shares, mesh[faces[face]]), points)
