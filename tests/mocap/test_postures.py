"""Laws of postures and their extent, pools that go through their files, and that bad ones are refused."""

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from capture.errors import InputError
from fixtures.skeletons import walk
from mocap.body import find_body
from mocap.posing import postures
from mocap.posing.postures import Pool, Posture
from mocap.skeleton import Skeleton, SkeletonMotion


@pytest.fixture(scope="module")
def figure():
    made = walk(1.0, 30)
    skeleton = Skeleton(made.names, made.parents, made.offsets)
    return SkeletonMotion(skeleton, made.translation, made.rotation, made.fps)


WAVE = Posture("wave", {"LeftArm": (0.3, -0.2, 2.0), "LeftHand": (0.0, 0.5, 0.1)})
BOW = Posture("bow", {"Spine": (0.8, 0.0, 0.0)})


def turned_alike(first, second):
    away = Rotation.from_quat(first.reshape(-1, 4)).inv() * Rotation.from_quat(second.reshape(-1, 4))
    return np.degrees(away.magnitude().max())


def test_extent_0_is_rest_and_1_the_posture(figure):
    rest = figure.rotation[3]
    kept = postures.posture_of(figure, 20, "step", rest)
    turns = np.stack([postures.turns_of(kept, figure.skeleton, extent) for extent in (0, 1)])
    played = postures.posed(figure.skeleton, turns, 30, rest)
    assert turned_alike(played.rotation[0], rest) < 1e-9
    assert turned_alike(played.rotation[1], figure.rotation[20]) < 1e-6


def test_between_rest_and_posture_lies_the_slerp_and_beyond_it_goes_on(figure):
    rest = figure.rotation[3]
    joint = figure.skeleton.names.index("LeftArm")
    ends = (
        Rotation.from_quat(rest[joint]),
        Rotation.from_quat(rest[joint]) * Rotation.from_rotvec(WAVE.turns["LeftArm"]),
    )
    slerp = Slerp([0, 1], Rotation.concatenate(ends))
    for extent in (0.25, 0.5, 0.9):
        own = postures.turned(rest, postures.turns_of(WAVE, figure.skeleton, extent))[joint]
        assert turned_alike(own, slerp(extent).as_quat()) < 1e-9
    step = ends[0].inv() * ends[1]
    twice = postures.turned(rest, postures.turns_of(WAVE, figure.skeleton, 2.0))[joint]
    assert turned_alike(twice, (ends[1] * step).as_quat()) < 1e-9


def test_postures_of_different_joints_mix_without_touching_each_other(figure):
    pool = Pool((WAVE, BOW))
    both = postures.mixed(pool, {"wave": 0.7, "bow": 1.5}, figure.skeleton)
    names = figure.skeleton.names
    assert both[names.index("LeftArm")] == pytest.approx(0.7 * np.array(WAVE.turns["LeftArm"]))
    assert both[names.index("Spine")] == pytest.approx([1.2, 0, 0])
    assert np.count_nonzero(both.any(axis=1)) == 3
    joined = postures.combined("both", [WAVE, BOW], [0.7, 1.5])
    assert postures.turns_of(joined, figure.skeleton) == pytest.approx(both)


def test_a_part_of_the_body_takes_its_own_joints_only_fingers_and_all(figure):
    body = find_body(figure.skeleton, figure.positions())
    whole = postures.posture_of(figure, 20, "step")
    whole = postures.combined("step", [whole, Posture("curl", {"LeftHandIndex1": (0.4, 0, 0)})])
    arm = postures.only(whole, ["left arm"], figure.skeleton, body)
    assert set(arm.turns) == {"LeftArm", "LeftForeArm", "LeftHandIndex1", "LeftHandThumb1"}
    assert all(arm.turns[joint] == whole.turns[joint] for joint in arm.turns)
    with pytest.raises(InputError, match="no 'left wing'"):
        postures.only(whole, ["left wing"], figure.skeleton, body)


def test_a_posture_from_a_frame_does_not_depend_on_where_the_figure_faced(figure):
    heading = Rotation.from_rotvec([0, 1.2, 0])
    rotation = figure.rotation.copy()
    rotation[:, 0] = (heading * Rotation.from_rotvec([0.2, 0, 0.1]) * Rotation.from_quat(rotation[:, 0])).as_quat()
    facing = SkeletonMotion(figure.skeleton, figure.translation, rotation, 30)
    root = np.array(postures.posture_of(facing, 9, "leant").turns["Hips"])
    assert root == pytest.approx([0.2, 0, 0.1], abs=0.02)
    assert postures.posture_of(facing, 9, "leant").turns["LeftUpLeg"] == pytest.approx(
        postures.posture_of(figure, 9, "leant").turns["LeftUpLeg"]
    )


def test_a_posture_joins_the_pool_in_the_place_of_its_name():
    pool = postures.with_posture(Pool((WAVE, BOW), "human"), Posture("wave", {"LeftArm": (0, 0, 1.0)}))
    assert pool.names() == ("wave", "bow") and pool["wave"].turns == {"LeftArm": (0, 0, 1.0)}
    assert postures.with_posture(pool, Posture("nod")).names() == ("wave", "bow", "nod")


def test_a_pool_that_goes_through_its_file_is_the_same_to_the_last_bit(tmp_path, figure):
    kept = tuple(postures.posture_of(figure, frame, f"step {frame} ☂") for frame in (0, 7, 20))
    pool = Pool((*kept, WAVE, Posture("rest")), "human")
    postures.write_pool(pool, tmp_path / "a.postures.json")
    read = postures.read_pool(tmp_path / "a.postures.json")
    assert read == pool
    postures.write_pool(read, tmp_path / "b.postures.json")
    assert (tmp_path / "a.postures.json").read_bytes() == (tmp_path / "b.postures.json").read_bytes()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda s: s.update(verison=1), "'verison' is no field of a pool"),
        (lambda s: s.update(version=2), "must be of version 1, it is of 2"),
        (lambda s: s.pop("kind"), "must have 'kind'"),
        (lambda s: s.update(postures=[]), "at least one posture"),
        (lambda s: s["postures"].append(s["postures"][0]), "two are called 'wave'"),
        (lambda s: s["postures"][0].update(turn={}), "'turn' is no field of a posture"),
        (lambda s: s["postures"][0].pop("turns"), "must have 'turns'"),
        (lambda s: s["postures"][0]["turns"].update(Hips=[1, 2]), "three finite numbers, 'Hips'"),
        (lambda s: s["postures"][0]["turns"].update(Hips=[1, 2, float("nan")]), "three finite numbers"),
        (lambda s: s["postures"][0]["turns"].update(Hips="up"), "three finite numbers"),
        (lambda s: s["postures"][0].update(name=""), "must have a name"),
    ],
)
def test_a_broken_pool_is_refused_by_what_is_wrong(tmp_path, change, said):
    path = tmp_path / "a.postures.json"
    postures.write_pool(Pool((WAVE,)), path)
    stored = json.loads(path.read_text())
    change(stored)
    path.write_text(json.dumps(stored))
    with pytest.raises(InputError, match=said):
        postures.read_pool(path)


def test_what_is_no_pool_or_is_not_there_is_refused(tmp_path):
    (tmp_path / "a.postures.json").write_text("{")
    (tmp_path / "b.postures.json").write_text("[1]")
    for name, said in (("a", "cannot be read"), ("b", "must be a table"), ("c", "there is no")):
        with pytest.raises(InputError, match=said):
            postures.read_pool(tmp_path / f"{name}.postures.json")


def test_an_empty_pool_a_strange_name_and_a_strange_skeleton_are_refused(figure):
    with pytest.raises(InputError, match="at least one posture"):
        Pool(())
    with pytest.raises(InputError, match=r"one of wave, bow; the pool has no 'jump'"):
        postures.mixed(Pool((WAVE, BOW)), {"jump": 1.0}, figure.skeleton)
    rope = Skeleton(("a", "b"), (-1, 0), np.zeros((2, 3)))
    with pytest.raises(InputError, match="joints that the skeleton has"):
        postures.turns_of(WAVE, rope)
    with pytest.raises(InputError, match="must be a number"):
        postures.turns_of(WAVE, figure.skeleton, np.nan)
    with pytest.raises(InputError, match="from 0 to 29"):
        postures.posture_of(figure, 30, "late")
