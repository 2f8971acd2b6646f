"""A pose with its pins, feel and music in a file: written and read again it is equal; what is wrong is refused."""

import json

import numpy as np
import pytest

from capture.errors import InputError
from fixtures import skeletons
from mocap.posing import poses, stance
from mocap.posing.stance import Music
from mocap.skeletons.skeleton import Skeleton

FIGURE = skeletons.walk(0.1)
SKELETON = Skeleton(FIGURE.names, FIGURE.parents, np.array(FIGURE.offsets, float))
MUSIC = Music("song.wav", (0.5, 1.0, 1.5, 2.0), 120.0, 2.2)


@pytest.fixture
def kept():
    pose = poses.rest_of(SKELETON)
    turned = poses.Pose(pose.positions + [0.1, 0.2, 1 / 3], pose.turns)
    return stance.stance_of(SKELETON, turned, (3,), {"arms up": 0.3}, {"quick": 3.0}, MUSIC), turned


def test_written_and_read_again_it_is_equal_and_gives_the_pose(tmp_path, kept):
    stored, pose = kept
    stance.write_stance(stored, tmp_path / "a.posing.json")
    read = stance.read_stance(tmp_path / "a.posing.json")
    assert read == stored
    again = stance.pose_of(read, SKELETON)
    assert (again.positions == pose.positions).all() and np.abs(again.turns - pose.turns).max() < 1e-12
    assert stance.pinned_of(read, SKELETON) == (3,)


def test_the_pace_takes_more_or_fewer_of_the_beats():
    def times(pace):
        return Music("a.wav", MUSIC.times, 120.0, 2.2, pace).beats()

    assert times(1.0).times.tolist() == [0.5, 1.0, 1.5, 2.0]
    assert times(0.5).times.tolist() == [0.5, 1.5] and times(0.5).bpm == 60
    assert times(2.0).times.tolist() == [0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0] and times(2.0).bpm == 240


@pytest.mark.parametrize(
    ("change", "must"),
    [
        ({"pinned": ["Nose"]}, "pin some of them"),
        ({"version": 2}, "version"),
        ({"tail": 1}, "'tail' is no field"),
        ({"extents": {"a": 1e9}}, "finite"),
        ({"music": {"file": "a", "times": [1, 0], "bpm": 1, "seconds": 1}}, "rise"),
        ({"music": {"file": "a", "times": [0, 1], "bpm": 1, "seconds": 1, "pace": 3}}, "pace"),
        ({"places": {}}, "same joints"),
        ({"turns": 3}, "posing.json"),
    ],
)
def test_what_is_wrong_in_a_file_is_refused_in_a_sentence(tmp_path, kept, change, must):
    path = tmp_path / "a.posing.json"
    stance.write_stance(kept[0], path)
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(InputError, match=must):
        stance.read_stance(path)


def test_a_pose_of_other_joints_is_refused(kept):
    other = Skeleton(("a", "b"), (-1, 0), np.array([[0.0, 0, 0], [0, 1, 0]]))
    with pytest.raises(InputError, match="figure's own joints"):
        stance.pose_of(kept[0], other)
