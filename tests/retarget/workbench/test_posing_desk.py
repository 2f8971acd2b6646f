"""The posing desk without a screen: drags, pins, postures, beats, and rubber beside what was captured."""

import numpy as np
import pytest

from mocap.posing.choreography import read_dance
from mocap.posing.postures import read_pool
from mocap.skeletons.bvh import read_bvh, write_bvh
from mocap.skeletons.skeleton import Skeleton, SkeletonMotion
from retarget.workbench.session import Session


@pytest.fixture
def session(tmp_path):
    opened = Session(tmp_path)
    opened.act({"do": "posing.begin", "who": "human"})
    yield opened
    opened.close()


@pytest.fixture
def kick(tmp_path):
    """A kick as a BVH file, from formulas."""
    from fixtures import skeletons

    figure = skeletons.kick(2.0, 30.0)
    skeleton = Skeleton(figure.names, figure.parents, np.array(figure.offsets, float))
    write_bvh(SkeletonMotion(skeleton, figure.translation, figure.rotation, 30.0), tmp_path / "kick.bvh")
    opened = Session(tmp_path, "kick.bvh")
    yield opened
    opened.close()


def joint(session, name):
    return session.state.figure.skeleton.names.index(name)


def places(session):
    return session.state.figure.pose.positions


def seen(session, look, **fields):
    (event,) = session.act({"look": f"posing.{look}", **fields})
    assert event["kind"] == "seen", event
    return np.frombuffer(event["data"], "<f4").reshape(event["shape"]), event


def test_a_dragged_joint_goes_along_pinned_ones_stay_and_one_undo_takes_the_drag_back(session, hop):
    before, hand, foot = places(session), joint(session, "RightHand"), joint(session, "LeftFoot")
    hop.done(session, "posing.pin", joint=foot)
    for n in range(1, 5):
        to = before[hand] + np.array([-0.05, 0.1, 0.1]) * n
        hop.done(session, "posing.drag", joint=hand, to=to.tolist(), gesture="g")
    assert np.abs(places(session)[hand] - to).max() < 2e-3
    assert np.abs(places(session)[foot] - before[foot]).max() < 1e-6
    hop.done(session, "undo")
    assert (places(session) == before).all() and session.state.figure.pinned == (foot,)


def test_a_posture_goes_by_its_extent_and_none_of_it_is_rest(session, hop):
    rest, head = places(session), joint(session, "Head")
    down = []
    for extent in (0.5, 1.0, 0.0):
        hop.done(session, "posing.mix", posture="bow", extent=extent)
        down.append(rest[head, 1] - places(session)[head, 1])
    assert 0 < down[0] < down[1] and down[2] == pytest.approx(0, abs=1e-9)


def test_a_kept_pose_is_a_posture_that_gives_the_pose_again_and_is_saved(session, hop):
    hand = joint(session, "LeftHand")
    hop.done(session, "posing.drag", joint=hand, to=(places(session)[hand] + [0.1, 0.4, 0.2]).tolist())
    posed = places(session)
    hop.done(session, "posing.keep", name="hello")
    hop.done(session, "posing.stand")
    assert np.abs(places(session) - posed).max() > 0.1
    hop.done(session, "posing.mix", posture="hello", extent=1.0)

    def apart(points):
        return np.linalg.norm(points[:, None] - points, axis=-1)

    assert np.allclose(apart(places(session)), apart(posed), atol=1e-6)  # where it is and heads is no posture's
    assert "hello" in read_pool(session.state.folder / "human.postures.json").names()


def test_postures_on_beats_are_danced_on_their_beats_and_saved(session, hop):
    hop.done(session, "posing.put", posture="arms up", beat=2.0)
    hop.done(session, "posing.put", posture="crouch", beat=6.0)
    hop.done(session, "posing.move", step=1, beat=5.0)
    (phrase,) = read_dance(session.state.folder / "human.dance.toml").phrases
    assert [(step.beat, step.posture) for step in phrase.steps] == [(2.0, "arms up"), (5.0, "crouch")]
    motion, said = seen(session, "danced", bpm=120.0)
    assert len(motion) == 8 * 12 and said["fps"] == 24
    hands, hips = motion[:, joint(session, "LeftHand"), 1], motion[:, joint(session, "Hips"), 1]
    assert hands[24] > hands.min() + 0.9 * np.ptp(hands) and hips[60] < hips.min() + 0.1 * np.ptp(hips)
    soft, _ = seen(session, "danced", bpm=120.0, wild=1.0, damping=0.2)
    assert soft.shape == motion.shape and np.abs(soft - motion).max() > 0.01
    hop.done(session, "posing.drop", step=0)
    assert len(session.state.figure.dance.phrases[0].steps) == 1


def test_rubber_of_a_clip_goes_further_the_more_of_it_is_asked(kick):
    captured, _ = seen(kick, "clip")
    spans = []
    for omega in (1.0, 3.0):
        made, said = seen(kick, "rubber", omega=omega, follow=0.0)
        assert len(made) == len(captured) and len(said["parents"]) == made.shape[1]
        spans.append(np.ptp(made, axis=0).max())
    assert spans[1] > 1.2 * spans[0]


def test_what_is_exported_is_a_file_that_a_reader_reads(kick, hop):
    hop.done(kick, "posing.put", posture="arms up", beat=1.0)
    hop.done(kick, "posing.save_pose")
    assert len(read_bvh(kick.state.folder / "kick.pose.bvh")) == 1
    for what, sliders in (("dance", {"bpm": 100.0}), ("rubber", {"omega": 2.0})):
        heard = []
        stop = kick.listen(heard.append)
        assert kick.act({"work": "posing.export", "what": what, "sliders": sliders})[-1]["kind"] == "done"
        hop.finished(kick)
        stop()
        ended = next(event for event in heard if event["kind"] == "ended")
        assert ended["made"] and f"kick.{what}.bvh" in ended["sentence"], ended
        assert len(read_bvh(kick.state.folder / f"kick.{what}.bvh")) > 10


@pytest.mark.parametrize(
    ("message", "must"),
    [
        ({"do": "posing.drag", "joint": 99, "to": [0, 0, 0]}, "no joint 99"),
        ({"do": "posing.drag", "joint": 1, "to": [0, 0, 1e9]}, "1e6"),
        ({"do": "posing.mix", "posture": "none", "extent": 1.0}, "must be one of"),
        ({"do": "posing.keep", "name": "x"}, "drag something first"),
        ({"do": "posing.take", "frame": 1}, "open a .bvh"),
        ({"look": "posing.rubber"}, "open a .bvh"),
        ({"look": "posing.danced"}, "put one there"),
        ({"work": "posing.export", "what": "dance", "sliders": {"rm": 1.0}}, "sliders"),
    ],
)
def test_what_cannot_be_is_refused_in_a_sentence(session, hop, message, must):
    assert must in hop.refused(session, message).replace("1000000.0", "1e6")
