"""Models as targets: what moves a drawing moves them in the plane they are seen in, and what depth does is chosen."""

from dataclasses import replace

import numpy as np
import pytest

from capture.errors import InputError
from capture.motion import affine
from retarget.characters.models import lift
from retarget.characters.models.mesh import mesh, read_mesh
from retarget.characters.models.model import Material, Model
from retarget.stage.perform import perform, placement


def blob(count=60, seed=2):
    """Points of a lopsided body, y up, and faces between them."""
    from scipy.spatial import ConvexHull

    points = np.random.default_rng(seed).normal(size=(count, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    faces = ConvexHull(points).simplices
    return points * [0.5, 1.0, 0.7], faces


def model(points, faces):
    return Model(points, faces, (Material(),), np.zeros(len(faces), int), np.zeros((len(points), 2)))


def character(plane="xy", depth=lift.kept, names=("rest",), shapes=None, **changes):
    points, faces = blob()
    return replace(
        mesh("egg", names, model(points, faces), points[None] if shapes is None else shapes, plane, depth), **changes
    )


def bowed(points, by):
    """A body bent forwards, towards its own z."""
    return points + np.stack([0 * points[:, 0], 0 * points[:, 0], by * points[:, 1] ** 2], axis=-1)


@pytest.mark.parametrize("plane", ["xy", "zy", "-xy", "-zy", (-1.0, 0.4, 1.0)])
def test_a_motion_that_does_not_move_plays_the_model_unchanged(by_hand, plane):
    target = character(plane)
    role = perform(by_hand.motion(by_hand.still(2), [[1.0], [1.0]]), [target]).roles[0]
    seen = target.keys.points[0] @ target.view[:, :3].T
    size = np.ptp(role.points[0], axis=0) / np.ptp(seen, axis=0)
    assert size == pytest.approx(size[1])  # as large as it stands, in all three directions
    moved = affine.fit_similarity(target.keys.points[0] * [1, -1, 1], role.points[0])  # no mirror but y up to y down
    np.testing.assert_allclose(affine.apply(moved, target.keys.points[0] * [1, -1, 1]), role.points[0], atol=1e-9)
    low, high = role.points[0].min(axis=0), role.points[0].max(axis=0)
    assert (low[0] + high[0]) / 2 == pytest.approx(160) and high[1] == pytest.approx(200)  # on the egg's ground
    assert high[1] - low[1] == pytest.approx(100)  # and as tall
    assert low[2] + high[2] == pytest.approx(0)


@pytest.mark.parametrize("depth", [lift.kept, lift.even, lift.keeping_volume])
@pytest.mark.parametrize("plane", ["xy", "-zy", (-1.0, 0.4, 1.0)])
def test_what_is_seen_is_exactly_what_a_flat_character_would_do(by_hand, plane, depth):
    """Lifting the motion and looking at the plane is the plane's own motion."""
    maps = by_hand.tumble(6)
    target = character(plane, depth)
    motion = by_hand.motion(maps, np.ones((6, 1)), names=("sit",))
    role = perform(motion, [target]).roles[0]
    flat = (target.keys.points[0] @ target.view[:, :3].T)[:, :2]
    truth = affine.apply(affine.about(maps, np.array([160.0, 190])), affine.apply(placement(motion, target), flat))
    np.testing.assert_allclose(role.points[..., :2], truth, atol=1e-9)


def test_depth_is_kept_or_follows_the_area_or_keeps_the_volume(by_hand):
    squash = np.array([[[1.6, 0, 0], [0, 0.5, 0]], [[2.0, 0.3, 0], [0, 1.5, 0]]])
    motion = by_hand.motion(squash, np.ones((2, 1)), names=("sit",))
    still = by_hand.motion(by_hand.still(2), np.ones((2, 1)), names=("sit",))
    areas = np.linalg.det(squash[..., :2])
    for depth, truth in ((lift.kept, [1, 1]), (lift.even, np.sqrt(areas)), (lift.keeping_volume, 1 / areas)):
        before, after = (perform(played, [character(depth=depth)]).roles[0].points for played in (still, motion))
        np.testing.assert_allclose(np.ptp(after[..., 2], axis=1) / np.ptp(before[..., 2], axis=1), truth)
    volume = np.abs(np.linalg.det(affine.fit(before, after)[..., :3]))
    np.testing.assert_allclose(volume, 1, atol=1e-9)


def test_the_rules_for_depth_are_products_so_that_parts_hang_on_parts():
    a, b = np.random.default_rng(4).normal(size=(2, 5, 2, 3))
    for depth in (lift.kept, lift.even, lift.keeping_volume):
        if depth is lift.keeping_volume:
            a, b = (np.concatenate([m[..., :2] + 2 * np.eye(2), m[..., 2:]], axis=-1) for m in (a, b))
        np.testing.assert_allclose(depth(affine.compose(a, b)), depth(a) * depth(b))


def test_a_drawing_squashed_flat_makes_no_body_endless():
    assert lift.keeping_volume(np.zeros((2, 3))) == pytest.approx(1 / lift.THINNEST)


def test_a_model_looks_to_the_right_from_one_side_and_to_the_left_from_the_other():
    nose, top, left_hand = np.eye(3)[[2, 1, 0]]  # it looks along z; its left hand is at the viewer's right
    assert lift.view("xy") @ nose == pytest.approx([0, 0, 1])
    assert lift.view("zy") @ nose == pytest.approx([1, 0, 0])
    assert lift.view("-zy") @ nose == pytest.approx([-1, 0, 0])
    assert lift.view("-xy") @ nose == pytest.approx([0, 0, -1])
    for plane in lift.PLANES:
        assert lift.view(plane) @ top == pytest.approx([0, -1, 0])
    assert lift.view("xy") @ left_hand == pytest.approx([1, 0, 0])
    for plane in (*lift.PLANES, (1, 2, 3), (0, 1, 0), (0, -1, 0)):
        turn = lift.view(plane)
        np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(turn) == pytest.approx(-1)  # y up becomes y down: a mirror, and no other


def test_a_nod_to_the_viewer_is_no_captured_map_and_stays_in_the_key():
    """The whole affine map of space would take it out, and nothing in a drawing's plane could put it back."""
    points, _ = blob()
    c, s = np.cos(0.6), np.sin(0.6)
    nod = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    target = character("xy", names=("sit", "lean"), shapes=np.stack([points, points @ nod.T]))
    depth = target.keys.points[1, :, 2]
    np.testing.assert_allclose(depth, (points @ nod.T)[:, 2], atol=1e-12)


def test_in_betweens_go_straight_and_beyond_the_keys(by_hand):
    points, _ = blob()
    target = character(names=("sit", "lean"), shapes=np.stack([points, bowed(points, 0.5)]))
    rows = np.array([[0, 0, 0], [0, 1, 0.25], [1, 1, 0]])
    sit, quarter, lean = target.shapes(rows)
    np.testing.assert_allclose(quarter, 0.75 * sit + 0.25 * lean)
    role = perform(by_hand.motion(by_hand.still(1), [[-0.3, 1.3]]), [target]).roles[0]
    a, b = (perform(by_hand.motion(by_hand.still(1), [w]), [target]).roles[0].points for w in ([1.0, 0], [0, 1.0]))
    np.testing.assert_allclose(role.points, -0.3 * a + 1.3 * b, atol=1e-9)


def test_a_pivot_is_a_point_of_the_model(by_hand):
    quarter = np.array([[[0.0, -1, 0], [1, 0, 0]]])
    points, _ = blob()
    for plane in ("xy", "zy"):
        target = character(plane, pivot=points[7])
        still, turned = (
            perform(by_hand.motion(maps, [[1.0]], names=("sit",)), [target]).roles[0].points[0]
            for maps in (by_hand.still(), quarter)
        )
        np.testing.assert_allclose(turned[7], still[7], atol=1e-9)
        assert np.abs(turned - still).max() > 10


def test_with_perspective_the_near_side_is_larger_and_far_away_it_is_as_without(by_hand):
    motion = by_hand.motion(by_hand.still(), [[1.0]])
    from retarget.stage import zbuffer

    near, far, flat = (perform(motion, [character(distance=away)]).posed(0)[0] for away in (1.2, 1e6, None))
    depth = flat.points[:, 2]
    wide = [
        np.ptp(zbuffer.projected(near)[side, 0]) / np.ptp(flat.points[side, 0]) for side in (depth > 20, depth < -20)
    ]
    assert wide[0] > 1.1 > 0.95 > wide[1]
    np.testing.assert_allclose(zbuffer.projected(far)[:, :2], flat.points[:, :2], atol=1e-3)


def test_a_key_squashed_flat_and_a_plane_that_is_none_are_refused():
    points, faces = blob()
    with pytest.raises(InputError, match="must not be squashed flat"):
        mesh("egg", ("a", "b"), model(points, faces), np.stack([points, points * [1, 0, 1]]))
    with pytest.raises(InputError, match="no width or height there"):
        mesh("egg", ("a",), model(points * [0, 0, 1], faces), (points * [0, 0, 1])[None])
    with pytest.raises(InputError, match="a plane must be xy, zy"):
        lift.view("yz")
    with pytest.raises(InputError, match="three numbers"):
        lift.view((0, 0, 0))


@pytest.fixture
def boxes(tmp_path):
    """A box in two files of one mesh, and a third that has a point more."""
    corners = [(x, y, z) for z in (0, 1) for y in (0, 2) for x in (0, 1)]
    sides = ["1 3 4 2", "5 6 8 7", "1 2 6 5", "3 7 8 4", "1 5 7 3", "2 4 8 6"]
    files = []
    for name, lean in (("box_sit", 0.0), ("box_lean", 0.5)):
        lines = [f"v {x + lean * y} {y} {z}" for x, y, z in corners] + [f"f {side}" for side in sides]
        files.append(tmp_path / f"{name}.obj")
        files[-1].write_text("\n".join(lines))
    files.append(tmp_path / "box_more.obj")
    files[-1].write_text(files[0].read_text() + "\nv 9 9 9\nf 1 2 9\n")
    return files


def test_several_files_of_one_mesh_are_its_keys(boxes, by_hand):
    target = read_mesh("egg", by_hand.names, boxes[:2])
    sheared = affine.fit(target.keys.points[0], affine.apply(target.keys.removed[1], target.keys.points[1]))
    np.testing.assert_allclose(sheared[:, :3], [[1, 0.5, 0], [0, 1, 0], [0, 0, 1]], atol=1e-9)


def test_keys_of_other_meshes_are_refused(boxes, by_hand):
    with pytest.raises(InputError, match=r"box_more\.obj must be the same mesh as .*box_sit\.obj.*9 points, not 8"):
        read_mesh("egg", by_hand.names, [boxes[0], boxes[2]])
    text = boxes[1].read_text().replace("f 1 3 4 2", "f 3 4 2 1")
    boxes[1].write_text(text)
    with pytest.raises(InputError, match="joins its points to other faces"):
        read_mesh("egg", by_hand.names, boxes[:2])


def test_two_keys_of_a_file_without_morph_targets_are_refused(boxes, by_hand):
    with pytest.raises(InputError, match=r"morph target of its model, .*box_sit\.obj has none, and 'sit' and 'lean'"):
        read_mesh("egg", by_hand.names, [boxes[0], boxes[0]])
    with pytest.raises(InputError, match="'sit' asks for 'Smile'"):
        read_mesh("egg", by_hand.names, [boxes[0], boxes[1]], [{"Smile": 1.0}, {}])
