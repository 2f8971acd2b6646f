"""Feet stand where the source's feet stand, the rest of the performance goes over calmly, and nothing else changes."""

from dataclasses import replace

import numpy as np
import pytest

from capture.errors import InputError
from capture.motion import keys
from capture.motion.tracks import CartoonMotion, Track
from fixtures import frog, hat, walker
from retarget.characters.drawings.drawing import outline_drawing
from retarget.stage import staging
from retarget.stage.perform import perform

RED = np.array([1.0, 0, 0, 1])
GROUND, LEAVES, LANDS, FRAMES = 200.0, 12, 28, 40


def truth_of(toon):
    """A cartoon's truth as a motion: nothing is captured."""
    tracks, sets = [], []
    for number, part in enumerate(toon.parts):
        source = keys.keyset(part.key_names, part.points[part.key_frames])
        weights = np.zeros((len(toon), len(source.rows)))
        for k in range(len(part.key_names)):
            weights[:, np.flatnonzero((source.rows == [k, k, 0]).all(axis=1))[0]] = part.weights[:, k]
        held = np.diff(part.drawing, prepend=-1) == 0
        frames = np.ones(len(toon), bool)
        tracks.append(
            Track(
                part=part.name,
                parent=part.parent,
                pivot=part.pivot,
                keys=part.key_names,
                rows=source.rows,
                affine=part.affine,
                weights=weights,
                residual=0.0 * frames,
                visible=frames,
                held=held,
                order=np.full(len(toon), number),
            )
        )
        sets.append(source)
    return CartoonMotion(tuple(tracks), tuple(sets), np.arange(len(toon)) / toon.fps, toon.fps, toon.size)


def itself(motion, part):
    return outline_drawing(part, motion.keyset(part), RED)


def hopping(by_hand):
    """An egg that leans back on the ground, hops to the right, and stands; drawn on twos while it stands."""
    t = np.arange(FRAMES)
    air = np.clip((t - LEAVES) / (LANDS - LEAVES), 0, 1)
    held = (t % 2 == 1) & ((t < LEAVES - 2) | (t > LANDS + 2))
    shown = np.where(held, t - 1, t)
    lean = np.interp(shown, [2, LEAVES, LANDS, LANDS + 6], [0, 1, 1, 0])
    maps = by_hand.still(FRAMES)
    maps[:, 0, 2] = 110 * air
    maps[:, 1, 2] = -70 * 4 * air * (1 - air)
    motion = by_hand.motion(maps, np.stack([1 - lean, lean], axis=-1), held=held)
    track = motion.tracks[0]
    weights = np.zeros_like(track.weights)
    for k, share in enumerate((1 - lean, lean)):
        weights[:, np.flatnonzero((track.rows == [k, k, 0]).all(axis=1))[0]] = share
    return replace(motion, tracks=(replace(track, weights=weights),))


def long_legged(by_hand, motion):
    """A character whose leaning key reaches 70 pixels lower, and 70 further back, than its first one."""
    sit = by_hand.egg()
    low = np.clip((sit[:, 1:] - 180) / 20, 0, 1) ** 2
    keyset = keys.keyset(by_hand.names, np.stack([sit, by_hand.lean(sit, 40) + low * [-70.0, 70.0]]))
    return outline_drawing("egg", keyset, RED)


def lowest(performance):
    return performance.roles[0].mesh()[..., 1].max(axis=1)


def test_a_motion_on_its_own_keys_is_left_as_it_is():
    for toon in (frog.frog(), walker.walker()):
        motion = truth_of(toon)
        performance = perform(motion, [itself(motion, part.name) for part in toon.parts])
        assert staging.ground(motion) is not None
        for role, stood in zip(performance.roles, staging.stand(performance, motion).roles, strict=True):
            np.testing.assert_allclose(stood.points, role.points, atol=1e-9)


def test_the_ground_of_a_cartoon_is_found():
    assert staging.ground(truth_of(frog.frog())) == pytest.approx(426, abs=1)  # its ink lies 4 above the line
    assert staging.ground(truth_of(walker.walker())) == pytest.approx(walker.GROUND, abs=8)  # its feet roll


def test_a_source_that_swings_freely_has_no_ground_and_nothing_changes(by_hand):
    for motion in (truth_of(hat.hat()), by_hand.motion(by_hand.tumble(6), np.ones((6, 1)))):
        performance = perform(motion, [itself(motion, track.part) for track in motion.tracks])
        assert staging.ground(motion) is None
        assert staging.contacts(motion) == ()
        assert staging.stand(performance, motion) is performance


def test_a_frog_touches_the_ground_between_its_hops_only():
    found = staging.contacts(truth_of(frog.frog()))
    touching = np.zeros(frog.FRAMES, bool)
    for contact in found:
        touching[contact.start : contact.stop] = True
    t = np.arange(frog.FRAMES)
    standing = np.all([(t <= start) | (t >= stop) for start, stop, _ in frog.HOPS], axis=0)
    assert not (touching & ~standing).any()
    assert touching[standing].mean() > 0.8  # it slides as it lands, and the last drawing is but one


def test_a_walkers_foot_is_in_contact_while_its_leg_carries():
    found = staging.contacts(truth_of(walker.walker()))
    assert {contact.part for contact in found} == {"near leg", "far leg"}
    for side, late in (("near", 0), ("far", walker.PERIOD // 2)):
        carries = (np.arange(walker.FRAMES) + late) % walker.PERIOD < walker.PERIOD // 2
        touching = np.zeros(walker.FRAMES, bool)
        for contact in found:
            if contact.part == f"{side} leg":
                touching[contact.start : contact.stop] = True
        assert touching[carries].mean() > 0.7  # it rolls onto the sole, and off it
        beyond = touching & ~carries
        assert beyond.mean() < 0.1


def test_a_long_leg_neither_sinks_nor_slides(by_hand):
    motion = hopping(by_hand)
    sunk = perform(motion, [long_legged(by_hand, motion)])
    assert lowest(sunk).max() > GROUND + 20
    stood = staging.stand(sunk, motion)
    source = motion.outline("egg")[..., 1].max(axis=1)
    standing = np.abs(source - GROUND) < 1
    assert standing[:LEAVES].all() and not standing[LEAVES + 3 : LANDS - 3].any()
    np.testing.assert_allclose(lowest(stood)[standing], source[standing], atol=1e-9)
    assert lowest(stood).max() <= GROUND + 1e-9
    found = staging.contacts(motion)
    assert len(found) >= 2
    assert max(staging.slide(sunk, contact) for contact in found) > 5
    assert max(staging.slide(stood, contact) for contact in found) < 1e-9


def test_longer_legs_walk_farther_and_no_foot_slides():
    """The feet of a walker stand still, so legs 1.3 times as long carry the body 1.3 times as fast."""
    toon = walker.walker()
    motion = truth_of(toon)
    longer = [replace(itself(motion, p.name), height=1.3 if "leg" in p.name else 1.0) for p in toon.parts]
    sunk = perform(motion, longer)
    stood = staging.stand(sunk, motion)
    gained = (stood.roles[0].points - sunk.roles[0].points)[:, 0, 0]
    np.testing.assert_allclose(gained, 0.3 * walker.SPEED * 2 * (np.arange(walker.FRAMES) // 2), atol=0.5)
    slides = [[staging.slide(p, contact) for contact in staging.contacts(motion)] for p in (sunk, stood)]
    assert min(slides[0]) > 10 and max(slides[1]) < 0.5


def test_held_drawings_stay_held_and_the_air_stays_calm(by_hand):
    motion = hopping(by_hand)
    sunk = perform(motion, [long_legged(by_hand, motion)])
    stood = staging.stand(sunk, motion)
    held = np.flatnonzero(motion.tracks[0].held)
    np.testing.assert_array_equal(stood.roles[0].points[held], stood.roles[0].points[held - 1])
    offset = (stood.roles[0].points - sunk.roles[0].points)[:, 0]
    air = offset[LEAVES + 2 : LANDS - 1]
    hop = motion.tracks[0].affine[:, :, 2]
    kick = np.abs(np.diff(hop, 2, axis=0)).max()
    assert np.abs(np.diff(air, 2, axis=0)).max() < kick


def test_moving_the_stage_moves_the_result_only(by_hand):
    motion = hopping(by_hand)
    way = np.array([37.0, -21.0])
    keyset = motion.keysets[0]
    moved = replace(
        motion,
        tracks=(replace(motion.tracks[0], pivot=motion.tracks[0].pivot + way),),
        keysets=(replace(keyset, points=keyset.points + way),),
    )
    character = long_legged(by_hand, motion)
    here, there = (staging.stand(perform(m, [character]), m).roles[0].points for m in (motion, moved))
    np.testing.assert_allclose(there, here + way, atol=1e-6)


def test_twice_the_height_follows_feet_twice_as_far(by_hand):
    motion = hopping(by_hand)
    performance = perform(motion, [replace(itself(motion, "egg"), height=2.0)])
    stood = staging.stand(performance, motion)
    np.testing.assert_allclose(stood.roles[0].points, performance.roles[0].points, atol=1e-6)


def test_a_foot_is_kept_in_a_place_over_given_frames(by_hand):
    motion = hopping(by_hand)
    performance = perform(motion, [itself(motion, "egg")])
    foot, place = np.array([22, 23, 24]), np.array([120.0, 180.0])
    kept = staging.keep(performance, [staging.Stay("egg", 14, 18, foot, place), staging.Stay("egg", 25, 30, foot)], 0.1)
    there = kept.roles[0].points[:, foot].mean(axis=1)
    np.testing.assert_allclose(there[14:18], np.tile(place, (4, 1)), atol=1e-9)
    assert np.ptp(there[25:30], axis=0).max() < 1e-9
    moved = np.abs(kept.roles[0].points - performance.roles[0].points).max(axis=(1, 2))
    assert moved[0] < 0.1 * moved[14:18].max()  # it is forgotten in time
    assert staging.keep(performance, []) is performance


def test_a_performance_follows_a_path_at_its_own_pace(by_hand):
    motion = hopping(by_hand)
    performance = perform(motion, [itself(motion, "egg")])
    path = np.array([[50.0, 100.0], [150.0, 100.0], [250.0, 160.0]])
    before, after = performance.roles[0].mesh(), staging.follow(performance, path).roles[0].mesh()
    middle = after[..., 0].mean(axis=1)
    assert (middle[0], middle[-1]) == pytest.approx((50, 250))
    hop = after[..., 1].mean(axis=1) - before[..., 1].mean(axis=1)
    np.testing.assert_allclose(hop, np.interp(middle, *path.T) - 100, atol=1e-9)


def test_feet_that_are_not_there_are_refused(by_hand):
    motion = hopping(by_hand)
    performance = perform(motion, [itself(motion, "egg")])
    for stay, said in (
        (staging.Stay("tail", 0, 3, np.array([1])), "a part that is played"),
        (staging.Stay("egg", 38, 44, np.array([1])), "frames of the clip, 0 to 39, got 38 to 43"),
        (staging.Stay("egg", 0, 3, np.array([5000])), "points of part 'egg'"),
    ):
        with pytest.raises(InputError, match=said):
            staging.keep(performance, [stay])
    with pytest.raises(InputError, match="a path must be 2 or more points"):
        staging.follow(performance, np.zeros((1, 2)))
