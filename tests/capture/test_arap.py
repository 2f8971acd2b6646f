"""In-betweens bend where straight lines would shrink; a carried mesh follows its handles and stays stiff."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from capture.motion import arap
from fixtures import maps

relaxed = settings(deadline=None, max_examples=25, derandomize=True)
LENGTH, WIDTH = 100.0, 10.0


def strip(columns=25, rows=3):
    """A strip of squares cut in two: points (N, 2) and faces (F, 3)."""
    x, y = np.meshgrid(np.linspace(0, LENGTH, columns), np.linspace(-WIDTH / 2, WIDTH / 2, rows))
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    below = corner + columns
    faces = np.concatenate([np.stack([corner, corner + 1, below + 1], -1), np.stack([corner, below + 1, below], -1)])
    return np.column_stack([x.ravel(), y.ravel()]), faces


def curled(points, total):
    """The strip wound up by `total` radians along a circle: its middle line keeps its length."""
    angle, radius = total * points[:, 0] / LENGTH, LENGTH / total
    r = radius - points[:, 1]
    return np.column_stack([r * np.sin(angle), radius - r * np.cos(angle)])


def areas(points, faces):
    a, b, c = np.moveaxis(points[..., faces, :], -2, 0)
    u, v = b - a, c - a
    return 0.5 * (u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])


def between(start, end, faces, *s):
    return arap.inbetweens(np.stack([start, end]), faces, np.array([(0, 1, at) for at in s]))


def off(a, b):
    return np.linalg.norm(a - b, axis=-1).max()


def moved(points, angle=0.0, shift=(0, 0)):
    return maps.move(maps.place(maps.turn(angle), (0, 0), shift), points)


MESH, FACES = strip()


@given(st.floats(0.01, 6), st.sampled_from((-1, 1)), st.floats(-500, 500))
@relaxed
def test_both_ends_are_reproduced(total, way, x):
    end = curled(MESH, way * total) + (x, 50)
    assert off(between(MESH, end, FACES, 0.0, 1.0), np.stack([MESH, end])) < 1e-9


def test_a_key_row_is_the_key_itself():
    pair = np.stack([MESH, curled(MESH, 1.0)])
    assert np.array_equal(arap.inbetweens(pair, FACES, np.array([(1, 1, 0), (0, 0, 0)])), pair[::-1])


@given(st.floats(0.01, 6), st.floats(0, 1), st.floats(0.5, 2))
@relaxed
def test_in_betweens_are_symmetric_in_their_ends(total, s, longer):
    end = curled(MESH * (longer, 1), total)
    forth = arap.inbetweens(np.stack([MESH, end]), FACES, np.array([(0, 1, s)]))
    back = arap.inbetweens(np.stack([end, MESH]), FACES, np.array([(0, 1, 1 - s)]))
    other_row = arap.inbetweens(np.stack([MESH, end]), FACES, np.array([(1, 0, 1 - s)]))
    assert off(forth, back) < 1e-9 and off(forth, other_row) < 1e-9


@given(st.floats(-3.1, 3.1), st.floats(-0.5, 1.5), st.floats(-80, 80))
@relaxed
def test_part_of_a_rigid_turn_is_that_part_of_the_turn(angle, s, x):
    end = moved(MESH, angle, (x, 20))
    found = between(MESH, end, FACES, s)[0]
    assert off(found - found.mean(0), moved(MESH - MESH.mean(0), s * angle)) < 1e-8
    assert np.allclose(found.mean(0), (1 - s) * MESH.mean(0) + s * end.mean(0))


def test_half_of_half_a_turn_is_a_quarter_turn_one_way_or_the_other():
    start = MESH - MESH.mean(0)
    found = between(start, moved(start, np.pi), FACES, 0.5)[0]
    assert min(off(found, moved(start, angle)) for angle in (np.pi / 2, -np.pi / 2)) < 1e-8


def test_half_of_a_stretch_is_half_the_stretch():
    found = between(MESH, MESH * (3, 0.5), FACES, 0.25, 0.5)
    middle = MESH.mean(0)
    assert off(found[0] - found[0].mean(0), (MESH - middle) * (1.5, 0.875)) < 1e-8
    assert off(found[1] - found[1].mean(0), (MESH - middle) * (2.0, 0.75)) < 1e-8


@pytest.mark.parametrize("degrees", [90, 180, 300, 400, -300, 720])
def test_a_curl_uncurls_on_the_way_back_without_flipping_or_shrinking(degrees):
    total = np.radians(degrees)
    halves = between(MESH, curled(MESH, total), FACES, 0.25, 0.5, 0.75)
    assert (areas(halves, FACES) > 0).all()  # principal angles alone flip beyond 180 degrees
    at_ends = areas(MESH, FACES).sum(), areas(curled(MESH, total), FACES).sum()
    assert np.allclose(areas(halves, FACES).sum(axis=-1), np.interp((0.25, 0.5, 0.75), (0, 1), at_ends), rtol=0.01)
    true = curled(MESH, total / 2)  # the strip wound up half as far
    linear = maps.best_affine(halves[1], true)
    assert np.allclose(linear[:, :2] @ linear[:, :2].T, np.eye(2), atol=0.01)  # placed by a mere turn
    assert off(maps.move(linear, halves[1]), true) < 0.01 * LENGTH


def test_straight_lines_do_shrink_and_that_is_the_point():
    pair = np.stack([MESH, curled(MESH, np.pi)])
    row = np.array([(0, 1, 0.5)])
    straight, bent = (
        areas(rule(pair, FACES, row)[0], FACES).sum() for rule in (arap.straight_inbetweens, arap.inbetweens)
    )
    assert straight < 0.75 * areas(MESH, FACES).sum() < 0.8 * bent


@given(st.integers(0, 10**6))
@relaxed
def test_straight_in_betweens_are_straight(seed):
    rng = np.random.default_rng(seed)
    keys, s = rng.normal(size=(3, 6, 2)), rng.uniform(-1, 2)
    found = arap.straight_inbetweens(keys, FACES, np.array([(0, 2, s), (1, 1, 0), (2, 1, s)]))
    assert np.allclose(found, [(1 - s) * keys[0] + s * keys[2], keys[1], (1 - s) * keys[2] + s * keys[1]])


def test_equal_keys_give_themselves():
    shape = curled(MESH, 2.0)
    assert off(between(shape, shape, FACES, 0.0, 0.3, 1.0, 1.7), shape) < 1e-9


def test_two_separate_pieces_move_each_by_itself():
    """The second piece turns the other way: neither may be pulled along by the first."""
    mesh = np.vstack([MESH, MESH + (0, 60)])
    faces = np.concatenate([FACES, FACES + len(MESH)])
    ends = moved(MESH, 1.2, (10, 0)), moved(MESH, -2.0, (0, 300))
    found = between(mesh, np.vstack(ends), faces, 0.5)[0]
    alone = [between(start, end, FACES, 0.5)[0] for start, end in zip((MESH, MESH + (0, 60)), ends)]
    assert off(found, np.vstack(alone)) < 1e-8


def test_a_face_without_area_does_no_harm():
    """A key may fold a limb to a line; in the other key it has an area."""
    end = MESH.copy()
    end[MESH[:, 0] > 90, 1] = 0
    found = between(MESH, end, FACES, 0.0, 0.5, 1.0)
    assert np.isfinite(found).all() and off(found[[0, 2]], np.stack([MESH, end])) < 1e-6


def test_faces_drawn_the_other_way_round_make_no_difference():
    end = curled(MESH, 4.0)
    assert off(between(MESH, end, FACES, 0.4), between(MESH, end, FACES[:, ::-1], 0.4)) < 1e-8


def test_many_rows_at_once_are_the_same_as_one_by_one():
    keys = np.stack([MESH, curled(MESH, 2.0), MESH * (1.5, 1)])
    rows = np.array([(0, 1, 0.2), (1, 2, 0.5), (0, 0, 0), (0, 1, 0.8), (1, 2, 0.1), (2, 2, 0)])
    together = arap.inbetweens(keys, FACES, rows)
    assert off(together, np.concatenate([arap.inbetweens(keys, FACES, row[None]) for row in rows])) < 1e-9


def test_in_betweens_turn_with_the_keys():
    end = curled(MESH, 2.5)
    plain = between(MESH, end, FACES, 0.3)
    assert off(between(moved(MESH, 0.7), moved(end, 0.7), FACES, 0.3), moved(plain, 0.7)) < 1e-8


# -- carry ----------------------------------------------------------------------------------------------------

ENDS = np.flatnonzero((MESH[:, 0] == 0) | (MESH[:, 0] == LENGTH))


def corners_as_handles(at):
    """Handles and shares that hold mesh points themselves."""
    return np.repeat(at[:, None], 3, axis=1), np.tile([1.0, 0.0, 0.0], (len(at), 1))


def test_a_mesh_whose_handles_stay_stays():
    assert off(arap.carry(MESH, FACES, *corners_as_handles(ENDS), MESH[ENDS]), MESH) < 1e-6


@given(st.floats(-3.1, 3.1), st.floats(-200, 200))
@relaxed
def test_handles_that_move_rigidly_carry_the_mesh_rigidly(angle, x):
    goal = moved(MESH, angle, (x, 3))
    assert off(arap.carry(MESH, FACES, *corners_as_handles(ENDS), goal[ENDS]), goal) < 1e-5


def test_a_carried_mesh_hits_its_goals_and_stays_stiff():
    goals = MESH[ENDS] + np.where(MESH[ENDS, :1] > 0, (-20.0, 30.0), 0.0)
    found = arap.carry(MESH, FACES, *corners_as_handles(ENDS), goals)
    assert off(found[ENDS], goals) < 0.05
    assert (areas(found, FACES) > 0).all()
    assert np.allclose(areas(found, FACES).sum(), areas(MESH, FACES).sum(), rtol=0.1)


def test_a_handle_may_lie_within_a_face():
    """Two handles given by their shares reach goals nearer together than they were."""
    handles = FACES[[0, len(FACES) // 2 - 1]]
    shares = np.array([(0.2, 0.5, 0.3), (1 / 3, 1 / 3, 1 / 3)])
    goals = np.einsum("pk,pkd->pd", shares, MESH[handles]) + [(5, 0), (0, 12)]
    found = arap.carry(MESH, FACES, handles, shares, goals)
    assert off(np.einsum("pk,pkd->pd", shares, found[handles]), goals) < 0.05


def test_a_single_handle_carries_the_whole_mesh():
    one = np.array([5])
    found = arap.carry(MESH, FACES, *corners_as_handles(one), MESH[one] + (7, -3))
    assert off(found, MESH + (7, -3)) < 1e-5


def test_the_arguments_are_left_as_they_were():
    keys, rows, before = np.stack([MESH, curled(MESH, 1.0)]), np.array([(0, 1, 0.5)]), MESH.copy()
    arap.inbetweens(keys, FACES, rows)
    arap.carry(MESH, FACES, *corners_as_handles(ENDS), MESH[ENDS] + 1)
    assert np.array_equal(MESH, before) and np.array_equal(keys[0], before)


def test_a_mesh_that_follows_its_own_ways_arrives_up_to_a_shift():
    mesh, faces = strip()
    shapes = np.stack([mesh, curled(mesh, 4.0), 1.3 * mesh[:, ::-1] * [1, -1]])
    found = arap.follow(mesh, faces, *arap.ways(mesh, shapes, faces))
    np.testing.assert_allclose(_centred(found), _centred(shapes), atol=1e-8)
    np.testing.assert_allclose(found.mean(axis=1), np.tile(mesh.mean(axis=0), (3, 1)), atol=1e-8)


def test_the_ways_of_a_long_curl_go_on_beyond_half_a_turn():
    mesh, faces = strip()
    turns, stretches = arap.ways(mesh, curled(mesh, 5.0)[None], faces)
    assert np.ptp(turns) > 4.5
    np.testing.assert_allclose(stretches, np.swapaxes(stretches, -1, -2), atol=1e-12)


def _centred(shapes):
    return shapes - shapes.mean(axis=1, keepdims=True)


def test_a_point_of_collapsed_faces_alone_goes_with_its_place_and_disturbs_nobody():
    points, faces = strip(9, 3)
    bent = curled(points, 1.0)
    lone = len(points)  # on a side of the first face, in both keys: the face with it is flat
    flat = np.array([faces[0, 0], faces[0, 1], lone])
    start, end = (np.vstack([key, key[faces[0, :2]].mean(axis=0)]) for key in (points, bent))
    without = between(points, bent, faces, 0.0, 0.4, 1.0)
    shapes = between(start, end, np.vstack([faces, flat]), 0.0, 0.4, 1.0)
    assert np.allclose(shapes[:, :lone], without, atol=1e-6)
    s = np.array([0.0, 0.4, 1.0])[:, None]
    assert np.allclose(shapes[:, lone], (1 - s) * start[lone] + s * end[lone], atol=1e-6)
