"""Section 3.4: the same motion, another character, on the same ground."""

from dataclasses import replace

import numpy as np
import pytest

from capture.errors import InputError
from capture.motion import affine, keys
from retarget.characters.drawings.drawing import outline_drawing, read_drawing
from retarget.stage.perform import perform

RED = np.array([1.0, 0, 0, 1])


def itself(motion, part="egg", **changes):
    return replace(outline_drawing(part, motion.keyset(part), RED), **changes)


def tumbling(by_hand, frames=6):
    rng = np.random.default_rng(5)
    weights = rng.dirichlet(np.ones(7), frames)
    return by_hand.motion(by_hand.tumble(frames), weights)


def walking(by_hand):
    """An egg with a second egg hanging on it, each turning about its own pivot."""
    frames = 5
    body = by_hand.motion(by_hand.tumble(frames), np.ones((frames, 1)), names=("sit",))
    arm = by_hand.motion(
        by_hand.tumble(frames)[::-1],
        np.ones((frames, 1)),
        names=("sit",),
        part="arm",
        parent="egg",
        pivot=np.array([180.0, 130]),
        order=np.array([1, 1, -1, 1, 1]),
    )
    return replace(body, tracks=body.tracks + arm.tracks, keysets=body.keysets + arm.keysets)


def test_a_part_on_a_parent_is_lent_too(by_hand):
    motion = walking(by_hand)
    performance = perform(motion, [itself(motion, "arm"), itself(motion)])
    for role, part in zip(performance.roles, ("egg", "arm"), strict=True):
        assert role.target.part == part
        assert np.abs(role.mesh() - motion.points(part)).max() < 1e-6


def test_the_size_of_a_drawing_does_not_matter(worm, by_hand, tmp_path):
    motion = tumbling(by_hand)
    larger = []
    for file in worm:
        larger.append(tmp_path / f"large_{file.name}")
        text = file.read_text().replace('width="320" height="240"', 'width="960" height="720"')
        larger[-1].write_text(text, encoding="utf-8")
    one, three = (perform(motion, [read_drawing("egg", by_hand.names, files)]) for files in (worm, larger))
    assert three.roles[0].target.box == pytest.approx(3 * one.roles[0].target.box, abs=0.2)
    for a, b in zip(one.posed(3), three.posed(3), strict=True):
        np.testing.assert_allclose(a.points, b.points, atol=1e-6)
        assert a.width == pytest.approx(b.width)


def test_key_0_stands_on_the_sources_ground_and_is_as_tall(worm, by_hand):
    motion = by_hand.motion(by_hand.still(), [[1.0]])
    for height in (1.0, 0.5, 2.0):
        character = replace(read_drawing("egg", by_hand.names, worm), height=height)
        role = perform(motion, [character]).roles[0]
        place = affine.fit(character.keys.points[0], role.mesh()[0])
        box = affine.apply(place, character.box)
        assert box[:, 0].mean() == pytest.approx(160)
        assert box[:, 1] == pytest.approx([200 - 100 * height, 200])


def test_twice_the_height_is_the_same_motion_twice_as_large_about_its_foot(by_hand):
    motion = walking(by_hand)
    one, two = (perform(motion, [itself(motion, part, height=h) for part in ("egg", "arm")]) for h in (1.0, 2.0))
    foot = np.array([160.0, 200.0])
    for a, b in zip(one.roles, two.roles, strict=True):
        np.testing.assert_allclose(b.points, foot + 2 * (a.points - foot), atol=1e-9)


def test_joints_stay_joints_between_parts_of_other_heights(by_hand):
    motion = walking(by_hand)
    body, arm = perform(motion, [itself(motion, height=0.7), itself(motion, "arm", height=1.6)]).roles
    still = perform(
        replace(motion, tracks=tuple(replace(t, affine=by_hand.still(5)) for t in motion.tracks)),
        [itself(motion, height=0.7), itself(motion, "arm", height=1.6)],
    ).roles
    pivot = np.array([160, 200]) + 0.7 * (np.array([180.0, 130]) - [160, 200])
    for t in range(5):
        of_body = affine.apply(affine.fit(still[0].points[0], body.points[t]), pivot[None])
        of_arm = affine.apply(affine.fit(still[1].points[0], arm.points[t]), pivot[None])
        travel = 1.6 * motion.track("arm").affine[t, :, 2]
        linear = affine.fit(still[0].points[0], body.points[t])[:, :2]
        np.testing.assert_allclose(of_arm - of_body, (linear @ travel)[None], atol=1e-6)


def test_a_target_turns_about_its_own_pivot_if_it_names_one(by_hand):
    quarter = np.array([[[0.0, -1, 0], [1, 0, 0]]])
    motion = by_hand.motion(quarter, [[1.0]], names=("sit",))
    pivot = np.array([150.0, 120.0])
    role = perform(motion, [itself(motion, pivot=pivot)]).roles[0]
    away = motion.keyset("egg").points[0] - pivot
    np.testing.assert_allclose(role.mesh()[0], pivot + away @ np.array([[0, 1], [-1, 0]]), atol=1e-9)


def test_a_rest_drawing_is_lent_the_affine_motion_alone(worm, by_hand):
    motion = tumbling(by_hand)
    character = read_drawing("egg", ("rest",), worm[:1])
    role = perform(motion, [character]).roles[0]
    for t in range(len(motion.times)):
        move = affine.fit(character.keys.points[0], role.mesh()[t])
        np.testing.assert_allclose(affine.apply(move, character.keys.points[0]), role.mesh()[t], atol=1e-9)
    assert affine.turn(move) == pytest.approx(affine.turn(motion.tracks[0].affine[-1]))


def test_parts_are_drawn_in_the_tracks_order_and_unseen_ones_not_at_all(by_hand):
    motion = walking(by_hand)
    blue = np.array([0, 0, 1.0, 1])
    targets = [itself(motion), outline_drawing("arm", motion.keyset("arm"), blue)]
    performance = perform(motion, targets)
    assert [path.fill[2] for path in performance.posed(0)] == [0, 1]
    assert [path.fill[2] for path in performance.posed(2)] == [1, 0]
    unseen = replace(motion.tracks[1], visible=np.zeros(5, bool))
    hidden = perform(replace(motion, tracks=(motion.tracks[0], unseen)), targets)
    assert len(hidden.posed(0)) == 1


def test_zoom_moves_pixel_corners_not_centres(by_hand):
    motion = tumbling(by_hand)
    performance = perform(motion, [itself(motion)])
    small, large = performance.posed(2)[0].points, performance.posed(2, 2.0)[0].points
    np.testing.assert_allclose(large + 0.5, 2 * (small + 0.5), atol=1e-9)


def test_keys_that_are_not_the_motions_are_refused(worm, by_hand):
    motion = tumbling(by_hand)
    character = read_drawing("egg", ("sit", "jump"), worm)
    with pytest.raises(InputError, match=r"part 'egg': the motion uses keys sit, lean, the target has sit, jump"):
        perform(motion, [character])


def test_a_target_for_a_part_that_is_not_there_is_refused(by_hand):
    motion = tumbling(by_hand)
    stranger = outline_drawing("tail", keys.keyset(("sit",), by_hand.egg()[None]), RED)
    with pytest.raises(InputError, match="this motion has no part 'tail'"):
        perform(motion, [stranger])


def test_two_targets_for_one_part_are_refused(by_hand):
    motion = tumbling(by_hand)
    with pytest.raises(InputError, match="one target only"):
        perform(motion, [itself(motion), itself(motion)])


def test_a_role_tells_what_it_mixed_so_that_its_shapes_can_be_lent_on(worm, by_hand):
    """The rows' shapes in the told weights are the role's own points, but for one affine map a frame."""
    weights = np.random.default_rng(6).dirichlet(np.ones(7), 4)
    role = perform(by_hand.motion(by_hand.tumble(4), weights), [read_drawing("egg", by_hand.names, worm)]).roles[0]
    mixed = np.tensordot(role.mixed, role.target.shapes(role.rows), axes=1)
    np.testing.assert_allclose(affine.apply(affine.fit(mixed, role.points), mixed), role.points, atol=1e-8)
