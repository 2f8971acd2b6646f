"""The rasteriser against rays shot at triangles one by one, against a sphere's formula, and against exact areas."""

import numpy as np
import pytest

from retarget.characters.models.mesh import DrawnMesh, mesh
from retarget.characters.models.model import Material, Model
from retarget.stage import zbuffer
from retarget.stage.draw2d import draw_things

PAGE = (slice(0, 60), slice(0, 80))
WHITE = Material((1.0, 1.0, 1.0, 1.0))


def model(points, faces, materials=(WHITE,), surface=None, uv=None, **more):
    points, faces = np.asarray(points, float), np.asarray(faces)
    surface = np.zeros(len(faces), int) if surface is None else np.asarray(surface)
    uv = np.zeros((len(points), 2)) if uv is None else np.asarray(uv, float)
    return Model(points, faces, tuple(materials), surface, uv, **more)


def drawn(points, faces, eye=None, **more):
    """Triangles that lie on the page as given: x right, y down, z to the viewer."""
    skin = mesh("it", ("rest",), model(points, faces, **more), np.asarray(points, float)[None]).surface
    return DrawnMesh(np.asarray(points, float), skin, None if eye is None else np.asarray(eye, float))


def alpha(thing, window=PAGE):
    return zbuffer.render(thing, window)[..., 3]


def soup(seed, count=60):
    """Triangles every which way, crossing each other, some beyond the page."""
    rng = np.random.default_rng(seed)
    middles = rng.uniform([-5, -5, -20], [85, 65, 20], (count, 1, 3))
    return (middles + rng.normal(0, 9, (count, 3, 3))).reshape(-1, 3), np.arange(3 * count).reshape(-1, 3)


def shot(thing, places):
    """Which triangle each ray meets first (P,), -1 for none: Moeller and Trumbore, all rays against all triangles."""
    corners = thing.points[thing.surface.faces]
    starts = np.column_stack([places, np.full(len(places), 1e3)])
    away = np.tile([0.0, 0, -1], (len(places), 1))
    if thing.eye is not None:
        starts = np.tile(thing.eye, (len(places), 1))
        away = np.column_stack([places, np.zeros(len(places))]) - thing.eye
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    across = np.cross(away[:, None], b[None])
    over = (across * a).sum(-1)
    offset = starts[:, None] - corners[:, 0]
    u = (offset * across).sum(-1) / over
    other = np.cross(offset, a[None])
    v = (other * away[:, None]).sum(-1) / over
    far = (other * b).sum(-1) / over
    far = np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (far > 0), far, 1e9)
    nearest = np.sort(far, axis=1)
    missed = nearest[:, 0] == 1e9
    clear = missed | (nearest[:, 1] - nearest[:, 0] > 1e-4 * nearest[:, 0])  # no two surfaces as near as each other
    return np.where(missed, -1, far.argmin(axis=1)), clear


@pytest.mark.parametrize("eye", [None, (40, 30, 90)])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_every_pixel_shows_the_triangles_that_rays_meet_first(seed, eye):
    points, faces = soup(seed)
    points[:, 2] = np.minimum(points[:, 2], 40)  # none near the eye: those are left out
    thing = drawn(points, faces, eye)
    height, width = 60, 80
    y, x = np.mgrid[:height, :width]
    middle = np.stack([x, y], axis=-1)[:, :, None]
    found, clear = shot(thing, (middle + zbuffer.PLACES).reshape(-1, 2))
    seen, counts = found.reshape(height, width, 4), clear.reshape(height, width, 4)
    truth = (seen >= 0).mean(axis=-1)
    off = np.abs(alpha(thing) - truth)
    assert (off > 0.01).mean() < 2e-3  # corners are put on a fine grid: a place on an edge may change sides
    which = np.full((height, width, 4), -1, np.int32)
    _cover_into(thing, which)
    assert (which != seen)[counts].mean() < 2e-3
    assert len(np.unique(which)) > 30


def _cover_into(thing, which):
    flat = zbuffer.projected(thing).copy()
    flat[:, :2] = np.round(flat[:, :2] * zbuffer.GRID) / zbuffer.GRID
    corners = flat[thing.surface.faces]
    doubled = zbuffer._doubled_areas(corners)
    count = len(corners)
    textures = (np.zeros((count, 3, 2)), np.ones((count, 3)), thing.surface.number, np.zeros(count))
    nearest = np.full(which.shape, -np.inf, np.float32)
    every = np.arange(count)
    zbuffer._compiled()[0](corners, doubled, every, zbuffer.PLACES, (*textures, *thing.surface.packed), which, nearest)


def ball(rings=48, radius=20.0, centre=(40.0, 30.0, 0.0)):
    """A sphere of latitudes and longitudes, with its poles at the top and the bottom, and where it is (u, v)."""
    v, u = np.meshgrid(np.linspace(0, np.pi, rings + 1), np.linspace(0, 2 * np.pi, 2 * rings + 1), indexing="ij")
    out = np.stack([np.sin(v) * np.sin(u), -np.cos(v), np.sin(v) * np.cos(u)], axis=-1).reshape(-1, 3)
    corner = (np.arange(rings)[:, None] * (2 * rings + 1) + np.arange(2 * rings)).ravel()
    below = corner + 2 * rings + 1
    faces = np.concatenate([np.stack([corner, below, below + 1], -1), np.stack([corner, below + 1, corner + 1], -1)])
    keep = [len(set(map(tuple, np.round(out[face], 9)))) == 3 for face in faces]
    return np.asarray(centre) + radius * out, faces[keep], np.column_stack([u.ravel() / (2 * np.pi), v.ravel() / np.pi])


def test_the_outline_of_a_sphere_is_a_disc():
    assert alpha(drawn(*ball()[:2])).sum() == pytest.approx(np.pi * 20**2, rel=0.005)
    away, radius = 60.0, 20.0  # the cone from the eye that touches the sphere meets the page in a larger disc
    touching = radius * away / np.sqrt(away**2 - radius**2)
    near = alpha(drawn(*ball()[:2], eye=(40, 30, 60)))
    assert near.sum() == pytest.approx(np.pi * touching**2, rel=0.01)


def test_a_sphere_is_lit_as_its_formula_says():
    color = zbuffer.render(drawn(*ball(64)[:2]), PAGE)
    y, x = np.mgrid[:60, :80]
    normal = np.stack([x - 40.0, y - 30.0], axis=-1) / 20
    inside = (normal**2).sum(-1) < 0.9
    normal = np.concatenate([normal, np.sqrt(np.maximum(1 - (normal**2).sum(-1), 0))[..., None]], axis=-1)
    light = np.full(inside.shape, zbuffer.AMBIENT)
    for *towards, strength in zbuffer.LIGHTS:
        light += strength * np.maximum(normal @ np.array(towards) / np.linalg.norm(towards), 0)
    truth = np.minimum(light ** (1 / 2.2), 1)
    assert np.abs(color[..., 0] - truth)[inside].max() < 0.01
    assert np.ptp(truth[inside]) > 0.3


def test_half_a_pixel_covered_is_half_opaque_whatever_the_slope():
    rng = np.random.default_rng(4)
    off = []
    for _ in range(40):
        triangle = rng.uniform([5, 5], [75, 55], (3, 2))
        a, b = triangle[1] - triangle[0], triangle[2] - triangle[0]
        area = 0.5 * abs(a[0] * b[1] - a[1] * b[0])
        edges = np.linalg.norm(triangle - np.roll(triangle, 1, axis=0), axis=1).sum()
        cover = alpha(drawn(np.column_stack([triangle, np.zeros(3)]), [[0, 1, 2]]))
        off.append((cover.sum() - area) / edges)
        assert set(np.unique(cover)) <= {0, 0.25, 0.5, 0.75, 1}
    assert np.abs(off).max() < 0.05 and abs(np.mean(off)) < 0.005  # pixels of area for a pixel of edge


def test_a_slow_edge_gets_softer_in_four_steps_when_steep_and_when_flat():
    for axis in (0, 1):
        steps = []
        for shift in np.arange(8) / 8:
            low, high = np.array([10.0, 10]), np.array([50.0, 50])
            low[axis] += shift - 7 / 16
            corners = [(low[0], low[1], 0), (high[0], low[1], 0), (high[0], high[1], 0), (low[0], high[1], 0)]
            cover = alpha(drawn(corners, [[0, 1, 2], [0, 2, 3]]))
            steps.append(cover[30, 10] if axis == 0 else cover[10, 30])
        assert sorted(set(steps), reverse=True) == [1, 0.75, 0.5, 0.25, 0]
        assert steps == sorted(steps, reverse=True)


def test_triangles_that_share_edges_leave_no_gap_and_no_seam():
    rng = np.random.default_rng(8)
    from scipy.spatial import Delaunay

    border = [(5, 5), (75, 5), (75, 55), (5, 55)]
    flat = np.vstack([border, rng.uniform(5, [75, 55], (400, 2))])
    faces = Delaunay(flat).simplices
    turned = [face if n % 2 else face[::-1] for n, face in enumerate(faces)]  # seen from both sides
    color = zbuffer.render(drawn(np.column_stack([flat, np.zeros(len(flat))]), turned), PAGE)
    inside = color[7:54, 7:74]
    assert inside[..., 3].min() == 1
    assert np.ptp(inside[..., :3]) < 1e-6


def checks(size=64, tiles=8):
    y, x = np.mgrid[:size, :size] * tiles // size
    grey = np.where((x + y) % 2, 255, 0).astype(np.uint8)
    return np.dstack([grey, grey, grey, np.full_like(grey, 255)])


def quad(corners, **more):
    return drawn(corners, [[0, 1, 2], [0, 2, 3]], uv=[[0, 0], [1, 0], [1, 1], [0, 1]], **more)


def test_a_texture_lies_upright_and_its_corners_in_the_corners():
    texture = np.zeros((2, 2, 4), np.uint8)
    texture[..., 3] = 255
    texture[0, 0, 0] = texture[0, 1, 1] = texture[1, 0, 2] = 255  # red green / blue black
    square = quad([(-0.5, -0.5, 0), (59.5, -0.5, 0), (59.5, 59.5, 0), (-0.5, 59.5, 0)], materials=[_shown(texture)])
    color = zbuffer.render(square, PAGE)[..., :3]
    strongest = [color[15, 15].argmax(), color[15, 45].argmax(), color[45, 15].argmax()]
    assert strongest == [0, 1, 2] and color[45, 45].max() == pytest.approx(0, abs=0.02)
    ramp = color[15, 16:44, 0]
    np.testing.assert_allclose(np.diff(ramp), ramp[1] - ramp[0], atol=1e-5)  # straight between two texels


def _shown(texture, cut_out=False):
    return Material((1.0, 1.0, 1.0, 1.0), texture, cut_out)


def test_a_texture_much_too_large_turns_to_its_mean_and_does_not_sparkle():
    small = quad([(10, 10, 0), (30, 10, 0), (30, 30, 0), (10, 30, 0)], materials=[_shown(checks(512, 256))])
    color = zbuffer.render(small, PAGE)[12:28, 12:28, 0]
    assert np.ptp(color) < 0.01
    lit = zbuffer.render(quad([(10, 10, 0), (30, 10, 0), (30, 30, 0), (10, 30, 0)]), PAGE)[20, 20, 0]
    assert color.mean() == pytest.approx(lit / 2, abs=0.01)


def test_a_picture_on_a_tilted_wall_is_seen_in_perspective():
    """A point of the wall shows the texture that lies there in space, not half-way along the drawn triangle."""
    gradient = np.tile(np.linspace(0, 255, 256).astype(np.uint8)[None, :, None], (256, 1, 4))
    gradient[..., 3] = 255
    eye = np.array([40.0, 30, 80])
    corners = np.array([(10, 10, 0), (70, 10, -120), (70, 50, -120), (10, 50, 0)], float)
    wall = quad(corners, eye=eye, materials=[_shown(gradient)])
    color = zbuffer.render(wall, PAGE)
    flat = quad(corners, eye=eye)
    lit = zbuffer.render(flat, PAGE)
    for s in (0.25, 0.5, 0.75):
        point = (1 - s) * corners[0] + s * corners[1] + [0, 20, 0]
        page = eye[:2] + (point[:2] - eye[:2]) * eye[2] / (eye[2] - point[2])
        column = page[0]
        row = round(page[1])
        shade = color[row, :, 0] / np.maximum(lit[row, :, 0], 1e-9)
        assert np.interp(column, np.arange(80), shade) == pytest.approx(s, abs=0.02)


def test_holes_of_a_cut_out_texture_show_what_is_behind():
    texture = np.full((64, 64, 4), 255, np.uint8)
    texture[:, 32:, 3] = 0
    front = [(0, 0, 5), (60, 0, 5), (60, 60, 5), (0, 60, 5)]
    back = [(0, 0, -5), (60, 0, -5), (60, 60, -5), (0, 60, -5)]
    faces, uv = [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]], [[0, 0], [1, 0], [1, 1], [0, 1]] * 2
    red = Material((1.0, 0.0, 0.0, 1.0))
    both = [_shown(texture, cut_out=True), red]
    color = zbuffer.render(drawn(front + back, faces, materials=both, surface=[0, 0, 1, 1], uv=uv), PAGE)
    assert color[30, 15, 1] > 0.5 and color[30, 45, 1] == 0 < color[30, 45, 0]
    alone = zbuffer.render(drawn(front, faces[:2], materials=both[:1], uv=uv[:4]), PAGE)
    assert alone[30, 15, 3] == 1 and alone[30, 45, 3] == 0


def test_the_edges_of_a_cube_stay_sharp_and_a_seam_in_the_texture_does_not_show():
    cube = np.array([(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)
    sides = [(0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5)]
    faces = [tri for a, b, c, d in sides for tri in ((a, b, c), (a, c, d))]
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    color = zbuffer.render(drawn([40, 30, 0] + 28 * (cube - 0.5) @ turn, faces), PAGE)
    solid = color[..., 0][color[..., 3] == 1]
    counts = np.unique(np.round(solid, 4), return_counts=True)[1]
    assert (counts > 60).sum() == 3 and counts[counts > 60].sum() > 0.85 * len(solid)  # three sides, each of one grey
    points, faces, _ = ball(24)
    split = zbuffer.render(drawn(points[faces].reshape(-1, 3), np.arange(3 * len(faces)).reshape(-1, 3)), PAGE)
    np.testing.assert_allclose(split, zbuffer.render(drawn(points, faces), PAGE), atol=1e-5)


def test_a_mesh_that_is_no_surface_is_drawn_all_the_same():
    """Three sheets on one edge, a face twice, a face without area, a point in no face."""
    points = [(40, 5, 0), (40, 55, 0), (10, 30, 0), (70, 30, 0), (40, 30, 9), (5, 5, 0)]
    faces = [[0, 1, 2], [0, 1, 3], [0, 1, 4], [0, 1, 2], [2, 2, 3]]
    color = zbuffer.render(drawn(points, faces), PAGE)
    assert np.isfinite(color).all()
    assert color[..., 3].sum() == pytest.approx(60 * 50 / 2, rel=0.01)


def test_what_lies_behind_the_eye_is_not_drawn():
    points, faces = soup(5)
    points[:, 2] += 95
    color = zbuffer.render(drawn(points, faces, eye=(40, 30, 90)), PAGE)
    assert np.isfinite(color).all() and color.max() <= 1


def test_a_model_lies_on_the_page_with_straight_alpha_in_its_turn():
    thing = drawn(*ball()[:2])
    alone = draw_things([thing], (80, 60)).astype(float)
    assert alone[alone[..., 3] > 0][:, :3].min() > 60  # no dark fringe
    photo = np.random.default_rng(1).integers(0, 256, (60, 80, 3), dtype=np.uint8)
    over = draw_things([thing], (80, 60), photo)
    share = alone[..., 3:] / 255
    assert np.abs(alone[..., :3] * share + photo * (1 - share) - over).max() < 3
    red, blue = (
        drawn(np.array([(10, 10, z), (60, 10, z), (10, 50, z)]), [[0, 1, 2]], materials=[Material(color)])
        for z, color in ((100, (1.0, 0, 0, 1)), (0, (0, 0, 1.0, 1)))
    )
    assert draw_things([red, blue], (80, 60))[20, 20, 2] > 100  # drawn later, though its depth is less
    assert (
        draw_things([drawn(np.array([(900, 10, 0), (960, 10, 0), (910, 50, 0)]), [[0, 1, 2]])], (80, 60))[..., 3].max()
        == 0
    )
