"""Starting pools do to any skeleton of a kind what their postures are called."""

import numpy as np
import pytest

from capture.errors import InputError
from fixtures import plants
from fixtures.skeletons import walk
from mocap.body import find_body
from mocap.posing import postures, starting
from mocap.posing.standing import stood
from mocap.skeleton import Skeleton


def person():
    made = walk(0.1)
    return Skeleton(made.names, made.parents, made.offsets)


def with_spread_arms():
    """The same person at rest in a T-pose, and its hips half a turn round."""
    skeleton = person()
    offsets = skeleton.offsets.copy()
    for joint, name in enumerate(skeleton.names):
        if "ForeArm" in name or "Hand" in name:
            side = 1 if name.startswith("Left") else -1
            x, y, z = offsets[joint]
            offsets[joint] = (-side * y, side * x, z)
    return Skeleton(skeleton.names, skeleton.parents, offsets * [-1, 1, -1])


def dog():
    """Four legs, a neck with a head, and a tail; it looks along z."""
    names, parents, offsets = ["Hips", "Spine", "Chest", "Neck", "Head", "Tail1", "Tail2"], [-1, 0, 1, 2, 3, 0, 5], []
    offsets = [
        [0, 0.5, 0],
        [0, 0, 0.25],
        [0, 0, 0.25],
        [0, 0.1, 0.1],
        [0, 0.15, 0.1],
        [0, 0.02, -0.1],
        [0, -0.05, -0.2],
    ]
    for end, base, z in (("Hind", 0, 0.0), ("Front", 2, 0.02)):
        for side, x in (("Left", 0.08), ("Right", -0.08)):
            for n, (link, way) in enumerate(
                (("UpLeg", [x, -0.02, z]), ("Leg", [0, -0.22, 0.02]), ("Foot", [0, -0.24, -0.02]))
            ):
                parents.append(base if n == 0 else len(names) - 1)
                names.append(f"{side}{end}{link}")
                offsets.append(way)
    return Skeleton(tuple(names), tuple(parents), np.array(offsets, float))


def plant(made):
    return Skeleton(made.names, made.parents, made.offsets)


def places(skeleton, posture, extent=1.0, rest=None):
    """Where joints are by name, and their places at rest."""
    turns = postures.turns_of(posture, skeleton, extent)
    moved, still = postures.posed(skeleton, np.stack([turns, 0 * turns]), 24, rest).positions()
    return dict(zip(skeleton.names, moved)), dict(zip(skeleton.names, still))


@pytest.mark.parametrize(
    ("skeleton", "kind"),
    [(person(), "human"), (with_spread_arms(), "human"), (dog(), "quadruped"), (plant(plants.flower()), "plant")]
    + [(plant(plants.lamp()), "plant"), (plant(plants.reed()), "plant")],
)
def test_each_kind_gets_its_pool_and_none_of_its_postures_is_nothing(skeleton, kind):
    assert starting.kind_of(skeleton) == kind
    pool = starting.starting_pool(skeleton)
    assert pool.kind == kind and len(pool.names()) >= 8
    for posture in pool.postures:
        turns = postures.turns_of(posture, skeleton)
        assert np.isfinite(turns).all() and turns.any(), posture.name


@pytest.mark.parametrize("skeleton", [person(), with_spread_arms()])
def test_a_person_does_what_the_posture_says_from_any_rest_pose_and_facing(skeleton):
    pool = starting.human(skeleton)
    ahead = 1.0 if skeleton is not None and skeleton.offsets[skeleton.names.index("LeftToeBase"), 2] > 0 else -1.0
    for side, left in (("Left", ahead), ("Right", -ahead)):
        low = side.lower()
        now, was = places(skeleton, pool[f"{low} arm raised"])
        assert now[f"{side}Hand"][1] > now["Head"][1]
        now, was = places(skeleton, pool[f"{low} arm out"])
        assert left * (now[f"{side}Hand"] - now[f"{side}Arm"])[0] > 0.5
        now, was = places(skeleton, pool[f"{low} leg raised"])
        assert (now[f"{side}Foot"] - was[f"{side}Foot"])[1] > 0.8
        assert ahead * (now[f"{side}Foot"] - was[f"{side}Foot"])[2] > 0.8
        now, was = places(skeleton, pool[f"{low} knee bent"])  # backwards, as knees do
        assert ahead * (now[f"{side}Foot"] - was[f"{side}Foot"])[2] < -0.3
        assert now[f"{side}Leg"] == pytest.approx(was[f"{side}Leg"])
        now, was = places(skeleton, pool[f"lean {low}"])
        assert left * (now["Head"] - was["Head"])[0] > 0.1
        assert now[f"{side}Foot"] == pytest.approx(was[f"{side}Foot"])
    now, was = places(skeleton, pool["bow"])
    assert ahead * (now["Head"] - was["Head"])[2] > 0.2


def test_postures_at_100_percent_go_about_twice_as_far_as_at_50():
    skeleton = person()
    pool = starting.human(skeleton)
    half, was = places(skeleton, pool["lean left"], 0.5)
    full, _ = places(skeleton, pool["lean left"], 1.0)
    assert 1.6 < (full["Head"] - was["Head"])[0] / (half["Head"] - was["Head"])[0] < 2.1


def test_arms_hang_in_the_standing_rest_whatever_the_files_rest_is():
    for skeleton in (person(), with_spread_arms()):
        rest = starting.standing(skeleton)
        now, _ = places(skeleton, postures.Posture("rest"), 1.0, rest)
        for side in ("Left", "Right"):
            for first, second in (("Arm", "ForeArm"), ("ForeArm", "Hand"), ("UpLeg", "Leg")):
                link = now[side + second] - now[side + first]
                assert link[1] < -0.98 * np.linalg.norm(link), (side, first)


def test_a_crouch_keeps_its_feet_flat_and_where_they_stood():
    skeleton = person()
    body = find_body(skeleton)
    pool = starting.human(skeleton)
    for name in ("crouch", "hips left"):
        extents = np.linspace(0, 1.2, 7)
        motion = postures.posed(skeleton, np.stack([postures.turns_of(pool[name], skeleton, e) for e in extents]), 24)
        still = motion.positions()[0]
        now = stood(motion, body.feet, still).positions()
        for foot in ("LeftFoot", "LeftToeBase", "RightFoot", "RightToeBase", "LeftToeBase end"):
            joint = skeleton.names.index(foot)
            assert np.abs(now[:, joint] - still[joint]).max() < 1e-6, (name, foot)
        assert np.linalg.norm(now[-1, 0] - still[0]) > 0.1


def test_who_lifts_a_leg_stands_on_the_other():
    skeleton = person()
    body = find_body(skeleton)
    turns = postures.turns_of(starting.human(skeleton)["left knee up"], skeleton)
    motion = postures.posed(skeleton, np.stack([0 * turns, turns]), 24)
    still = motion.positions()[0]
    foot = skeleton.names.index("RightToeBase")
    assert stood(motion, body.feet, still).positions()[1, foot] == pytest.approx(still[foot], abs=1e-6)


def test_a_dog_lifts_the_leg_that_is_said_and_wags_to_the_side_that_is_said():
    skeleton = dog()
    pool = starting.quadruped(skeleton)
    for end in ("Front", "Hind"):
        for side in ("Left", "Right"):
            now, was = places(skeleton, pool[f"{side.lower()} {end.lower()} leg lifted"])
            assert (now[f"{side}{end}Foot"] - was[f"{side}{end}Foot"])[1] > 0.08
            still = [name for name in now if end not in name or side not in name]
            assert max(np.abs(now[name] - was[name]).max() for name in still) < 1e-9
    now, was = places(skeleton, pool["tail left"])
    assert now["Tail2"][0] > was["Tail2"][0] + 0.02
    now, was = places(skeleton, pool["tail up"])
    assert now["Tail2"][1] > was["Tail2"][1] + 0.02
    now, was = places(skeleton, pool["head up"])
    assert (now["Head"] - now["Neck"])[1] > (was["Head"] - was["Neck"])[1]


@pytest.mark.parametrize("made", [plants.flower(), plants.lamp(), plants.reed()])
def test_a_plant_leans_where_it_is_said_and_its_base_stays(made):
    skeleton = plant(made)
    pool = starting.plant(skeleton)
    for name, axis, sign in (("bow", 2, 1), ("lean back", 2, -1), ("lean left", 0, 1), ("lean right", 0, -1)):
        now, was = places(skeleton, pool[name])
        top = max(was, key=lambda joint: was[joint][1])
        assert sign * (now[top] - was[top])[axis] > 0.1 * was[top][1], name
        assert now[made.names[1]] == pytest.approx(was[made.names[1]])


def test_a_flower_opens_and_wilts():
    skeleton = plant(plants.flower())
    pool = starting.plant(skeleton)

    def width(joints):
        tips = np.array([joints[f"petal {n} middle"] for n in range(1, 7)])
        return np.linalg.norm(tips - tips.mean(axis=0), axis=1).mean()

    now, was = places(skeleton, pool["open"])
    shut, _ = places(skeleton, pool["close"])
    assert width(shut) < 0.9 * width(was) < 0.9 * width(now)
    now, was = places(skeleton, pool["wilt"])
    assert now["petal 1"][1] < was["petal 1"][1] - 0.05 and now["stem 3"][1] > 0.9 * was["stem 3"][1]


def test_what_lacks_the_limbs_or_joints_of_a_kind_is_refused():
    with pytest.raises(InputError, match="no left arm"):
        starting.human(plant(plants.lamp()))
    with pytest.raises(InputError, match="four legs"):
        starting.quadruped(person())
    with pytest.raises(InputError, match="between its root and its tips"):
        starting.plant(Skeleton(("root", "tip"), (-1, 0), np.array([[0, 0, 0], [0, 1.0, 0]])))
